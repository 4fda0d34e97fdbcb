"""Filaments, which users add, put into a System, integrate and ask; the work is done by the modules that it calls."""

from __future__ import annotations

from dataclasses import replace
from typing import TYPE_CHECKING

import numpy as np
import openmm
from openmm import unit

from ..couplings.growing_chains import refuse_forces_on_growing
from ..couplings.periodicity import default_box, is_periodic
from ..couplings.stiff_joints import warn_of_stiff_joints
from ..engine_choice import default_scheme
from ..engines.description import describe_chains, filament_label, refuse_constraints
from ..engines.protocol import IntegratorSettings
from ..errors import InputError
from ..filaments.attachments import add_virtual_site, attachment_positions, neighbors
from ..filaments.refusals import refuse_beams, refuse_growth, refuse_twist
from ..kinetics.linkers import refuse_barriers_without_linkers, refuse_linkers_without_volume
from ..mechanics.flow import Flow, as_flow
from ..mechanics.redistribution import ChainSet
from ..time_steps.bead_spring_step import refuse_modes
from ..time_steps.coupled_forces import CoupledForces
from ..time_steps.growth_step import refuse_countless_monomers
from ..time_steps.precision import check_precision, refuse_mixed_precision_of_beams
from ..time_steps.schemes import IMPLICIT_SCHEMES, MODES, check_scheme
from ..time_steps.step_of_system import recommended_step_of
from ..time_steps.step_warnings import warn_of_long_step
from ..time_steps.time_step import TimeStep, as_step
from ..units.quantities import TEMPERATURE, non_negative, require_kind, true_or_false, whole_number
from ..units.types import BoxVectors, Numbers, Scalar, Vectors
from .filaments_in_context import FilamentsInContext
from .insertion import (
    add_body_to_system,
    add_nodes_to_system,
    add_to_topology,
    check_force_groups,
    check_target,
    set_box_vectors,
)
from .particle_entries import add_noninteracting_entries, refuse_forces
from .periodic_forces import warn_of_forces_without_images
from .tied_filaments import TiedFilaments

if TYPE_CHECKING:
    from openmm import app


class Filaments(TiedFilaments):
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

    def build(
        self, box_vectors: BoxVectors | None = None, stretching_force_group: int = 0, bending_force_group: int = 0
    ) -> tuple[app.Topology, openmm.System, unit.Quantity]:
        """Put the filaments into a new Topology, System and positions.

        Parameters
        ----------
        box_vectors : three (3,) lengths, optional
            Periodic box vectors of the System and the Topology. Forces between filaments, and linkers, take nearest
            images where a System has a box.
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
            For box vectors that are not three, not finite or not in the reduced form that OpenMM needs; or the cube of
            2 nm that every System has.
        """
        from openmm import app

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
        node and bonds along it. Rigid bodies come behind them, each a chain with an atom (named "BOD") for each
        point. Everything that was in the Topology and the System stays as it is.

        Parameters
        ----------
        topology : openmm.app.Topology
            Changed in place.
        system : openmm.System
            Changed in place. Forces that ask for parameters of every particle are given non-interacting entries for
            the nodes: nonbonded forces, implicit solvents, AMOEBA and others. CustomNonbondedForce and CustomGBForce
            have a parameter more then, by which their expressions leave out nodes; forces that act on all particles
            where none are named, such as RGForce, get those that are there. (Where a long-range dispersion correction
            is used, its constant changes, because OpenMM averages it over all particles.)
            Its box counts, if it is to have one: set it before.
        positions : (particles, 3) length
            Positions of the particles that are there.
        stretching_force_group, bending_force_group : int
            Force groups of the chain's own forces. The compiled engine has one force for both, so they must
            not differ.

        Returns
        -------
        (particles, 3) Quantity in nm
            The positions of everything.

        Raises
        ------
        InputError
            If there are no filaments, or they are in a System; Topology, System, positions and entries of forces do not
            match; or a force has no entries that leave all else as it is: a GBSAOBCForce with a surface energy,
            AmoebaGeneralizedKirkwoodForce, ATMForce, and, where particles are in one place, or may be with beads, those
            that divide by all distances.
        """
        if not (self._filaments or self._bodies):
            raise InputError("There are no filaments to add: call add_straight, add_nodes or add_equilibrium first.")
        if self._nodes is not None:
            raise InputError("These filaments are already in a System; make another Filaments for another System.")
        positions = check_target(topology, system, positions)
        check_force_groups(stretching_force_group, bending_force_group)
        may_coincide = bool(self._attachments) or any(filament.spare_nodes for filament in self._filaments)
        refuse_forces(system, positions, self._filaments, may_coincide)
        self._nodes, self._control_points = [], []
        self._attachment_indices = np.zeros(len(self._attachments), dtype=int)
        everything = [positions]
        for number, filament in enumerate(self._filaments):
            nodes, control_points = add_nodes_to_system(system, filament)
            self._nodes.append(nodes)
            self._control_points.append(control_points)
            spare = np.repeat(filament.positions[-1:], filament.spare_nodes, axis=0)
            everything += [filament.positions, spare, self._add_attachments(system, number)]
            if filament.control_points is not None:
                everything.insert(-1, filament.control_points)
            names = [self._attachments[index].name for index in self._attachments_of[number]]
            add_to_topology(topology, filament, f"F{number}", names)
        self._body_indices = [
            add_body_to_system(system, topology, placed, f"B{number}") for number, placed in enumerate(self._bodies)
        ]
        everything += [placed.positions for placed in self._bodies]
        count, positions = len(positions), np.concatenate(everything)
        add_noninteracting_entries(system, count, positions, self._coinciding())
        self._periodic = is_periodic(system)
        placed = replace(self._placed(), positions=positions)
        refuse_barriers_without_linkers(self.linkers, self.barriers)
        self._engine.add_forces(system, placed, stretching_force_group, bending_force_group)
        return positions * unit.nanometer

    def _add_attachments(self, system, number):
        # Those of one filament; returns their positions.
        attachments = [self._attachments[index] for index in self._attachments_of[number]]
        for index, attachment in zip(self._attachments_of[number], attachments):
            self._attachment_indices[index] = add_virtual_site(
                system, attachment, self._nodes[number], self._control_points[number]
            )
        own = self._filaments[number]
        segments = np.array([one.segment for one in attachments], dtype=int)
        fractions = np.array([one.fraction for one in attachments], dtype=float)
        return attachment_positions(segments, fractions, own.positions, own.control_points)

    def _coinciding(self):
        for number, nodes in enumerate(self._nodes):
            own = self._filaments[number]
            if own.may_be_absent:
                yield tuple(nodes.tolist())
            elif own.spare_nodes:
                # Any node but the first may become a spare one.
                yield tuple(nodes[1:].tolist())
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
        other, links as they move the gaps of contacts and walls, and walls that hold filaments on a curved surface, or
        outside, by its radius of curvature (see ``coupled_step``). All others act from the start of a step, and a
        spring of the stiffness k on a place of the response mu h to a force in a step h has a variance too large by
        1/(1 - k mu h/2). mu h is that of the place on the straight filament (see ``mobility``), or h/gamma of a
        particle. The step leaves 5 % at most, with all forces at once. Known are HarmonicBondForce, crosslinks, walls,
        contacts, constant forces, tethers, and CustomBondForce and CustomExternalForce that are harmonic; walls as if
        all their particles were in contact, and contacts of two filaments as if they crossed at their ends, or touched
        all along with an error of a third.
        Other forces are listed in ``unknown_forces``. Filaments that constant forces, tethers or propulsion compress
        bind it by the rate with which they buckle (see ``buckling_step``). Where ends that grow may push walls or
        contacts, they gain a fifth of a monomer in a step, which resolves contacts (see ``growth_step``).

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
            If there are no filaments, they are not in the System, it has constraints, particles lack a friction, or
            contacts or walls are in two stages.
        """
        if system is not None:
            self._refuse_if_not_in(system)
            refuse_constraints(system, self._placed())
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
            decay of bends of second order in the step, but not for ``capsule_contact_force`` and
            ``filament_wall_force``. "midpoint", the portable engine's default, is Fixman's explicit scheme with the
            right drift on chains. "euler" is Section 4 of the paper, biased on chains. "modes" moves open chains of
            beads alone, by their modes.
        temperature : temperature, optional
            That of the filaments if not given.
        particle_friction : energy*time/length^2, or array of them
            Friction coefficients of the particles outside filaments and rigid bodies, in the order of their indices; a
            number holds for all of them. Values for massless particles are ignored: those do not move.
            ``stokes_friction`` computes one. A particle that is added later, and can move, has none: its Context is
            refused (portable engine: its first step).
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
            noise changes lengths by 10^-5 of themselves in a step, or more. For filaments with twist, k (1+2 k_BT
            h/zeta)^(1/2) is at most 10^5 k_BT, with the stiffness k of twist and the friction zeta of a segment against
            turning about itself, and no hands follow their helix.
            Positions, twists and forces are in double precision, and other filaments altogether; so are those of beam
            elements.
            "automatic" does so where it is faster as well, about twice as fast: where there are enough filaments of
            similar length, or few that are long. With the portable engine it is the same as "double".
            ``integrator.getNumMixedPrecisionChains()`` says for how many filaments the last step did so.

        Returns
        -------
        openmm.Integrator
            Of the engine: a NativeIntegrator or a PortableIntegrator.

        Warns
        -----
        TimeStepWarning
            If filaments that grow may push walls or others, and an end gains half a monomer or more in a step. If the
            step exceeds a bound of stability, or the recommended step of a filament, or that of buckling, more
            than four times, or that of hands of linkers; if forces of the System are so stiff that variances may be
            10 % too large (see ``recommended_time_step``); if it is too long for the flow or for self-propelled
            filaments; or if FENE lengths have too much energy at it (``timestep.fene_steps``).
        SegmentLengthWarning
            If constant forces, or tethers, pull a filament so much that the chain of segments has the extension of the
            wormlike chain at a force that is a tenth off (see ``theory.wlc_share_of_force``), or more than it is
            calibrated for.
        TwistWarning
            If a filament has a torque at an end under which it is not straight, see ``theory.critical_torque``, with
            constant forces as the pull on it.
        ContactWarning
            If scheme "implicit" takes contacts for hard ones: energies and forces of contacts and walls are too small.
            If its step is nearly as long: contacts along filaments have up to a sixth too much energy.
        JointWarning
            If a joint of filaments that are not linked where it is has more than 20 EI/h of an element.
        BoxWarning
            If the System is periodic, but crosslinks, contacts or linkers do not take nearest images, or a wall keeps
            filaments outside.

        Raises
        ------
        InputError
            If the engine does not have the scheme or the precision, all filaments have beam elements and the precision
            is "mixed", contacts or walls are in two stages, the System has constraints or does not hold the filaments.
            If filaments grow: for an explicit scheme, a force of OpenMM that names their particles, or rates of more
            than 100000 monomers in a step.
        """
        step_size = as_step(step_size)
        check_precision(precision)
        refuse_mixed_precision_of_beams(self, precision)
        self._refuse_if_not_in(system)
        refuse_constraints(system, self._placed())
        scheme = default_scheme(self._engine_name) if scheme is None else scheme
        check_scheme(scheme)
        if self._bodies and scheme != "implicit":
            raise InputError(f"Rigid bodies are moved by scheme 'implicit' alone, not by {scheme!r}.")
        if scheme == MODES:
            for number, filament in enumerate(self):
                refuse_modes(filament, filament_label(number, filament))
        if scheme not in IMPLICIT_SCHEMES:
            refuse_growth(self, f"scheme {scheme!r}", "Take an implicit one.")
        refuse_countless_monomers(list(self), step_size, default_box(system) if is_periodic(system) else None)
        refuse_forces_on_growing(system)
        flow = as_flow(flow)
        warn_of_forces_without_images(system)
        refuse_linkers_without_volume(self.linkers, system)
        if scheme != "implicit":
            refuse_beams(self, f"scheme {scheme!r}")
            refuse_twist(self, f"scheme {scheme!r}")
        CoupledForces(system).refuse_in_two_stages(scheme)
        bath = self._bath(temperature)
        if true_or_false(checks, "checks"):
            warn_of_long_step(self, system, step_size, scheme, bath, particle_friction, flow)
            warn_of_stiff_joints(system, self)
        random_seed = whole_number(random_seed, 0, "random_seed")
        settings = IntegratorSettings(step_size, scheme, bath, particle_friction, random_seed, flow, checks, precision)
        return self._engine.create_integrator(system, self._placed(), settings)

    def in_context(self, context: openmm.Context) -> FilamentsInContext:
        """The filaments in a Context of their System, to ask for what they have there, and to change it.

        Parameters
        ----------
        context : openmm.Context
            Of the System that these filaments were put into.

        Returns
        -------
        FilamentsInContext
        """
        require_kind(context, openmm.Context, "context")
        return FilamentsInContext(self._placed(), self._engine, context, self._moved_tethers.setdefault(context, {}))

    def chain_set(self, system: openmm.System) -> ChainSet:
        """The filaments as an engine sees them (a ``ChainSet``): friction of segments and fixed nodes.

        Raises InputError for beam elements, which are no such chains.
        """
        self._refuse_if_not_in(system)
        refuse_beams(self, "properties of a ChainSet")
        refuse_growth(self, "properties of a ChainSet")
        return describe_chains(system, self._placed())

    def _bath(self, temperature):
        return self._temperature if temperature is None else non_negative(temperature, TEMPERATURE, "temperature")

    def _refuse_if_not_in(self, system):
        require_kind(system, openmm.System, "system")
        if system.getNumParticles() <= max(own.max() for own in (*self.node_indices, *self.body_indices)):
            raise InputError("This is not the System that the filaments were put into: it has too few particles.")
