"""Tethers of beam elements: energy and forces, moving them, statics, equilibrium, XML, and pulls."""

import copy

import numpy as np
import openmm
import pytest
from openmm import unit
from scipy.optimize import minimize
from scipy.spatial.transform import Rotation

from openmm_cylchain import ConstantVelocityPulling, Crosslinks, Filaments, InputError
from openmm_cylchain.beams.curve import element_energies
from openmm_cylchain.beams.equilibrium import draw_beam
from support.contexts import energy_of, forces_of, new_context, positions_of
from support.linked_beams import BEAM, LENGTH, STRAIGHT
from support.solvent import KT, TEMPERATURE, VISCOSITY

SIGMAS = 4.0
BENDS = 1.93
"""Of an element of a quarter of a persistence length in space, in k_B T: see the tests of chains without links."""


def tethered(points, stiffness, elements=3, temperature=TEMPERATURE, **options):
    """A beam, and a straight filament before it, which has a tether of its own."""
    filaments = Filaments(VISCOSITY, temperature, engine="compiled")
    filaments.add_straight(STRAIGHT, 2, [0, -500, 0], [1, 0, 0])
    filaments.add_straight(BEAM, elements, [0, 0, 0], [1, 0, 0], **options)
    filaments.add_tether(0, 1, [130, -500, 0], 0.5)
    for node, point in points.items():
        filaments.add_tether(1, node, point * unit.nanometer, stiffness * unit.kilojoule_per_mole / unit.nanometer**2)
    return filaments


@pytest.mark.parametrize("platform", ["Reference", "CPU"])
def test_energy_and_forces_of_tethers_that_are_moved(platform):
    filaments = tethered({0: [3, 4, 0], -1: [3 * LENGTH, 0, 1]}, 0.2)
    _, system, positions = filaments.build()
    context = new_context(system, positions, platform=platform)
    here = filaments.in_context(context)
    rest = 0.25 * 5.0**2
    free = Filaments(VISCOSITY, TEMPERATURE, engine="compiled")
    free.add_straight(BEAM, 3, [0, 0, 0], [1, 0, 0])
    of_beam = energy_of(new_context(free.build()[1], positions[3:]))
    assert energy_of(context) - of_beam == pytest.approx(rest + 0.1 * 25 + 0.1 * 1, rel=1e-9)
    before = forces_of(context)
    here.move_tether(1, [3, 4, 5], 0.4)
    node, control = filaments.node_indices[1][0], filaments.control_point_indices[1][0]
    assert energy_of(context) - of_beam == pytest.approx(rest + 0.2 * 50 + 0.1, rel=1e-9)
    change = forces_of(context) - before
    assert change[node] == pytest.approx(0.4 * np.array([3, 4, 5]) - 0.2 * np.array([3, 4, 0]))
    assert change[control] == pytest.approx(0.0)
    # A new Context begins as filaments were described, and the tether of the straight filament has stayed.
    fresh = new_context(system, positions, platform=platform)
    assert energy_of(fresh) - of_beam == pytest.approx(rest + 2.6, rel=1e-9)
    assert [tether.stiffness for tether in here.tethers()] == [0.5, 0.4, 0.2]


def test_copies_and_xml_keep_tethers():
    from openmm_cylchain.engines.compiled import CylinderChainForce

    _, system, _ = tethered({0: [1, 2, 3], 2: [4, 5, 6]}, 0.7).build()
    force = CylinderChainForce.cast(system.getForce(0))
    for duplicate in (copy.deepcopy(force), openmm.XmlSerializer.deserialize(openmm.XmlSerializer.serialize(force))):
        duplicate = CylinderChainForce.cast(duplicate)
        assert duplicate.getNumTethers() == force.getNumTethers() == 3
        found = [duplicate.getTetherParameters(i) for i in range(3)]
        assert (1, 2, (4, 5, 6), 0.7) in [(chain, node, tuple(at._value), k._value) for chain, node, at, k in found]
    with pytest.raises(openmm.OpenMMException, match="no node 4 in chain 1"):
        force.addTether(1, 4, openmm.Vec3(0, 0, 0), 1.0)
    with pytest.raises(openmm.OpenMMException, match="cannot have two tethers"):
        force.addTether(1, 0, openmm.Vec3(0, 0, 0), 1.0)
    with pytest.raises(openmm.OpenMMException, match="cannot be negative"):
        force.addTether(1, 1, openmm.Vec3(0, 0, 0), -1.0)


def test_what_is_refused():
    filaments = tethered({0: [0, 0, 0]}, 1.0)
    with pytest.raises(InputError, match="has a tether already"):
        filaments.add_tether(1, 0, [0, 0, 0], 1.0)
    with pytest.raises(InputError, match="node"):
        filaments.add_tether(1, 4, [0, 0, 0], 1.0)


@pytest.mark.parametrize("linked", [False, True])
def test_a_clamped_beam_on_a_spring_relaxes_to_the_least_energy(linked):
    """Without noise, in long steps; and in steps of coupled filaments, where a link does not pull."""
    spring, point = 0.5, np.array([1.7 * LENGTH, 0.9 * LENGTH, 20.0])
    filaments = tethered({-1: point}, spring, 2, 0.0, clamped=0, clamped_tangents=0)
    _, system, positions = filaments.build()
    if linked:
        links = Crosslinks(1e-12, 0.0)
        links.add(None, int(filaments.node_indices[0][0]), int(filaments.node_indices[1][0]))
        links.add_to(system)
    integrator = filaments.create_integrator(system, 1e6, checks=False)
    context = new_context(system, positions, integrator)
    integrator.step(400)
    found = positions_of(context)
    element = filaments[1].beam_element(0.0)
    start = np.stack([filaments[1].positions, filaments[1].control_points])

    def energy(free):
        points = start.copy()
        points[:, 1:] = free.reshape(2, 2, 3) * LENGTH
        parts = sum(part.sum() for part in element_energies(*points, element))
        return parts + 0.5 * spring * np.sum((points[0, -1] - point) ** 2)

    search = minimize(energy, start[:, 1:].ravel() / LENGTH, method="BFGS", jac="3-point", options={"gtol": 1e-4})
    least = search.x.reshape(2, 2, 3)
    for own, place in zip((filaments.node_indices[1], filaments.control_point_indices[1]), least):
        assert found[own][1:] == pytest.approx(place * LENGTH, abs=2e-3 * LENGTH)
    assert (
        np.linalg.norm(found[filaments.node_indices[1][-1]] - positions._value[filaments.node_indices[1][-1]]) > 100.0
    )


@pytest.mark.sample(r"0\.01-True|^1\.0-False|100\.0-True")
@pytest.mark.parametrize("linked", [False, True])
@pytest.mark.parametrize("stiffness", [1e-2, 1.0, 100.0])
def test_equilibrium_on_one_tether_is_that_of_a_free_beam(stiffness, linked):
    """3/2 k_B T in the tether, and the bends of a free chain, at the recommended step."""
    copies, samples = 400, 60
    filaments, generator = Filaments(VISCOSITY, TEMPERATURE, engine="compiled"), np.random.default_rng(4)
    for number in range(copies):
        filaments.add_equilibrium(BEAM, 2, seed=number)
        away = generator.normal(size=3) * np.sqrt(KT / stiffness)
        filaments.add_tether(number, 1, filaments[number].positions[1] + away, stiffness)
    _, system, positions = filaments.build()
    if linked:
        links = Crosslinks(1e-9, 0.0)
        links.add(None, int(filaments.node_indices[0][0]), int(filaments.node_indices[1][0]))
        links.add_to(system)
    step = filaments.recommended_time_step(system=system)
    assert not step.unknown_forces
    integrator = filaments.create_integrator(system, step, random_seed=3)
    context = new_context(system, positions, integrator, "CPU")
    integrator.step(50)
    energies, bends = [], []
    nodes, controls = (np.array(own) for own in (filaments.node_indices, filaments.control_point_indices))
    points = np.array([tether.point for tether in filaments.tethers])
    for _ in range(samples):
        integrator.step(10)
        now = positions_of(context)
        energies.append(0.5 * stiffness * np.sum((now[nodes[:, 1]] - points) ** 2, axis=1) / KT)
        element = filaments[0].beam_element(TEMPERATURE)
        bends.append(element_energies(now[nodes], now[controls], element)[1].mean(axis=1) / KT)
    for values, expected, allowed in ((energies, 1.5, 0.01), (bends, BENDS, 0.01)):
        means = np.mean(values, axis=0)
        error = np.std(means, ddof=1) / np.sqrt(copies)
        print(np.mean(means), expected, error)
        assert error < 0.0125 * expected
        assert abs(np.mean(means) - expected) < SIGMAS * error + allowed * expected


@pytest.mark.slow
def test_equilibrium_between_two_tethers_is_that_of_weighted_draws():
    """Springs at both ends of an element, half of its length apart: how far they reach, and how much it is bent."""
    draws, copies, samples, stiffness, apart = 200000, 800, 60, 2e-3, 0.5 * LENGTH
    generator, element = np.random.default_rng(8), BEAM.beam_element(TEMPERATURE)
    chain = draw_beam(element, draws, KT, generator, np.zeros(3), None, False)
    nodes, controls = (np.stack([own[:-1], own[1:]], axis=1) for own in chain)
    turns, origins = Rotation.random(draws, random_state=2), nodes[:, :1].copy()
    nodes, controls = (
        np.stack([turns.apply(own[:, end] - origins[:, 0]) for end in (0, 1)], axis=1) for own in (nodes, controls)
    )
    points = np.array([[0.0, 0.0, 0.0], [apart, 0.0, 0.0]])
    ends = nodes[:, 1] - nodes[:, 0]
    # The two springs, of which one place is integrated over, are one of half the stiffness between end and point.
    weights = np.exp(-0.25 * stiffness * np.sum((ends - points[1]) ** 2, axis=1) / KT)
    weights /= weights.sum()
    assert 1.0 / np.sum(weights**2) > 0.01 * draws

    def measure(nodes, controls):
        ends = nodes[:, 1] - nodes[:, 0]
        bends = element_energies(nodes, controls, element)[1][:, 0] / KT
        return ends[:, 0] / LENGTH, np.sum(ends**2, axis=1) / LENGTH**2, bends

    values = measure(nodes, controls)
    expected = [float(weights @ each) for each in values]
    errors = [np.sqrt(np.sum((weights * (each - mean)) ** 2)) for each, mean in zip(values, expected)]
    filaments = Filaments(VISCOSITY, TEMPERATURE, engine="compiled")
    for _ in range(copies):
        number = filaments.add_straight(BEAM, 1, [0, 0, 0], [1, 0, 0])
        for node in (0, 1):
            filaments.add_tether(number, node, points[node], stiffness)
    _, system, positions = filaments.build()
    positions, chosen = positions._value, generator.choice(draws, copies, p=weights)
    indices = [np.array(own) for own in (filaments.node_indices, filaments.control_point_indices)]
    shift = 0.5 * (points[1] - ends[chosen])[:, None]
    for own, drawn in zip(indices, (nodes, controls)):
        positions[own] = drawn[chosen] + shift
    integrator = filaments.create_integrator(system, filaments.recommended_time_step(system=system), random_seed=3)
    context = new_context(system, positions, integrator, "CPU")
    integrator.step(100)
    measured = []
    for _ in range(samples):
        integrator.step(20)
        now = positions_of(context)
        measured.append(measure(*(now[own] for own in indices)))
    for mean, value, uncertainty, least in zip(np.mean(measured, axis=0), expected, errors, (0.0125, 0.0125, 0.0125)):
        error = np.hypot(np.std(mean, ddof=1) / np.sqrt(copies), uncertainty)
        print(np.mean(mean), value, error)
        assert error < least * value
        assert abs(np.mean(mean) - value) < SIGMAS * error + 0.01 * value


def test_pulling_at_constant_velocity():
    """Slowly and without noise, the mean force of the spring is the drag of the beam that follows it.

    The point moves once in ten steps, so that it is ahead of its mean by half of that then.
    """
    filaments = Filaments(VISCOSITY, 0.0, engine="compiled")
    filaments.add_straight(BEAM, 2, [0, 0, 0], [1, 0, 0])
    tether = filaments.add_tether(0, -1, [2 * LENGTH, 0, 0], 0.1)
    _, system, positions = filaments.build()
    integrator = filaments.create_integrator(system, 1e5, checks=False)
    context = new_context(system, positions, integrator)
    simulation = type("Simulation", (), {"context": context, "integrator": integrator, "currentStep": 0})()
    velocity = 1e-5
    pulling = ConstantVelocityPulling(None, 10, filaments, tether, [velocity, 0, 0])
    pulling.describeNextReport(simulation)
    for _ in range(40):
        integrator.step(10)
        simulation.currentStep += 10
        pulling.report(simulation, context.getState(positions=True, energy=True, enforcePeriodicBox=False))
    friction = 2 * BEAM.segment_friction(VISCOSITY, 0.0, 2).parallel
    lag = filaments.in_context(context).tethers()[0].point[0] - positions_of(context)[filaments.node_indices[0][-1], 0]
    assert lag == pytest.approx(friction * velocity / 0.1 + 0.5 * 10 * 1e5 * velocity, rel=0.01)
