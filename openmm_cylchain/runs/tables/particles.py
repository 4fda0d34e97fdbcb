"""[[particles]]: spheres beside filaments."""

from dataclasses import dataclass

import numpy as np

from ...mechanics.friction import stokes_friction
from ...units import quantities as units
from ...units.quantities import thermal_energy
from ..keys import REQUIRED, Flag, Inline, Key, Listing, Quantity, Text, Whole, point
from ..table import TableKind
from .filament import MOST_NODES
from .shapes import REGION, REGION_EXAMPLE, Region

PARTICLES = TableKind(
    "particles",
    (
        Key("name", Text('"BEAD"'), "PRT", "Up to 5 letters or digits, for structure files."),
        Key(
            "diameter", Quantity(units.LENGTH), REQUIRED, "Diameter of a sphere, for its friction, contacts and walls."
        ),
        Key("count", Whole(1, MOST_NODES, "100"), None, "How many begin at random places."),
        Key(
            "positions",
            Listing(point(), "points", '[["0 nm", "0 nm", "0 nm"]]'),
            None,
            "In place of count: where they begin.",
        ),
        Key("inside", Inline(REGION, REGION_EXAMPLE), None, "A region of random places; the box if not given."),
        Key("friction", Quantity(units.FRICTION), None, "That of Stokes if not given."),
        Key("diffusion", Quantity(units.DIFFUSION), None, "In place of friction: k_B T over the friction."),
        Key("fixed", Flag(), False, "They do not move."),
    ),
    "Spheres that diffuse, beside filaments. Where there are [contacts], they push filaments, bodies and each other; "
    "walls keep them in.",
    repeated=True,
)


@dataclass(frozen=True)
class ParticleGroup:
    """A [[particles]] table; lengths in nm, friction in kJ ps/(mol nm^2)."""

    name: str
    diameter: float
    count: int
    positions: tuple | None
    inside: Region | None
    friction: float
    fixed: bool

    def places(self, generator, box):
        """Where they begin: (count, 3) positions in nm."""
        if self.positions is not None:
            return np.array(self.positions)
        if self.inside is not None:
            return np.array([self.inside.draw(generator) for _ in range(self.count)])
        return generator.uniform(0.0, box, (self.count, 3))


def check_name_and_places(entries, box, taken=("NOD", "ATT", "BED"), owner="nodes"):
    """Raise ConfigurationError unless Entries have a name for structure files, and say how many begin where.

    ``taken`` are names of particles of an ``owner``.
    """
    name = entries["name"]
    if not (name.isalnum() and name.isascii() and len(name) <= 5):
        raise entries.at("name").error(f"must be 1 to 5 letters or digits, but is {name!r}.")
    if name in taken:
        raise entries.at("name").error(f"{name!r} is that of {owner}: choose another.")
    entries.only_one("count", "positions")
    if "positions" in entries:
        entries.refuse(("inside",), "cannot be with positions.")
    else:
        entries.require("count")
        if box is None:
            entries.require("inside")


def read_particles(entries, solvent, box):
    """The ParticleGroup of a [[particles]] table."""
    check_name_and_places(entries, box)
    entries.only_one(
        "friction",
        "diffusion",
    )
    friction = entries["friction"]
    if "diffusion" in entries:
        friction = thermal_energy(solvent.temperature) / entries["diffusion"]
    if friction is None:
        friction = stokes_friction(entries["diameter"], solvent.viscosity)
    positions = entries["positions"]
    return ParticleGroup(
        entries["name"],
        entries["diameter"],
        entries["count"] if positions is None else len(positions),
        positions,
        None if entries["inside"] is None else Region(entries["inside"]),
        friction,
        entries["fixed"],
    )
