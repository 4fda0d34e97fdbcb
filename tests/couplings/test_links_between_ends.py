"""A spring between both ends of a stiff chain bends it to a loop: against independent draws of the same chain.

Energies of loops matter: an error of 2 % of the spring's at each of its stiffnesses is one of 20 % of a J factor.
"""

import numpy as np
import pytest
from openmm import Context, Platform, unit

from openmm_cylchain import DSDNA, Crosslinks, Filaments
from support.gap_draws import turned_by
from support.linked_networks import mean_and_error

TEMPERATURE = 310 * unit.kelvin
THERMAL_ENERGY = (unit.MOLAR_GAS_CONSTANT_R * TEMPERATURE).value_in_unit(unit.kilojoule_per_mole)
TYPE = DSDNA.with_segment_length(10 * unit.nanometer)
SEGMENTS = 8
STIFFNESS = 0.005  # k_BT/nm^2


def draw_through(grid, energies, generator, shape):
    """Numbers with the density exp(-energies/k_BT), which are given between the points of a grid."""
    weights = np.exp(-(energies - energies.min()) / THERMAL_ENERGY) * np.diff(grid)
    cumulated = np.concatenate([[0.0], np.cumsum(weights)])
    return np.interp(generator.random(shape), cumulated / cumulated[-1], grid)


def draw_distances(generator, count):
    """Distances between the ends of free chains, and their bends, summed over joints, in 1 - cos."""
    grid = np.linspace(-0.999, 1, 40001)
    middles = 0.5 * (grid[1:] + grid[:-1])
    cosines = draw_through(grid, TYPE.bending_energy(middles), generator, (SEGMENTS - 1, count))
    grid = TYPE.segment_length * np.linspace(0.7, 1.3, 40001)
    middles = 0.5 * (grid[1:] + grid[:-1])
    energies = TYPE.stretching_energy(middles) - 2 * THERMAL_ENERGY * np.log(middles)
    lengths = draw_through(grid, energies, generator, (SEGMENTS, count))
    tangents = np.tile([0.0, 0.0, 1.0], (count, 1))
    ends = lengths[0][:, None] * tangents
    for cosine, length in zip(cosines, lengths[1:]):
        tangents = turned_by(tangents, cosine, generator)
        ends += length[:, None] * tangents
    return np.linalg.norm(ends, axis=1), (1 - cosines).sum(axis=0)


def exact():
    """Means and errors of the spring's energy, in k_BT, and of the bends with the spring."""
    generator = np.random.default_rng(3)
    parts = []
    for _ in range(20):
        distances, bends = draw_distances(generator, 100_000)
        energies = 0.5 * STIFFNESS * distances**2
        weights = np.exp(-energies)
        parts.append([weights.sum(), weights @ energies, weights @ bends])
    parts = np.array(parts)
    means = parts[:, 1:].sum(axis=0) / parts[:, 0].sum()
    errors = (parts[:, 1:] / parts[:, :1]).std(axis=0, ddof=1) / np.sqrt(len(parts))
    return dict(zip(("spring", "bends"), zip(means, errors)))


@pytest.mark.slow
def test_a_loop_costs_what_it_should_at_the_recommended_step():
    copies = 48
    filaments = Filaments(1e-3 * unit.pascal * unit.second, TEMPERATURE)
    for number in range(copies):
        filaments.add_equilibrium(TYPE, SEGMENTS, seed=number, start=[0, 100.0 * number, 0])
    _, system, positions = filaments.build()
    springs = Crosslinks(STIFFNESS * THERMAL_ENERGY, 0.0)
    nodes = np.array(filaments.node_indices)
    springs.add_many(None, nodes[:, [0, -1]])
    springs.add_to(system)
    step = filaments.recommended_time_step(system=system).step
    integrator = filaments.create_integrator(system, step, random_seed=4)
    context = Context(system, integrator, Platform.getPlatformByName("CPU"))
    context.setPositions(positions)
    measured = {"spring": [], "bends": []}
    # A loop closes and opens within microseconds.
    integrator.step(int(2e7 / step))
    for _ in range(500):
        integrator.step(int(1e6 / step))
        chains = context.getState(positions=True).getPositions(asNumpy=True).value_in_unit(unit.nanometer)[nodes]
        tangents = np.diff(chains, axis=1)
        tangents /= np.linalg.norm(tangents, axis=2)[..., None]
        measured["spring"].append(0.5 * STIFFNESS * ((chains[:, -1] - chains[:, 0]) ** 2).sum(axis=1))
        measured["bends"].append((1 - (tangents[:, 1:] * tangents[:, :-1]).sum(axis=2)).sum(axis=1))
    assert integrator.getNumDividedSteps() == 0
    for name, (mean, error) in exact().items():
        value, own = mean_and_error(np.array(measured[name]).T)
        both = np.hypot(own, error)
        assert both < 0.008 * mean
        assert abs(value - mean) < 0.005 * mean + 4 * both, f"{name}: {value / mean:.4f} +- {both / mean:.4f} of exact"
