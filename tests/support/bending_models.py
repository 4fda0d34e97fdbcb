"""The bending models once more, by hand: what a joint of unit stiffness has at an angle. Tests take them from here."""

from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

import numpy as np


@dataclass(frozen=True)
class BendingModel:
    """The energy, and its derivative by the angle."""

    energy: Callable[..., Any]
    slope: Callable[..., Any]


BENDING_MODELS = {
    # Eq. (27), eq. (26) and case B of Fig. 5 of Pesek et al. 2016.
    "inscribed-circle": BendingModel(
        energy=lambda angle: 2 * np.tan(angle / 2) ** 2,
        slope=lambda angle: 2 * np.tan(angle / 2) / np.cos(angle / 2) ** 2,
    ),
    "kratky-porod": BendingModel(energy=lambda angle: 2 * np.sin(angle / 2) ** 2, slope=np.sin),
    "quadratic": BendingModel(energy=lambda angle: angle**2 / 2, slope=lambda angle: angle),
}
