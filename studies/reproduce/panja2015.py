"""What is reproduced of Panja, Barkema and van Leeuwen, Phys. Rev. E 2015, 92, 032603."""

from . import coarse_graining, explicit_steps, largest_steps, mode_coupling, simulated_time, tumbling

TITLE = "Panja, Barkema and van Leeuwen, Phys. Rev. E 2015, 92, 032603, reproduced"
CITATION = (
    "D. Panja, G. T. Barkema and J. M. J. van Leeuwen, *Efficient simulation of semiflexible polymers*, "
    "Phys. Rev. E 2015, 92, 032603, doi:10.1103/PhysRevE.92.032603"
)
_MODULES = (mode_coupling, largest_steps, simulated_time, explicit_steps, coarse_graining, tumbling)
CASES = tuple(case for module in _MODULES for case in module.CASES)
