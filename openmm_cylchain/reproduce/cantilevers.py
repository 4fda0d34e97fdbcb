"""Fig. 8 of Chandran and Mofrad 2009: cantilevers bent by a force at the end or by their weight, and a ruler.

The tables that the paper compares with are solutions of Euler's elastica, which is solved here once more:
a theta'' = -(F + w (L - s)) cos(theta), theta(0) = 0, theta'(L) = 0.
"""

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


def bent_cantilevers(end_loads, weights, length_micrometers, segments, steps, step):
    """Cantilevers without noise, after a number of steps.

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
    _, system, positions = filaments.build()
    pull = openmm.CustomExternalForce("-force*y")
    pull.addPerParticleParameter("force")
    unit_load = ACTIN.rigidity / length**2
    for nodes, end_load, weight in zip(filaments.node_indices, end_loads, weights):
        # Half of a segment's weight acts on each of its ends.
        shares = np.full(segments, weight / segments)
        shares[-1] = end_load + 0.5 * weight / segments
        for node, share in zip(nodes[2:], shares):
            pull.addParticle(int(node), [share * unit_load])
    system.addForce(pull)
    context = simulation.start(filaments, step, 1, system, positions)
    late, last = (nodes / length for nodes in simulation.frames(context, len(end_loads), [steps - steps // 10, steps]))
    return {"shapes": last[:, 1:, :2], "unrest": np.abs(last - late).max()}


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


def _measured(records, quick):
    loads = [(load, 0.0) for load in _END_LOADS] + [(0.0, weight) for weight in _WEIGHTS]
    loads += [_ruler_loads(name) for name in _RULER_LOADS]
    segments = _SEGMENTS[quick]
    friction = ACTIN.friction(_LENGTH / segments, segments + 1)
    relaxation = friction.perpendicular * segments / _LENGTH * (_LENGTH / 1.8751) ** 4 / ACTIN.rigidity
    data = records.measure(
        "figure-08",
        bent_cantilevers,
        end_loads=[load[0] for load in loads],
        weights=[load[1] for load in loads],
        length_micrometers=_LENGTH / MICROMETER,
        segments=segments,
        steps=round(_RELAXATION_TIMES * _STEPS_PER_RELAXATION),
        step=relaxation / _STEPS_PER_RELAXATION,
    )
    return loads, data


def _tip(shape):
    # Shortening, deflection and angle of the end, which has no curvature: the last segment points as the end does.
    return 1.0 - shape[-1, 0], shape[-1, 1], np.arctan2(*(shape[-1] - shape[-2])[::-1])


def evaluate(records, quick):
    """Fig. 8."""
    loads, data = _measured(records, quick)
    rule = Rule(3.0, _TOLERANCE[quick])
    results = []
    names = [f"end_load_{load:g}" for load in _END_LOADS] + [f"weight_{weight:g}" for weight in _WEIGHTS]
    for name, load, shape in zip(names, loads, data["shapes"]):
        exact, angle = elastica(*load, 2)
        theory = 1.0 - exact[-1, 0], exact[-1, 1], angle
        for quantity, ours, expected in zip(("shortening", "deflection", "angle"), _tip(shape), theory):
            unit = "rad" if quantity == "angle" else "L"
            results.append(Result(f"{quantity}_{name}", unit, Estimate(ours, None), rule, expected))
    for name, load, shape in zip(_RULER_LOADS, loads[len(names) :], data["shapes"][len(names) :]):
        exact, _ = elastica(*load, 2)
        for quantity, ours, expected in zip(
            ("shortening", "deflection"), _tip(shape), (1.0 - exact[-1, 0], exact[-1, 1])
        ):
            centimeters = 100.0 * _RULER["length"]
            estimate = Estimate(ours * centimeters, None)
            results.append(
                Result(f"ruler_{quantity}_loads_of_the_{name}", "cm", estimate, rule, expected * centimeters)
            )
    pictures = {
        "Cantilevers with a force at the end or under their weight": lambda figure: _draw_tips(figure, data["shapes"]),
        "A ruler under its weight and a force at its end": lambda figure: _draw_ruler(figure, data["shapes"][-2:]),
    }
    return Outcome(results, pictures, _remarks(data, quick))


def _remarks(data, quick):
    text, caption = _RULER_LOADS["text"], _RULER_LOADS["caption"]
    millimeters = 1e3 * caption[0] * (0.1 * _RULER["length"]) ** 3 / (3.0 * _RULER["rigidity"])
    return (
        f"Filaments of {_LENGTH / MICROMETER:g} µm in {_SEGMENTS[quick]} segments without noise, with loads in units "
        f"of EI/L² and EI/L³, which alone matter, until no node moves by more than {data['unrest']:.1g} L. The theory "
        "is Euler's elastica, solved numerically: the published tables that the paper compares with are solutions of "
        "it. The shape of the chain tends to it with the square of the number of segments.\n\n"
        f"The ruler of {100 * _RULER['length']:g} cm and {_RULER['rigidity']} N m² carries {text[0]} N at its end and "
        f"weighs {text[1]} N in the text of the paper; in the caption of its figure it carries {caption[0]} N, weighs "
        f"{caption[1]} N and is 3 cm long, which must be misprinted: its end would move by {millimeters:.2g} mm. "
        f"Ours are both pairs of loads on {100 * _RULER['length']:g} cm."
    )


def _draw_tips(figure, shapes):
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
            axis.plot(loads, tips[:, column], marker, color=colour, markersize=5, label=f"ours, {name}")
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
