"""The description of a run of a configuration, for ``analysis.load``."""

import math
from dataclasses import replace

from ..output.run_description import DescribedStage
from ..systems.described_runs import describe_system
from ..units.quantities import PICONEWTON
from .initial_state import box_vectors

_NO_LOAD = "no pull"


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
    groups = (group for group in configuration.filaments for _ in range(group.count))
    described = zip(description.filaments, loads_of_filaments(configuration), groups)
    stages = [
        DescribedStage(
            own.name,
            own.begin,
            own.first_step,
            own.configuration.simulation.steps_per_report,
            own.reports,
            own.is_piece,
        )
        for own in configuration.stages
    ]
    return replace(description, stages=tuple(stages), filaments=tuple(_described(*own) for own in described))


def _described(own, load, group):
    # Of one that comes later, what is clamped then.
    return replace(own, load=load, clamped=tuple(group.clamped), clamped_tangents=tuple(group.clamped_tangents))


def loads_of_filaments(configuration):
    """Of each filament the constant forces on it, as text; empty if they are all alike."""
    found = [[] for group in configuration.filaments for _ in range(group.count)]
    for pull in configuration.pulls:
        for number in pull.filaments:
            found[number].append(_in_words(pull))
    loads = [" + ".join(own) or _NO_LOAD for own in found]
    return loads if len({*loads}) > 1 else [""] * len(found)


def _in_words(pull):
    if pull.force is None:
        return f"{pull.tension / PICONEWTON:.3g} pN"
    return f"{math.hypot(*pull.force) / PICONEWTON:.3g} pN on node {pull.node}"
