"""Rods that touch each other, walls and links: distances, energies, forces and order beside Monte Carlo and quadrature.

References are of the same energies by means that know nothing of the package (``support.rod_monte_carlo``). Those that
take minutes are in ``support/rod_references.json``; a slow test computes them again.
"""

import json
from pathlib import Path

import numpy as np
import pytest
from openmm import unit
from scipy.optimize import brentq, minimize

from openmm_cylchain import Filaments, FilamentType, Sphere, filament_wall_force, wall_forces
from support import rod_cases
from support.contexts import energy_of, new_context, positions_of
from support.rod_cases import (
    CASES,
    LOOP,
    PAIR,
    RODS_IN_A_PLANE,
    RODS_IN_A_SLAB,
    RODS_IN_A_WIDE_SLAB,
    rods_between_walls,
)
from support.rod_monte_carlo import RodMonteCarlo, linked_pair, random_rods
from support.rod_observables import check, means_of, observable_names, observe
from support.rod_simulations import PICONEWTON_PER_NANOMETER, RodSimulation, rod_system
from support.solvent import KT

REFERENCES = json.loads((Path(rod_cases.__file__).parent / "rod_references.json").read_text())
MICROSECOND = 1e6


def _in_equilibrium(system, copies, sweeps):
    sampler = RodMonteCarlo(system, *random_rods(system, copies, 1), seed=2)
    sampler.sweep(sweeps)
    return sampler.middles, sampler.along


def _run(system, middles, along, factor, samples, interval, blocks=1):
    """Rows of ``observe``: samples so many us apart, after an eighth of them."""
    simulation = RodSimulation(system, middles, along, factor)
    steps = max(1, round(interval * MICROSECOND / simulation.step))
    simulation.integrator.step(samples // 8 * steps)
    return simulation.rows(observe, samples, steps, blocks)


@pytest.mark.filterwarnings("ignore::openmm_cylchain.errors.ContactWarning")
@pytest.mark.parametrize("name", ["loop", "slab", "plane"])
def test_energies_of_the_package_are_those_of_monte_carlo(name):
    """Of rods at random, and of rods that are nearly parallel, which touch at two places."""
    system = {"loop": LOOP, "slab": RODS_IN_A_SLAB, "plane": RODS_IN_A_PLANE}[name]
    dimensions = 2 if system.planar else 3
    simulation, totals = None, {}
    for seed in range(3 if system.rods > 3 else 10):
        middles, along = random_rods(system, 1, seed)
        generator = np.random.default_rng(seed)
        for rod in range(0, system.rods - 1, 2):
            for vectors, spread in ((along, 1.0), (middles, 15.0)):
                vectors[0, rod + 1] = vectors[0, rod]
                vectors[0, rod + 1, :dimensions] += generator.normal(0, spread, dimensions)
        if system.wall:
            middles[..., 2] *= 1.3
        simulation = simulation or RodSimulation(system, middles, along)
        simulation.set_configuration(middles, along)
        distances, parallel = system.pairs(middles, along)
        totals["parallel"] = totals.get("parallel", 0) + parallel.sum()
        expected = {"contacts": system.contact_energies(distances, parallel).sum()}
        if system.wall:
            expected["walls"] = system.wall_energies(middles, along).sum()
        if system.links:
            expected["links"] = system.link_energies(middles, along).sum()
        for kind, value in expected.items():
            totals[kind] = totals.get(kind, 0.0) + value
            assert energy_of(simulation.context, simulation.groups[kind]) / KT == pytest.approx(value, rel=1e-9)
    assert min(totals.values()) > 1


@pytest.mark.slow
def test_monte_carlo_of_a_pair_is_that_of_draws():
    middles, along, weights = linked_pair(PAIR, 300000, 1)
    exact, exact_errors = means_of(PAIR, observe(PAIR, middles, along), weights)
    sampler = RodMonteCarlo(PAIR, middles[:1000], along[:1000], 2)
    sampler.sweep(100)
    means, errors = means_of(PAIR, sampler.means(observe, 50, 8))
    errors = np.hypot(errors, exact_errors)
    assert (4 * errors[2:7] < 0.1 * exact[2:7]).all()
    assert (np.abs(means - exact) < 4 * errors + 1e-12).all()


FACTORS = [1.0, pytest.param(0.1, marks=pytest.mark.slow), pytest.param(0.01, marks=pytest.mark.slow)]


@pytest.mark.sample("^1")
@pytest.mark.slow
@pytest.mark.parametrize("factor", FACTORS)
def test_a_pair_of_rods_on_a_spring(factor):
    middles, along, weights = linked_pair(PAIR, 3000, 7)
    kept = np.random.default_rng(8).random(len(weights)) < weights
    rows = _run(PAIR, middles[kept][:400], along[kept][:400], factor, 600, 4.0)
    check(PAIR, rows, *np.transpose(list(REFERENCES["pair"].values())))


@pytest.mark.exhaustive
@pytest.mark.parametrize("stiffness", [0.02, 1.0, 5.0])
def test_contacts_of_rods_on_springs(stiffness):
    """Of springs that are softer and stiffer than the contact, at the recommended step."""
    system = rod_system(2, links=[((0, 0.5), (1, 0.5), stiffness, 35.0)])
    middles, along, weights = linked_pair(system, 400000, 7)
    exact, exact_errors = means_of(system, observe(system, middles, along), weights)
    kept = np.random.default_rng(8).random(len(weights)) < weights
    rows = _run(system, middles[kept][:400], along[kept][:400], 1.0, 600, 4.0)
    check(system, rows, exact, exact_errors)


@pytest.mark.sample("^1")
@pytest.mark.slow
@pytest.mark.parametrize("factor", [1.0, 0.1])
def test_three_rods_in_a_loop(factor):
    rows = _run(LOOP, *_in_equilibrium(LOOP, 200, 300), factor, 500, 4.0)
    check(LOOP, rows, *np.transpose(list(REFERENCES["loop"].values())))


@pytest.mark.sample("^1")
@pytest.mark.slow
@pytest.mark.parametrize("factor", [1.0, 0.1])
def test_rods_between_walls_with_contacts(factor):
    """Twenty-four of 100 nm, between walls 100 nm apart."""
    system = RODS_IN_A_SLAB
    rows = _run(system, *_in_equilibrium(system, 1, 300), factor, 12000, 6.0, blocks=20)
    check(system, rows, *np.transpose(list(REFERENCES["slab"].values())))


@pytest.mark.sample(r"1\.0")
@pytest.mark.slow
@pytest.mark.parametrize("factor", [1.0, 0.1])
@pytest.mark.parametrize("name", ["space", "plane"])
def test_dense_rods(name, factor):
    system = CASES[name]
    rows = _run(system, *_in_equilibrium(system, 1, 300), factor, 5000, 12.0, blocks=20)
    check(system, rows, *np.transpose(list(REFERENCES[name].values())))


@pytest.mark.exhaustive
@pytest.mark.parametrize("name", RODS_IN_A_WIDE_SLAB)
def test_equation_of_state(name):
    """Forces of walls on rods that touch each other, at the recommended step: their pressure at a density."""
    system = CASES[name]
    of_walls = system.without_contacts()
    simulation = RodSimulation(system, *_in_equilibrium(system, 1, 300))
    simulation.integrator.step(2000)
    # As many rods are at the walls in all of the cases.
    samples = 6000000 // system.rods
    rows = simulation.rows(lambda _, *rods: observe(of_walls, *rods), samples, 2, blocks=20)
    check(of_walls, rows, *np.transpose([REFERENCES[name][each] for each in observable_names(of_walls)]))


@pytest.mark.sample(r"^1\.0-|^0\.1-0\.5")
@pytest.mark.parametrize(
    "stiffness", [pytest.param(0.05, marks=pytest.mark.slow), 0.5, pytest.param(5.0, marks=pytest.mark.slow)]
)
@pytest.mark.parametrize("factor", FACTORS)
def test_rods_between_walls(stiffness, factor):
    system = rods_between_walls(stiffness)
    # Fewer are beyond a stiff wall.
    rows = _run(system, *_in_equilibrium(system, 400, 300), factor, 1000 if stiffness < 1 else 2500, 4.0)
    exact = rod_cases.quadrature_between_walls(system)
    check(system, rows, exact, np.zeros(len(exact)))


@pytest.mark.exhaustive
@pytest.mark.parametrize("name", CASES)
def test_references_are_those_of_monte_carlo(name):
    """Within what a minute can see."""
    system = CASES[name]
    copies = max(20, 600 // system.rods)
    sampler = RodMonteCarlo(system, *random_rods(system, copies, 11), seed=12)
    sampler.sweep(300)
    means, errors = means_of(system, sampler.means(observe, 60000 // (copies * system.rods) + 100, 3))
    exact, exact_errors = np.transpose(list(REFERENCES[name].values()))
    assert (np.abs(means - exact) < 4 * np.hypot(errors, exact_errors) + 1e-9).all()


def _force_of_bent_filament(segments, length, rigidity, stretching, radius, wall):
    """On each end of a filament that a sphere bends: what is least of its energy, of half of it in a plane."""
    half = segments // 2
    joint = rigidity / length

    def depth(values):
        angles, lengths = values[:half], length + values[half:]
        return (lengths * np.cos(angles)).sum() - radius

    def energy(values):
        angles = values[:half]
        bends = np.append(np.diff(angles), 2 * angles[0])
        tangents = 2 * joint * np.tan(0.5 * bends) ** 2
        tangents[-1] *= 0.5
        return tangents.sum() + 0.5 * wall * max(depth(values), 0) ** 2 + 0.5 * stretching * (values[half:] ** 2).sum()

    values = np.concatenate([0.9 * np.sin(np.pi * (np.arange(half) + 0.5) / segments), np.zeros(half)])
    for _ in range(3):
        values = minimize(energy, values, method="BFGS", options={"gtol": 1e-5, "maxiter": 20000}).x
    return wall * depth(values)


@pytest.mark.parametrize("step", [5000.0, 1000.0, pytest.param(100.0, marks=pytest.mark.slow)])
def test_a_filament_that_a_sphere_bends(step):
    """Twelve um in a sphere of 5 um radius: walls and bends balance. Thermal motion is a small part of the force."""
    rigidity, modulus, wall = 20e6, 10000.0, 0.2
    exact = _force_of_bent_filament(24, 500.0, rigidity, modulus / 500.0, 5000.0, wall)
    assert exact == pytest.approx(1.498, abs=0.001)
    kind = FilamentType(
        name="MT", diameter=25, segment_length=500, bending_rigidity=rigidity * PICONEWTON_PER_NANOMETER,
        stretching_modulus=modulus * PICONEWTON_PER_NANOMETER, extension_relaxation_time=1000.0,
        friction_length="filament",
    )  # fmt: skip
    filaments = Filaments(0.02 * unit.pascal * unit.second, 304.2)
    # An arc of a circle whose chord is the diameter of the sphere.
    angle = brentq(lambda half: np.sin(half) / half - 10 / 12, 0.1, 2.0)
    angles = np.linspace(-angle, angle, 25)
    for _ in range(8):
        filaments.add_nodes(kind, 6000.0 / angle * np.column_stack([np.sin(angles), np.cos(angles) - 1, 0 * angles]))
    _, system, positions = filaments.build()
    stiffness = wall * PICONEWTON_PER_NANOMETER
    system.addForce(filament_wall_force(filaments, system, Sphere([0, 0, 0], 5000.0), stiffness))
    integrator = filaments.create_integrator(system, step * MICROSECOND, random_seed=2, checks=False)
    context = new_context(system, positions, integrator, "CPU", {"Threads": "1"})
    ends = np.array(filaments.node_indices)[:, [0, -1]]
    steps = 4000 if step >= 1000 else 20000
    # It relaxes in half a second.
    integrator.setStepSize(5e9)
    integrator.step(1000)
    integrator.setStepSize(step * MICROSECOND)
    integrator.step(steps // 4)
    wall_forces(context)
    depths = []
    for _ in range(steps):
        integrator.step(1)
        depths.append(np.maximum(np.linalg.norm(positions_of(context)[ends], axis=2) - 5000.0, 0.0).mean(axis=1))
    forces = wall * np.mean(depths, axis=0)
    error = forces.std(ddof=1) / np.sqrt(len(forces))
    assert 4 * error < 0.05 * exact
    assert forces.mean() == pytest.approx(exact, abs=0.02 * exact + 4 * error)
    # The same from what the wall has pushed with over steps.
    found = np.linalg.norm(wall_forces(context)[0].forces._value[ends], axis=2).mean(axis=1)
    assert found.mean() / PICONEWTON_PER_NANOMETER == pytest.approx(exact, abs=0.02 * exact + 4 * error)
