"""[[joint]]: moments between tangents of filaments of beam elements."""

import math
from dataclasses import dataclass

from ...units import quantities as units
from ..keys import REQUIRED, Key, Pair, Quantity, direction
from ..table import ACTIVE, TableKind, group_of
from .couplings import PLACE_KEYS, check_place

_TANGENT = TableKind(
    "tangent",
    (
        *(key for key in PLACE_KEYS if key.name not in ("point", "body", "body_point")),
        Key("direction", direction(), None, "One that does not change, in place of a filament."),
    ),
    "Where the tangent of a filament is, towards its last node, or a direction.",
)
_TANGENTS = '[{ filament = 0, arc_length = "1 um" }, { filament = 1, node = 0 }]'

JOINT = TableKind(
    "joint",
    (
        Key("between", Pair(_TANGENT, _TANGENTS), REQUIRED, "Two tangents, or a tangent and a direction."),
        Key("stiffness", Quantity(units.ENERGY), REQUIRED, "Stiffness of the joint, per square radian."),
        Key(
            "angle",
            Quantity(units.ANGLE, "zero"),
            None,
            'Between the two, up to "180 deg"; without it, at rest as the run begins.',
        ),
        ACTIVE,
    ),
    'Moments that hold the angle between two filaments of element = "beam" anywhere along them, or between one and a '
    "direction, see `Joints`. With a [[link]] of rest length zero between the same two places, the two are welded "
    "together.",
    repeated=True,
)


@dataclass(frozen=True)
class JointGroup:
    """A [[joint]] table: two tangents, as dicts, the stiffness in kJ/mol, and the angle in radians or None."""

    between: tuple
    stiffness: float
    angle: float | None


def read_joint(entries, groups):
    """The JointGroup of a [[joint]] table."""
    for tangent in entries["between"]:
        if "direction" in tangent:
            names = ("filament", "arc_length", "segment", "fraction", "node")
            tangent.refuse(names, "cannot be with a direction.")
            continue
        check_place(tangent, groups)
        group = group_of(tangent["filament"], groups)
        if group.type.segment_kind.straight:
            raise tangent.at("filament").error(
                f"{tangent['filament']} ({group.type.name}) has straight segments: joints are between filaments of "
                'element = "beam".'
            )
    if all("direction" in tangent for tangent in entries["between"]):
        raise entries.at("between").error("must have a filament: there is nothing to turn between two directions.")
    if entries["angle"] is not None and entries["angle"] > math.pi * (1.0 + 1e-9):
        raise entries.at("angle").error('must be at most "180 deg".')
    between = tuple(tangent.values for tangent in entries["between"])
    return JointGroup(between, entries["stiffness"], entries["angle"])
