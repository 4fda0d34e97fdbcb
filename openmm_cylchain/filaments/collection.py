"""What couplings, reporters and recommended steps see of a Filaments object, which stands above them."""

from collections.abc import Iterator, Sequence
from typing import Any, Protocol

import openmm

from ..errors import InputError
from ..mechanics.flow import Flow
from ..mechanics.redistribution import ChainSet
from ..units.quantities import whole_numbers
from ..units.types import Indices, IntArray, Vectors
from .attachments import Attachment
from .body import PlacedBody
from .filament import Filament, Tether
from .twist import EndFrame


class CollectionInContext(Protocol):
    """What they have in a Context: a ``FilamentsInContext`` object, whose docstrings say what is what."""

    def tethers(self) -> tuple[Tether, ...]: ...

    def move_tethers(self, tethers: Indices, points: Vectors) -> None: ...

    def twists(self, filament: int) -> Any: ...

    def energies(self, filament: int) -> Any: ...

    def growth(self) -> Any: ...

    def linkers(self) -> Any: ...

    def linker_places(self) -> Any: ...

    def linker_events(self, linker_type: int | None = None) -> tuple[int, int]: ...

    def flow(self) -> Flow: ...

    def record_tensions(self) -> None: ...

    def mean_axial_tensions(self) -> list[Any]: ...


class FilamentCollection(Protocol):
    """Filaments with their places in a System: a ``Filaments`` object, whose docstrings say what is what."""

    def __len__(self) -> int: ...

    def __getitem__(self, index: int) -> Filament: ...

    def __iter__(self) -> Iterator[Filament]: ...

    @property
    def end_frames(self) -> tuple[EndFrame, ...]: ...

    @property
    def bodies(self) -> tuple[PlacedBody, ...]: ...

    @property
    def body_indices(self) -> list[IntArray]: ...

    @property
    def viscosity(self) -> float: ...

    @property
    def temperature(self) -> float: ...

    @property
    def node_indices(self) -> list[IntArray]: ...

    @property
    def control_point_indices(self) -> list[IntArray]: ...

    @property
    def bead_indices(self) -> list[IntArray]: ...

    @property
    def attachment_indices(self) -> IntArray: ...

    @property
    def attachments(self) -> tuple[Attachment, ...]: ...

    @property
    def tethers(self) -> tuple[Tether, ...]: ...

    @property
    def linkers(self) -> tuple[Any, ...]: ...

    def chain_set(self, system: openmm.System) -> ChainSet: ...

    def in_context(self, context: openmm.Context) -> CollectionInContext: ...


def held_numbers(numbers: Indices | None, count: int) -> Sequence[int]:
    """Numbers of different ones of so many filaments, all if None; InputError for others."""
    if numbers is None:
        return range(count)
    held = whole_numbers(numbers, 0, "numbers")
    for index in held:
        if index >= count:
            raise InputError(f"Filament {index} does not exist; there are {count}.")
    if len(set(held)) < len(held):
        raise InputError(f"numbers must be those of different filaments, but are {list(held)}.")
    return held


def require_filaments(filaments: Any) -> None:
    """Raise InputError for what is no Filaments object."""
    # Of the class: the property itself refuses filaments that are not in a System yet, which is another mistake.
    if not hasattr(type(filaments), "node_indices"):
        raise InputError(f"filaments must be a Filaments object, but is {type(filaments).__name__}.")
