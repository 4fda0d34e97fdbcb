"""Filaments: puts filaments into a Topology, a System and positions, new or existing."""

from dataclasses import replace

import numpy as np
import openmm
from openmm import app, unit

from .attachments import add_virtual_site, attachment_positions, neighbors
from .collection import FilamentCollection
from .contacts import default_stiffness, filament_diameters
from .engines import choose_engine, default_scheme, load_engine
from .engines.description import describe_chains
from .errors import InputError
from .flow import as_flow
from .insertion import (
    add_nodes_to_system,
    add_noninteracting_entries,
    add_to_topology,
    check_force_groups,
    check_target,
)
from .placement import vector
from .quantities import FORCE, LENGTH, STIFFNESS, in_units_of, positive, whole_number
from .tension import filament_tensions
from .timestep import (
    check_scheme,
    contact_time_step,
    recommended_time_step,
    warn_if_driven_far,
    warn_if_strained,
    warn_if_unstable,
)


class Filaments(FilamentCollection):
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
        super().__init__(viscosity, temperature)
        self._engine_name = choose_engine(engine)
        self._engine = load_engine(self._engine_name)

    @property
    def engine(self):
        """Name of the engine that computes the filaments."""
        return self._engine_name

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
        if not self._filaments:
            raise InputError("There are no filaments to add: call add_straight, add_nodes or add_equilibrium first.")
        if self._nodes is not None:
            raise InputError("These filaments are already in a System; make another Filaments for another System.")
        positions = check_target(topology, system, positions)
        check_force_groups(stretching_force_group, bending_force_group)
        self._nodes = []
        self._attachment_indices = np.zeros(len(self._attachments), dtype=int)
        everything = [positions]
        for number, filament in enumerate(self._filaments):
            self._nodes.append(add_nodes_to_system(system, filament))
            everything += [filament.positions, self._add_attachments(system, number)]
            names = [self._attachments[index].name for index in self._attachments_of[number]]
            add_to_topology(topology, filament, f"F{number}", names)
        add_noninteracting_entries(system, len(positions), self._coinciding())
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
            recommended_time_step(f.type, self._viscosity, self._temperature, scheme, f.segments, f.closed)
            for f in self._filaments
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
            If the step exceeds a bound of stability, or is too long for the flow or for self-propelled filaments.
        """
        step_size = positive(step_size, unit.picosecond, "step_size")
        if system.getNumParticles() <= max(nodes.max() for nodes in self.node_indices):
            raise InputError("This is not the System that the filaments were put into: it has too few particles.")
        scheme = default_scheme(self._engine_name) if scheme is None else scheme
        check_scheme(scheme)
        flow = as_flow(flow)
        warn_if_strained(step_size, flow)
        for f in {(f.type, f.segments, f.propulsion): f for f in self._filaments}.values():
            solvent = (self._viscosity, self._temperature)
            warn_if_unstable(f.type, *solvent, step_size, f.segments, scheme)
            warn_if_driven_far(f.type, *solvent, step_size, f.segments, f.propulsion)
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
