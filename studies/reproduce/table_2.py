"""Table 2 of Pesek et al., Soft Matter 2016, 12, 3360: what the theory is evaluated for."""

from dataclasses import replace

from openmm import unit

from openmm_cylchain import DSDNA, F_ACTIN
from openmm_cylchain.units.quantities import FORCE, STIFFNESS, VISCOSITY, in_units_of, thermal_energy

ACTIN = replace(F_ACTIN, temperature=None)
"""With the joints of the paper, l_p k_B T/l0; those of the preset are calibrated to l_p."""
DNA = replace(DSDNA, temperature=None)
"""That of the footnote on DNA, with the joints of the paper."""
SOLVENT_TEMPERATURE = 310.0
SOLVENT_VISCOSITY = in_units_of(1.71e-3 * unit.pascal * unit.second, VISCOSITY, "viscosity")
THERMAL_ENERGY = thermal_energy(SOLVENT_TEMPERATURE)
PERSISTENCE_LENGTH = ACTIN.persistence_length_at(SOLVENT_TEMPERATURE)

MICROSECOND = 1e6
"""In ps."""
MILLISECOND = 1e9
PICONEWTON = in_units_of(1.0 * unit.piconewton, FORCE, "force")
PICONEWTON_PER_NANOMETER = in_units_of(1.0 * unit.piconewton / unit.nanometer, STIFFNESS, "stiffness")


def actin_friction():
    """Friction of a segment of Table 2."""
    return ACTIN.segment_friction(SOLVENT_VISCOSITY, SOLVENT_TEMPERATURE)
