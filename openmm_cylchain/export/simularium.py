"""A run as a Simularium file (JSON): filaments, linkers, crosslinks and walls as fibers, hands and
particles as spheres."""

import json
from pathlib import Path
from typing import Any

import numpy as np

from ..analysis.runs import Run
from ..mechanics.geometry import unrolled
from ..output.files import check_path, write_atomically
from ..rendering.colors import WALL_COLOR, filament_colors, linker_colors, particle_colors
from ..units.text import time_unit
from ..version import __version__
from .drawn import spring_labels, thickness, visible_diameter, walls

_SPHERE, _FIBER = 1000.0, 1001.0


def write_simularium(run: Run, path: str | Path) -> None:
    """Write all frames of a run for the Simularium viewer, https://simularium.allencell.org.

    The format is version 3 of the trajectory, version 1 of its frames, https://github.com/simularium. Lengths are in
    nm, about the middle of the box; times are in the unit of the last frame. A filament keeps its number from frame to
    frame, linkers do not. A ring goes on to its first node; beam elements are drawn by points of their curve. Lines on
    walls are fibers of the type "wall".

    Parameters
    ----------
    run : Run
        See ``analysis.load``.
    path : str or Path
        Ends in ``.simularium``.
    """
    path = check_path(path, ".simularium")
    name, length = time_unit(float(run.times[-1]) if run.times[-1] > 0 else run.time_step)
    types, mapping = _types(run)
    outlines = walls(run)
    center, size = _box(run, outlines)
    content = {
        "trajectoryInfo": {
            "version": 3,
            "timeUnits": {"magnitude": 1.0, "name": {"us": "µs"}.get(name, name)},
            "timeStepSize": float(run.times[1] - run.times[0]) / length if len(run) > 1 else 0.0,
            "totalSteps": len(run),
            "spatialUnits": {"magnitude": 1.0, "name": "nm"},
            "size": dict(zip("xyz", map(float, size))),
            "cameraDefault": {
                "position": {"x": 0.0, "y": 0.0, "z": 1.6 * float(max(size))},
                "lookAtPosition": {"x": 0.0, "y": 0.0, "z": 0.0},
                "upVector": {"x": 0.0, "y": 1.0, "z": 0.0},
                "fovDegrees": 50.0,
            },
            "typeMapping": mapping,
            "trajectoryTitle": run.title or run.path.name,
            "modelInfo": {"title": run.title or run.path.name, "version": f"openmm-cylchain {__version__}"},
        },
        "spatialData": {
            "version": 1,
            "msgType": 1,
            "bundleStart": 0,
            "bundleSize": len(run),
            "bundleData": [
                {
                    "frameNumber": frame,
                    "time": float(run.times[frame]) / length,
                    "data": _agents(run, frame, types, center, outlines),
                }
                for frame in range(len(run))
            ],
        },
        "plotData": {"version": 1, "data": []},
    }
    write_atomically(path, json.dumps(content, allow_nan=False, separators=(",", ":")).encode())


def _types(run):
    # Numbers of types of agents, by what they are.
    numbers: dict[tuple[str, str | int], int] = {}
    mapping: dict[str, Any] = {}
    agents: list[tuple[tuple[str, str | int], str, str, str]] = [
        (("filament", name), name, "FIBER", color) for name, color in filament_colors(run).items()
    ]
    for kind, (label, color) in enumerate(zip(spring_labels(run), linker_colors(run))):
        agents.append((("linker", kind), label, "FIBER", color))
        agents.append((("hand", kind), f"{label}#hand", "SPHERE", color))
    agents += [(("particle", name), name, "SPHERE", color) for name, color in particle_colors(run).items()]
    if run.walls:
        agents.append((("wall", 0), "wall", "FIBER", WALL_COLOR))
    for number, (key, label, shape, color) in enumerate(agents):
        numbers[key] = number
        mapping[str(number)] = {"name": label, "geometry": {"displayType": shape, "url": "", "color": color}}
    return numbers, mapping


def _box(run, outlines):
    if run.box is not None:
        return 0.5 * run.box.sum(axis=0), np.abs(run.box).sum(axis=0)
    frames = [run.points(frame) for frame in np.unique(np.linspace(0, len(run) - 1, 20).astype(int))]
    points = np.concatenate([*frames, *outlines])
    lower, upper = points.min(axis=0), points.max(axis=0)
    return 0.5 * (lower + upper), 1.1 * (upper - lower) + thickness(run)


def _agents(run, frame, types, center, outlines):
    data: list[float] = []
    for number, (own, points) in enumerate(zip(run.filaments, run.curves(frame))):
        if not len(points):
            continue
        points = unrolled(points) if own.ring else points
        data += _agent(_FIBER, number, types["filament", own.label], 0.5 * own.diameter, points - center)
    number = len(run.filaments)
    for own in run.particles:
        for position in run.positions(frame)[own.indices] if len(own.indices) else ():
            data += _agent(
                _SPHERE,
                number,
                types["particle", own.name],
                0.5 * visible_diameter(run, own),
                np.zeros((0, 3)),
                position - center,
            )
            number += 1
    radius = 0.5 * thickness(run)
    for kind in range(len(run.spring_names)):
        lines, hands = run.springs(frame, kind)
        for line in lines:
            data += _agent(_FIBER, number, types["linker", kind], 0.5 * radius, line - center)
            number += 1
        for hand in hands:
            data += _agent(_SPHERE, number, types["hand", kind], 1.2 * radius, np.zeros((0, 3)), hand - center)
            number += 1
    for line in outlines:
        data += _agent(_FIBER, number, types["wall", 0], 0.2 * radius, line - center)
        number += 1
    return data


def _agent(shape, number, kind, radius, points, position=(0.0, 0.0, 0.0)):
    # Digits that a viewer shows.
    numbers = np.round(points, 4).ravel().tolist()
    place = np.round(position, 4).tolist()
    return [shape, float(number), float(kind), *place, 0.0, 0.0, 0.0, radius, float(len(numbers)), *numbers]
