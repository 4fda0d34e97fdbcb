"""Crosslinks as records in a file, and what they are in a frame of a trajectory."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
import numpy.typing as npt
import openmm

from ..output.record_file import RecordFile, read_records
from ..units.types import BoolArray, FloatArray, IntArray
from .beam_curves import BeamCurves
from .crosslink_computation import lengths_and_vectors, slopes_of
from .crosslink_tables import CrosslinkTable
from .crosslinks import Crosslinks

CROSSLINK_RECORD = np.dtype(
    [
        ("step", "<i8"),
        ("force", "<i4"),
        ("number", "<i8"),
        ("pairs", "<i4", (2,)),
        ("partners", "<i4", (2,)),
        ("fractions", "<f8", (2,)),
        ("points", "<f8", (3,)),
        ("stiffness", "<f8"),
        ("rest_length", "<f8"),
        ("maximum_extension", "<f8"),
        ("active", "?"),
        ("periodic", "?"),
    ]
)
"""A crosslink from a step on, as in CrosslinkTable; its force is counted from 0. A number of -1: there are none."""

_COLUMNS = ("pairs", "partners", "fractions", "points", "stiffness", "rest_length", "maximum_extension", "active")


class CrosslinkFile:
    """The crosslinks of a Context in a file (``.npy``) of CROSSLINK_RECORD: all of them whenever one has changed.

    Parameters
    ----------
    system : openmm.System
        With the Crosslinks.
    append : bool
        Go on with a file that exists, behind what is of earlier steps.
    step : int
        With ``append``: records of later steps are forgotten.
    """

    def __init__(self, path: Path, system: openmm.System, append: bool = False, step: int = 0) -> None:
        self._crosslinks = Crosslinks.from_system(system)
        forces = [force for force in system.getForces() if Crosslinks.of_force(force) is not None]
        self._periodic = [force.usesPeriodicBoundaryConditions() for force in forces]
        self._written: Any = None
        self._before: Any = None
        count = None
        if append:
            before = read_records(path)
            count = int(np.searchsorted(before["step"], step, "right"))
            if count:
                begin = int(np.searchsorted(before["step"], before["step"][count - 1], "left"))
                self._before = np.array(before[begin:count])
        self._file = RecordFile(path, CROSSLINK_RECORD, "crosslinks", count)

    def write(self, context: openmm.Context, step: int) -> None:
        """Append the crosslinks of a Context, unless they are those that were written last."""
        tables = [links.table(context) for links in self._crosslinks]
        identities = [table.identity for table in tables]
        if identities == self._written:
            return
        parts = [
            _records(table, number, step, periodic)
            for number, (table, periodic) in enumerate(zip(tables, self._periodic))
        ]
        records = np.concatenate([np.zeros(0, CROSSLINK_RECORD), *parts])
        if not len(records):
            records = np.zeros(1, CROSSLINK_RECORD)
            records["step"], records["number"] = step, -1
        if not _are_same(records, self._before):
            self._file.write(records)
        self._written, self._before = identities, None

    def synchronise(self) -> None:
        """Bring everything to disk."""
        self._file.synchronise()

    def close(self) -> None:
        """Close the file."""
        self._file.close()


def _are_same(records, before):
    # But for their steps.
    if before is None or len(records) != len(before):
        return False
    return all(np.array_equal(records[name], before[name]) for name in CROSSLINK_RECORD.fields or () if name != "step")


def _records(table, force, step, periodic):
    records = np.zeros(len(table), CROSSLINK_RECORD)
    records["step"], records["force"], records["periodic"] = step, force, periodic
    records["number"] = table.numbers
    for name in _COLUMNS:
        records[name] = getattr(table, name)
    return records


@dataclass(frozen=True)
class CrosslinkFrame:
    """The crosslinks of a frame.

    Attributes
    ----------
    numbers : (n,) int array
        By which the Crosslinks of each force know them.
    places : (n, 2, 3) array
        What they join, in nm; in a periodic box the second place is the image next to the first.
    tensions : (n,) array
        dV/dd in kJ/(mol nm), positive where they pull; zero for those that are off.
    active : (n,) bool array
        Which are on.
    at_points : (n,) bool array
        Which hold to a fixed point, the second place.
    """

    numbers: IntArray
    places: FloatArray
    tensions: FloatArray
    active: BoolArray
    at_points: BoolArray

    def __len__(self) -> int:
        return len(self.numbers)


def crosslinks_at(
    records: npt.NDArray[Any],
    step: int,
    positions: FloatArray,
    box: FloatArray | None,
    curves: BeamCurves | None = None,
) -> CrosslinkFrame:
    """The crosslinks of a step: those of the last records that are not later.

    At positions in nm, with filaments that are whole, and with the curves of beam elements that places are on.
    """
    end = int(np.searchsorted(records["step"], step, "right"))
    begin = 0 if end == 0 else int(np.searchsorted(records["step"], records["step"][end - 1], "left"))
    present = np.array(records[begin:end])
    present = present[present["number"] >= 0]
    places, tensions = np.zeros((len(present), 2, 3)), np.zeros(len(present))
    for periodic in (False, True):
        for harmonic in (False, True):
            rows = (present["periodic"] == periodic) & (np.isinf(present["maximum_extension"]) == harmonic)
            if not rows.any():
                continue
            own, nearest = present[rows], box if periodic else None
            table = CrosslinkTable(np.arange(len(own)), next_number=len(own), **{name: own[name] for name in _COLUMNS})
            model = "harmonic" if harmonic else "fene"
            lengths, vectors = lengths_and_vectors(model, table, positions, nearest, nearest, curves)
            first = table.places.positions(positions, 0, nearest, curves)
            places[rows] = np.stack([first, first + vectors], axis=1)
            tensions[rows] = slopes_of(model, table, lengths)
    return CrosslinkFrame(present["number"], places, tensions, present["active"], present["pairs"][:, 1] < 0)
