"""The systems of the time-step benchmark: from stiff filaments of long segments to chains with free joints."""

from dataclasses import dataclass

from openmm import unit

from openmm_cylchain import DSDNA, F_ACTIN, MICROTUBULE
from openmm_cylchain.filaments.filament_type import FilamentType
from openmm_cylchain.units.quantities import BOLTZMANN, VISCOSITY, in_units_of

from . import systems

_VISCOSITY = in_units_of(systems.VISCOSITY, VISCOSITY, "viscosity")
STRETCHING_MODULUS = F_ACTIN.segment_stiffness * F_ACTIN.segment_length


@dataclass(frozen=True)
class BenchmarkSystem:
    """Filaments of one kind.

    Attributes
    ----------
    name : str
        For rows.
    label : str
        For people.
    type : FilamentType
    segments, chains : int
    temperature, viscosity : float
        In K and kJ ps/(mol nm^3).
    """

    name: str
    label: str
    type: FilamentType
    segments: int
    chains: int
    temperature: float = systems.TEMPERATURE
    viscosity: float = _VISCOSITY


def actin(length):
    """F-actin in segments of a length in nm, with the stretching modulus of the paper's."""
    return FilamentType(
        name=f"A{length:g}",
        diameter=F_ACTIN.diameter,
        segment_length=length,
        bending_rigidity=F_ACTIN.bending_rigidity,
        stretching_modulus=STRETCHING_MODULUS,
    )


def _freely_jointed():
    length = 100.0
    stiffness = 400.0 * BOLTZMANN * systems.TEMPERATURE / length**2
    return FilamentType(
        name="FJC", diameter=5.0, segment_length=length, bending_rigidity=0.0, stretching_stiffness=stiffness
    )


F_ACTIN_SYSTEM = BenchmarkSystem("f_actin", "F-actin, 64 × 360 nm (Table 2)", F_ACTIN, 64, 200)

WORKLOAD = BenchmarkSystem(
    "cytosim_workload",
    "F-actin, 64 × 360 nm, 4.14 pN nm, 1 mPa s",
    F_ACTIN,
    64,
    200,
    temperature=(4.14 * unit.piconewton * unit.nanometer / unit.BOLTZMANN_CONSTANT_kB).value_in_unit(unit.kelvin),
    viscosity=_VISCOSITY / 1.71,
)
"""The workload on which other simulators of filaments were compared."""

SYSTEMS = (
    F_ACTIN_SYSTEM,
    BenchmarkSystem("f_actin_60nm", "F-actin, 32 × 60 nm", actin(60.0), 32, 120),
    BenchmarkSystem("f_actin_20nm", "F-actin, 32 × 20 nm", actin(20.0), 32, 120),
    BenchmarkSystem("dna_8nm", "DNA, 16 × 8 nm", DSDNA.with_segment_length(8.0), 16, 240),
    BenchmarkSystem("microtubule", "microtubule, 16 segments", MICROTUBULE, 16, 240),
    BenchmarkSystem("freely_jointed", "free joints, 16 × 100 nm", _freely_jointed(), 16, 240),
)
