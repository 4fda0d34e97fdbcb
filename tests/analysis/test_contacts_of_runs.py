"""Contacts of a Context and of a run: their forces, and their stress by straining what touches."""

import dataclasses

import numpy as np
import openmm
import pytest
from openmm import app, unit

from openmm_cylchain import (
    F_ACTIN,
    Filaments,
    InputError,
    RunReporter,
    analysis,
    capsule_contact_force,
    find_contacts,
)
from openmm_cylchain.units.quantities import thermal_energy

DIAMETER, BOX, TEMPERATURE = 30.0, 400.0, 300.0
KIND = dataclasses.replace(F_ACTIN, segment_length=40.0)


def crowd(seed=5, periodic=True, size=BOX):
    """Filaments and spheres at random places in a box, which overlap; a System with their contacts."""
    generator = np.random.default_rng(seed)
    filaments = Filaments(1e-3, TEMPERATURE)
    for number in range(60):
        filaments.add_equilibrium(KIND, 5, number, generator.uniform(0, size, 3), generator.normal(size=3))
    topology, system, positions = filaments.build()
    places = np.concatenate([positions.value_in_unit(unit.nanometer), generator.uniform(0, size, (20, 3))])
    spheres = [system.addParticle(1.0) for _ in range(20)]
    if periodic:
        system.setDefaultPeriodicBoxVectors(*(size * np.eye(3)).tolist())
    force = capsule_contact_force(
        filaments, system, DIAMETER, particles=spheres, particle_diameter=40.0, periodic=periodic
    )
    force.setForceGroup(3)
    system.addForce(force)
    return filaments, topology, system, force, places


def context_of(system):
    return openmm.Context(system, openmm.VerletIntegrator(0.001), openmm.Platform.getPlatformByName("Reference"))


def test_forces_of_contacts_are_those_on_particles():
    filaments, _, system, force, positions = crowd()
    context = context_of(system)
    context.setPositions(positions)
    state = context.getState(forces=True, energy=True, groups={3})
    found = find_contacts(force, context)
    assert len(found) > 50 and np.any(found.filaments < 0)
    diameters = np.where(found.filaments < 0, 40.0, DIAMETER)
    np.testing.assert_allclose(found.distances - found.gaps, diameters.mean(axis=1))
    total = np.zeros_like(positions)
    for side, sign in ((0, 1.0), (1, -1.0)):
        for number in range(len(found)):
            pull = sign * found.forces[number] * found.directions[number]
            own, segment, place = (
                column[number, side] for column in (found.filaments, found.segments, found.fractions)
            )
            if own < 0:
                total[len(positions) - 20 + segment] += pull
            else:
                nodes = filaments.node_indices[own]
                total[nodes[segment]] += (1.0 - place) * pull
                total[nodes[segment + 1]] += place * pull
    expected = state.getForces(asNumpy=True)._value
    np.testing.assert_allclose(total, expected, atol=1e-9 * np.abs(expected).max())


def test_the_stress_of_contacts_is_the_change_of_energy_by_strain(tmp_path):
    """In a box by strains that leave it one of OpenMM's; what a run writes, at its single precision."""
    filaments, topology, system, force, positions = crowd()
    for _ in range(20):
        topology.addAtom("S", None, topology.addResidue("S", topology.addChain()))
    topology.setPeriodicBoxVectors(BOX * np.eye(3) * unit.nanometer)
    simulation = app.Simulation(
        topology, system, openmm.VerletIntegrator(1e-9), openmm.Platform.getPlatformByName("Reference")
    )
    simulation.context.setPositions(positions)
    simulation.reporters.append(RunReporter(tmp_path / "run", 1, filaments))
    simulation.step(1)
    del simulation
    run = analysis.load(tmp_path / "run", incomplete=True)
    frame = len(run) - 1
    found = analysis.stress(run, frame)
    context = context_of(system)

    def energy(strain):
        matrix = np.eye(3) + strain
        context.setPeriodicBoxVectors(*(run.box @ matrix.T).tolist())
        context.setPositions(run.positions(frame) @ matrix.T)
        return context.getState(energy=True, groups={3}).getPotentialEnergy()._value

    expected = np.zeros((3, 3))
    for i, j in ((0, 0), (1, 1), (2, 2), (0, 1), (0, 2), (1, 2)):
        strain = np.zeros((3, 3))
        strain[i, j] = 1e-7
        expected[i, j] = expected[j, i] = (energy(strain) - energy(-strain)) / 2e-7
    scale = np.abs(expected).max()
    assert scale > 100.0 * thermal_energy(TEMPERATURE)
    np.testing.assert_allclose(BOX**3 * found.contacts, expected, atol=1e-5 * scale)
    contacts = run.contacts(frame)
    assert np.trace(found.contacts) < 0.0 and len(contacts) > 50
    np.testing.assert_allclose(found.total, found.chains + found.contacts + found.ideal)


def test_bad_input_is_refused():
    _, _, system, force, positions = crowd(periodic=False)
    with pytest.raises(InputError, match="must be one of capsule_contact_force"):
        find_contacts(openmm.HarmonicBondForce(), context_of(system))
    context = context_of(system)
    context.setPositions(positions)
    _, _, other, stranger, _ = crowd()
    with pytest.raises(InputError, match="Contacts are not to be found"):
        find_contacts(stranger, context)
    assert len(find_contacts(force, context)) > 0
