"""What is asked of filaments, or changed, in a Context."""

from dataclasses import replace

import numpy as np
import openmm
from openmm import unit

from ..couplings.beam_curves import BeamCurves
from ..engines.description import describe_chains
from ..errors import InputError
from ..filaments.beam_refusals import refuse_beams
from ..filaments.filament import Tether
from ..kinetics.binding_force import (
    find_binding_force,
    naming_unknown_linkers,
    places_of,
    pulls_of,
    set_table,
    table_of,
)
from ..kinetics.linker_table import LinkerTable
from ..kinetics.linkers import LinkerPulls
from ..mechanics.flow import Flow
from ..mechanics.redistribution import ChainSet
from ..mechanics.tension import components_along, filament_tensions
from ..units.quantities import FORCE, LENGTH, STIFFNESS, in_units_of, positive, vector, whole_number
from ..units.types import Indices, Scalar, Vector, Vectors
from .tied_filaments import TiedFilaments


class FilamentsInContexts(TiedFilaments):
    """Filaments whose tensions, linkers and tethers each Context has: what ``Filaments`` asks and moves there."""

    def linkers_in(self, context: openmm.Context) -> LinkerTable:
        """The linkers of a Context, and where they are bound: a LinkerTable.

        Raises
        ------
        InputError
            If there are none, or the Context has got a State that does not say where linkers are.
        """
        return table_of(self._binding_force(context), context)

    def set_linkers(self, context: openmm.Context, table: LinkerTable) -> None:
        """Give a Context other linkers.

        Raises
        ------
        InputError
            For linkers that do not fit their types, the anchors or the filaments.
        """
        set_table(self._binding_force(context), context, table)

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

    def chain_set(self, system: openmm.System) -> ChainSet:
        """The filaments as an engine sees them (a ``ChainSet``): friction of segments and fixed nodes.

        Raises InputError for beam elements, which are no such chains.
        """
        refuse_beams(self, "tensions of joints and other properties of a ChainSet")
        return describe_chains(system, self._placed())

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
