"""What is reproduced of Chandran and Mofrad, Phys. Rev. E 2009, 79, 011906."""

from . import cantilevers, chromosome, rod_diffusion, thin_film

TITLE = "Chandran and Mofrad, Phys. Rev. E 2009, 79, 011906, reproduced"
CITATION = (
    "P. L. Chandran and M. R. K. Mofrad, *Rods-on-string idealization captures semiflexible filament dynamics*, "
    "Phys. Rev. E 2009, 79, 011906, doi:10.1103/PhysRevE.79.011906"
)
_MODULES = (rod_diffusion, cantilevers, chromosome, thin_film)
CASES = tuple(case for module in _MODULES for case in module.CASES)
