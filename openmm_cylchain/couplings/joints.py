"""Joints: moments that hold the angle between two filaments of beam elements, or between one and a direction."""

from __future__ import annotations

from typing import Any

import numpy as np
import openmm

from ..errors import InputError
from ..filaments.segment_place import SegmentPlace
from ..units.quantities import ANGLE, ENERGY, in_units_of, positive, require_kind, shown, unit_vector
from ..units.types import FloatArray, Indices, IntArray, Scalar, Vector
from .beam_curves import BeamCurves
from .crosslink_tables import CrosslinkTable
from .crosslinks import Crosslinks
from .native_links import is_of_compiled_engine

JOINTS_NAME = "Joints"


class Joints:
    """Moments between tangents of beam elements: what a crosslink is to places, a joint is to directions.

    A joint has an energy of the angle theta between the unit vectors t1 and t2 along two filaments at places on their
    curves, with its minimum at the angle theta0 and the curvature k there:

        V = (k/2) ((|t1 - t2| - 2 sin(theta0/2))/cos(theta0/2))^2,    |t1 - t2| = 2 sin(theta/2),

    which is ``k (1 - cos theta)`` where theta0 is zero, that of a rod of length a and rigidity EI = k a that bends. It
    holds no place: with a crosslink without rest length at the same two places, filaments are welded together, end to
    end or anywhere along them.

    The vectors are dr/ds of the curve, whose absolute value differs from 1 by the strain, some thousandths at most.
    Scheme "implicit" has joints in its equations, however stiff they are. Joints come and go as Crosslinks do, and
    checkpoints hold them; the methods that take a Context mean that one alone, or with None all that begin later.

    Parameters
    ----------
    stiffness : energy
        k of a joint that is given none of its own, per square radian.

    Raises
    ------
    InputError
        For a stiffness that is not positive or of the wrong unit.

    Examples
    --------
    >>> from openmm_cylchain import F_ACTIN, Filaments, Joints
    >>> from dataclasses import replace
    >>> beam = replace(F_ACTIN, element="beam", extension_relaxation_time=None)
    >>> filaments = Filaments(viscosity=1030, temperature=310)
    >>> for start in ([0, 0, 0], [720, 0, 0]):
    ...     _ = filaments.add_straight(beam, segments=2, start=start, direction=[1, 0, 0])
    >>> topology, system, positions = filaments.build()
    >>> joints = Joints(stiffness=1000.0)
    >>> joints.add(None, filaments.segment_place(0, arc_length=720), filaments.segment_place(1, arc_length=0))
    0
    >>> force = joints.add_to(system)
    """

    def __init__(self, stiffness: Scalar) -> None:
        self._stiffness = positive(stiffness, ENERGY, "Joints: stiffness")
        self._links = Crosslinks(self._stiffness, 0.0)
        self._curves: BeamCurves | None = None

    def add_to(self, system: openmm.System, force_group: int = 0) -> openmm.Force:
        """Add the force to a System, when its filaments are there and before the integrator is created.

        Returns
        -------
        CylinderChainLinkForce

        Raises
        ------
        InputError
            If these joints are in a System already, or one is not on a filament of beam elements of it.
        """
        require_kind(system, openmm.System, "system")
        curves = BeamCurves.of_system(system) if is_of_compiled_engine(system) else None
        if curves is None:
            raise InputError("Joints are between filaments of beam elements, of which this System has none.")
        self._check(self._links.table(None), curves, system.getNumParticles())
        force: Any = self._links.add_to(system, force_group, periodic=False)
        force.setJoinsTangents(True)
        force.setName(JOINTS_NAME)
        self._curves = curves
        return force

    def add(
        self,
        context: openmm.Context | None,
        first: SegmentPlace,
        second: SegmentPlace | Vector,
        angle: Scalar = 0.0,
        stiffness: Scalar | None = None,
    ) -> int:
        """Add a joint.

        Parameters
        ----------
        context : openmm.Context or None
        first : SegmentPlace
            Where t1 is, as ``Filaments.segment_place`` returns it: t1 points to the last node of the filament. With its
            two particles exchanged and ``1 - fraction``, it points to the first.
        second : SegmentPlace or (3,) array
            Where t2 is, or t2 itself, a direction that does not change; it need not be normalised.
        angle : angle
            theta0, from 0 to a right angle; exchange the particles of one of the two for a larger one.
        stiffness : energy, optional
            k of this joint, if it differs from that of the others.

        Returns
        -------
        int
            The joint's number.

        Raises
        ------
        InputError
            For a place that is not on a filament of beam elements, an angle that is larger, or a value that is none.
        """
        if not isinstance(first, SegmentPlace):
            raise InputError(f"The first place of a joint must be a SegmentPlace, but is {shown(first)}.")
        target = second if isinstance(second, SegmentPlace) else unit_vector(second, "Joint").tolist()
        angle = in_units_of(angle, ANGLE, "Joint: angle")
        if not (isinstance(angle, float) and 0.0 <= angle <= 0.5 * np.pi * (1.0 + 1e-12)):
            raise InputError(
                f"The angle of a joint must be between 0 and pi/2, but is {shown(angle)}. For a larger one, exchange "
                "the particles of a place: SegmentPlace(place.second, place.first, 1 - place.fraction) has the "
                "opposite direction."
            )
        own = self._stiffness if stiffness is None else positive(stiffness, ENERGY, "Joint: stiffness")
        if self._curves is not None and context is not None:
            for place in (first, target):
                if isinstance(place, SegmentPlace):
                    self._require(np.array([place.first]), np.array([place.second]), self._curves, "The joint")
        rest = 2.0 * np.sin(0.5 * angle)
        return self._links.add(context, first, target, own / np.cos(0.5 * angle) ** 2, rest)

    def remove(self, context: openmm.Context | None, numbers: int | Indices) -> None:
        """Remove a joint, or several at once; InputError for a number that is not that of one."""
        self._links.remove(context, numbers)

    def set_active(self, context: openmm.Context | None, numbers: int | Indices, active: bool) -> None:
        """Switch a joint, or several at once, on or off; InputError for a number that is not that of one."""
        self._links.set_active(context, numbers, active)

    def numbers(self, context: openmm.Context | None) -> IntArray:
        """The numbers of all joints of a Context: an int array (n,), ascending."""
        return self._links.numbers(context)

    def angles(self, context: openmm.Context) -> FloatArray:
        """The angles theta of all joints of a Context in radians: an array (n,), in the order of ``numbers``."""
        return self._measure(context)[1]

    def moments(self, context: openmm.Context) -> FloatArray:
        """Moments dV/dtheta of all joints of a Context in kJ/mol: an array (n,), positive where theta is larger than
        theta0. Zero of those that are off."""
        table, angles = self._measure(context)
        slopes = table.stiffness * (2.0 * np.sin(0.5 * angles) - table.rest_length) * np.cos(0.5 * angles)
        return np.where(table.active, slopes, 0.0)

    def _measure(self, context):
        if self._curves is None:
            raise InputError("These joints are not in a System yet: call add_to before Contexts are created.")
        if not isinstance(context, openmm.Context):
            raise InputError(f"context must be an openmm.Context, but is {shown(context)}.")
        table = self._links.table(context)
        state = context.getState(positions=True)
        positions = state.getPositions(asNumpy=True)._value
        places = table.places
        box = state.getPeriodicBoxVectors(asNumpy=True)._value if _are_nearest(context) else None
        first, second = (np.zeros((len(table), 3)) for _ in range(2))
        fixed = places.at_points
        for side, vectors, rows in ((0, first, np.full(len(table), True)), (1, second, ~fixed)):
            columns = (places.pairs[rows, side], places.partners[rows, side], places.fractions[rows, side])
            vectors[rows] = self._curves.tangents(*columns, positions, box)
        second[fixed] = places.points[fixed]
        # More accurate than an arc cosine where the two are nearly parallel.
        difference, total = (np.linalg.norm(one, axis=1) for one in (first - second, first + second))
        return table, 2.0 * np.arctan2(difference, total)

    def _check(self, table: CrosslinkTable, curves: BeamCurves, particles: int) -> None:
        table.places.check(table.numbers, particles)
        places = table.places
        for side in (0, 1):
            rows = np.flatnonzero(places.pairs[:, side] >= 0)
            self._require(places.pairs[rows, side], places.partners[rows, side], curves, "Joint", table.numbers[rows])

    @staticmethod
    def _require(first, second, curves, label, numbers=None):
        wrong = np.flatnonzero(~curves.on_curve(first, second))
        if len(wrong):
            number = "" if numbers is None else f" {numbers[wrong[0]]}"
            particles = f"{first[wrong[0]]} and {second[wrong[0]]}"
            raise InputError(
                f"{label}{number} has a place between the particles {particles}, which are not neighbouring nodes of a "
                "filament of beam elements: straight segments have no joints of this kind."
            )


def _are_nearest(context):
    from ..engine_choice import load_plugin

    kind = load_plugin().CylinderChainForce
    forces = context.getSystem().getForces()
    return any(kind.isinstance(one) and kind.cast(one).usesPeriodicBoundaryConditions() for one in forces)
