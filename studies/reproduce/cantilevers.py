"""Fig. 8 of Chandran and Mofrad 2009: cantilevers bent by a force at the end or by their weight, and a ruler.

The tables that the paper compares with are solutions of Euler's elastica, which is solved here once more:
a theta'' = -(F + w (L - s)) cos(theta), theta(0) = 0, theta'(L) = 0. Cantilevers are of straight segments, and of few
beam elements, which bend inside as those of the paper do.
"""

import math

import numpy as np
import openmm
from scipy.integrate import solve_bvp

from . import rods_on_string, simulation, style
from .case import Case, Outcome
from .result import Estimate, Result, Rule
from .rods_on_string import ACTIN, MICROMETER

_LENGTH = 5.0 * MICROMETER
_SEGMENTS = {True: 20, False: 40}
_END_LOADS = (0.5, 1.0, 2.0, 3.0, 5.0, 7.0, 10.0)
_WEIGHTS = (1.0, 2.0, 4.0, 8.0, 12.0, 16.0, 24.0)
_RULER = {"length": 0.3, "rigidity": 0.24}
"""In m and N m^2."""
_RULER_LOADS = {"text": (3.92, 0.554), "caption": (0.394, 0.224)}
"""The force at the end and the weight in N."""
_RELAXATION_TIMES = 25.0
_STEPS_PER_RELAXATION = 40.0
_TOLERANCE = {True: 0.006, False: 0.0015}
"""The deflection of a chain of n segments is off by a share of 1/(2 n^2) for small loads, by more for large."""
_BEAM_TOLERANCE = 0.0015
_ELEMENTS = {1: (1.0, 0.0), 2: (10.0, 4.0), 4: (math.inf, math.inf)}
"""Numbers of beam elements, each with the largest P L^2/EI and w L^3/EI that it is taken for."""


def bent_cantilevers(end_loads, weights, length_micrometers, segments, steps, step):
    """Cantilevers of straight segments without noise, after a number of steps.

    Parameters
    ----------
    end_loads, weights : list of float
        P L^2/EI and w L^3/EI of each, with the force P at the end and the weight w per length.
    length_micrometers : float
        Of the part beyond the clamp.
    segments : int
        Of that part.
    steps : int
    step : float
        In ps.

    Returns
    -------
    dict of arrays
        ``shapes`` (cantilevers, segments + 1, 2) over the length, from the clamp, and ``unrest``, the largest share of
        the length by which a node has moved in the last tenth of the steps.
    """
    column = rods_on_string.SIMULATED_ACTIN
    length = length_micrometers * MICROMETER
    kind = column.filament_type(length / segments)
    filaments = column.solvent(temperature=0.0)
    for _ in end_loads:
        filaments.add_straight(kind, segments + 1, [-length / segments, 0, 0], [1, 0, 0], clamped=[0, 1])
    loads = []
    for end_load, weight in zip(end_loads, weights):
        # Half of a segment's weight acts on each of its ends.
        shares = np.full(segments, weight / segments)
        shares[-1] = end_load + 0.5 * weight / segments
        loads.append([0.0, 0.0, *shares])
    late, last = (nodes / length for nodes in _bent(filaments, loads, length, steps, step))
    return {"shapes": last[:, 1:, :2], "unrest": np.abs(last - late).max()}


def bent_beams(end_loads, weights, length_micrometers, elements, steps, step):
    """Cantilevers of beam elements; see ``bent_cantilevers``.

    Returns
    -------
    dict of arrays
        ``nodes`` and ``control_points`` (cantilevers, elements + 1, 2) over the length, and ``unrest``.
    """
    column = rods_on_string.SIMULATED_ACTIN
    length = length_micrometers * MICROMETER
    kind = column.filament_type(length / elements, element="beam")
    filaments = column.solvent(temperature=0.0)
    for _ in end_loads:
        filaments.add_straight(kind, elements, [0, 0, 0], [1, 0, 0], clamped=0, clamped_tangents=0)
    loads = []
    for end_load, weight in zip(end_loads, weights):
        # A load q per length does the work of q h/2 on each node of an element, and of q h/4 and -q h/4 on its vectors
        # from nodes to control points: these are left at the two ends of the filament alone.
        nodes, control_points = np.full(elements + 1, weight / elements), np.zeros(elements + 1)
        nodes[[0, -1]] *= 0.25, 0.75
        control_points[[0, -1]] = 0.25 * weight / elements, -0.25 * weight / elements
        nodes[-1] += end_load
        loads.append([*nodes, *control_points])
    late, last = (points / length for points in _bent(filaments, loads, length, steps, step))
    nodes, control_points = np.split(last[..., :2], 2, axis=1)
    return {"nodes": nodes, "control_points": control_points, "unrest": np.abs(last - late).max()}


def _bent(filaments, loads, length, steps, step):
    # Particles (cantilevers, particles, 3) in nm after nine tenths of the steps and after all; loads are over EI/L^2.
    _, system, positions = filaments.build()
    pull = openmm.CustomExternalForce("-force*y")
    pull.addPerParticleParameter("force")
    unit_load = ACTIN.rigidity / length**2
    for particle, share in enumerate(np.ravel(loads)):
        if share:
            pull.addParticle(particle, [share * unit_load])
    system.addForce(pull)
    context = simulation.start(filaments, step, 1, system, positions)
    return list(simulation.frames(context, len(loads), [steps - steps // 10, steps]))


def elastica(end_load, weight, points):
    """Shape (points, 2) over the length, and the angle at the end, of Euler's elastica.

    Parameters
    ----------
    end_load, weight : float
        P L^2/EI and w L^3/EI.
    points : int
        Evenly spaced along it, both ends included.
    """

    def slope(s, y):
        angle, curvature = y[0], y[1]
        return np.array([curvature, -(end_load + weight * (1.0 - s)) * np.cos(angle), np.cos(angle), np.sin(angle)])

    def ends(start, end):
        return np.array([start[0], end[1], start[2], start[3]])

    s = np.linspace(0.0, 1.0, 200)
    solution = solve_bvp(slope, ends, s, np.vstack([0 * s, 0 * s, s, 0 * s]), tol=1e-9, max_nodes=100000)
    return solution.sol(np.linspace(0.0, 1.0, points))[2:].T, float(solution.sol(1.0)[0])


def _ruler_loads(name):
    unit_load = _RULER["rigidity"] / _RULER["length"] ** 2
    return tuple(load / unit_load for load in _RULER_LOADS[name])


def _loads():
    loads = [(load, 0.0) for load in _END_LOADS] + [(0.0, weight) for weight in _WEIGHTS]
    return loads + [_ruler_loads(name) for name in _RULER_LOADS]


def _settings(segments):
    loads = _loads()
    friction = ACTIN.friction(_LENGTH / segments, segments + 1)
    relaxation = friction.perpendicular * segments / _LENGTH * (_LENGTH / 1.8751) ** 4 / ACTIN.rigidity
    return {
        "end_loads": [load[0] for load in loads],
        "weights": [load[1] for load in loads],
        "length_micrometers": _LENGTH / MICROMETER,
        "steps": round(_RELAXATION_TIMES * _STEPS_PER_RELAXATION),
        "step": relaxation / _STEPS_PER_RELAXATION,
    }


def _tip(shape):
    # Shortening, deflection and angle of the end, which has no curvature: the last segment points as the end does.
    return 1.0 - shape[-1, 0], shape[-1, 1], np.arctan2(*(shape[-1] - shape[-2])[::-1])


def _beam_tips(records):
    # What _tip gives, (loads, 3) for each number of beam elements, and the largest unrest.
    tips, unrest = {}, 0.0
    for elements in _ELEMENTS:
        settings = _settings(_SEGMENTS[False])
        data = records.measure(f"figure-08-{elements}-beams", bent_beams, elements=elements, **settings)
        ends, control_points = data["nodes"][:, -1], data["control_points"][:, -1]
        x, y = (control_points - ends).T
        tips[elements] = np.stack([1.0 - ends[:, 0], ends[:, 1], np.arctan2(y, x)], axis=1)
        unrest = max(unrest, data["unrest"])
    return tips, unrest


def _elements_for(end_load, weight):
    return next(elements for elements, (most, heaviest) in _ELEMENTS.items() if end_load <= most and weight <= heaviest)


def _tip_results(tips, rule, suffix):
    names = [f"end_load_{load:g}" for load in _END_LOADS] + [f"weight_{weight:g}" for weight in _WEIGHTS]
    loads = _loads()
    for name, load, tip in zip(names, loads, tips):
        exact, angle = elastica(*load, 2)
        theory = 1.0 - exact[-1, 0], exact[-1, 1], angle
        for quantity, ours, expected in zip(("shortening", "deflection", "angle"), tip, theory):
            unit = "rad" if quantity == "angle" else "L"
            yield Result(f"{quantity}_{name}{suffix(*load)}", unit, Estimate(ours, None), rule, expected)
    scale = 100.0 * _RULER["length"]
    for name, load, tip in zip(_RULER_LOADS, loads[len(names) :], tips[len(names) :]):
        exact, _ = elastica(*load, 2)
        theory = 1.0 - exact[-1, 0], exact[-1, 1]
        for quantity, ours, expected in zip(("shortening", "deflection"), tip, theory):
            result = f"ruler_{quantity}_loads_of_the_{name}{suffix(*load)}"
            yield Result(result, "cm", Estimate(ours * scale, None), rule, expected * scale)


def _beam_suffix(end_load, weight):
    elements = _elements_for(end_load, weight)
    return f"_{elements}_beam_element{'s' if elements > 1 else ''}"


def evaluate(records, quick):
    """Fig. 8."""
    segments = _SEGMENTS[quick]
    data = records.measure("figure-08", bent_cantilevers, segments=segments, **_settings(segments))
    beams, unrest = _beam_tips(records)
    chosen = [beams[_elements_for(*load)][number] for number, load in enumerate(_loads())]
    results = [
        *_tip_results([_tip(shape) for shape in data["shapes"]], Rule(3.0, _TOLERANCE[quick]), lambda *load: ""),
        *_tip_results(chosen, Rule(3.0, _BEAM_TOLERANCE), _beam_suffix),
    ]
    pictures = {
        "Cantilevers with a force at the end or under their weight": lambda figure: _draw_tips(
            figure, data["shapes"], chosen
        ),
        "A ruler under its weight and a force at its end": lambda figure: _draw_ruler(figure, data["shapes"][-2:]),
    }
    return Outcome(results, pictures, _remarks(max(data["unrest"], unrest), quick))


def _remarks(unrest, quick):
    text, caption = _RULER_LOADS["text"], _RULER_LOADS["caption"]
    millimeters = 1e3 * caption[0] * (0.1 * _RULER["length"]) ** 3 / (3.0 * _RULER["rigidity"])
    return (
        f"Filaments of {_LENGTH / MICROMETER:g} µm in {_SEGMENTS[quick]} segments without noise, with loads in units "
        f"of EI/L² and EI/L³, which alone matter, until no node moves by more than {unrest:.1g} L. The theory "
        "is Euler's elastica, solved numerically: the published tables that the paper compares with are solutions of "
        "it. The shape of the chain tends to it with the square of the number of segments. Beam elements are within "
        f"{100 * _BEAM_TOLERANCE:g} % of it, one under end loads of at most 1, two under others and under weights of "
        "at most 4, and four under heavier ones, which turn the filament most next to its clamp.\n\n"
        f"The ruler of {100 * _RULER['length']:g} cm and {_RULER['rigidity']} N m² carries {text[0]} N at its end and "
        f"weighs {text[1]} N in the text of the paper; in the caption of its figure it carries {caption[0]} N, weighs "
        f"{caption[1]} N and is 3 cm long, which must be misprinted: its end would move by {millimeters:.2g} mm. "
        f"Ours are both pairs of loads on {100 * _RULER['length']:g} cm."
    )


def _draw_tips(figure, shapes, beams):
    figure.set_size_inches(9.0, 4.0)
    panels = figure.subplots(1, 2, sharey=True)
    for axis, loads, first, label in (
        (panels[0], _END_LOADS, 0, r"end load $PL^2/EI$"),
        (panels[1], _WEIGHTS, len(_END_LOADS), r"weight $wL^3/EI$"),
    ):
        fine = np.linspace(0.0, 1.05 * loads[-1], 40)
        curves = []
        for load in fine:
            shape, angle = elastica(*((load, 0.0) if first == 0 else (0.0, load)), 2)
            curves.append((1.0 - shape[-1, 0], shape[-1, 1], angle / (0.5 * np.pi)))
        tips = np.array([_tip(shape) for shape in shapes[first : first + len(loads)]]) / [1.0, 1.0, 0.5 * np.pi]
        names = (r"$-\Delta x/L$", r"$-\Delta y/L$", r"$2\Delta\theta/\pi$")
        for column, (name, colour, marker) in enumerate(zip(names, style.COLOURS, "os^")):
            axis.plot(fine, np.array(curves)[:, column], color=colour, linewidth=1)
            axis.plot(loads, tips[:, column], marker, color=colour, markersize=4, label=f"ours, {name}")
            own = np.array(beams[first : first + len(loads)]) / [1.0, 1.0, 0.5 * np.pi]
            axis.plot(loads, own[:, column], marker, color=colour, markersize=9, markerfacecolor="none")
        axis.plot([], [], "o", color="gray", markersize=9, markerfacecolor="none", label="few beam elements")
        axis.plot([], [], color="gray", linewidth=1, label="elastica")
        style.finish(axis, label, "" if first else "deflection of the end", xlim=(0, fine[-1]), ylim=(0, 1))


def _draw_ruler(figure, shapes):
    figure.set_size_inches(6.4, 3.8)
    axis = figure.subplots()
    scale = 100.0 * _RULER["length"]
    for name, shape, colour, marker in zip(_RULER_LOADS, shapes, style.COLOURS, "os"):
        force, weight = _RULER_LOADS[name]
        exact, _ = elastica(*_ruler_loads(name), 200)
        axis.plot(scale * exact[:, 0], -scale * exact[:, 1], color=colour, linewidth=1)
        label = f"ours, {force} N and {weight} N ({name})"
        axis.plot(scale * shape[:, 0], -scale * shape[:, 1], marker, color=colour, markersize=4, label=label)
    axis.plot([], [], color="gray", linewidth=1, label="elastica")
    style.finish(axis, "x (cm)", "y (cm)", aspect="equal", xlim=(0, scale + 1), ylim=(-0.55 * scale, 1.5))


CASES = (Case("figure-08", "Fig. 8: cantilevers under load", (8,), evaluate),)
