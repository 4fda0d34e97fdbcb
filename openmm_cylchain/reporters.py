"""Reporters of filaments, tethers and crosslinks, for ``simulation.reporters`` of OpenMM's app layer.

They write CSV with a line for each filament, tether or crosslink and report, which tables and spreadsheets read as it
is, and keep what they wrote as NumPy arrays.
"""

from abc import ABC, abstractmethod
from pathlib import Path

import numpy as np

from .errors import InputError
from .geometry import segment_vectors
from .quantities import whole_number


class _TableReporter(ABC):
    # What reporters of a table have in common: a line for each thing and report.

    _columns = ()
    _thing = ""

    def __init__(self, file, reportInterval, append=False):  # noqa: N803 - OpenMM's name
        self._interval = whole_number(reportInterval, 1, "reportInterval")
        self._rows = []
        self._reports = []
        self._owned = isinstance(file, (str, Path))
        if self._owned:
            file = open(file, "a" if append else "w", newline="")  # noqa: SIM115 - closed with the reporter
        elif file is not None and not hasattr(file, "write"):
            raise InputError(f"file must be a path, a file that is open for writing, or None, but is {file!r}.")
        self._file = file
        if file is not None and not (append and self._owned and file.tell() > 0):
            print(",".join(("step", "time_ps", self._thing, *self._columns)), file=file)

    def describeNextReport(self, simulation):  # noqa: N802 - OpenMM's name
        """When the next report is due, and that it needs positions; as OpenMM asks for it."""
        steps = self._interval - simulation.currentStep % self._interval
        return {"steps": steps, "periodic": False, "include": ["positions"]}

    def report(self, simulation, state):
        """Write a report; OpenMM calls it."""
        time = state.getTime()._value
        numbers, values = self._table(simulation, state)
        self._reports.append((simulation.currentStep, time))
        self._rows.append(values)
        if self._file is None:
            return
        for number, row in zip(numbers, values):
            cells = (simulation.currentStep, f"{time:.10g}", number, *(f"{value:.10g}" for value in row))
            print(",".join(str(cell) for cell in cells), file=self._file)
        self._file.flush()

    @abstractmethod
    def _table(self, simulation, state):
        """The numbers of all things, and a row of values for each."""

    @property
    def step(self):
        """The steps of all reports so far."""
        return np.array([step for step, _ in self._reports], dtype=int)

    @property
    def time(self):
        """The times of all reports so far, in ps."""
        return np.array([time for _, time in self._reports], dtype=float)

    def close(self):
        """Close the file, if the reporter has opened it."""
        if self._owned and self._file is not None:
            self._file.close()
            self._file = None

    def __del__(self):
        if getattr(self, "_owned", False):
            self.close()


class FilamentsReporter(_TableReporter):
    """What reporters of things whose number does not change have in common: arrays (reports, things)."""

    def __init__(self, file, reportInterval, filaments, append=False):  # noqa: N803 - OpenMM's name
        self._filaments = filaments
        self._nodes = filaments.node_indices
        super().__init__(file, reportInterval, append)

    def __getitem__(self, column):
        """An array (reports, filaments or tethers) of a column."""
        if column not in self._columns:
            raise InputError(f"There is no column {column!r}: known are {', '.join(self._columns)}.")
        table = np.array(self._rows, dtype=float).reshape(len(self._rows), -1, len(self._columns))
        return table[:, :, self._columns.index(column)]


class FilamentReporter(FilamentsReporter):
    """Reports energies, end-to-end distance and contour length of every filament.

    Columns: ``stretching_energy`` and ``bending_energy`` in kJ/mol, ``end_to_end_distance`` and ``contour_length`` in
    nm. ``reporter["contour_length"]`` is an array (reports, filaments). The ends of a ring are one, at distance 0.

    Parameters
    ----------
    file : str, Path, file object or None
        None keeps the arrays alone.
    reportInterval : int
        In steps.
    filaments : Filaments
    append : bool
        Go on with a file that exists.

    Examples
    --------
    >>> simulation.reporters.append(FilamentReporter("filaments.csv", 100, filaments))  # doctest: +SKIP
    """

    _columns = ("stretching_energy", "bending_energy", "end_to_end_distance", "contour_length")
    _thing = "filament"

    def _table(self, simulation, state):
        positions = state.getPositions(asNumpy=True)._value
        rows = [_describe(filament, positions[nodes]) for filament, nodes in zip(self._filaments, self._nodes)]
        return range(len(rows)), rows


def _describe(filament, nodes):
    segments = segment_vectors(nodes, filament.closed)
    contour_length = np.linalg.norm(segments, axis=1).sum()
    end_to_end_distance = 0.0 if filament.closed else np.linalg.norm(nodes[-1] - nodes[0])
    return *filament.energies(nodes), end_to_end_distance, contour_length


class TetherReporter(FilamentsReporter):
    """Reports where every tether's point and node are, and the force of the tether on its node, -k (x - point).

    Columns: ``point_x``, ``point_y``, ``point_z``, ``extension_x``, ``extension_y``, ``extension_z`` (x - point) in nm,
    ``force_x``, ``force_y``, ``force_z`` in kJ/(mol nm). Points and stiffnesses are those of ``Filaments.move_tether``.

    Parameters
    ----------
    file : str, Path, file object or None
        None keeps the arrays alone.
    reportInterval : int
        In steps.
    filaments : Filaments
    append : bool
        Go on with a file that exists.
    """

    _columns = tuple(f"{what}_{axis}" for what in ("point", "extension", "force") for axis in "xyz")
    _thing = "tether"

    def __init__(self, file, reportInterval, filaments, append=False):  # noqa: N803 - OpenMM's name
        if not filaments.tethers:
            raise InputError("There are no tethers to report: call add_tether first.")
        super().__init__(file, reportInterval, filaments, append)

    def _table(self, simulation, state):
        positions = state.getPositions(asNumpy=True)._value
        rows = []
        for tether in self._filaments.tethers:
            extension = positions[self._nodes[tether.filament][tether.node]] - tether.point
            rows.append((*tether.point, *extension, *(-tether.stiffness * extension)))
        return range(len(rows)), rows


class CrosslinkReporter(_TableReporter):
    """Reports the particles, length, extension and force of every crosslink that there is at a report.

    Columns: ``particle_1``, ``particle_2``, ``length`` d and ``extension`` d - d0 in nm, ``force`` dV/dd in
    kJ/(mol nm), positive where it pulls. A crosslink is known by its number, which no other one gets when it is
    removed. Since each report may have more or fewer, ``reporter["force"]`` is an array (lines,) as in the file, beside
    ``reporter["step"]``, ``reporter["time_ps"]`` and ``reporter["crosslink"]``; ``count`` says how many a report has.

    Parameters
    ----------
    file : str, Path, file object or None
        None keeps the arrays alone.
    reportInterval : int
        In steps.
    crosslinks : Crosslinks
        In the System that is simulated.
    append : bool
        Go on with a file that exists.

    Examples
    --------
    >>> reporter = CrosslinkReporter("crosslinks.csv", 100, links)  # doctest: +SKIP
    >>> simulation.reporters.append(reporter)  # doctest: +SKIP
    >>> reporter["force"][reporter["crosslink"] == 3]  # doctest: +SKIP
    """

    _columns = ("particle_1", "particle_2", "length", "extension", "force")
    _thing = "crosslink"

    def __init__(self, file, reportInterval, crosslinks, append=False):  # noqa: N803 - OpenMM's name
        self._crosslinks = crosslinks
        self._numbers = []
        super().__init__(file, reportInterval, append)

    def _table(self, simulation, state):
        table, lengths, forces = self._crosslinks.measure(simulation.context, state)
        self._numbers.append(table.numbers)
        return table.numbers, list(zip(*table.pairs.T, lengths, lengths - table.rest_length, forces))

    @property
    def count(self):
        """How many crosslinks each report has: an array (reports,)."""
        return np.array([len(numbers) for numbers in self._numbers], dtype=int)

    def __getitem__(self, column):
        """An array (lines,) of a column of the file."""
        if column == "step":
            return np.repeat(self.step, self.count)
        if column == "time_ps":
            return np.repeat(self.time, self.count)
        if column == "crosslink":
            return np.concatenate([np.zeros(0, dtype=int), *self._numbers])
        if column not in self._columns:
            known = ("step", "time_ps", self._thing, *self._columns)
            raise InputError(f"There is no column {column!r}: known are {', '.join(known)}.")
        index = self._columns.index(column)
        kind = int if column.startswith("particle") else float
        return np.array([row[index] for rows in self._rows for row in rows], dtype=kind)
