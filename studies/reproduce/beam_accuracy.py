"""Accuracy of beam elements and straight segments against the number of their unknowns.

Loads and lengths are those of ``cantilevers`` and ``chromosome``; exact values are those of a continuous filament.
"""

import math

import numpy as np
import openmm

from openmm_cylchain.theory import (
    chain_mean_square_end_to_end,
    clamped_angle_variance,
    clamped_deflection_variance,
    wlc_mean_square_end_to_end,
)

from . import beam_networks, cantilevers, chromosome, rods_on_string, simulation, style
from .beam_networks import Network
from .case import Case, Outcome
from .result import Estimate, Result, Rule
from .rods_on_string import ACTIN, CHROMOSOME, MICROMETER

TITLE = "Accuracy of beam elements against the number of unknowns"
CITATION = (
    "Filaments of elements that bend inside, beside those of straight segments. In a plane, a segment adds a node with "
    "two unknowns, and a beam element a node and a control point with four."
)
_UNKNOWNS = {"straight": 2, "beam": 4}
_NAMES = {"straight": "straight segments", "beam": "beam elements"}
_COUNTS = {"straight": (1, 2, 4, 8, 16, 32), "beam": (1, 2, 3, 4, 8)}
_COLUMN_COUNTS = {"straight": (1, 2, 4, 8, 16), "beam": (1, 2, 4)}
_FLUCTUATING = (1, 2, 3)
_LOADS = (1.0, 10.0)
_SHARES = (0.8, 0.85, 0.9)
"""Of the critical load that is looked for."""
_NUDGE = 1e-4
_ACTIN_LENGTH = 15.5 * MICROMETER
_DRAWN, _DRAWS = (2, 3, 6, 12), {True: 500, False: 8000}
_DRAWN_RULE = Rule(3.0, 0.003, 0.012)
_GROUPS = 20
_SEEDS = (1, 2)
_NETWORK_COUNTS = {
    "lattice": [*(("straight", n) for n in (1, 2, 4, 8)), *(("beam", n) for n in (1, 2, 3))],
    "random": [*(("straight", n) for n in (4, 8, 16, 32, 64)), *(("beam", n) for n in (2, 4, 8, 16))],
}
_NETWORK_TOLERANCES = {
    ("lattice", "beam", 1): 0.001,
    ("lattice", "beam", 2): 0.0005,
    ("lattice", "beam", 3): 0.0005,
    ("lattice", "straight", 8): 0.02,
    ("random", "beam", 16): 0.02,
    ("random", "straight", 64): 0.002,
}
_ON_NETWORKS = """Networks of actin in a plane without thermal motion, of which one line is moved along another that
is held, and the force that this takes, beside that of continuous filaments, whose linear equations
are solved exactly. Means over {networks} networks.

In a lattice of triangles, {present:g} % of whose spans are there, nodes are where filaments are
linked: numbers are those of elements, and unknowns, for each span. One beam element for each span
is enough, because a span that forces at its ends bend is a cubic curve. What is left is due to
tangents of one length on both sides of a link, where strains would jump. Straight segments bend at
their joints alone, and need more than eight.

{lattice}

Filaments that lie anywhere are linked anywhere, here to {spans:.1f} spans each on the average;
numbers, and unknowns, are those for each filament. With the same number of unknowns, straight
segments err less: shear forces jump at links, and no element has such a curve inside. Nodes belong
where filaments are linked.

{random}"""


def loaded_columns(loads, length_micrometers, segments, element, steps, step):
    """Columns that are clamped at the foot, without noise, with a force along them and a small one across, at the end.

    Parameters
    ----------
    loads : list of float
        P L^2/EI of the force along each.
    length_micrometers : float
    segments : int
    element : {"straight", "beam"}
    steps : int
    step : float
        In ps.

    Returns
    -------
    dict of arrays
        ``deflection`` (columns,) of the end over the length and over the force across by EI/L^2.
    """
    column = rods_on_string.SIMULATED_ACTIN
    length = length_micrometers * MICROMETER
    kind = column.filament_type(length / segments, element=element)
    filaments = column.solvent(temperature=0.0)
    for _ in loads:
        if element == "beam":
            filaments.add_straight(kind, segments, [0, 0, 0], [1, 0, 0], clamped=0, clamped_tangents=0, planar=True)
        else:
            start = [-length / segments, 0, 0]
            filaments.add_straight(kind, segments + 1, start, [1, 0, 0], clamped=[0, 1], planar=True)
    _, system, positions = filaments.build()
    push = openmm.CustomExternalForce("along*x-across*y")
    for name in ("along", "across"):
        push.addPerParticleParameter(name)
    unit_load = ACTIN.rigidity / length**2
    ends = [int(nodes[-1]) for nodes in filaments.node_indices]
    for end, load in zip(ends, loads):
        push.addParticle(end, [load * unit_load, _NUDGE * unit_load])
    system.addForce(push)
    context = simulation.start(filaments, step, 1, system, positions)
    context.getIntegrator().step(steps)
    places = context.getState(positions=True).getPositions(asNumpy=True)._value
    return {"deflection": places[ends, 1] / length / _NUDGE}


def drawn_beams(elements, draws, length_micrometers, seed):
    """Free filaments in a plane, drawn from equilibrium.

    Returns
    -------
    dict of arrays
        ``square`` of the distance between the ends, in nm^2 (groups,).
    """
    column = rods_on_string.SIMULATED_ACTIN
    kind = column.filament_type(length_micrometers * MICROMETER / elements, element="beam")
    filaments = column.solvent()
    for number in range(draws):
        filaments.add_equilibrium(kind, elements, seed + number, planar=True)
    ends = np.array([own.positions[-1] - own.positions[0] for own in filaments])
    return {"square": simulation.groups(np.sum(ends**2, axis=1), _GROUPS)}


def _critical_load(records, element, segments, expected):
    # P L^2/EI at which the response 1/deflection vanishes: a parabola through three loads just below.
    settings = cantilevers._settings(segments)
    loads = [share * expected for share in _SHARES]
    data = records.measure(
        f"column-{segments}-{element}",
        loaded_columns,
        loads=loads,
        length_micrometers=settings["length_micrometers"],
        segments=segments,
        element=element,
        steps=4000,
        step=settings["step"] * 40.0,
    )
    curve = np.polyfit(np.array(loads) / expected, 1.0 / data["deflection"], 2)
    roots = np.roots(curve)
    return float(expected * roots[np.argmin(np.abs(roots - 1.0))].real)


def _straight_critical_load(segments):
    return 4.0 * segments**2 * math.sin(math.pi / (4.0 * segments)) ** 2


def _bent(records, element, segments):
    # Deflections of the end over the length, one for each of _LOADS.
    settings = {**cantilevers._settings(40), "end_loads": list(_LOADS), "weights": [0.0, 0.0]}
    if element == "beam":
        data = records.measure(f"bent-{segments}-beam", cantilevers.bent_beams, elements=segments, **settings)
        return data["nodes"][:, -1, 1]
    data = records.measure(f"bent-{segments}-straight", cantilevers.bent_cantilevers, segments=segments, **settings)
    return data["shapes"][:, -1, 1]


def _percent(value):
    return f"{100 * value:+.3f} %" if abs(value) < 0.01 else f"{100 * value:+.2f} %"


def _table(heads, errors):
    lines = ["| | number | unknowns | " + " | ".join(heads) + " |", "|---|---|---|" + len(heads) * "---|"]
    for (element, number), row in errors.items():
        cells = [_NAMES[element], str(number), str(number * _UNKNOWNS[element]), *map(_percent, row)]
        lines.append("| " + " | ".join(cells) + " |")
    return "\n".join(lines)


def _draw(figure, errors, heads):
    figure.set_size_inches(4.6 * len(heads), 3.8)
    panels = np.atleast_1d(figure.subplots(1, len(heads), sharey=True))
    for column, (axis, head) in enumerate(zip(panels, heads)):
        for (element, name), colour, marker in zip(_NAMES.items(), style.COLOURS, "os"):
            points = [
                (number * _UNKNOWNS[element], abs(row[column]))
                for (own, number), row in errors.items()
                if own == element
            ]
            axis.plot(*np.array(points).T, marker=marker, color=colour, label=name)
        axis.set_title(head, fontsize=10)
        ylabel = "" if column else "relative error"
        style.finish(axis, "unknowns", ylabel, not column, xscale="log", yscale="log")
        axis.set_xticks([2, 4, 8, 16, 32, 64], ["2", "4", "8", "16", "32", "64"])
        axis.set_xticks([], minor=True)


def evaluate_cantilevers(records, quick):
    """Deflection of a cantilever under a force at its end."""
    exact = np.array([cantilevers.elastica(load, 0.0, 2)[0][-1, 1] for load in _LOADS])
    errors, results = {}, []
    for element, counts in _COUNTS.items():
        for number in counts:
            ours = _bent(records, element, number)
            errors[element, number] = ours / exact - 1.0
            for load, value, theory in zip(_LOADS, ours, exact):
                if element == "beam" and number >= (1 if load == 1.0 else 2):
                    name = f"deflection_end_load_{load:g}_{number}_beam_element" + ("s" if number > 1 else "")
                    results.append(Result(name, "L", Estimate(value, None), Rule(3.0, 0.0015), theory))
    heads = [f"PL²/EI = {load:g}" for load in _LOADS]
    remarks = "Deflection of the end of a cantilever, less that of Euler's elastica.\n\n" + _table(heads, errors)
    return Outcome(
        results, {"Error of the deflection of a cantilever": lambda figure: _draw(figure, errors, heads)}, remarks
    )


def evaluate_columns(records, quick):
    """Buckling of a column that is clamped at its foot: half of one with hinges at both ends."""
    exact = (0.5 * math.pi) ** 2
    errors, results = {}, []
    for element, counts in _COLUMN_COUNTS.items():
        for number in counts:
            expected = _straight_critical_load(number) if element == "straight" else exact
            ours = _critical_load(records, element, number, expected)
            errors[element, number] = [ours / exact - 1.0]
            theory, rule = (expected, Rule(3.0, 0.001)) if element == "straight" else (exact, Rule(3.0, 0.01))
            name = f"critical_load_{2 * number}_{_NAMES[element].replace(' ', '_')}_hinged_at_both_ends"
            results.append(Result(name, "EI/L^2", Estimate(ours, None), rule, theory))
    heads = ["critical load"]
    remarks = (
        "A column that is clamped at its foot is half of one of twice its length that is hinged at both ends, with "
        "twice the number of elements; numbers here are those of the half. The critical load is where the "
        "deflection under a small force across the end, measured below it, grows without bound. That of straight "
        "segments is 4 n² sin²(π/4n) EI/L², that of a continuous one π²/4 EI/L².\n\n" + _table(heads, errors)
    )
    return Outcome(
        results, {"Error of the critical load of a column": lambda figure: _draw(figure, errors, heads)}, remarks
    )


def evaluate_variances(records, quick):
    """Fluctuations of the end of a stiff filament that is clamped."""
    length, persistence = chromosome._LENGTH, CHROMOSOME.persistence_length
    exact = [clamped_angle_variance(length, persistence), clamped_deflection_variance(length, persistence)]
    errors, results, rows = {}, [], []
    for number in _FLUCTUATING:
        data = records.measure(
            f"fluctuating-{number}-beam",
            chromosome.fluctuating_beams,
            elements=number,
            copies=chromosome._BEAM_COPIES[quick],
            steps=chromosome._BEAM_STEPS[quick],
            step_seconds=chromosome._BEAM_STEP * chromosome._relaxation_time(1.0) / rods_on_string.SECOND,
            seed=30 + number,
        )
        suffix = f"{number}_beam_element" + ("s" if number > 1 else "")
        for name, values, theory in (
            ("angle_variance", data["angle_square"], exact[0]),
            ("deflection_variance", data["deflection_square"][-1], exact[1]),
        ):
            ours = simulation.mean(values / theory)
            results.append(Result(f"{name}_over_exact_{suffix}", "1", ours, chromosome._BEAM_RULE, 1.0))
            rows.append(f"{name.replace('_', ' ')} {100 * (ours.value - 1):+.2f} ± {100 * ours.error:.2f} %")
        errors["beam", number] = [float(simulation.mean(data["deflection_square"][-1]).value / exact[1] - 1.0)]
    for number in _COUNTS["straight"]:
        errors["straight", number] = [0.5 / number**2]
    errors = {key: errors[key] for key in sorted(errors, key=lambda key: (key[0] != "straight", key[1]))}
    head = "variance of the deflection of the end"
    remarks = (
        "The chromosome of Fig. 9 of Chandran and Mofrad 2009. For small deflections, beam elements have "
        "the exact distribution of the positions and tangents of their nodes, however few there are, and what is left "
        "here is the standard error of ours: with "
        + "; ".join(
            f"{number} element{'s' if number > 1 else ''}, {rows[2 * i]} and {rows[2 * i + 1]}"
            for i, number in enumerate(_FLUCTUATING)
        )
        + ". Straight segments have 1 + 1/(2 n²) times the variance of the deflection, in closed form.\n\n"
        + _table([head], errors)
    )
    return Outcome(results, {"Error of variances": lambda figure: _draw(figure, errors, [head])}, remarks)


def evaluate_distances(records, quick):
    """<R^2> of actin in a plane."""
    exact = wlc_mean_square_end_to_end(_ACTIN_LENGTH, ACTIN.persistence_length, planar=True)
    errors, results = {}, []
    for number in _COUNTS["straight"]:
        kind = ACTIN.filament_type(_ACTIN_LENGTH / number)
        square = chain_mean_square_end_to_end(kind, number, ACTIN.temperature, planar=True)
        errors["straight", number] = [square / exact - 1.0]
    for number in _DRAWN:
        data = records.measure(
            f"drawn-{number}-beam",
            drawn_beams,
            elements=number,
            draws=_DRAWS[quick],
            length_micrometers=_ACTIN_LENGTH / MICROMETER,
            seed=1000000 * number,
        )
        ours = simulation.mean(data["square"] / MICROMETER**2)
        errors["beam", number] = [ours.value * MICROMETER**2 / exact - 1.0]
        name = f"end_to_end_square_{number}_beam_elements"
        results.append(Result(name, "um^2", ours, _DRAWN_RULE, exact / MICROMETER**2))
    heads = ["⟨R²⟩"]
    remarks = (
        "The actin filament of Fig. 10 of Chandran and Mofrad 2009, 15.5 µm long, free in a plane. Straight segments "
        "are in closed form, with joints of EI/l₀ (those of a type with a `persistence_length` are calibrated to the "
        f"correlation of tangents, and err less). Beam elements are {_DRAWS[quick]} draws from equilibrium, whose "
        "standard errors are in the table below; those are what is left of theirs.\n\n" + _table(heads, errors)
    )
    return Outcome(results, {"Error of the mean square distance": lambda figure: _draw(figure, errors, heads)}, remarks)


def evaluate_networks(records, quick):
    """The shear modulus of crosslinked networks against elements per span."""
    errors, results = {}, []
    networks = {kind: [Network.of_kind(kind, seed) for seed in _SEEDS] for kind in _NETWORK_COUNTS}
    for kind, counts in _NETWORK_COUNTS.items():
        exact = np.array([beam_networks.continuous_force(network) for network in networks[kind]])
        errors[kind] = {}
        for element, number in counts:
            name = f"{kind}-{number}-{element}"
            settings = {"kind": kind, "seeds": list(_SEEDS), "elements": number, "element": element}
            data = records.measure(f"network-{name}", beam_networks.network_forces, **settings)
            ratio = float(np.mean(data["force"] / exact))
            errors[kind][element, number] = [ratio - 1.0]
            if (kind, element, number) in _NETWORK_TOLERANCES:
                rule = Rule(3.0, _NETWORK_TOLERANCES[kind, element, number])
                name = f"modulus_of_{kind}_over_exact_{number}_{_NAMES[element].replace(' ', '_')}"
                results.append(Result(name, "1", Estimate(ratio, None), rule, 1.0))
    heads = {"lattice": ["linked at nodes"], "random": ["linked anywhere"]}
    spans = np.mean([network.spans for network in networks["random"]])
    remarks = _ON_NETWORKS.format(
        networks=len(_SEEDS),
        present=100 * beam_networks.PRESENT,
        lattice=_table(heads["lattice"], errors["lattice"]),
        spans=spans,
        random=_table(heads["random"], errors["random"]),
    )
    pictures = {
        "Error of the modulus of a lattice": lambda figure: _draw(figure, errors["lattice"], heads["lattice"]),
        "Error of the modulus of a random network": lambda figure: _draw(figure, errors["random"], heads["random"]),
    }
    return Outcome(results, pictures, remarks)


CASES = (
    Case("cantilevers", "Cantilevers", (), evaluate_cantilevers),
    Case("columns", "Buckling of columns", (), evaluate_columns),
    Case("variances", "Thermal fluctuations", (), evaluate_variances),
    Case("distances", "Distance of the ends", (), evaluate_distances),
    Case("networks", "Shear modulus of crosslinked networks", (), evaluate_networks),
)
