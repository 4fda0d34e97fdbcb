"""Links in the equations of implicit steps keep equilibrium: exact averages of trees, Monte Carlo for loops.

Copies begin in equilibrium, so a scheme that is right has nothing to wait for.
"""

from functools import lru_cache

import numpy as np
import pytest

from openmm_cylchain import DSDNA, F_ACTIN, MICROTUBULE
from support.linked_networks import (
    MICROSECOND,
    POINT,
    LinkPotential,
    Network,
    Simulation,
    mean_and_error,
    monte_carlo,
)

SCHEMES = ("implicit", "implicit-second-order")
TREES = {
    "pair": Network((((0, 2, 0.5), (1, 3, 0.3)),), 2),
    "ends of a pair": Network((((0, 5, 1.0), (1, 0, 0.0)),), 2),
    "star": Network(tuple(((0, s, 0.25), (s + 1, 2, 1.0)) for s in range(4)), 5, 4),
    "star at one place": Network(tuple(((0, 1, 0.5), (s + 1, 0, 0.0)) for s in range(3)), 4, 3),
    "fixed point": Network((((0, 4, 0.7), POINT),), 1),
    "particle": Network((((0, 2, 1.0), (0,)),), 1, particles=1),
    "particle to particle": Network((((0,), (0, 1, 0.5)), ((0, 4, 0.5), (1,)), ((1,), (2,))), 1, particles=3),
}
SOFT, MIDDLE, STIFF = LinkPotential(0.01), LinkPotential(0.25), LinkPotential(100.0)
LONG, LONG_STIFF = LinkPotential(0.25, 35.0), LinkPotential(100.0, 35.0)
FENE = LinkPotential(0.25, 35.0, 20.0)
# Potential, steps in us.
RANGES = [(SOFT, (20, 50)), (MIDDLE, (2, 50)), (STIFF, (0.1, 1, 50)), (LONG, (2, 10)), (LONG_STIFF, (0.1, 1, 10)),
          (LinkPotential(0.01, 35.0), (50,)), (FENE, (5,))]  # fmt: skip
CASES = [(potential, step) for potential, steps in RANGES for step in steps]


def label(value):
    if isinstance(value, LinkPotential):
        return f"{value.stiffness}pN/nm-{value.rest_length:g}nm" + ("-fene" if value.maximum_extension else "")
    return f"{value}us" if isinstance(value, int | float) else None


def check(name, values, exact, allowed=0.01, power=0.01):
    """Within ``allowed`` of ``exact`` and four standard errors, and able to tell 5 %."""
    mean, error = mean_and_error(values)
    assert error < power * exact, f"{name}: the standard error is {error / exact:.4f} of {exact:.4f}"
    assert abs(mean - exact) < allowed * exact + 4 * error, (
        f"{name}: {mean / exact:.4f} +- {error / exact:.4f} of exact"
    )


def run_tree(network, potential, scheme, step, copies, samples, seed=1, interval=1, **options):
    nodes, particles = network.draw(potential, copies, np.random.default_rng(seed))
    simulation = Simulation(network, potential, nodes, particles, scheme, step, **options)
    simulation.integrator.step(30)
    energies = simulation.measure(samples, interval)
    divided = simulation.integrator.getNumDividedSteps()
    # A step is divided for all that is connected, particles as well, and counts for each of them.
    bodies = copies * (network.filaments + network.particles)
    assert divided < 1e-3 * bodies * (samples * interval + 30), f"{divided} steps were divided"
    check("links", energies["links"], potential.mean(potential.energy))
    return simulation, energies


def check_filaments(network, energies, allowed=0.01):
    for name, exact in network.free_energies().items():
        check(name, energies[name], exact, allowed)


pytestmark = pytest.mark.slow


@pytest.mark.sample(r"implicit$|100\.0pN/nm-35nm.*second")
@pytest.mark.parametrize("scheme", SCHEMES)
@pytest.mark.parametrize(("potential", "step"), CASES, ids=label)
def test_pairs_keep_their_energies(potential, step, scheme):
    network = TREES["pair"]
    # Soft links with a rest length relax slowly.
    copies = 900 if potential.rest_length and potential.stiffness < 1 else 400
    _, energies = run_tree(network, potential, scheme, step * MICROSECOND, copies, 120)
    check_filaments(network, energies)


@pytest.mark.sample(r"35nm-implicit$|^star-100.*35nm.*second")
@pytest.mark.parametrize("scheme", SCHEMES)
@pytest.mark.parametrize("potential", [MIDDLE, STIFF, LONG_STIFF], ids=label)
@pytest.mark.parametrize("tree", [name for name in TREES if name != "pair"])
def test_trees_keep_their_energies(tree, potential, scheme):
    network = TREES[tree]
    _, energies = run_tree(network, potential, scheme, 5 * MICROSECOND, 250, 100)
    check_filaments(network, energies, 0.02 if scheme == "implicit-second-order" else 0.01)


@pytest.mark.sample(r"implicit$|^100\.0pN/nm-0nm")
@pytest.mark.parametrize("scheme", SCHEMES)
@pytest.mark.parametrize("potential", [MIDDLE, STIFF, LONG, LONG_STIFF], ids=label)
def test_vectors_of_links_have_the_right_distribution(potential, scheme):
    """Their quantiles, and their directions in space and against the filaments that they join."""
    network, copies = TREES["pair"], 700
    nodes, particles = network.draw(potential, copies, np.random.default_rng(2))
    simulation = Simulation(network, potential, nodes, particles, scheme, 5 * MICROSECOND)
    distance, cumulative = potential._grid()
    counts, squares, against = np.zeros((copies, 10)), np.zeros((copies, 3)), np.zeros(copies)
    samples = 60
    for _ in range(samples):
        simulation.integrator.step(2)
        nodes, particles = simulation.configuration()
        first, second = network.links[0]
        vector = network.at(first, nodes, particles) - network.at(second, nodes, particles)
        d = np.linalg.norm(vector, axis=1)
        decile = np.minimum((10 * np.interp(d, distance, cumulative)).astype(int), 9)
        counts[np.arange(copies), decile] += 1
        squares += (vector / d[:, None]) ** 2
        tangent = nodes[:, 0, 3] - nodes[:, 0, 2]
        against += (np.sum(tangent * vector, axis=1) / d / np.linalg.norm(tangent, axis=1)) ** 2
    for decile in range(10):
        check(f"decile {decile}", 10 * counts[:, decile] / samples, 1.0, 0.02, 0.02)
    for axis in range(3):
        check(f"axis {axis}", 3 * squares[:, axis] / samples, 1.0, 0.01, 0.03)
    check("along the filament", 3 * against / samples, 1.0, 0.01, 0.03)


@pytest.mark.sample("implicit$|kind[67].*second")
@pytest.mark.parametrize("scheme", SCHEMES)
@pytest.mark.parametrize(
    ("kind", "segments", "step", "stiffness"),
    [(F_ACTIN, 16, 1.3e9, k) for k in (0.0003, 0.001, 0.003)]
    + [(MICROTUBULE, 8, 87e6, k) for k in (0.01, 0.03, 0.1, 0.3)]
    + [(DSDNA, 8, 2.6e3, 10.0)],
)
def test_links_at_the_recommended_step_of_filaments(kind, segments, step, stiffness, scheme):
    """Where explicit links had 30 % too much energy, or blew up."""
    interval = 2
    if kind is F_ACTIN and scheme == "implicit-second-order":
        # The recommended step of this scheme for long actin. Links need many of them to relax, fewer if less moves.
        step, interval, segments = 51e6, 32, 8
    network = Network((((0, segments // 2, 0.0), (1, segments // 2, 0.0)),), 2, segments, kind=kind)
    run_tree(network, LinkPotential(stiffness), scheme, step, 1000, 60, interval=interval)


LOOPS = {
    "two links": Network((((0, 0, 0.5), (1, 0, 0.5)), ((0, 2, 0.5), (1, 2, 0.5))), 2, 3),
    "four links": Network(tuple(((0, s, 0.5), (1, s, 0.5)) for s in range(4)), 2, 4),
    "same place": Network((((0, 1, 0.5), (1, 1, 0.5)),) * 3, 2, 3),
    "three": Network(tuple(((i, 2, 0.5), ((i + 1) % 3, 0, 0.5)) for i in range(3)), 3, 3),
    "four": Network(tuple(((i, 2, 1.0), ((i + 1) % 4, 0, 0.0)) for i in range(4)), 4, 3),
    "one filament": Network((((0, 1, 0.8), (0, 2, 0.2)),), 1, 4),
}


@lru_cache(maxsize=1)
def sampled(loop, potential, copies, moves):
    """Copies in equilibrium, and averages by Monte Carlo."""
    network, generator = LOOPS[loop], np.random.default_rng(4)
    nodes, particles = network.draw(potential, copies, generator)
    # Softer links first, so that copies close their loops.
    for factor in (0.01, 0.1, 1):
        soft = LinkPotential(potential.stiffness * factor, potential.rest_length)
        nodes, particles, _ = monte_carlo(network, soft, nodes, particles, moves // 4, generator, 1)
    return monte_carlo(network, potential, nodes, particles, moves, generator, moves // 50)


def check_loop(loop, potential, scheme, step, copies, moves, samples, allowed=0.02):
    network = LOOPS[loop]
    nodes, particles, expected = sampled(loop, potential, copies, moves)
    simulation = Simulation(network, potential, nodes, particles, scheme, step * MICROSECOND)
    simulation.integrator.step(samples // 3)
    energies = simulation.measure(samples, 1)
    for name in ("links", "bending", "stretching"):
        # Both averages began with the same copies: their difference has no more than the sum of their errors.
        exact, error = mean_and_error(expected[name])
        assert error < 0.02 * exact, f"{name}: the error of Monte Carlo is {error / exact:.4f}"
        check(name, energies[name], exact, allowed + 4 * error / exact, 0.02)


@pytest.mark.sample(r"^0\.0-.*-(1-implicit|10-implicit-second-order)$|^35\.0-.*-(10-implicit|1-implicit-second-order)$")
@pytest.mark.parametrize("scheme", SCHEMES)
@pytest.mark.parametrize("step", [1, 10])
@pytest.mark.parametrize("loop", LOOPS)
@pytest.mark.parametrize("rest_length", [0.0, 35.0])
def test_loops_agree_with_monte_carlo(rest_length, loop, step, scheme):
    check_loop(loop, LinkPotential(0.25, rest_length), scheme, step, 400, 4000, 80)


@pytest.mark.parametrize("scheme", SCHEMES)
@pytest.mark.parametrize("sets", [1, 2])
def test_the_noise_of_links_is_their_own(sets, scheme):
    """Two links between the same places, in one force or in two, are one of twice the stiffness."""
    single, double = LinkPotential(10.0), LinkPotential(20.0)
    network = Network((((0, 2, 0.5), (1, 3, 0.3)),) * 2, 2)
    nodes, particles = network.draw(double, 300, np.random.default_rng(6))
    simulation = Simulation(network, single, nodes, particles, scheme, 5 * MICROSECOND, sets=sets)
    energies = simulation.measure(150, 1)
    check("links", energies["links"], 0.5 * double.mean(double.energy))
