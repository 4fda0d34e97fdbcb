"""Errors of a simulation that cannot go on: what and where as attributes, beside the message."""

import pickle

import numpy as np
import openmm
import pytest

from openmm_cylchain import DSDNA, F_ACTIN, Filaments, InstabilityError
from openmm_cylchain.engines import compiled
from openmm_cylchain.engines.compiled import CylinderChainForce, CylinderChainIntegrator

VISCOSITY = 1029.8
TEMPERATURE = 310.0


def blown_up(engine, particle_of, scheme="midpoint"):
    """The error of a step in which the force on a particle is not finite."""
    filaments = Filaments(VISCOSITY, TEMPERATURE, engine=engine)
    for number, kind in enumerate((F_ACTIN, DSDNA)):
        filaments.add_equilibrium(kind, 4, seed=number + 1, start=[0, 0, 500.0 * number])
    _, system, positions = filaments.build()
    system.addParticle(1.0)
    force = openmm.CustomExternalForce("sqrt(-1-x^2)*on")
    force.addGlobalParameter("on", 0.0)
    force.addParticle(particle_of(filaments))
    system.addForce(force)
    integrator = filaments.create_integrator(system, 1.0, scheme=scheme, particle_friction=1e4, checks=False)
    context = openmm.Context(system, integrator, openmm.Platform.getPlatform("Reference"))
    context.setPositions(np.concatenate([positions._value, [[0, 0, 2000.0]]]))
    with pytest.raises(InstabilityError) as raised:
        integrator.step(2)
    return raised.value


@pytest.mark.parametrize(
    "engine, scheme", [("compiled", "implicit"), ("compiled", "midpoint"), ("portable", "midpoint")]
)
def test_instability_of_a_filament(engine, scheme):
    error = blown_up(engine, lambda filaments: int(filaments.node_indices[1][2]), scheme)
    assert str(error).startswith("Filament 1 (DNA) has blown up at segment 1 in step 1: the force on it")
    assert (error.filament, error.segment, error.particle, error.step) == (1, 1, None, 1)
    again = pickle.loads(pickle.dumps(error))
    assert str(again) == str(error) and (again.filament, again.segment, again.step) == (1, 1, 1)


@pytest.mark.parametrize("engine", ["compiled", "portable"])
def test_instability_of_another_particle(engine):
    error = blown_up(engine, lambda filaments: sum(map(len, filaments.node_indices)))
    assert str(error).startswith("Particle 10, outside filaments, has blown up in step 1: the force on it")
    assert (error.filament, error.segment, error.particle, error.step) == (None, None, 10, 1)


def test_instability_without_a_place():
    error = InstabilityError("It has blown up.")
    assert str(error) == "It has blown up."
    assert (error.filament, error.segment, error.particle, error.step) == (None, None, None, None)


def chain_in(system, positions, stretching=CylinderChainForce.Harmonic):
    """A Context with a chain of two segments of the length 10, of the plugin alone, and its integrator."""
    force = CylinderChainForce()
    force.addChain([0, 1, 2], CylinderChainForce.KratkyPorod, stretching, 10, 100, 2, 1, 1, 1, 1, 1)
    system.addForce(force)
    for _ in range(3):
        system.addParticle(1.0)
    integrator = CylinderChainIntegrator(300, 1, 1e-3)
    context = openmm.Context(system, integrator, openmm.Platform.getPlatform("Reference"))
    context.setPositions(positions)
    return context, integrator


def test_exceptions_of_the_plugin():
    exception = compiled.plugin.CylinderChainException
    assert issubclass(exception, openmm.OpenMMException)

    periodic = openmm.System()
    periodic.setDefaultPeriodicBoxVectors([50, 0, 0], [0, 50, 0], [0, 0, 50])
    lattice = openmm.NonbondedForce()
    lattice.setNonbondedMethod(openmm.NonbondedForce.CutoffPeriodic)
    for _ in range(3):
        lattice.addParticle(0, 1, 0)
    periodic.addForce(lattice)
    _context, integrator = chain_in(periodic, [[5, 0, 0], [15, 0, 0], [65, 0, 0]])
    with pytest.raises(exception, match="^Chain 0 is torn at segment 1: ") as raised:
        integrator.step(1)
    error = raised.value
    assert (error.kind, error.chain, error.segment, error.particle, error.step) == ("torn-chain", 0, 1, None, None)

    _context, integrator = chain_in(openmm.System(), [[0, 0, 0], [15, 0, 0], [25, 0, 0]], CylinderChainForce.FENE)
    with pytest.raises(exception, match="^Chain 0 is out of range at segment 0: ") as raised:
        integrator.step(1)
    error = raised.value
    assert (error.kind, error.chain, error.segment, error.step) == ("length-out-of-range", 0, 0, None)

    _context, integrator = chain_in(openmm.System(), [[0, 0, 0], [10, 0, 0], [20, 0, 0]])
    with pytest.raises(exception, match="No tensions were recorded") as raised:
        integrator.getMeanTensions(0)
    assert raised.value.kind == "nothing-recorded"

    with pytest.raises(openmm.OpenMMException) as raised:
        integrator.setPathLevel(99)
    assert not isinstance(raised.value, exception)
