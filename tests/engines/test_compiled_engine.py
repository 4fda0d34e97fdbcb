"""The compiled engine: the same step as the portable one, XML, copies, checkpoints, threads, refusals."""

import copy
import os
import pickle
import subprocess
import sys
from dataclasses import replace

import numpy as np
import openmm
import pytest
from openmm import unit

from openmm_cylchain import DSDNA, F_ACTIN, Filaments, InputError, InstabilityError
from openmm_cylchain.engines import compiled as native
from openmm_cylchain.engines.compiled import CylinderChainForce, CylinderChainIntegrator
from openmm_cylchain.mechanics.potentials import BENDING_POTENTIALS
from openmm_cylchain.time_steps.schemes import SCHEMES
from support.contexts import energy_of, new_context, positions_of
from support.platforms import ON_COMPILED_PLATFORMS

VISCOSITY = 1029.8
TEMPERATURE = 310.0
STEP = {"F_ACTIN": 1000.0, "DSDNA": 1.0}


def filaments_of(engine, kind=F_ACTIN, chains=2, segments=6, clamped=()):
    """Chains of different lengths, drawn from equilibrium, with an engine."""
    filaments = Filaments(VISCOSITY, TEMPERATURE, engine=engine)
    for number in range(chains):
        filaments.add_equilibrium(
            kind, segments + number % 3, seed=number + 1, start=[0, 0, 500.0 * number], clamped=clamped
        )
    return filaments


def context_of(
    filaments, platform="Reference", others=0, temperature=TEMPERATURE, scheme="midpoint", seed=7, **properties
):
    """A Context with the filaments and some free particles."""
    topology, system, positions = filaments.build()
    for _ in range(others):
        system.addParticle(1.0)
    kind = filaments[0].type.name
    integrator = filaments.create_integrator(
        system,
        STEP["F_ACTIN" if kind == F_ACTIN.name else "DSDNA"],
        scheme=scheme,
        temperature=temperature,
        particle_friction=5.0e4,
        random_seed=seed,
    )
    more = np.arange(3.0 * others).reshape(-1, 3)
    positions = np.concatenate([positions._value, more])
    return new_context(system, positions, integrator, platform, properties), integrator


@ON_COMPILED_PLATFORMS
@pytest.mark.parametrize("scheme", ["midpoint", "euler"])
@pytest.mark.parametrize("kind", [F_ACTIN, DSDNA], ids=lambda kind: kind.name)
@pytest.mark.parametrize("clamped", [(), (0, 3)], ids=["free", "clamped"])
def test_step_without_noise_equals_portable(platform, scheme, kind, clamped):
    displacements = []
    for engine, where in (("compiled", platform), ("portable", "Reference")):
        filaments = filaments_of(engine, kind, clamped=clamped)
        context, integrator = context_of(filaments, where, temperature=0.0, scheme=scheme)
        before = positions_of(context)
        integrator.step(1)
        displacements.append(positions_of(context) - before)
    scale = np.abs(displacements[1]).max()
    assert np.abs(displacements[0] - displacements[1]).max() < platform.tolerance * scale + platform.rounding


@ON_COMPILED_PLATFORMS
@pytest.mark.parametrize("kind", [F_ACTIN, DSDNA], ids=lambda kind: kind.name)
def test_forces_and_energies_equal_portable(platform, kind):
    states = []
    for engine, where in (("compiled", platform), ("portable", "Reference")):
        context, _ = context_of(filaments_of(engine, kind), where)
        states.append(context.getState(energy=True, forces=True))
    compiled, portable = (state.getForces(asNumpy=True)._value for state in states)
    assert np.abs(compiled - portable).max() < platform.tolerance * np.abs(portable).max()
    compiled, portable = (state.getPotentialEnergy()._value for state in states)
    assert compiled == pytest.approx(portable, rel=platform.tolerance)
    assert states[0].getKineticEnergy()._value == 0.0


def test_energies_are_told_apart():
    context, _ = context_of(filaments_of("compiled"))
    force = CylinderChainForce.cast(context.getSystem().getForce(0))
    stretching, bending = force.computeEnergies(context)
    assert stretching.unit == unit.kilojoule_per_mole
    total = context.getState(energy=True).getPotentialEnergy()
    assert (stretching + bending)._value == pytest.approx(total._value, rel=1e-12)


@pytest.mark.parametrize("model", BENDING_POTENTIALS)
def test_system_survives_xml(model):
    filaments = filaments_of("compiled", replace(F_ACTIN, bending_model=model))
    _, system, _ = filaments.build()
    text = openmm.XmlSerializer.serialize(system)
    restored = openmm.XmlSerializer.deserialize(text)
    assert openmm.XmlSerializer.serialize(restored) == text
    force = restored.getForce(0)
    assert CylinderChainForce.isinstance(force)
    assert not CylinderChainForce.isinstance(openmm.HarmonicBondForce())
    force = CylinderChainForce.cast(force)
    assert force.getNumChains() == 2
    assert force.getChainParticles(1) == tuple(filaments.node_indices[1])
    assert force.getBendingModelNames()[force.getChainModels(1)[0]] == model


def integrator_with_everything_set():
    """An integrator whose every field differs from its default."""
    integrator = CylinderChainIntegrator(300 * unit.kelvin, 2 / unit.picosecond, 3 * unit.femtosecond)
    integrator.setScheme(CylinderChainIntegrator.Euler)
    integrator.setRandomNumberSeed(5)
    integrator.setParticleFriction(4, 1.5)
    integrator.setIntegrationForceGroups({0, 3})
    integrator.setConstraintTolerance(1e-7)
    return integrator


def force_with_everything_set():
    """A force whose every field differs from its default."""
    force = CylinderChainForce()
    force.addChain([2, 0, 1], CylinderChainForce.Quadratic, CylinderChainForce.FENE, *range(1, 9))
    force.setSegmentParameters(0, 1, *range(11, 18))
    force.setJointParameters(0, 0, 0.25)
    force.setForceGroup(4)
    force.setName("filaments")
    force.setUsesPeriodicBoundaryConditions(True)
    return force


@pytest.mark.parametrize("original", [integrator_with_everything_set(), force_with_everything_set()])
@pytest.mark.parametrize("copied", [copy.copy, copy.deepcopy, lambda one: pickle.loads(pickle.dumps(one))])
def test_copies_and_pickles(original, copied):
    duplicate = copied(original)
    assert type(duplicate) is type(original)
    assert openmm.XmlSerializer.serialize(duplicate) == openmm.XmlSerializer.serialize(original)
    if isinstance(duplicate, CylinderChainForce):
        assert duplicate.getSegmentParameters(0, 1)[0] == 11 * unit.nanometer
        assert duplicate.getJointParameters(0, 0) == 0.25 * unit.kilojoule_per_mole
    else:
        assert duplicate.getTemperature() == 300 * unit.kelvin
        assert duplicate.getParticleFrictions()[4]._value == 1.5


def test_units_are_converted():
    integrator = CylinderChainIntegrator(300 * unit.kelvin, 2 / unit.nanosecond, 3 * unit.femtosecond)
    assert integrator.getFriction()._value == pytest.approx(0.002)
    friction = 2 * unit.kilojoule_per_mole * unit.nanosecond / unit.nanometer**2
    integrator.setParticleFriction(0, friction)
    assert integrator.getParticleFrictions()[0]._value == pytest.approx(2000)


@ON_COMPILED_PLATFORMS
def test_checkpoint_is_bit_identical(platform):
    filaments = filaments_of("compiled")
    context, integrator = context_of(filaments, platform, others=3, seed=0)
    integrator.step(5)
    checkpoint = context.createCheckpoint()
    integrator.step(5)
    expected = positions_of(context)
    context.loadCheckpoint(checkpoint)
    integrator.step(5)
    assert np.array_equal(positions_of(context), expected)

    # The seed is part of it, so another Context goes on in the same way.
    context, integrator = context_of(filaments_of("compiled"), platform, others=3, seed=0)
    context.loadCheckpoint(checkpoint)
    integrator.step(5)
    assert np.array_equal(positions_of(context), expected)
    assert context.getStepCount() == 10


@ON_COMPILED_PLATFORMS
def test_state_carries_the_number_of_steps(platform):
    context, integrator = context_of(filaments_of("compiled"), platform)
    integrator.step(5)
    state = context.getState(positions=True, integratorParameters=True)
    integrator.step(5)
    expected = positions_of(context)
    context.reinitialize()
    context.setState(openmm.XmlSerializer.deserialize(openmm.XmlSerializer.serialize(state)))
    integrator.step(5)
    assert np.array_equal(positions_of(context), expected)


@ON_COMPILED_PLATFORMS
def test_reinitialize_preserves_state(platform):
    context, integrator = context_of(filaments_of("compiled"), platform, seed=0)
    integrator.step(5)
    checkpoint = context.createCheckpoint()
    integrator.step(5)
    expected = positions_of(context)
    context.loadCheckpoint(checkpoint)
    context.reinitialize(preserveState=True)
    integrator.step(5)
    assert np.array_equal(positions_of(context), expected)


def test_threads_and_platforms_do_not_matter():
    results = []
    for platform, properties in (("CPU", {"Threads": "1"}), ("CPU", {"Threads": "2"}), ("Reference", {})):
        filaments = filaments_of("compiled", chains=40)
        context, integrator = context_of(filaments, platform, others=200, **properties)
        integrator.step(20)
        energy = energy_of(context)
        results.append((positions_of(context), energy))
    for positions, energy in results[1:]:
        assert np.array_equal(positions, results[0][0])
        assert energy == results[0][1]


@ON_COMPILED_PLATFORMS
def test_other_particles_diffuse_with_their_friction(platform):
    count = 20000
    context, integrator = context_of(filaments_of("compiled"), platform, others=count)
    nodes = context.getSystem().getNumParticles() - count
    before = positions_of(context)[nodes:]
    integrator.step(1)
    moved = positions_of(context)[nodes:] - before
    expected = 2 * unit.MOLAR_GAS_CONSTANT_R.value_in_unit(unit.kilojoule_per_mole / unit.kelvin) * TEMPERATURE
    expected *= STEP["F_ACTIN"] / 5.0e4
    assert moved.var() == pytest.approx(expected, rel=5 * np.sqrt(2 / (3 * count)))
    velocities = context.getState(velocities=True).getVelocities(asNumpy=True)._value[nodes:]
    rounding = platform.rounding * before.max() / 2048.0
    assert velocities == pytest.approx(moved / STEP["F_ACTIN"], abs=1e-12 + rounding / STEP["F_ACTIN"])


@ON_COMPILED_PLATFORMS
def test_virtual_sites_follow_and_massless_particles_stay(platform):
    filaments = filaments_of("compiled")
    _, system, positions = filaments.build()
    site, fixed = system.addParticle(0.0), system.addParticle(0.0)
    system.setVirtualSite(site, openmm.TwoParticleAverageSite(0, 1, 0.25, 0.75))
    integrator = filaments.create_integrator(system, STEP["F_ACTIN"], random_seed=1)
    context = new_context(system, np.concatenate([positions._value, np.ones((2, 3))]), integrator, platform)
    integrator.step(3)
    after = positions_of(context)
    assert after[site] == pytest.approx(0.25 * after[0] + 0.75 * after[1], abs=1e-12 + platform.rounding)
    assert np.array_equal(after[fixed], np.ones(3))


@ON_COMPILED_PLATFORMS
def test_update_parameters_in_context(platform):
    context, integrator = context_of(filaments_of("compiled"), platform, temperature=0.0, scheme="euler")
    force = CylinderChainForce.cast(context.getSystem().getForce(0))
    before = force.computeEnergies(context)
    start = positions_of(context)
    integrator.step(1)
    displacement = positions_of(context) - start
    for chain in range(force.getNumChains()):
        for segment in range(force.getNumSegments(chain)):
            parameters = [parameter._value for parameter in force.getSegmentParameters(chain, segment)]
            force.setSegmentParameters(chain, segment, *parameters[:3], *[2 * friction for friction in parameters[3:]])
        for joint in range(force.getNumJoints(chain)):
            force.setJointParameters(chain, joint, 3 * force.getJointParameters(chain, joint))
    force.updateParametersInContext(context)
    context.setPositions(start)
    stretching, bending = force.computeEnergies(context)
    assert stretching == before[0]
    assert bending._value == pytest.approx(3 * before[1]._value, rel=1e-12)
    for chain in range(force.getNumChains()):
        for joint in range(force.getNumJoints(chain)):
            force.setJointParameters(chain, joint, force.getJointParameters(chain, joint) / 3)
    force.updateParametersInContext(context)
    integrator.step(1)
    halved = pytest.approx(displacement, rel=1e-6, abs=1e-9 + 3 * platform.rounding)
    assert 2 * (positions_of(context) - start) == halved


@ON_COMPILED_PLATFORMS
@pytest.mark.parametrize(("scheme", "excess"), [("midpoint", "would move by"), ("implicit", "cannot be solved")])
def test_blow_up_names_filament_segment_and_step(platform, scheme, excess):
    filaments = filaments_of("compiled")
    _, system, positions = filaments.build()
    force = openmm.CustomExternalForce("-pull*x")
    force.addGlobalParameter("pull", 0.0)
    force.addParticle(int(filaments.node_indices[1][3]))
    system.addForce(force)
    integrator = filaments.create_integrator(system, STEP["F_ACTIN"], scheme=scheme, random_seed=1)
    context = new_context(system, positions, integrator, platform)
    integrator.step(2)
    before = positions_of(context)
    # The largest force that OpenMM adds on GPUs is 2^31.
    for pull, what in ((1e9, excess), (np.nan, "not finite")):
        context.setParameter("pull", pull)
        with pytest.raises(
            InstabilityError, match=r"Filament 1 \(.*\) has blown up at segment [23] in step 3: .*" + what
        ):
            integrator.step(1)
        assert np.array_equal(positions_of(context), before)


def message_of(system, integrator):
    """What OpenMM says when a Context is created."""
    with pytest.raises(openmm.OpenMMException) as raised:
        openmm.Context(system, integrator, openmm.Platform.getPlatformByName("Reference"))
    return str(raised.value)


def chain_force(*chains):
    """A force with unit parameters."""
    force = CylinderChainForce()
    for particles in chains:
        force.addChain(particles, 0, 0, 1, 1, 0, 1, 1, 1, 1, 1)
    return force


def system_with(count, *forces, masses=None):
    """A System with forces."""
    system = openmm.System()
    for mass in masses or [1.0] * count:
        system.addParticle(mass)
    for force in forces:
        system.addForce(force)
    return system


def test_refused_systems():
    def integrator():
        return CylinderChainIntegrator(300, 1, 0.001)

    assert "does not contain a CylinderChainForce" in message_of(system_with(2), integrator())
    two = system_with(4, chain_force([0, 1]), chain_force([2, 3]))
    assert "multiple CylinderChainForces" in message_of(two, integrator())
    assert "Particle 1 is in two chains" in message_of(system_with(3, chain_force([0, 1], [1, 2])), integrator())
    assert "Illegal particle index: 5" in message_of(system_with(3, chain_force([0, 5])), integrator())
    frictionless = chain_force([0, 1])
    frictionless.setSegmentParameters(0, 0, 1, 1, 0, 1, 1, 0, 1)
    assert "Segment 0 of chain 0 lacks friction" in message_of(system_with(2, frictionless), integrator())
    massless = system_with(2, chain_force([0, 1]), masses=[0.0, 0.0])
    assert "All nodes of chain 0 are massless" in message_of(massless, integrator())
    constrained = system_with(4, chain_force([0, 1]))
    constrained.addConstraint(2, 3, 1.0)
    assert "does not support constraints" in message_of(constrained, integrator())
    virtual = system_with(3, chain_force([0, 2]), masses=[1.0, 1.0, 0.0])
    virtual.setVirtualSite(2, openmm.TwoParticleAverageSite(0, 1, 0.5, 0.5))
    assert "cannot be a virtual site" in message_of(virtual, integrator())
    own = integrator()
    own.setParticleFriction(1, 1.0)
    assert "cannot have a friction coefficient of its own" in message_of(system_with(2, chain_force([0, 1])), own)


@pytest.mark.parametrize(
    "particles, parameters, message",
    [
        ([0], [0, 0, 1, 1, 0, 1, 1, 1, 1, 1], "at least two particles"),
        ([0, 1, 0], [0, 0, 1, 1, 0, 1, 1, 1, 1, 1], "Particle 0 appears twice"),
        ([0, -1], [0, 0, 1, 1, 0, 1, 1, 1, 1, 1], "Illegal particle index: -1"),
        ([0, 1], [-1, 0, 1, 1, 0, 1, 1, 1, 1, 1], "Illegal bending model: -1"),
        ([0, 1], [99, 0, 1, 1, 0, 1, 1, 1, 1, 1], "Illegal bending model: 99"),
        ([0, 1], [0, 2, 1, 1, 0, 1, 1, 1, 1, 1], "Illegal stretching model: 2"),
        ([0, 1], [0, 0, 0, 1, 0, 1, 1, 1, 1, 1], "rest length must be positive"),
        ([0, 1], [0, 0, 1, 1, 0, -1, 1, 1, 1, 1], "stiffness of a joint"),
        ([0, 1], [0, 1, 1, 1, 0, 1, 1, 1, 1, 1], "maximum extension must be positive"),
        ([0, 1], [0, 0, 1, 1, 0, 1, np.nan, 1, 1, 1], "parallel friction cannot be negative"),
        ([0, 1], [0, 0, 1, 1, 0, 1, 1, 1, 1, np.inf], "extensional friction cannot be negative"),
    ],
)
def test_refused_chains(particles, parameters, message):
    force = CylinderChainForce()
    with pytest.raises(openmm.OpenMMException, match=message):
        force.addChain(particles, *parameters)
    assert force.getNumChains() == 0


def test_refused_arguments():
    for arguments, message in (
        ((-1, 1, 1), "Temperature cannot be negative"),
        ((np.nan, 1, 1), "Temperature cannot be negative"),
        ((1, -1, 1), "Friction cannot be negative"),
    ):
        with pytest.raises(openmm.OpenMMException, match=message):
            CylinderChainIntegrator(*arguments)
    with pytest.raises(openmm.OpenMMException, match="not a CylinderChainForce"):
        CylinderChainForce.cast(openmm.HarmonicBondForce())
    with pytest.raises(InputError, match="same force group"):
        filaments_of("compiled").build(stretching_force_group=0, bending_force_group=1)
    assert native.SCHEMES.keys() == set(SCHEMES)


STEPS_OF_ONE = """
from openmm_cylchain import F_ACTIN, Filaments
import openmm
filaments = Filaments(1029.8, 310.0, engine="compiled")
filaments.add_straight(F_ACTIN, 4, [0, 0, 0], [1, 0, 0])
_, system, positions = filaments.build()
integrator = filaments.create_integrator(system, 1e6, scheme="implicit", random_seed=1)
context = openmm.Context(system, integrator, openmm.Platform.getPlatformByName("Reference"))
context.setPositions(positions)
integrator.step(3)
print(context.getState(positions=True).getPositions(asNumpy=True)._value.sum())
"""


def test_an_instruction_set_computes_the_same_or_says_that_it_was_not_built(tmp_path):
    def run(environment):
        command = [sys.executable, "-c", STEPS_OF_ONE]
        # From elsewhere, so that what is installed is imported.
        return subprocess.run(command, env={**os.environ, **environment}, cwd=tmp_path, capture_output=True, text=True)

    best = run({})
    assert best.returncode == 0
    for instruction_set in ("avx512", "avx2", "baseline"):
        result = run({"CYLCHAIN_INSTRUCTION_SET": instruction_set})
        if result.returncode == 0:
            assert np.isclose(float(result.stdout), float(best.stdout), rtol=1e-12)
        else:
            # No better one than AVX-512 is built.
            assert instruction_set != "avx512"
            assert "CYLCHAIN_FOR_THIS_PROCESSOR=OFF" in result.stderr.splitlines()[-1]


def test_other_integrators_refuse_planar_filaments():
    filaments = Filaments(VISCOSITY, TEMPERATURE, engine="compiled")
    filaments.add_straight(F_ACTIN, 3, [0, 0, 0], [1, 0, 0], planar=True)
    _, system, positions = filaments.build()
    simulation = openmm.Context(system, openmm.VerletIntegrator(1.0), openmm.Platform.getPlatform("Reference"))
    simulation.setPositions(positions)
    assert energy_of(simulation) == pytest.approx(0.0, abs=1e-9)
    with pytest.raises(openmm.OpenMMException, match="Filament 0 .* is planar, but this Integrator"):
        simulation.getIntegrator().step(1)
