"""Spare nodes of filaments that grow: particles behind the last node, and exactly where it is."""

from __future__ import annotations

import numpy as np

from ..errors import InputError
from ..units.quantities import LENGTH, in_units_of
from ..units.types import FloatArray, IntArray, Vectors


def count_nodes(positions: Vectors) -> IntArray:
    """How many nodes a filament that grows has in each frame: its other particles are where the last node is, exactly.

    Parameters
    ----------
    positions : (frames, n, 3) or (n, 3) length
        Of all particles of one filament.

    Returns
    -------
    (frames,) int array, without an axis for (n, 3)
        0 where all of them are in one place: there is no filament.

    Raises
    ------
    InputError
        For another shape, or fewer than two particles.
    """
    places = np.asarray(in_units_of(positions, LENGTH, "positions"))
    if places.ndim not in (2, 3) or places.shape[-1] != 3 or places.shape[-2] < 2:
        raise InputError(f"positions must have the shape (frames, n, 3) with n from 2 on, but have {places.shape}.")
    apart = np.any(places != places[..., -1:, :], axis=-1)
    # The last node is behind the last particle that is elsewhere.
    elsewhere = places.shape[-2] - np.argmax(apart[..., ::-1], axis=-1)
    nodes: IntArray = np.where(apart.any(axis=-1), elsewhere + 1, 0)
    return nodes


def without_spare_nodes(positions: FloatArray) -> FloatArray:
    """Positions (frames, n, 3) of one filament with NaN in the place of its spare nodes; as they are without any."""
    counts = count_nodes(positions)
    if np.all(counts == positions.shape[1]):
        return positions
    spare = np.arange(positions.shape[1]) >= counts[:, None]
    return np.where(spare[..., None], np.nan, positions)
