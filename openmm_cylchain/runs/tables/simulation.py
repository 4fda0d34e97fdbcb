"""[simulation]: scheme, steps, intervals, and what computes them."""

import math
from dataclasses import dataclass

from ...engine_choice import ENGINES, default_scheme
from ...time_steps.schemes import SCHEMES
from ...units import quantities as units
from ...units.text import format_time
from ..keys import REQUIRED, Choice, Flag, Key, Quantity, Text, Whole, WordOrQuantity
from ..table import TableKind

PRECISIONS = ("automatic", "single", "mixed", "double")
"""Those of filaments with the compiled engine, and those of platforms. The default, "automatic", chooses for them."""
_MOST_STEPS = 10**15
_MOST_STEPS_PER_REPORT = 2**31 - 1  # That a DCD file can say.

SIMULATION = TableKind(
    "simulation",
    (
        Key("scheme", Choice(tuple(SCHEMES)), None, "The engine's default if not given."),
        Key("time_step", WordOrQuantity(("recommended",), units.TIME), REQUIRED, "See `openmm-cylchain timestep`."),
        Key(
            "duration",
            Quantity(units.TIME),
            None,
            "How long the run is: a whole number of reports. Required, unless `[[stage]]` tables say it.",
        ),
        Key("report_interval", Quantity(units.TIME), REQUIRED, "From frame to frame: a whole number of steps."),
        Key("checkpoint_interval", Quantity(units.TIME), None, "A whole number of reports; 10 of them if not given."),
        Key("seed", Whole(1, None, "1"), 1, "The same seed gives the same run."),
        Key("engine", Choice(tuple(ENGINES)), None, "The compiled one where it is installed, if not given."),
        Key("platform", Text('"CPU"'), "Reference", "One that OpenMM has."),
        Key(
            "precision",
            Choice(PRECISIONS),
            None,
            "Of filaments with the compiled engine on Reference and CPU, else of the platform.",
        ),
        Key("threads", Whole(1, 4096, "2"), None, "Threads of the platform CPU; all cores if not given."),
        Key(
            "checks",
            Flag(),
            True,
            "Whether to look for a step that is too long while it runs, see `create_integrator`.",
        ),
    ),
    "The run.",
    required=True,
)


@dataclass(frozen=True)
class SimulationSettings:
    """The [simulation] table: times in ps, intervals in steps."""

    scheme: str
    time_step: float
    steps: int
    steps_per_report: int
    steps_per_checkpoint: int
    seed: int
    engine: str | None
    platform: str
    precision: str | None
    threads: int | None = None
    checks: bool = True


def read_seed(entries):
    """The seed of a [simulation] table."""
    if entries["seed"] >= 2**31:
        raise entries.at("seed").error(f"must be below 2^31, but is {entries['seed']}.")
    return entries["seed"]


def read_simulation(entries, recommended):
    """The SimulationSettings of a [simulation] table; ``recommended(scheme, engine)`` is the recommended step in ps."""
    entries.require("duration")
    engine = entries["engine"]
    scheme = entries["scheme"] or default_scheme(engine)
    if "threads" in entries and entries["platform"] != "CPU":
        raise entries.at("threads").error('belongs to platform = "CPU".')
    report = entries["report_interval"]
    if entries["time_step"] == "recommended":
        time_step = _divisor(report, recommended(scheme, engine))
    else:
        time_step = entries["time_step"]
    steps_per_report = _multiple(entries.at("report_interval"), report, "time_step", time_step)
    if steps_per_report > _MOST_STEPS_PER_REPORT:
        raise entries.at("report_interval").error(
            f"makes {steps_per_report:.3g} steps from report to report, of {format_time(time_step)}: there can be "
            f"{_MOST_STEPS_PER_REPORT:.2g}. Take a longer time_step or a shorter interval."
        )
    reports = _multiple(entries.at("duration"), entries["duration"], "report_interval", report)
    reports_per_checkpoint = 10
    if entries["checkpoint_interval"] is not None:
        place = entries.at("checkpoint_interval")
        reports_per_checkpoint = _multiple(place, entries["checkpoint_interval"], "report_interval", report)
    if reports * steps_per_report > _MOST_STEPS:
        raise entries.at("duration").error(f"makes {reports * steps_per_report:.3g} steps: that will never end.")
    return SimulationSettings(
        scheme=scheme,
        time_step=time_step,
        steps=reports * steps_per_report,
        steps_per_report=steps_per_report,
        steps_per_checkpoint=reports_per_checkpoint * steps_per_report,
        seed=read_seed(entries),
        engine=engine,
        platform=entries["platform"],
        precision=entries["precision"],
        threads=entries["threads"],
        checks=entries["checks"],
    )


def _divisor(report, largest):
    # The largest step that fits into a report interval a whole number of times and exceeds the recommendation, which
    # is no sharper than that, by at most 0.1 %.
    return report / max(1, math.ceil(report / largest * (1.0 - 1e-3)))


def _multiple(place, interval, base_name, base):
    ratio = interval / base
    count = round(ratio)
    if count >= 1 and abs(ratio - count) <= 1e-6 * max(1.0, 1e-3 * ratio):
        return count
    below, above = math.floor(ratio), math.floor(ratio) + 1
    nearest = " or ".join(f'"{format_time(n * base, 12)}"' for n in (below, above) if n > 0)
    raise place.error(
        f"is {format_time(interval, 12)}, which is not a whole multiple of {base_name}, "
        f"{format_time(base, 12)}: use {nearest}."
    )
