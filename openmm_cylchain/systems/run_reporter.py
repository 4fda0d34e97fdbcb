"""A reporter that writes what ``openmm-cylchain run`` writes, so that scripts are loaded, drawn and exported alike."""

import contextlib
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np
import openmm

from ..couplings.crosslink_records import CrosslinkFile
from ..couplings.crosslinks import Crosslinks
from ..couplings.force_tables import ForceTables
from ..couplings.mean_forces import ForceReaders
from ..couplings.periodicity import is_periodic
from ..couplings.shapes import Shape
from ..errors import InputError
from ..filaments.twist import has_twist
from ..output.files import as_path
from ..output.growth_reporter import rows_of_growth
from ..output.linker_records import LinkerFile, measure_linkers
from ..output.record_file import read_records
from ..output.run_files import RunFiles
from ..output.run_tables import (
    ReportTable,
    TrajectoryFile,
    size_of_lines,
    start_of_trajectory,
)
from ..output.twist_rows import TwistFile
from ..units.quantities import (
    LARGEST_INT,
    LENGTH,
    positive,
    require_kind,
    shown,
    thermal_energy,
    true_or_false,
    whole_number,
)
from ..units.types import Scalar
from .described_runs import (
    describe_system,
    energy_cells,
    growth_in,
    total_energies,
    write_topology,
)
from .filaments import Filaments

if TYPE_CHECKING:
    from openmm import app


class RunReporter:
    """Writes a directory as ``openmm-cylchain run`` does, for ``simulation.reporters`` of OpenMM's app layer.

    ``analysis.load``, ``openmm-cylchain render`` and ``openmm-cylchain export`` take the directory. In it are the
    trajectory with its topology, energies, a description of filaments, periodic box, walls of ``filament_wall_force``
    and contacts, their forces (means over the steps between frames), and where linkers and crosslinks are, which may
    come and go. The configuration in which the
    Simulation starts is the first frame.

    Parameters
    ----------
    directory : str or Path
        Made if it does not exist.
    reportInterval : int
        In steps.
    filaments : Filaments
        In the System that is simulated.
    title : str
    walls : sequence of Shape
        Those to be drawn beside walls of ``filament_wall_force``: of ``wall_force``, whose formula alone is in the
        System.
    particle_diameters : mapping of names of residues to lengths, optional
        Of particles beside filaments, to be drawn so. Of those that are not named: the diameter in contacts, or the
        sigma of a ``NonbondedForce``; where there is neither, they are drawn so that they can be seen.
    append : bool
        Go on with a directory that this reporter has written; frames behind the present step are forgotten, so that
        a run can go on from a checkpoint. The description stays what it was.

    Raises
    ------
    InputError
        If the directory holds a run already (without ``append``), or none (with it), or another one; in the first
        step, if there are no particles of a name that has a diameter.

    Examples
    --------
    >>> simulation.reporters.append(RunReporter("my_run", 100, filaments))  # doctest: +SKIP
    >>> simulation.step(10000)  # doctest: +SKIP
    >>> run = analysis.load("my_run")  # doctest: +SKIP
    """

    def __init__(
        self,
        directory: str | Path,
        reportInterval: int,  # noqa: N803 - OpenMM's name
        filaments: Filaments,
        title: str = "",
        walls: Sequence[Shape] = (),
        append: bool = False,
        particle_diameters: Mapping[str, Scalar] | None = None,
    ) -> None:
        self._closed = True
        self._interval = whole_number(reportInterval, 1, "reportInterval", LARGEST_INT)
        if not isinstance(filaments, Filaments):
            raise InputError(f"filaments must be a Filaments object, but is {type(filaments).__name__}.")
        if not isinstance(walls, Sequence) or isinstance(walls, str):
            raise InputError(f"walls must be a sequence of Shapes such as Sphere, but is {shown(walls)}.")
        for shape in walls:
            if not isinstance(shape, Shape):
                raise InputError(f"walls must be Shapes such as Sphere, but one is {shown(shape)}.")
        as_path(directory, "directory")
        require_kind(title, str, "title")
        self._filaments, self._title, self._walls = filaments, title, tuple(walls)
        self._kT = thermal_energy(filaments.temperature)
        self._append = append = true_or_false(append, "append")
        particle_diameters = {} if particle_diameters is None else particle_diameters
        if not isinstance(particle_diameters, Mapping) or not all(isinstance(name, str) for name in particle_diameters):
            raise InputError(
                "particle_diameters must have lengths by names of residues, such as {'PRT': 5.0}, but is "
                f"{shown(particle_diameters)}."
            )
        self._diameters = {
            name: positive(diameter, LENGTH, f"particle_diameters: the diameter of {name!r}")
            for name, diameter in particle_diameters.items()
        }
        self._files = RunFiles(directory)
        self._open: list[Any] = []
        self._last = -1
        if self._files.path.exists() and not self._files.path.is_dir():
            raise InputError(f"{directory} is a file: give the name of a directory.")
        there = self._files.trajectory.exists() or self._files.configuration.exists()
        if there and not append:
            raise InputError(
                f"{directory} holds a run already: choose another directory, or go on with it by append=True."
            )
        if append and (not there or self._files.configuration.exists()):
            raise InputError(f"{directory} holds no run of a RunReporter: it cannot be gone on with.")
        self._closed = False

    def describeNextReport(self, simulation: "app.Simulation") -> dict[str, Any]:  # noqa: N802 - OpenMM's name
        """When the next report is due, and that it needs positions; as OpenMM asks for it."""
        if self._closed:
            raise InputError(f"The RunReporter of {self._files.path} is closed: make another one with append=True.")
        if not self._open:
            self._begin(simulation)
        steps = self._interval - simulation.currentStep % self._interval
        return {"steps": steps, "periodic": False, "include": ["positions"]}

    def _begin(self, simulation):
        filaments, system, files = self._filaments, simulation.system, self._files
        last = max(int(own.max()) for own in (*filaments.node_indices, *filaments.body_indices))
        if last >= system.getNumParticles():
            raise InputError("filaments must be those in the System that is simulated, but it has fewer particles.")
        time_step = simulation.integrator.getStepSize()._value
        state = simulation.context.getState(positions=True)
        files.path.mkdir(parents=True, exist_ok=True)
        frames, step = None, simulation.currentStep
        if self._append:
            frames = size_of_lines(files.energies, step)[1]
        else:
            box = state.getPeriodicBoxVectors(asNumpy=True)._value if is_periodic(system) else None
            description = describe_system(
                filaments,
                system,
                self._title,
                time_step,
                None,
                self._interval,
                box,
                self._walls,
                simulation.topology,
                self._diameters_of(simulation.topology),
            )
            description.write(files.description)
            write_topology(files, simulation.topology, filaments, system, state.getPositions(asNumpy=True))

        def table(path):
            return ReportTable(path, size_of_lines(path, step)[0] if self._append else None)

        with contextlib.ExitStack() as stack:

            def opened(file):
                stack.callback(file.close)
                self._open.append(file)
                return file

            begun = start_of_trajectory(files.trajectory, frames) if frames is not None else (None, b"")
            self._trajectory = opened(
                TrajectoryFile(files.trajectory, simulation.topology, time_step, self._interval, *begun)
            )
            self._energies = opened(table(files.energies))
            if filaments.linkers:
                self._linkers = opened(table(files.linkers))
                count = None
                if self._append:
                    count = int(np.searchsorted(read_records(files.linker_places)["step"], step, "right"))
                self._places = opened(LinkerFile(files.linker_places, count))
            self._twists = None
            if any(has_twist(own.type) for own in filaments):
                count = (
                    int(np.searchsorted(read_records(files.twists)["step"], step, "right")) if self._append else None
                )
                self._twists = opened(TwistFile(files.twists, filaments, count))
            if growth_in(simulation.context, filaments) is not None:
                self._growth = opened(table(files.growth))
            self._readers = ForceReaders(simulation.context)
            on_filaments = len(filaments) > 0 and bool(self._readers.contact_forces())
            there = bool(self._readers.wall_forces()), on_filaments
            sizes = None
            if self._append:
                paths = files.wall_forces, files.contact_forces
                sizes = [size_of_lines(path, step)[0] if own else 0 for path, own in zip(paths, there)]
            self._forces = opened(ForceTables(files, *there, sizes))
            self._crosslinks = None
            if Crosslinks.from_system(system):
                self._crosslinks = opened(CrosslinkFile(files.crosslinks, system, self._append, step))
            stack.pop_all()
        if not self._append and step % self._interval == 0:
            self.report(simulation, state)

    def _diameters_of(self, topology):
        names = {atom.index: atom.residue.name for atom in topology.atoms()}
        for name in self._diameters:
            if name not in names.values():
                there = ", ".join(sorted(set(names.values())))
                raise InputError(f"particle_diameters has {name!r}, but residues are named {there}.")
        return {index: self._diameters[name] for index, name in names.items() if name in self._diameters}

    def report(self, simulation: "app.Simulation", state: openmm.State) -> None:
        """Write a frame; OpenMM calls it."""
        step, time = simulation.currentStep, state.getTime()._value
        positions = state.getPositions(asNumpy=True)._value
        growth = growth_in(simulation.context, self._filaments)
        energies = total_energies(self._filaments, simulation.context, positions)
        cells = energy_cells(self._filaments, positions, *energies, self._kT, growth)
        # The energies come last: load takes a frame for whole that has a line there.
        self._trajectory.write(positions)
        if self._crosslinks is not None:
            self._crosslinks.write(simulation.context, step)
        if self._filaments.linkers:
            rows, records = measure_linkers(self._filaments, simulation.context, step)
            for number, row in enumerate(rows):
                self._linkers.write(step, (time, number, *row))
            self._places.write(records)
        if self._twists is not None:
            self._twists.measure(simulation.context, step)
        for line in rows_of_growth(growth):
            self._growth.write(step, (time, *line))
        walls, contacts = self._readers.wall_forces(), self._readers.contact_forces()
        self._forces.write(step, time, walls, contacts, self._filaments)
        self._energies.write(step, (time, *cells))

    def close(self) -> None:
        """Close the files; what was written can be loaded before, too."""
        for file in getattr(self, "_open", []):
            file.close()
        self._open, self._closed = [], True

    def __del__(self) -> None:
        self.close()
