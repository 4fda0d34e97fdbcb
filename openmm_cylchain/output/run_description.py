"""What a run simulates, as a file beside its trajectory: filaments, box, walls, kinds of linkers, times of frames."""

import dataclasses
import json
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from ..bead_spring.bead_spring_type import BeadSpringType
from ..errors import InputError
from ..filaments.chain_type import ChainType
from ..filaments.filament_type import FilamentType
from ..mechanics.friction import EndCorrections
from ..version import __version__
from .files import write_atomically

_FORMAT = "openmm-cylchain run 1"
_TYPES: dict[str, Any] = {kind.__name__: kind for kind in (FilamentType, BeadSpringType)}


@dataclass(frozen=True)
class DescribedFilament:
    """A filament of a run.

    Attributes
    ----------
    type : FilamentType or BeadSpringType
    nodes : tuple of int
        Particles, in order along the filament.
    ring : bool
        Whether the last node is joined to the first.
    clamped : tuple of int
        Nodes that do not move, counted along the filament.
    """

    type: ChainType
    nodes: tuple[int, ...]
    ring: bool = False
    clamped: tuple[int, ...] = ()

    @property
    def diameter(self) -> float:
        """In nm."""
        return self.type.diameter


@dataclass(frozen=True)
class DescribedLinkers:
    """A kind of linkers of a run: name, stiffness in kJ/(mol nm^2) and rest length in nm of their springs."""

    name: str
    stiffness: float
    rest_length: float


@dataclass(frozen=True)
class DescribedWall:
    """A wall of a run by its region: see ``Shape.region``; lengths in nm."""

    shape: str
    point: tuple[float, float, float]
    vector: tuple[float, float, float]
    length: float


@dataclass(frozen=True)
class RunDescription:
    """What a run simulates.

    Attributes
    ----------
    title : str
    temperature : float
        In K.
    time_step : float
        In ps.
    steps, steps_per_frame : int
    particles : int
    filaments : tuple of DescribedFilament
    box : three vectors of a periodic box in nm, or None
    linkers : tuple of DescribedLinkers
    walls : tuple of DescribedWall
    """

    title: str
    temperature: float
    time_step: float
    steps: int
    steps_per_frame: int
    particles: int
    filaments: tuple[DescribedFilament, ...]
    box: tuple[tuple[float, ...], ...] | None = None
    linkers: tuple[DescribedLinkers, ...] = ()
    walls: tuple[DescribedWall, ...] = ()

    def write(self, path: Path) -> None:
        """Write the description as JSON."""
        types = list(dict.fromkeys(filament.type for filament in self.filaments))
        content = {
            **{field.name: getattr(self, field.name) for field in dataclasses.fields(self)},
            "format": _FORMAT,
            "version": __version__,
            "types": [_type_entries(kind) for kind in types],
            "filaments": [
                {"type": types.index(own.type), "nodes": own.nodes, "ring": own.ring, "clamped": own.clamped}
                for own in self.filaments
            ],
            "linkers": [dataclasses.asdict(own) for own in self.linkers],
            "walls": [dataclasses.asdict(own) for own in self.walls],
        }
        write_atomically(path, (json.dumps(content, allow_nan=False) + "\n").encode())


def _type_entries(kind):
    entries = {field.name: getattr(kind, field.name) for field in dataclasses.fields(kind) if field.init}
    if "end_corrections" in entries:
        entries["end_corrections"] = dataclasses.asdict(entries["end_corrections"])
    return {"kind": type(kind).__name__, **entries}


def read_run_description(path: Path) -> RunDescription:
    """Read what ``RunDescription.write`` has written; InputError if the file is another one or damaged."""
    try:
        content = json.loads(path.read_bytes())
        if content.pop("format") != _FORMAT:
            raise ValueError
        content.pop("version")
        types = [_type_of(entries) for entries in content.pop("types")]
        content["filaments"] = tuple(
            DescribedFilament(types[own["type"]], tuple(own["nodes"]), own["ring"], tuple(own["clamped"]))
            for own in content["filaments"]
        )
        content["box"] = None if content["box"] is None else tuple(map(tuple, content["box"]))
        content["linkers"] = tuple(DescribedLinkers(**own) for own in content["linkers"])
        content["walls"] = tuple(
            DescribedWall(own["shape"], tuple(own["point"]), tuple(own["vector"]), own["length"])
            for own in content["walls"]
        )
        return RunDescription(**content)
    except (ValueError, KeyError, TypeError, IndexError, AttributeError):
        raise InputError(
            f"{path} does not describe a run, is damaged or of another version of openmm_cylchain."
        ) from None


def _type_of(entries):
    kind = _TYPES[entries.pop("kind")]
    if "end_corrections" in entries:
        entries["end_corrections"] = EndCorrections(**entries["end_corrections"])
    return kind(**entries)
