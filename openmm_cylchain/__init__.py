"""Filaments for OpenMM: Brownian dynamics of extensible cylinder chains.

All that users call is here and in the modules ``analysis``, ``theory`` and ``scans``; all others are private and may
change.
"""

import importlib
from types import ModuleType
from typing import TYPE_CHECKING

from .bead_spring.bead_spring_type import DSDNA_BASE_PAIRS, BeadSpringType
from .couplings.capsule_contacts import capsule_contact_force
from .couplings.contact_frames import find_contacts
from .couplings.contacts import add_exclusions, contact_force, crossing_barrier, excluded_pairs, share_exclusions
from .couplings.crosslink_tables import CrosslinkTable
from .couplings.crosslinks import Crosslinks
from .couplings.force_reporters import ContactForceReporter, WallForceReporter
from .couplings.joints import Joints
from .couplings.mean_forces import ContactForces, WallForces, contact_forces, wall_forces
from .couplings.pulling import ConstantVelocityPulling, change_constant_force, constant_force, constant_tension
from .couplings.shapes import Box, Capsule, Cylinder, Ellipsoid, Plane, Slab, Sphere, Torus, prism_faces
from .couplings.wall_points import random_points_on
from .couplings.walls import filament_wall_force, wall_force
from .engine_choice import prepare_openmm
from .engines.gpu_platforms import enable_platform
from .errors import (
    BoxWarning,
    ContactWarning,
    EngineWarning,
    EquilibrationWarning,
    InputError,
    InstabilityError,
    JointWarning,
    LinkerWarning,
    PrecisionWarning,
    SegmentLengthWarning,
    StageWarning,
    TimeStepError,
    TimeStepWarning,
    TwistWarning,
)
from .filaments.attachments import Attachment
from .filaments.body import Body
from .filaments.end_states import DynamicInstability, EndStates, TwoUnitCap
from .filaments.filament import Filament, Tether
from .filaments.filament_type import FilamentType
from .filaments.growth import Growth
from .filaments.monomers import MonomerPool, Monomers, MonomerState
from .filaments.presets import (
    ACTIN_AGING,
    ACTIN_ATP,
    COFILIN,
    DSDNA,
    F_ACTIN,
    INSTABILITY_IN_MITOSIS,
    MDIA1_ENDS,
    MICROTUBULE,
    TUBULIN,
    TUBULIN_IN_MITOSIS,
)
from .filaments.rest_bends import RestBends
from .filaments.segment_place import SegmentPlace
from .filaments.severing import Severing
from .filaments.shapes import FilamentOptions
from .filaments.twist import EndFrame
from .kinetics.barrier import Barrier
from .kinetics.binding_range import BindingRange
from .kinetics.branching import Branching
from .kinetics.crosslinker import Crosslinker
from .kinetics.growth_force import FilamentGrowth
from .kinetics.hand import Hand
from .kinetics.hand_at_end import HandAtEnd
from .kinetics.hand_on_helix import HandOnHelix
from .kinetics.linker_table import LinkerTable
from .kinetics.nucleation import Nucleation
from .kinetics.presets import ALPHA_ACTININ, COHESIN, CONDENSIN, DYNEIN, FILAMIN, KINESIN_1, KINESIN_13, MYOSIN_II
from .mechanics.flow import Flow
from .mechanics.friction import EndCorrections, SegmentFriction, stokes_friction
from .output.growth_reporter import GrowthReporter
from .output.reporters import CrosslinkReporter, FilamentReporter, LinkerReporter, TensionReporter, TetherReporter
from .output.structure_files import write_lammps_data, write_mmcif, write_psf
from .systems.filaments import Filaments
from .systems.filaments_in_context import FilamentsInContext
from .systems.periodic import make_trajectory_whole, make_whole, remove_jumps
from .systems.run_reporter import RunReporter
from .systems.step_check import check_time_step
from .systems.step_check_results import ObservableCheck, StepCheck
from .time_steps.recommended_step import fene_steps, recommended_time_step
from .time_steps.stability import stability_bounds, time_step_bounds
from .time_steps.time_step import TimeStep, effective_rate
from .version import __version__

__all__ = [
    "ACTIN_AGING",
    "ACTIN_ATP",
    "ALPHA_ACTININ",
    "Attachment",
    "Barrier",
    "BeadSpringType",
    "BindingRange",
    "Body",
    "Box",
    "BoxWarning",
    "Branching",
    "COFILIN",
    "COHESIN",
    "CONDENSIN",
    "Capsule",
    "ConstantVelocityPulling",
    "ContactForceReporter",
    "ContactForces",
    "ContactWarning",
    "CrosslinkReporter",
    "CrosslinkTable",
    "Crosslinker",
    "Crosslinks",
    "Cylinder",
    "DSDNA",
    "DSDNA_BASE_PAIRS",
    "DYNEIN",
    "DynamicInstability",
    "Ellipsoid",
    "EndCorrections",
    "EndFrame",
    "EndStates",
    "EngineWarning",
    "EquilibrationWarning",
    "FILAMIN",
    "F_ACTIN",
    "Filament",
    "FilamentGrowth",
    "FilamentOptions",
    "FilamentReporter",
    "FilamentType",
    "Filaments",
    "FilamentsInContext",
    "Flow",
    "Growth",
    "GrowthReporter",
    "Hand",
    "HandAtEnd",
    "HandOnHelix",
    "INSTABILITY_IN_MITOSIS",
    "InputError",
    "InstabilityError",
    "JointWarning",
    "Joints",
    "KINESIN_1",
    "KINESIN_13",
    "LinkerReporter",
    "LinkerTable",
    "LinkerWarning",
    "MDIA1_ENDS",
    "MICROTUBULE",
    "MYOSIN_II",
    "MonomerPool",
    "MonomerState",
    "Monomers",
    "Nucleation",
    "ObservableCheck",
    "Plane",
    "PrecisionWarning",
    "RestBends",
    "RunReporter",
    "SegmentFriction",
    "SegmentLengthWarning",
    "SegmentPlace",
    "Severing",
    "Slab",
    "Sphere",
    "StageWarning",
    "StepCheck",
    "TUBULIN",
    "TUBULIN_IN_MITOSIS",
    "TensionReporter",
    "Tether",
    "TetherReporter",
    "TimeStep",
    "TimeStepError",
    "TimeStepWarning",
    "Torus",
    "TwistWarning",
    "TwoUnitCap",
    "WallForceReporter",
    "WallForces",
    "__version__",
    "add_exclusions",
    "analysis",
    "capsule_contact_force",
    "change_constant_force",
    "check_time_step",
    "constant_force",
    "constant_tension",
    "contact_force",
    "contact_forces",
    "crossing_barrier",
    "effective_rate",
    "enable_platform",
    "excluded_pairs",
    "fene_steps",
    "filament_wall_force",
    "find_contacts",
    "make_trajectory_whole",
    "make_whole",
    "prism_faces",
    "random_points_on",
    "recommended_time_step",
    "remove_jumps",
    "rendering",
    "scans",
    "share_exclusions",
    "stability_bounds",
    "stokes_friction",
    "theory",
    "time_step_bounds",
    "wall_force",
    "wall_forces",
    "write_lammps_data",
    "write_mmcif",
    "write_psf",
]

if TYPE_CHECKING:
    from . import analysis, rendering, scans, theory
else:

    def __getattr__(name: str) -> ModuleType:
        # Loaded when they are asked for: what they import takes longer than all else, and few simulations need it.
        if name in ("analysis", "rendering", "scans", "theory"):
            return importlib.import_module(f".{name}", __name__)
        raise AttributeError(f"module {__name__!r} has no attribute {name!r}")


def __dir__() -> list[str]:
    return sorted({*globals(), *__all__})


# So that OpenMM can read Systems of it from XML files.
prepare_openmm()
del prepare_openmm
