"""The names of the files of a run, and whether one is going on."""

from pathlib import Path
from typing import IO


class RunFiles:
    """The files of a run in its directory."""

    def __init__(self, path: str | Path) -> None:
        self.path = Path(path)
        self.configuration = self.path / "configuration.toml"
        self.description = self.path / "description.json"
        self.topology = self.path / "topology.cif"
        self.topology_psf = self.path / "topology.psf"
        self.topology_data = self.path / "topology.data"
        self.trajectory = self.path / "trajectory.dcd"
        self.energies = self.path / "energies.csv"
        self.linkers = self.path / "linkers.csv"
        self.linker_places = self.path / "linkers.npy"
        self.pulling = self.path / "pulling.csv"
        self.twist = self.path / "twist.csv"
        self.twists = self.path / "twists.npy"
        self.crosslinks = self.path / "crosslinks.npy"
        self.growth = self.path / "growth.csv"
        self.wall_forces = self.path / "wall_forces.csv"
        self.contact_forces = self.path / "contact_forces.csv"
        self.checkpoint = self.path / "checkpoint.chk"
        self.summary = self.path / "summary.json"
        self.figure = self.path / "summary.png"
        self.lock = self.path / ".lock"

    @property
    def is_being_written(self) -> bool:
        """Whether a process holds the lock of the directory."""
        if not self.lock.exists():
            return False
        with open(self.lock, "rb") as file:
            return not try_lock(file, shared=True)


def try_lock(file: IO[bytes], shared: bool = False) -> bool:
    """Lock a file that is open until it is closed, and say whether that was possible.

    A shared lock is one against those alone that lock it for themselves.
    """
    try:
        import fcntl
    except ImportError:
        import msvcrt

        try:
            msvcrt.locking(file.fileno(), msvcrt.LK_NBLCK, 1)  # type: ignore[attr-defined]
        except (BlockingIOError, PermissionError):
            return False
        return True
    try:
        fcntl.flock(file.fileno(), (fcntl.LOCK_SH if shared else fcntl.LOCK_EX) | fcntl.LOCK_NB)
    except (BlockingIOError, PermissionError):
        return False
    return True
