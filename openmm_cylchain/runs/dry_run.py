"""What a run would be, without one: what is built, what binds its step, how long it takes, how large its files get."""

import tempfile
import time

import numpy as np

from ..kinetics.branching import Branching
from ..output.run_tables import ENERGY_COLUMNS, GROWTH_TABLE_COLUMNS, LINKER_TABLE_COLUMNS
from ..units.text import format_time
from .configuration import linker_labels, named_bound
from .created_simulation import begin, create_simulation
from .errors_of_tables import located_instability
from .growth_summary import ENDS, MICROMOLAR, free_rate, populations
from .initial_state import box_vectors, recommended_step
from .run import Recorder, steps
from .run_directory import RunDirectory
from .stage_transition import following_simulation
from .stages import named_stages, naming_stage, stages_of, time_steps_in_words
from .steady_populations import steady_population
from .summary import group_labels, group_members

_MEASURED_SECONDS = 3.0
_PER_SECOND, _PER_SECOND_AND_UM = 1e12, 1e15
STEPS_OF_STAGE = 2
_BYTES_OF_NUMBER = 20
"""Of a number in a table, with its comma."""


def dry_run(configuration):
    """A description of the run of a configuration, line by line. It takes some steps, and their time.

    InputError if the configuration cannot be simulated, InstabilityError if its first steps cannot be taken.
    """
    settings = configuration.simulation
    stages = stages_of(configuration)
    simulation, built = create_simulation(stages[0].configuration)
    begin(stages[0].configuration, simulation, built)
    recommended = recommended_step(configuration, settings.scheme, settings.engine, settings.seed, built)
    yield configuration.title or "Run"
    yield from _what_is_built(configuration, built)
    yield (
        f"  {settings.steps} steps of {time_steps_in_words(stages)}, scheme {settings.scheme}, "
        f"{built.filaments.engine} engine, platform {simulation.context.getPlatform().getName()}"
    )
    yield f"  recommended {format_time(recommended.step)}: {_binding(configuration, recommended)}"
    yield from _cost(configuration, stages, simulation, built)
    if len(stages) > 1:
        yield from _stages(stages, (simulation, built))


def _what_is_built(configuration, built):
    filaments, system = built.filaments, built.system
    there = [filament for filament in filaments if not filament.is_reserve]
    segments = sum(filament.segments for filament in there)
    counts = [(len(there), "filament"), (segments, "segment"), (system.getNumParticles(), "particle")]
    if len(there) < len(filaments):
        counts.append((len(filaments) - len(there), "place for filaments that come", "places for filaments that come"))
    yield f"  {', '.join(_counted(*one) for one in counts)}"
    for label, group in zip(group_labels(configuration), configuration.filaments):
        yield f"    {label}"
        if group.growth is not None:
            yield f"      {_growth_of(group)}"
        if group.nucleation is not None:
            yield f"      {_beginnings(group, configuration.box)}"
    yield from _populations(configuration)
    yield from (f"    {own.count} × {own.name}, {own.diameter:g} nm" for own in configuration.particles)
    for own in configuration.bodies:
        spheres = int((own.body.radii > 0.0).sum())
        yield f"    {own.count} × {own.body.name}, {_counted(spheres, 'sphere')} of {own.body.radii.max():g} nm"
    for label, own in zip(linker_labels(configuration), configuration.linkers):
        count = len(own.anchors) if own.anchors is not None else own.count
        yield f"    {'linkers at a concentration' if count is None else _counted(count, 'linker')}: {label}"
    if configuration.barriers:
        yield f"    {_counted(len(configuration.barriers), 'barrier')}"
    if built.links:
        yield f"    {_counted(built.links, 'link')}"
    if configuration.joints:
        yield f"    {_counted(len(configuration.joints), 'joint')}"
    if configuration.box is not None:
        yield f"  box of {' × '.join(f'{edge:g}' for edge in configuration.box)} nm"
    yield f"  forces: {', '.join(force.getName() for force in system.getForces())}"


def _growth_of(group):
    growth = group.growth
    concentration = growth.pool.concentration / MICROMOLAR
    rates = {end: free_rate(growth, end, concentration) for end in ENDS if growth.states(end).grows}
    gains = [
        f"{rate:+.3g} monomers/s at the {end} end" if np.isfinite(rate) else f"as its length says at the {end} end"
        for end, rate in rates.items()
    ]
    nodes = f"{_counted(group.spare_nodes, 'spare node')} each, for a length of {growth.longest:g} nm"
    return f"{' and '.join(gains)}, where it is free, at {concentration:.4g} uM; {nodes}"


def _beginnings(group, box):
    rate = group.nucleation.whole_rate(box_vectors(box))
    if isinstance(group.nucleation, Branching):
        return f"{rate * _PER_SECOND_AND_UM:.3g} begin per second on each um of mothers"
    return f"{rate * _PER_SECOND:.3g} begin per second"


def _populations(configuration):
    for groups, _, name in populations(configuration, group_members(configuration)):
        free = steady_population(groups, box_vectors(configuration.box), groups[0].growth.pool.concentration)
        if free is not None:
            yield (
                f"    {name}: {free.number:.3g} at once in the long run, {free.length:.4g} nm long on average, where "
                f"they are free; {_counted(sum(group.count for group in groups), 'place')}"
            )


def _counted(count, what, several=None):
    return f"{count} {what if count == 1 else several or what + 's'}"


def _binding(configuration, recommended):
    names = [name for name, step in recommended.allowed.items() if step <= recommended.step * (1.0 + 1e-9)]
    # Those of forces say in their names which force it is.
    return f"{named_bound(configuration, names[0])}" if names and ":" in names[0] else recommended.reason


def _stages(stages, current):
    # In turn, with a few steps of each, which is to say that each can be begun.
    yield "  stages, each of which takes its first steps:"
    lasts = {stage.number: last for stage, last in named_stages(stages)}
    for stage, _, _ in take_first_steps(stages, current, STEPS_OF_STAGE):
        if not stage.is_piece:
            last = lasts[stage.number]
            count = last.number - stage.number + 1
            divided = f", in {count} pieces" if count > 1 else ""
            yield f"    {stage.name}: from {format_time(stage.begin)} to {format_time(last.end)}{divided}"


def take_first_steps(stages, current, count, most_seconds=float("inf"), stop=None):
    """Take a count of steps of each stage in turn, or fewer where they take long: each Stage, how many were taken, and
    the share of those of filaments that were divided.

    ``current`` are the Simulation and the BuiltSystem of the first one, where it begins. Each stage has an equal share
    of the seconds of processors that are left, and one that comes again takes none: None. ``stop`` is called after each
    step between stages. InputError and InstabilityError as in a run.
    """
    first, known, start = current, set(), time.process_time()
    for place, stage in enumerate(stages):
        taken, share = None, 0.0
        if id(stage.configuration) not in known:
            known.add(id(stage.configuration))
            with naming_stage(stage), located_instability(stage.configuration), steps():
                if stage.number:
                    seed = stages[0].configuration.simulation.seed
                    current = following_simulation(current, stage, first, seed, stop=stop)
                now = time.process_time()
                end = now + (start + most_seconds - now) / (len(stages) - place)
                taken, before = 0, _divided_steps(current)
                while taken < min(count, stage.configuration.simulation.steps) and time.process_time() < end:
                    current[0].step(1)
                    taken += 1
                share = (_divided_steps(current) - before) / max(1, taken * len(current[1].filaments))
        yield stage, taken, share


def _divided_steps(current):
    # Those of the portable engine are none.
    return getattr(current[0].integrator, "getNumDividedSteps", lambda: 0)()


def _cost(configuration, stages, simulation, built):
    settings = configuration.simulation
    with tempfile.TemporaryDirectory() as folder, located_instability(configuration), steps():
        recorder = Recorder(stages[0], built, simulation, RunDirectory(folder), None, stages)
        step, seconds = recorder.seconds_of_run(_MEASURED_SECONDS)
    seconds *= settings.steps / stages[0].configuration.simulation.steps
    particles, reports = simulation.system.getNumParticles(), sum(own.reports for own in stages) + 1
    # A frame of a DCD file has three records of single-precision numbers, and one of the box.
    trajectory = 276 + reports * (3 * (4 * particles + 8) + (56 if configuration.box is not None else 0))
    tables = reports * _BYTES_OF_NUMBER * len(ENERGY_COLUMNS)
    tables += reports * _BYTES_OF_NUMBER * len(LINKER_TABLE_COLUMNS) * len(configuration.linkers)
    grow = sum(filament.growth is not None for filament in built.filaments)
    tables += reports * _BYTES_OF_NUMBER // 2 * len(GROWTH_TABLE_COLUMNS) * grow
    return [
        f"  about {_duration(seconds)} for steps and reports: {1e3 * step:.3g} ms a step at first",
        f"  {reports} frames, every {_intervals(stages)}: trajectory of "
        f"{_size(trajectory)}, tables of about {_size(tables)}"
        + (", and a record of 100 bytes for each linker that is bound" if configuration.linkers else ""),
    ]


def _intervals(stages):
    every = (own.configuration.simulation for own in stages)
    return " or ".join(dict.fromkeys(format_time(own.steps_per_report * own.time_step) for own in every))


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
