"""What couplings, reporters and recommended steps see of a Filaments object, which stands above them."""

from collections.abc import Iterator
from typing import Any, Protocol

import openmm

from ..mechanics.flow import Flow
from ..mechanics.redistribution import ChainSet
from ..units.types import Indices, IntArray, Vectors
from .attachments import Attachment
from .filament import Filament, Tether


class FilamentCollection(Protocol):
    """Filaments with their places in a System: a ``Filaments`` object, whose docstrings say what is what."""

    def __len__(self) -> int: ...

    def __getitem__(self, index: int) -> Filament: ...

    def __iter__(self) -> Iterator[Filament]: ...

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

    def tethers_in(self, context: openmm.Context) -> tuple[Tether, ...]: ...

    def move_tethers(self, context: openmm.Context, tethers: Indices, points: Vectors) -> None: ...

    def flow(self, context: openmm.Context) -> Flow: ...

    def chain_set(self, system: openmm.System) -> ChainSet: ...

    def record_tensions(self, context: openmm.Context) -> None: ...

    def mean_axial_tensions(self, context: openmm.Context) -> list[Any]: ...
