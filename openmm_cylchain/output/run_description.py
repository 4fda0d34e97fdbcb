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
    nodes : tuple of int
        Particles, in order along the filament.
    ring : bool
        Whether the last node is joined to the first.
    clamped : tuple of int
        Nodes that do not move, counted along the filament.
    control_points : tuple of int
        Particles of the control points of nodes of beam elements.
    clamped_tangents : tuple of int
        Nodes of beam elements whose control points do not move.
    planar : bool
        Whether it stays in its plane z = const.
    load : str
        What pulls at it, such as "0.2 pN", where loads differ; else empty.
    monomer_length : float
        By which it grows, in nm; zero if it does not.
    bent_at_rest : bool
        Whether its joints are.
    """

    type: ChainType
    nodes: tuple[int, ...]
    ring: bool = False
    clamped: tuple[int, ...] = ()
    control_points: tuple[int, ...] = ()
    clamped_tangents: tuple[int, ...] = ()
    planar: bool = False
    load: str = ""
    monomer_length: float = 0.0
    bent_at_rest: bool = False

    @property
    def diameter(self) -> float:
        """In nm."""
        return self.type.diameter


@dataclass(frozen=True)
class DescribedLinkers:
    """A kind of linkers of a run: name, stiffness in kJ/(mol nm^2) and rest length in nm of their springs; whether a
    hand walks."""

    name: str
    stiffness: float
    rest_length: float
    motor: bool = False


@dataclass(frozen=True)
class DescribedParticles:
    """Particles of a run that are no part of filaments: of one name, with a diameter in nm, 0 if it is not known."""

    name: str
    particles: tuple[int, ...]
    diameter: float


@dataclass(frozen=True)
class DescribedWall:
    """A wall of a run by its region: see ``Shape.region``; lengths in nm.

    ``stiffness`` in kJ/(mol nm^2), and particles with the radii around them in nm, are those of a
    ``filament_wall_force``; of another wall the shape alone is known, and the stiffness is None.
    """

    shape: str
    point: tuple[float, float, float]
    vector: tuple[float, float, float]
    length: float
    stiffness: float | None = None
    particles: tuple[int, ...] = ()
    radii: tuple[float, ...] = ()


@dataclass(frozen=True)
class DescribedContacts:
    """A ``capsule_contact_force`` of a run: stiffness in kJ/(mol nm^2), diameters in nm.

    ``chains`` are (nodes, diameter, segments of one chain that do not touch, whether it is a ring), ``spheres``
    (particle, diameter), ``exclusions`` (chain, segment, chain, segment).
    """

    stiffness: float
    periodic: bool
    chains: tuple[tuple[tuple[int, ...], float, int, bool], ...]
    spheres: tuple[tuple[int, float], ...] = ()
    exclusions: tuple[tuple[int, int, int, int], ...] = ()


@dataclass(frozen=True)
class DescribedStage:
    """A stage of a run: its name, when it begins in ps, steps before it, and steps from each frame to the next.

    One with ramps is divided: what follows its first piece ``is_piece``.
    """

    name: str
    begin: float
    first_step: int
    steps_per_frame: int
    frames: int
    is_piece: bool = False

    @property
    def steps(self) -> range:
        """Those of its frames."""
        return range(
            self.first_step + self.steps_per_frame,
            self.first_step + self.steps_per_frame * self.frames + 1,
            self.steps_per_frame,
        )


@dataclass(frozen=True)
class RunDescription:
    """What a run simulates.

    Attributes
    ----------
    temperature : float
        In K.
    time_step : float
        In ps.
    steps : int or None
        Of the whole run; None if nobody has said how long it will be.
    filaments : tuple of DescribedFilament
    box : three vectors of a periodic box in nm, or None
    linkers : tuple of DescribedLinkers
    walls : tuple of DescribedWall
    contacts : tuple of DescribedContacts
    others : tuple of DescribedParticles
        Beside filaments.
    stages : tuple of DescribedStage
        Where it is divided into such; the steps of frames are those of them then.
    """

    title: str
    temperature: float
    time_step: float
    steps: int | None
    steps_per_frame: int
    particles: int
    filaments: tuple[DescribedFilament, ...]
    box: tuple[tuple[float, ...], ...] | None = None
    linkers: tuple[DescribedLinkers, ...] = ()
    walls: tuple[DescribedWall, ...] = ()
    contacts: tuple[DescribedContacts, ...] = ()
    others: tuple[DescribedParticles, ...] = ()
    stages: tuple[DescribedStage, ...] = ()

    @property
    def frames(self) -> int | None:
        """Of the whole run, with that at its start; None if nobody has said how long it will be."""
        if self.stages:
            return 1 + sum(own.frames for own in self.stages)
        return None if self.steps is None else self.steps // self.steps_per_frame + 1

    def write(self, path: Path) -> None:
        """Write the description as JSON."""
        types = list(dict.fromkeys(filament.type for filament in self.filaments))
        content = {
            **{field.name: getattr(self, field.name) for field in dataclasses.fields(self)},
            "format": _FORMAT,
            "version": __version__,
            "types": [_type_entries(kind) for kind in types],
            "filaments": [
                {
                    "type": types.index(own.type),
                    "nodes": own.nodes,
                    "ring": own.ring,
                    "clamped": own.clamped,
                    "planar": own.planar,
                    **({"load": own.load} if own.load else {}),
                    **({"monomer_length": own.monomer_length} if own.monomer_length else {}),
                    **({"bent_at_rest": True} if own.bent_at_rest else {}),
                    **(
                        {"control_points": own.control_points, "clamped_tangents": own.clamped_tangents}
                        if own.control_points
                        else {}
                    ),
                }
                for own in self.filaments
            ],
            "linkers": [dataclasses.asdict(own) for own in self.linkers],
            "walls": [dataclasses.asdict(own) for own in self.walls],
            "contacts": [dataclasses.asdict(own) for own in self.contacts],
            "others": [dataclasses.asdict(own) for own in self.others],
            "stages": [dataclasses.asdict(own) for own in self.stages],
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
            DescribedFilament(
                types[own["type"]],
                tuple(own["nodes"]),
                own["ring"],
                tuple(own["clamped"]),
                tuple(own.get("control_points", ())),
                tuple(own.get("clamped_tangents", ())),
                own.get("planar", False),
                own.get("load", ""),
                own.get("monomer_length", 0.0),
                own.get("bent_at_rest", False),
            )
            for own in content["filaments"]
        )
        content["box"] = None if content["box"] is None else tuple(map(tuple, content["box"]))
        content["linkers"] = tuple(DescribedLinkers(**own) for own in content["linkers"])
        content["walls"] = tuple(DescribedWall(**_as_tuples(own)) for own in content["walls"])
        content["contacts"] = tuple(DescribedContacts(**_as_tuples(own)) for own in content.get("contacts", ()))
        content["stages"] = tuple(DescribedStage(**own) for own in content.get("stages", ()))
        content["others"] = tuple(DescribedParticles(**_as_tuples(own)) for own in content.get("others", ()))
        return RunDescription(**content)
    except (ValueError, KeyError, TypeError, IndexError, AttributeError):
        raise InputError(
            f"{path} does not describe a run, is damaged or of another version of openmm_cylchain."
        ) from None


def _as_tuples(entries):
    if isinstance(entries, dict):
        return {name: _as_tuples(own) for name, own in entries.items()}
    return tuple(map(_as_tuples, entries)) if isinstance(entries, list) else entries


def _type_of(entries):
    kind = _TYPES[entries.pop("kind")]
    if "end_corrections" in entries:
        entries["end_corrections"] = EndCorrections(**entries["end_corrections"])
    return kind(**entries)
