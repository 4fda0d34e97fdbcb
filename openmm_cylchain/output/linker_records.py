"""What linkers do at a report: numbers and tensions of each type, and where each one is, in a file that grows."""

from pathlib import Path

import numpy as np
import openmm

from ..filaments.collection import FilamentCollection
from .record_file import RecordFile

LINKER_COLUMNS = (
    "unbound",
    "one_hand_bound",
    "both_hands_bound",
    "mean_tension",
    "maximum_tension",
    "bindings",
    "unbindings",
)
"""Of a type of linkers; tensions in kJ/(mol nm), NaN where no linker pulls."""

LINKER_RECORD = np.dtype(
    [
        ("step", "<i8"),
        ("number", "<i8"),
        ("type", "<i4"),
        ("anchor", "<i4"),
        ("filaments", "<i4", (2,)),
        ("arc_lengths", "<f8", (2,)),
        ("places", "<f4", (2, 3)),
        ("tension", "<f8"),
    ]
)
"""Of a linker with a hand that is bound: as in LinkerTable; places in nm, tension in kJ/(mol nm), both NaN if none."""


def measure_linkers(
    filaments: FilamentCollection, context: openmm.Context, step: int
) -> tuple[list[tuple[float, ...]], np.ndarray]:
    """Rows of LINKER_COLUMNS, one for each type, and an array of LINKER_RECORD of linkers with a hand that is bound."""
    here = filaments.in_context(context)
    table, places = here.linkers(), here.linker_places()._value
    lengths = np.linalg.norm(places[:, 1] - places[:, 0], axis=1)
    kinds = [own.kind for own in filaments.linkers]
    stiffness, rest = np.array([(kind.stiffness, kind.rest_length) for kind in kinds])[table.types].T
    tensions = stiffness * (lengths - rest)
    rows = []
    for number in range(len(kinds)):
        pulling = tensions[(table.types == number) & ~np.isnan(tensions)]
        mean, largest = (pulling.mean(), pulling.max()) if len(pulling) else (np.nan, np.nan)
        rows.append((*table.counts(number), float(mean), float(largest), *here.linker_events(number)))
    bound = table.bound.any(axis=1)
    records = np.zeros(int(bound.sum()), dtype=LINKER_RECORD)
    records["step"] = step
    for name, values in (
        ("number", table.numbers),
        ("type", table.types),
        ("anchor", table.anchors),
        ("filaments", table.filaments),
        ("arc_lengths", table.arc_lengths),
        ("places", places),
        ("tension", tensions),
    ):
        records[name] = values[bound]
    return rows, records


class LinkerFile(RecordFile):
    """A RecordFile of LINKER_RECORD."""

    def __init__(self, path: Path, count: int | None = None) -> None:
        super().__init__(path, LINKER_RECORD, "places of linkers", count)
