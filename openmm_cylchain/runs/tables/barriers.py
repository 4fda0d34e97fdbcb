"""[[barrier]]: places on filaments that capture hands of linkers which walk past them."""

from ...kinetics.barrier import as_barrier
from ...kinetics.binding_range import ENDS_OF_RANGE
from ...units import quantities as units
from ..keys import REQUIRED, Choice, Key, Listing, Number, Quantity, Whole
from ..table import ACTIVE, TableKind, group_of
from .couplings import check_filament, lengths_along

BARRIER = TableKind(
    "barrier",
    (
        Key("filament", Whole(0, None, "0"), REQUIRED, "Number of a filament."),
        Key(
            "arc_lengths",
            Listing(Quantity(units.LENGTH, "zero"), "lengths", '["2 um", "5 um"]'),
            REQUIRED,
            "Places: distances from its first node along it.",
        ),
        Key("toward", Choice(ENDS_OF_RANGE), REQUIRED, "They capture hands that walk towards this end."),
        Key("release_rate", Quantity(units.RATE, "zero"), REQUIRED, "Rate at which each lets a hand go on."),
        Key("capture_probability", Number("0.8"), 1.0, "How likely it captures a hand that comes by."),
        ACTIVE,
    ),
    "Places on a filament that capture hands of linkers which walk past them, as CTCF captures cohesin, see "
    "`Filaments.add_barrier`.",
    repeated=True,
)


def read_barrier(entries, groups):
    """The Barriers of a [[barrier]] table."""
    check_filament(entries, entries["filament"], groups)
    group = group_of(entries["filament"], groups)
    if group.growth is not None:
        raise entries.at("filament").error(f"{entries['filament']} grows: barriers are on filaments that do not.")
    length = float(lengths_along(group.type, group.segments, group.closed).sum())
    with entries.naming():
        return tuple(
            as_barrier(
                entries["filament"],
                along,
                entries["toward"],
                entries["release_rate"],
                entries["capture_probability"],
                length,
            )
            for along in entries["arc_lengths"]
        )


def check_barriers(tables, linkers):
    """Raise ConfigurationError for a [[barrier]] table without linkers."""
    if tables and not linkers:
        raise tables[0].error("captures hands of linkers, but there are no [[linkers]]: add some, or leave it out.")
