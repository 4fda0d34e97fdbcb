"""What can differ between Contexts: what is asked of filaments, or changed, in one of them."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import numpy.typing as npt
import openmm
from openmm import unit

from ..couplings.beam_curves import BeamCurves
from ..couplings.shapes import Plane
from ..engines.compiled_twist import twists_of
from ..engines.description import describe_chains
from ..engines.protocol import Engine, PlacedFilaments
from ..errors import InputError
from ..filaments.filament import Tether
from ..filaments.refusals import refuse_beams, refuse_growth, refuse_twist
from ..filaments.rest_bends import bending_energies_at_rest
from ..kinetics.binding_force import (
    find_binding_force,
    naming_unknown_linkers,
    places_of,
    pulls_of,
    set_table,
    table_of,
)
from ..kinetics.growth_force import FilamentGrowth, contours_in, cut_by, growth_of, set_growth_of
from ..kinetics.linker_table import LinkerTable
from ..kinetics.linkers import LinkerPulls
from ..mechanics.flow import Flow
from ..mechanics.geometry import segment_vectors
from ..mechanics.tension import components_along, filament_tensions
from ..units.quantities import (
    FORCE,
    LENGTH,
    STIFFNESS,
    in_units_of,
    positive,
    require_kind,
    vector,
    whole_number,
    whole_numbers,
)
from ..units.types import Indices, Scalar, Vector, Vectors
from .carried_state import carry_state
from .twist_in_context import TwistInContext


class FilamentsInContext(TwistInContext):
    """Filaments in a Context: the tensions, linkers, tethers and flow that they have there.

    ``Filaments.in_context`` makes it, at hardly any cost; all that it makes for a Context show and change the same.

    Examples
    --------
    >>> filaments.in_context(simulation.context).move_tether(0, [100, 0, 0])  # doctest: +SKIP
    """

    def __init__(
        self, placed: PlacedFilaments, engine: Engine, context: openmm.Context, moved_tethers: dict[int, Tether]
    ) -> None:
        super().__init__(placed, context)
        self._engine = engine
        # By number, and shared by all that are made for the Context.
        self._moved_tethers = moved_tethers

    def growth(self) -> FilamentGrowth:
        """How far the filaments that grow have grown: a FilamentGrowth.

        Raises
        ------
        InputError
            If none of them grow, or the Context has got a State that does not say how far they have.
        """
        self._refuse_if_none_grows()
        with naming_unknown_linkers():
            return growth_of(self._context, self._placed.filaments)

    def set_growth(self, monomers: npt.ArrayLike) -> None:
        """Tell the Context how far the filaments that grow have grown at its positions.

        The first particles of a filament are taken for its nodes, and the others go to the last of these. What ends
        have gained and lost, and whether they shrink, stays as it was; a closed pool has less monomers by those that
        filaments have more than before.

        Parameters
        ----------
        monomers : (n, 2) int array
            As ``FilamentGrowth.monomers``: for each filament that grows, in their order, the number of its first
            monomer and that behind its last one.

        Raises
        ------
        InputError
            If none of them grow, for an array of another shape or kind, and for numbers for which a filament is too
            short, has not nodes enough, or a pool has not monomers enough.

        Examples
        --------
        >>> context.setPositions(run.positions(-1))  # doctest: +SKIP
        >>> filaments.in_context(context).set_growth(list(run.monomers(-1).values()))  # doctest: +SKIP
        """
        self._refuse_if_none_grows()
        set_growth_of(self._context, self._placed.filaments, monomers)

    def cut(self, plane: Plane, numbers: Indices | None = None) -> tuple[int, int]:
        """Cut filaments that grow, at once, wherever they go through a plane, as a laser does.

        A cut is between the two monomers that are nearest, and both parts are filaments then, with new ends as
        ``Growth.severing`` says, in the places that ``Filaments.add_reserve`` has added. What is bound stays where it
        is. A filament stays whole where there is no place for a part, where a part would be shorter than the
        ``shortest``, unless filaments vanish, where what is cut off would be clamped or held by a tether, and where
        walls, contacts or linkers refuse a hundred new ends that are drawn.

        Parameters
        ----------
        plane : Plane
            Without an end; which way its normal points means nothing.
        numbers : sequence of int, optional
            Of the filaments that are cut; all that grow if not given.

        Returns
        -------
        places, cuts : int
            At how many places filaments go through the plane, and at how many of them they were cut.

        Raises
        ------
        InputError
            If none of them grow, for numbers of filaments that do not grow, and in a periodic box.

        Examples
        --------
        >>> filaments.in_context(context).cut(Plane([0, 0, 0], [1, 0, 0]))  # doctest: +SKIP
        """
        self._refuse_if_none_grows()
        require_kind(plane, Plane, "plane")
        if numbers is not None:
            numbers = whole_numbers(numbers, 0, "numbers")
        with naming_unknown_linkers():
            return cut_by(self._context, plane, numbers)

    def _refuse_if_none_grows(self):
        if not any(filament.growth is not None for filament in self._placed.filaments):
            raise InputError("No filaments grow: give some a growth when they are added.")

    def go_on_from(self, context: openmm.Context) -> None:
        """Bring this Context into the state of one of the same filaments in another System.

        So an experiment goes on with other forces, rates or a step that an integrator does not change: make filaments
        anew with other numbers, build them, and go on from the Context before. Positions, time, how far filaments have
        grown, where linkers are, and the count of steps, by which noise is drawn, are those of that Context; flow,
        crosslinks and tethers are of this one. Where nothing else has changed, steps go on as if nothing had happened,
        to the bit, if both integrators have the same seed.

        Parameters
        ----------
        context : openmm.Context

        Raises
        ------
        InputError
            If the two Systems have not as many particles, or the linkers or the growth of that Context do not fit.

        Examples
        --------
        >>> stopped.in_context(later.context).go_on_from(simulation.context)  # doctest: +SKIP
        """
        require_kind(context, openmm.Context, "context")
        carry_state(context, self._context)

    def linkers(self) -> LinkerTable:
        """The linkers that there are, and where they are bound: a LinkerTable.

        Raises
        ------
        InputError
            If there are none, or the Context has got a State that does not say where linkers are.
        """
        return table_of(self._binding_force(), self._context)

    def set_linkers(self, table: LinkerTable) -> None:
        """Put other linkers in the place of those that there are.

        Raises
        ------
        InputError
            For linkers that do not fit their types, the anchors or the filaments.
        """
        set_table(self._binding_force(), self._context, table)

    def linker_pulls(self) -> LinkerPulls:
        """What the springs of linkers do that join two places: a LinkerPulls."""
        return pulls_of(*self._seen_linkers())

    def linker_places(self) -> unit.Quantity:
        """Where the two ends of each linker of ``linkers`` are: (n, 2, 3) in nm, NaN where not bound.

        In a periodic box, the second end is at the image that is nearest to the first one.
        """
        return places_of(*self._seen_linkers()) * unit.nanometer

    def linker_events(self, linker_type: int | None = None) -> tuple[int, int]:
        """How often hands have bound and unbound since the start, with all that the Context's checkpoint knew.

        Parameters
        ----------
        linker_type : int, optional
            What ``add_linkers`` returned; linkers of all types if not given.

        Raises
        ------
        InputError
            If there are no linkers, or none of this type, or the Context has got a State that does not say where
            linkers are.
        """
        force = self._binding_force()
        if linker_type is not None:
            linker_type = whole_number(linker_type, 0, "linker_type")
            if linker_type >= len(self._placed.linkers):
                raise InputError(f"There is no type {linker_type} of linkers: there are {len(self._placed.linkers)}.")
        types = range(len(self._placed.linkers)) if linker_type is None else [linker_type]
        with naming_unknown_linkers():
            bindings, unbindings = zip(*(force.getNumEventsInContext(self._context, number) for number in types))
        return sum(bindings), sum(unbindings)

    def joint_tensions(self) -> list[unit.Quantity]:
        """Instantaneous virtual forces Phi at the joints, without noise, in the Context's configuration and flow.

        Phi of joint i, eqs. (22)-(24), is the force that segment i + 1 exerts on segment i; its component along the
        chain is positive under tension. Random forces are left out: this is the mean over the noise of an
        infinitesimal step that begins here. See ``mean_joint_tensions`` for those of the steps that were taken.
        Stretching, bending and propulsion belong to their segments; any other force on a shared node is given to the
        two segments in equal parts.

        Returns
        -------
        list of (joints, 3) Quantity in kJ/(mol nm), one for each filament
            An open filament has segments - 1 joints. A ring has as many as segments: the last is node 0, where the
            force is that of segment 0 on the last one.
        """
        filaments, nodes = self._placed.filaments, self._placed.node_indices
        refuse_beams(filaments, "instantaneous tensions of joints")
        refuse_twist(filaments, "instantaneous tensions of joints")
        refuse_growth(filaments, "instantaneous tensions of joints", "Ask for mean_joint_tensions.")
        state = self._context.getState(positions=True, forces=True)
        positions = state.getPositions(asNumpy=True)._value
        forces = state.getForces(asNumpy=True)._value
        chains = describe_chains(self._context.getSystem(), self._placed)
        parts = filament_tensions(filaments, nodes, chains, positions, forces, self.flow())
        return [part * FORCE for part in parts]

    def mean_joint_tensions(self) -> list[unit.Quantity]:
        """Virtual forces Phi at the joints as means over the last step, with friction and noise.

        Phi of joint i is the force that segment i + 1 exerts on segment i, as in ``joint_tensions``, but of the step
        that scheme "implicit" has solved, with all that moved the segments in it, their friction and the random forces.
        Where the nodes of the joint are free to move, the forces q on the ends of the two segments, which they exert
        themselves, and those from outside balance, q_plus(i) + q_minus(i+1) + f = 0, and f acts on both in equal parts:
        Phi = (q_minus(i+1) - q_plus(i))/2. Averages over time are the forces that a filament transmits, such as that
        of a trap at its end; the noise of a single step is large. The integrator records them from the first step after
        ``record_tensions`` on.

        Returns
        -------
        list of (joints, 3) Quantity in kJ/(mol nm), one for each filament
            In the order of ``joint_tensions``.

        Raises
        ------
        InputError
            With the portable engine or an explicit scheme, or if nothing was recorded.
        """
        return [forces * FORCE for _, forces, _ in self._recorded()]

    def mean_tensions(self) -> list[unit.Quantity]:
        """Tensions T of the segments as means over the last step, with friction and noise.

        T is the elastic force of the segment's length, its friction against becoming longer and the noise of both, as
        an implicit scheme has solved for them, along the direction of the segment half-way through the step; it is
        positive where it pulls the ends together. See ``mean_joint_tensions``.

        Returns
        -------
        list of (segments,) Quantity in kJ/(mol nm), one for each filament

        Raises
        ------
        InputError
            As for ``mean_joint_tensions``.
        """
        return [tensions * FORCE for tensions, _, _ in self._recorded()]

    def mean_axial_tensions(self) -> list[unit.Quantity]:
        """Components of ``mean_joint_tensions`` along the filaments, positive under tension.

        The direction of a filament at a joint is that of the sum of the unit vectors along its two segments half-way
        through the step. (That at its end would be correlated with the noise of the step.)

        Returns
        -------
        list of (joints,) Quantity in kJ/(mol nm), one for each filament

        Raises
        ------
        InputError
            As for ``mean_joint_tensions``.
        """
        return [components_along(directions, forces) * FORCE for _, forces, directions in self._recorded()]

    def record_tensions(self) -> None:
        """Let the integrator record mean tensions from its next step on; see ``mean_joint_tensions``.

        Raises
        ------
        InputError
            With the portable engine or an explicit scheme.
        """
        refuse_beams(self._placed.filaments, "records of mean tensions")
        refuse_twist(self._placed.filaments, "records of mean tensions")
        self._engine.record_tensions(self._context)

    def energies(self, filament: int) -> tuple[unit.Quantity, unit.Quantity]:
        """Stretching energies of the segments of a filament, and bending energies of its joints or beam elements.

        Those of joints with ``rest_bends`` are those for the twists that the filament has. Energies of twist are not
        among them. Of filaments that grow, they are those of segments as they were added.

        Parameters
        ----------
        filament : int

        Returns
        -------
        tuple of two Quantities in kJ/mol
        """
        number = self._number(filament)
        own = self._placed.filaments[number]
        positions = self._context.getState(positions=True).getPositions(asNumpy=True)._value
        nodes = positions[self._placed.node_indices[number]]
        if own.rest_bends is None:
            controls = positions[self._placed.control_point_indices[number]]
            found = own.energies_along(nodes, controls, self._placed.temperature)
        else:
            frames = [one.direction for one in self._placed.end_frames if (one.filament, one.end) == (number, "minus")]
            lengths = np.linalg.norm(segment_vectors(nodes, own.closed), axis=-1)
            bending = bending_energies_at_rest(
                own.type,
                nodes,
                own.closed,
                twists_of(self._context, number),
                np.array(frames[0] if frames else (0.0, 0.0, 1.0)),
                own.components_of_rest_bends,
                own.joint_stiffnesses,
            )
            found = own.type.stretching_energies(lengths, own.closed), bending
        return tuple(values * unit.kilojoule_per_mole for values in found)

    def flow(self) -> Flow:
        """The Flow of the solvent, at rest where the integrator knows of none."""
        return self._engine.flow_of(self._context)

    def tethers(self) -> tuple[Tether, ...]:
        """Tuple of the tethers, in the order of their numbers, where they were moved to.

        A State or a checkpoint does not hold them, and ``context.reinitialize`` brings them back to where they were
        added: move them again then.
        """
        return tuple(self._moved_tethers.get(number, own) for number, own in enumerate(self._placed.tethers))

    def move_tether(self, tether: int, point: Vector, stiffness: Scalar | None = None) -> None:
        """Move the point of a tether, and change its stiffness if one is given.

        Other Contexts of the System keep theirs.

        Parameters
        ----------
        tether : int
            Number of the tether, as ``add_tether`` returned it.
        point : (3,) length
        stiffness : energy/length^2, optional

        Raises
        ------
        InputError
            For a tether that does not exist, or a point or a stiffness that is no such thing.
        """
        tether = self._tether_number(tether)
        x, y, z = (float(x) for x in vector(point, LENGTH, f"Tether {tether}: point"))
        old = self.tethers()[tether]
        if stiffness is not None:
            old = replace(old, stiffness=positive(stiffness, STIFFNESS, f"Tether {tether}: stiffness"))
        self._change_tethers({tether: replace(old, point=(x, y, z))})

    def move_tethers(self, tethers: Indices, points: Vectors) -> None:
        """Move the points of several tethers, at hardly more cost than that of one.

        Parameters
        ----------
        tethers : sequence of int
        points : (tethers, 3) length
        """
        points = np.asarray(in_units_of(points, LENGTH, "points"))
        tethers = whole_numbers(tethers, 0, "tethers")
        if points.shape != (len(tethers), 3):
            raise InputError(f"points must have the shape ({len(tethers)}, 3), but have {points.shape}.")
        old = self.tethers()
        numbers = [self._tether_number(tether) for tether in tethers]
        # The points are plain numbers by now: nothing is checked once more for each.
        self._change_tethers({own: replace(old[own], point=tuple(to)) for own, to in zip(numbers, points.tolist())})

    def _recorded(self):
        return self._engine.mean_tensions(self._context, len(self._placed.filaments))

    def _seen_linkers(self):
        force, state = self._binding_force(), self._context.getState(positions=True)
        positions = state.getPositions(asNumpy=True)._value
        box = state.getPeriodicBoxVectors(asNumpy=True)._value if force.usesPeriodicBoundaryConditions() else None
        table, curves = self.linkers(), BeamCurves.of_system(self._context.getSystem())
        contours = contours_in(self._context, self._placed.filaments)
        return force, table, contours, self._placed.node_indices, positions, box, curves

    def _binding_force(self):
        force = find_binding_force(self._context.getSystem())
        if force is None:
            raise InputError("There are no linkers here: add them by add_linkers, before the filaments are built.")
        return force

    def _tether_number(self, tether):
        tether, count = whole_number(tether, 0, "tether"), len(self._placed.tethers)
        if tether >= count:
            raise InputError(f"Tether {tether} does not exist; there are {count}.")
        return tether

    def _change_tethers(self, changed):
        moved = {**self._moved_tethers, **changed}
        self._engine.set_tethers(self._context, self._placed, moved)
        self._moved_tethers.update(moved)
