"""A configuration with every kind of table."""

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
[[particles]]
name = "COL"
diameter = "50 nm"
count = 3
[[linkers]]
type = "ALPHA_ACTININ"
hand = { reach = "60 nm" }
count = 20
bound = 10
[[link]]
within = "300 nm"
stiffness = "0.01 pN/nm"
count = 4
[[link]]
between = [{ filament = 0, arc_length = "100 nm" }, { point = ["1 um", "1 um", "1 um"] }]
stiffness = "0.001 pN/nm"
rest_length = "20 nm"
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
