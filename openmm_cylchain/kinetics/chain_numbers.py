"""The numbers by which a CylinderChainBindingForce knows filaments: those of beam elements are behind all others."""

from collections.abc import Sequence

import numpy as np
import numpy.typing as npt

from ..filaments.filament import Filament
from ..units.types import IntArray


class ChainNumbers:
    """Takes numbers of filaments to those of chains, and back; -1, for none, stays what it is.

    Parameters
    ----------
    filaments : sequence of Filament
        Of a System, in their order.
    """

    def __init__(self, filaments: Sequence[Filament]) -> None:
        beams = np.array([filament.type.has_beam_elements for filament in filaments], dtype=bool)
        # An index of -1 finds the last entry.
        self._filaments = np.append(np.argsort(beams, kind="stable"), -1)
        self._chains = np.append(np.argsort(self._filaments[:-1]), -1)

    def chains(self, filaments: npt.ArrayLike) -> IntArray:
        """Numbers of chains, in the shape of those of filaments. Those that do not exist stay what they are."""
        return self._taken(self._chains, filaments)

    def filaments(self, chains: npt.ArrayLike) -> IntArray:
        """Numbers of filaments, in the shape of those of chains."""
        return self._taken(self._filaments, chains)

    @staticmethod
    def _taken(numbers, given):
        given = np.asarray(given, dtype=int)
        known = (given >= -1) & (given < len(numbers) - 1)
        return np.where(known, numbers[np.where(known, given, -1)], given)
