"""The page about configurations in ``docs``, from the same lists of keys that read them.

python -m openmm_cylchain.runs.reference > docs/configuration.md
"""

from .configuration import TABLES
from .keys import REQUIRED, Choice, Either, Listing
from .table import TableKind
from .tables.stages import CHANGES, STAGE

_INTRODUCTION = """# The file of a run

Every key of the TOML file that `openmm-cylchain run` reads; [the guide](guide.md#runs-from-a-file) says how to begin.
This page is made from the list of keys that reads the file, and so is the schema that `openmm-cylchain schema` prints.

Quantities are texts with a number and a unit: `"360 nm"`, `"0.1 pN/nm"`, `"1.71 mPa*s"`. Points are lists of three
lengths, directions lists of three numbers. `[table]` is written once, `[[table]]` any number of times. At the top,
before all tables, there may be a `title`. A table within another one is described where it comes first.
"""

_FILES = """
`file` is an array of positions in nm, `.npy` of the shape (filaments, nodes, 3) or (nodes, 3), or `.npz` with several
of them; or `.cif`, a structure that a run or `app.PDBxFile` has written; or a trajectory, `.dcd`, with its `topology`
and a `frame`. It is looked for beside the configuration; a run keeps a copy in its directory.
"""


def reference_page():
    """The page as Markdown."""
    parts, known = [_INTRODUCTION], []
    for kind in TABLES:
        parts += section(kind, "##", kind.header, known)
        if kind.name == "filament":
            parts.append(_FILES)
    parts += section(STAGE, "##", STAGE.header, known)
    parts += _changes()
    return "\n".join(parts)


def _changes():
    # Which keys stages may change.
    yield (
        "Beside these it has tables that change others, by their names, and by the names or numbers of tables where "
        "there are several: `[stage.linkers.myosin]`, `[stage.wall.2]`, `[stage.wall]` for all walls. A value that "
        "goes from one to another is `{ from = ..., to = ... }`. `[[stage.stage]]` tables in place of a duration are "
        "stages that come one after the other, as often as `repeat` says. [Stages](stages.md) has examples.\n"
    )
    yield "| table | keys that a stage may change |\n|---|---|"
    headers = {kind.name: kind.header for kind in TABLES}
    for name, keys in CHANGES.items():
        yield f"| `{headers[name]}` | {', '.join(f'`{key}`' for key in keys)} |"
    yield ""


def section(kind, level, title, known=None):
    """Lines of a table of keys below a heading, and of those within it; but for a list of known ones, which grows."""
    known = [] if known is None else known
    needed = " (required)" if kind.required else ""
    yield f"{level} `{title}`{needed}\n\n{kind.text}\n\n| key | value | meaning |\n|---|---|---|"
    inner = []
    for key in kind.keys:
        if key.name not in kind.borrowed:
            yield f"| `{key.name}` | {_value(key)} | {_meaning(key)} |"
        inner += _tables_in(key)
    if kind.borrowed:
        names = ", ".join(f"`{name}`" for name in kind.borrowed)
        yield f"\nWithout a `table`, also keys of a `[[filament]]`: {names}."
    yield ""
    for name, table in inner:
        if table not in known:
            known.append(table)
            yield from section(table, "###", f"{name} of {title}", known)


def _value(key):
    text = key.kind.text
    if isinstance(key.kind, Choice):
        return text
    return f"{text}: `{key.kind.example}`" if "..." not in key.kind.example and '"' + "'" not in text else text


def _meaning(key):
    if key.default is REQUIRED:
        return f"Required. {key.text}"
    if key.default in (None, ()):
        return key.text
    return f"{key.text} Default: {_written(key.default)}."


def _written(value):
    if isinstance(value, bool):
        return f"`{str(value).lower()}`"
    if isinstance(value, tuple):
        return f"({', '.join(f'{item:g}' for item in value)})"
    return f'`"{value}"`' if isinstance(value, str) else f"{value:g}"


def _tables_in(key):
    # Of a list, the table that its items are.
    kind = key.kind.kinds[0][1] if isinstance(key.kind, Either) else key.kind
    kind = kind.kind if isinstance(kind, Listing) else kind
    table = getattr(kind, "table", None)
    if isinstance(table, TableKind):
        yield key.name, table


if __name__ == "__main__":
    print(reference_page(), end="")
