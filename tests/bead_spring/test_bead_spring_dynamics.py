"""Averages and motion of DNA base pair by base pair: exact averages at steps from 1 ps to 1.6 ns, and its motion."""

import numpy as np
import pytest

from bead_spring_observables import mean_squares_of_observables, observables
from openmm_cylchain import DSDNA_BASE_PAIRS, Filaments, theory
from support.contexts import new_context, positions_of

ROOM, VISCOSITY = 296.15, 602.0
KIND = DSDNA_BASE_PAIRS
UNIT = KIND.time_unit


class Chains:
    """Chains in equilibrium that are moved by a scheme."""

    def __init__(self, bonds, count, scheme, step, precision="automatic", seed=1, planar=False, kind=KIND):
        filaments = Filaments(VISCOSITY, ROOM, engine="compiled")
        for chain in range(count):
            filaments.add_equilibrium(kind, bonds, seed=1000 * seed + chain, planar=planar)
        _, system, positions = filaments.build()
        self.integrator = filaments.create_integrator(
            system, step, scheme=scheme, random_seed=seed, precision=precision, checks=False
        )
        self.context = new_context(system, positions, self.integrator)
        self.shape = (count, bonds + 1, 3)

    def frames(self, number, steps):
        """So many frames (count, beads, 3) in nm, so many steps apart, after one that is not among them."""
        for _ in range(number):
            self.integrator.step(steps)
            yield positions_of(self.context).reshape(self.shape)

    def mean_squares(self, number, steps):
        """Mean squares (count, 3) in nm^2 of the paper's observables, over frames."""
        squares = [np.sum(observables(frame) ** 2, axis=2) for frame in self.frames(number, steps)]
        return np.mean(squares, axis=0)

    def motion(self, number, steps):
        """Mean square motion (count, 3) in nm^2 of the paper's observables over so many steps."""
        frames = [observables(frame) for frame in self.frames(number + 1, steps)]
        return np.mean(np.sum(np.diff(frames, axis=0) ** 2, axis=3), axis=0)


def exact_mean_squares(bonds):
    return mean_squares_of_observables(KIND, bonds, ROOM)


def check_means(values, expected, tolerance, power):
    """Means over chains are right within a tolerance and four standard errors, which are small enough to tell."""
    error = values.std(axis=0, ddof=1) / np.sqrt(len(values))
    assert np.all(error < power * expected)
    assert np.all(np.abs(values.mean(axis=0) - expected) < tolerance * expected + 4.0 * error)


@pytest.mark.sample("mixed")
@pytest.mark.slow
@pytest.mark.parametrize("precision", ["mixed", "double"])
def test_averages_at_the_recommended_step(precision):
    # 1.6 ns, 1e4 tau; the slowest of the three relaxes in a hundred steps.
    chains = Chains(63, 256, "implicit", 1e4 * UNIT, precision)
    check_means(chains.mean_squares(300, 4), exact_mean_squares(63), 0.01, 0.0125)
    assert chains.integrator.getNumDividedSteps() < 1e-3 * 256 * 1200


@pytest.mark.sample(r"^63-|^127-1\.0|^255-1600|^511-160\.0")
@pytest.mark.parametrize(
    "bonds, step",
    [(63, 1.0)]
    + [
        pytest.param(bonds, step, marks=pytest.mark.slow)
        for bonds in (63, 127, 255, 511)
        for step in (1.0, 16.0, 160.0, 1600.0)
        if (bonds, step) != (63, 1.0)
    ],
)
def test_correlations_of_bonds_at_any_step(bonds, step):
    """Products of bonds up to 16 apart, which make up the end-to-end vector, relax within the time of the test."""
    distances = np.array([0, 1, 4, 16])
    exact = theory.bead_spring_bond_correlations(KIND, bonds, ROOM)
    expected = np.array([np.diagonal(exact, distance).mean() for distance in distances])
    chains = Chains(bonds, 8192 // (bonds + 1), "implicit", step)
    means = []
    for frame in chains.frames(24, 10):
        vectors = np.diff(frame, axis=1)
        products = [
            np.sum(vectors[:, distance:] * vectors[:, : bonds - distance], axis=2).mean(axis=1)
            for distance in distances
        ]
        means.append(np.transpose(products))
    # The first half leads from the draws to what the scheme keeps.
    check_means(np.mean(means[12:], axis=0), expected, 0.01, 0.0125)


@pytest.mark.exhaustive
@pytest.mark.slow
def test_averages_of_longer_chains():
    found = Chains(127, 384, "implicit", 1e4 * UNIT).mean_squares(250, 10)
    check_means(found, exact_mean_squares(127), 0.01, 0.04)


@pytest.mark.slow
def test_averages_of_modes():
    """Scheme "modes" makes the end-to-end vector too short at long steps, by 7 % in its square at 100 tau: Table II."""
    exact = exact_mean_squares(63)
    chains = Chains(63, 512, "modes", 100.0 * UNIT)
    chains.integrator.step(8000)
    squares = chains.mean_squares(30, 500)[:, 0] / exact[0]
    error = squares.std() / np.sqrt(512)
    assert error < 0.0125
    assert squares.mean() == pytest.approx(1.0 - 0.067, abs=0.01 + 3.0 * error)


@pytest.mark.exhaustive
@pytest.mark.slow
def test_loss_of_correlation_is_that_of_modes_at_their_smallest_step():
    # In a thousand units of tau and more, at a step of 1e3 tau.
    reference = Chains(63, 256, "modes", UNIT, seed=5)
    expected = {3: reference.motion(10, 3000), 10: reference.motion(14, 10000)}
    for lag, bound in ((3, 0.1), (10, 0.05)):
        found = Chains(63, 256, "implicit", 1e3 * UNIT).motion(600 // lag, lag)
        for one, other in zip(found.T, expected[lag].T):
            ratio = one.mean() / other.mean()
            errors = [values.std(ddof=1) / np.sqrt(len(values)) / values.mean() for values in (one, other)]
            error = np.hypot(*errors)
            assert error < 0.025, (lag, error, ratio)
            assert abs(ratio - 1.0) < bound + 2.0 * error
