"""The description of a run of a configuration, for ``analysis.load``."""

from dataclasses import replace

from ..systems.described_runs import describe_system
from .initial_state import box_vectors


def describe(configuration, filaments, system, topology):
    """The RunDescription of a run of a configuration, in whose System particles are behind the filaments."""
    settings = configuration.simulation
    diameters = [own.diameter for own in configuration.particles for _ in range(own.count)]
    description = describe_system(
        filaments,
        system,
        title=configuration.title,
        time_step=settings.time_step,
        steps=settings.steps,
        steps_per_frame=settings.steps_per_report,
        box=box_vectors(configuration.box),
        # Those of the portable engine do not say what they are.
        shapes=() if filaments.engine == "compiled" else [own.shape for own in configuration.walls],
        topology=topology,
        diameters=dict(enumerate(diameters, system.getNumParticles() - len(diameters))),
    )
    loads = _loads(configuration.filaments)
    return replace(
        description, filaments=tuple(replace(own, load=load) for own, load in zip(description.filaments, loads))
    )


def _loads(groups):
    # Of each filament, as text; empty if they are all alike.
    differ = len({group.load for group in groups}) > 1
    return [group.load if differ else "" for group in groups for _ in range(group.count)]
