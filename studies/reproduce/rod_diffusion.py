"""Fig. 7 of Chandran and Mofrad 2009: parallel, normal and rotational diffusion of rods that are cut into segments.

With what the paper does, the logarithm of the whole rod in the friction of every segment and no end corrections, the
friction of the segments adds up to that of the rod. With the logarithm of their own length it adds up to more.
"""

import math
from itertools import pairwise

import numpy as np

from benchmark.measurement import scaled
from openmm_cylchain.mechanics.friction import EndCorrections
from openmm_cylchain.units.quantities import VISCOSITY, in_units_of

from . import rods_on_string, simulation, style
from .case import Case, Outcome
from .result import ROUNDING, Estimate, Result, Rule
from .rods_on_string import MICROMETER, ROD, SECOND

_LENGTHS = (1, 2, 3, 4, 5)
_SEGMENTS = (1, 5, 20)
_SPACE_LENGTH, _OWN_LENGTH = 3, 5
_TURN = 0.02
"""Standard deviation, in rad, of the angle by which a rod turns in an interval, which is one step.

Steps in which it turns by 0.07 rad leave the rotational diffusion of 20 segments 4 % too small, these 0.1 %.
"""
_INTERVALS = 100
_COPIES = {True: 150, False: 1000}
_GROUPS = 20
_RULE = Rule(3.0, 0.003, 0.02)
_UNITS = {"parallel": "um^2/s", "normal": "um^2/s", "rotational": "1/s"}
_SCALES = {"parallel": MICROMETER**2 / SECOND, "normal": MICROMETER**2 / SECOND, "rotational": 1.0 / SECOND}
_FRICTIONS = {
    "whole": {},
    "corrected": {"end_corrections": EndCorrections()},
    "own": {"end_corrections": EndCorrections(), "friction_length": "segment"},
}
"""The paper's, with the logarithm of the whole rod; with end corrections; with the logarithm of a segment's length."""
_LABELS = {"corrected": "end_corrections", "own": "their_own_logarithm"}


def diffusing_rods(
    length_micrometers, segments, planar, friction, copies, intervals, interval_seconds, seed, element="straight"
):
    """Diffusion coefficients of rods from their displacements in intervals, eq. (14).

    Parameters
    ----------
    planar : bool
    friction : {"whole", "corrected", "own"}
        See ``_FRICTIONS``.
    element : {"straight", "beam"}

    Returns
    -------
    dict of (groups,) arrays
        ``parallel`` and ``normal``, of the middle of the rod against its direction at the start of an interval, in
        nm^2/ps, and ``rotational`` in 1/ps.
    """
    column = rods_on_string.SIMULATED_ROD
    filaments = column.solvent()
    kind = column.filament_type(length_micrometers * MICROMETER / segments, element=element, **_FRICTIONS[friction])
    for angle in np.random.default_rng(seed).uniform(0.0, 2.0 * np.pi, copies):
        filaments.add_straight(kind, segments, [0, 0, 0], [math.cos(angle), math.sin(angle), 0], planar=planar)
    interval = interval_seconds * SECOND
    context = simulation.start(filaments, interval, seed)
    shapes = (points[:, : segments + 1] for points in simulation.frames(context, copies, range(intervals + 1)))
    frames = ((nodes.mean(axis=1), _axis(nodes)) for nodes in shapes)
    sums = np.zeros((3, copies))
    for (middle, axis), (next_middle, next_axis) in pairwise(frames):
        moved = next_middle - middle
        along = np.sum(moved * axis, axis=1) ** 2
        sums += along, np.sum(moved**2, axis=1) - along, np.sum(axis * next_axis, axis=1)
    along, across, cosine = simulation.groups(sums / intervals, _GROUPS)
    # Both across and turns have one direction in a plane, two in space: <t.t'> = exp(-directions D_r dt).
    directions = 1 if planar else 2
    return {
        "parallel": along / (2.0 * interval),
        "normal": across / (2.0 * directions * interval),
        "rotational": -np.log(cosine) / (directions * interval),
    }


def _axis(nodes):
    axis = nodes[:, -1] - nodes[:, 0]
    return axis / np.linalg.norm(axis, axis=1)[:, None]


def rod_diffusion(length):
    """Eqs. (11) to (13) for a slender rod of a length in nm: D_p, D_n in nm^2/ps and D_r in 1/ps.

    ``D_p = k_B T ln(L/d)/(2 pi eta L)``, ``D_n = D_p/2``, ``D_r = 3 k_B T ln(L/d)/(pi eta L^3)``
    """
    viscosity = in_units_of(ROD.viscosity, VISCOSITY, "viscosity")
    mobility = ROD.thermal_energy * math.log(length / ROD.diameter) / (math.pi * viscosity * length)
    return {"parallel": mobility / 2.0, "normal": mobility / 4.0, "rotational": 3.0 * mobility / length**2}


def cut_rod_diffusion(length, segments, friction="whole"):
    """Diffusion coefficients of a straight rigid chain of segments, from the friction of a segment; exact.

    ``D_p = k_B T/(N gamma_par)``, ``D_n = k_B T/(N gamma_perp)``, ``D_r = k_B T/(N gamma_rot + gamma_perp sum s^2)``
    with the places s of the middles of the segments, ``sum s^2 = l0^2 N (N^2-1)/12``.
    """
    one = length / segments
    own = ROD.friction(one, segments, **_FRICTIONS[friction])
    squares = one**2 * segments * (segments**2 - 1) / 12.0
    return {
        "parallel": ROD.thermal_energy / (segments * own.parallel),
        "normal": ROD.thermal_energy / (segments * own.perpendicular),
        "rotational": ROD.thermal_energy / (segments * own.rotational + own.perpendicular * squares),
    }


def _measured(records, quick, length, segments, planar=True, friction="whole", beams=False):
    exact = cut_rod_diffusion(length * MICROMETER, segments, friction)
    name = f"figure-07-{length}-um-{segments}-segments"
    name += ("" if planar else "-space") + ("" if friction == "whole" else f"-{friction}")
    name += "-beams" if beams else ""
    seed = 7 + 100 * length + segments + (0 if planar else 1000) + 2000 * list(_FRICTIONS).index(friction)
    return records.measure(
        name,
        diffusing_rods,
        length_micrometers=length,
        segments=segments,
        planar=planar,
        friction=friction,
        copies=_COPIES[quick],
        intervals=_INTERVALS,
        interval_seconds=_TURN**2 / (2.0 * exact["rotational"]) / SECOND,
        seed=seed + (10000 if beams else 0),
        **({"element": "beam"} if beams else {}),
    )


def _results(data, exact, suffix):
    for direction, scale in _SCALES.items():
        ours = scaled(simulation.mean(data[direction]), 1.0 / scale)
        yield Result(f"{direction}_diffusion_{suffix}", _UNITS[direction], ours, _RULE, exact[direction] / scale)


def evaluate(records, quick):
    """Fig. 7, and rods whose segments have end corrections, or the friction of their own length."""
    results, points, cut = [], {}, {}
    for length in _LENGTHS:
        whole = rod_diffusion(length * MICROMETER)
        for segments in _SEGMENTS:
            points[length, segments] = _measured(records, quick, length, segments)
            results += _results(points[length, segments], whole, f"{length}_um_{segments}_segments")
    for length in _LENGTHS:
        for segments in _SEGMENTS:
            data = _measured(records, quick, length, segments, beams=True)
            suffix = f"{length}_um_{segments}_beam_element" + ("s" if segments > 1 else "")
            results += _results(data, rod_diffusion(length * MICROMETER), suffix)
    for length in _LENGTHS:
        ratios = _shares(length, _SEGMENTS[-1], "whole")
        for direction in _SCALES:
            ours = Estimate(ratios[direction], None)
            name = f"{direction}_friction_of_the_rod_over_{_SEGMENTS[-1]}_segments_{length}_um"
            results.append(Result(name, "1", ours, ROUNDING, 1.0))
    for segments in _SEGMENTS:
        data = _measured(records, quick, _SPACE_LENGTH, segments, planar=False)
        suffix = f"{_SPACE_LENGTH}_um_{segments}_segments_in_space"
        results += _results(data, rod_diffusion(_SPACE_LENGTH * MICROMETER), suffix)
    for friction, label in _LABELS.items():
        for segments in _SEGMENTS:
            data = _measured(records, quick, _OWN_LENGTH, segments, friction=friction)
            cut[friction, segments] = data
            exact = cut_rod_diffusion(_OWN_LENGTH * MICROMETER, segments, friction)
            results += _results(data, exact, f"{_OWN_LENGTH}_um_{segments}_segments_with_{label}")
    pictures = {
        "Diffusion of rods cut into segments": lambda figure: _draw_rods(figure, points),
        "Diffusion of a cut rod over that of the whole": lambda figure: _draw_shares(figure, cut),
    }
    return Outcome(results, pictures, _remarks())


def _shares(length, segments, friction):
    # Diffusion coefficients of a rod cut into segments over those of one segment with the same friction law.
    cut = cut_rod_diffusion(length * MICROMETER, segments, friction)
    whole = cut_rod_diffusion(length * MICROMETER, 1, friction)
    return {direction: cut[direction] / whole[direction] for direction in cut}


def _remarks():
    cuts = []
    for segments in _SEGMENTS[1:]:
        shares = _shares(_OWN_LENGTH, segments, "own")
        numbers = ", ".join(f"{100 * (1 - share):.0f} % ({direction})" for direction, share in shares.items())
        cuts.append(f"{numbers} in {segments} segments")
    turning = _shares(_OWN_LENGTH, _SEGMENTS[-1], "corrected")["rotational"]
    corrections = EndCorrections()
    return (
        f"Ours is (14) in intervals in which a rod turns by {_TURN} rad, the theory (11) to (13) for the whole rod, "
        "without end corrections, as Section IV has it. The paper gives the logarithm of the whole rod to all segments "
        '(`friction_length="filament"`). Then the friction of segments adds up to that of the rod, the rotational one '
        "by (A3), and a cut rod diffuses exactly as the whole, in closed form as in the simulation. The paper "
        "simulates in a plane; rods in space have the same coefficients. So have rods of beam elements, whose friction "
        "is spread along them.\n\n"
        f"With the end corrections that are the default, a cut rod of {_OWN_LENGTH} µm still moves along and across as "
        f"the whole, but turns {100 * (turning - 1):.0f} % faster in {_SEGMENTS[-1]} segments: what turns it is their "
        f"friction across, with the correction {corrections.perpendicular}, and not the friction of rotation, with "
        f"{corrections.rotational}.\n\n"
        'With `friction_length="segment"`, as in Pešek et al. 2016 and by default, each segment has the logarithm of '
        f"its own length. A cut rod of {_OWN_LENGTH} µm then diffuses more slowly than one segment: by "
        f"{'; '.join(cuts)}. The cause is in the model, which neglects the flow that one segment makes at another, "
        "not in the scheme: the simulation agrees with the closed form of the sum of the friction. Segments shorter "
        f"than {math.exp(-corrections.rotational):.2f} diameters have no such friction at all and are refused."
    )


def _draw_rods(figure, points):
    figure.set_size_inches(9.6, 3.4)
    fine = np.linspace(0.9, 5.1, 100)
    for axis, direction, label in zip(figure.subplots(1, 3), _SCALES, ("D_p", "D_n", "D_r")):
        curve = np.array([rod_diffusion(length * MICROMETER)[direction] for length in fine]) / _SCALES[direction]
        axis.plot(fine, curve, "--", color=style.THEORY, linewidth=1, label="(11) to (13)")
        for segments, colour, marker, size in zip(_SEGMENTS, style.COLOURS, "os^", (10, 7, 4)):
            means = [simulation.mean(points[length, segments][direction] / _SCALES[direction]) for length in _LENGTHS]
            axis.errorbar(
                _LENGTHS,
                [mean.value for mean in means],
                [mean.error for mean in means],
                fmt=marker,
                markersize=size,
                markerfacecolor="none",
                color=colour,
                label="1 segment" if segments == 1 else f"{segments} segments",
            )
        unit = {"um^2/s": "µm²/s"}.get(_UNITS[direction], "1/s")
        scales = {"yscale": "log"} if direction == "rotational" else {"ylim": (0, None)}
        style.finish(axis, "length of the rod (µm)", rf"${label}$ ({unit})", direction == "parallel", **scales)


def _draw_shares(figure, cut):
    figure.set_size_inches(9.6, 4.0)
    numbers = range(1, _SEGMENTS[-1] + 1)
    titles = {"corrected": "logarithm of the whole rod, end corrections", "own": "logarithm of a segment"}
    for axis, (friction, title) in zip(figure.subplots(1, 2, sharey=True), titles.items()):
        whole = cut_rod_diffusion(_OWN_LENGTH * MICROMETER, 1, friction)
        curves = [_shares(_OWN_LENGTH, number, friction) for number in numbers]
        for direction, colour, marker in zip(_SCALES, style.COLOURS, "os^"):
            means = [simulation.mean(cut[friction, segments][direction] / whole[direction]) for segments in _SEGMENTS]
            axis.errorbar(
                _SEGMENTS,
                [mean.value for mean in means],
                [mean.error for mean in means],
                fmt=marker,
                markersize=5,
                color=colour,
                label=f"ours, {direction}",
            )
            axis.plot(numbers, [curve[direction] for curve in curves], color=colour, linewidth=1)
        axis.plot([], [], color="gray", linewidth=1, label="sum of the friction")
        axis.axhline(1.0, color=style.THEORY, linestyle="--", linewidth=1, label="(11) to (13), as the paper")
        axis.set_title(title, fontsize=10)
        ylabel = f"D of a cut rod of {_OWN_LENGTH} µm / D of the whole" if friction == "corrected" else ""
        legend = friction == "corrected"
        style.finish(axis, "segments", ylabel, legend, ylim=(0, 1.5), xlim=(0, 21), xticks=(1, 5, 10, 15, 20))


CASES = (Case("figure-07", "Fig. 7: diffusion of rods cut into segments", (7,), evaluate),)
