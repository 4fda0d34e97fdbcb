"""Filaments of which an end has a torque that the pull on them, as far as it is known before a run, does not bear."""

import warnings
from collections.abc import Mapping
from typing import cast

import numpy as np

from ..errors import TwistWarning
from ..filaments.collection import FilamentCollection
from ..filaments.filament_type import FilamentType
from ..theory.twisted_chain import critical_torque
from ..units.quantities import PICONEWTON
from ..units.types import FloatArray
from .pulled_filaments import tensions_of_loads


def warn_of_winding_filaments(filaments: FilamentCollection, constant_forces: Mapping[int, FloatArray]) -> None:
    """Issue a TwistWarning of the first filament with a torque above that of ``theory.critical_torque``.

    The filament has a frame that is held at its other end, and is pulled by constant forces, (3,) in kJ/(mol nm), which
    are by the particle that they act on. The tension is that of most of its segments.
    """
    held = {(own.filament, own.end) for own in filaments.end_frames if own.is_held}
    for frame in filaments.end_frames:
        number, filament = frame.filament, filaments[frame.filament]
        other = "minus" if frame.end == "plus" else "plus"
        nodes = filaments.node_indices[number].tolist()
        loads = {node: constant_forces[one] for node, one in enumerate(nodes) if one in constant_forces}
        if not (frame.torque and loads and (number, other) in held):
            continue
        tethers = [own for own in filaments.tethers if own.filament == number]
        tension = float(np.median(tensions_of_loads(filament, loads, tethers) @ np.array(frame.direction)))
        largest = float(critical_torque(cast(FilamentType, filament.type), max(0.0, tension)))
        if abs(frame.torque) > largest:
            warnings.warn(
                f"The {frame.end} end of filament {number} ({filament.type.name}) has a torque of "
                f"{frame.torque / PICONEWTON:.3g} pN nm. Under a tension of {tension / PICONEWTON:.3g} pN, filaments "
                f"are straight up to {largest / PICONEWTON:.3g} pN nm: this one winds itself up, without end. Hold its "
                "end in turns (add_end_frame without a torque), or pull more.",
                TwistWarning,
                stacklevel=4,
            )
            return
