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
