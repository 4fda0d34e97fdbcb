"""The run: filaments from a configuration, simulated into a directory, resumable after any interruption."""

import contextlib
import math
import time

import numpy as np
import openmm
from openmm import unit

from ..couplings.crosslink_records import CrosslinkFile
from ..couplings.force_tables import ForceTables
from ..couplings.mean_forces import contact_forces, wall_forces
from ..engines.description import describe_lengths, filament_label
from ..errors import InputError, InstabilityError
from ..filaments.twist import has_twist
from ..mechanics.broken_segment import find_broken_segment
from ..output.growth_reporter import rows_of_growth
from ..output.linker_records import LinkerFile, measure_linkers
from ..output.progress import RunProgress
from ..output.run_tables import ReportTable, TrajectoryFile
from ..output.twist_rows import TwistFile, rows_of_twist
from ..systems.described_runs import (
    energy_cells,
    growth_in,
    total_energies,
    write_topology,
)
from ..systems.step_check import check_time_step
from ..units.quantities import thermal_energy
from ..units.text import format_time
from .countless_events import refuse_countless_events
from .created_simulation import begin, create_simulation, platform_of, stage_simulation
from .description import describe
from .errors_of_tables import located_errors, located_instability
from .initial_state import build_system
from .lost_turns import LostTurns
from .moving_tethers import MovingTethers
from .relaxation import relaxed_positions
from .rows_of_forces import RowsOfForces
from .run_directory import Checkpoint, RunDirectory
from .signals import Signals
from .stage_transition import following_simulation
from .stages import naming_stage, stage_at, stages_of

_SECONDS_BETWEEN_CHECKS = 0.2
_MEASURED_REPORTS = 3
_LEAST_POWER, _MOST_GROWTH = 0.1, 3.0


class RunInterrupted(Exception):  # noqa: N818 - not an error
    """A run that a signal has ended after a checkpoint: the message says how to go on."""

    def __init__(self, signal_number, message):
        super().__init__(message)
        self.signal_number = signal_number


def run(configuration, output, resume=False):
    """Run a configuration, or continue it, until its end.

    Files in the output directory: ``configuration.toml``, ``description.json`` (what ``analysis.load`` needs to know),
    ``topology.cif``, the same for VMD (``topology.psf``) and OVITO (``topology.data``), ``trajectory.dcd`` (the initial
    configuration and one frame per report interval), ``energies.csv`` and ``checkpoint.chk``; with linkers also
    ``linkers.csv`` (how many are bound, their tensions) and ``linkers.npy`` (where each one is, see
    ``LinkerReporter``); with twist ``twists.npy``; with filaments that grow ``growth.csv``; with walls
    ``wall_forces.csv``, and with contacts ``contact_forces.csv``: forces of each face, and on each filament, means over
    the steps since the report before. A resumed run ends with the same files, to the bit, as one that was never
    interrupted.

    Parameters
    ----------
    output : str or Path
    resume : bool
        Continue the run in ``output``; it starts from the beginning if there is no checkpoint yet.

    Raises
    ------
    InputError
        If the configuration cannot be simulated, or the directory is not that of this run.
    InstabilityError
        If the simulation blows up. Frames written before are kept.
    RunInterrupted
        After SIGINT or SIGTERM.
    """
    stages = stages_of(configuration)
    checked = len(stages) > 1 and not resume
    first = check_stages(stages) if checked else create_simulation(stages[0].configuration)
    with RunDirectory(output) as directory:
        checkpoint = directory.claim(configuration, resume)
        if checkpoint is not None and checkpoint.step == configuration.simulation.steps:
            print(f"The run in {directory.path} is finished: nothing to resume.")
            return
        if checkpoint is None:
            if resume:
                print("No checkpoint yet: starting from the beginning.")
            stage, current = stages[0], first
            simulation, built = first
            positions = begin(stage.configuration, *first)
            write_topology(directory, simulation.topology, built.filaments, simulation.system, positions)
            describe(configuration, built.filaments, simulation.system, simulation.topology).write(
                directory.description
            )
            _write_crosslinks(directory, simulation, stages)
        else:
            stage = stage_at(stages, checkpoint.step)
            current = first if stage.number == 0 else stage_simulation(stage, first, checkpoint.deleted)
            _restore(current[0].context, checkpoint, current[1].filaments.engine)
            _check_crosslinks(directory, current[0], stages, checkpoint.step)
            where = f" in {stage.name}" if stage.name else ""
            print(f"Resuming at step {checkpoint.step}, {format_time(stage.time(checkpoint.step))}{where}.")
        try:
            with Signals() as signals:
                progress = RunProgress(stages[-1].end, 0.0 if checkpoint is None else stage.time(checkpoint.step))
                try:
                    _run_stages(stages, stage, first, current, directory, checkpoint, signals, progress)
                finally:
                    progress.finish()
        except InstabilityError as error:
            raise type(error)(
                f"{error} What came before is kept in {directory.path}; run the changed configuration in another "
                "directory.",
                **error.place,
            ) from None


def _run_stages(stages, stage, first, current, directory, checkpoint, signals, progress):
    # From a stage on, which is in the state of its Simulation.
    seed = stages[0].configuration.simulation.seed
    while True:
        with naming_stage(stage), located_instability(stage.configuration), steps():
            recorder = Recorder(stage, current[1], current[0], directory, checkpoint, stages)
            checkpoint = recorder.run_to_end(signals, progress)
        if stage.number == len(stages) - 1:
            return
        stage = stages[stage.number + 1]
        with naming_stage(stage):
            current = following_simulation(current, stage, first, seed, print)
        _write_crosslinks(directory, current[0], stages, stage.first_step)


def check_stages(stages):
    """The Simulation of the first stage and its BuiltSystem; InputError if any stage cannot be simulated."""
    first, known = None, set()
    for stage in stages:
        if stage.is_piece or id(stage.configuration) in known:
            continue
        known.add(id(stage.configuration))
        with naming_stage(stage):
            current = create_simulation(stage.configuration) if first is None else stage_simulation(stage, first)
        first = first or current
    return first


@contextlib.contextmanager
def steps():
    """InstabilityError in place of any other error with which OpenMM ends a step."""
    try:
        yield
    except openmm.OpenMMException as error:
        raise InstabilityError(f"A step cannot be taken: {error}.") from None


@located_errors
def check_step(configuration, seconds=20.0, say=lambda message: None):
    """Run a configuration for a while with its step and a sixteenth of it: see ``step_check.check_time_step``.

    Parameters
    ----------
    seconds : float
        Time that it may take.
    say : callable (str), optional
        Told how far it is.

    Returns
    -------
    StepCheck

    Raises
    ------
    InputError
        If the configuration cannot be simulated.
    RunInterrupted
        After SIGINT or SIGTERM.
    """
    settings = configuration.simulation
    built = build_system(configuration, settings.engine, settings.seed)
    refuse_countless_events(configuration, built.filaments)
    positions = relaxed_positions(configuration, built, say)
    platform, properties = platform_of(settings, built.filaments.engine)
    # An interruption that Python raises within a step may end as an error of OpenMM.
    with Signals() as signals, located_instability(configuration), steps():
        check = check_time_step(
            built.filaments,
            built.system,
            positions,
            settings.time_step,
            scheme=settings.scheme,
            seconds=seconds,
            random_seed=settings.seed,
            equilibrium=all(
                group.start == "equilibrium" and not group.disturbed and not group.planar
                for group in configuration.filaments
            ),
            **built.arguments(),
            platform=platform,
            properties=properties,
            say=say,
            stop=lambda: signals.received is not None,
        )
    if signals.received is not None:
        raise RunInterrupted(signals.received, "The check has not come to its end: start it again.")
    return check


def _write_crosslinks(directory, simulation, stages, step=None):
    # Those of a stage stay as they are; from a step on, they follow those that are there.
    if any(own.configuration.links for own in stages):
        file = CrosslinkFile(directory.crosslinks, simulation.system, step is not None, step or 0)
        with contextlib.closing(file):
            # The frame of the step is that of the stage before.
            file.write(simulation.context, 0 if step is None else step + 1)
            file.synchronise()


def _check_crosslinks(directory, simulation, stages, step):
    if any(own.configuration.links for own in stages):
        CrosslinkFile(directory.crosslinks, simulation.system, append=True, step=step).close()


def _restore(context, checkpoint, engine):
    if checkpoint.engine != engine:
        raise InputError(
            f"The run was started with the {checkpoint.engine} engine, and this is the {engine} one: resume with that, "
            "or start it again in another directory."
        )
    try:
        context.loadCheckpoint(checkpoint.state)
    except openmm.OpenMMException as error:
        raise InputError(
            f"The checkpoint cannot be loaded: {error}. Resume on the machine and with the OpenMM version on which "
            "the run was started."
        ) from None


class Recorder:
    # Advances the simulation and writes frames, energies, linkers and checkpoints at their times.

    def __init__(self, stage, built, simulation, directory, checkpoint, stages=None):
        configuration, filaments = stage.configuration, built.filaments
        self._stage, self._stages = stage, stages or (stage,)
        self._settings = configuration.simulation
        self._kT = thermal_energy(configuration.solvent.temperature)
        self._filaments, self._deleted = filaments, built.deleted
        self._simulation = simulation
        self._directory = directory
        self._checkpoint = checkpoint
        self._step = 0 if checkpoint is None else checkpoint.step
        self._moving = MovingTethers(stage, filaments)
        self._framed = sorted({frame.filament for frame in filaments.end_frames})
        self._twisted = any(has_twist(own.type) for own in filaments)
        # Without contacts, strands pass through each other anyway.
        self._lost_turns = LostTurns(filaments) if self._twisted and configuration.contacts_of_filaments else None
        self._absent = [number for number, own in enumerate(filaments) if not own.takes_part]
        self._grows = any(filament.growth is not None for filament in filaments)
        self._rows = RowsOfForces(self._stages, configuration)

    def run_to_end(self, signals, progress):
        """Take the steps of the stage that are left, and return the Checkpoint of its end."""
        with self.files():
            if self._checkpoint is None:
                self._report()
            return self._advance(signals, progress)

    @contextlib.contextmanager
    def files(self):
        """A context in which the files of the run are open."""
        settings, begun = self._stages[0].configuration.simulation, self._checkpoint
        self._trajectory = TrajectoryFile(
            self._directory.trajectory,
            self._simulation.topology,
            settings.time_step,
            settings.steps_per_report,
            begun and begun.trajectory_size,
            begun.trajectory_header if begun else b"",
        )
        self._energies = ReportTable(self._directory.energies, begun and begun.energies_size)
        files = [self._trajectory, self._energies]
        if self._filaments.linkers:
            self._linkers = ReportTable(self._directory.linkers, begun and begun.linkers_size)
            self._places = LinkerFile(self._directory.linker_places, begun and begun.linker_records)
            files += [self._linkers, self._places]
        if self._moving:
            self._pulling = ReportTable(self._directory.pulling, begun and begun.pulling_size)
            files.append(self._pulling)
        if self._framed:
            self._twist = ReportTable(self._directory.twist, begun and begun.twist_size)
            files.append(self._twist)
        if self._twisted:
            self._twists = TwistFile(self._directory.twists, self._filaments, begun and begun.twist_records)
            files.append(self._twists)
        if self._grows:
            self._growth = ReportTable(self._directory.growth, begun and begun.growth_size)
            files.append(self._growth)
        self._forces = ForceTables(self._directory, *self._rows.there, begun and begun.force_sizes)
        files.append(self._forces)
        with contextlib.ExitStack() as stack:
            for file in files:
                stack.enter_context(contextlib.closing(file))
            yield

    def seconds_of_run(self, most):
        """Seconds that a step takes at first, and all steps, reports and checkpoints of the run.

        Steps are taken for ``most`` seconds, but no more than the run has; then a few reports and a checkpoint. Where
        linkers bring filaments together, steps become slower: by a power of their number, which is that of the second
        half of those that are taken to the first, and threefold in all at most.
        """
        settings, moving, chunk = self._settings, self._moving, 1
        with self.files():
            moving.move(self._simulation.context, 0)
            self._timed_steps(1)  # which sets things up
            self._report()
            start, first, work = time.monotonic(), self._step, [(0, time.process_time())]
            while self._step == first or (self._step < max(settings.steps, 2) and time.monotonic() - start < most):
                chunk = self._timed_steps(self._limited(chunk))
                if moving and self._done % moving.interval == 0:
                    moving.move(self._simulation.context, self._step)
                work.append((self._step - first, time.process_time()))
            taken = self._step - first
            step = (time.monotonic() - start) / taken
            start = time.monotonic()
            for _ in range(_MEASURED_REPORTS):
                self._report()
            report = (time.monotonic() - start) / _MEASURED_REPORTS
            start = time.monotonic()
            self._write_checkpoint()
            checkpoint = time.monotonic() - start
        slower = _growth(work, settings.steps / taken) if self._filaments.linkers else 1.0
        reports = settings.steps // settings.steps_per_report + 1
        checkpoints = math.ceil(settings.steps / settings.steps_per_checkpoint)
        return step, settings.steps * slower * step + reports * report + checkpoints * checkpoint

    @property
    def _done(self):
        # Steps of the stage.
        return self._step - self._stage.first_step

    def _limited(self, chunk):
        # Up to the next report, or motion of tethers.
        limits = [self._settings.steps_per_report - self._done % self._settings.steps_per_report]
        if self._moving:
            limits.append(self._moving.interval - self._done % self._moving.interval)
        return min(chunk, *limits)

    def _advance(self, signals, progress):
        settings, moving, last = self._settings, self._moving, self._stage.last_step
        chunk, checkpoint = 1, self._checkpoint
        moving.move(self._simulation.context, self._step)
        while self._step < last:
            chunk = self._timed_steps(self._limited(chunk))
            if self._done % settings.steps_per_report == 0:
                self._report()
            if moving and self._done % moving.interval == 0:
                moving.move(self._simulation.context, self._step)
            interrupted = signals.received is not None
            if interrupted or self._done % settings.steps_per_checkpoint == 0 or self._step == last:
                checkpoint = self._write_checkpoint()
            if interrupted:
                raise RunInterrupted(
                    signals.received,
                    f"Interrupted at step {self._step} of {self._stages[-1].last_step}; a checkpoint is written. "
                    "Continue with the same command and --resume.",
                )
            progress.update(self._stage.time(self._step))
        return checkpoint

    def _timed_steps(self, steps):
        # Take some steps and return how many to take before signals are looked at again.
        start = time.monotonic()
        self._simulation.step(steps)
        self._step += steps
        elapsed = max(time.monotonic() - start, 1e-6)
        return max(1, min(2 * steps, int(steps * _SECONDS_BETWEEN_CHECKS / elapsed)))

    def _report(self):
        context = self._simulation.context
        state = context.getState(positions=True)
        positions = state.getPositions(asNumpy=True).value_in_unit(unit.nanometer)
        growth = growth_in(context, self._filaments)
        stretching, bending = total_energies(self._filaments, context, positions)
        self._check_finite(positions, stretching, bending)
        self._trajectory.write(self._without_absent(positions))
        self._energies.write(
            self._step,
            (
                self._stage.time(self._step),
                *energy_cells(self._filaments, positions, stretching, bending, self._kT, growth),
            ),
        )
        if self._filaments.linkers:
            rows, records = measure_linkers(self._filaments, context, self._step)
            for number, row in enumerate(rows):
                self._linkers.write(self._step, (self._stage.time(self._step), number, *row))
            self._places.write(records)
        if any(self._rows.there):
            time, walls, contacts = self._stage.time(self._step), wall_forces(context), contact_forces(context)
            self._forces.write_rows(self._step, time, *self._rows.of(walls, contacts, self._filaments))
        for row in rows_of_growth(growth):
            self._growth.write(self._step, (self._stage.time(self._step), *row))
        for row in self._moving.rows(self._step, positions):
            self._pulling.write(self._step, row)
        for row in rows_of_twist(self._filaments, context, self._framed):
            self._twist.write(self._step, (self._stage.time(self._step), *row))
        if self._twisted:
            self._twists.measure(context, self._step)
        if self._lost_turns:
            self._lost_turns.look(context)

    def _without_absent(self, positions):
        # Of a filament that is not there, all particles are in one place: that of a node that stands still.
        if self._absent:
            positions = np.array(positions)
        for number in self._absent:
            nodes = self._filaments.node_indices[number]
            positions[nodes] = positions[self._filaments.control_point_indices[number]] = positions[nodes[-1]]
        return positions

    def _check_finite(self, positions, stretching, bending):
        if np.isfinite(stretching) and np.isfinite(bending) and np.all(np.isfinite(positions)):
            return
        filaments = self._filaments
        curved = [(number, own) for number, own in enumerate(filaments) if not own.type.segment_kind.straight]
        for number, own in curved:
            particles = np.concatenate([filaments.node_indices[number], filaments.control_point_indices[number]])
            if not np.all(np.isfinite(positions[particles])):
                node = int(np.argmin(np.isfinite(positions[particles]).all(axis=1))) % len(own.positions)
                raise InstabilityError(
                    f"{filament_label(number, own)} has blown up at node {node} by step {self._step}: its position is "
                    "not finite. Use a smaller time step.",
                    filament=number,
                    segment=min(node, own.segments - 1),
                    step=self._step,
                )
        if curved or self._grows or not len(filaments):
            raise InstabilityError(
                f"The energy is not finite in step {self._step}. Use a smaller time step.", step=self._step
            )
        chains = filaments.chain_set(self._simulation.system)
        nodes = np.concatenate(filaments.node_indices)
        broken = find_broken_segment(chains, *describe_lengths(filaments), positions[nodes])
        if broken is not None:
            raise InstabilityError(
                f"{filament_label(broken.chain, filaments[broken.chain])} has blown up at segment {broken.segment} by "
                f"step {self._step}: its position or energy is not finite. Use a smaller time step.",
                filament=broken.chain,
                segment=broken.segment,
                step=self._step,
            )
        raise InstabilityError(f"The energy is not finite in step {self._step}. Use a smaller time step.")

    def _write_checkpoint(self):
        size, header = self._trajectory.synchronise()
        checkpoint = Checkpoint(
            step=self._step,
            engine=self._filaments.engine,
            trajectory_size=size,
            trajectory_header=header,
            energies_size=self._energies.synchronise(),
            linkers_size=self._linkers.synchronise() if self._filaments.linkers else 0,
            linker_records=self._places.synchronise() if self._filaments.linkers else 0,
            pulling_size=self._pulling.synchronise() if self._moving else 0,
            twist_size=self._twist.synchronise() if self._framed else 0,
            twist_records=self._twists.synchronise() if self._twisted else 0,
            force_sizes=self._forces.synchronise(),
            growth_size=self._growth.synchronise() if self._grows else 0,
            deleted=self._deleted,
            state=self._simulation.context.createCheckpoint(),
        )
        self._directory.write_checkpoint(checkpoint)
        return checkpoint


def _growth(work, longer):
    # By which factor steps of a run so many times longer are slower, on average, by numbers of steps and the work until
    # then.
    steps, seconds = np.array(work).T
    half, whole = np.interp(0.5 * steps[-1], steps, seconds - seconds[0]), seconds[-1] - seconds[0]
    power = np.log2(whole / half) - 1.0 if half > 0.0 else 0.0
    return min(_MOST_GROWTH, max(1.0, longer) ** power) if power > _LEAST_POWER else 1.0
