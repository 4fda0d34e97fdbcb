"""Motion in dense solutions and stress in networks, in long steps and in steps that are sixteen times as short."""

import numpy as np
import pytest

from benchmark.network_systems import nearest_places
from openmm_cylchain import F_ACTIN, Crosslinks, Filaments, capsule_contact_force
from support.contexts import new_context, positions_of
from support.solvent import TEMPERATURE, VISCOSITY

ACTIN = F_ACTIN.with_segment_length(100)
DIAMETER, EDGE, FILAMENTS, SEGMENTS = 30.0, 600.0, 50, 5
LAGS = (10, 20, 40)
# Those of docs/networks.md for contacts, and a fifth of that for links. A single filament relaxes faster.
STEP, STEP_OF_LINKS = 5e6, 2e7
# In kJ/(mol nm^2): 0.25 pN/nm.
LINK, LINKS, STRAIN = 0.15, 300, 0.3


def _solution():
    """A dense solution, the density of which is that of the benchmark of networks, after its filaments came apart."""
    generator = np.random.default_rng(1)
    filaments = Filaments(VISCOSITY, TEMPERATURE)
    for number in range(FILAMENTS):
        filaments.add_equilibrium(ACTIN, SEGMENTS, seed=number + 1, start=generator.uniform(0, EDGE, 3))
    _, system, positions = filaments.build(box_vectors=EDGE * np.eye(3))
    system.addForce(capsule_contact_force(filaments, system, DIAMETER))
    integrator = filaments.create_integrator(system, 1e3, random_seed=1, checks=False)
    context = new_context(system, positions, integrator, "CPU", {"Threads": "1"})
    integrator.setTemperature(1)
    for step in (1e3, 1e4, 1e5):
        integrator.setStepSize(step)
        integrator.step(20)
    integrator.setTemperature(TEMPERATURE)
    for step, steps in ((1e4, 50), (1e5, 50), (1e6, 100), (1e7, 300)):
        integrator.setStepSize(step)
        integrator.step(steps)
    return filaments, system, positions_of(context)


def _middles(filaments, system, positions, step, level, steps, windows, seed):
    """Middles of filaments after each of some windows that follow each other, from the same Brownian path."""
    integrator = filaments.create_integrator(system, step / 2**level, random_seed=seed, checks=False)
    integrator.setPathLevel(level)
    context = new_context(system, positions, integrator, "CPU", {"Threads": "1"})
    nodes, found = np.array(filaments.node_indices), []
    for _ in range(windows):
        found.append(positions_of(context)[nodes].mean(axis=1))
        integrator.step(steps * 2**level)
    assert integrator.getNumDividedSteps() < 0.01 * steps * 2**level * windows * FILAMENTS
    return np.array(found)


@pytest.mark.slow
def test_diffusion_in_a_dense_solution_is_that_of_short_steps():
    """Mean square displacements of filaments at lags of 10 steps and more."""
    filaments, system, positions = _solution()
    ratios = []
    for seed in range(1, 5):
        coarse, fine = (_middles(filaments, system, positions, STEP, level, 10, 81, seed) for level in (0, 4))
        squares = [
            [np.mean(np.sum((own[lag // 10 :] - own[: -lag // 10]) ** 2, axis=2)) for lag in LAGS]
            for own in (coarse, fine)
        ]
        ratios.append(np.divide(*squares))
    mean, error = np.mean(ratios, axis=0), np.std(ratios, axis=0, ddof=1) / np.sqrt(len(ratios))
    assert (4 * error[:2] < 0.05).all(), (mean, error)
    assert (np.abs(mean - 1) < 0.05).all(), (mean, error)


def _network():
    filaments = Filaments(VISCOSITY, TEMPERATURE)
    generator = np.random.default_rng(1)
    for number in range(FILAMENTS):
        filaments.add_equilibrium(ACTIN, SEGMENTS, seed=number + 1, start=generator.uniform(0, EDGE, 3))
    _, system, positions = filaments.build(box_vectors=EDGE * np.eye(3))
    links = Crosslinks(LINK, 0.0)
    places = nearest_places(filaments, positions._value, EDGE)[:LINKS]
    links.add_many(None, places)
    links.add_to(system, periodic=True)
    return filaments, places, system, positions._value


def _vectors(places, positions, box):
    """Vectors of links to the nearest images of their second places."""
    first, second = (
        np.array([(1 - one.fraction) * positions[one.first] + one.fraction * positions[one.second] for one in side])
        for side in zip(*places)
    )
    vectors = second - first
    for axis in (2, 1, 0):
        vectors -= np.round(vectors[:, axis] / box[axis, axis])[:, None] * box[axis]
    return vectors


def _stresses(network, start, strain, step, level, seed):
    """Means of x z of links at lags of steps after filaments were moved with a strain, whole, and the box with them."""
    filaments, places, system, _ = network
    box = EDGE * np.eye(3)
    box[2, 0] = strain * EDGE
    moved = start.copy()
    for nodes in filaments.node_indices:
        moved[nodes, 0] += strain * start[nodes, 2].mean()
    integrator = filaments.create_integrator(system, step / 2**level, random_seed=seed, checks=False)
    integrator.setPathLevel(level)
    system.setDefaultPeriodicBoxVectors(*box)
    context = new_context(system, moved, integrator, "CPU", {"Threads": "1"})
    found, taken = [], 0
    for lag in LAGS:
        integrator.step((lag - taken) * 2**level)
        taken = lag
        vectors = _vectors(places, positions_of(context), box)
        found.append(np.mean(vectors[:, 0] * vectors[:, 2]))
    return np.array(found)


@pytest.mark.slow
def test_stress_after_a_step_strain_is_that_of_short_steps():
    """Opposite strains with the same noise leave the response alone.

    The network is connected: what is left as soon as its filaments have turned and bent stays.
    """
    network = _network()
    filaments, _, system, start = network
    stresses = []
    for seed in range(1, 25):
        integrator = filaments.create_integrator(system, STEP_OF_LINKS, random_seed=seed, checks=False)
        system.setDefaultPeriodicBoxVectors(*(EDGE * np.eye(3)))
        context = new_context(system, start, integrator, "CPU", {"Threads": "1"})
        integrator.step(200)
        relaxed = positions_of(context)
        stresses.append(
            [
                np.subtract(
                    *(_stresses(network, relaxed, sign * STRAIN, STEP_OF_LINKS, level, seed) for sign in (1, -1))
                )
                for level in (0, 4)
            ]
        )
    coarse, fine = np.array(stresses).mean(axis=0)
    differences = np.subtract(*np.swapaxes(stresses, 0, 1))
    error = differences.std(axis=0, ddof=1) / np.sqrt(len(differences)) / fine
    assert (fine > 30).all(), fine
    assert (4 * error < 0.05).all(), (coarse / fine, error)
    assert (np.abs(coarse / fine - 1) < 0.05).all(), (coarse / fine, error)
