"""What is tied to filaments before they are in a System: tethers, attachment points, beads and linkers."""

from __future__ import annotations

from collections import defaultdict
from collections.abc import Sequence
from dataclasses import replace
from typing import Any
from weakref import WeakKeyDictionary

import numpy as np

from ..couplings.shapes import Shape
from ..engines.protocol import PlacedFilaments
from ..errors import InputError
from ..filaments.attachments import Attachment, distribute_beads, locate
from ..filaments.filament import Tether
from ..filaments.placement import named_nodes
from ..filaments.refusals import HELD_BY_LINKERS, growth_refusal
from ..filaments.segment_place import SegmentPlace
from ..filaments.twist import EndFrame, has_twist
from ..kinetics.barrier import Barrier, as_barrier
from ..kinetics.crosslinker import Crosslinker
from ..kinetics.first_places import contour_of
from ..kinetics.growth_force import branchings_of
from ..kinetics.linkers import Linkers, as_linkers, warn_if_springs_do_not_fit
from ..units.quantities import LENGTH, STIFFNESS, non_negative, positive, shown, vector, whole_number
from ..units.types import Indices, IntArray, Scalar, Vector, Vectors
from .added_filaments import AddedFilaments

_AGAINST = -0.9
"""The cosine from which on the direction of an end frame is against its filament, where its joint has no twist."""


class TiedFilaments(AddedFilaments):
    """Filaments with tethers, attachment points, beads and linkers: what ``Filaments`` adds to them."""

    def __init__(self, viscosity: Scalar, temperature: Scalar, engine: str | None = None) -> None:
        super().__init__(viscosity, temperature, engine)
        self._tethers: list[Tether] = []
        self._tethered_nodes: set[tuple[int, int]] = set()
        self._end_frames: list[EndFrame] = []
        self._linkers: list[Linkers] = []
        self._barriers: list[Barrier] = []
        # For so many filaments: the linkers of the joints of their branches.
        self._joints: tuple[int, list[Linkers]] = (0, [])
        # By Context: what has moved there, by number.
        self._moved_tethers: WeakKeyDictionary[Any, dict[int, Tether]] = WeakKeyDictionary()
        self._attachments: list[Attachment] = []
        self._attachments_of: defaultdict[int, list[int]] = defaultdict(list)
        self._attachment_indices: Any = None
        self._beads: dict[int, list[int]] = {}

    @property
    def tethers(self) -> tuple[Tether, ...]:
        """Tuple of the tethers as they were added, in order of their numbers; see ``FilamentsInContext.tethers``."""
        return tuple(self._tethers)

    @property
    def end_frames(self) -> tuple[EndFrame, ...]:
        """Tuple of the frames beyond ends of filaments, as they were added."""
        return tuple(self._end_frames)

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
            The tether's number, for ``FilamentsInContext.move_tether``.

        Raises
        ------
        InputError
            For a filament or node that does not exist, a node of a filament that grows but for the first one of a
            capped minus end, a second tether, or a stiffness that is not positive.
        """
        label = f"Tether {len(self._tethers)}"
        self._refuse_if_built(label)
        filament = self._filament_number(filament, label)
        (node,) = named_nodes([node], len(self[filament].positions), f"{label}:")
        own = self[filament]
        if own.is_reserve or (own.growth is not None and not (node == 0 and own.growth.keeps_first_node)):
            advice = "Its first node can, with minus_capped=True, if it does not vanish."
            self._lasting_filament(filament, label, "a tether", "" if own.is_reserve else advice)
        if (filament, node) in self._tethered_nodes:
            raise InputError(f"{label}: node {node} of filament {filament} has a tether already.")
        x, y, z = (float(x) for x in vector(point, LENGTH, f"{label}: point"))
        stiffness = positive(stiffness, STIFFNESS, f"{label}: stiffness")
        self._tethers.append(Tether(filament, node, (x, y, z), stiffness))
        self._tethered_nodes.add((filament, node))
        return len(self._tethers) - 1

    def add_end_frame(
        self,
        filament: int,
        end: str,
        direction: Vector,
        *,
        torque: Scalar | None = None,
        angular_velocity: Scalar = 0.0,
        rotational_friction: Scalar | None = None,
        body: int | None = None,
    ) -> None:
        """Bind the material at an end of a filament with twist to a frame beyond it, such as that of a magnetic bead.

        Half a segment of material is between the frame and that of the last segment: a joint with the stiffness 2C/l0
        against twist, which does not bend. So an end that is held keeps its turns, whatever the filament does, and the
        linking number of a filament that is held at both ends is kept, if clamped nodes or forces keep its ends near to
        the directions. An end without a frame is free.

        A frame with a rotational_friction Z is a bead that turns by psi, with the twist m of that joint and its noise:

            Z dpsi/dt = torque + noise -(2C/l0) m at a plus end, + (2C/l0) m at a minus end,

        of first order in the step, and in equilibrium at any step.

        A frame that a rigid body carries turns with it, whichever way it turns, and its joint turns the body: with the
        direction a of the frame, and b of the last segment, by the couple

            -(2C/l0) m (a+b)/(1+a.b) at a plus end, and the opposite one at a minus end.

        It is that when the filament has taken its step, and stays while it turns the body: so 2C/l0 must turn the body
        by itself little in a step, which ``recommended_time_step`` knows. Links hold the end on the body, as without a
        frame.

        Parameters
        ----------
        filament : int
            The filament's number.
        end : {"minus", "plus"}
            That of the first node, or that of the last.
        direction : (3,) array
            From minus to plus, where the filament would go on beyond its plus end, or has come from at its minus end.
            It does not change, and need not be normalised.
        torque : energy, optional
            A torque about the direction on a frame that turns about it. The frame is held if neither a torque nor a
            rotational_friction is given. Without a friction, it turns with the last segment.
        angular_velocity : angle/time
            How fast a frame that is held turns about the direction; radians/ps if a plain number.
        rotational_friction : energy time, optional
            Of a frame that turns against it, such as a bead: pi eta d**3 of a sphere about its middle.
        body : int, optional
            The number of the body that carries the frame, as ``add_body`` returns it: the direction is that where the
            body begins, and an angular_velocity is that against the body.

        Raises
        ------
        InputError
            For a filament, an end or a body that does not exist, a ring, a filament without twist, a second frame, a
            direction against the filament, a friction that is not positive, an angular velocity of a frame that is not
            held, or a torque or friction of one that a body carries.

        Examples
        --------
        >>> filaments.add_end_frame(0, "minus", [0, 0, 1])  # doctest: +SKIP
        >>> filaments.add_end_frame(0, "plus", [0, 0, 1], torque=8 * unit.piconewton * unit.nanometer)  # doctest: +SKIP
        """
        label = f"End frame {len(self._end_frames)}"
        self._refuse_if_built(label)
        number = self._filament_number(filament, label)
        own = self[number]
        if not has_twist(own.type):
            raise InputError(f"{label}: filament {number} has no twist: give its type a twist_persistence_length.")
        if own.closed:
            raise InputError(f"{label}: filament {number} is a ring, and has no ends.")
        frame = EndFrame(
            number,
            end,
            direction,  # type: ignore[arg-type]
            torque,
            angular_velocity,
            rotational_friction,
            body,
        )
        if frame.body is not None and frame.body >= len(self.bodies):
            raise InputError(f"{label}: body {frame.body} does not exist: add it first, by add_body.")
        if own.rest_bends is not None and frame.end == "minus" and frame.angular_velocity != 0.0:
            raise InputError(
                f"{label}: filament {number} has rest_bends, which would turn with its minus end: turn its plus end."
            )
        if own.rest_bends is not None and (frame.body, frame.rotational_friction) != (None, None):
            raise InputError(
                f"{label}: filament {number} has rest_bends, and its frames cannot have a friction or a body yet."
            )
        last = np.diff(own.positions[:2] if frame.end == "minus" else own.positions[-2:], axis=0)[0]
        if last @ np.array(frame.direction) < _AGAINST * np.linalg.norm(last):
            raise InputError(
                f"{label}: the direction points against filament {number} at its {frame.end} end: it must be that from "
                "minus to plus, at both ends."
            )
        if any(other.filament == number and other.end == end for other in self._end_frames):
            raise InputError(f"{label}: the {end} end of filament {number} has a frame already.")
        self._end_frames.append(frame)

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
            For a filament, segment or place that does not exist, or a filament that grows.
        """
        label = f"Attachment point {len(self._attachments)}"
        self._refuse_if_built(label)
        filament = self._lasting_filament(filament, label, "an attachment point", HELD_BY_LINKERS)
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
            For a filament, segment or place that does not exist, a filament that grows, or before ``build`` or
            ``add_to``.
        """
        label = "Place on a segment"
        filament = self._lasting_filament(filament, label, "a place on a segment", HELD_BY_LINKERS)
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
            For a filament that does not exist, grows or has beads already, or a spacing that is not positive.
        """
        label = f"Beads of filament {shown(filament)}"
        self._refuse_if_built(label)
        filament = self._lasting_filament(
            filament, label, "beads", "capsule_contact_force and filament_wall_force need none."
        )
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
        diffusion: Scalar | None = None,
        planar: bool = False,
        region: Shape | Sequence[Shape] | None = None,
        places: Sequence[tuple[int, Scalar] | tuple[tuple[int, Scalar], tuple[int, Scalar]]] | None = None,
    ) -> int:
        """Add linkers that bind to filaments, walk along them and unbind: crosslinkers or motors.

        While they are not bound, they are anywhere: a linker binds its first hand with the rate
        ``binding_rate/(2 reach) v/V`` for each length of filament, where V is the volume in which unbound linkers are
        and v = (4 pi/3) R^3 with the reach R (of hands that differ, the geometric mean of both v). How many there are
        of them, and where they are bound, belongs to each Context: ``FilamentsInContext.linkers``.

        With ``diffusion``, each of them has a position while it is not bound, within its region and the periodic box. A
        hand binds to what is within its reach R of there, with the rate ``binding_rate/(2 R) (R'/R)^(3/2)`` for each
        length of filament, R' being the reach of the other hand, and unbinds to anywhere in a sphere with the radius R,
        but not through a wall. In equilibrium, that makes the same numbers of bound linkers.

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
        diffusion : length^2/time, optional
            Diffusion coefficient of those that are not bound, of a count of linkers. Which of them bind is right where
            they move less far in a step, (2 D h)^(1/2), than it takes to where their density is another one.
        planar : bool
            Whether those that are not bound stay in the plane z = 0. The factor of the rate is R'/R then.
        region : Shape, or several, optional
            What those that diffuse are within; the walls of the System (``filament_wall_force``) if not given.
        places : sequence of (filament, arc length), or of pairs of these, optional
            Where those begin bound, for each of them: the number of a filament, and the distance from its first node
            along it with segments at rest; of linkers without anchors also two such places, one for each hand. Hands
            that never unbind hold what grows for ever, as an attachment or a crosslink does.

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
        linkers = as_linkers(kind, count, concentration, volume, anchors, bound, seed, diffusion, planar, region)
        if places is not None:
            linkers = replace(linkers, places=self._first_places(places, linkers))
        self._linkers.append(linkers)
        warn_if_springs_do_not_fit(kind, self.temperature)
        return len(self._linkers) - 1

    def add_barrier(
        self,
        filament: int,
        arc_length: Scalar,
        *,
        toward: str,
        release_rate: Scalar,
        capture_probability: float = 1.0,
    ) -> int:
        """Add a barrier: a place on a filament that captures hands which walk past it, as CTCF captures cohesin.

        A hand that it has captured stays there, bound, until the barrier lets it go on. It feels the force of its
        spring, and unbinds with the rate that it has elsewhere. Hands that bind beside it, or are pulled past it
        backward, are not captured. On sites, the one that has the barrier holds the hand.

        Parameters
        ----------
        filament : int
            The filament's number.
        arc_length : length
            From the first node, with segments at rest.
        toward : {"plus", "minus", "both"}
            It captures hands that walk towards this end. CTCF captures those that come to it from the side to which its
            motif points: a motif that points to the plus end has ``toward="minus"``.
        release_rate : 1/time
            At which it lets a hand go on; 0 if it never does.
        capture_probability : float
            How likely it captures a hand that comes by.

        Returns
        -------
        int
            The barrier's number.

        Raises
        ------
        InputError
            For a filament or place that does not exist, a filament that grows, or a value that is missing or wrong.
        """
        label = f"Barrier {len(self._barriers)}"
        self._refuse_if_built(label)
        if not self._engine.has_linkers:
            raise InputError(f"{label}: the {self._engine_name} engine has no linkers; use the compiled one.")
        filament = self._lasting_filament(filament, label, "a barrier")
        length = float(contour_of(self[filament])[-1])
        self._barriers.append(as_barrier(filament, arc_length, toward, release_rate, capture_probability, length))
        return len(self._barriers) - 1

    @property
    def barriers(self) -> tuple[Barrier, ...]:
        """Tuple of the barriers, in the order of their numbers."""
        return tuple(self._barriers)

    @property
    def linkers(self) -> tuple[Linkers, ...]:
        """Tuple of the types of linkers, in the order of their numbers, as they were added, and behind them those of
        the joints of branches."""
        if self._joints[0] != len(self):
            joints = [
                own.linkers(f"branch_{number}", self.temperature) for number, own in branchings_of(self._filaments)
            ]
            self._joints = len(self), [linkers for joint in joints for linkers in joint]
        return (*self._linkers, *self._joints[1])

    def _first_places(self, places, linkers):
        label = f"Linkers {linkers.kind.name!r}"
        hands = linkers.kind.hands[0 if linkers.anchors is None else 1 :]
        if len(places) != linkers.bound:
            raise InputError(f"{label}: {linkers.bound} begin bound, but there are {len(places)} places for them.")
        found = []
        for own in places:
            of_hands = own if isinstance(own[0], (tuple, list)) else (own,)
            if len(of_hands) > len(hands):
                raise InputError(f"{label}: a linker with an anchor has one hand, and one place.")
            found.append(tuple(self._first_place(place, hand, label) for place, hand in zip(of_hands, hands)))
            if len(of_hands) == 2 and found[-1][0][0] == found[-1][1][0] and not linkers.kind.same_filament:
                raise InputError(f"{label}: both hands are on filament {found[-1][0][0]}: add same_filament=True.")
        return tuple(found)

    def _first_place(self, place, hand, label):
        filament, along = place
        number = self._filament_number(filament, label)
        along = non_negative(along, LENGTH, f"{label}: places")
        length = contour_of(self[number])[-1]
        if not hand.binds(self[number].type) or hand.site_spacing is not None:
            raise InputError(f"{label}: places are for hands without sites, which bind to filament {number}.")
        if self[number].is_reserve:
            raise InputError(f"{label}: filament {number} is not there yet, so that no hand can be bound to it.")
        if along > length * (1.0 + 1e-9):
            raise InputError(f"{label}: {along:g} nm is beyond the end of filament {number}, {length:g} nm long.")
        return number, min(along, length)

    def _attach(self, attachment):
        self._attachments.append(attachment)
        self._attachments_of[attachment.filament].append(len(self._attachments) - 1)
        return len(self._attachments) - 1

    def _filament_number(self, filament, label):
        filament = whole_number(filament, 0, f"{label}: filament")
        if filament >= len(self):
            raise InputError(f"{label}: filament {filament} does not exist; there are {len(self)}.")
        return filament

    def _lasting_filament(self, filament, label, what, advice=""):
        number = self._filament_number(filament, label)
        own = self[number]
        if own.growth is not None:
            raise InputError(f"{label}: {growth_refusal(f'filament {number} ({own.type.name})', what, advice)}")
        return number

    def _placed(self):
        return PlacedFilaments(
            tuple(self._filaments),
            tuple(self.node_indices),
            tuple(self._tethers),
            self._viscosity,
            self._temperature,
            self.linkers,
            self._periodic,
            tuple(self._control_points),
            tuple(self._bodies),
            tuple(self.body_indices),
            barriers=tuple(self._barriers),
            end_frames=tuple(self._end_frames),
        )
