"""A platform of OpenMM with its precision. Importing this creates no Context, which OpenMM may write a warning of."""

from dataclasses import dataclass

import openmm_cylchain
from openmm_cylchain.engines.gpu_platforms import GPU_PLATFORMS


@dataclass(frozen=True)
class CompiledPlatform:
    """A platform on which the compiled engine is tested, for ``new_context``.

    Attributes
    ----------
    name : str
    precision : {"single", "mixed", "double"} or None
        None where there is no choice.
    tolerance : float
        By which share of the largest one forces, energies and displacements may differ from those of the Reference
        platform.
    rounding : float
        In nm, by which stored positions are rounded that are less than 2048 nm from the origin.
    path_tolerance : float
        In nm, by which such positions may differ after up to 100 steps with noise.
    """

    name: str
    precision: str | None
    tolerance: float
    rounding: float
    path_tolerance: float

    def __str__(self):
        return self.name if self.precision is None else f"{self.name}-{self.precision}"

    @property
    def properties(self):
        """Of a Context."""
        return {} if self.precision is None else {"Precision": self.precision}

    def enable(self):
        """Load the plugin of a platform for GPUs."""
        if self.name in GPU_PLATFORMS:
            openmm_cylchain.enable_platform(self.name)
