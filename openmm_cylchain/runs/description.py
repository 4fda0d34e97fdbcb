"""The description of a run of a configuration, for ``analysis.load``."""

from ..couplings.walls import as_filament_wall_force
from ..output.run_description import DescribedFilament, DescribedLinkers, DescribedWall, RunDescription
from .initial_state import box_vectors


def describe(configuration, filaments, system):
    """What a run simulates.

    Parameters
    ----------
    configuration : Configuration
    filaments : Filaments
    system : openmm.System
        With the filaments; walls of ``filament_wall_force`` are found in it.

    Returns
    -------
    RunDescription
    """
    settings = configuration.simulation
    box = box_vectors(configuration.box)
    return RunDescription(
        title=configuration.title,
        temperature=configuration.solvent.temperature,
        time_step=settings.time_step,
        steps=settings.steps,
        steps_per_frame=settings.steps_per_report,
        particles=system.getNumParticles(),
        filaments=tuple(
            DescribedFilament(own.type, tuple(int(node) for node in nodes), own.closed, tuple(own.clamped))
            for own, nodes in zip(filaments, filaments.node_indices)
        ),
        box=None if box is None else tuple(tuple(float(edge) for edge in vector) for vector in box),
        linkers=tuple(
            DescribedLinkers(own.kind.name, own.kind.stiffness, own.kind.rest_length) for own in filaments.linkers
        ),
        walls=tuple(wall for wall in map(_wall, system.getForces()) if wall is not None),
    )


def _wall(force):
    force = as_filament_wall_force(force)
    if force is None:
        return None
    # Quantities in OpenMM's units: the vector is a direction of some shapes and a length of others.
    shape, point, vector, length = (getattr(value, "_value", value) for value in force.getRegion())
    return DescribedWall(shape, tuple(map(float, point)), tuple(map(float, vector)), float(length))
