"""Fig. 1: how much of the force that couples the modes is left when its linear part is taken out."""

import numpy as np
import scipy

from openmm_cylchain.bead_spring.modes import mode_shapes
from openmm_cylchain.bead_spring.transfer_operator import transfer_operator

from . import base_pairs, simulation, style
from .case import Case, Outcome
from .result import Result, Rule

_BONDS = 63
_MODES = (1, 2, 3, 4, 5, 6, 7, 8, 16, 31, 32, 48, 62, 63)
_COPIES = {True: 2048, False: 16384}
_GROUPS = 32
_RULE = Rule(3.0, 0.005, 0.03)


def mode_amplitudes(positions):
    """Amplitudes R_p, eq. (26): (..., beads, 3) of p = 0 to N, from positions (..., beads, 3) of chains."""
    return scipy.fft.dct(positions, type=2, norm="ortho", axis=-2)


def mode_forces(bead_type, positions):
    """What couples the modes of chains: (lambda DeltaH_p, lambda H_p), two arrays (..., beads, 3) in kJ/(mol nm).

    H_p is the force of the contour length, (37), all that is not linear; DeltaH_p, (44), what is left of it once the
    linear force that it has on average is in zeta_p:

        DeltaH_p = sum_n chi_np u_n (1/|u_n| - (1 - 2 nu)),    chi_np = phi_np - phi_(n-1)p

    with lengths in units of d. (chi_np = -2 sqrt(2/(N+1)) s_p sin(p n pi/(N+1)); the print of (39) lacks the minus.)
    """
    bonds = np.diff(positions, axis=-2)
    tangents = bonds / np.linalg.norm(bonds, axis=-1)[..., None]
    force = bead_type.stiffness * bead_type.natural_length
    linear = bonds / bead_type.bead_spacing
    return mode_amplitudes(force * _on_beads(tangents - linear)), mode_amplitudes(force * _on_beads(tangents))


def _on_beads(pushes):
    # Every bond pushes its beads apart: forces (..., beads, 3) of pushes (..., bonds, 3).
    none = np.zeros_like(pushes[..., :1, :])
    return np.concatenate([none, pushes], axis=-2) - np.concatenate([pushes, none], axis=-2)


def coupling_forces(bonds, copies, groups, seed):
    """Mean squares of H_p and DeltaH_p over chains drawn from equilibrium.

    Returns
    -------
    dict of arrays
        ``whole`` and ``rest``, (modes 1 to N, groups), in units of (lambda d)^2.
    """
    kind = base_pairs.SIMULATED
    positions = base_pairs.drawn_positions(kind, bonds, copies, seed)
    scale = (kind.stiffness * kind.natural_length) ** 2
    rest, whole = (
        simulation.groups(np.sum(force[:, 1:] ** 2, axis=-1).T / scale, groups)
        for force in mode_forces(kind, positions)
    )
    return {"whole": whole, "rest": rest}


def exact_ratios(bonds):
    """(<H_p^2>/<DeltaH_p^2>)^(1/2) of modes 1 to N, by the transfer operator."""
    kind = base_pairs.BASE_PAIRS
    operator = transfer_operator(kind.nu, kind.reduced_temperature(base_pairs.TEMPERATURE), bonds)
    shapes = np.diff(mode_shapes(bonds, np.arange(1, bonds + 1)), axis=0)

    def mean_square(vector):
        diagonal = (shapes**2).T @ operator.means(lambda length: vector(length) ** 2)[0]
        return diagonal + 2.0 * operator.correlation_sum(shapes, shapes, vector)

    # H_p is made of unit vectors along the bonds, DeltaH_p of what they have beyond u/b.
    return np.sqrt(mean_square(np.ones_like) / mean_square(lambda length: 1.0 - (1.0 - 2.0 * kind.nu) * length))


def evaluate(records, quick):
    """Fig. 1."""
    data = records.measure("figure-01", coupling_forces, bonds=_BONDS, copies=_COPIES[quick], groups=_GROUPS, seed=1)
    exact = exact_ratios(_BONDS)
    ratios = [
        simulation.jackknife(lambda means: np.sqrt(means[0] / means[1]), np.stack([whole, rest]))
        for whole, rest in zip(data["whole"], data["rest"])
    ]
    results = [Result(f"ratio_of_mode_{p}", "1", ratios[p - 1], _RULE, float(exact[p - 1])) for p in _MODES]

    def draw(figure):
        axis = figure.subplots()
        modes = np.arange(1, _BONDS + 1)
        for first, marker, name in ((0, "o", "odd"), (1, "s", "even")):
            chosen = slice(first, None, 2)
            values = [ratio.value for ratio in ratios[chosen]]
            axis.plot(modes[chosen], exact[chosen], "-", color=style.THEORY, linewidth=0.8)
            axis.plot(modes[chosen], values, marker, color=style.COLOURS[first], markersize=4, label=f"ours, {name} p")
        axis.plot([], [], "-", color=style.THEORY, linewidth=0.8, label="exact")
        ylabel = r"$[\langle H_p^2\rangle/\langle\Delta H_p^2\rangle]^{1/2}$"
        style.finish(axis, "mode p", ylabel, xscale="log", yscale="log")

    remarks = (
        "Ours are chains drawn from their exact equilibrium, the theory is the transfer operator, which gives both "
        "mean squares without statistical error. The paper prints no numbers; the linear part is nearly all of the "
        "force on the modes of long wavelength, and two thirds of it are left at short ones."
    )
    return Outcome(results, {"What is left of the coupling of modes, N = 63": draw}, remarks)


CASES = (Case("figure-01", "Fig. 1: coupling of modes", (1,), evaluate),)
