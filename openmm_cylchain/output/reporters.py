"""Reporters of filaments, tension, tethers, crosslinks and linkers, for ``simulation.reporters`` of OpenMM's app layer.

They write CSV with a line for each filament, joint, tether, crosslink or type of linkers and report, which tables and
spreadsheets read as it is, and keep what they wrote as NumPy arrays.
Positions are taken as they are, not wrapped into a periodic box.

With ``append=True`` they go on with a file that exists; a line that a killed run has left unfinished is cut off. A run
that goes on from a checkpoint older than its last report writes the reports in between once more, as OpenMM's reporters
do: of lines with the same step, the last holds.
"""

from abc import ABC, abstractmethod
from pathlib import Path
from typing import TYPE_CHECKING, Any, Protocol

import numpy as np
import numpy.typing as npt
import openmm

from ..errors import InputError
from ..filaments.collection import FilamentCollection, require_filaments
from ..filaments.grown import GrownChain
from ..filaments.refusals import refuse_beams, refuse_growth
from ..mechanics.redistribution import ChainSet
from ..mechanics.tension import axial_tensions, filament_tensions
from ..units.quantities import LARGEST_INT, shown, true_or_false, whole_number
from ..units.types import FloatArray, IntArray
from .files import TextFile, check_output_path
from .linker_records import LINKER_COLUMNS, LinkerFile, measure_linkers
from .run_tables import TEXT_COLUMNS

if TYPE_CHECKING:
    from openmm import app


class MeasuredCrosslinks(Protocol):
    """What a CrosslinkReporter sees of a Crosslinks object."""

    def measure(self, context: openmm.Context, state: openmm.State) -> tuple[Any, FloatArray, FloatArray]: ...


class TableReporter(ABC):
    """What reporters of a table have in common: a line for each thing and report."""

    _columns: tuple[str, ...] = ()
    _thing = ""
    _include: tuple[str, ...] = ("positions",)

    def __init__(self, file: TextFile | None, reportInterval: int, append: bool = False) -> None:  # noqa: N803 - OpenMM's name
        self._interval = whole_number(reportInterval, 1, "reportInterval", LARGEST_INT)
        append = true_or_false(append, "append")
        self._rows: list[Any] = []
        self._reports: list[tuple[int, float]] = []
        self._file: Any = None
        self._owned = isinstance(file, (str, Path))
        stream: Any = file
        if isinstance(file, (str, Path)):
            check_output_path(file)
            if append:
                _cut_unfinished_line(Path(file), self._header)
            stream = open(file, "a" if append else "w", newline="")  # noqa: SIM115 - closed with the reporter
        elif file is not None and not hasattr(file, "write"):
            raise InputError(f"file must be a path, a file that is open for writing, or None, but is {file!r}.")
        self._file = stream
        if stream is not None and not (append and self._owned and stream.tell() > 0):
            print(self._header, file=stream)

    def describeNextReport(self, simulation: "app.Simulation") -> dict[str, Any]:  # noqa: N802 - OpenMM's name
        """When the next report is due, and that it needs positions; as OpenMM asks for it."""
        steps = self._interval - simulation.currentStep % self._interval
        return {"steps": steps, "periodic": False, "include": list(self._include)}

    def report(self, simulation: "app.Simulation", state: openmm.State) -> None:
        """Write a report; OpenMM calls it."""
        time = state.getTime()._value
        numbers, values = self._table(simulation, state)
        self._reports.append((simulation.currentStep, time))
        self._rows.append(values)
        if self._file is None:
            return
        for number, row in zip(numbers, values):
            print(self._line(simulation.currentStep, time, number, row), file=self._file)
        self._file.flush()

    @property
    def _header(self) -> str:
        return ",".join(("step", "time_ps", self._thing, *self._columns))

    def _line(self, step: int, time: float, number: Any, row: Any) -> str:
        # What the file says of a thing at a time in ps.
        return ",".join([str(step), f"{time:.10g}", str(number), *(f"{value:.10g}" for value in row)])

    @abstractmethod
    def _table(self, simulation, state):
        """What the line of each thing says it is, and a row of values for each."""

    @property
    def step(self) -> IntArray:
        """The steps of all reports so far."""
        return np.array([step for step, _ in self._reports], dtype=int)

    @property
    def time(self) -> FloatArray:
        """The times of all reports so far, in ps."""
        return np.array([time for _, time in self._reports], dtype=float)

    def __getitem__(self, column: str) -> npt.NDArray[Any]:
        """An array (reports, things) of a column."""
        if not isinstance(column, str) or column not in self._columns:
            raise InputError(f"There is no column {shown(column)}: known are {', '.join(self._columns)}.")
        index, kind = self._columns.index(column), str if column in TEXT_COLUMNS else float
        return np.array([[row[index] for row in rows] for rows in self._rows], dtype=kind)

    def close(self) -> None:
        """Close the file, if the reporter has opened it."""
        if getattr(self, "_owned", False) and self._file is not None:
            self._file.close()
            self._file = None

    def __del__(self) -> None:
        self.close()


def _cut_unfinished_line(path, header):
    if not path.exists():
        return
    with open(path, "r+b") as file:
        end = 0
        for line in file:
            if not line.endswith(b"\n"):
                break
            if end == 0 and line.decode(errors="replace").strip() != header:
                raise InputError(f"{path} is not a file of this reporter: its first line is not {header!r}.")
            end += len(line)
        file.truncate(end)


class FilamentsReporter(TableReporter):
    """What reporters of things whose number does not change have in common: arrays (reports, things)."""

    def __init__(
        self, file: TextFile | None, reportInterval: int, filaments: FilamentCollection, append: bool = False
    ) -> None:  # noqa: N803 - OpenMM's name
        require_filaments(filaments)
        self._filaments = filaments
        self._nodes = filaments.node_indices
        super().__init__(file, reportInterval, append)


class FilamentReporter(FilamentsReporter):
    """Reports energies, end-to-end distance and contour length of every filament.

    Columns: ``stretching_energy`` and ``bending_energy`` in kJ/mol, ``end_to_end_distance`` and ``contour_length`` in
    nm. ``reporter["contour_length"]`` is an array (reports, filaments). The ends of a ring are one, at distance 0.
    Energies of filaments that grow are those of the segments that they have at a report; all is NaN of one that is not
    there.

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
        controls, temperature = self._filaments.control_point_indices, self._filaments.temperature
        monomers = _monomers(self._filaments, simulation.context)
        rows = [
            self._describe_bent(simulation, number, positions[nodes])
            if filament.rest_bends is not None
            else _describe(filament, positions[nodes], positions[own], temperature, monomers.get(number))
            for number, (filament, nodes, own) in enumerate(zip(self._filaments, self._nodes, controls))
        ]
        return range(len(rows)), rows

    def _describe_bent(self, simulation, number, nodes):
        energies = self._filaments.in_context(simulation.context).energies(number)
        return _row(self._filaments[number], [np.sum(own._value) for own in energies], nodes, None)


def _monomers(filaments, context):
    # The first monomer of filaments that grow and that behind the last one, by the numbers of filaments.
    if all(filament.growth is None for filament in filaments):
        return {}
    growth = filaments.in_context(context).growth()
    return dict(zip(growth.filaments.tolist(), growth.monomers))


def _describe(filament, nodes, control_points, temperature, monomers):
    if monomers is None:
        energies = filament.energies(nodes, control_points, temperature)
    else:
        chain = GrownChain(filament.type, filament.growth.monomers.length, monomers, nodes)
        if not chain.nodes:
            return (np.nan,) * 4
        energies = chain.energies
    return _row(filament, energies, nodes, control_points)


def _row(filament, energies, nodes, control_points):
    end_to_end_distance = 0.0 if filament.closed else np.linalg.norm(nodes[-1] - nodes[0])
    lengths = filament.type.segment_kind.lengths(nodes, control_points, filament.closed)
    return *energies, end_to_end_distance, lengths.sum()


class TensionReporter(FilamentsReporter):
    """Reports the tension in filaments: the component of the virtual force Phi of a joint along the chain.

    Phi, eqs. (22)-(24), is the force that the segment after a joint exerts on the one before it, of all forces but the
    random ones; see ``FilamentsInContext.joint_tensions``. The direction of the chain at a joint is that of the sum of
    the unit vectors along its two segments. Tension is positive, compression negative.

    Columns: ``mean_tension``, ``minimum_tension`` and ``maximum_tension`` over the joints of a filament, or with
    ``joints=True`` a line for each joint with ``tension``, all in kJ/(mol nm); 1 pN is 0.602214 of these. Filaments of
    one segment have no joints and are left out; those that grow are NaN then. ``reporter["mean_tension"]`` is an array
    (reports, filaments with joints), ``reporter["tension"]`` one of (reports, joints of all filaments), and
    ``reporter.places`` says which.

    Parameters
    ----------
    file : str, Path, file object or None
        None keeps the arrays alone.
    reportInterval : int
        In steps.
    filaments : Filaments
    append : bool
        Go on with a file that exists.
    joints : bool
        Report every joint rather than every filament.
    mean : bool
        Report tensions as means over the last step, with friction and noise
        (``FilamentsInContext.mean_axial_tensions``), which scheme "implicit" of the compiled engine has; the integrator
        records them then. By default, they are instantaneous ones without noise, of the configuration. ``mean_tension``
        is the mean over joints in both cases. Filaments that grow have these alone, and a line for each filament.

    Raises
    ------
    InputError
        If no filament has joints; if filaments grow, without ``mean=True`` or with ``joints=True``; with ``mean=True``,
        during a run, if the integrator has another scheme.

    Examples
    --------
    >>> simulation.reporters.append(TensionReporter("tension.csv", 100, filaments))  # doctest: +SKIP
    """

    places: list[tuple[int, ...]]

    def __init__(
        self,
        file: TextFile | None,
        reportInterval: int,  # noqa: N803 - OpenMM's name
        filaments: FilamentCollection,
        append: bool = False,
        joints: bool = False,
        mean: bool = False,
    ) -> None:
        require_filaments(filaments)
        refuse_beams(filaments, "a TensionReporter")
        self._joints = joints = true_or_false(joints, "joints")
        self._mean = mean = true_or_false(mean, "mean")
        if joints or not mean:
            refuse_growth(filaments, "a TensionReporter of joints or of instantaneous tensions", "Give it mean=True.")
        self._include = () if mean else ("positions", "forces")
        if joints:
            self._thing, self._columns = "filament,joint", ("tension",)
            self.places: list[tuple[int, ...]] = [
                (f, j) for f, filament in enumerate(filaments) for j in range(_joints(filament))
            ]
        else:
            self._thing, self._columns = "filament", ("mean_tension", "minimum_tension", "maximum_tension")
            self.places = [(number,) for number, own in enumerate(filaments) if _joints(own) or own.growth is not None]
        if not self.places:
            raise InputError("There are no tensions to report: filaments of one segment have no joints.")
        self._chains: ChainSet | None = None
        super().__init__(file, reportInterval, filaments, append)

    def describeNextReport(self, simulation: "app.Simulation") -> dict[str, Any]:  # noqa: N802 - OpenMM's name
        if self._mean:
            self._filaments.in_context(simulation.context).record_tensions()
        return super().describeNextReport(simulation)

    def _table(self, simulation, state):
        tensions = self._means(simulation) if self._mean else self._present(simulation, state)
        labels = [",".join(map(str, place)) for place in self.places]
        if self._joints:
            return labels, [(tension,) for tension in np.concatenate(tensions)]
        # A filament that grows may have no joints for a while.
        tensions = [tension if len(tension) else np.array([np.nan]) for tension in tensions]
        return labels, [(tension.mean(), tension.min(), tension.max()) for tension in tensions]

    def _means(self, simulation):
        tensions = self._filaments.in_context(simulation.context).mean_axial_tensions()
        return [tensions[number]._value for number in dict.fromkeys(place[0] for place in self.places)]

    def _present(self, simulation, state):
        if self._chains is None:
            self._chains = self._filaments.chain_set(simulation.system)
        positions, forces = (values._value for values in (state.getPositions(True), state.getForces(True)))
        flow = self._filaments.in_context(simulation.context).flow()
        virtual = filament_tensions(self._filaments, self._nodes, self._chains, positions, forces, flow)
        return [
            axial_tensions(positions[nodes], phi, filament.closed)
            for filament, nodes, phi in zip(self._filaments, self._nodes, virtual)
            if len(phi)
        ]


def _joints(filament):
    return len(filament.joint_stiffnesses)


class TetherReporter(FilamentsReporter):
    """Reports where every tether's point and node are, and the force of the tether on its node, -k (x - point).

    Columns: ``point_x``, ``point_y``, ``point_z``, ``extension_x``, ``extension_y``, ``extension_z`` (x - point) in nm,
    ``force_x``, ``force_y``, ``force_z`` in kJ/(mol nm). Points and stiffnesses are those of
    ``FilamentsInContext.tethers``.

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

    def __init__(
        self, file: TextFile | None, reportInterval: int, filaments: FilamentCollection, append: bool = False
    ) -> None:  # noqa: N803 - OpenMM's name
        require_filaments(filaments)
        if not filaments.tethers:
            raise InputError("There are no tethers to report: call add_tether first.")
        super().__init__(file, reportInterval, filaments, append)

    def _table(self, simulation, state):
        positions = state.getPositions(asNumpy=True)._value
        rows = []
        for tether in self._filaments.in_context(simulation.context).tethers():
            extension = positions[self._nodes[tether.filament][tether.node]] - tether.point
            rows.append((*tether.point, *extension, *(-tether.stiffness * extension)))
        return range(len(rows)), rows


class CrosslinkReporter(TableReporter):
    """Reports the particles, length, extension and force of every crosslink that there is at a report.

    Columns: ``particle_1``, ``particle_2``, ``length`` d and ``extension`` d - d0 in nm, ``force`` dV/dd in
    kJ/(mol nm), positive where it pulls. A crosslink is known by its number, which no other one gets when it is
    removed. Since each report may have more or fewer, ``reporter["force"]`` is an array (lines,) as in the file, beside
    ``reporter["step"]``, ``reporter["time_ps"]`` and ``reporter["crosslink"]``; ``count`` says how many a report has.
    Of a place on a segment, the particle is that at fraction 0; of a fixed point it is -1. The force of a crosslink
    that is off is zero.

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

    def __init__(
        self, file: TextFile | None, reportInterval: int, crosslinks: MeasuredCrosslinks, append: bool = False
    ) -> None:  # noqa: N803 - OpenMM's name
        if not hasattr(crosslinks, "measure"):
            raise InputError(f"crosslinks must be a Crosslinks object, but is {type(crosslinks).__name__}.")
        self._crosslinks = crosslinks
        self._numbers: list[IntArray] = []
        super().__init__(file, reportInterval, append)

    def _table(self, simulation, state):
        table, lengths, forces = self._crosslinks.measure(simulation.context, state)
        self._numbers.append(table.numbers)
        return table.numbers, list(zip(*table.pairs.T, lengths, lengths - table.rest_length, forces))

    @property
    def count(self) -> IntArray:
        """How many crosslinks each report has: an array (reports,)."""
        return np.array([len(numbers) for numbers in self._numbers], dtype=int)

    def __getitem__(self, column: str) -> npt.NDArray[Any]:
        """An array (lines,) of a column of the file."""
        known = ("step", "time_ps", self._thing, *self._columns)
        if not isinstance(column, str) or column not in known:
            raise InputError(f"There is no column {shown(column)}: known are {', '.join(known)}.")
        if column == "step":
            return np.repeat(self.step, self.count)
        if column == "time_ps":
            return np.repeat(self.time, self.count)
        if column == "crosslink":
            return np.concatenate([np.zeros(0, dtype=int), *self._numbers])
        index = self._columns.index(column)
        kind = int if column.startswith("particle") else float
        return np.array([row[index] for rows in self._rows for row in rows], dtype=kind)


class LinkerReporter(FilamentsReporter):
    """Reports how many linkers are bound, and the tension of their springs, a line for each type of ``add_linkers``.

    Columns: ``unbound``, ``one_hand_bound`` and ``both_hands_bound`` count linkers, with an anchor for a hand;
    ``mean_tension`` and ``maximum_tension`` are those of linkers that join two places, in kJ/(mol nm), positive where
    they pull, NaN if there are none; ``bindings`` and ``unbindings`` are events of the hands of this type since the
    start. ``reporter["both_hands_bound"]`` is an array (reports, types).

    Where each linker with a hand that is bound is goes to a file of its own, ``places``, that ``numpy.load`` reads as
    one array of records: ``step``, ``number``, ``type``, ``anchor``, ``filaments`` and ``arc_lengths`` (as in
    LinkerTable), ``places`` (2, 3) in nm, NaN for a hand that is not bound, in a periodic box the second next to the
    first, and ``tension`` in kJ/(mol nm).

    Parameters
    ----------
    file : str, Path, file object or None
        None keeps the arrays alone.
    reportInterval : int
        In steps.
    filaments : Filaments
        With linkers.
    append : bool
        Go on with files that exist.
    places : str or Path, optional
        A file such as "linkers.npy".

    Raises
    ------
    InputError
        If there are no linkers, or a file to go on with is not one of this reporter.

    Examples
    --------
    >>> reporter = LinkerReporter("linkers.csv", 100, filaments, places="linkers.npy")  # doctest: +SKIP
    >>> simulation.reporters.append(reporter)  # doctest: +SKIP
    >>> records = np.load("linkers.npy")  # doctest: +SKIP
    >>> last = records[records["step"] == records["step"][-1]]  # doctest: +SKIP
    """

    _columns = LINKER_COLUMNS
    _thing = "linkers"
    _include = ()

    def __init__(
        self,
        file: TextFile | None,
        reportInterval: int,  # noqa: N803 - OpenMM's name
        filaments: FilamentCollection,
        append: bool = False,
        places: str | Path | None = None,
    ) -> None:
        require_filaments(filaments)
        if not filaments.linkers:
            raise InputError("There are no linkers to report: call add_linkers first.")
        if places is not None and not isinstance(places, (str, Path)):
            raise InputError(f"places must be the path of a file, or None, but is {shown(places)}.")
        if places is not None:
            check_output_path(places)
        self._linkers = filaments
        self._places: LinkerFile | None = None
        super().__init__(file, reportInterval, filaments, append)
        if places is not None:
            self._places = LinkerFile(Path(places), -1 if append and Path(places).exists() else None)

    def _table(self, simulation, state):
        rows, records = measure_linkers(self._linkers, simulation.context, simulation.currentStep)
        if self._places is not None:
            self._places.write(records)
        return range(len(rows)), rows

    def close(self) -> None:
        """Close the files that the reporter has opened."""
        super().close()
        places: LinkerFile | None = getattr(self, "_places", None)
        if places is not None:
            places.close()
            self._places = None
