"""The file of a scan: a TOML file that names a run, the keys that vary, how many replicas, and what is gathered."""

from dataclasses import dataclass, field
from pathlib import Path

from ..errors import InputError
from ..output.files import as_path
from ..runs.configuration import TABLES, configuration_of, read_configuration
from ..runs.keys import Choice, ConfigurationError, Inline, Key, Listing, Place, Text, Whole
from ..runs.table import TableKind, UnknownKeyError
from ..runs.toml_lines import lines_of, read_toml
from .grid import Axis, make_runs
from .quantities import QUANTITIES

SCAN = TableKind(
    "scan",
    (
        Key(
            "base",
            Text('"network.toml"'),
            None,
            "The file of a run, beside this one; without it, the tables `[base.…]`.",
        ),
        Key("replicas", Whole(1, 100000, "4"), 1, "Runs of each point, each with a seed of its own."),
        Key("seed", Whole(1, 2**31 - 1, "1"), 1, "From which, and from what is simulated, seeds of runs are derived."),
        Key(
            "gather",
            Listing(Choice(QUANTITIES), "quantities", '["persistence length"]'),
            None,
            "Quantities of the tables and the figure; all that runs write if not given.",
        ),
        Key("attempts", Whole(1, 100, "3"), 3, "How often a run may be started that dies by a signal."),
    ),
    "What is run, and what is gathered.",
    required=True,
)
"""The keys of [scan]."""

_TOP = ("title", SCAN.name, "base", "vary")
_VARY = "[vary]"


@dataclass(frozen=True)
class Scan:
    """A scan that was read and checked.

    Attributes
    ----------
    folder : Path
        From which runs name their files.
    axes : tuple of Axis
    runs : tuple of ScanRun
        All replicas of all points, point by point.
    gather : tuple of str
        Names of quantities; all if empty.
    """

    path: Path
    title: str
    folder: Path
    axes: tuple
    runs: tuple
    gather: tuple
    attempts: int
    text: str = field(compare=False, repr=False, default="")


def read_scan(path):
    """Read and check the file of a scan, and the configuration of every point of it.

    Parameters
    ----------
    path : str or Path

    Returns
    -------
    Scan

    Raises
    ------
    InputError
        For a file that cannot be read, or describes no scan: with its line, table and key.
    """
    path = as_path(path, "path")
    try:
        text = path.read_bytes().decode("utf-8")
    except OSError as error:
        raise InputError(f"The scan {path} cannot be read: {error.strerror}.") from None
    except UnicodeDecodeError:
        raise InputError(f"The scan {path} is not UTF-8 text: save it as UTF-8.") from None
    text_of_lines = text.replace("\r\n", "\n")
    try:
        raw = read_toml(text_of_lines)
    except InputError as error:
        raise _named(path, error) from None
    lines = lines_of(text_of_lines, raw)
    try:
        return _read(path, text, raw, lines)
    except UnknownKeyError as error:
        raise _named(path, error.with_suggestion((SCAN, *TABLES)).with_line(lines)) from None
    except ConfigurationError as error:
        raise _named(path, error.with_line(lines)) from None


def _named(path, error):
    return InputError(f"{path}{', ' if str(error).startswith('line ') else ': '}{error}")


def _read(path, text, raw, lines):
    for name in raw:
        if name not in _TOP:
            raise UnknownKeyError(Place("the scan", ()), name, _TOP)
    title = Text().read(raw.get("title", ""), Place("title", ("title",)))
    if not isinstance(raw.get(SCAN.name, {}), dict):
        raise ConfigurationError(f"{SCAN.name!r} must be a table: write {SCAN.header} once.", (SCAN.name,))
    settings = SCAN.read(raw.get(SCAN.name, {}), Place(SCAN.header, (SCAN.name,)))
    base, folder, base_lines = _base(path, raw, settings, lines)
    axes = _axes(raw.get("vary", {}), base)
    runs = make_runs(base, axes, settings["replicas"], settings["seed"], settings.at("replicas"))
    return Scan(
        path=path,
        title=title,
        folder=folder,
        axes=axes,
        runs=tuple(_checked(runs, settings["replicas"], folder, {**base_lines, **_lines_of_axes(axes, lines)})),
        gather=settings["gather"] or (),
        attempts=settings["attempts"],
        text=text,
    )


def _base(path, raw, settings, lines):
    # Tables of the run on which all are based, the folder of its files, and the lines of its entries in this file.
    if ("base" in settings) == ("base" in raw):
        raise settings.error(
            'needs a run on which all are based: base = "FILE", or tables [base.solvent], [[base.filament]] and so on'
            f"{', not both' if 'base' in raw else ''}."
        )
    if "base" in settings:
        name = settings["base"]
        file = path.parent / name
        if not file.is_file():
            raise settings.at("base").error(f"{str(file)!r} does not exist.")
        configuration = read_configuration(file)
        return read_toml(configuration.text.replace("\r\n", "\n")), file.parent, {}
    if not isinstance(raw["base"], dict):
        raise ConfigurationError("'base' must be tables: [base.solvent], [[base.filament]] and so on.", ("base",))
    own = {place[1:]: line for place, line in lines.items() if place[0] == "base" and len(place) > 1}
    _check(raw["base"], "", path.parent, own, "")
    return raw["base"], path.parent, own


class _LocatedError(ConfigurationError):
    # A mistake of which the message says the line already.

    def with_line(self, lines):
        return self


def _check(entries, text, folder, lines, addition):
    try:
        return configuration_of(entries, text, folder, lines)
    except InputError as error:
        raise _LocatedError(f"{error}{addition}") from None


def _checked(runs, replicas, folder, lines):
    # The configuration of each point; its replicas differ in seeds alone.
    for number, run in enumerate(runs):
        if number % replicas == 0:
            addition = f" That is with {run.point_label}." if run.values else ""
            files = _check(read_toml(run.text), run.text, folder, lines, addition).start_files
        yield run.with_digest([digest or "" for digest in files.values()])


def _lines_of_axes(axes, lines):
    return {axis.path: lines[axis.place.path] for axis in axes if axis.place.path in lines}


def _axes(raw, base):
    if not isinstance(raw, dict):
        raise ConfigurationError(f"'vary' must be a table: write {_VARY} once, with its keys below it.", ("vary",))
    kinds = {kind.name: kind for kind in TABLES}
    axes = []
    for name, inner in raw.items():
        place = Place(f"{_VARY} {name}", ("vary", name))
        if name not in kinds:
            raise UnknownKeyError(Place(_VARY, ("vary",)), name, tuple(kinds))
        if not isinstance(inner, dict):
            raise place.error(f"must name a key of {kinds[name].header}, as in {name}.KEY = [...].")
        if kinds[name].repeated:
            axes += _axes_of_repeated(kinds[name], inner, place, len(base.get(name, [])))
        else:
            axes += _axes_of_table(kinds[name], inner, place, (name,))
    for axis in axes:
        if axis.path == ("simulation", "seed"):
            raise axis.place.error("is derived for each run: give the number of replicas in [scan].")
    return tuple(axes)


def _axes_of_repeated(kind, inner, place, count):
    plain = {name: value for name, value in inner.items() if not name.isdigit()}
    if plain and count != 1:
        raise place.error(
            f"does not say which: the run has {count} {kind.header} tables. Write {kind.name}.1.{next(iter(plain))} "
            "for the first of them."
            if count
            else f"varies nothing: the run has no {kind.header} table."
        )
    yield from _axes_of_table(kind, plain, place, (kind.name, 0))
    for name, own in inner.items():
        if not name.isdigit():
            continue
        place_of_own = Place(f"{place.name}.{name}", (*place.path, name))
        if not 1 <= int(name) <= count:
            raise place_of_own.error(
                f"does not exist: {kind.header} tables are counted from 1, and the run has {count}."
            )
        if not isinstance(own, dict):
            raise place_of_own.error(f"must name a key, as in {kind.name}.{name}.KEY = [...].")
        yield from _axes_of_table(kind, own, place_of_own, (kind.name, int(name) - 1))


def _axes_of_table(kind, inner, place, path):
    keys = {key.name: key for key in kind.keys}
    for name, values in inner.items():
        if name not in keys:
            raise UnknownKeyError(place, name, kind.names)
        own = Place(f"{place.name}.{name}", (*place.path, name))
        if isinstance(values, dict) and isinstance(keys[name].kind, Inline):
            yield from _axes_of_table(keys[name].kind.table, values, own, (*path, name))
            continue
        if not isinstance(values, list) or not values:
            raise own.error(f"must be a list of values, one for each point, as in [{keys[name].kind.example}].")
        read = [keys[name].kind.read(value, own.item(index)) for index, value in enumerate(values)]
        for index, value in enumerate(values):
            if value in values[:index]:
                raise own.item(index).error(f"is {value!r} again: write each value once.")
        label = own.name.removeprefix(f"{_VARY} ")
        yield Axis((*path, name), label, tuple(values), tuple(read), own)
