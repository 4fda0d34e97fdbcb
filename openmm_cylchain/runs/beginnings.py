"""Commented configurations to begin with: the files in ``starts``."""

from importlib import resources
from pathlib import Path

from ..errors import InputError

START_NAMES = (
    *("network", "bundle", "gliding", "treadmilling", "microtubules", "aster", "stages"),
    *("dna", "force-extension"),
)


def start_text(kind):
    """The text of a configuration to begin with, by one of START_NAMES."""
    return resources.files(__package__).joinpath("starts", f"{kind}.toml").read_text(encoding="utf-8")


def write_start(kind, path=None):
    """Write a configuration to begin with.

    Parameters
    ----------
    kind : str
        One of START_NAMES.
    path : str or Path, optional
        ``kind.toml`` in the working directory if not given.

    Returns
    -------
    Path

    Raises
    ------
    InputError
        If the file exists, or cannot be there.
    """
    path = Path(f"{kind}.toml" if path is None else path)
    if not path.parent.is_dir():
        raise InputError(f"{path} is in {path.parent}, which is not a directory.")
    text = start_text(kind).replace(f"{kind}.toml", path.name)
    # In commands, runs and films have the name of the file.
    for before, after in (("--output ", "\n"), ("render ", " "), ("--output ", ".gif\n")):
        text = text.replace(f"{before}{kind}{after}", f"{before}{path.stem}{after}")
    try:
        with open(path, "x", encoding="utf-8", newline="\n") as file:
            file.write(text)
    except FileExistsError:
        raise InputError(f"{path} exists already: name another file.") from None
    return path
