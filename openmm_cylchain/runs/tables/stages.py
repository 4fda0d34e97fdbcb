"""[[stage]]: parts of a run one after the other, and which keys of other tables may change with them."""

from ...units import quantities as units
from ..keys import Key, Quantity, Text, Whole
from ..table import TableKind

_MOST_REPEATS, _MOST_PIECES = 10**4, 10**4

STAGE = TableKind(
    "stage",
    (
        Key("name", Text('"drug"'), None, "What the summary and the figure call it; its number if not given."),
        Key("duration", Quantity(units.TIME), None, "How long it is: a whole number of reports."),
        Key("repeat", Whole(1, _MOST_REPEATS, "3"), 1, "How often it comes, one after the other."),
        Key(
            "pieces",
            Whole(1, _MOST_PIECES, "20"),
            None,
            "Into how many equal pieces, each a whole number of reports, it is divided for values that go from one to "
            "another. In each, they are those of its middle.",
        ),
    ),
    "A part of the run. It begins as the one before has ended, with what its tables change: `[stage.NAME]` has keys of "
    "`[NAME]`, and stays in force until a later stage changes it again. See below.",
    repeated=True,
)
"""Its own keys."""

CHANGES = {
    "solvent": ("temperature", "viscosity"),
    "flow": (
        *("velocity", "shear", "extension", "gradient", "direction", "gradient_direction", "compression", "origin"),
        "active",
    ),
    "filament": (
        *("persistence_length", "bending_rigidity", "stretching_modulus", "stretching_stiffness", "propulsion"),
        *("growth", "contact_diameter", "contacts", "active", "delete", "cut"),
    ),
    "monomers": ("plus_on_rate", "plus_off_rate", "minus_on_rate", "minus_off_rate", "aging", "concentration"),
    "nucleation": ("rate", "total_rate", "direction", "inside", "contact_diameter", "contacts"),
    "branching": ("rate", "debranching_rate", "debranching_force", "inside", "contact_diameter", "contacts"),
    "particles": ("diameter", "friction", "diffusion"),
    "linkers": (
        *("hand", "hands", "stiffness", "rest_length", "same_filament", "count", "concentration", "volume", "bound"),
        "keep",
    ),
    "barrier": ("toward", "release_rate", "capture_probability", "active"),
    "link": ("stiffness", "rest_length", "maximum_extension", "active"),
    "joint": ("stiffness", "angle", "active"),
    "tether": ("point", "stiffness", "velocity", "start_time", "active"),
    "end_frame": ("torque", "angular_velocity"),
    "pull": ("tension", "direction", "node", "force", "active"),
    "contacts": ("diameter", "stiffness", "excluded_neighbors", "active"),
    "wall": (
        *(
            "point",
            "normal",
            "thickness",
            "center",
            "radius",
            "major_radius",
            "minor_radius",
            "axis",
            "lower",
            "upper",
            "semi_axes",
            "corners",
            "bottom",
            "top",
            "stiffness",
        ),
        *("length", "distance", "side", "whole", "nodes", "holds", "active"),
    ),
    "simulation": ("time_step", "report_interval", "checkpoint_interval", "checks"),
}
"""Keys that a stage may change, by the names of tables."""

STAYS = {"growth": ("monomers", "longest", "shortest", "vanishes"), "hand": ("site_spacing",)}
"""Keys that may not, of tables within these."""

INSTEAD = (
    ("linkers", ("count", "concentration")),
    ("filament", ("persistence_length", "bending_rigidity")),
    ("filament", ("stretching_modulus", "stretching_stiffness")),
    ("particles", ("friction", "diffusion")),
    ("nucleation", ("rate", "total_rate")),
)
"""Of which one is in place of the other."""
