"""A configuration with every kind of table, and the filaments of one."""

from openmm_cylchain.runs.initial_state import place_filaments

EVERYTHING = """
title = "everything"
[solvent]
temperature = "310 K"
viscosity = "10 mPa*s"
[box]
edges = ["2 um", "2 um", "2 um"]
[flow]
shear = "1 1/s"
[[filament]]
type = "F_ACTIN"
segment_length = "100 nm"
segments = [4, 6, 8]
count = 6
inside = { shape = "cylinder", radius = "300 nm", length = "1.8 um", point = ["1 um", "1 um", "1 um"] }
direction = [1, 0, 0]
orientation = "nematic"
[[filament]]
type = "F_ACTIN"
segment_length = "100 nm"
segments = 12
closed = true
normal = [0, 1, 0]
contacts = false
[[filament]]
name = "OWN"
diameter = "7 nm"
segment_length = "100 nm"
persistence_length = "9 um"
stretching_modulus = "20 nN"
segments = 5
planar = true
height = "500 nm"
count = 2
propulsion = "0.01 pN"
contact_diameter = "12 nm"
[[particles]]
name = "COL"
diameter = "50 nm"
count = 3
[[linkers]]
type = "ALPHA_ACTININ"
hand = { reach = "60 nm" }
count = 20
volume = "8 um^3"
bound = 10
[[link]]
within = "300 nm"
stiffness = "0.01 pN/nm"
count = 4
[[link]]
between = [{ filament = 0, arc_length = "100 nm" }, { point = ["1 um", "1 um", "1 um"] }]
stiffness = "0.001 pN/nm"
rest_length = "20 nm"
[[barrier]]
filament = 0
arc_lengths = ["150 nm", "300 nm"]
toward = "plus"
release_rate = "10 1/s"
[[tether]]
table = 1
node = 0
stiffness = "0.001 pN/nm"
[[tether]]
filament = 1
node = -1
stiffness = "0.001 pN/nm"
velocity = ["1 um/s", "0 um/s", "0 um/s"]
start_time = "1 ms"
[[pull]]
filament = [1, 2]
tension = "0.1 pN"
[[pull]]
filament = 0
node = -1
force = ["0.1 pN", "0 pN", "0 pN"]
[contacts]
diameter = "15 nm"
[[wall]]
shape = "sphere"
center = ["1 um", "1 um", "1 um"]
radius = "1.5 um"
stiffness = "0.01 pN/nm"
[simulation]
scheme = "implicit"
time_step = "10 us"
duration = "2 ms"
report_interval = "0.1 ms"
checkpoint_interval = "0.3 ms"
seed = 2
platform = "CPU"
threads = 1
checks = false
"""
"""A small run, which takes a second."""

BEAMS = """
title = "beams"
[solvent]
temperature = "310 K"
viscosity = "1.71 mPa*s"
[[filament]]
name = "BEAM"
element = "beam"
diameter = "8 nm"
segment_length = "1 um"
persistence_length = "5 um"
stretching_modulus = "10 nN"
friction_length = "filament"
segments = 3
count = 2
[[filament]]
type = "F_ACTIN"
element = "beam"
friction_length = "filament"
segment_length = "1 um"
nodes = [["0 um", "4 um", "1 um"], ["0.95 um", "4.2 um", "1 um"], ["1.9 um", "4 um", "1 um"]]
tangents = [[1, 0.5, 0], [1, 0, 0], [1, -0.5, 0]]
clamped = [0, -1]
clamped_tangents = [0]
[[filament]]
type = "F_ACTIN"
nodes = [["0 um", "6 um", "0 um"], ["360 nm", "6 um", "0 um"], ["720 nm", "6 um", "0 um"]]
planar = true
[[filament]]
name = "FLAT"
element = "beam"
diameter = "8 nm"
segment_length = "500 nm"
bending_rigidity = "7e-26 N*m^2"
stretching_modulus = "10 nN"
friction_length = "filament"
segments = [2, 3]
count = 2
planar = true
height = "200 nm"
inside = { shape = "sphere", radius = "3 um" }
[[link]]
between = [{ filament = 0, arc_length = "1.25 um" }, { filament = 1, node = -1 }]
stiffness = "0.001 pN/nm"
[[joint]]
between = [{ filament = 0, node = 1 }, { direction = [0, 1, 0] }]
stiffness = "1 kJ/mol"
angle = "120 deg"
[simulation]
time_step = "20 us"
duration = "2.4 ms"
report_interval = "40 us"
checkpoint_interval = "120 us"
seed = 5
"""
"""Filaments of beam elements, beside one of straight segments: clamped, linked, joined, planar, of given nodes."""


GROWING = """
title = "growing"
[solvent]
temperature = "298 K"
viscosity = "1 mPa*s"
[[monomers]]
type = "ACTIN_ATP"
concentration = "50 uM"
volume = "box"
[[monomers]]
name = "slow"
length = "3 nm"
plus_on_rate = "5 1/(uM*s)"
plus_off_rate = "60 1/s"
concentration = "2 uM"
[[filament]]
type = "F_ACTIN"
segment_length = "108 nm"
segments = [4, 5]
count = 5
growth = { monomers = "ACTIN_ATP", longest = "700 nm", shortest = "300 nm" }
inside = { shape = "sphere", radius = "0.5 um" }
[[filament]]
type = "F_ACTIN"
segment_length = "60 nm"
segments = 6
growth = { monomers = "slow", longest = "1 um", minus_capped = true }
clamped = [0]
planar = true
position = ["0 nm", "0 nm", "100 nm"]
[[filament]]
type = "MICROTUBULE"
segment_length = "200 nm"
segments = 3
position = ["0 nm", "0 nm", "0 nm"]
[[linkers]]
type = "MYOSIN_II"
count = 200
bound = 50
diffusion = "1 um^2/s"
[contacts]
diameter = "10 nm"
[[wall]]
shape = "sphere"
radius = "0.8 um"
stiffness = "0.1 pN/nm"
[simulation]
time_step = "0.1 ms"
duration = "100 ms"
report_interval = "5 ms"
checkpoint_interval = "15 ms"
seed = 2
platform = "CPU"
threads = 1
checks = false
"""
"""Filaments that grow of monomers of two kinds, one of which becomes less, beside one that does not, with linkers."""

COMING_AND_GOING = """
title = "coming and going"
[solvent]
temperature = "298 K"
viscosity = "10 mPa*s"
[[monomers]]
type = "ACTIN_AGING"
concentration = "50 uM"
volume = "4 um^3"
[[monomers]]
name = "rings"
length = "8 nm"
plus_on_rate = "5 1/(uM*s)"
concentration = "20 uM"
[[monomers]]
name = "own"
length = "2.7 nm"
plus_on_rate = "5 1/(uM*s)"
plus_off_rate = "400 1/s"
aging = [{ name = "old", rate = "20 1/s", plus_off_rate = "800 1/s" }]
concentration = "50 uM"
[[filament]]
type = "F_ACTIN"
segment_length = "108 nm"
segments = [6, 9]
count = 6
inside = { shape = "sphere", radius = "0.8 um" }
reserve = 20
[filament.growth]
monomers = "ACTIN_AGING"
longest = "1.2 um"
minus_capped = true
vanishes = true
severing_rate = "20 1/(um*s)"
severing_states = ["ADP", "ADP-Pi"]
[[filament]]
type = "MICROTUBULE"
segment_length = "200 nm"
segments = 2
count = 2
inside = { shape = "sphere", radius = "0.8 um" }
[filament.growth]
monomers = "rings"
longest = "1 um"
shortest = "100 nm"
minus_capped = true
vanishes = true
hydrolysis_rate = "20 1/s"
shrinking_off_rate = "200 1/s"
[[nucleation]]
table = 2
count = 20
rate = "50 1/(um^3*s)"
inside = { shape = "box", lower = ["-0.5 um", "-0.5 um", "-0.5 um"], upper = ["0.5 um", "0.5 um", "0.5 um"] }
length = "200 nm"
direction = [1, 0, 0]
[[nucleation]]
name = "MINE"
diameter = "7 nm"
segment_length = "108 nm"
persistence_length = "9 um"
stretching_modulus = "20 nN"
growth = { monomers = "own", longest = "1 um", vanishes = true }
planar = true
count = 10
total_rate = "50 1/s"
order = 2
inside = { shape = "sphere", radius = "0.5 um" }
[[branching]]
table = 1
count = 10
rate = "20 1/(um*s)"
mothers = [1]
debranching_rate = "2 1/s"
debranching_force = "50 pN"
[[linkers]]
type = "ALPHA_ACTININ"
hand = { reach = "60 nm", binds_to = "ACT", severing_rate = "0.1 1/s" }
count = 20
diffusion = "0.1 um^2/s"
inside = { shape = "cylinder", radius = "500 nm", length = "1 um" }
[[wall]]
shape = "sphere"
radius = "1 um"
stiffness = "0.1 pN/nm"
[contacts]
diameter = "7 nm"
[simulation]
time_step = "0.1 ms"
duration = "100 ms"
report_interval = "5 ms"
checkpoint_interval = "15 ms"
seed = 2
platform = "CPU"
threads = 1
checks = false
"""
"""Filaments that begin, vanish, are cut and branch, of monomers that age and with caps; it takes two seconds."""


ENDS = """
title = "ends"
[solvent]
temperature = "298 K"
viscosity = "10 mPa*s"
[[monomers]]
type = "ACTIN_ATP"
concentration = "50 uM"
[[monomers]]
name = "rings"
length = "8 nm"
plus_on_rate = "5 1/(uM*s)"
minus_on_rate = "2 1/(uM*s)"
concentration = "20 uM"
[[filament]]
type = "F_ACTIN"
segment_length = "108 nm"
segments = 4
count = 6
inside = { shape = "sphere", radius = "0.4 um" }
[filament.growth]
monomers = "ACTIN_ATP"
longest = "1 um"
minus_capped = true
plus_states = [
    { name = "free", switch_rates = { "in pause" = "60 1/s" }, blocked_switch_rates = { "in pause" = "99 1/s" } },
    { name = "with formin", on_rate = "3 1/(uM*s)", off_rate = "0.4 1/s", shortest_switch_rates = { free = "9 1/s" } },
    { name = "in pause", on_rate = "0 1/(uM*s)", off_rate = "0 1/s", switch_rates = { free = "30 1/s" } },
]
[[filament]]
type = "MICROTUBULE"
segment_length = "160 nm"
segments = 3
count = 4
inside = { shape = "sphere", radius = "0.4 um" }
[filament.growth]
monomers = "rings"
longest = "1.2 um"
shortest = "100 nm"
minus_catastrophe_rate = "10 1/s"
minus_rescue_rate = "20 1/s"
minus_shrinking_off_rate = "50 1/s"
minus_shrinking_on_rate = "0.1 1/(uM*s)"
minus_blocked_catastrophe_rate = "30 1/s"
minus_renucleation_rate = "40 1/s"
[[filament]]
type = "MICROTUBULE"
segment_length = "160 nm"
segments = 3
position = ["0 nm", "0 nm", "300 nm"]
[filament.growth]
monomers = "rings"
longest = "1.2 um"
plus_capped = true
minus_states = [
    { name = "odd", after_gain = "even", after_loss = "even", off_rate = "10 1/s" },
    { name = "even", after_gain = "odd", after_loss = "odd", off_rate = "10 1/s" },
]
[[linkers]]
name = "formin"
stiffness = "0.1 pN/nm"
rest_length = "40 nm"
concentration = "10 uM"
[[linkers.hands]]
binding_rate = "100 1/s"
reach = "50 nm"
unbinding_rate = "5 1/s"
binds_to = "F_ACTIN"
filament_end = { end = "plus", range = "20 nm", binds_there = true, tracks = true, changes = ["free", "with formin"] }
[[linkers.hands]]
binding_rate = "0 1/s"
reach = "50 nm"
unbinding_rate = "0 1/s"
[[linkers]]
type = "KINESIN_13"
concentration = "0.2 uM"
[[tether]]
table = 1
node = 0
stiffness = "0.5 pN/nm"
[simulation]
time_step = "0.1 ms"
duration = "100 ms"
report_interval = "5 ms"
checkpoint_interval = "15 ms"
seed = 2
platform = "CPU"
threads = 1
checks = false
"""
"""Ends with states of one's own, minus ends that turn, formins at ends, and tethers of capped ends."""


def placed_filaments(configuration):
    """Filaments with their initial positions, and linkers, that a run of a configuration has."""
    settings = configuration.simulation
    return place_filaments(configuration, settings.engine, settings.seed)


BODIES = """
title = "bodies"
[solvent]
temperature = "300 K"
viscosity = "0.01 Pa*s"
[[filament]]
type = "MICROTUBULE"
segment_length = "250 nm"
segments = [4, 6]
count = 8
[[filament]]
type = "MICROTUBULE"
segment_length = "240 nm"
segments = 4
count = 4
growth = { monomers = "tubulin", longest = "2 um", minus_capped = true }
[[filament]]
type = "F_ACTIN"
segment_length = "100 nm"
segments = 4
inside = { shape = "sphere", radius = "1 um" }
[[monomers]]
name = "tubulin"
length = "8 nm"
concentration = "10 uM"
plus_on_rate = "100 1/(uM*s)"
[[body]]
name = "POLE"
radius = "200 nm"
positions = [["-1 um", "0 um", "0 um"], ["1 um", "0 um", "0 um"]]
filaments = { table = 1, stiffness = "1 pN/nm", arm_stiffness = "0.5 pN/nm" }
[[body]]
name = "MTOC"
radius = "100 nm"
positions = [["0 um", "3 um", "0 um"]]
direction = [0, 1, 0]
filaments = { table = 2, stiffness = "1 pN/nm", arm_stiffness = "0.5 pN/nm", arm = "300 nm" }
[[body]]
name = "CARGO"
points = [["0 nm", "0 nm", "0 nm"], ["150 nm", "0 nm", "0 nm"], ["0 nm", "150 nm", "0 nm"]]
radii = ["100 nm", "60 nm", "0 nm"]
count = 2
inside = { shape = "sphere", radius = "3 um" }
[[linkers]]
type = "KINESIN_1"
anchors = { body_table = 3, body_points = [2, 2, 0] }
[[link]]
between = [{ body = 3, body_point = 2 }, { filament = 12, node = 0 }]
stiffness = "0.1 pN/nm"
rest_length = "0 nm"
[[link]]
between = [{ body = 4 }, { point = ["0 um", "-3 um", "0 um"] }]
stiffness = "0.1 pN/nm"
rest_length = "0 nm"
[contacts]
diameter = "25 nm"
[[wall]]
shape = "sphere"
radius = "6 um"
stiffness = "0.1 pN/nm"
[simulation]
time_step = "0.5 us"
duration = "0.2 ms"
report_interval = "10 us"
checkpoint_interval = "40 us"
platform = "CPU"
seed = 3
"""
