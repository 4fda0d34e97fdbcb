"""Filaments: what users add, build, integrate and ask; the work is done by the modules that it calls."""

from collections import defaultdict
from collections.abc import Iterator
from dataclasses import replace
from typing import Any
from weakref import WeakKeyDictionary

import numpy as np
import openmm
from openmm import app, unit

from ..couplings.beam_curves import BeamCurves
from ..couplings.stiff_joints import warn_of_stiff_joints
from ..dynamics.bead_spring_step import refuse_modes
from ..dynamics.precision import check_precision, refuse_mixed_precision_of_beams
from ..dynamics.schemes import MODES, check_scheme
from ..dynamics.step_of_system import recommended_step_of
from ..dynamics.step_warnings import warn_of_long_step
from ..dynamics.time_step import TimeStep, as_step
from ..engine_choice import choose_engine, default_scheme, load_engine
from ..engines.description import describe_chains, filament_label
from ..engines.protocol import IntegratorSettings, PlacedFilaments
from ..errors import InputError
from ..filaments import shapes
from ..filaments.attachments import (
    Attachment,
    add_virtual_site,
    attachment_positions,
    distribute_beads,
    locate,
    neighbors,
)
from ..filaments.beam_refusals import refuse_beams
from ..filaments.chain_type import ChainType
from ..filaments.filament import Filament, Tether
from ..filaments.placement import named_nodes
from ..filaments.segment_place import SegmentPlace
from ..kinetics.binding_force import (
    find_binding_force,
    naming_unknown_linkers,
    places_of,
    pulls_of,
    set_table,
    table_of,
)
from ..kinetics.crosslinker import Crosslinker
from ..kinetics.linker_table import LinkerTable
from ..kinetics.linkers import LinkerPulls, Linkers, as_linkers, warn_if_springs_do_not_fit
from ..mechanics.flow import Flow, as_flow
from ..mechanics.redistribution import ChainSet
from ..mechanics.tension import components_along, filament_tensions
from ..units.quantities import (
    FORCE,
    LENGTH,
    STIFFNESS,
    TEMPERATURE,
    VISCOSITY,
    in_units_of,
    non_negative,
    positive,
    shown,
    vector,
    whole_number,
)
from ..units.types import BoxVectors, Indices, IntArray, Numbers, Scalar, Vector, Vectors
from .insertion import (
    add_nodes_to_system,
    add_noninteracting_entries,
    add_to_topology,
    check_force_groups,
    check_target,
    set_box_vectors,
)


class Filaments:
    """Filaments in a solvent, to be added to an OpenMM System.

    Parameters
    ----------
    viscosity : pressure*time
        Viscosity of the solvent; a plain number is in kJ ps/(mol nm^3), 602214 of which are 1 Pa s.
    temperature : temperature
        For eq. (20), equilibrium draws and the default temperature of the integrator.
    engine : {"compiled", "portable"}, optional
        What computes the chains: the compiled plugin, which is much faster and runs on the Reference and
        CPU platforms, or stock OpenMM forces and NumPy, on every platform. The compiled one if it is
        installed and none is named.

    Examples
    --------
    >>> from openmm import unit
    >>> from openmm_cylchain import F_ACTIN, Filaments
    >>> filaments = Filaments(viscosity=1.71e-3 * unit.pascal * unit.second, temperature=310 * unit.kelvin)
    >>> filaments.add_straight(F_ACTIN, segments=10, start=[0, 0, 0], direction=[1, 0, 0])
    0
    >>> topology, system, positions = filaments.build()
    >>> system.getNumParticles()
    11
    """

    def __init__(self, viscosity: Scalar, temperature: Scalar, engine: str | None = None) -> None:
        self._viscosity = positive(viscosity, VISCOSITY, "viscosity")
        self._temperature = non_negative(temperature, TEMPERATURE, "temperature")
        self._filaments: list[Filament] = []
        self._tethers: list[Tether] = []
        self._tethered_nodes: set[tuple[int, int]] = set()
        self._linkers: list[Linkers] = []
        self._periodic = False
        # By Context: what has moved there, by number.
        self._moved_tethers: WeakKeyDictionary[Any, dict[int, Tether]] = WeakKeyDictionary()
        self._attachments: list[Attachment] = []
        self._attachments_of: defaultdict[int, list[int]] = defaultdict(list)
        self._attachment_indices: Any = None
        self._beads: dict[int, list[int]] = {}
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

    def __getitem__(self, index: int) -> Filament:
        return self._filaments[index]

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

    @property
    def tethers(self) -> tuple[Tether, ...]:
        """Tuple of the tethers, in the order of their numbers, as they were added; see ``tethers_in``."""
        return tuple(self._tethers)

    @property
    def attachments(self) -> tuple[Attachment, ...]:
        """Tuple of the attachment points, in the order of their numbers."""
        return tuple(self._attachments)

    @property
    def attachment_indices(self) -> IntArray:
        """Particle indices of the attachment points, in the order of their numbers, once they are in a System."""
        self._refuse_unless_built()
        return self._attachment_indices

    @property
    def bead_indices(self) -> list[IntArray]:
        """Particle indices of the beads, a list of an array for each filament, once they are in a System."""
        self._refuse_unless_built()
        return [self._attachment_indices[self._beads.get(number, [])] for number in range(len(self))]

    def add_straight(
        self,
        filament_type: ChainType,
        segments: int,
        start: Vector,
        direction: Vector,
        clamped: int | Indices = (),
        *,
        planar: bool = False,
        propulsion: Scalar = 0.0,
        clamped_tangents: int | Indices = (),
    ) -> int:
        """Add a straight filament with segments of rest length.

        A clamped node alone is a hinge. Two neighbouring ones fix the direction there, too: the joint between a segment
        with both nodes clamped and one that is free is about twice as stiff as others, because only the half segment of
        material on its free side can bend. The filament is then clamped exactly at that node.

        Parameters
        ----------
        filament_type : FilamentType or BeadSpringType
        segments : int
        start : (3,) length
            Position of the first node.
        direction : (3,) array
            Direction from the first node to the last; need not be normalised.
        clamped : sequence of int
            Nodes that do not move; negative numbers count from the end.
        planar : bool
            The filament moves in a plane of constant z, as under a cover slip: its nodes keep their z, and no force or
            noise acts along z.
        propulsion : force
            F0 of self-propelled filaments: a force F0 t acts on every segment, half on either end, where t is its
            tangent, away from the first node; on beam elements, along their curves. With a negative F0 the filament
            moves with its first node in front. It is not conservative and has no energy.
        clamped_tangents : sequence of int
            Of beam elements: clamped nodes whose tangents do not turn either. The filament is clamped exactly there; a
            clamped node alone is a hinge.

        Returns
        -------
        int
            The filament's number.
        """
        label = self._label(filament_type)
        positions = shapes.straight(filament_type, segments, start, direction, label)
        controls = shapes.beam_control_points(filament_type, positions, None, label)
        return self._add(
            filament_type, positions, clamped, label, False, planar, propulsion, controls, clamped_tangents
        )

    def add_nodes(
        self,
        filament_type: ChainType,
        positions: Vectors,
        clamped: int | Indices = (),
        *,
        closed: bool = False,
        planar: bool = False,
        propulsion: Scalar = 0.0,
        tangents: Vectors | None = None,
        control_points: Vectors | None = None,
        clamped_tangents: int | Indices = (),
    ) -> int:
        """Add a filament with given node positions.

        Rest lengths are the type's segment length, whatever the distances between the nodes are.

        Parameters
        ----------
        filament_type : FilamentType or BeadSpringType
        positions : (n, 3) length
            At least two nodes, four for a ring.
        clamped : sequence of int
            Nodes that do not move; negative numbers count from the end.
        closed : bool
            Make a ring: a last segment leads from the last node back to the first.
        tangents : (n, 3) array, optional
            Of beam elements: directions of the curve at the nodes, which need not be normalised; those of the natural
            cubic spline through the nodes, or of the periodic one of a ring, if not given.
        control_points : (n, 3) length, optional
            Of beam elements, in place of tangents: those of another chain, as it is, with its strains.
        planar, propulsion, clamped_tangents
            See ``add_straight``.

        Returns
        -------
        int
            The filament's number.
        """
        label = self._label(filament_type)
        positions = shapes.given(positions, label)
        if control_points is None:
            controls = shapes.beam_control_points(filament_type, positions, tangents, label, bool(closed))
        else:
            controls = self._given_control_points(filament_type, positions, tangents, control_points, label)
        return self._add(
            filament_type, positions, clamped, label, closed, planar, propulsion, controls, clamped_tangents
        )

    def add_ring(
        self,
        filament_type: ChainType,
        segments: int,
        center: Vector,
        normal: Vector = (0.0, 0.0, 1.0),
        *,
        clamped: int | Indices = (),
        planar: bool = False,
        propulsion: Scalar = 0.0,
        clamped_tangents: int | Indices = (),
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
        clamped, planar, propulsion, clamped_tangents
            See ``add_straight``.

        Returns
        -------
        int
            The filament's number.
        """
        label = self._label(filament_type)
        controls = None
        if filament_type.has_beam_elements:
            positions, controls = shapes.beam_ring(
                filament_type, segments, self._temperature, center, normal, planar, label
            )
        else:
            positions = shapes.ring(filament_type, segments, center, normal, label)
        return self._add(filament_type, positions, clamped, label, True, planar, propulsion, controls, clamped_tangents)

    def add_equilibrium(
        self,
        filament_type: ChainType,
        segments: int,
        seed: int,
        start: Vector = (0.0, 0.0, 0.0),
        direction: Vector | None = None,
        clamped: int | Indices = (),
        *,
        planar: bool = False,
        propulsion: Scalar = 0.0,
        clamped_tangents: int | Indices = (),
    ) -> int:
        """Add a filament drawn from the exact equilibrium of the free discrete chain.

        Segment lengths come from rho(l), joint angles from rho(c) (see ``filaments.equilibrium``), or, if the
        filament is planar, from those of two dimensions. Beam elements are drawn from theirs (``beams.equilibrium``).

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
        clamped : sequence of int
            Nodes that do not move; negative numbers count from the end.
        planar, propulsion, clamped_tangents
            See ``add_straight``.

        Returns
        -------
        int
            The filament's number.
        """
        label = self._label(filament_type)
        generator = np.random.default_rng(whole_number(seed, 0, f"{label}: seed"))
        if filament_type.has_beam_elements:
            positions, controls = shapes.drawn_beam(
                filament_type, segments, self._temperature, generator, start, direction, planar, label
            )
            return self._add(
                filament_type, positions, clamped, label, False, planar, propulsion, controls, clamped_tangents
            )
        positions = shapes.drawn(
            filament_type, segments, self._temperature, generator, start, direction, clamped, planar, label
        )
        return self._add(filament_type, positions, clamped, label, False, planar, propulsion, None, clamped_tangents)

    def add_tether(self, filament: int, node: int, point: Vector, stiffness: Scalar) -> int:
        """Tether a node to a point by a harmonic spring, such as an optical trap: energy (k/2) |x - point|^2.

        Scheme "implicit" takes tethers at the end of the step, like the filament's own forces, so they may be as stiff
        as a segment. The explicit schemes, and other OpenMM forces in all schemes, need a step well below
        2 gamma/k, where gamma is the friction of what the spring pulls, at least a quarter of a segment's parallel
        friction per segment that meets in the node. A node of beam elements is held at its position, and can turn.

        Parameters
        ----------
        filament : int
            The filament's number.
        node : int
            The node's number in the filament; negative numbers count from the end. A node can have one tether.
        point : (3,) length
        stiffness : energy/length^2

        Returns
        -------
        int
            The tether's number, for ``move_tether``.

        Raises
        ------
        InputError
            For a filament or node that does not exist, a second tether, or a stiffness that is not positive.
        """
        label = f"Tether {len(self._tethers)}"
        self._refuse_if_built(label)
        filament = self._filament_number(filament, label)
        (node,) = named_nodes([node], len(self[filament].positions), f"{label}:")
        if (filament, node) in self._tethered_nodes:
            raise InputError(f"{label}: node {node} of filament {filament} has a tether already.")
        x, y, z = (float(x) for x in vector(point, LENGTH, f"{label}: point"))
        stiffness = positive(stiffness, STIFFNESS, f"{label}: stiffness")
        self._tethers.append(Tether(filament, node, (x, y, z), stiffness))
        self._tethered_nodes.add((filament, node))
        return len(self._tethers) - 1

    def add_attachment(
        self, filament: int, arc_length: Scalar | None = None, segment: int | None = None, fraction: float | None = None
    ) -> int:
        """Add an attachment point: a virtual site on a segment, on which any OpenMM force can act.

        It is at ``(1 - fraction) x_minus + fraction x_plus`` of its segment's ends, or on the curve of a beam element
        at the parameter ``fraction``, and follows them in the same step; a force on it acts at that place of the
        cylinder (step 5 of Section 4 of the paper). It becomes a particle of its own behind the nodes of its filament,
        in the Topology with the name "ATT"; ``attachment_indices`` says which.

        Parameters
        ----------
        filament : int
            The filament's number.
        arc_length : length, optional
            Distance from the first node along segments of rest length. Give this, or a segment.
        segment : int, optional
            The segment's number; negative numbers count from the end.
        fraction : float, optional
            Place on the segment, from 0 at its first node to 1 at its last; 0.5 if not given.

        Returns
        -------
        int
            The attachment point's number.

        Raises
        ------
        InputError
            For a filament, segment or place that does not exist.
        """
        label = f"Attachment point {len(self._attachments)}"
        self._refuse_if_built(label)
        filament = self._filament_number(filament, label)
        return self._attach(locate(self[filament], filament, label, arc_length, segment, fraction))

    def segment_place(
        self, filament: int, arc_length: Scalar | None = None, segment: int | None = None, fraction: float | None = None
    ) -> SegmentPlace:
        """A place on a filament that crosslinks can hold, at any time, without an attachment point.

        Parameters
        ----------
        filament : int
            The filament's number.
        arc_length, segment, fraction
            As for ``add_attachment``.

        Returns
        -------
        SegmentPlace

        Raises
        ------
        InputError
            For a filament, segment or place that does not exist, or before ``build`` or ``add_to``.
        """
        label = "Place on a segment"
        filament = self._filament_number(filament, label)
        place = locate(self[filament], filament, label, arc_length, segment, fraction)
        nodes = self.node_indices[filament]
        return SegmentPlace(int(nodes[place.segment]), int(nodes[(place.segment + 1) % len(nodes)]), place.fraction)

    def add_beads(self, filament: int, spacing: Scalar) -> list[int]:
        """Cover a filament evenly with beads, on which contact forces act (see ``openmm_cylchain.couplings.contacts``).

        Beads are attachment points, from the first node to the last at equal distances along the contour, in the
        Topology with the name "BED". ``bead_indices`` says which particles they are.

        Parameters
        ----------
        filament : int
            The filament's number.
        spacing : length
            The largest distance of two neighbours along segments of rest length. Half a contact diameter closes
            all gaps.

        Returns
        -------
        list of int
            The beads' numbers among the attachment points.

        Raises
        ------
        InputError
            For a filament that does not exist or has beads already, or a spacing that is not positive.
        """
        label = f"Beads of filament {filament}"
        self._refuse_if_built(label)
        filament = self._filament_number(filament, label)
        if filament in self._beads:
            raise InputError(f"{label}: it has beads already.")
        beads = distribute_beads(self[filament], filament, positive(spacing, LENGTH, f"{label}: spacing"))
        self._beads[filament] = [self._attach(bead) for bead in beads]
        return list(self._beads[filament])

    def add_linkers(
        self,
        kind: Crosslinker,
        count: int | None = None,
        *,
        concentration: Scalar | None = None,
        volume: Scalar | None = None,
        anchors: Indices | Vectors | None = None,
        bound: int = 0,
        seed: int = 0,
    ) -> int:
        """Add linkers that bind to filaments, walk along them and unbind: crosslinkers or motors.

        While they are not bound, they are anywhere: a linker binds its first hand with the rate
        ``binding_rate/(2 reach) v/V`` for each length of filament, where V is the volume in which unbound linkers are
        and v = (4 pi/3) R^3 with the reach R (of hands that differ, the geometric mean of both v). How many there are
        of them, and where they are bound, belongs to each Context: ``linkers_in``.

        In every step, filaments stand still while linkers bind and unbind as long as the step takes; then filaments
        move, with the springs of linkers in their equations if the scheme is implicit.

        Parameters
        ----------
        kind : Crosslinker
        count : int
            How many there are. Or give one of the next two.
        concentration : 1/length^3, or amount/length^3
            Of those that are not bound, if that does not change.
        anchors : (n,) int or (n, 3) length
            Particles of the System, or points, to which n linkers are tied, in the place of their first hands.
        volume : length^3, optional
            V, of a count of linkers; that of the periodic box if not given.
        bound : int
            How many begin with their first hand bound, at random places. Of those with anchors, the first that have a
            filament within reach begin with their only hand bound to it, as the energy of the spring has it.
        seed : int
            Of these places.

        Returns
        -------
        int
            The number of their type, for tables.

        Raises
        ------
        InputError
            For a value that is missing or wrong; with the portable engine, which has no linkers; or if the filaments
            are in a System already.

        Warns
        -----
        LinkerWarning
            For a spring without rest length that is so stiff that hands do not bind anywhere near their reach, or one
            that is much longer at rest than they reach.
        """
        if not self._engine.has_linkers:
            raise InputError(
                f"The {self._engine_name} engine has no linkers that bind and unbind; use the compiled one, or "
                "Crosslinks, which are added and removed from Python."
            )
        if self._nodes is not None:
            raise InputError("These filaments are already in a System: add linkers before.")
        self._linkers.append(as_linkers(kind, count, concentration, volume, anchors, bound, seed))
        warn_if_springs_do_not_fit(kind, self.temperature)
        return len(self._linkers) - 1

    @property
    def linkers(self) -> tuple[Linkers, ...]:
        """Tuple of the types of linkers, in the order of their numbers, as they were added."""
        return tuple(self._linkers)

    def linkers_in(self, context: openmm.Context) -> LinkerTable:
        """The linkers of a Context, and where they are bound: a LinkerTable.

        Raises
        ------
        InputError
            If there are none, or the Context has got a State that does not say where linkers are.
        """
        return table_of(self._binding_force(context), context, self._filaments)

    def set_linkers(self, context: openmm.Context, table: LinkerTable) -> None:
        """Give a Context other linkers.

        Raises
        ------
        InputError
            For linkers that do not fit their types, the anchors or the filaments.
        """
        set_table(self._binding_force(context), context, table, self._filaments)

    def linker_pulls(self, context: openmm.Context) -> LinkerPulls:
        """What the springs of linkers do that join two places in a Context: a LinkerPulls."""
        return pulls_of(*self._seen_linkers(context))

    def linker_places(self, context: openmm.Context) -> unit.Quantity:
        """Where the two ends of each linker of ``linkers_in`` are in a Context: (n, 2, 3) in nm, NaN where not bound.

        In a periodic box, the second end is at the image that is nearest to the first one.
        """
        return places_of(*self._seen_linkers(context)) * unit.nanometer

    def linker_events(self, context: openmm.Context, linker_type: int | None = None) -> tuple[int, int]:
        """How often hands have bound and unbound in a Context since the start, with all that its checkpoint knew.

        Parameters
        ----------
        context : openmm.Context
        linker_type : int, optional
            What ``add_linkers`` returned; linkers of all types if not given.

        Raises
        ------
        InputError
            If there are no linkers, or none of this type, or the Context has got a State that does not say where
            linkers are.
        """
        force = self._binding_force(context)
        if linker_type is not None:
            whole_number(linker_type, 0, "linker_type")
            if linker_type >= len(self._linkers):
                raise InputError(f"There is no type {linker_type} of linkers: there are {len(self._linkers)}.")
        types = range(len(self._linkers)) if linker_type is None else [linker_type]
        with naming_unknown_linkers():
            bindings, unbindings = zip(*(force.getNumEventsInContext(context, number) for number in types))
        return sum(bindings), sum(unbindings)

    def _seen_linkers(self, context):
        force, state = self._binding_force(context), context.getState(positions=True)
        positions = state.getPositions(asNumpy=True)._value
        box = state.getPeriodicBoxVectors(asNumpy=True)._value if force.usesPeriodicBoundaryConditions() else None
        table, curves = self.linkers_in(context), BeamCurves.of_system(context.getSystem())
        return force, table, self._filaments, self.node_indices, positions, box, curves

    def _binding_force(self, context):
        force = find_binding_force(context.getSystem())
        if force is None:
            raise InputError("There are no linkers here: add them by add_linkers, before the filaments are built.")
        return force

    def build(
        self, box_vectors: BoxVectors | None = None, stretching_force_group: int = 0, bending_force_group: int = 0
    ) -> tuple[app.Topology, openmm.System, unit.Quantity]:
        """Put the filaments into a new Topology, System and positions.

        Parameters
        ----------
        box_vectors : three (3,) lengths, optional
            Periodic box vectors of the System and the Topology.
        stretching_force_group, bending_force_group : int
            Force groups of the chain's own forces. The compiled engine has one force for both, so they must
            not differ.

        Returns
        -------
        topology : openmm.app.Topology
        system : openmm.System
        positions : (particles, 3) Quantity in nm

        Raises
        ------
        InputError
            For box vectors that are not three, not finite or not in the reduced form that OpenMM needs.
        """
        topology, system = app.Topology(), openmm.System()
        if box_vectors is not None:
            vectors = set_box_vectors(system, box_vectors)
            topology.setPeriodicBoxVectors(vectors * unit.nanometer)
        positions = self.add_to(
            topology, system, np.zeros((0, 3)) * unit.nanometer, stretching_force_group, bending_force_group
        )
        return topology, system, positions

    def add_to(
        self,
        topology: app.Topology,
        system: openmm.System,
        positions: Vectors,
        stretching_force_group: int = 0,
        bending_force_group: int = 0,
    ) -> unit.Quantity:
        """Put the filaments into an existing Topology and System, behind what is there.

        One filament becomes one chain of the Topology, with a residue and an atom (named "NOD") for each
        node and bonds along it. Everything that was in the Topology and the System stays as it is.

        Parameters
        ----------
        topology : openmm.app.Topology
            Changed in place.
        system : openmm.System
            Changed in place. NonbondedForce and CustomNonbondedForce, which ask for parameters of every
            particle, are given non-interacting entries for the nodes. (Where they use a long-range dispersion
            correction, its constant changes, because OpenMM averages it over all particles.)
        positions : (particles, 3) length
            Positions of the particles that are there.
        stretching_force_group, bending_force_group : int
            Force groups of the chain's own forces. The compiled engine has one force for both, so they must
            not differ.

        Returns
        -------
        (particles, 3) Quantity in nm
            The positions of everything.
        """
        if not self._filaments:
            raise InputError("There are no filaments to add: call add_straight, add_nodes or add_equilibrium first.")
        if self._nodes is not None:
            raise InputError("These filaments are already in a System; make another Filaments for another System.")
        positions = check_target(topology, system, positions)
        check_force_groups(stretching_force_group, bending_force_group)
        self._nodes, self._control_points = [], []
        self._attachment_indices = np.zeros(len(self._attachments), dtype=int)
        everything = [positions]
        for number, filament in enumerate(self._filaments):
            nodes, control_points = add_nodes_to_system(system, filament)
            self._nodes.append(nodes)
            self._control_points.append(control_points)
            everything += [filament.positions, self._add_attachments(system, number)]
            if filament.control_points is not None:
                everything.insert(-1, filament.control_points)
            names = [self._attachments[index].name for index in self._attachments_of[number]]
            add_to_topology(topology, filament, f"F{number}", names)
        add_noninteracting_entries(system, len(positions), self._coinciding())
        self._periodic = topology.getPeriodicBoxVectors() is not None or system.usesPeriodicBoundaryConditions()
        positions = np.concatenate(everything)
        placed = replace(self._placed(), positions=positions)
        self._engine.add_forces(system, placed, stretching_force_group, bending_force_group)
        return positions * unit.nanometer

    def _placed(self):
        return PlacedFilaments(
            tuple(self._filaments),
            tuple(self.node_indices),
            tuple(self._tethers),
            self._viscosity,
            self._temperature,
            tuple(self._linkers),
            self._periodic,
            tuple(self._control_points),
        )

    def _add_attachments(self, system, number):
        # Those of one filament; returns their positions.
        attachments = [self._attachments[index] for index in self._attachments_of[number]]
        for index, attachment in zip(self._attachments_of[number], attachments):
            self._attachment_indices[index] = add_virtual_site(
                system, attachment, self._nodes[number], self._control_points[number]
            )
        own = self._filaments[number]
        return attachment_positions(attachments, own.positions, own.control_points)

    def _coinciding(self):
        for number, nodes in enumerate(self._nodes):
            mine = self._attachments_of[number]
            yield from neighbors([self._attachments[index] for index in mine], self._attachment_indices[mine], nodes)

    def recommended_time_step(
        self,
        scheme: str | None = None,
        contact_diameter: Numbers | None = None,
        contact_stiffness: Scalar | None = None,
        confidence: float = 3.0,
        *,
        system: openmm.System | None = None,
        temperature: Scalar | None = None,
        particle_friction: Numbers | None = None,
        flow: Flow | None = None,
    ) -> TimeStep:
        """The recommended step, and what binds: a TimeStep, which ``create_integrator`` takes.

        It is that of the filament that allows the least (see ``timestep``), and, if a System is given, of its forces:
        crosslinks, joints and capsule contacts of the compiled engine are in the equations of its implicit schemes.
        Joints do not bind the step; the others do only as the places that they join or keep apart diffuse against each
        other (see ``coupled_step``). All others act from the start of a step, and a spring of the stiffness k on a
        place of the response mu h to a force
        in a step h has a variance too large by 1/(1 - k mu h/2). mu h is that of the place on the straight filament
        (see ``mobility``), or h/gamma of a particle. The step leaves 5 % at most, with all forces at once. Known are
        HarmonicBondForce, crosslinks, walls, contacts, constant forces, tethers, and CustomBondForce and
        CustomExternalForce that are harmonic; walls as if all their particles were in contact, and contacts of two
        filaments as if they crossed at their ends, or touched all along with an error of a third.
        Other forces are listed in ``unknown_forces``.

        Parameters
        ----------
        scheme : {"implicit", "implicit-second-order", "midpoint", "euler"}, optional
            The engine's default if not given.
        contact_diameter : length, or (filaments,) array of lengths, optional
            Filaments that touch at this distance must not jump through each other, eq. (56), nor be thrown apart by
            the contact force: see ``timestep.contact_time_step``. With a System, those of its contact force.
        contact_stiffness : energy/length^2, optional
            Of the contact force; that of ``contacts.default_stiffness`` if not given.
        confidence : float
            c_sigma of eq. (53): how many standard deviations of a displacement must stay below half the diameter.
        system : openmm.System, optional
            That the filaments were put into, with all of its forces.
        temperature, particle_friction, flow : optional
            As for ``create_integrator``.

        Returns
        -------
        TimeStep
            Its ``bounds`` have the bounds of filaments by name, and that of each force with the spring that binds, as
            in "HarmonicBondForce (force 3): bond 12": the step at which it throws the System apart.

        Raises
        ------
        InputError
            If there are no filaments, they are not in the System, or particles lack a friction.
        """
        if system is not None:
            self._refuse_if_not_in(system)
        return recommended_step_of(
            self,
            default_scheme(self._engine_name) if scheme is None else scheme,
            contact_diameter,
            contact_stiffness,
            confidence,
            system=system,
            temperature=self._bath(temperature),
            particle_friction=particle_friction,
            flow=as_flow(flow),
        )

    def _bath(self, temperature):
        return self._temperature if temperature is None else non_negative(temperature, TEMPERATURE, "temperature")

    def _refuse_if_not_in(self, system):
        if system.getNumParticles() <= max(nodes.max() for nodes in self.node_indices):
            raise InputError("This is not the System that the filaments were put into: it has too few particles.")

    def create_integrator(
        self,
        system: openmm.System,
        step_size: Scalar | TimeStep,
        scheme: str | None = None,
        temperature: Scalar | None = None,
        particle_friction: Numbers | None = None,
        random_seed: int = 0,
        flow: Flow | None = None,
        checks: bool = True,
        precision: str = "automatic",
    ) -> openmm.Integrator:
        """Create the integrator that moves the filaments and everything else in the System.

        Call it when all forces and particles are in the System: it also adds to the System the force
        that redistributes forces along the chains.

        Parameters
        ----------
        system : openmm.System
            The System that the filaments were put into.
        step_size : time, or TimeStep
        scheme : {"implicit", "implicit-second-order", "midpoint", "euler", "modes"}, optional
            "implicit", the compiled engine's default, takes stretching, bending and tethers at the end of the step,
            and steps a thousand times as long as explicit ones. "implicit-second-order" does so in two stages, with
            decay of bends of second order in the step. "midpoint", the portable engine's default, is Fixman's
            explicit scheme with the right drift on chains. "euler" is Section 4 of the paper, biased on chains. "modes"
            moves open chains of beads alone, by their modes.
        temperature : temperature, optional
            That of the filaments if not given.
        particle_friction : energy*time/length^2, or array of them
            Friction coefficients of the particles outside filaments, in the order of their indices; a
            number holds for all of them. Values for massless particles are ignored: those do not move.
            ``stokes_friction`` computes one.
        random_seed : int
            0 draws a fresh seed from the operating system.
        flow : Flow, optional
            Flow of the solvent. ``integrator.setFlow(flow)`` changes it during a run.
        checks : bool
            Whether to look for a step that is too long, now and while it runs (see ``step_watch``). The attribute
            ``checks`` of the integrator turns the latter off and on.
        precision : {"automatic", "mixed", "double"}
            "mixed" computes what happens within a step in single precision, wherever that changes no result beyond its
            statistical error: for open filaments with harmonic lengths and an implicit scheme of the compiled engine,
            above zero temperature, without flow, while 4 h K/gamma_rot is at most 10^4, k l0^2/k_BT at most 10^9, and
            noise changes lengths by 10^-5 of themselves in a step, or more.
            Positions and forces are in double precision, and other filaments altogether; so are those of beam elements,
            and all on platforms for GPUs, where "mixed" is refused before the first step. "automatic" does so where it
            is faster as well, about twice as fast: where there are enough filaments of similar length, or few that are
            long. With the portable engine it is the same as "double".
            ``integrator.getNumMixedPrecisionChains()`` says for how many filaments the last step did so.

        Returns
        -------
        openmm.Integrator
            Of the engine: a NativeIntegrator or a PortableIntegrator.

        Warns
        -----
        TimeStepWarning
            If the step exceeds a bound of stability, or the recommended step of a filament more than four times; if
            forces of the System are so stiff that variances double (k mu h > 1, see ``recommended_time_step``); if it
            is too long for the flow or for self-propelled filaments; or if FENE lengths have too much energy at it
            (``timestep.fene_steps``).
        JointWarning
            If a joint of filaments that are not linked where it is has more than 20 EI/h of an element.

        Raises
        ------
        InputError
            If the engine does not have the scheme or the precision, all filaments have beam elements and the precision
            is "mixed", or the System does not hold the filaments.
        """
        step_size = as_step(step_size)
        check_precision(precision)
        refuse_mixed_precision_of_beams(self, precision)
        self._refuse_if_not_in(system)
        scheme = default_scheme(self._engine_name) if scheme is None else scheme
        check_scheme(scheme)
        if scheme == MODES:
            for number, filament in enumerate(self):
                refuse_modes(filament, filament_label(number, filament))
        flow = as_flow(flow)
        if scheme != "implicit":
            refuse_beams(self, f"scheme {scheme!r}")
        bath = self._bath(temperature)
        if checks:
            warn_of_long_step(self, system, step_size, scheme, bath, particle_friction, flow)
            warn_of_stiff_joints(system, self)
        settings = IntegratorSettings(step_size, scheme, bath, particle_friction, random_seed, flow, checks, precision)
        return self._engine.create_integrator(system, self._placed(), settings)

    def chain_set(self, system: openmm.System) -> ChainSet:
        """The filaments as an engine sees them (a ``ChainSet``): friction of segments and fixed nodes.

        Raises InputError for beam elements, which are no such chains.
        """
        refuse_beams(self, "tensions of joints and other properties of a ChainSet")
        return describe_chains(system, self._placed())

    def joint_tensions(self, context: openmm.Context) -> list[unit.Quantity]:
        """Instantaneous virtual forces Phi at the joints, without noise, in the context's configuration and flow.

        Phi of joint i, eqs. (22)-(24), is the force that segment i + 1 exerts on segment i; its component along the
        chain is positive under tension. Random forces are left out: this is the mean over the noise of an
        infinitesimal step that begins here. See ``mean_joint_tensions`` for those of the steps that were taken.
        Stretching, bending and propulsion belong to their segments; any other force on a shared node is given to the
        two segments in equal parts.

        Parameters
        ----------
        context : openmm.Context
            Of a System that these filaments were put into.

        Returns
        -------
        list of (joints, 3) Quantity in kJ/(mol nm), one for each filament
            An open filament has segments - 1 joints. A ring has as many as segments: the last is node 0, where the
            force is that of segment 0 on the last one.
        """
        state = context.getState(positions=True, forces=True)
        positions = state.getPositions(asNumpy=True)._value
        forces = state.getForces(asNumpy=True)._value
        chains = self.chain_set(context.getSystem())
        flow = self._engine.flow_of(context)
        parts = filament_tensions(self._filaments, self._nodes, chains, positions, forces, flow)
        return [part * FORCE for part in parts]

    def mean_joint_tensions(self, context: openmm.Context) -> list[unit.Quantity]:
        """Virtual forces Phi at the joints as means over the last step, with friction and noise.

        Phi of joint i is the force that segment i + 1 exerts on segment i, as in ``joint_tensions``, but of the step
        that scheme "implicit" has solved, with all that moved the segments in it, their friction and the random forces.
        Where the nodes of the joint are free to move, the forces q on the ends of the two segments, which they exert
        themselves, and those from outside balance, q_plus(i) + q_minus(i+1) + f = 0, and f acts on both in equal parts:
        Phi = (q_minus(i+1) - q_plus(i))/2. Averages over time are the forces that a filament transmits, such as that
        of a trap at its end; the noise of a single step is large.

        Parameters
        ----------
        context : openmm.Context
            Of a System that these filaments were put into, in which a step was taken after
            ``integrator.setRecordsTensions(True)``.

        Returns
        -------
        list of (joints, 3) Quantity in kJ/(mol nm), one for each filament
            In the order of ``joint_tensions``.

        Raises
        ------
        InputError
            With the portable engine or an explicit scheme, or if nothing was recorded.
        """
        return [forces * FORCE for _, forces, _ in self._engine.mean_tensions(context, len(self))]

    def mean_tensions(self, context: openmm.Context) -> list[unit.Quantity]:
        """Tensions T of the segments as means over the last step, with friction and noise.

        T is the elastic force of the segment's length, its friction against becoming longer and the noise of both, as
        an implicit scheme has solved for them, along the direction of the segment half-way through the step; it is
        positive where it pulls the ends together. See ``mean_joint_tensions``.

        Parameters
        ----------
        context : openmm.Context

        Returns
        -------
        list of (segments,) Quantity in kJ/(mol nm), one for each filament

        Raises
        ------
        InputError
            As for ``mean_joint_tensions``.
        """
        return [tensions * FORCE for tensions, _, _ in self._engine.mean_tensions(context, len(self))]

    def mean_axial_tensions(self, context: openmm.Context) -> list[unit.Quantity]:
        """Components of ``mean_joint_tensions`` along the filaments, positive under tension.

        The direction of a filament at a joint is that of the sum of the unit vectors along its two segments half-way
        through the step. (That at its end would be correlated with the noise of the step.)

        Parameters
        ----------
        context : openmm.Context

        Returns
        -------
        list of (joints,) Quantity in kJ/(mol nm), one for each filament

        Raises
        ------
        InputError
            As for ``mean_joint_tensions``.
        """
        recorded = self._engine.mean_tensions(context, len(self))
        return [components_along(directions, forces) * FORCE for _, forces, directions in recorded]

    def record_tensions(self, context: openmm.Context) -> None:
        """Let the integrator of a Context record mean tensions from its next step on; see ``mean_joint_tensions``.

        Raises
        ------
        InputError
            With the portable engine or an explicit scheme.
        """
        refuse_beams(self, "records of mean tensions")
        self._engine.record_tensions(context)

    def flow(self, context: openmm.Context) -> Flow:
        """The Flow of the solvent in a Context, at rest where its integrator knows of none."""
        return self._engine.flow_of(context)

    def tethers_in(self, context: openmm.Context) -> tuple[Tether, ...]:
        """Tuple of the tethers of a Context, in the order of their numbers, where they were moved to.

        A State or a checkpoint does not hold them, and ``context.reinitialize`` brings them back to where they were
        added: move them again then.
        """
        moved = self._moved_tethers.get(context, {})
        return tuple(moved.get(number, tether) for number, tether in enumerate(self._tethers))

    def move_tether(self, context: openmm.Context, tether: int, point: Vector, stiffness: Scalar | None = None) -> None:
        """Move the point of a tether in a Context, and change its stiffness if one is given.

        Other Contexts of the System keep theirs.

        Parameters
        ----------
        context : openmm.Context
            Of the System that these filaments were put into.
        tether : int
            Number of the tether, as ``add_tether`` returned it.
        point : (3,) length
        stiffness : energy/length^2, optional

        Raises
        ------
        InputError
            For a tether that does not exist, or a point or a stiffness that is no such thing.
        """
        self._change_tethers(context, [self._moved(context, tether, point, stiffness)])

    def move_tethers(self, context: openmm.Context, tethers: Indices, points: Vectors) -> None:
        """Move the points of several tethers in a Context, at hardly more cost than that of one.

        Parameters
        ----------
        context : openmm.Context
        tethers : sequence of int
        points : (tethers, 3) length
        """
        points = np.asarray(in_units_of(points, LENGTH, "points"))
        if points.shape != (len(tethers), 3):
            raise InputError(f"points must have the shape ({len(tethers)}, 3), but have {points.shape}.")
        self._change_tethers(context, [self._moved(context, *each, None) for each in zip(tethers, points)])

    def _moved(self, context, tether, point, stiffness):
        tether = whole_number(tether, 0, "tether")
        if tether >= len(self._tethers):
            raise InputError(f"Tether {tether} does not exist; there are {len(self._tethers)}.")
        point = tuple(float(x) for x in vector(point, LENGTH, f"Tether {tether}: point"))
        old = self._moved_tethers.get(context, {}).get(tether, self._tethers[tether])
        if stiffness is None:
            stiffness = old.stiffness
        stiffness = positive(stiffness, STIFFNESS, f"Tether {tether}: stiffness")
        return tether, replace(old, point=point, stiffness=stiffness)

    def _change_tethers(self, context, changed):
        moved = {**self._moved_tethers.get(context, {}), **dict(changed)}
        self._engine.set_tethers(context, self._placed(), moved)
        self._moved_tethers[context] = moved

    def _attach(self, attachment):
        self._attachments.append(attachment)
        self._attachments_of[attachment.filament].append(len(self._attachments) - 1)
        return len(self._attachments) - 1

    def _refuse_if_built(self, label):
        if self._nodes is not None:
            raise InputError(f"{label} comes too late: the filaments are already in a System.")

    def _refuse_unless_built(self):
        if self._nodes is None:
            raise InputError("The filaments are not in a System yet: call build or add_to first.")

    def _filament_number(self, filament, label):
        filament = whole_number(filament, 0, f"{label}: filament")
        if filament >= len(self):
            raise InputError(f"{label}: filament {filament} does not exist; there are {len(self)}.")
        return filament

    def _label(self, filament_type):
        if not isinstance(filament_type, ChainType):
            raise InputError(
                f"Filament {len(self)}: filament_type must be a FilamentType, such as F_ACTIN, or a BeadSpringType, "
                f"but is {shown(filament_type)}."
            )
        return f"Filament {len(self)} ({filament_type.name})"

    @staticmethod
    def _given_control_points(filament_type, positions, tangents, control_points, label):
        if tangents is not None:
            raise InputError(f"{label}: give either tangents or control_points, not both.")
        if not filament_type.has_beam_elements:
            raise InputError(f"{label}: control_points belong to nodes of beam elements; its segments are straight.")
        controls = np.array(in_units_of(control_points, LENGTH, f"{label}: control_points"))
        if controls.shape != positions.shape:
            raise InputError(
                f"{label}: control_points must have the shape {positions.shape}, but have {controls.shape}."
            )
        apart = np.linalg.norm(controls - positions, axis=1)
        if not np.all(apart > 0.0):
            raise InputError(f"{label}: the control point of node {int(np.argmin(apart))} is at the node.")
        return controls

    def _add(
        self,
        filament_type,
        positions,
        clamped,
        label,
        closed=False,
        planar=False,
        propulsion=0.0,
        control_points=None,
        clamped_tangents=(),
    ):
        self._refuse_if_built(label)
        if filament_type.has_beam_elements and not self._engine.has_beam_elements:
            raise InputError(f"{label}: the {self._engine_name} engine has no beam elements: use the compiled one.")
        filament = shapes.new_filament(
            filament_type,
            positions,
            clamped,
            label,
            closed,
            planar,
            propulsion,
            control_points,
            clamped_tangents,
        )
        # Friction is computed now, so that a filament that has none is refused here.
        try:
            filament_type.segment_friction(self._viscosity, self._temperature, filament.segments)
        except InputError as error:
            raise InputError(f"{label}: {error}") from None
        self._filaments.append(filament)
        return len(self) - 1
