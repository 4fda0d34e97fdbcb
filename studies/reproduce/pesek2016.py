"""What is reproduced of Pesek et al., Soft Matter 2016, 12, 3360."""

from . import bending_potentials, end_to_end, force_extension, free_segments, relaxation, speed, tables

TITLE = "Pešek et al., Soft Matter 2016, 12, 3360, reproduced"
CITATION = (
    "J. Pešek, P. Baerts, B. Smeets, C. Maes and H. Ramon, *Mathematical model suitable for efficient simulation of "
    "thin semi-flexible polymers in complex environments*, Soft Matter 2016, 12, 3360, doi:10.1039/c5sm03106k"
)
_MODULES = (tables, bending_potentials, speed, free_segments, end_to_end, force_extension, relaxation)
CASES = tuple(case for module in _MODULES for case in module.CASES)
