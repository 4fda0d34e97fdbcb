"""The points of a scan and their replicas: the configuration, the seed and the digest of each run."""

import copy
import dataclasses
import hashlib
import itertools
import math
import re
from dataclasses import dataclass

from .toml_text import toml_text

_MOST_RUNS = 100_000
_SEEDS = 2**31 - 1
_QUANTITY = re.compile(r"\s*([-+]?(?:\d+\.?\d*|\.\d+)(?:[eE][-+]?\d+)?)\s*(\S.*?)?\s*")


@dataclass(frozen=True)
class Axis:
    """A key that varies.

    Attributes
    ----------
    path : tuple
        Of the key in a configuration.
    label : str
        As it is written: "solvent.temperature".
    values : tuple
        As they are written.
    read : tuple
        As they are read.
    place : Place
        In the file of the scan.
    """

    path: tuple
    label: str
    values: tuple
    read: tuple
    place: object = dataclasses.field(compare=False, repr=False)

    @property
    def numbers(self):
        """The values as numbers and their unit, as written; None if they are no numbers of one unit."""
        if all(isinstance(value, (int, float)) and not isinstance(value, bool) for value in self.values):
            return list(self.values), ""
        matches = [_QUANTITY.fullmatch(value) if isinstance(value, str) else None for value in self.values]
        if not all(matches) or len({match[2] for match in matches}) > 1:
            return None
        return [float(match[1]) for match in matches], matches[0][2] or ""


@dataclass(frozen=True)
class ScanRun:
    """A replica of a point: its values along the axes by their labels, its seed, and the text of its configuration."""

    values: dict
    replica: int
    seed: int
    text: str = dataclasses.field(repr=False)
    digest: str = ""

    @property
    def name(self):
        """Of its directory."""
        return self.digest[:16]

    @property
    def point_label(self):
        """Its values in words."""
        return ", ".join(f"{label} = {written(value)}" for label, value in self.values.items())

    @property
    def label(self):
        """What messages call it."""
        return f"{self.point_label}, replica {self.replica}" if self.values else f"replica {self.replica}"

    def with_digest(self, files):
        """The same with the SHA-256 of its configuration and of the digests of files that it starts from."""
        digest = hashlib.sha256("\0".join([self.text, *files]).encode()).hexdigest()
        return dataclasses.replace(self, digest=digest)


def written(value):
    """A value as people write it: texts without quotes."""
    return value if isinstance(value, str) else toml_text({"value": value}).removeprefix("value = ").strip()


def make_runs(base, axes, replicas, seed, place):
    """All replicas of all points of a grid, point by point, the last axis first.

    Seeds are those of what is simulated and of the number of the replica, so that they stay when a grid grows.

    Parameters
    ----------
    base : dict
        Tables of the run on which all are based.
    axes : sequence of Axis
    replicas, seed : int
    place : Place
        Of the number of replicas, for messages.

    Returns
    -------
    list of ScanRun
    """
    count = math.prod(len(axis.values) for axis in axes) * replicas
    if count > _MOST_RUNS:
        raise place.error(f"and [vary] make {count} runs: there can be {_MOST_RUNS} at most.")
    runs, taken = [], set()
    for point in itertools.product(*(axis.values for axis in axes)):
        entries = copy.deepcopy(base)
        for axis, value in zip(axes, point):
            _set(entries, axis.path, value)
        entries["simulation"].pop("seed", None)
        simulated = toml_text(entries)
        for replica in range(1, replicas + 1):
            own = _seed(f"{seed}\0{replica}\0{simulated}", taken)
            taken.add(own)
            entries["simulation"]["seed"] = own
            values = {axis.label: value for axis, value in zip(axes, point)}
            runs.append(ScanRun(values, replica, own, toml_text(entries)))
    return runs


def _set(entries, path, value):
    for key in path[:-1]:
        entries = entries[key] if isinstance(key, int) else entries.setdefault(key, {})
    entries[path[-1]] = value


def _seed(text, taken):
    for number in itertools.count():
        digest = hashlib.sha256(f"{number}\0{text}".encode()).digest()
        seed = 1 + int.from_bytes(digest[:8], "big") % _SEEDS
        if seed not in taken:
            return seed
