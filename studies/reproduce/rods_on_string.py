"""Table II of Chandran and Mofrad, Phys. Rev. E 2009, 79, 011906, twice: for the theory and for what is simulated.

The two are apart so that the one can be wrong without the other.
"""

from dataclasses import dataclass

from openmm import unit

from openmm_cylchain import EndCorrections, Filaments, FilamentType
from openmm_cylchain.units.quantities import BENDING_RIGIDITY, VISCOSITY, in_units_of, thermal_energy

SECOND = 1e12
"""In ps."""
MICROMETER = 1e3
"""In nm."""


@dataclass(frozen=True)
class Column:
    """A column of Table II.

    The friction is that of the paper: of slender rods without end corrections, with the logarithm of the whole
    filament. The paper's filaments are inextensible; the lengths of these segments fluctuate by less than 0.5 %.

    Attributes
    ----------
    name : str
    diameter : float
        In nm.
    bending_rigidity : Quantity
        EI.
    stretching_modulus : Quantity
        EA.
    viscosity : Quantity
    temperature : float
        In K.
    """

    name: str
    diameter: float
    bending_rigidity: unit.Quantity
    stretching_modulus: unit.Quantity
    viscosity: unit.Quantity
    temperature: float

    @property
    def rigidity(self):
        """EI in kJ nm/mol."""
        return in_units_of(self.bending_rigidity, BENDING_RIGIDITY, "bending_rigidity")

    @property
    def thermal_energy(self):
        """k_B T in kJ/mol."""
        return thermal_energy(self.temperature)

    @property
    def persistence_length(self):
        """EI/(k_B T), eq. (3), in nm."""
        return self.rigidity / self.thermal_energy

    def filament_type(self, segment_length, **changes):
        """The FilamentType with segments of a length in nm; changes are attributes of it."""
        options = {
            "name": self.name,
            "diameter": self.diameter,
            "segment_length": segment_length,
            "bending_rigidity": self.rigidity,
            "stretching_modulus": self.stretching_modulus,
            "end_corrections": EndCorrections(0.0, 0.0, 0.0),
            "friction_length": "filament",
        }
        return FilamentType(**{**options, **changes})

    def friction(self, segment_length, segments, viscosity_factor=1.0, **changes):
        """Friction of a segment in a filament of so many."""
        viscosity = viscosity_factor * in_units_of(self.viscosity, VISCOSITY, "viscosity")
        return self.filament_type(segment_length, **changes).segment_friction(viscosity, self.temperature, segments)

    def solvent(self, viscosity_factor=1.0, temperature=None):
        """A Filaments in the solvent, at another temperature in K if one is given."""
        temperature = self.temperature if temperature is None else temperature
        return Filaments(viscosity_factor * self.viscosity, temperature, engine="compiled")


def _columns():
    rigidity, force, viscosity = unit.newton * unit.meter**2, unit.newton, unit.pascal * unit.second
    return (
        # The rigidity is arbitrarily large in the paper. This one makes l_p/L 5e4 at least.
        Column("ROD", 80.0, 1e-21 * rigidity, 2.5e-8 * force, 1e-3 * viscosity, 293.15),
        Column("CHR", 800.0, 5.523e-23 * rigidity, 1.4e-9 * force, 0.89e-3 * viscosity, 298.15),
        Column("ACT", 8.0, 7.3e-26 * rigidity, 1.8e-8 * force, 0.89e-3 * viscosity, 298.15),
    )


ROD, CHROMOSOME, ACTIN = _columns()
SIMULATED_ROD, SIMULATED_CHROMOSOME, SIMULATED_ACTIN = _columns()
