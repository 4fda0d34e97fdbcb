"""The command ``openmm-cylchain import``."""

import tempfile
from pathlib import Path

import numpy as np

from ..errors import InputError
from .document import EXACT, LEFT_OUT, NEAREST

_HEADINGS = {NEAREST: "nearest, by our laws", LEFT_OUT: "left out"}
_SHOWN = 40


def add_command(commands):
    """Add ``import`` to the subcommands of an argparse parser."""
    parser = commands.add_parser("import", help="write a configuration from one of Cytosim")
    parser.add_argument("file", metavar="FILE", help="configuration of Cytosim, such as my.cym")
    parser.add_argument("--output", metavar="FILE", required=True, help="TOML file to write; never overwritten")
    parser.add_argument(
        "--dimensions", type=int, choices=(2, 3), help="for which Cytosim was built; what the file says if not given"
    )
    parser.add_argument(
        "--value",
        metavar="NAME=VALUE",
        action="append",
        default=[],
        help="value of a name in a template, in the place of the first one that it has there",
    )
    parser.add_argument("--no-trial", action="store_true", help="do not try whether its first steps can be taken")
    parser.set_defaults(command=_import)


def _import(options):
    values = {}
    for text in options.value:
        name, equals, value = text.partition("=")
        if not equals or not name.isidentifier():
            raise InputError(f"--value must be a name and a value, as in --value x=1, but is {text!r}.")
        try:
            values[name] = float(value) if "." in value or "e" in value.lower() else int(value)
        except ValueError:
            values[name] = value
    for line in import_file(options.file, options.output, options.dimensions, values, not options.no_trial):
        print(line)


def import_file(path, output, dimensions=None, given=None, trial=False):
    """Write a configuration from one of Cytosim, and return the lines of a report.

    Parameters
    ----------
    path, output : str or Path
        The output is never overwritten; files that it names lie beside it.
    dimensions : {2, 3}, optional
    given : dict, optional
        Values of names in templates.
    trial : bool
        Whether to take the first steps of it, and shorter ones if these cannot be taken.

    Raises
    ------
    InputError
        If the file is none of Cytosim, has nothing that we can say, or the output exists.
    """
    from .translation import translate
    from .trial import try_first_steps

    output = Path(output)
    if not output.parent.is_dir():
        raise InputError(f"{output} is in {output.parent}, which is not a directory.")
    if output.exists():
        raise InputError(f"{output} exists already: name another file.")
    translation = translate(path, output.stem, dimensions, given)
    for name in translation.start_files:
        if (output.parent / name).exists():
            raise InputError(f"{output.parent / name} exists already: name another output.")
    configuration = check(translation, translation.document.text(), path)
    untried = None
    if trial:
        untried = try_first_steps(
            translation.document, configuration, lambda: check(translation, translation.document.text(), path)
        )
    text = translation.document.text()
    for name, positions in translation.start_files.items():
        np.save(output.parent / name, positions)
    with open(output, "x", encoding="utf-8", newline="\n") as file:
        file.write(text)
    return list(report(translation, output, untried))


def check(translation, text, path):
    """Read a text as a run does: a Configuration. InputError with the line of Cytosim's file for what a run refuses."""
    from ..runs.configuration import configuration_of
    from ..runs.keys import ConfigurationError
    from ..runs.toml_lines import read_toml

    with tempfile.TemporaryDirectory() as folder:
        for name, positions in translation.start_files.items():
            np.save(Path(folder) / name, positions)
        try:
            return configuration_of(read_toml(text), text, folder, {})
        except ConfigurationError as error:
            line = _line_of(translation.document, error.path)
            where = "" if line is None else f", line {line}"
            raise InputError(f"{path}{where}: what becomes of this cannot be run: {error}") from None
        except InputError as error:
            raise InputError(f"{path}: what becomes of it cannot be run: {error}") from None


def _line_of(document, path):
    if not path:
        return None
    tables = [table for table in document.tables if table.header.strip("[]") == path[0]]
    index = path[1] if len(path) > 1 and isinstance(path[1], int) else 0
    return tables[index].line if index < len(tables) else None


def report(translation, output, untried=None):
    """Lines that say what was done, and which of the first steps were not tried."""
    notes = translation.document.notes
    counts = {kind: [note for note in notes if note.kind == kind] for kind in (EXACT, NEAREST, LEFT_OUT)}
    files = ", ".join([str(output), *(str(output.parent / name) for name in translation.start_files)])
    yield f"Written: {files}"
    yield f"  exact: {len(counts[EXACT])} settings"
    for kind, heading in _HEADINGS.items():
        own = list(dict.fromkeys(str(note).removeprefix(f"{kind}: ") for note in counts[kind]))
        yield f"  {heading}: {len(own) or 'nothing'}"
        yield from (f"    {text}" for text in own[:_SHOWN])
        if len(own) > _SHOWN:
            yield f"    and {len(own) - _SHOWN} more, in the comments of {output}"
    if translation.document.missing:
        yield "  missing, to say all of it:"
        yield from (f"    {needs}" for needs in translation.document.missing)
    if untried is not None:
        yield f"  {untried}"
    yield f"Look at it, and run it with\n    openmm-cylchain run {output} --output {output.with_suffix('')}"
