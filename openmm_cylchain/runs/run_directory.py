"""The directory of a run: who may write into it, and files that survive a kill at any moment.

The checkpoint records how long the trajectory and the energies were when it was made. It is replaced in
one step once they are safely on disk, so whatever is written behind that point can be cut off again.
"""

import hashlib
import json
from dataclasses import dataclass

from ..errors import InputError
from ..output.files import write_atomically
from ..output.run_files import RunFiles, try_lock
from ..version import __version__
from .configuration import changed_keys, read_configuration
from .start_files import COPIES

_MAGIC = "openmm-cylchain checkpoint 6"


@dataclass(frozen=True)
class Checkpoint:
    """State of a run after ``step`` steps: OpenMM's checkpoint, the extent of files, and which filaments have gone."""

    step: int
    engine: str
    trajectory_size: int
    trajectory_header: bytes
    energies_size: int
    state: bytes
    linkers_size: int = 0
    linker_records: int = 0
    pulling_size: int = 0
    twist_size: int = 0
    twist_records: int = 0
    force_sizes: tuple[int, int] = (0, 0)
    growth_size: int = 0
    deleted: frozenset[int] = frozenset()


class RunDirectory(RunFiles):
    """A directory, made if need be, that one run at a time writes into; a context manager that holds its lock."""

    def __init__(self, path):
        super().__init__(path)
        # As it was when the directory was claimed.
        self._configuration_digest = None

    def __enter__(self):
        if self.path.exists() and not self.path.is_dir():
            raise InputError(f"The output directory {self.path} is a file: choose another name.")
        self.path.mkdir(parents=True, exist_ok=True)
        self._lock = open(self.lock, "a+b")
        if not try_lock(self._lock):
            self._lock.close()
            raise InputError(
                f"Another run is writing into {self.path}: wait until it ends, or choose another output directory."
            )
        return self

    def __exit__(self, *exception):
        # Closing releases the lock; the file stays, because removing it would let two runs in.
        self._lock.close()

    def claim(self, configuration, resume):
        """Make the directory that of a run with this configuration.

        Parameters
        ----------
        resume : bool
            Whether to continue a run that is there.

        Returns
        -------
        Checkpoint or None
            Where to continue; None to start from the beginning.

        Raises
        ------
        InputError
            If the directory holds a run and ``resume`` is False, or a run of another configuration.
        """
        if resume and self.configuration.exists():
            self._check_same(configuration)
            self._configuration_digest = self._digest_of_configuration()
            return self._read_checkpoint()
        self._check_vacant(configuration, resume)
        self._keep_start_files(configuration.start_files)
        write_atomically(self.configuration, configuration.text.encode())
        self._configuration_digest = self._digest_of_configuration()
        return None

    def _keep_start_files(self, paths):
        # The configuration is read again from here, and must find them whatever becomes of the originals.
        names = [path.name for path in paths]
        if len(set(names)) < len(names):
            raise InputError(
                f"Files to start from must have different names, because the run keeps copies, but are {names}."
            )
        for path in paths:
            (self.path / COPIES).mkdir(exist_ok=True)
            write_atomically(self.path / COPIES / path.name, path.read_bytes())

    def _check_vacant(self, configuration, resume):
        results = (
            self.trajectory,
            self.checkpoint,
            self.energies,
            self.linkers,
            self.linker_places,
            self.crosslinks,
            self.pulling,
            self.twist,
            self.twists,
            self.growth,
            self.wall_forces,
            self.contact_forces,
        )
        for path in (*results, self.topology, self.summary, self.figure):
            if path.exists():
                advice = "but no configuration.toml to resume it with:" if resume else "continue it with --resume, or"
                raise InputError(
                    f"The output directory {self.path} already holds a run ({path.name}), {advice} choose another "
                    "output directory."
                )
        if self.configuration.exists() and self.configuration.read_bytes() != configuration.text.encode():
            raise InputError(
                f"The output directory {self.path} already holds another configuration.toml: choose another output "
                "directory."
            )

    def _check_same(self, configuration):
        changed = changed_keys(read_configuration(self.configuration), configuration)
        if changed:
            raise InputError(
                f"The configuration differs from the one that the run in {self.path} was started with, in "
                f"{', '.join(changed)}. Resume with {self.configuration}, or start a new run in another directory."
            )

    def write_checkpoint(self, checkpoint):
        """Replace the checkpoint; the trajectory and the energies must be on disk already."""
        header = {
            "format": _MAGIC,
            "configuration": self._configuration_digest,
            "version": __version__,
            "step": checkpoint.step,
            "engine": checkpoint.engine,
            "trajectory_size": checkpoint.trajectory_size,
            "trajectory_header": checkpoint.trajectory_header.hex(),
            "energies_size": checkpoint.energies_size,
            "linkers_size": checkpoint.linkers_size,
            "linker_records": checkpoint.linker_records,
            "pulling_size": checkpoint.pulling_size,
            "twist_size": checkpoint.twist_size,
            "twist_records": checkpoint.twist_records,
            "force_sizes": checkpoint.force_sizes,
            "growth_size": checkpoint.growth_size,
            "deleted": sorted(checkpoint.deleted),
            "state_size": len(checkpoint.state),
        }
        header["digest"] = digest_of_checkpoint(header, checkpoint.state)
        write_atomically(self.checkpoint, json.dumps(header).encode() + b"\n" + checkpoint.state)

    def _digest_of_configuration(self):
        return hashlib.sha256(self.configuration.read_bytes()).hexdigest()

    def _read_checkpoint(self):
        if not self.checkpoint.exists():
            return None
        line, _, state = self.checkpoint.read_bytes().partition(b"\n")
        try:
            header = json.loads(line)
            if header["format"] != _MAGIC:
                raise ValueError
            self._check_version(header["version"])
            if header.pop("digest") != digest_of_checkpoint(header, state):
                raise ValueError
            configuration = header["configuration"]
            checkpoint = Checkpoint(
                step=header["step"],
                engine=header["engine"],
                trajectory_size=header["trajectory_size"],
                trajectory_header=bytes.fromhex(header["trajectory_header"]),
                energies_size=header["energies_size"],
                linkers_size=header["linkers_size"],
                linker_records=header["linker_records"],
                pulling_size=header["pulling_size"],
                twist_size=header["twist_size"],
                twist_records=header["twist_records"],
                force_sizes=tuple(header["force_sizes"]),
                growth_size=header["growth_size"],
                deleted=frozenset(header["deleted"]),
                state=state,
            )
        except InputError:
            raise
        except (ValueError, KeyError, TypeError, AttributeError, RecursionError):
            raise InputError(
                f"{self.checkpoint} is damaged or of another version: the run cannot be resumed. Delete it to start "
                "from the beginning with --resume."
            ) from None
        if configuration != self._configuration_digest:
            raise InputError(
                f"{self.configuration} has been changed since the run was started: put back what it was, or start a "
                "new run in another directory."
            )
        return checkpoint

    def _check_version(self, version):
        if version != __version__:
            raise InputError(
                f"The run in {self.path} was started with openmm_cylchain {version}, and this is {__version__}: resume "
                "it with that version, or start it again in another directory."
            )


def digest_of_checkpoint(header, state):
    """SHA-256 of all that a checkpoint says: of its header, a dict, and of OpenMM's checkpoint, in bytes."""
    return hashlib.sha256(json.dumps(header, sort_keys=True).encode() + b"\n" + state).hexdigest()
