"""A run as a GSD file for OVITO: nodes, bound hands and particles with radii, segments and springs as bonds."""

from pathlib import Path

import numpy as np
import scipy

from ..analysis.runs import Run
from ..errors import InputError
from ..mechanics.geometry import segment_vectors
from ..output.files import check_path
from .drawn import spring_labels, thickness, visible_diameter, walls

_ANGSTROM = 10.0  # in a nm
_UPRIGHT = np.array([1.0, 0.0, 0.0, 0.0])
_NO_BONDS = np.zeros((0, 2), dtype=int)


def write_ovito(run: Run, path: str | Path) -> None:
    """Write all frames of a run for OVITO, in angstrom.

    Particles are the nodes of filaments, the hands of linkers that are bound and the ends of crosslinks, with the names
    of their types and radii; bonds are segments and springs, so that their number changes from frame to frame. Beam
    elements are drawn by points of their curve. Particles beside filaments have their name and radius. Lines on
    walls are particles and bonds of the type "wall". ``time_ps`` is an attribute of each frame, beside its step.
    Without a periodic box, the cell is three times as wide as what it holds. Nodes of filaments with twist have
    orientations: z is along the segment behind a node, before it at the last one, and x turns with the material.

    Parameters
    ----------
    run : Run
        See ``analysis.load``.
    path : str or Path
        Ends in ``.gsd``.

    Raises
    ------
    InputError
        If the package gsd is not installed.
    """
    path = check_path(path, ".gsd")
    try:
        import gsd.hoomd
    except ImportError:
        raise InputError("Files for OVITO need the package gsd: install it by pip install gsd.") from None
    names = list(dict.fromkeys(own.label for own in run.filaments))
    springs = spring_labels(run)
    hands = [f"{name} hand" for name in springs]
    particle_names = list(dict.fromkeys(own.name for own in run.particles))
    wall_points, wall_bonds = _joined(walls(run))
    walls_there = ["wall"] if len(wall_points) else []
    first_particle = len(names) + len(hands) + len(walls_there)
    center, cell = _cell(run)
    known: list[int] | None = None
    temporary = path.with_name(f".{path.stem}.new.gsd")
    try:
        with gsd.hoomd.open(str(temporary), mode="w") as file:
            for frame in range(len(run)):
                curves = run.curves(frame)
                counts = [len(points) for points in curves]
                if counts != known:
                    # Those of filaments that grow change.
                    known, (segments, kinds, types, diameters) = counts, _along_filaments(run, names, counts)
                positions, bonds = [np.zeros((0, 3)), *curves], [segments]
                particle_types, bond_types, widths = [types], [kinds], [diameters]
                count = len(types)
                for kind in range(len(springs)):
                    lines, places = run.springs(frame, kind)
                    # Ends of springs are particles of their own, at the places of hands or anchors.
                    ends = np.concatenate([lines.reshape(-1, 3), places])
                    positions.append(ends)
                    bonds.append(count + np.arange(2 * len(lines)).reshape(-1, 2))
                    particle_types.append(np.full(len(ends), len(names) + kind))
                    bond_types.append(np.full(len(lines), len(names) + kind))
                    widths.append(np.full(len(ends), 1.2 * thickness(run)))
                    count += len(ends)
                if walls_there:
                    positions.append(wall_points)
                    bonds.append(count + wall_bonds)
                    particle_types.append(np.full(len(wall_points), len(names) + len(hands)))
                    bond_types.append(np.full(len(wall_bonds), len(names) + len(springs)))
                    widths.append(np.full(len(wall_points), 0.2 * thickness(run)))
                    count += len(wall_points)
                for own in run.particles:
                    positions.append(run.positions(frame)[own.indices])
                    particle_types.append(np.full(len(own.indices), first_particle + particle_names.index(own.name)))
                    widths.append(np.full(len(own.indices), visible_diameter(run, own)))
                    count += len(own.indices)
                snapshot = gsd.hoomd.Frame()
                snapshot.configuration.step = int(run.steps[frame])
                snapshot.configuration.box = _ANGSTROM * cell
                snapshot.particles.N = count
                snapshot.particles.types = names + hands + walls_there + particle_names
                snapshot.particles.typeid = np.concatenate(particle_types)
                snapshot.particles.position = _ANGSTROM * (np.concatenate(positions) - center)
                snapshot.particles.diameter = _ANGSTROM * np.concatenate(widths)
                if any(len(own) for own in run.twists(frame)):
                    snapshot.particles.orientation = np.concatenate(
                        [*_orientations(run, frame), np.tile(_UPRIGHT, (count - len(types), 1))]
                    )
                snapshot.bonds.N = sum(len(own) for own in bonds)
                snapshot.bonds.types = names + springs + walls_there
                snapshot.bonds.group = np.concatenate(bonds)
                snapshot.bonds.typeid = np.concatenate(bond_types)
                snapshot.log["time_ps"] = np.array([run.times[frame]])
                file.append(snapshot)
        temporary.replace(path)
    finally:
        temporary.unlink(missing_ok=True)


def _orientations(run, frame):
    # Quaternions (w, x, y, z) of the points of each filament.
    for own, points, across in zip(run.filaments, run.curves(frame), run.material_frames(frame)):
        if not len(across):
            yield np.tile(_UPRIGHT, (len(points), 1))
            continue
        along = segment_vectors(points, own.ring)
        along = along / np.linalg.norm(along, axis=1, keepdims=True)
        axes = np.stack([across, np.cross(along, across), along], axis=2)
        found = scipy.spatial.transform.Rotation.from_matrix(axes).as_quat()[:, [3, 0, 1, 2]]
        yield found if own.ring else np.vstack([found, found[-1:]])


def _joined(lines):
    # Points of all lines, and pairs of neighbours.
    bonds, count = [], 0
    for line in lines:
        first = count + np.arange(len(line) - 1)
        bonds.append(np.stack([first, first + 1], axis=1))
        count += len(line)
    return np.concatenate([np.zeros((0, 3)), *lines]), np.concatenate([_NO_BONDS, *bonds])


def _along_filaments(run, names, counts):
    # Bonds between points that are neighbours on a filament, counted along all of them, with their types; types and
    # diameters of points.
    bonds, bond_types, first = [], [], 0
    for own, count in zip(run.filaments, counts):
        points = first + np.arange(count)
        bonds.append(np.stack([points, np.roll(points, -1)], axis=1)[: max(0, count - (not own.ring))])
        bond_types.append(np.full(len(bonds[-1]), names.index(own.label)))
        first += count
    kinds = np.array([names.index(own.label) for own in run.filaments], dtype=int)
    diameters = np.array([own.diameter for own in run.filaments], dtype=float)
    counts = np.array(counts, dtype=int)
    return (
        np.concatenate([_NO_BONDS, *bonds]),
        np.concatenate([_NO_BONDS[:, 0], *bond_types]),
        np.repeat(kinds, counts),
        np.repeat(diameters, counts),
    )


def _cell(run):
    # HOOMD's box: edges and tilts; its middle is the origin.
    if run.box is not None:
        (a, _, _), (xy, b, _), (xz, yz, c) = run.box
        return 0.5 * run.box.sum(axis=0), np.array([a, b, c, xy / b, xz / c, yz / c]) * [1, 1, 1, 0.1, 0.1, 0.1]
    points = np.concatenate([run.points(frame) for frame in range(len(run))])
    lower, upper = points.min(axis=0), points.max(axis=0)
    edge = 3.0 * float(np.max(upper - lower)) + 1.0
    return 0.5 * (lower + upper), np.array([edge, edge, edge, 0.0, 0.0, 0.0])
