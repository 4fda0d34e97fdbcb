"""Filaments on OpenMM's platforms for GPUs follow the trajectory of the Reference platform, noise and all."""

from dataclasses import replace

import numpy as np
import openmm
import pytest
from openmm import app, unit

from openmm_cylchain import (
    ACTIN_ATP,
    F_ACTIN,
    Body,
    Crosslinker,
    Crosslinks,
    Filaments,
    Growth,
    Hand,
    InstabilityError,
    MonomerPool,
    Sphere,
    capsule_contact_force,
    filament_wall_force,
    stokes_friction,
)
from support.contexts import energy_of, forces_of, new_context, positions_of
from support.mixed_systems import mixed_context
from support.platform_variants import ACTIN, SHEAR, VARIANTS, filaments_of_variant, step_of_variant
from support.platforms import GPU_CASES, GPU_NAMES, NOT_TESTED
from support.solvent import TEMPERATURE, VISCOSITY

# Of paths, in nm. Pushes of 0.3 kJ/(mol nm) take filaments 1000 nm far here.
TOLERANCES = {case.precision: case.path_tolerance for case in GPU_CASES}

# The same where OpenMM adds all forces without a loss.
EXACT_TOLERANCES = {"double": 1e-9, "mixed": 1e-6, "single": 5e-3}

pytestmark = pytest.mark.skipif(not GPU_NAMES, reason=str(NOT_TESTED))


def _context(variant, scheme, platform, precision=None, flow=None, pushed=True):
    filaments, system, positions, arguments = filaments_of_variant(variant, flow, pushed)
    integrator = filaments.create_integrator(
        system, step_of_variant(variant, scheme), scheme, random_seed=4, precision="double", checks=False, **arguments
    )
    return new_context(system, positions, integrator, platform, {"Precision": precision} if precision else {})


def _compare(gpu, variant, scheme, precision, steps=20, flow=None, tolerances=TOLERANCES):
    expected, found = (
        _context(variant, scheme, platform, own, flow) for platform, own in (("Reference", None), (gpu, precision))
    )
    start = positions_of(expected)
    forces = forces_of(expected)
    assert forces_of(found) == pytest.approx(forces, abs=2e-4 * np.abs(forces).max())
    assert energy_of(found) == pytest.approx(energy_of(expected), rel=1e-3, abs=1e-3)
    for context in (expected, found):
        context.getIntegrator().step(steps)
    end = positions_of(expected)
    assert np.abs(end - start).max() > 100 * tolerances[precision]
    assert np.abs(positions_of(found) - end).max() < tolerances[precision]


@pytest.mark.parametrize("precision", TOLERANCES)
def test_trajectories_with_noise_agree(gpu, precision):
    """100 steps of open filaments among beads, in each precision."""
    _compare(gpu, "open", "implicit", precision, steps=100, tolerances=EXACT_TOLERANCES)


@pytest.mark.slow
@pytest.mark.parametrize("scheme", ["implicit", "implicit-second-order"])
@pytest.mark.parametrize("variant", VARIANTS)
def test_all_variants_agree_at_implicit_steps(gpu, variant, scheme):
    _compare(gpu, variant, scheme, "double")


@pytest.mark.slow
@pytest.mark.parametrize("scheme", ["euler", "midpoint"])
@pytest.mark.parametrize("variant", VARIANTS)
def test_all_variants_agree_at_explicit_steps(gpu, variant, scheme):
    _compare(gpu, variant, scheme, "double")


@pytest.mark.slow
@pytest.mark.parametrize("variant", VARIANTS)
def test_without_forces_of_openmm_they_agree_to_rounding(gpu, variant):
    """A hundred steps with noise. What OpenMM computes itself is added in units of 2^-32 kJ/(mol nm) there."""
    contexts = [
        _context(variant, "implicit", platform, precision, pushed=False)
        for platform, precision in (("Reference", None), (gpu, "double"))
    ]
    start = positions_of(contexts[0])
    for context in contexts:
        context.getIntegrator().step(100)
    expected, found = map(positions_of, contexts)
    assert np.abs(expected - start).max() > 1.0
    assert np.abs(found - expected).max() < 1e-10


@pytest.mark.slow
@pytest.mark.parametrize("variant", ["open", "fixed", "ring", "planar", "beads"])
def test_filaments_in_a_flow_agree(gpu, variant):
    for scheme in ("implicit", "midpoint"):
        _compare(gpu, variant, scheme, "double", flow=SHEAR)


BOX = 1500.0


def _crossing_context(platform, precision=None, tether=True):
    """Equal filaments among beads, with a cutoff force, that are dragged across a periodic box but for one."""
    topology, system = app.Topology(), openmm.System()
    chain = topology.addChain()
    beads = np.random.default_rng(3).uniform(0, BOX, size=(40, 3))
    for _ in beads:
        topology.addAtom("B", None, topology.addResidue("BEA", chain))
        system.addParticle(1e5)
    system.setDefaultPeriodicBoxVectors(*(BOX * np.eye(3)))
    topology.setPeriodicBoxVectors(BOX * np.eye(3) * unit.nanometer)
    filaments = Filaments(VISCOSITY, TEMPERATURE, "compiled")
    for number in range(6):
        filaments.add_equilibrium(ACTIN, 10, seed=number, start=[100.0, 240.0 * number, 50.0])
    if tether:
        filaments.add_tether(5, 0, [100.0 + BOX, 1200.0, 50.0 - 2 * BOX], 0.5)
    positions = filaments.add_to(topology, system, beads * unit.nanometer)
    repulsion = openmm.CustomNonbondedForce("20*(1-r/60)^2")
    repulsion.setNonbondedMethod(openmm.CustomNonbondedForce.CutoffPeriodic)
    repulsion.setCutoffDistance(60.0)
    for _ in range(system.getNumParticles()):
        repulsion.addParticle([])
    system.addForce(repulsion)
    drift = openmm.CustomExternalForce("-6*(x+0.7*y-0.5*z)")
    for particle in range(system.getNumParticles()):
        drift.addParticle(particle, [])
    system.addForce(drift)
    friction = stokes_friction(60, VISCOSITY)
    integrator = filaments.create_integrator(
        system, 2e5, "implicit", particle_friction=friction, random_seed=4, precision="double", checks=False
    )
    return new_context(system, positions, integrator, platform, {"Precision": precision} if precision else {})


def test_filaments_cross_a_periodic_box_while_particles_are_reordered(gpu):
    """For longer than OpenMM waits to reorder particles; the tether's point is some boxes away from its node."""
    expected, found = _crossing_context("Reference"), _crossing_context(gpu, "double")
    start = positions_of(expected)
    for context in (expected, found):
        context.getIntegrator().step(600)
    end = positions_of(expected)
    assert np.median(np.abs(end - start).max(axis=1)) > BOX
    assert np.abs(positions_of(found) - end).max() < 1e-2


def _far_context(platform, precision=None):
    """Filaments some boxes away from each other, with links, a wall and contacts that are not periodic."""
    filaments = Filaments(VISCOSITY, TEMPERATURE, "compiled")
    for number, where in enumerate(([0, 0, 0], [0, 3 * BOX, 200], [0, 300, -2 * BOX], [10, 312, -2 * BOX])):
        filaments.add_equilibrium(ACTIN, 10, seed=number, start=np.add([100.0, 240.0, 50.0], where))
    _, system, positions = filaments.build()
    links = Crosslinks(1e-4, 30.0)
    links.add(None, filaments.segment_place(0, arc_length=100.0), filaments.segment_place(1, arc_length=100.0))
    links.add_to(system)
    system.addForce(filament_wall_force(filaments, system, Sphere((0, 0, -2 * BOX), 350.0), 1e-4))
    system.addForce(capsule_contact_force(filaments, system, 25.0, 0.5, periodic=False))
    system.setDefaultPeriodicBoxVectors(*(BOX * np.eye(3)))
    repulsion = openmm.CustomNonbondedForce("20*(1-r/5)^2")
    repulsion.setNonbondedMethod(openmm.CustomNonbondedForce.CutoffPeriodic)
    repulsion.setCutoffDistance(5.0)
    for _ in range(system.getNumParticles()):
        repulsion.addParticle([])
    system.addForce(repulsion)
    integrator = filaments.create_integrator(
        system, step_of_variant("open", "midpoint"), "midpoint", random_seed=4, precision="double", checks=False
    )
    return new_context(system, positions, integrator, platform, {"Precision": precision} if precision else {})


def test_couplings_reach_across_periodic_boxes(gpu):
    """OpenMM wraps filaments into the box after some hundred steps; what couples them must not see it."""
    expected, found = _far_context("Reference"), _far_context(gpu, "double")
    for context in (expected, found):
        context.getIntegrator().step(300)
    forces = forces_of(expected)
    assert np.abs(forces).max() > 1 and np.abs(forces_of(found) - forces).max() < 1e-5 * np.abs(forces).max()
    assert energy_of(found) == pytest.approx(energy_of(expected), rel=1e-6)
    assert np.abs(positions_of(found) - positions_of(expected)).max() < TOLERANCES["double"]


def test_failure_leaves_positions_before_the_step(gpu):
    context = _context("open", "implicit", gpu, "double")
    integrator = context.getIntegrator()
    integrator.step(3)
    system = context.getSystem()
    before, steps = positions_of(context), context.getStepCount()
    push = next(force for force in system.getForces() if isinstance(force, openmm.CustomExternalForce))
    push.setEnergyFunction("1e12*x^2")
    context.reinitialize(preserveState=True)
    with pytest.raises(InstabilityError, match="force on it, or its position, is not finite") as caught:
        integrator.step(1)
    assert caught.value.step is not None and "Filament 0" in str(caught.value)
    assert positions_of(context) == pytest.approx(before, abs=1e-9) and context.getStepCount() == steps


def test_checkpoint_continues_the_same_trajectory(gpu):
    first, second = (_context("open", "implicit", gpu, "mixed") for _ in range(2))
    first.getIntegrator().step(5)
    checkpoint = first.createCheckpoint()
    first.getIntegrator().step(7)
    second.loadCheckpoint(checkpoint)
    second.getIntegrator().step(7)
    assert np.array_equal(positions_of(first), positions_of(second))


def test_steps_taken_together_are_those_taken_one_by_one(gpu):
    ends = []
    for counts in ([40], [1] * 40):
        filaments = Filaments(VISCOSITY, TEMPERATURE, "compiled")
        filaments.add_equilibrium(ACTIN, 12, seed=1)
        _, system, positions = filaments.build()
        integrator = filaments.create_integrator(system, 2e6, "implicit", random_seed=2)
        context = new_context(system, positions, integrator, gpu, {"Precision": "single"})
        for count in counts:
            integrator.step(count)
        ends.append(positions_of(context))
        assert context.getStepCount() == 40 and context.getTime()._value == pytest.approx(40 * 2e6)
    assert np.array_equal(*ends)


def test_moved_tethers_hold_filaments_elsewhere(gpu):
    """Parameters are updated in one of two Contexts, which follows the Reference platform as before."""
    contexts, ends = [], []
    for platform, precision in (("Reference", None), (gpu, "double"), (gpu, "double")):
        filaments, system, positions, arguments = filaments_of_variant("tethered")
        integrator = filaments.create_integrator(
            system, 2e6, "implicit", random_seed=4, precision="double", checks=False, **arguments
        )
        properties = {"Precision": precision} if precision else {}
        context = new_context(system, positions, integrator, platform, properties)
        contexts.append(context)
        integrator.step(5)
        if len(contexts) < 3:
            filaments.in_context(context).move_tether(0, [300.0, 100.0, -50.0], 4e-3)
        integrator.step(5)
        ends.append(positions_of(context))
    assert np.abs(ends[1] - ends[0]).max() < TOLERANCES["double"]
    assert np.abs(ends[2] - ends[0]).max() > 10


def test_filaments_among_many_particles_with_virtual_sites_agree(gpu):
    """100 steps with noise of all that a System of particles has, and ten filaments."""
    (filaments, expected), (_, found) = mixed_context("Reference"), mixed_context(gpu, "double")
    start = positions_of(expected)
    for context in (expected, found):
        context.getIntegrator().step(100)
    end = positions_of(expected)
    moved = np.abs(end - start).max(axis=1)
    assert np.median(moved) > 1 and moved[filaments.attachment_indices].min() > 0.1
    assert np.abs(positions_of(found) - end).max() < TOLERANCES["double"]


def _add_links(filaments, system):
    links = Crosslinks(0.1, 30.0)
    links.add(None, filaments.segment_place(0, arc_length=100.0), filaments.segment_place(1, arc_length=100.0))
    links.add(None, filaments.segment_place(1, arc_length=300.0), filaments.segment_place(2, arc_length=250.0))
    links.add_to(system)


def _add_walls(filaments, system):
    system.addForce(filament_wall_force(filaments, system, Sphere((0, 400, 0), 350.0), 0.1))


def _add_contacts(filaments, system):
    # Filaments begin 500 nm apart, and their own segments are left out.
    system.addForce(capsule_contact_force(filaments, system, 450.0, 0.5, excluded_neighbors=12))


COUPLINGS = {"links": _add_links, "walls": _add_walls, "contacts": _add_contacts}


def _coupled_context(what, scheme, platform, properties=None):
    filaments, system, positions, arguments = filaments_of_variant("open")
    COUPLINGS[what](filaments, system)
    step = step_of_variant("open", scheme)
    integrator = filaments.create_integrator(
        system, step, scheme, random_seed=4, precision="double", checks=False, **arguments
    )
    return new_context(system, positions, integrator, platform, properties)


@pytest.mark.parametrize("scheme", ["implicit", "midpoint"])
@pytest.mark.parametrize("what", COUPLINGS)
def test_steps_with_couplings_agree(gpu, what, scheme):
    expected, bare = _coupled_context(what, scheme, "Reference"), _context("open", scheme, "Reference")
    found = _coupled_context(what, scheme, gpu, {"Precision": "double"})
    forces = forces_of(expected)
    added = np.abs(forces - forces_of(bare)).max()
    assert added > 1.0
    assert np.abs(forces_of(found) - forces).max() < 1e-6 * added
    assert energy_of(found) == pytest.approx(energy_of(expected), rel=1e-6)
    for context in (expected, found, bare):
        context.getIntegrator().step(50)
    end = positions_of(expected)
    assert np.abs(end - positions_of(bare)).max() > 1e-3
    assert np.abs(positions_of(found) - end).max() < TOLERANCES["double"]


def test_a_link_out_of_its_range_is_named_before_the_step(gpu):
    filaments, system, positions, arguments = filaments_of_variant("open")
    links = Crosslinks(0.1, 30.0, "fene", 40.0)
    links.add(None, filaments.segment_place(0, segment=1), filaments.segment_place(1, segment=1))
    links.add_to(system)
    integrator = filaments.create_integrator(system, 1.0, "midpoint", random_seed=4, checks=False, **arguments)
    context = new_context(system, positions, integrator, gpu, {"Precision": "mixed"})
    before = positions_of(context)
    with pytest.raises(InstabilityError, match="its length of [0-9.]+ nm is outside 30"):
        integrator.step(1)
    assert np.array_equal(positions_of(context), before) and context.getStepCount() == 0


def _linked_context(platform, precision=None, scheme="midpoint"):
    """Filaments in a periodic box with crosslinkers, motors and anchored ones, whose hands come and go fast."""
    filaments = Filaments(VISCOSITY, TEMPERATURE, "compiled")
    generator = np.random.default_rng(1)
    for number in range(12):
        filaments.add_equilibrium(ACTIN, 8, seed=number, start=generator.uniform(0.0, 400.0, 3))
    hand = Hand(binding_rate=3e-4, reach=80.0, unbinding_rate=1e-5, unbinding_force=5.0)
    motor = Hand(binding_rate=3e-4, reach=80.0, unbinding_rate=1e-5, speed=1e-3, stall_force=10.0)
    filaments.add_linkers(Crosslinker(hands=hand, stiffness=0.06, rest_length=50.0), count=60)
    filaments.add_linkers(Crosslinker(hands=motor, stiffness=0.06, rest_length=50.0), count=40)
    filaments.add_linkers(
        Crosslinker(hands=hand, stiffness=0.06, rest_length=50.0), anchors=generator.uniform(0.0, 400.0, (20, 3))
    )
    _, system, positions = filaments.build(box_vectors=400.0 * np.eye(3))
    step = step_of_variant("open", "midpoint")
    integrator = filaments.create_integrator(system, step, scheme, random_seed=4, precision="double", checks=False)
    properties = {"Precision": precision} if precision else {}
    return filaments, new_context(system, positions, integrator, platform, properties)


@pytest.mark.parametrize("scheme", ["implicit", "midpoint"])
def test_linkers_bind_walk_and_pull(gpu, scheme):
    """Hands are where they are on the Reference platform, after many have bound and unbound; so are filaments."""
    tables, ends, energies = [], [], []
    for platform, precision in (("Reference", None), (gpu, "double")):
        filaments, context = _linked_context(platform, precision, scheme)
        here = filaments.in_context(context)
        start = here.linkers()
        context.getIntegrator().step(100)
        tables.append(here.linkers())
        ends.append(positions_of(context))
        energies.append(energy_of(context))
    assert tables[0].counts()[2] > 20 and start.counts()[2] == 0
    assert np.array_equal(tables[1].filaments, tables[0].filaments)
    assert tables[1].arc_lengths == pytest.approx(tables[0].arc_lengths, abs=1e-3)
    assert np.abs(ends[1] - ends[0]).max() < TOLERANCES["double"]
    assert energies[1] == pytest.approx(energies[0], rel=1e-6)


def test_linkers_continue_from_checkpoints(gpu):
    filaments, context = _linked_context(gpu, "mixed")
    integrator = context.getIntegrator()
    integrator.step(40)
    checkpoint = context.createCheckpoint()
    ends = []
    for _ in range(2):
        integrator.step(40)
        ends.append((positions_of(context), filaments.in_context(context).linkers()))
        context.loadCheckpoint(checkpoint)
    assert ends[0][1].counts()[2] > 20
    assert np.array_equal(ends[0][0], ends[1][0])
    assert np.array_equal(ends[0][1].filaments, ends[1][1].filaments)


def _step_together(gpu, build, steps, tolerance=1e-7):
    """The Filaments, and Contexts on Reference and on the GPU after some steps: their positions, which agree."""
    contexts = []
    for platform, precision in (("Reference", None), (gpu, "double")):
        filaments, system, positions, integrator = build()
        context = new_context(system, positions, integrator, platform, {"Precision": precision} if precision else {})
        integrator.step(steps)
        contexts.append(context)
    ends = [positions_of(context) for context in contexts]
    assert np.abs(ends[0] - positions._value).max() > 1000 * tolerance
    assert np.abs(ends[1] - ends[0]).max() < tolerance
    return filaments, contexts


def test_modes_agree(gpu):
    def build():
        filaments, system, positions, arguments = filaments_of_variant("beads")
        return (
            filaments,
            system,
            positions,
            filaments.create_integrator(system, 0.05, "modes", random_seed=4, checks=False, **arguments),
        )

    _step_together(gpu, build, 100, TOLERANCES["double"])


def test_beams_with_links_agree(gpu):
    beam = replace(ACTIN, segment_length=100.0, element="beam", extension_relaxation_time=None)

    def build():
        filaments = Filaments(VISCOSITY, TEMPERATURE, "compiled")
        for number in range(3):
            filaments.add_straight(beam, 3, [0, 30 * number, 0], [1, 0, 0])
        _, system, positions = filaments.build()
        links = Crosslinks(0.1, 30.0)
        for number in range(2):
            links.add(None, *(filaments.segment_place(number + one, arc_length=150.0) for one in (0, 1)))
        links.add_to(system)
        return filaments, system, positions, filaments.create_integrator(system, 1e6, random_seed=2, checks=False)

    _step_together(gpu, build, 50)


def test_bodies_linkers_and_growing_filaments_agree(gpu):
    """A pole of growing microtubules in a cell, beside linkers that diffuse, and beside particles of OpenMM."""

    def build():
        filaments = Filaments(VISCOSITY, TEMPERATURE, "compiled")
        actin = F_ACTIN.with_segment_length(108.0)
        directions = np.eye(3)
        for direction in directions:
            filaments.add_straight(actin, 4, 200.0 * direction, direction)
            growth = Growth(monomers=ACTIN_ATP, pool=MonomerPool(unit.Quantity(5e-5, unit.molar)), longest=2000.0)
            filaments.add_straight(actin, 4, -300.0 * direction, -direction, growth=growth)
        pole = filaments.add_body(Body.sphere(200.0, 200.0 * directions), [0, 0, 0])
        hand = Hand(binding_rate=3e-5, reach=50.0, unbinding_rate=1e-6)
        filaments.add_linkers(Crosslinker(hands=hand, stiffness=0.06), count=300, diffusion=1e-3)
        _, system, positions = filaments.build()
        places = filaments.body_indices[pole]
        links = Crosslinks(60.0, 0.0)
        for nodes, place in zip(filaments.node_indices[::2], places[1:], strict=True):
            links.add(None, int(nodes[0]), int(place))
        links.add_to(system)
        system.addForce(filament_wall_force(filaments, system, Sphere((0, 0, 0), 1500.0), 0.1))
        return filaments, system, positions, filaments.create_integrator(system, 1e7, random_seed=2, checks=False)

    filaments, contexts = _step_together(gpu, build, 20)
    tables = [filaments.in_context(context).linkers() for context in contexts]
    assert tables[0].counts()[1] > 0 and np.array_equal(tables[0].filaments, tables[1].filaments)


@pytest.mark.parametrize("scheme", ["implicit", "midpoint"])
def test_mixed_precision_of_steps_is_theirs(gpu, scheme):
    """By one name for another: it is not the platform's."""

    def build():
        filaments, system, positions, arguments = filaments_of_variant("open")
        step = step_of_variant("open", scheme)
        return (
            filaments,
            system,
            positions,
            filaments.create_integrator(
                system, step, scheme, precision="mixed", random_seed=2, checks=False, **arguments
            ),
        )

    _, contexts = _step_together(gpu, build, 20, TOLERANCES["double"])
    counts = [context.getIntegrator().getNumMixedPrecisionChains() for context in contexts]
    assert counts[0] == counts[1] and (scheme == "midpoint") == (counts[0] == 0)


def test_tensions_agree(gpu):
    found = []
    for platform, precision in (("Reference", None), (gpu, "double")):
        filaments, system, positions, arguments = filaments_of_variant("open")
        integrator = filaments.create_integrator(system, 2e6, random_seed=4, checks=False, **arguments)
        context = new_context(system, positions, integrator, platform, {"Precision": precision} if precision else {})
        integrator.setRecordsTensions(True)
        integrator.step(2)
        found.append(filaments.in_context(context).mean_axial_tensions()[0]._value)
    assert np.abs(found[0]).max() > 0.1 and found[1] == pytest.approx(found[0], rel=1e-5, abs=1e-5)
