"""A run of DNA whose ends are wound in one stage, and held in the next."""

WOUND = """
title = "wound and held"
[solvent]
temperature = "298 K"
viscosity = "1 mPa s"
[[filament]]
type = "DSDNA"
segment_length = "5 nm"
twist_persistence_length = "100 nm"
count = 2
segments = 20
start = "straight"
direction = [0, 0, 1]
clamped = [0, 1]
[[end_frame]]
table = 1
end = "minus"
direction = [0, 0, 1]
[[end_frame]]
table = 1
end = "plus"
direction = [0, 0, 1]
angular_velocity = "3.141592653589793 1/us"
[[pull]]
table = 1
node = -1
force = ["0 pN", "0 pN", "40 pN"]
[[pull]]
table = 1
node = -2
force = ["0 pN", "0 pN", "-30 pN"]
[simulation]
time_step = "1 ns"
report_interval = "0.05 us"
checkpoint_interval = "0.5 us"
seed = 3
[[stage]]
name = "winding"
duration = "1 us"
[[stage]]
name = "held"
duration = "1 us"
[stage.end_frame.2]
angular_velocity = "0 1/us"
"""
