"""Filaments as they are added: before they are in a System."""

from __future__ import annotations

from collections import Counter
from collections.abc import Iterator
from dataclasses import replace
from typing import TYPE_CHECKING, Any

import numpy as np

from ..engine_choice import choose_engine, load_engine
from ..errors import InputError
from ..filaments import shapes
from ..filaments.body import Body, PlacedBody, place_body
from ..filaments.chain_type import ChainType
from ..filaments.filament import Filament
from ..filaments.filament_type import FilamentType
from ..filaments.growth import Growth
from ..filaments.refusals import growth_refusal
from ..filaments.shapes import FilamentOptions
from ..filaments.twist import has_twist
from ..kinetics.nucleation import Nucleation, require_nucleation
from ..units.quantities import TEMPERATURE, VISCOSITY, non_negative, positive, shown, true_or_false, whole_number
from ..units.types import IntArray, Scalar, Vector, Vectors

if TYPE_CHECKING:
    from typing_extensions import Unpack

_MOST_KINDS = 4
_RESERVE_DISTANCE, _RESERVE_ROW = 10.0, 50
"""In nm, and how many are in a row of the lattice of those that have not begun."""


def _reserve_place(number):
    # Beside the middle of the region of nucleation, on a lattice that all have in common.
    row = _RESERVE_ROW
    return _RESERVE_DISTANCE * np.array([number % row, number // row % row, number // row**2], dtype=float)


class AddedFilaments:
    """Filaments in a solvent: what ``Filaments`` adds."""

    def __init__(self, viscosity: Scalar, temperature: Scalar, engine: str | None = None) -> None:
        self._viscosity = positive(viscosity, VISCOSITY, "viscosity")
        self._temperature = non_negative(temperature, TEMPERATURE, "temperature")
        self._filaments: list[Filament] = []
        self._bodies: list[PlacedBody] = []
        self._body_indices: Any = None
        self._periodic = False
        self._nodes: Any = None
        self._control_points: Any = None
        self._engine_name = choose_engine(engine)
        self._engine = load_engine(self._engine_name)

    @property
    def engine(self) -> str:
        """Name of the engine that computes the filaments."""
        return self._engine_name

    def __len__(self) -> int:
        return len(self._filaments)

    def __repr__(self) -> str:
        kinds = Counter((own.type.name, own.type.segment_kind.name, own.segments) for own in self._filaments)
        parts = [f"{count} × {name}, {size} {kind}{'s' * (size > 1)}" for (name, kind, size), count in kinds.items()]
        shown = "; ".join(parts[:_MOST_KINDS]) + "; ..." * (len(parts) > _MOST_KINDS)
        return f"<Filaments at {self._temperature:g} K, {self._engine_name} engine: {shown or 'none yet'}>"

    def __getitem__(self, index: int) -> Filament:
        count = len(self)
        number = whole_number(index, -count, "The number of a filament")
        if number >= count:
            raise InputError(f"Filament {number} does not exist; there are {count}.")
        return self._filaments[number]

    def __iter__(self) -> Iterator[Filament]:
        return iter(self._filaments)

    @property
    def viscosity(self) -> float:
        """Viscosity of the solvent in kJ ps/(mol nm^3)."""
        return self._viscosity

    @property
    def temperature(self) -> float:
        """Temperature in K."""
        return self._temperature

    @property
    def bodies(self) -> tuple[PlacedBody, ...]:
        """Tuple of the rigid bodies as they were added, in the order of their numbers."""
        return tuple(self._bodies)

    @property
    def body_indices(self) -> list[IntArray]:
        """Particle indices of the points of bodies, a list of an array for each, once they are in a System."""
        self._refuse_unless_built()
        return self._body_indices

    @property
    def node_indices(self) -> list[IntArray]:
        """Particle indices of the nodes, a list of an array for each filament, once they are in a System."""
        self._refuse_unless_built()
        return self._nodes

    @property
    def control_point_indices(self) -> list[IntArray]:
        """Particle indices of the control points of the nodes, a list of an array for each filament, once they are in a
        System: empty ones of filaments without beam elements."""
        self._refuse_unless_built()
        return self._control_points

    def add_straight(
        self,
        filament_type: ChainType,
        segments: int,
        start: Vector,
        direction: Vector,
        **options: Unpack[FilamentOptions],
    ) -> int:
        """Add a straight filament with segments of rest length.

        A clamped node alone is a hinge. Two neighbouring ones fix the direction there, too: the joint between a segment
        with both nodes clamped and one that is free is about twice as stiff as others, because only the half segment of
        material on its free side can bend. The filament is then clamped exactly at the node between these segments:
        ``clamped=[0, 1]`` clamps it at node 1, and of its length L, L - l0 is free. Let it begin a segment earlier, or
        take beam elements (``element="beam"``), which ``clamped=0, clamped_tangents=0`` clamps at the end itself.

        Parameters
        ----------
        filament_type : FilamentType or BeadSpringType
        segments : int
        start : (3,) length
            Position of the first node.
        direction : (3,) array
            Direction from the first node to the last; need not be normalised.
        **options
            See ``FilamentOptions``: ``clamped``, ``clamped_tangents``, ``planar`` and ``propulsion``.

        Returns
        -------
        int
            The filament's number.
        """
        label = self._label(filament_type)
        points = shapes.straight(filament_type, segments, start, direction, label)
        return self._add(filament_type, points, label, False, options)

    def set_aside(self, filament: int) -> None:
        """Have a filament take no part: it stands still but for its first node, and no linkers bind to it.

        So a filament comes, or goes, while an experiment goes on: in another System it takes part, and a Context of
        that goes on from one of this (``FilamentsInContext.go_on_from``). Contacts and walls are for the others if they
        are given the ``numbers`` of these.

        Parameters
        ----------
        filament : int
            Its number. It must not grow.
        """
        number = whole_number(filament, 0, "filament")
        own = self[number]
        if own.growth is not None:
            raise InputError(f"Filament {number} grows: it cannot stand aside. Begin it by a Nucleation.")
        # Engines want a node that is free.
        nodes = tuple(range(1, len(own.positions)))
        tangents = () if own.control_points is None else nodes
        self._filaments[number] = replace(own, clamped=nodes, clamped_tangents=tangents, takes_part=False)

    def add_nodes(
        self,
        filament_type: ChainType,
        positions: Vectors,
        *,
        closed: bool = False,
        tangents: Vectors | None = None,
        control_points: Vectors | None = None,
        **options: Unpack[FilamentOptions],
    ) -> int:
        """Add a filament with given node positions.

        Rest lengths are the type's segment length, whatever the distances between the nodes are.

        Parameters
        ----------
        filament_type : FilamentType or BeadSpringType
        positions : (n, 3) length
            At least two nodes, four for a ring.
        closed : bool
            Make a ring: a last segment leads from the last node back to the first.
        tangents : (n, 3) array, optional
            Of beam elements: directions of the curve at the nodes, which need not be normalised; those of the natural
            cubic spline through the nodes, or of the periodic one of a ring, if not given.
        control_points : (n, 3) length, optional
            Of beam elements, in place of tangents: those of another chain, as it is, with its strains.
        **options
            See ``FilamentOptions``.

        Returns
        -------
        int
            The filament's number.
        """
        label = self._label(filament_type)
        points = shapes.given(filament_type, positions, label, tangents, control_points, closed)
        return self._add(filament_type, points, label, closed, options)

    def add_ring(
        self,
        filament_type: ChainType,
        segments: int,
        center: Vector,
        normal: Vector = (0.0, 0.0, 1.0),
        **options: Unpack[FilamentOptions],
    ) -> int:
        """Add a ring: a regular polygon with segments of rest length, or a circle of beam elements without strains.

        Parameters
        ----------
        filament_type : FilamentType or BeadSpringType
        segments : int
            At least four.
        center : (3,) length
        normal : (3,) array
            Of the polygon's plane; nodes go counter-clockwise around it. It need not be normalised.
        **options
            See ``FilamentOptions``.

        Returns
        -------
        int
            The filament's number.
        """
        label = self._label(filament_type)
        planar = options.get("planar", False)
        points = shapes.ring(filament_type, segments, self._temperature, center, normal, planar, label)
        return self._add(filament_type, points, label, True, options)

    def add_equilibrium(
        self,
        filament_type: ChainType,
        segments: int,
        seed: int,
        start: Vector = (0.0, 0.0, 0.0),
        direction: Vector | None = None,
        **options: Unpack[FilamentOptions],
    ) -> int:
        """Add a filament drawn from the exact equilibrium of the free discrete chain.

        Segment lengths come from rho(l), joint angles from rho(c) (see ``filaments.equilibrium``), or, if the
        filament is planar, from those of two dimensions. Beam elements are drawn from theirs (``beams.equilibrium``).
        With ``rest_bends``, bends are drawn for the twists at rest with which a Context begins.

        Parameters
        ----------
        filament_type : FilamentType or BeadSpringType
        segments : int
        seed : int
            The same seed gives the same chain.
        start : (3,) length
            Position of the first node.
        direction : (3,) array, optional
            Direction of the first segment; drawn from the sphere, or from the plane's directions, if not given.
        **options
            See ``FilamentOptions``.

        Returns
        -------
        int
            The filament's number.
        """
        label = self._label(filament_type)
        generator = np.random.default_rng(whole_number(seed, 0, f"{label}: seed"))
        clamped, planar = options.get("clamped", ()), options.get("planar", False)
        points = shapes.drawn(
            filament_type,
            segments,
            self._temperature,
            generator,
            start,
            direction,
            clamped,
            planar,
            options.get("rest_bends"),
            label,
        )
        return self._add(filament_type, points, label, False, options)

    def add_reserve(
        self,
        filament_type: ChainType,
        count: int,
        *,
        growth: Growth,
        nucleation: Nucleation | None = None,
        planar: bool = False,
        propulsion: Scalar = 0.0,
    ) -> range:
        """Add filaments that are not there yet: they begin by nucleation, or as parts of filaments that are cut.

        A System cannot get more particles while it runs, so filaments that come need places. All of their particles are
        in one place until then, and where they vanished afterwards. Those that are cut take any place of the same type
        and growth.

        Parameters
        ----------
        filament_type : FilamentType
        count : int
            How many there can be at once, besides others.
        growth : Growth
            With ``vanishes=True``, filaments give their place back.
        nucleation : Nucleation, or Branching, optional
            How they begin; only as parts if not given.
        planar, propulsion
            See ``FilamentOptions``.

        Returns
        -------
        range
            Their numbers.

        Raises
        ------
        InputError
            If the engine has no filaments that grow, or something is not what it should be.
        """
        label = f"Reserve {self._label(filament_type)}"
        self._refuse_if_built(label)
        if not self._engine.has_growth:
            raise InputError(
                f"{label}: the {self._engine_name} engine has no filaments that grow: use the compiled one."
            )
        require_nucleation(nucleation)
        filament = shapes.reserve_filament(filament_type, label, growth, nucleation, planar, propulsion)
        self._check_twist(filament, label)
        if nucleation is not None and isinstance(filament_type, FilamentType):
            try:
                nucleation.monomers(growth, filament_type)
            except InputError as error:
                raise InputError(f"{label}: {error}") from None
        numbers = range(len(self), len(self) + whole_number(count, 1, f"{label}: count"))
        # Apart from each other, since forces between all particles of a System divide by distances.
        self._filaments += [replace(filament, positions=filament.positions + _reserve_place(own)) for own in numbers]
        return numbers

    def add_body(
        self, body: Body, position: Vector, orientation: Vectors | None = None, *, planar: bool = False
    ) -> int:
        """Add a rigid body: a bead, a vesicle, a spindle pole, cargo.

        Its points become particles of the System, behind those of filaments: ``body_indices`` says which. Crosslinks
        to them, anchors of linkers, contacts and walls are in the equations of the implicit step, which moves the body
        and turns it, and however stiff they are they do not limit the step. All other forces on its particles act from
        the start of a step.

        Parameters
        ----------
        body : Body
        position : (3,) length
            Of the origin of its frame.
        orientation : (3, 3) array, optional
            A rotation matrix, which takes vectors from the frame of the body to that of space.
        planar : bool
            Whether it moves in its plane of constant z, and turns about z, alone.

        Returns
        -------
        int
            The body's number.

        Raises
        ------
        InputError
            If the engine has no bodies, the filaments are in a System already, or something is not what it should be.
        """
        label = f"Body {len(self._bodies)}"
        self._refuse_if_built(label)
        if not self._engine.has_bodies:
            raise InputError(f"{label}: the {self._engine_name} engine has no rigid bodies: use the compiled one.")
        self._bodies.append(place_body(body, position, orientation, true_or_false(planar, f"{label}: planar"), label))
        return len(self._bodies) - 1

    def _refuse_if_built(self, label):
        if self._nodes is not None:
            raise InputError(f"{label} comes too late: the filaments are already in a System.")

    def _refuse_unless_built(self):
        if self._nodes is None:
            raise InputError("The filaments are not in a System yet: call build or add_to first.")

    def _label(self, filament_type):
        if not isinstance(filament_type, ChainType):
            raise InputError(
                f"Filament {len(self)}: filament_type must be a FilamentType, such as F_ACTIN, or a BeadSpringType, "
                f"but is {shown(filament_type)}."
            )
        return f"Filament {len(self)} ({filament_type.name})"

    def _check_twist(self, filament, label):
        if not has_twist(filament.type):
            return
        if not self._engine.has_twist:
            raise InputError(f"{label}: the {self._engine_name} engine has no twist: use the compiled one.")
        if filament.planar:
            raise InputError(f"{label} is planar, and cannot have twist.")
        if filament.growth is not None:
            raise InputError(growth_refusal(label, "twist"))

    def _add(self, filament_type, points, label, closed, options):
        self._refuse_if_built(label)
        if not (filament_type.segment_kind.straight or self._engine.has_beam_elements):
            raise InputError(f"{label}: the {self._engine_name} engine has no beam elements: use the compiled one.")
        if options.get("growth") is not None and not self._engine.has_growth:
            raise InputError(
                f"{label}: the {self._engine_name} engine has no filaments that grow: use the compiled one."
            )
        filament = shapes.new_filament(filament_type, points, label, closed, **options)
        self._check_twist(filament, label)
        # Friction is computed now, so that a filament that has none is refused here.
        try:
            filament_type.segment_friction(self._viscosity, self._temperature, filament.segments)
        except InputError as error:
            raise InputError(f"{label}: {error}") from None
        self._filaments.append(filament)
        return len(self) - 1
