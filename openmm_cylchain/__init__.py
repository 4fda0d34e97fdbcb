"""Filaments for OpenMM: Brownian dynamics of extensible cylinder chains."""

from .build import Filaments
from .collection import Filament
from .errors import (
    ContactWarning,
    EquilibrationWarning,
    InputError,
    InstabilityError,
    TimeStepError,
    TimeStepWarning,
)
from .filament import DSDNA, F_ACTIN, MICROTUBULE, FilamentType
from .flow import Flow
from .friction import EndCorrections, SegmentFriction, stokes_friction
from .step_check import check_time_step
from .timestep import TimeStep, recommended_time_step
from .version import __version__

__all__ = [
    "ContactWarning",
    "DSDNA",
    "EndCorrections",
    "EquilibrationWarning",
    "F_ACTIN",
    "Filament",
    "FilamentType",
    "Filaments",
    "Flow",
    "InputError",
    "InstabilityError",
    "MICROTUBULE",
    "SegmentFriction",
    "TimeStep",
    "TimeStepError",
    "TimeStepWarning",
    "__version__",
    "check_time_step",
    "recommended_time_step",
    "stokes_friction",
]
