"""Runs of several stages, which take a second."""

from .configurations import COMING_AND_GOING
from .small_runs import NETWORK


def divided(text, parts=2):
    """A configuration in equal stages, which change nothing."""
    begin = text.index('duration = "')
    line = text[begin : text.index("\n", begin)]
    number, unit = line.split('"')[1].split()
    stages = [f'[[stage]]\nduration = "{float(number) / parts:.12g} {unit}"\n' for _ in range(parts)]
    return text.replace(line, "").rstrip() + "\n" + "".join(stages)


DIFFUSING = """[[linkers]]
diffusion = "1 um^2/s"
inside = { shape = "box", lower = ["-1 um", "-1 um", "-1 um"], upper = ["2 um", "2 um", "2 um"] }"""
"""Linkers that diffuse by themselves."""

MANY_CHANGES = (
    NETWORK.replace('duration = "1 ms"\n', "checks = false\n")
    .replace('report_interval = "0.1 ms"', 'report_interval = "50 us"')
    .replace("[[linkers]]", DIFFUSING, 1)
    .replace("bound = 40", 'volume = "0.08 um^3"\nbound = 40')
    + """
checkpoint_interval = "50 us"
[[link]]
between = [{ filament = 0, node = 0 }, { filament = 1, node = 0 }]
stiffness = "0.01 pN/nm"
active = false
[[wall]]
shape = "box"
lower = ["-0.5 um", "-0.5 um", "-0.5 um"]
upper = ["1 um", "1 um", "1 um"]
stiffness = "0.1 pN/nm"
active = false
[[tether]]
filament = 2
node = 0
stiffness = "0.01 pN/nm"
velocity = ["100 um/s", "0 um/s", "0 um/s"]
[[stage]]
name = "start"
duration = "0.2 ms"
[[stage]]
name = "drug"
duration = "0.2 ms"
[stage.linkers.motor]
hand.speed = "0 um/s"
count = 25
[stage.linkers.1]
count = 80
bound = 10
[stage.simulation]
time_step = "2.5 us"
report_interval = "25 us"
checkpoint_interval = "50 us"
[stage.link]
active = true
rest_length = "50 nm"
[stage.tether]
velocity = ["0 um/s", "0 um/s", "0 um/s"]
[[stage]]
name = "cycle"
repeat = 2
[[stage.stage]]
name = "hot"
duration = "0.1 ms"
solvent.temperature = "310 K"
tether.velocity = ["0 um/s", "50 um/s", "0 um/s"]
[[stage.stage]]
name = "squeeze"
duration = "0.1 ms"
pieces = 2
solvent.temperature = "298.15 K"
[stage.stage.wall]
active = true
upper = { from = ["1 um", "1 um", "1 um"], to = ["0.6 um", "1 um", "1 um"] }
"""
)
"""A network with a drug, a wall that closes, a trap that moves, linkers that come and go, and two cycles of heat."""

GROWING = (
    divided(COMING_AND_GOING, 4)
    + """
[stage.monomers]
concentration = "0 uM"
"""
)
"""Filaments that grow, of which monomers are taken away in the last stage."""

DELETING = """
[solvent]
temperature = "300 K"
viscosity = "1 mPa*s"
[[filament]]
name = "ROD"
diameter = "10 nm"
segment_length = "100 nm"
persistence_length = "10 um"
stretching_modulus = "1 nN"
segments = 4
count = 40
inside = { shape = "sphere", radius = "0.6 um" }
[[link]]
within = "60 nm"
count = 20
stiffness = "0.1 pN/nm"
[[linkers]]
name = "glue"
stiffness = "0.1 pN/nm"
rest_length = "20 nm"
hand = { binding_rate = "1e5 1/s", reach = "60 nm", unbinding_rate = "100 1/s" }
count = 60
volume = "0.1 um^3"
[[wall]]
shape = "sphere"
radius = "0.61 um"
stiffness = "0.1 pN/nm"
[contacts]
diameter = "20 nm"
[simulation]
time_step = "0.5 us"
report_interval = "50 us"
checkpoint_interval = "50 us"
seed = 4
checks = false
[[stage]]
duration = "0.1 ms"
[[stage]]
name = "one side"
duration = "0.1 ms"
filament.ROD.delete = { inside = { shape = "sphere", center = ["0.5 um", "0 um", "0 um"], radius = "0.5 um" } }
[[stage]]
name = "thinned"
repeat = 2
[[stage.stage]]
duration = "0.1 ms"
filament.ROD.delete = { count = 5 }
"""
"""Filaments in a cell that links and linkers join, of which some go: those on one side, and twice five others."""

DELETING_GROWN = """
[solvent]
temperature = "300 K"
viscosity = "1 mPa*s"
[[monomers]]
name = "unit"
length = "5 nm"
plus_on_rate = "400 1/(uM*s)"
plus_off_rate = "300 1/s"
concentration = "6 uM"
volume = "2 um^3"
[[filament]]
name = "GROWS"
diameter = "10 nm"
segment_length = "100 nm"
persistence_length = "10 um"
stretching_modulus = "1 nN"
segments = 4
count = 20
inside = { shape = "sphere", radius = "0.4 um" }
growth = { longest = "2 um", minus_capped = true, severing_rate = "0.5 1/(um*s)" }
reserve = 20
[[branching]]
table = 1
rate = "50 1/(um*s)"
count = 10
[[linkers]]
name = "glue"
stiffness = "0.1 pN/nm"
rest_length = "20 nm"
hand = { binding_rate = "1e5 1/s", reach = "60 nm", unbinding_rate = "1 1/s" }
count = 30
volume = "0.1 um^3"
[simulation]
time_step = "10 us"
report_interval = "2.5 ms"
checkpoint_interval = "2.5 ms"
seed = 4
checks = false
[[stage]]
duration = "20 ms"
[[stage]]
name = "fewer"
duration = "5 ms"
filament.GROWS.delete = { count = 15 }
[[stage]]
name = "middle"
duration = "5 ms"
filament.GROWS.delete = { outside = { shape = "sphere", radius = "0.4 um" } }
[[stage]]
name = "laser"
duration = "5 ms"
filament.GROWS.cut = [{ normal = [1, 0, 0] }, { point = ["0 nm", "50 nm", "0 nm"], normal = [0, 1, 0] }]
"""
"""Filaments that grow, branch and are cut, of which some go, then those far from the middle; and planes cut others."""
