"""Filaments: puts filaments into a Topology, a System and positions, new or existing."""

from collections import defaultdict
from dataclasses import dataclass, replace

import numpy as np
import openmm
from openmm import app, unit

from .attachments import add_virtual_site, attachment_positions, locate, neighbors
from .contacts import default_stiffness, distribute_beads, filament_diameters
from .engines import choose_engine, default_scheme, load_engine
from .engines.description import describe_chains
from .equilibrium import draw_chain
from .errors import InputError
from .filament import FilamentType
from .flow import as_flow
from .geometry import regular_polygon
from .placement import (
    check_shape,
    clamped_nodes,
    in_one_plane,
    joint_stiffnesses,
    named_nodes,
    planar_direction,
    unit_vector,
    vector,
)
from .quantities import (
    FORCE,
    LENGTH,
    STIFFNESS,
    TEMPERATURE,
    VISCOSITY,
    finite_number,
    in_units_of,
    non_negative,
    positive,
    whole_number,
)
from .tension import filament_tensions
from .timestep import check_scheme, contact_time_step, recommended_time_step, warn_if_unstable

NODE_NAME = "NOD"
"""Atom name of a filament node in topologies."""

MINIMUM_RING = 4
"""Segments that a ring has at least."""


@dataclass(frozen=True)
class Filament:
    """One filament.

    Attributes
    ----------
    type : FilamentType
    positions : (n, 3) array
        Initial node positions in nm.
    clamped : tuple of int
        Nodes that do not move.
    closed : bool
        A ring, whose last node is joined to the first.
    planar : bool
        The nodes keep their z.
    propulsion : float
        F0 in kJ/(mol nm): the force F0 t on every segment, half on either end, with its tangent t.
    """

    type: FilamentType
    positions: np.ndarray
    clamped: tuple
    closed: bool = False
    planar: bool = False
    propulsion: float = 0.0

    @property
    def segments(self):
        """Number of segments."""
        return len(self.positions) - (0 if self.closed else 1)

    @property
    def joint_stiffnesses(self):
        """Bending stiffness of every joint in kJ/mol, see ``placement.joint_stiffnesses``."""
        return joint_stiffnesses(self.type, len(self.positions), self.clamped, self.closed)

    def energies(self, nodes):
        """Stretching and bending energy, in kJ/mol, with node positions (n, 3) in nm."""
        return self.type.chain_energies(nodes, self.joint_stiffnesses, self.closed)


@dataclass(frozen=True)
class Tether:
    """A harmonic spring between a node and a point: energy (k/2) d^2 for their distance d.

    Attributes
    ----------
    filament, node : int
    point : tuple of three floats
        In nm.
    stiffness : float
        k in kJ/(mol nm^2).
    """

    filament: int
    node: int
    point: tuple
    stiffness: float


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

    def __init__(self, viscosity, temperature, engine=None):
        self._engine_name = choose_engine(engine)
        self._engine = load_engine(self._engine_name)
        self._viscosity = positive(viscosity, VISCOSITY, "viscosity")
        self._temperature = non_negative(temperature, TEMPERATURE, "temperature")
        self._filaments = []
        self._tethers = []
        self._tethered_nodes = set()
        self._attachments = []
        self._attachments_of = defaultdict(list)
        self._attachment_indices = None
        self._beads = {}
        self._nodes = None

    def __len__(self):
        return len(self._filaments)

    def __getitem__(self, index):
        return self._filaments[index]

    @property
    def engine(self):
        """Name of the engine that computes the filaments."""
        return self._engine_name

    @property
    def viscosity(self):
        """Viscosity of the solvent in kJ ps/(mol nm^3)."""
        return self._viscosity

    @property
    def temperature(self):
        """Temperature in K."""
        return self._temperature

    @property
    def node_indices(self):
        """List of arrays: the particle indices of the nodes of every filament, once they are in a System."""
        self._refuse_unless_built()
        return self._nodes

    @property
    def tethers(self):
        """Tuple of the tethers, in the order of their numbers, with the points to which they were moved last."""
        return tuple(self._tethers)

    @property
    def attachments(self):
        """Tuple of the attachment points, in the order of their numbers."""
        return tuple(self._attachments)

    @property
    def attachment_indices(self):
        """Particle indices of the attachment points, in the order of their numbers, once they are in a System."""
        self._refuse_unless_built()
        return self._attachment_indices

    @property
    def bead_indices(self):
        """List of arrays: the particle indices of the beads of every filament, once they are in a System."""
        self._refuse_unless_built()
        return [self._attachment_indices[self._beads.get(number, [])] for number in range(len(self))]

    def add_straight(self, filament_type, segments, start, direction, clamped=(), *, planar=False, propulsion=0.0):
        """Add a straight filament with segments of rest length.

        A clamped node alone is a hinge. Two neighbouring ones fix the direction there, too: the joint between a segment
        with both nodes clamped and one that is free is twice as stiff as others, because only the half segment of
        material on its free side can bend. The filament is then clamped exactly at that node.

        Parameters
        ----------
        filament_type : FilamentType
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
            tangent, away from the first node. With a negative F0 the filament moves with its first node in front. It is
            not conservative and has no energy.

        Returns
        -------
        int
            The filament's number.
        """
        label = self._label(filament_type)
        segments = whole_number(segments, 1, f"{label}: segments")
        start = vector(start, LENGTH, f"{label}: start")
        direction = unit_vector(direction, label)
        distance = np.arange(segments + 1) * filament_type.segment_length
        positions = start + distance[:, None] * direction
        return self._add(filament_type, positions, clamped, label, planar=planar, propulsion=propulsion)

    def add_nodes(self, filament_type, positions, clamped=(), *, closed=False, planar=False, propulsion=0.0):
        """Add a filament with given node positions.

        Rest lengths are the type's segment length, whatever the distances between the nodes are.

        Parameters
        ----------
        filament_type : FilamentType
        positions : (n, 3) length
            At least two nodes, four for a ring.
        clamped : sequence of int
            Nodes that do not move; negative numbers count from the end.
        closed : bool
            Make a ring: a last segment leads from the last node back to the first.
        planar, propulsion
            See ``add_straight``.

        Returns
        -------
        int
            The filament's number.
        """
        label = self._label(filament_type)
        positions = np.atleast_1d(in_units_of(positions, LENGTH, f"{label}: positions"))
        if positions.ndim != 2 or positions.shape[1] != 3:
            raise InputError(f"{label}: positions must have the shape (n, 3), but have {positions.shape}.")
        if len(positions) < 2:
            raise InputError(f"{label} needs at least two nodes (one segment), but has {len(positions)}.")
        return self._add(filament_type, positions.copy(), clamped, label, closed, planar, propulsion)

    def add_ring(
        self, filament_type, segments, center, normal=(0.0, 0.0, 1.0), *, clamped=(), planar=False, propulsion=0.0
    ):
        """Add a ring: a regular polygon with segments of rest length.

        Parameters
        ----------
        filament_type : FilamentType
        segments : int
            At least four.
        center : (3,) length
        normal : (3,) array
            Of the polygon's plane; nodes go counter-clockwise around it. It need not be normalised.
        clamped, planar, propulsion
            See ``add_straight``.

        Returns
        -------
        int
            The filament's number.
        """
        label = self._label(filament_type)
        segments = whole_number(segments, 1, f"{label}: segments")
        center = vector(center, LENGTH, f"{label}: center")
        positions = regular_polygon(
            segments, filament_type.segment_length, center, unit_vector(normal, label, "normal")
        )
        return self._add(filament_type, positions, clamped, label, True, planar, propulsion)

    def add_equilibrium(
        self,
        filament_type,
        segments,
        seed,
        start=(0.0, 0.0, 0.0),
        direction=None,
        clamped=(),
        *,
        planar=False,
        propulsion=0.0,
    ):
        """Add a filament drawn from the exact equilibrium of the free discrete chain.

        Segment lengths come from rho(l), joint angles from rho(c) (see ``openmm_cylchain.equilibrium``), or, if the
        filament is planar, from those of two dimensions.

        Parameters
        ----------
        filament_type : FilamentType
        segments : int
        seed : int
            The same seed gives the same chain.
        start : (3,) length
            Position of the first node.
        direction : (3,) array, optional
            Direction of the first segment; drawn from the sphere, or from the plane's directions, if not given.
        clamped : sequence of int
            Nodes that do not move; negative numbers count from the end.
        planar, propulsion
            See ``add_straight``.

        Returns
        -------
        int
            The filament's number.
        """
        label = self._label(filament_type)
        segments = whole_number(segments, 1, f"{label}: segments")
        start = vector(start, LENGTH, f"{label}: start")
        planar = _flag(planar, f"{label}: planar")
        if direction is not None:
            direction = unit_vector(direction, label)
            direction = planar_direction(direction, label) if planar else direction
        if self._temperature == 0:
            raise InputError(f"{label}: an equilibrium draw needs a temperature above zero.")
        generator = np.random.default_rng(whole_number(seed, 0, f"{label}: seed"))
        stiffnesses = joint_stiffnesses(filament_type, segments + 1, clamped_nodes(clamped, segments + 1, label))
        positions = draw_chain(
            filament_type, segments, self._temperature, generator, start, direction, planar, stiffnesses
        )
        return self._add(filament_type, positions, clamped, label, planar=planar, propulsion=propulsion)

    def add_tether(self, filament, node, point, stiffness):
        """Tether a node to a point by a harmonic spring, such as an optical trap: energy (k/2) |x - point|^2.

        Scheme "implicit" takes tethers at the end of the step, like the filament's own forces, so they may be as stiff
        as a segment. The explicit schemes, and other OpenMM forces in all schemes, need a step well below
        2 gamma/k, where gamma is the friction of what the spring pulls, at least a quarter of a segment's parallel
        friction per segment that meets in the node.

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
        point = tuple(float(x) for x in vector(point, LENGTH, f"{label}: point"))
        stiffness = positive(stiffness, STIFFNESS, f"{label}: stiffness")
        self._tethers.append(Tether(filament, node, point, stiffness))
        self._tethered_nodes.add((filament, node))
        return len(self._tethers) - 1

    def add_attachment(self, filament, arc_length=None, segment=None, fraction=None):
        """Add an attachment point: a virtual site on a segment, on which any OpenMM force can act.

        It is at ``(1 - fraction) x_minus + fraction x_plus`` of its segment's ends and follows them in the same
        step; a force on it acts at that place of the cylinder (step 5 of Section 4 of the paper). It becomes a
        particle of its own behind the nodes of its filament, in the Topology with the name "ATT";
        ``attachment_indices`` says which.

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

    def add_beads(self, filament, spacing):
        """Cover a filament evenly with beads, on which contact forces act (see ``openmm_cylchain.contacts``).

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

    def _attach(self, attachment):
        self._attachments.append(attachment)
        self._attachments_of[attachment.filament].append(len(self._attachments) - 1)
        return len(self._attachments) - 1

    def move_tether(self, context, tether, point, stiffness=None):
        """Move the point of a tether in a Context, and change its stiffness if one is given.

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
        self._change_tethers(context, [self._moved(tether, point, stiffness)])

    def move_tethers(self, context, tethers, points):
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
        self._change_tethers(context, [self._moved(tether, point, None) for tether, point in zip(tethers, points)])

    def _moved(self, tether, point, stiffness):
        tether = whole_number(tether, 0, "tether")
        if tether >= len(self._tethers):
            raise InputError(f"Tether {tether} does not exist; there are {len(self._tethers)}.")
        point = tuple(float(x) for x in vector(point, LENGTH, f"Tether {tether}: point"))
        old = self._tethers[tether]
        if stiffness is None:
            stiffness = old.stiffness
        stiffness = positive(stiffness, STIFFNESS, f"Tether {tether}: stiffness")
        return tether, replace(old, point=point, stiffness=stiffness)

    def _change_tethers(self, context, changed):
        self._engine.move_tethers(context, changed, self.node_indices)
        for number, tether in changed:
            self._tethers[number] = tether

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
        if not isinstance(filament_type, FilamentType):
            raise InputError(
                f"Filament {len(self)}: filament_type must be a FilamentType, such as F_ACTIN, but is "
                f"{filament_type!r}."
            )
        return f"Filament {len(self)} ({filament_type.name})"

    def _add(self, filament_type, positions, clamped, label, closed=False, planar=False, propulsion=0.0):
        self._refuse_if_built(label)
        closed, planar = _flag(closed, f"{label}: closed"), _flag(planar, f"{label}: planar")
        if closed and len(positions) < MINIMUM_RING:
            raise InputError(f"{label}: a ring needs at least {MINIMUM_RING} segments, but has {len(positions)}.")
        check_shape(filament_type, positions, label, closed)
        if planar:
            positions = in_one_plane(positions, filament_type.segment_length, label)
        filament = Filament(
            filament_type,
            positions,
            clamped_nodes(clamped, len(positions), label),
            closed,
            planar,
            finite_number(propulsion, FORCE, f"{label}: propulsion"),
        )
        # Friction is computed now, so that a filament that has none is refused here.
        try:
            filament_type.segment_friction(self._viscosity, self._temperature, filament.segments)
        except InputError as error:
            raise InputError(f"{label}: {error}") from None
        self._filaments.append(filament)
        return len(self) - 1

    def build(self, box_vectors=None, stretching_force_group=0, bending_force_group=0):
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
        """
        topology, system = app.Topology(), openmm.System()
        if box_vectors is not None:
            vectors = [openmm.Vec3(*vector(edge, LENGTH, "box_vectors")) for edge in box_vectors]
            system.setDefaultPeriodicBoxVectors(*vectors)
            topology.setPeriodicBoxVectors(vectors * unit.nanometer)
        positions = self.add_to(
            topology, system, np.zeros((0, 3)) * unit.nanometer, stretching_force_group, bending_force_group
        )
        return topology, system, positions

    def add_to(self, topology, system, positions, stretching_force_group=0, bending_force_group=0):
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
        positions = self._check_target(topology, system, positions)
        self._check_force_groups(stretching_force_group, bending_force_group)
        self._nodes = []
        self._attachment_indices = np.zeros(len(self._attachments), dtype=int)
        everything = [positions]
        for number, filament in enumerate(self._filaments):
            first = system.getNumParticles()
            self._nodes.append(np.arange(first, first + len(filament.positions)))
            self._add_particles(system, filament)
            everything += [filament.positions, self._add_attachments(system, number)]
            self._add_to_topology(topology, filament, number)
        self._add_noninteracting_entries(system, positions)
        self._engine.add_forces(
            system,
            self._filaments,
            self._nodes,
            self._tethers,
            self._viscosity,
            self._temperature,
            stretching_force_group,
            bending_force_group,
        )
        return np.concatenate(everything) * unit.nanometer

    def _add_attachments(self, system, number):
        # Those of one filament; returns their positions.
        attachments = [self._attachments[index] for index in self._attachments_of[number]]
        for index, attachment in zip(self._attachments_of[number], attachments):
            self._attachment_indices[index] = add_virtual_site(system, attachment, self._nodes[number])
        return attachment_positions(attachments, self._filaments[number].positions)

    def _check_target(self, topology, system, positions):
        if not self._filaments:
            raise InputError("There are no filaments to add: call add_straight, add_nodes or add_equilibrium first.")
        if self._nodes is not None:
            raise InputError("These filaments are already in a System; make another Filaments for another System.")
        positions = np.asarray(in_units_of(positions, LENGTH, "positions"))
        count = system.getNumParticles()
        if topology.getNumAtoms() != count:
            raise InputError(f"The Topology has {topology.getNumAtoms()} atoms, but the System has {count} particles.")
        if positions.size == 0 and count == 0:
            positions = np.zeros((0, 3))
        if positions.shape != (count, 3):
            raise InputError(f"positions must have the shape ({count}, 3), but have {positions.shape}.")
        for force in system.getForces():
            if force.getName().startswith("CylinderChain"):
                raise InputError("The System already holds filaments: add all of them through one Filaments object.")
        return positions

    @staticmethod
    def _check_force_groups(*groups):
        for group in groups:
            if whole_number(group, 0, "force group") > 31:
                raise InputError(f"A force group must be between 0 and 31, but is {group}.")

    def _add_to_topology(self, topology, filament, number):
        chain = topology.addChain(f"F{number}")
        nodes = len(filament.positions)
        names = [NODE_NAME] * nodes + [self._attachments[index].name for index in self._attachments_of[number]]
        previous = None
        for particle, name in enumerate(names):
            residue = topology.addResidue(filament.type.name, chain, str(particle + 1))
            atom = topology.addAtom(name, None, residue)
            if 0 < particle < nodes:
                topology.addBond(previous, atom)
            previous = atom
            if particle == 0:
                first = atom
            if filament.closed and particle == nodes - 1:
                topology.addBond(atom, first)

    @staticmethod
    def _add_particles(system, filament):
        # Each segment's mass goes to its two ends in equal parts.
        masses = np.full(len(filament.positions), filament.type.segment_mass)
        if not filament.closed:
            masses[[0, -1]] *= 0.5
        masses[list(filament.clamped)] = 0.0
        for mass in masses:
            system.addParticle(mass)

    def _add_noninteracting_entries(self, system, existing):
        missing = system.getNumParticles() - len(existing)
        for force in system.getForces():
            if isinstance(force, openmm.NonbondedForce):
                for _ in range(missing):
                    force.addParticle(0.0, 1.0, 0.0)
                # Particles in one place would give 0/0, even if they do not interact.
                for pair in self._coinciding():
                    force.addException(*pair, 0.0, 1.0, 0.0)
            elif isinstance(force, openmm.CustomNonbondedForce):
                _exclude_from_custom_nonbonded(force, len(existing), missing)

    def _coinciding(self):
        for number, nodes in enumerate(self._nodes):
            mine = self._attachments_of[number]
            yield from neighbors([self._attachments[index] for index in mine], self._attachment_indices[mine], nodes)

    def recommended_time_step(self, scheme=None, contact_diameter=None, contact_stiffness=None, confidence=3.0):
        """The recommended step for the filament that allows the least: a TimeStep (see ``timestep``).

        Other forces in the System, and particles outside filaments, may need a smaller step.

        Parameters
        ----------
        scheme : {"implicit", "midpoint", "euler"}, optional
            The engine's default if not given.
        contact_diameter : length, or (filaments,) array of lengths, optional
            Filaments that touch at this distance must not jump through each other, eq. (56), nor be thrown apart by
            the contact force: see ``timestep.contact_time_step``.
        contact_stiffness : energy/length^2, optional
            Of the contact force; that of ``contacts.default_stiffness`` if not given.
        confidence : float
            c_sigma of eq. (53): how many standard deviations of a displacement must stay below half the diameter.
        """
        scheme = default_scheme(self._engine_name) if scheme is None else scheme
        steps = [
            recommended_time_step(filament.type, self._viscosity, self._temperature, scheme, filament.segments)
            for filament in self._filaments
        ]
        if not steps:
            raise InputError("There are no filaments to recommend a time step for.")
        least = min(steps, key=lambda step: step.step)
        if contact_diameter is None:
            if contact_stiffness is not None:
                raise InputError("A contact_stiffness needs a contact_diameter.")
            return least
        contact = self._contact_time_step(contact_diameter, contact_stiffness, confidence)
        return replace(min(least, contact, key=lambda step: step.step), bounds={**least.bounds, **contact.bounds})

    def _contact_time_step(self, diameter, stiffness, confidence):
        diameters = filament_diameters(diameter, len(self))
        if stiffness is None:
            if self._temperature == 0.0:
                raise InputError("At a temperature of zero, contacts need a contact_stiffness.")
            stiffness = default_stiffness(diameters.min(), self._temperature)
        solvent = (self._viscosity, self._temperature)
        steps = []
        for number, (filament, d) in enumerate(zip(self._filaments, diameters)):
            density = max(1.0, len(self._beads.get(number, ())) / filament.segments)
            steps.append(
                contact_time_step(filament.type, *solvent, d, stiffness, filament.segments, density, confidence)
            )
        return min(steps, key=lambda step: step.step)

    def create_integrator(
        self, system, step_size, scheme=None, temperature=None, particle_friction=None, random_seed=0, flow=None
    ):
        """Create the integrator that moves the filaments and everything else in the System.

        Call it when all forces and particles are in the System: it also adds to the System the force
        that redistributes forces along the chains.

        Parameters
        ----------
        system : openmm.System
            The System that the filaments were put into.
        step_size : time
        scheme : {"implicit", "midpoint", "euler"}, optional
            "implicit", the compiled engine's default, takes stretching, bending and tethers at the end of the step,
            and steps a thousand times as long as the others. "midpoint", the portable engine's default, is Fixman's
            explicit scheme with the right drift on chains. "euler" is Section 4 of the paper, biased on chains.
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

        Returns
        -------
        openmm.Integrator
            Of the engine: a NativeIntegrator or a PortableIntegrator.

        Warns
        -----
        TimeStepWarning
            If the step exceeds a bound of stability.
        """
        step_size = positive(step_size, unit.picosecond, "step_size")
        if system.getNumParticles() <= max(nodes.max() for nodes in self.node_indices):
            raise InputError("This is not the System that the filaments were put into: it has too few particles.")
        scheme = default_scheme(self._engine_name) if scheme is None else scheme
        check_scheme(scheme)
        flow = as_flow(flow)
        for filament in {(f.type, f.segments): f for f in self._filaments}.values():
            warn_if_unstable(filament.type, self._viscosity, self._temperature, step_size, filament.segments, scheme)
        return self._engine.create_integrator(
            system,
            self._filaments,
            self._nodes,
            self._viscosity,
            self._temperature,
            self._temperature if temperature is None else temperature,
            step_size,
            scheme,
            particle_friction,
            random_seed,
            flow,
        )

    def chain_set(self, system):
        """The filaments as an engine sees them (a ``ChainSet``): friction of segments and fixed nodes."""
        return describe_chains(system, self._filaments, self.node_indices, self._viscosity, self._temperature)

    def joint_tensions(self, context):
        """Virtual forces Phi at the joints, eqs. (22)-(24), in the context's present configuration and flow.

        Phi of joint i is the force that segment i + 1 exerts on segment i; its component along the chain is
        positive under tension. Random forces are left out: this is the mean over the noise of a step.
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

    def flow(self, context):
        """The Flow of the solvent in a Context, at rest where its integrator knows of none."""
        return self._engine.flow_of(context)


def _flag(value, name):
    if not isinstance(value, (bool, np.bool_)):
        raise InputError(f"{name} must be True or False, but is {value!r}.")
    return bool(value)


def _exclude_from_custom_nonbonded(force, existing, missing):
    for _ in range(missing):
        force.addParticle([0.0] * force.getNumPerParticleParameters())
    if missing and force.getNumInteractionGroups() == 0:
        force.addInteractionGroup(range(existing), range(existing))
