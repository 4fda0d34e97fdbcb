"""Chains of beam elements in the compiled engine: forces, statics, equilibrium, States, and what is refused."""

import numpy as np
import openmm
import pytest
from openmm import unit

from openmm_cylchain.engines.compiled import (
    BENDING_MODELS,
    STRETCHING_MODELS,
    CylinderChainForce,
    CylinderChainIntegrator,
    plugin,
)
from support.beam_contexts import beam_context
from support.contexts import positions_of
from support.solvent import KT, TEMPERATURE

PLATFORMS = ("Reference", "CPU")


def straight_beam(elements, length, start):
    """Positions (2 (elements+1), 3) of nodes and control points along x."""
    nodes = np.arange(elements + 1) * length
    x = np.column_stack([nodes, nodes + length / 3]).reshape(-1)
    return start + x[:, None] * np.array([1.0, 0.0, 0.0])


def beam_system(count, elements, length, rigidity, modulus, clamped=False, friction=(1.0, 2.0), planar=False):
    """A System of chains side by side, and its positions."""
    system, force, positions = openmm.System(), CylinderChainForce(), []
    for chain in range(count):
        particles = range(2 * (elements + 1) * chain, 2 * (elements + 1) * (chain + 1))
        for particle in particles:
            system.addParticle(0.0 if clamped and particle - particles[0] < 2 else 1.0)
        force.addBeamChain(list(particles), length, modulus, rigidity, 0.0, *friction, planar)
        positions.append(straight_beam(elements, length, np.array([0.0, 3.0 * chain, 0.0])))
    system.addForce(force)
    return system, force, np.concatenate(positions)


@pytest.mark.parametrize("platform", PLATFORMS)
def test_forces_are_differences_of_the_energy(platform):
    system, _, positions = beam_system(2, 2, 1.0, 20.0, 1e3)
    positions = positions + np.random.default_rng(1).normal(0.0, 0.05, positions.shape)
    context = beam_context(system, positions, 0.01, platform=platform)
    state = context.getState(forces=True, energy=True)
    forces = state.getForces(asNumpy=True)._value
    parts = CylinderChainForce.cast(system.getForce(0)).computeEnergies(context)
    assert sum(part._value for part in parts) == pytest.approx(state.getPotentialEnergy()._value, rel=1e-12)
    width = 1e-5
    for particle, axis in ((0, 0), (1, 1), (4, 2), (9, 0), (11, 1)):
        energies = []
        for sign in (1, -1):
            moved = positions.copy()
            moved[particle, axis] += sign * width
            context.setPositions(moved)
            energies.append(context.getState(energy=True).getPotentialEnergy()._value)
        slope = (energies[0] - energies[1]) / (2 * width)
        assert forces[particle, axis] == pytest.approx(-slope, rel=1e-4, abs=1e-4)


@pytest.mark.parametrize("platform", PLATFORMS)
@pytest.mark.parametrize(
    ("elements", "load", "back", "across"),
    [(1, 1.0, 0.0564332363, 0.3017207738), (2, 10.0, 0.5549955978, 0.8106090249)],
)
def test_cantilever_is_the_elastica(platform, elements, load, back, across):
    """The end of a cantilever under P L^2/EI, within 0.15 %, with an OpenMM force on the particle of its end."""
    system, _, positions = beam_system(1, elements, 1.0 / elements, 1.0, 1e6, clamped=True)
    pull = openmm.CustomExternalForce("-pull*y")
    pull.addGlobalParameter("pull", load)
    pull.addParticle(2 * elements)
    system.addForce(pull)
    context = beam_context(system, positions, 0.02, temperature=0.0, platform=platform)
    context.getIntegrator().step(400)
    end = positions_of(context)[2 * elements]
    assert np.array_equal(positions_of(context)[:2], positions[:2])
    assert 1.0 - end[0] == pytest.approx(back, rel=1.5e-3)
    assert end[1] == pytest.approx(across, rel=1.5e-3)


def test_equilibrium_of_a_stiff_cantilever():
    """<y^2> = k_B T L^3/3EI at every node, in steps far longer than what it takes to relax."""
    count, elements, length, rigidity = 64, 3, 0.5, 2000.0 * KT
    system, _, positions = beam_system(count, elements, length, rigidity, 1e5 * KT, clamped=True, friction=(KT, 2 * KT))
    context = beam_context(system, positions, 0.03)
    integrator = context.getIntegrator()
    integrator.step(50)
    samples = []
    for _ in range(500):
        integrator.step(2)
        samples.append((positions_of(context) - positions).reshape(count, 2 * (elements + 1), 3)[:, ::2, 1:])
    deflections = np.concatenate(samples)
    for node in range(1, elements + 1):
        expected = KT * (node * length) ** 3 / (3 * rigidity)
        # Steps are nearly independent.
        error = np.sqrt(2.0 / deflections[:, node].size)
        assert error < 0.008
        assert np.mean(deflections[:, node] ** 2) == pytest.approx(expected, rel=5 * error)


def with_a_straight_chain(system, positions):
    """The positions of the same System with a chain of segments in the same force."""
    first = system.getNumParticles()
    for _ in range(4):
        system.addParticle(1.0)
    models = BENDING_MODELS["kratky-porod"], STRETCHING_MODELS["harmonic"]
    force = CylinderChainForce.cast(system.getForce(0))
    force.addChain([first, first + 1, first + 2, first + 3], *models, 1.0, 1e3, 0.0, 20.0, 1.0, 2.0, 0.2, 0.1)
    return np.concatenate([positions, np.array([[x, 50.0, 0.0] for x in range(4)])])


def test_steps_are_the_same_on_platforms_and_from_checkpoints_and_xml():
    system, _, positions = beam_system(5, 3, 1.0, 20.0 * KT, 1e4 * KT, friction=(KT, 2 * KT))
    positions = with_a_straight_chain(system, positions)
    ends = {}
    for platform in PLATFORMS:
        context = beam_context(system, positions, 1e-3, platform=platform)
        context.getIntegrator().step(30)
        checkpoint = context.createCheckpoint()
        context.getIntegrator().step(10)
        ends[platform] = positions_of(context)
        context.loadCheckpoint(checkpoint)
        context.getIntegrator().step(10)
        assert np.array_equal(positions_of(context), ends[platform])
    assert np.allclose(ends["Reference"], ends["CPU"], rtol=0, atol=1e-12)
    assert np.all(np.any(ends["CPU"] != positions, axis=1))
    again = openmm.XmlSerializer.deserialize(openmm.XmlSerializer.serialize(system))
    context = beam_context(again, positions, 1e-3)
    context.getIntegrator().step(40)
    assert np.array_equal(positions_of(context), ends["CPU"])


def test_parameters_are_read_back_and_changed_in_a_context():
    system, _, positions = beam_system(1, 2, 1.0, 20.0, 1e3, planar=True)
    force = CylinderChainForce.cast(system.getForce(0))
    assert force.getNumChains() == 1 and force.isChainPlanar(0)
    assert force.getChainKind(0) == CylinderChainForce.BeamElements
    assert list(force.getChainParticles(0)) == list(range(6))
    length, modulus, rigidity, shortening, along, across = force.getBeamChainParameters(0)
    assert (length, modulus) == (1.0 * unit.nanometer, 1e3 * unit.kilojoule_per_mole / unit.nanometer)
    assert rigidity == 20.0 * unit.kilojoule_per_mole * unit.nanometer
    assert (shortening._value, along._value, across._value) == (0.0, 1.0, 2.0)
    positions[4, 1] += 0.3
    positions[5, 1] += 0.3
    context = beam_context(system, positions, 0.01)
    bending = force.computeEnergies(context)[1]
    force.setBeamChainParameters(0, 1.0, 1e3, 40.0, 0.0, 1.0, 2.0)
    force.updateParametersInContext(context)
    assert force.computeEnergies(context)[1]._value == pytest.approx(2 * bending._value, rel=1e-12)


def test_beams_that_were_wrapped_into_a_box_are_refused_unless_they_are_periodic():
    system, _, positions = beam_system(1, 2, 1.0, 20.0, 1e3)
    system.setDefaultPeriodicBoxVectors(*(10.0 * np.eye(3)))
    other = openmm.HarmonicBondForce()
    other.setUsesPeriodicBoundaryConditions(True)
    system.addForce(other)
    wrapped = positions.copy()
    wrapped[3:, 0] -= 10.0
    ends = []
    for periodic in (False, True):
        force = CylinderChainForce.cast(system.getForce(0))
        force.setUsesPeriodicBoundaryConditions(periodic)
        if not periodic:
            refused_step(system, wrapped, "Chain 0 is torn at element 1")
            continue
        for start in (positions, wrapped):
            context = beam_context(system, start, 0.01)
            context.getIntegrator().step(5)
            ends.append(positions_of(context) - start)
    assert np.allclose(ends[0], ends[1], rtol=0, atol=1e-9)
    assert np.abs(ends[0]).max() > 1e-3


def refused_step(system, positions, message, scheme=None, temperature=TEMPERATURE):
    with pytest.raises(openmm.OpenMMException, match=message):
        context = beam_context(system, positions, 0.01, temperature)
        if scheme is not None:
            context.getIntegrator().setScheme(scheme)
        context.getIntegrator().step(1)


def test_what_beams_cannot_have_is_refused():
    system, force, positions = beam_system(1, 2, 1.0, 20.0, 1e3)
    refused_step(system, positions, "scheme Implicit alone", scheme=CylinderChainIntegrator.Midpoint)
    refused_step(
        system,
        positions,
        "8.* persistence lengths long.*divide it into more",
        temperature=8.0 * 20.0 / KT * TEMPERATURE,
    )
    with pytest.raises(openmm.OpenMMException, match="two particles for each of at least two nodes"):
        force.addBeamChain([0, 1, 2], 1.0, 1e3, 20.0, 0.0, 1.0, 2.0)
    with pytest.raises(openmm.OpenMMException, match="Particle 1 appears twice"):
        force.addBeamChain([0, 1, 1, 2], 1.0, 1e3, 20.0, 0.0, 1.0, 2.0)
    with pytest.raises(openmm.OpenMMException, match="bending rigidity of a chain of beam elements must be positive"):
        force.addBeamChain([0, 1, 2, 3], 1.0, 1e3, 0.0, 0.0, 1.0, 2.0)
    contacts = plugin.CylinderChainContactForce(1.0)
    contacts.addChain([0, 2, 4], 0.2)
    number = system.addForce(contacts)
    refused_step(system, positions, "contacts of this plugin between their nodes, but between virtual sites on their")
    system.removeForce(number)
    system.setParticleMass(3, 0.0)
    with pytest.raises(Exception, match="control point of node 1 of chain 0 is fixed"):
        beam_context(system, positions, 0.01)
