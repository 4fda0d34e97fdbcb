"""Quantities that the summaries of runs have, by names under which scans gather them."""

import json
from dataclasses import dataclass

from ..errors import InputError
from ..runs.measures import MEASURES

_OF_FILAMENTS = (
    "stretching energy per segment",
    "segment length",
    "bending energy per joint",
    "cosine of joint angle",
    "mean square end-to-end distance",
    "extension along the tension, second half of the run",
    "persistence length",
)
_OF_LINKERS = {
    "unbound linkers": ("unbound", ""),
    "linkers with one hand bound": ("one_hand_bound", ""),
    "linkers with both hands bound": ("both_hands_bound", ""),
    "mean tension of linkers": ("mean_tension", "pN"),
    "largest tension of linkers": ("largest_tension", "pN"),
}
_OF_POPULATIONS = {"filaments at once": ("number", ""), "mean length of filaments that come and go": ("length", "nm")}
QUANTITIES = (*_OF_FILAMENTS, *_OF_LINKERS, *MEASURES, *_OF_POPULATIONS)
"""Names of all quantities."""


@dataclass(frozen=True)
class Quantity:
    """A quantity of one run: of which filaments or linkers (``group`` their number, ``of`` their name), its value in
    ``unit``, its standard error within the run and its theory; None where there is none."""

    of: str
    group: int
    name: str
    unit: str
    value: float
    standard_error: float | None
    theory: float | None


def read_quantities(path):
    """The quantities of the summary of a run: a list of Quantity."""
    try:
        summary = json.loads(path.read_text())
        return [
            *_of_filaments(summary["groups"]),
            *_of_linkers(summary.get("linkers", [])),
            *_of_all(summary.get("measures", [])),
            *_of_populations(summary.get("population", {"kinds": []})["kinds"]),
        ]
    except (ValueError, KeyError, TypeError):
        raise InputError(f"{path} is no summary of a run: remove it, and start the scan again.") from None


def _of_filaments(groups):
    names = _distinct([own["type"] for own in groups])
    for number, (own, name) in enumerate(zip(groups, names)):
        for observable in own["observables"]:
            if observable["name"] in QUANTITIES:
                comparable = observable["verdict"] != "not comparable"
                yield Quantity(
                    name,
                    number,
                    observable["name"],
                    observable["unit"],
                    observable["value"],
                    observable["standard_error"],
                    observable["theory"] if comparable else None,
                )


def _of_linkers(linkers):
    for number, (own, name) in enumerate(zip(linkers, _distinct([own["name"] for own in linkers]))):
        for quantity, (field, unit) in _OF_LINKERS.items():
            if own[field] is not None:
                yield Quantity(name, number, quantity, unit, own[field], own.get(f"{field}_error"), None)


def _of_all(measures):
    # The mean over the second half of the run, or what is in the last frame.
    for own in measures:
        value = own["last"] if own["mean"] is None else own["mean"]
        yield Quantity("all filaments", 0, own["name"], own["unit"], value, own["standard_error"], None)


def _of_populations(kinds):
    for number, own in enumerate(kinds):
        for quantity, (field, unit) in _OF_POPULATIONS.items():
            if own[field] is not None:
                error, theory = own[f"{field}_error"], own[f"{field}_of_free_ones"]
                yield Quantity(own["name"], number, quantity, unit, own[field], error, theory)


def _distinct(names):
    if len(set(names)) == len(names):
        return names
    return [f"{name} ({number})" for number, name in enumerate(names, start=1)]
