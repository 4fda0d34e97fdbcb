"""What a run would be, without one: what is built, what binds its step, how long it takes, how large its files get."""

import time

from ..errors import InstabilityError
from ..output.run_tables import ENERGY_COLUMNS, LINKER_TABLE_COLUMNS
from ..units.text import format_time
from .configuration import linker_labels, named_bound
from .initial_state import recommended_step
from .relaxation import relaxed_positions
from .run import create_simulation
from .summary import group_labels

_MEASURED_SECONDS = 2.0
_BYTES_OF_NUMBER = 20
"""Of a number in a table, with its comma."""


def format_dry_run(configuration):
    """A description of the run of a configuration: text for a terminal. It takes some steps, and their time.

    InputError if the configuration cannot be simulated.
    """
    settings = configuration.simulation
    simulation, built = create_simulation(configuration)
    simulation.context.setPositions(relaxed_positions(configuration, built))
    recommended = recommended_step(configuration, settings.scheme, settings.engine, settings.seed)
    lines = [configuration.title or "Run", *_what_is_built(configuration, built)]
    lines += [
        f"  {settings.steps} steps of {format_time(settings.time_step)}, scheme {settings.scheme}, "
        f"{built.filaments.engine} engine, platform {simulation.context.getPlatform().getName()}",
        f"  recommended {format_time(recommended.step)}: {_binding(configuration, recommended)}",
    ]
    return "\n".join([*lines, *_cost(configuration, simulation)])


def _what_is_built(configuration, built):
    filaments, system = built.filaments, built.system
    segments = sum(filament.segments for filament in filaments)
    yield f"  {len(filaments)} filaments, {segments} segments, {system.getNumParticles()} particles"
    yield from (f"    {label}" for label in group_labels(configuration))
    yield from (f"    {own.count} × {own.name}, {own.diameter:g} nm" for own in configuration.particles)
    for label, own in zip(linker_labels(configuration), configuration.linkers):
        count = len(own.anchors) if own.anchors is not None else own.count
        yield f"    {'linkers at a concentration' if count is None else f'{count} linkers'}: {label}"
    if built.links:
        yield f"    {built.links} links"
    if configuration.joints:
        yield f"    {len(configuration.joints)} joints"
    if configuration.box is not None:
        yield f"  box of {' × '.join(f'{edge:g}' for edge in configuration.box)} nm"
    yield f"  forces: {', '.join(force.getName() for force in system.getForces())}"


def _binding(configuration, recommended):
    names = [name for name, step in recommended.allowed.items() if step <= recommended.step * (1.0 + 1e-9)]
    # Those of forces say in their names which force it is.
    return f"{named_bound(configuration, names[0])}" if names and ":" in names[0] else recommended.reason


def _cost(configuration, simulation):
    settings = configuration.simulation
    try:
        step = _seconds_of_step(simulation, settings.steps)
    except InstabilityError as error:
        return [f"  its first steps fail: {error}"]
    particles, reports = simulation.system.getNumParticles(), settings.steps // settings.steps_per_report + 1
    # A frame of a DCD file has three records of single-precision numbers, and one of the box.
    trajectory = 276 + reports * (3 * (4 * particles + 8) + (56 if configuration.box is not None else 0))
    tables = reports * _BYTES_OF_NUMBER * len(ENERGY_COLUMNS)
    tables += reports * _BYTES_OF_NUMBER * len(LINKER_TABLE_COLUMNS) * len(configuration.linkers)
    return [
        f"  about {_duration(step * settings.steps)}: {1e3 * step:.3g} ms a step, as its first steps took",
        f"  {reports} frames, every {format_time(settings.steps_per_report * settings.time_step)}: trajectory of "
        f"{_size(trajectory)}, tables of about {_size(tables)}"
        + (", and a record of 100 bytes for each linker that is bound" if configuration.linkers else ""),
    ]


def _seconds_of_step(simulation, most):
    simulation.step(1)  # which sets things up
    taken, start = 0, time.monotonic()
    while taken < most and (taken == 0 or time.monotonic() - start < _MEASURED_SECONDS):
        count = max(1, min(taken, most - taken))
        simulation.step(count)
        taken += count
    return (time.monotonic() - start) / taken


def _duration(seconds):
    for name, length in (("days", 86400.0), ("hours", 3600.0), ("minutes", 60.0)):
        if seconds >= 2.0 * length:
            return f"{seconds / length:.3g} {name}"
    return f"{seconds:.2g} seconds"


def _size(size):
    for name, length in (("GB", 1e9), ("MB", 1e6), ("kB", 1e3)):
        if size >= length:
            return f"{size / length:.3g} {name}"
    return f"{size} bytes"
