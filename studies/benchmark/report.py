"""Rows of a benchmark: as a table and as JSON."""

import json
import math
from dataclasses import asdict, dataclass, field
from pathlib import Path

from openmm_cylchain.output.files import write_atomically


@dataclass(frozen=True)
class Row:
    """A measured value with its standard error (None if it was measured once) and its unit ("1" for a ratio)."""

    name: str
    value: float
    error: float | None
    unit: str


@dataclass(frozen=True)
class Report:
    """Results of a benchmark.

    Attributes
    ----------
    title : str
    machine : dict
        See ``measurement.describe_machine``.
    settings : dict
        How it was measured.
    rows : list of Row
    missing : dict
        What could not be measured, with the reason.
    details : list of Row
        More rows, for JSON alone.
    table : str
        What people see of the details.
    """

    title: str
    machine: dict
    settings: dict
    rows: list
    missing: dict
    details: list = field(default_factory=list)
    table: str = ""


def row(name, estimate, unit):
    """A Row from an Estimate."""
    return Row(name, estimate.value, estimate.error, unit)


def format_report(report):
    """A table for people."""
    lines = [
        report.title,
        f"{report.machine['processor']}, {report.machine['processors']} processors, "
        f"load {_format_load(report.machine['load_average'])} at the start",
        "",
    ]
    if report.table:
        lines += [report.table, ""]
    texts = [(each.name, *_format_value(each.value, each.error), each.unit) for each in report.rows]
    widths = [max((len(text[column]) for text in texts), default=0) for column in range(3)]
    for name, value, error, unit in texts:
        unit = "" if unit == "1" else unit
        lines.append(f"{name:<{widths[0]}}  {value:>{widths[1]}} {error:<{widths[2]}}  {unit}".rstrip())
    lines.extend(f"{name} missing: {reason}" for name, reason in report.missing.items())
    return "\n".join(lines)


def _format_load(load):
    return "unknown" if load is None else f"{load:.2f}"


def _format_value(value, error):
    scale = error if error else abs(value) / 100.0
    if 0 < scale < 1e-5:
        return f"{value:.3g}", "" if error is None else f"± {error:.1g}"
    decimals = max(0, 1 - math.floor(math.log10(scale))) if scale > 0 else 0
    return f"{value:.{decimals}f}", "" if error is None else f"± {error:.{decimals}f}"


def write_json(report, path):
    """Write machine, settings, rows and what is missing to a file."""
    content = {
        "machine": report.machine,
        "settings": report.settings,
        "rows": [asdict(each) for each in (*report.rows, *report.details)],
        "missing": report.missing,
    }
    write_atomically(Path(path), (json.dumps(content, indent=2, allow_nan=False) + "\n").encode())
