"""Where the filaments of a configuration begin, and its linkers."""

import numpy as np

from ..filaments import shapes
from ..systems.filaments import Filaments
from ..theory import chain_mean_square_end_to_end


def place_filaments(solvent, groups, box, linkers, engine, seed):
    """Filaments with their initial positions, and linkers.

    Filaments without a position are laid out side by side on a grid in the xy plane, centred on the origin, for the eye
    and for the digits of the single-precision trajectory. In a periodic box, their middles are at random places in it,
    and those that begin straight without a direction have random ones.

    Parameters
    ----------
    solvent : Solvent
    groups : sequence of FilamentGroup
    box : (3,) tuple or None
        Edges of a periodic box in nm.
    linkers : sequence of LinkerGroup
    engine : {"compiled", "portable"} or None
    seed : int

    Returns
    -------
    Filaments
    """
    filaments = Filaments(solvent.viscosity, solvent.temperature, engine)
    centers = _grid_centers(groups, solvent.temperature) if box is None else None
    for group in groups:
        for _ in range(group.count):
            number = len(filaments)
            places = None if box is None else np.random.default_rng([seed, number, 1])
            nodes = _shape(group, solvent.temperature, seed, number, places)
            if group.position is not None:
                nodes += group.position
            else:
                nodes += (next(centers) if box is None else places.uniform(0.0, box)) - nodes.mean(axis=0)
            filaments.add_nodes(group.type, nodes, group.clamped)
    for own in linkers:
        anchors = None if own.anchors is None else np.array(own.anchors)
        filaments.add_linkers(
            own.kind,
            own.count,
            concentration=own.concentration,
            volume=own.volume,
            anchors=anchors,
            bound=own.bound,
            seed=seed,
        )
    return filaments


def recommended_step_of_network(solvent, groups, box, linkers, engine, scheme):
    """The TimeStep that is recommended for filaments with linkers; arguments as for ``place_filaments``."""
    filaments = place_filaments(solvent, groups, box, linkers, engine, 1)
    _, system, _ = filaments.build(box_vectors(box))
    return filaments.recommended_time_step(scheme, system=system)


def box_vectors(box):
    """Vectors of a rectangular periodic box with three edges, or None if there is none."""
    return None if box is None else np.diag(box)


def _shape(group, temperature, seed, number, places):
    # Nodes with the first one at the origin. Each filament has a seed of its own.
    kind, origin, label = group.type, (0.0, 0.0, 0.0), f"Filament {number}"
    if group.start == "straight":
        direction = group.direction
        if direction is None:
            direction = (1.0, 0.0, 0.0) if places is None else places.normal(size=3)
        return shapes.straight(kind, group.segments, origin, direction, label)
    generator = np.random.default_rng([seed, number])
    return shapes.drawn(
        kind, group.segments, temperature, generator, origin, group.direction, group.clamped, False, label
    )


def _grid_centers(groups, temperature):
    groups = [group for group in groups if group.position is None]
    count = sum(group.count for group in groups)
    spacing = 1.1 * max((_extent(group, temperature) for group in groups), default=0.0)
    columns = int(np.ceil(np.sqrt(count)))
    rows = int(np.ceil(count / max(columns, 1)))
    for number in range(count):
        row, column = divmod(number, columns)
        yield spacing * np.array([column - 0.5 * (columns - 1), 0.5 * (rows - 1) - row, 0.0])


def _extent(group, temperature):
    if group.start == "straight":
        return group.segments * group.type.segment_length
    return np.sqrt(chain_mean_square_end_to_end(group.type, group.segments, temperature))
