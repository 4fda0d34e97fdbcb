"""What an engine is given, and what it does."""

from abc import ABC, abstractmethod
from dataclasses import dataclass, field
from typing import Any

import numpy as np
import openmm

from ..filaments.body import PlacedBody
from ..filaments.filament import Filament, Tether
from ..filaments.twist import EndFrame
from ..kinetics.barrier import Barrier
from ..kinetics.linkers import Linkers
from ..mechanics.flow import Flow


@dataclass(frozen=True)
class PlacedFilaments:
    """Filaments whose nodes are particles of a System.

    Attributes
    ----------
    filaments : tuple of Filament
    node_indices : tuple of (n,) int arrays
        Particles of the nodes of each filament.
    tethers : tuple of Tether
        As they were added; those of a Context may have moved.
    viscosity : float
        Of the solvent, in kJ ps/(mol nm^3).
    temperature : float
        For the friction of segments, in K.
    linkers : tuple of Linkers
        What binds to filaments and unbinds.
    periodic : bool
        Whether linkers join nearest periodic images.
    control_point_indices : tuple of (n,) int arrays
        Particles of the control points of each filament; none of straight segments.
    bodies : tuple of PlacedBody
    body_indices : tuple of (n,) int arrays
        Particles of each body.
    positions : (particles, 3) array
        In nm, of the System, while forces are added; empty later.
    barriers : tuple of Barrier
        On filaments, for hands of linkers.
    end_frames : tuple of EndFrame
        As they were added; those of a Context may have changed.
    """

    filaments: tuple[Filament, ...]
    node_indices: tuple[np.ndarray, ...]
    tethers: tuple[Tether, ...]
    viscosity: float
    temperature: float
    linkers: tuple[Linkers, ...] = ()
    periodic: bool = False
    control_point_indices: tuple[np.ndarray, ...] = ()
    bodies: tuple[PlacedBody, ...] = ()
    body_indices: tuple[np.ndarray, ...] = ()
    positions: np.ndarray = field(default_factory=lambda: np.zeros((0, 3)))
    barriers: tuple[Barrier, ...] = ()
    end_frames: tuple[EndFrame, ...] = ()

    @property
    def nodes(self) -> np.ndarray:
        """Particles of the nodes of all filaments, one after the other, and of the control points of beam elements."""
        return np.concatenate([np.zeros(0, dtype=int), *self.node_indices, *self.control_point_indices])

    def particles_of(self, filament: int) -> np.ndarray:
        """Particles of the nodes of a filament and, if it has beam elements, of their control points."""
        own = self.control_point_indices[filament] if self.control_point_indices else np.zeros(0, dtype=int)
        return np.concatenate([self.node_indices[filament], own])


@dataclass(frozen=True)
class IntegratorSettings:
    """How the filaments of a System, and everything else in it, are to be moved; see ``Filaments.create_integrator``.

    Attributes
    ----------
    step_size : float
        In ps.
    temperature : float
        Of the bath, in K.
    particle_friction : energy*time/length^2, array of them, or None
    """

    step_size: float
    scheme: str
    temperature: float
    particle_friction: Any
    random_seed: int
    flow: Flow
    checks: bool
    precision: str


class Engine(ABC):
    """What computes filaments. It keeps nothing of its own: state belongs to the Context."""

    has_linkers = False
    """Whether it knows linkers that bind to filaments and unbind."""

    has_growth = False
    """Whether it knows filaments that grow."""

    has_beam_elements = False
    """Whether it moves filaments of beam elements."""

    has_bodies = False
    """Whether it moves rigid bodies."""

    has_twist = False
    """Whether it moves filaments with twist."""

    @abstractmethod
    def add_forces(
        self, system: openmm.System, placed: PlacedFilaments, stretching_force_group: int, bending_force_group: int
    ) -> None:
        """Add the forces of filaments to a System that holds their nodes; InputError if they cannot have these force
        groups."""

    @abstractmethod
    def create_integrator(
        self, system: openmm.System, placed: PlacedFilaments, settings: IntegratorSettings
    ) -> openmm.Integrator:
        """Create the integrator of a System with filaments.

        InputError if there is no such scheme or precision, or the System is none that the engine can move.
        """

    @abstractmethod
    def flow_of(self, context: openmm.Context) -> Flow:
        """The flow of the solvent in a Context, at rest where its integrator knows of none."""

    @abstractmethod
    def set_tethers(self, context: openmm.Context, placed: PlacedFilaments, tethers: dict[int, Tether]) -> None:
        """Give a Context other tethers, by their numbers, and those of the description for the rest."""

    @abstractmethod
    def record_tensions(self, context: openmm.Context) -> None:
        """Let the integrator of a Context record mean tensions from its next step on; InputError if it cannot."""

    @abstractmethod
    def mean_tensions(self, context: openmm.Context, filaments: int) -> list[tuple[np.ndarray, np.ndarray, np.ndarray]]:
        """What the integrator of a Context has recorded of the last step, for so many filaments; InputError if it is
        nothing.

        For each filament tensions (segments,) and joint forces (joints, 3) in kJ/(mol nm), and directions
        (segments, 3).
        """
