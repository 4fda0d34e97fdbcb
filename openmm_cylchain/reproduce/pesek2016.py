"""What is reproduced of Pesek et al., Soft Matter 2016, 12, 3360."""

from . import bending_potentials, force_extension, free_segments, tables

TITLE = "Pešek et al., Soft Matter 2016, 12, 3360, reproduced"
CITATION = (
    "J. Pešek, P. Baerts, B. Smeets, C. Maes and H. Ramon, *Mathematical model suitable for efficient simulation of "
    "thin semi-flexible polymers in complex environments*, Soft Matter 2016, 12, 3360, doi:10.1039/c5sm03106k"
)
CASES = tuple(case for module in (tables, bending_potentials, free_segments, force_extension) for case in module.CASES)
