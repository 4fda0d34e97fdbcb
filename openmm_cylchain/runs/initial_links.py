"""Links of a configuration where filaments begin: all of one model at once, since there may be millions."""

import numpy as np
import scipy

from ..beams.curve import element_points
from ..couplings.crosslink_tables import CrosslinkTable
from ..couplings.crosslinks import Crosslinks
from ..couplings.link_places import LinkPlaces, as_places
from ..errors import InputError
from ..filaments.attachments import attachment_positions, lengths_along, places_along
from .initial_bodies import holding_links

_MOST_PLACES, _MOST_PAIRS = 10**7, 3 * 10**7
"""On filaments, and of places that are near enough, to draw random links from."""
_MOST_LINKS = 10**6
"""Where there is no count: more are likely meant to be fewer."""


def add_links(configuration, filaments, system, seed):
    """Add the links of a configuration to a System with its filaments, and return how many there are.

    One force for each model, with links in the order of the file.
    """
    count = 0
    for model in ("harmonic", "fene"):
        groups = [(number, own) for number, own in enumerate(configuration.links) if own.model == model]
        held = holding_links(configuration, filaments) if model == "harmonic" else []
        if not groups and not held:
            continue
        if groups:
            _, first = groups[0]
            links = Crosslinks(first.stiffness, first.rest_length or 0.0, model, first.maximum_extension)
        else:
            links = Crosslinks(held[0][1][0], 0.0)
        table = _table(configuration, groups, held, filaments, seed)
        links.set_table(None, table)
        links.add_to(system)
        count += len(table)
    return count


def _table(configuration, groups, held, filaments, seed):
    parts = []
    for number, own in groups:
        with configuration.tables["link"][number].naming():
            places, distances = _places(own, filaments, configuration.box, np.random.default_rng([seed, number, 5]))
            rests = distances if own.rest_length is None else np.full(len(distances), own.rest_length)
            places.check(np.arange(len(places)), None)
            _refuse_torn(own, distances, rests)
        extension = np.inf if own.maximum_extension is None else own.maximum_extension
        parts.append((places, rests, np.full(len(rests), own.stiffness), np.full(len(rests), extension)))
    # Behind those of the file.
    for places, stiffness, rests in held:
        places.check(np.arange(len(places)), None)
        parts.append((places, rests, stiffness, np.full(len(rests), np.inf)))
    places, *columns = zip(*parts)
    pairs, partners, fractions, points = (
        np.concatenate([getattr(one, name) for one in places]) for name in ("pairs", "partners", "fractions", "points")
    )
    rests, stiffness, extensions = map(np.concatenate, columns)
    numbers = np.arange(len(pairs))
    active = _are_there(filaments, pairs)
    return CrosslinkTable(numbers, pairs, stiffness, rests, extensions, len(pairs), partners, fractions, points, active)


def _are_there(filaments, pairs):
    # Which links are on no filament that is not there.
    absent = [nodes for own, nodes in zip(filaments, filaments.node_indices) if not own.takes_part]
    return ~np.isin(pairs, np.concatenate(absent)).any(axis=1) if absent else np.ones(len(pairs), bool)


def _refuse_torn(own, distances, rests):
    if own.maximum_extension is None:
        return
    torn = np.flatnonzero(np.abs(distances - rests) >= own.maximum_extension)
    if len(torn):
        raise InputError(
            f"begins with a length of {distances[torn[0]]:g} nm, but its FENE spring of {rests[torn[0]]:g} nm becomes "
            f"longer or shorter by less than {own.maximum_extension:g} nm: move what it joins, or change rest_length "
            "or maximum_extension."
        )


def _places(own, filaments, box, generator):
    # LinkPlaces and their distances in nm.
    if own.between is None:
        return _random_places(own, filaments, box, generator)
    places, points = zip(*(_place(entries, filaments) for entries in own.between))
    return as_places([places]), np.linalg.norm([_nearest(points[1] - points[0], box)], axis=1)


def _nearest(vectors, box):
    return vectors if box is None else vectors - np.round(vectors / box) * box


def _place(entries, filaments):
    if entries["body"] is not None:
        number, point = entries["body"], entries["body_point"]
        return int(filaments.body_indices[number][point]), filaments.bodies[number].positions[point]
    if entries["point"] is not None:
        return entries["point"], np.array(entries["point"])
    number, nodes = entries["filament"], filaments[entries["filament"]].positions
    if entries["node"] is not None:
        return int(filaments.node_indices[number][entries["node"]]), nodes[entries["node"]]
    place = filaments.segment_place(number, entries["arc_length"], entries["segment"], entries["fraction"])
    return place, _position_of(place, filaments, number)


def _position_of(place, filaments, number):
    first, own = filaments.node_indices[number][0], filaments[number]
    nodes = own.positions
    if own.control_points is not None:
        element = np.array([place.first, place.second]) - first
        return element_points(nodes[element], own.control_points[element], [place.fraction])[0, 0]
    return (1.0 - place.fraction) * nodes[place.first - first] + place.fraction * nodes[place.second - first]


def _random_places(own, filaments, box, generator):
    if box is not None and own.within >= 0.5 * min(box):
        raise InputError(f"within must be less than half of the shortest edge of the box, {min(box):g} nm.")
    _refuse_many_places(own, filaments)
    firsts, seconds, fractions, points, owners = zip(
        *(_places_on(number, own.spacing, filaments) for number in range(len(filaments)))
    )
    ends = np.stack([np.concatenate(firsts), np.concatenate(seconds)], axis=1)
    fractions, points, owners = map(np.concatenate, (fractions, points, owners))
    found = _pairs_within(own.within, points, owners, box)
    if own.count is None and len(found) > _MOST_LINKS:
        raise InputError(
            f"within is {own.within:g} nm, which makes {len(found):.2g} links: give a count of those that are meant."
        )
    if own.count is not None and len(found) > own.count:
        found = found[np.sort(generator.choice(len(found), own.count, replace=False))]
    distances = np.linalg.norm(_nearest(points[found[:, 1]] - points[found[:, 0]], box), axis=1)
    return LinkPlaces(ends[found][..., 0], ends[found][..., 1], fractions[found]), distances


def _refuse_many_places(own, filaments):
    count = sum(_parts(filament, own.spacing)[0] for filament in filaments)
    if count > _MOST_PLACES:
        raise InputError(
            f"spacing makes {count:.2g} places on filaments: there can be {_MOST_PLACES:.0e}. Take a larger one."
        )


def _parts(filament, spacing):
    # Into how many equal parts places in their middles divide a filament, so that ends have no more links than others.
    length = float(lengths_along(filament.type, filament.segments, filament.closed).sum())
    spacing = 0.5 * filament.type.segment_length if spacing is None else spacing
    return max(1, int(length / spacing + 1e-9)), length


def _places_on(number, spacing, filaments):
    # Of each place on a filament: the particles of its segment, the fraction, the point, and the filament.
    filament, nodes = filaments[number], np.asarray(filaments.node_indices[number])
    parts, length = _parts(filament, spacing)
    segments, fractions = places_along(filament, length * (np.arange(parts) + 0.5) / parts)
    points = attachment_positions(segments, fractions, filament.positions, filament.control_points)
    return nodes[segments], nodes[(segments + 1) % len(nodes)], fractions, points, np.full(parts, number)


def _pairs_within(distance, points, owners, box):
    # Pairs of places on different filaments, in order.
    wrapped = points if box is None else np.mod(points, box) % box
    tree = scipy.spatial.cKDTree(wrapped, boxsize=box)
    # In both orders, and of each place with itself.
    count = (tree.count_neighbors(tree, distance) - len(points)) // 2
    if count > _MOST_PAIRS:
        raise InputError(
            f"within is {distance:g} nm, where {count:.2g} pairs of the {len(points)} places on filaments are: there "
            f"can be {_MOST_PAIRS:.0e} to draw links from. Take a smaller one, or a larger spacing of places."
        )
    first, second = tree.query_pairs(distance, output_type="ndarray").T
    others = owners[first] != owners[second]
    # Sorted as single numbers, which is much faster than in columns.
    return np.stack(np.divmod(np.sort(first[others] * len(points) + second[others]), len(points)), axis=1)
