"""The tables of a scan: quantities of each run, and of each point with means over its replicas."""

import csv
import io
import math

import numpy as np

from ..output.files import write_atomically
from ..output.run_files import RunFiles
from .grid import written
from .quantities import read_quantities


def gather(scan, path, status_of):
    """Rows of ``runs.csv`` and ``results.csv``, lists of dicts, of a scan in a directory.

    ``status_of`` of a ScanRun is "done" for a run with a summary.
    """
    runs, points = [], {}
    for run in scan.runs:
        directory = path / "runs" / run.name
        row = {
            **{label: written(value) for label, value in run.values.items()},
            "replica": run.replica,
            "seed": run.seed,
            "status": status_of(run),
            "directory": f"runs/{run.name}",
        }
        own = points.setdefault(tuple(map(written, run.values.values())), {})
        if row["status"] == "done":
            for quantity in read_quantities(RunFiles(directory).summary):
                if not scan.gather or quantity.name in scan.gather:
                    column = _column(quantity)
                    row[column] = quantity.value
                    row[f"{column}, standard error"] = quantity.standard_error
                    own.setdefault((quantity.group, quantity.of, quantity.name, quantity.unit), []).append(quantity)
        runs.append(row)
    results = [
        _result(dict(zip((axis.label for axis in scan.axes), point)), *key, quantities)
        for point, own in points.items()
        for key, quantities in own.items()
    ]
    return runs, results


def _column(quantity):
    return f"{quantity.of}: {quantity.name}{f' ({quantity.unit})' if quantity.unit else ''}"


def _result(values, group, of, name, unit, quantities):
    numbers = np.array([quantity.value for quantity in quantities])
    theories = [quantity.theory for quantity in quantities if quantity.theory is not None]
    count = len(numbers)
    return {
        **values,
        "of": of,
        "quantity": name,
        "unit": unit,
        "replicas": count,
        "mean": float(numbers.mean()),
        # Replicas are independent; of one alone nothing is known.
        "standard error": float(numbers.std(ddof=1) / math.sqrt(count)) if count > 1 else None,
        "theory": float(np.mean(theories)) if theories else None,
    }


def write_runs(path, scan, rows):
    """Write ``runs.csv``: a line for each run."""
    first = [*(axis.label for axis in scan.axes), "replica", "seed", "status", "directory"]
    quantities = dict.fromkeys(name for row in rows for name in row if name not in first)
    _write(path, [*first, *quantities], rows)


def write_results(path, scan, rows):
    """Write ``results.csv``: a line for each quantity of each point."""
    columns = ("of", "quantity", "unit", "replicas", "mean", "standard error", "theory")
    _write(path, [*(axis.label for axis in scan.axes), *columns], rows)


def _write(path, columns, rows):
    text = io.StringIO()
    writer = csv.DictWriter(text, columns, restval="", lineterminator="\n")
    writer.writeheader()
    writer.writerows(rows)
    write_atomically(path, text.getvalue().encode())
