"""FilamentCollection: filaments, tethers, attachment points and beads, before anything is built."""

from collections import defaultdict
from dataclasses import dataclass

import numpy as np

from ..couplings.contacts import distribute_beads
from ..errors import InputError
from ..mechanics.geometry import regular_polygon
from ..units.quantities import (
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
from .attachments import locate
from .equilibrium import draw_chain
from .filament_type import FilamentType
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


class FilamentCollection:
    """Filaments in a solvent, and what belongs to them: what ``Filaments`` puts into a System.

    Parameters
    ----------
    viscosity : pressure*time
    temperature : temperature
    """

    def __init__(self, viscosity, temperature):
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
        with both nodes clamped and one that is free is about twice as stiff as others, because only the half segment of
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

        Segment lengths come from rho(l), joint angles from rho(c) (see ``openmm_cylchain.filaments.equilibrium``), or, if the
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


def _flag(value, name):
    if not isinstance(value, (bool, np.bool_)):
        raise InputError(f"{name} must be True or False, but is {value!r}.")
    return bool(value)
