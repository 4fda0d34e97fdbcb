"""The portable engine: stock OpenMM forces, a CustomIntegrator and one PythonForce. It runs wherever OpenMM runs."""

import numpy as np

from ..couplings.periodicity import is_periodic
from ..errors import InputError
from ..mechanics.geometry import joined
from ..time_steps.other_particles import describe_other_particles
from .description import (
    advice_after_blow_up,
    describe_chains,
    describe_lengths,
    filament_label,
)
from .portable_displacements import ChainDisplacements, add_redistribution
from .portable_forces import (
    TETHER_NAME,
    add_bending_forces,
    add_propulsion,
    add_stretching_forces,
    add_tethers,
    set_tethers,
)
from .portable_integrator import PortableIntegrator, flow_of_integrator
from .protocol import Engine


class PortableEngine(Engine):
    """The portable engine: stock OpenMM forces, a CustomIntegrator and a PythonForce, on every platform."""

    def add_forces(self, system, placed, stretching_force_group, bending_force_group):
        """Add a force for each model of stretching and bending; those of tethers and propulsion join stretching."""
        segments, joints = [], []
        for filament, indices in zip(placed.filaments, placed.node_indices):
            ends = [(int(indices[node - 1]), int(indices[node])) for node in range(1, len(indices))]
            ends += [(int(indices[-1]), int(indices[0]))] if filament.closed else []
            stiffnesses = filament.type.segment_stiffnesses(filament.segments, filament.closed).tolist()
            lengths = filament.type.segment_lengths(filament.segments, filament.closed).tolist()
            segments += [(filament.type, *pair, *values) for pair, *values in zip(ends, stiffnesses, lengths)]
            pairs = zip(*joined(np.array(ends), filament.closed))
            for stiffness, (before, behind) in zip(filament.joint_stiffnesses, pairs):
                joints.append((filament.type, *map(int, (before[0], *behind)), stiffness))
        add_stretching_forces(system, segments, stretching_force_group)
        add_bending_forces(system, joints, bending_force_group)
        if any(filament.propulsion for filament in placed.filaments):
            add_propulsion(system, placed.filaments, placed.node_indices, stretching_force_group)
        if placed.tethers:
            add_tethers(system, placed, stretching_force_group)

    def create_integrator(self, system, placed, settings):
        """Create a PortableIntegrator, and the PythonForce that it needs."""
        if settings.precision == "mixed":
            raise InputError(
                "The portable engine computes filaments in double precision alone: use the compiled engine, or leave "
                "precision out."
            )
        filaments = placed.filaments
        computation = ChainDisplacements(
            describe_chains(system, placed),
            placed.nodes,
            *describe_lengths(filaments),
            [filament_label(number, filament) for number, filament in enumerate(filaments)],
            *describe_other_particles(system, placed.nodes, settings.particle_friction),
            advice_after_blow_up(system, filaments),
            is_periodic(system),
        )
        return PortableIntegrator(
            system,
            add_redistribution(system, computation),
            settings.temperature,
            settings.step_size,
            settings.scheme,
            settings.random_seed,
            settings.flow,
            settings.checks,
        )

    def flow_of(self, context):
        """The flow of the solvent in a Context, at rest where its integrator knows of none."""
        return flow_of_integrator(context.getIntegrator())

    def set_tethers(self, context, placed, tethers):
        """Give a Context other tethers, by their numbers."""
        for force in context.getSystem().getForces():
            if force.getName() == TETHER_NAME:
                set_tethers(force, placed, tethers)
                force.updateParametersInContext(context)
                set_tethers(force, placed, {number: placed.tethers[number] for number in tethers})

    def record_tensions(self, context):
        """Refused: only the implicit schemes solve for tensions."""
        self.mean_tensions(context, 0)

    def mean_tensions(self, context, filaments):
        """Refused: only the implicit schemes solve for tensions."""
        raise InputError(
            "Mean tensions belong to the implicit schemes of the compiled engine: the portable engine has those of the "
            "configuration alone (FilamentsInContext.joint_tensions)."
        )


ENGINE = PortableEngine()
