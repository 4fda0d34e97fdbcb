"""Types of arguments and results: with a unit of openmm or plain, in OpenMM's units (nm, ps, K, Da, kJ/mol)."""

from collections.abc import Sequence
from typing import TypeAlias

import numpy as np
import numpy.typing as npt
from openmm import unit

Scalar: TypeAlias = float | unit.Quantity
"""One number: a quantity of ``openmm.unit``, or plain in OpenMM's units."""

Numbers: TypeAlias = npt.ArrayLike | unit.Quantity
"""One number or an array of them, as a list, a tuple or an array: with a unit or plain."""

Vector: TypeAlias = npt.ArrayLike | unit.Quantity
"""Three components, (3,), as a list, a tuple or an array: with a unit or plain."""

Vectors: TypeAlias = npt.ArrayLike | unit.Quantity
"""Vectors (..., 3), such as positions or those of a periodic box: with a unit or plain."""

BoxVectors: TypeAlias = Sequence[npt.ArrayLike | unit.Quantity] | npt.NDArray[np.float64] | unit.Quantity
"""The three vectors (3,) of a periodic box, or those (frames, 3, 3) of a trajectory: with a unit or plain."""

Indices: TypeAlias = Sequence[int] | npt.NDArray[np.integer]
"""Whole numbers, such as those of particles, nodes or filaments."""

FloatArray: TypeAlias = npt.NDArray[np.float64]
"""An array of plain numbers in OpenMM's units."""

IntArray: TypeAlias = npt.NDArray[np.integer]
"""An array of whole numbers."""

StringArray: TypeAlias = npt.NDArray[np.str_]
"""An array of texts."""

BoolArray: TypeAlias = npt.NDArray[np.bool_]
"""An array of truth values."""

FloatOrArray: TypeAlias = float | npt.NDArray[np.float64]
"""A plain number in OpenMM's units where one was given, and an array of them where an array was."""
