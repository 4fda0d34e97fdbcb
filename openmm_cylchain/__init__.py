"""Filaments for OpenMM: Brownian dynamics of extensible cylinder chains."""

from .dynamics.time_step import TimeStep, recommended_time_step
from .errors import (
    ContactWarning,
    EquilibrationWarning,
    InputError,
    InstabilityError,
    TimeStepError,
    TimeStepWarning,
)
from .filaments.collection import Filament
from .filaments.filament_type import DSDNA, F_ACTIN, MICROTUBULE, FilamentType
from .mechanics.flow import Flow
from .mechanics.friction import EndCorrections, SegmentFriction, stokes_friction
from .systems.filaments import Filaments
from .systems.step_check import check_time_step
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
