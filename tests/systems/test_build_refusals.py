"""Input that cannot be simulated is refused with a message that names the filament and says what to do."""

import math
from dataclasses import replace

import numpy as np
import openmm
import pytest
from openmm import app, unit

from openmm_cylchain import DSDNA, F_ACTIN, Filaments, InputError, TimeStepWarning
from openmm_cylchain.time_steps.stability import stability_bounds
from support.contexts import new_context
from support.solvent import VISCOSITY

TEMPERATURE = 310 * unit.kelvin
STEP = 10 * unit.nanosecond
ACTIN_0 = r"Filament 0 \(ACT\)"
ACTIN_1 = r"Filament 1 \(ACT\)"
SHORT = replace(F_ACTIN, segment_length=6, friction_length="filament")


@pytest.fixture
def filaments():
    """One filament that is as it should be."""
    result = Filaments(VISCOSITY, TEMPERATURE)
    result.add_straight(F_ACTIN, 4, [0, 0, 0], [1, 0, 0])
    return result


def refused(message):
    return pytest.raises(InputError, match=f"(?s){message}")


# The solvent


@pytest.mark.parametrize("viscosity", [0, -1.0, math.nan, math.inf, 1 * unit.pascal, [1.0, 2.0], "water"])
def test_viscosity(viscosity):
    with refused("viscosity (must be|has the unit)"):
        Filaments(viscosity, TEMPERATURE)


@pytest.mark.parametrize("temperature", [-1.0, math.nan, 1 * unit.joule, [300, 310], None])
def test_temperature(temperature):
    with refused("temperature (must be|cannot be negative|has the unit)"):
        Filaments(VISCOSITY, temperature)


def test_zero_temperature_is_allowed_but_has_no_equilibrium():
    cold = Filaments(VISCOSITY, 0)
    cold.add_straight(F_ACTIN, 4, [0, 0, 0], [1, 0, 0])
    with refused(f"{ACTIN_1}: an equilibrium draw needs a temperature above zero"):
        cold.add_equilibrium(F_ACTIN, 4, seed=1)


# Filaments


@pytest.mark.parametrize("filament_type", ["ACT", None, 5, type(F_ACTIN)])
def test_type(filaments, filament_type):
    for add in (
        lambda: filaments.add_straight(filament_type, 4, [0, 0, 0], [1, 0, 0]),
        lambda: filaments.add_nodes(filament_type, [[0, 0, 0], [360, 0, 0]]),
        lambda: filaments.add_equilibrium(filament_type, 4, seed=1),
    ):
        with refused("Filament 1: filament_type must be a FilamentType, such as F_ACTIN"):
            add()


@pytest.mark.parametrize("segments", [0, -3, 2.5, math.nan, True, None, "4"])
def test_number_of_segments(filaments, segments):
    with refused(f"{ACTIN_1}: segments must be"):
        filaments.add_straight(F_ACTIN, segments, [0, 0, 0], [1, 0, 0])
    with refused(f"{ACTIN_1}: segments must be"):
        filaments.add_equilibrium(F_ACTIN, segments, seed=1)
    assert len(filaments) == 1


@pytest.mark.parametrize(
    "start", [[0, 0], [0, 0, math.nan], 5.0, [[0, 0, 0]], [0, 0, 1 * unit.picosecond], [1, 2, 3] * unit.kelvin]
)
def test_start(filaments, start):
    with refused(f"{ACTIN_1}: start"):
        filaments.add_straight(F_ACTIN, 4, start, [1, 0, 0])
    with refused(f"{ACTIN_1}: start"):
        filaments.add_equilibrium(F_ACTIN, 4, seed=1, start=start)


@pytest.mark.parametrize("direction", [[0, 0, 0], [1, 0], [math.inf, 0, 0], [1, 0, 0] * unit.nanometer, "x"])
def test_direction(filaments, direction):
    with refused(f"{ACTIN_1}: direction"):
        filaments.add_straight(F_ACTIN, 4, [0, 0, 0], direction)
    with refused(f"{ACTIN_1}: direction"):
        filaments.add_equilibrium(F_ACTIN, 4, seed=1, direction=direction)


@pytest.mark.parametrize("seed", [-1, 1.5, None, "1"])
def test_seed(filaments, seed):
    with refused(f"{ACTIN_1}: seed must be"):
        filaments.add_equilibrium(F_ACTIN, 4, seed=seed)


@pytest.mark.parametrize(
    "positions, message",
    [
        ([[0, 0, 0]], "needs at least two nodes"),
        ([], "positions must have the shape"),
        ([[0, 0], [1, 1]], "positions must have the shape"),
        ([1, 2, 3], "positions must have the shape"),
        (7.0, "positions must have the shape"),
        (np.zeros((2, 3, 3)), "positions must have the shape"),
        ([[0, 0, 0], [360, 0, math.nan]], "positions must be finite"),
        ([[0, 0, 0], [360, 0]], "positions must be a number or an array of numbers"),
        (np.ones((2, 3)) * unit.second, "positions has the unit second"),
        ([[0, 0, 0], [360, 0, 0], [360, 0, 0]], "nodes 1 and 2 coincide; move them apart"),
        ([[0, 0, 0], [360, 0, 0], [1, 0, 0]], "node 1 are antiparallel.*move the node"),
    ],
)
def test_positions(filaments, positions, message):
    with refused(f"{ACTIN_1}.*{message}"):
        filaments.add_nodes(F_ACTIN, positions)
    assert len(filaments) == 1


@pytest.mark.parametrize(
    "clamped, message",
    [
        ([0, 1, 2, 3, 4], "has all of its nodes clamped.*leave at least one free"),
        ([0, 1, 2, -2, -1], "has all of its nodes clamped.*leave at least one free"),
        ([5], "clamped node 5 does not exist; there are 5 nodes"),
        ([-6], "clamped node"),
        ([0.5], "clamped node must be a whole number"),
    ],
)
def test_clamped(filaments, clamped, message):
    with refused(f"{ACTIN_1}.*{message}"):
        filaments.add_straight(F_ACTIN, 4, [0, 0, 0], [1, 0, 0], clamped=clamped)


def test_segments_too_short_for_their_friction(filaments):
    # The length of the whole filament is in the logarithm, so only Filaments can tell.
    filaments.add_straight(SHORT, 30, [0, 0, 0], [1, 0, 0])
    with refused(r"Filament 2 \(ACT\).*Use longer segments"):
        filaments.add_straight(SHORT, 1, [0, 0, 0], [1, 0, 0])


def test_spring_too_soft_for_its_relaxation_time(filaments):
    soft = replace(F_ACTIN, stretching_stiffness=1e-6)
    with refused(rf"{ACTIN_1}.*Give extensional_friction instead"):
        filaments.add_straight(soft, 4, [0, 0, 0], [1, 0, 0])


# Topology and System


def test_nothing_to_build():
    with refused("There are no filaments to add: call add_straight"):
        Filaments(VISCOSITY, TEMPERATURE).build()


def test_added_twice(filaments):
    topology, system, positions = filaments.build()
    with refused("already in a System; make another Filaments"):
        filaments.build()
    with refused("already in a System; make another Filaments"):
        filaments.add_to(topology, system, positions)
    with refused(f"{ACTIN_1} comes too late"):
        filaments.add_straight(F_ACTIN, 4, [0, 0, 0], [1, 0, 0])
    second = Filaments(VISCOSITY, TEMPERATURE)
    second.add_straight(DSDNA, 4, [0, 0, 0], [1, 0, 0])
    with refused("already holds filaments: add all of them through one Filaments object"):
        second.add_to(topology, system, positions)
    assert system.getNumParticles() == 5


def two_particles():
    topology, system = app.Topology(), openmm.System()
    chain = topology.addChain()
    for _ in range(2):
        topology.addAtom("X", None, topology.addResidue("X", chain))
        system.addParticle(1.0)
    return topology, system, np.array([[0.0, 0.0, 0.0], [1.0, 0.0, 0.0]])


def test_sizes_that_do_not_fit(filaments):
    topology, system, positions = two_particles()
    system.addParticle(1.0)
    with refused("Topology has 2 atoms, but the System has 3 particles"):
        filaments.add_to(topology, system, positions)
    topology, system, positions = two_particles()
    with refused(r"positions must have the shape \(2, 3\), but have \(3, 3\)"):
        filaments.add_to(topology, system, np.zeros((3, 3)))
    with refused("positions has the unit second"):
        filaments.add_to(topology, system, positions * unit.second)
    assert topology.getNumAtoms() == system.getNumParticles() == 2
    filaments.add_to(topology, system, positions)


@pytest.mark.parametrize("group", [-1, 32, 1.5])
def test_force_groups(filaments, group):
    with refused("force group"):
        filaments.build(stretching_force_group=group)
    with refused("force group"):
        filaments.build(bending_force_group=group)


def test_box_vectors(filaments):
    with refused("box_vectors"):
        filaments.build(box_vectors=[[1, 0], [0, 1], [0, 0]])


def test_questions_asked_too_early(filaments, reference):
    _, system, positions = two_particles()
    with refused("not in a System yet: call build or add_to first"):
        _ = filaments.node_indices
    with refused("not in a System yet: call build or add_to first"):
        filaments.create_integrator(system, STEP)
    context = new_context(system, positions, platform=reference)
    with refused("not in a System yet: call build or add_to first"):
        filaments.in_context(context).joint_tensions()


# Integrator


@pytest.mark.parametrize("step", [0, -1.0, math.nan, 1 * unit.nanometer, [1.0, 2.0]])
def test_step(filaments, step):
    _, system, _ = filaments.build()
    with refused("step_size (must be|has the unit)"):
        filaments.create_integrator(system, step)


@pytest.mark.parametrize("temperature", [-5, math.nan, 1 * unit.second])
def test_temperature_of_the_integrator(filaments, temperature):
    _, system, _ = filaments.build()
    with refused("temperature"):
        filaments.create_integrator(system, STEP, temperature=temperature)


@pytest.mark.parametrize("options, message", [(dict(scheme="verlet"), "scheme"), (dict(random_seed=-1), "random_seed")])
def test_options_of_the_integrator(filaments, options, message):
    _, system, _ = filaments.build()
    with refused(f"{message} must be"):
        filaments.create_integrator(system, STEP, **options)


def test_other_system(filaments):
    filaments.build()
    with refused("not the System that the filaments were put into"):
        filaments.create_integrator(openmm.System(), STEP)


def test_constraint_on_a_node():
    topology, system, positions = two_particles()
    filaments = Filaments(VISCOSITY, TEMPERATURE)
    filaments.add_straight(DSDNA, 4, [0, 0, 0], [1, 0, 0])
    filaments.add_straight(F_ACTIN, 4, [0, 0, 0], [1, 0, 0])
    filaments.add_to(topology, system, positions)
    node = int(filaments.node_indices[1][3])
    system.addConstraint(0, node, 1.0)
    with refused(f"{ACTIN_1}: node 3 has a System constraint.*remove it"):
        filaments.create_integrator(system, 1.0, particle_friction=1.0)


def test_constraint_elsewhere(filaments):
    topology, system, positions = two_particles()
    system.addConstraint(0, 1, 1.0)
    filaments.add_to(topology, system, positions)
    # Before a friction is asked for, which would not help.
    for friction in ({}, {"particle_friction": 1.0}):
        with refused("Particles 0 and 1 have a System constraint.*LangevinMiddleIntegrator.*replace it by a bond"):
            filaments.create_integrator(system, STEP, **friction)
        with refused("Particles 0 and 1 have a System constraint"):
            filaments.recommended_time_step(system=system, **friction)


def test_all_masses_set_to_zero_later(filaments):
    _, system, _ = filaments.build()
    for index in range(5):
        system.setParticleMass(index, 0.0)
    with refused(f"{ACTIN_0} has only nodes of mass zero: leave at least one free"):
        filaments.create_integrator(system, STEP)


def test_node_that_became_a_virtual_site(filaments):
    _, system, _ = filaments.build()
    system.setParticleMass(2, 0.0)
    system.setVirtualSite(2, openmm.TwoParticleAverageSite(0, 1, 0.5, 0.5))
    with refused(f"{ACTIN_0}: particle 2 is a node and cannot be a virtual site"):
        filaments.create_integrator(system, STEP)


@pytest.mark.parametrize(
    "friction, message",
    [
        (None, "2 particles outside filaments can move, but have no friction: give particle_friction"),
        ([1.0], "one entry for each of the 2 particles outside filaments"),
        ([1.0, 1.0, 1.0], "one entry for each of the 2 particles outside filaments"),
        ([[1.0, 1.0]], "one entry for each of the 2 particles outside filaments"),
        (0.0, "particle_friction must be positive, but is 0 for particle 0"),
        ([1.0, -2.0], "particle_friction must be positive, but is -2 for particle 1"),
        ([1.0, math.nan], "particle_friction must be finite"),
        (1 * unit.nanometer, "particle_friction has the unit nanometer"),
    ],
)
def test_particle_friction(filaments, friction, message):
    topology, system, positions = two_particles()
    filaments.add_to(topology, system, positions)
    with refused(message):
        filaments.create_integrator(system, STEP, particle_friction=friction)


def test_friction_of_massless_particles_is_not_asked_for(filaments):
    topology, system, positions = two_particles()
    system.setParticleMass(0, 0.0)
    system.setParticleMass(1, 0.0)
    filaments.add_to(topology, system, positions)
    filaments.create_integrator(system, STEP)


def test_step_beyond_a_stability_bound_warns(filaments):
    _, system, _ = filaments.build()
    bound = stability_bounds(F_ACTIN, VISCOSITY, TEMPERATURE, 4)["stretching"]
    with pytest.warns(TimeStepWarning, match="exceeds the stretching bound of .*'ACT'.*Recommended: ") as caught:
        filaments.create_integrator(system, 1.01 * bound, scheme="midpoint")
    assert caught[0].filename == __file__


@pytest.mark.filterwarnings("ignore::openmm_cylchain.TimeStepWarning")
def test_every_type_is_warned_about_once():
    filaments = Filaments(VISCOSITY, TEMPERATURE)
    for _ in range(3):
        filaments.add_straight(F_ACTIN.with_segment_length(30), 10, [0, 0, 0], [1, 0, 0])
        filaments.add_straight(F_ACTIN, 10, [0, 0, 0], [1, 0, 0])
    _, system, _ = filaments.build()
    with pytest.warns(TimeStepWarning, match="exceeds the bending bound") as caught:
        filaments.create_integrator(system, 0.1 * unit.microsecond, scheme="euler")
    unstable, far = sorted((str(one.message) for one in caught), key=lambda text: "exceeds" not in text)
    assert "exceeds the bending bound" in unstable and "10 times as long as the recommended one" in far


def test_a_refusal_leaves_the_system_as_it_was(filaments):
    topology, system, positions = two_particles()
    filaments.add_to(topology, system, positions)
    before = openmm.XmlSerializer.serialize(system)
    with refused("no friction"):
        filaments.create_integrator(system, STEP)
    with refused("scheme"):
        filaments.create_integrator(system, STEP, particle_friction=1.0, scheme="verlet")
    assert openmm.XmlSerializer.serialize(system) == before
