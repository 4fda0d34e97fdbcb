"""[solvent], [box] and [flow]: what filaments are in."""

from dataclasses import dataclass

import numpy as np

from ...mechanics.flow import Flow
from ...units import quantities as units
from ..keys import REQUIRED, Key, Listing, Quantity, Triple, direction, point
from ..table import ACTIVE, TableKind

SOLVENT = TableKind(
    "solvent",
    (
        Key("temperature", Quantity(units.TEMPERATURE), REQUIRED, "Temperature of the solvent and of the noise."),
        Key("viscosity", Quantity(units.VISCOSITY), REQUIRED, "Viscosity of the solvent."),
    ),
    "The solvent.",
    required=True,
)

EDGES = Triple(Quantity(units.LENGTH, "any"), '["1 um", "1 um", "1 um"]', positive=True)
BOX = TableKind(
    "box",
    (Key("edges", EDGES, REQUIRED, "Edges of a rectangular box, along x, y and z."),),
    "A periodic box. Contacts, links and linkers join nearest images; filaments without a place begin anywhere in it.",
)

FLOW = TableKind(
    "flow",
    (
        Key(
            "velocity",
            Triple(Quantity(units.VELOCITY, "any"), '["1 um/s", "0 um/s", "0 um/s"]'),
            None,
            "Velocity at the origin.",
        ),
        Key("shear", Quantity(units.RATE, "any"), None, "Rate of simple shear: flow along direction."),
        Key("extension", Quantity(units.RATE, "any"), None, "Rate of planar extension along direction."),
        Key(
            "gradient",
            Listing(
                Triple(Quantity(units.RATE, "any"), '["0 1/s", "0 1/s", "10 1/s"]'), "three rows", '[["0 1/s", ...]]', 3
            ),
            None,
            "Any linear flow: in row i and column j, the change of component i of the velocity along axis j.",
        ),
        Key("direction", direction(), (1.0, 0.0, 0.0), "Direction of the flow of shear, or of extension."),
        Key("gradient_direction", direction(), (0.0, 0.0, 1.0), "Direction along which the velocity of shear grows."),
        Key("compression", direction(), (0.0, 1.0, 0.0), "Axis of compression of extension."),
        Key("origin", point(), (0.0, 0.0, 0.0), "Where the velocity is that given, or zero."),
        ACTIVE,
    ),
    "Flow of the solvent: the sum of what is given. In a periodic box see `Flow`.",
)


@dataclass(frozen=True)
class Solvent:
    """Temperature in K and viscosity in kJ ps/(mol nm^3)."""

    temperature: float
    viscosity: float


def read_solvent(entries):
    """The Solvent of a [solvent] table."""
    return Solvent(entries["temperature"], entries["viscosity"])


def read_flow(entries):
    """The Flow of a [flow] table."""
    if not entries.given("velocity", "shear", "extension", "gradient"):
        raise entries.error("says nothing: give velocity, shear, extension or gradient.")
    if "gradient" in entries and len(entries["gradient"]) != 3:
        raise entries.at("gradient").error("must be three rows of three rates.")
    origin = entries["origin"]
    with entries.naming():
        flow = Flow(entries["velocity"] or (0.0, 0.0, 0.0), entries["gradient"] or np.zeros((3, 3)), origin)
        if "shear" in entries:
            flow += Flow.shear(entries["shear"], entries["direction"], entries["gradient_direction"], origin)
        if "extension" in entries:
            flow += Flow.extension(entries["extension"], entries["direction"], entries["compression"], origin)
    return flow
