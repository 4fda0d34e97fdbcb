"""Chains of beads at fixed distances, (62) to (68): multipliers that keep the lengths, and all forces at the midpoint.

Lengths are in units of a bond, energies of kappa, times of xi/kappa. The energy is -sum_n u_n.u_(n+1), and
T = k_B T/kappa = a/l_p.
"""

import numpy as np
from scipy.linalg import solve_banded

_TOLERANCE = 1e-5
"""Of a bond; lengths are set right afterwards."""
_MOST_ITERATIONS = 60


def drawn_bonds(temperature, bonds, copies, generator):
    """Unit bonds (copies, bonds, 3) of chains in equilibrium, with the density exp(cos/T) of each bend."""
    stiffness = 1.0 / temperature
    uniform = generator.random((copies, bonds - 1))
    bends = np.minimum(-np.log1p(uniform * np.expm1(-2.0 * stiffness)) / stiffness, 2.0)
    tangents = generator.normal(size=(copies, bonds, 3))
    tangents /= np.linalg.norm(tangents, axis=2, keepdims=True)
    for bond in range(1, bonds):
        before, bend = tangents[:, bond - 1], bends[:, bond - 1, None]
        across = np.cross(before, tangents[:, bond])
        across *= np.sqrt(bend * (2.0 - bend)) / np.linalg.norm(across, axis=1, keepdims=True)
        tangents[:, bond] = (1.0 - bend) * before + across
        tangents[:, bond] /= np.linalg.norm(tangents[:, bond], axis=1, keepdims=True)
    return tangents


def exact_mean_squares(temperature, bonds):
    """Mean squares of the end-to-end vector and of the middle bead as seen from the centre of all beads."""
    correlation = 1.0 / np.tanh(1.0 / temperature) - temperature
    number = np.arange(1, bonds + 1)
    correlations = correlation ** np.abs(number[:, None] - number)
    weights = _weights_of_the_middle(bonds)
    return np.array([correlations.sum(), weights @ correlations @ weights])


def mean_squares(tangents):
    """The same of chains, means over all of them: (2,)."""
    weights = _weights_of_the_middle(tangents.shape[1])
    vectors = np.stack([tangents.sum(axis=1), np.einsum("n,cnk->ck", weights, tangents)])
    return np.sum(vectors**2, axis=2).mean(axis=1)


def _weights_of_the_middle(bonds):
    number = np.arange(1, bonds + 1)
    return (number <= (bonds + 1) // 2) - (bonds + 1.0 - number) / (bonds + 1.0)


def advanced(tangents, step, temperature, generator):
    """Bonds after one step, and how many iterations it took; None if they did not converge.

    u' - u is perpendicular to u + u', which keeps the lengths, (65); the tensions are solved for with the tridiagonal
    matrix (66) of the unit vectors along u + u', (68), at which the forces are taken, too.
    """
    copies, bonds, _ = tangents.shape
    noise = np.sqrt(2.0 * temperature * step) * generator.normal(size=(copies, bonds + 1, 3))
    after = tangents
    for iteration in range(1, _MOST_ITERATIONS + 1):
        middle = tangents + after
        middle /= np.linalg.norm(middle, axis=2, keepdims=True)
        moved = noise.copy()
        _add_on_beads(moved, step * _bending(middle))
        wanted = np.diff(moved, axis=1)
        pull = _tensions(middle, wanted)[..., None] * middle
        moved[:, :-1] += pull
        moved[:, 1:] -= pull
        before, after = after, tangents + np.diff(moved, axis=1)
        if not np.abs(after - before).max() < 10.0:
            return None, iteration
        if np.abs(after - before).max() < _TOLERANCE:
            return after / np.linalg.norm(after, axis=2, keepdims=True), iteration
    return None, _MOST_ITERATIONS


def _bending(tangents):
    # -dH/du_n: both neighbours.
    forces = np.zeros_like(tangents)
    forces[:, 1:] += tangents[:, :-1]
    forces[:, :-1] += tangents[:, 1:]
    return forces


def _add_on_beads(moved, forces):
    # A force on u_n = r_n - r_(n-1) acts on both beads.
    moved[:, 1:] += forces
    moved[:, :-1] -= forces


def _tensions(middle, wanted):
    # All chains are one tridiagonal system, without couplings from chain to chain.
    copies, bonds, _ = middle.shape
    cosines = np.sum(middle[:, 1:] * middle[:, :-1], axis=2)
    matrix = np.zeros((3, copies, bonds))
    matrix[1] = 2.0
    matrix[0, :, 1:] = matrix[2, :, :-1] = -cosines
    right = np.sum(middle * wanted, axis=2)
    solution = solve_banded((1, 1), matrix.reshape(3, -1), right.reshape(-1), check_finite=False)
    return solution.reshape(copies, bonds)


def inextensible_chains(bonds, persistence_length, copies, step, time, frames, groups, seed):
    """Chains that start in equilibrium and take steps.

    Parameters
    ----------
    bonds : int
    persistence_length : float
        In bonds.
    copies : int
    step, time : float
    frames : int
        At equal times, of which the first third is left out.
    groups : int
        Of copies.
    seed : int

    Returns
    -------
    dict
        ``squares`` (2, groups) as of ``mean_squares``, ``starts``, those at the start, and ``iterations`` of a step;
        ``failed``, 1 if a step did not converge, and then there is nothing else but zeros.
    """
    generator = np.random.default_rng(seed)
    temperature = 1.0 / persistence_length
    tangents = drawn_bonds(temperature, bonds, copies, generator)
    parts = np.array_split(np.arange(copies), groups)
    steps = max(frames, round(time / step))
    every = steps // frames
    sampled, iterations = [], 0
    starts = np.array([mean_squares(tangents[part]) for part in parts]).T
    for number in range(1, every * frames + 1):
        tangents, taken = advanced(tangents, step, temperature, generator)
        if tangents is None:
            return {"failed": 1, "squares": np.zeros_like(starts), "starts": starts, "iterations": 0.0}
        iterations += taken
        if number % every == 0 and number > every * frames // 3:
            sampled.append([mean_squares(tangents[part]) for part in parts])
    squares = np.mean(sampled, axis=0).T
    return {"failed": 0, "squares": squares, "starts": starts, "iterations": iterations / (every * frames)}
