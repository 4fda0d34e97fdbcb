"""Beads, what they do not see, and the force between them, on every platform and beside other forces."""

import warnings

import numpy as np
import openmm
import pytest
from openmm import app, unit

from openmm_cylchain import DSDNA, F_ACTIN, ContactWarning, Filaments, InputError
from openmm_cylchain.couplings.contacts import (
    add_exclusions,
    contact_force,
    crossing_barrier,
    default_stiffness,
    excluded_pairs,
    share_exclusions,
)
from openmm_cylchain.time_steps.recommended_step import contact_time_step
from openmm_cylchain.time_steps.stability import contact_stiffness_bound, diffusion_bound
from support.contexts import forces_of, new_context
from support.platforms import ENGINE_PLATFORMS, PLATFORMS
from support.solvent import KT, TEMPERATURE, VISCOSITY

ACTIN = F_ACTIN.with_segment_length(100)
DIAMETER = 30.0
BOX = 600.0 * np.eye(3)


def _crossed(engine=None, height=20.0, box=None):
    """Two filaments at right angles, one above the other, with beads."""
    filaments = Filaments(VISCOSITY, TEMPERATURE, engine=engine)
    filaments.add_straight(ACTIN, 4, [0, 200, 0], [1, 0, 0])
    filaments.add_straight(ACTIN, 4, [200, 0, height], [0, 1, 0])
    for number in range(2):
        filaments.add_beads(number, 15)
    return filaments, *filaments.build(box_vectors=box)


def _state(context):
    return context.getState(energy=True, forces=True, positions=True)


# Beads


@pytest.mark.parametrize("spacing, count", [(100, 5), (99.9, 6), (400, 2), (1000, 2), (15, 28), (0.04 * 1000, 11)])
def test_beads_cover_a_filament_evenly_with_its_ends(spacing, count):
    filaments = Filaments(VISCOSITY, TEMPERATURE)
    filaments.add_straight(DSDNA, 3, [0, 0, 0], [0, 0, 1])
    filaments.add_straight(ACTIN, 4, [0, 0, 0], [1, 0, 0])
    filaments.add_attachment(1, segment=0)
    beads = filaments.add_beads(1, spacing * unit.nanometer)
    assert len(beads) == count and beads == list(range(1, count + 1))
    topology, _, positions = filaments.build()
    indices = filaments.bead_indices
    assert len(indices[0]) == 0 and indices[1].tolist() == filaments.attachment_indices[beads].tolist()
    assert positions._value[indices[1]] == pytest.approx(np.linspace([0, 0, 0], [400, 0, 0], count))
    assert [atom.name for atom in topology.atoms()][4:] == ["NOD"] * 5 + ["ATT"] + ["BED"] * count


def test_beads_where_segments_are_shorter_than_the_spacing():
    filaments = Filaments(VISCOSITY, TEMPERATURE)
    filaments.add_straight(DSDNA, 10, [0, 0, 0], [1, 0, 0])
    filaments.add_beads(0, 2.5 * DSDNA.segment_length)
    _, _, positions = filaments.build()
    places = positions._value[filaments.bead_indices[0]]
    assert places == pytest.approx(np.linspace([0, 0, 0], [10 * DSDNA.segment_length, 0, 0], 5))


# Exclusions


def _pairs_by_hand(filaments, distance):
    """Every pair of one filament, one of them no node, whose segments are the same or neighbours, or that is close."""
    pairs = set()
    for number, nodes in enumerate(filaments.node_indices):
        last = filaments[number].segments - 1
        places = {int(node): float(place) for place, node in enumerate(nodes)}
        for particle, one in zip(filaments.attachment_indices, filaments.attachments):
            if one.filament == number:
                places[int(particle)] = one.segment + one.fraction
        segments = {p: {s for s in range(last + 1) if s <= place <= s + 1} for p, place in places.items()}
        for a in places:
            for b in places:
                close = abs(places[a] - places[b]) * filaments[number].type.segment_length <= distance
                near = min(abs(s - t) for s in segments[a] for t in segments[b]) <= 1
                if a < b and not {a, b} <= set(nodes.tolist()) and (close or near):
                    pairs.add((a, b))
    return pairs


@pytest.mark.parametrize("distance", [0.0, 190.0, 1000.0])
def test_excluded_pairs(distance):
    filaments = Filaments(VISCOSITY, TEMPERATURE)
    filaments.add_straight(ACTIN, 7, [0, 0, 0], [1, 0, 0])
    filaments.add_straight(DSDNA, 3, [0, 0, 50], [0, 0, 1])
    filaments.add_straight(ACTIN, 2, [0, 0, 200], [1, 0, 0])
    filaments.add_beads(1, 3)
    filaments.add_beads(0, 50)
    filaments.add_attachment(0, arc_length=333)
    filaments.build()
    pairs = excluded_pairs(filaments, distance * unit.nanometer)
    assert np.all(pairs[:, 0] < pairs[:, 1])
    assert len(np.unique(pairs, axis=0)) == len(pairs)
    assert set(map(tuple, pairs.tolist())) == _pairs_by_hand(filaments, distance)


def test_number_of_exclusions_is_proportional_to_that_of_beads():
    counts = []
    for segments in (20, 40, 80):
        filaments = Filaments(VISCOSITY, TEMPERATURE)
        filaments.add_straight(ACTIN, segments, [0, 0, 0], [1, 0, 0])
        filaments.add_beads(0, 10)
        filaments.build()
        counts.append(len(excluded_pairs(filaments, 60)))
    assert counts[2] - counts[1] == 2 * (counts[1] - counts[0])


def test_no_filament_with_beads_has_no_exclusions():
    filaments = Filaments(VISCOSITY, TEMPERATURE)
    filaments.add_straight(ACTIN, 2, [0, 0, 0], [1, 0, 0])
    filaments.build()
    assert excluded_pairs(filaments).shape == (0, 2)


def test_exclusions_are_added_once_and_change_no_exception():
    nonbonded, custom = openmm.NonbondedForce(), openmm.CustomNonbondedForce("r")
    for _ in range(4):
        nonbonded.addParticle(1, 1, 1)
        custom.addParticle([])
    nonbonded.addException(2, 1, 0.5, 0.3, 0.2)
    for force in (nonbonded, custom):
        for _ in range(2):
            add_exclusions(force, np.array([[1, 2], [0, 3], [3, 0]]))
    assert nonbonded.getNumExceptions() == custom.getNumExclusions() == 2
    assert [value._value for value in nonbonded.getExceptionParameters(0)[2:]] == [0.5, 0.3, 0.2]
    assert [value._value for value in nonbonded.getExceptionParameters(1)[2:]] == [0.0, 1.0, 0.0]
    add_exclusions(custom, [])
    for force, pairs, message in (
        (openmm.HarmonicBondForce(), [[0, 1]], "force must be one of NonbondedForce"),
        (custom, [0, 1], "pairs must be an int array"),
        (custom, [[0.0, 1.0]], "pairs must be an int array"),
    ):
        with pytest.raises(InputError, match=message):
            add_exclusions(force, pairs)


# The force


@pytest.mark.parametrize("platform", PLATFORMS)
@pytest.mark.parametrize("box", [None, BOX])
def test_energy_and_forces_of_two_rows(platform, box):
    """Against the sum over all pairs of beads of the two filaments; nodes carry the forces of their beads."""
    filaments, _, system, positions = _crossed("portable", box=box)
    system.addForce(contact_force(filaments, system, DIAMETER * unit.nanometer, 0.25))
    if box is not None:
        # One of the filaments in another image, and both across the boundary.
        positions = positions._value + [0, 0, 590.0]
        second = np.concatenate([filaments.node_indices[1], filaments.bead_indices[1]])
        positions[second] += [600.0, -1200.0, 600.0]
    state = _state(new_context(system, positions, platform=platform))
    placed = state.getPositions(asNumpy=True)._value
    first, second = (placed[beads] for beads in filaments.bead_indices)
    difference = first[:, None] - second[None]
    if box is not None:
        difference -= 600.0 * np.round(difference / 600.0)
    distance = np.linalg.norm(difference, axis=2)
    overlap = np.maximum(0.0, DIAMETER - distance)
    assert np.count_nonzero(overlap) > 3
    assert state.getPotentialEnergy()._value == pytest.approx(0.125 * np.sum(overlap**2), rel=1e-4)
    total = np.einsum("ij,ijk->k", 0.25 * overlap / distance, difference)
    forces = state.getForces(asNumpy=True)._value
    assert forces[filaments.node_indices[0]].sum(axis=0) == pytest.approx(total, rel=1e-3, abs=1e-3)
    assert total[2] < -1.0


@pytest.mark.parametrize("platform", PLATFORMS)
def test_a_filament_does_not_see_itself(platform):
    """Even where beads and nodes coincide, segments are shorter than the contact diameter, or it is bent."""
    filaments = Filaments(VISCOSITY, TEMPERATURE, engine="portable")
    angles = np.linspace(0, 2.0, 11)
    filaments.add_nodes(ACTIN.with_segment_length(20), 100 * np.stack([np.cos(angles), np.sin(angles), 0 * angles]).T)
    filaments.add_nodes(ACTIN, [[0, 0, 500], [100, 0, 500], [110, 80, 500]])
    for number in range(2):
        filaments.add_beads(number, 10)
        filaments.add_attachment(number, segment=0, fraction=0)
        filaments.add_attachment(number, segment=0, fraction=0)
    _, system, positions = filaments.build()
    force = contact_force(filaments, system, DIAMETER)
    force.setForceGroup(3)
    system.addForce(force)
    context = new_context(system, positions, platform=platform)
    state = context.getState(energy=True, forces=True, groups={3})
    assert state.getPotentialEnergy()._value == 0.0
    assert not state.getForces(asNumpy=True)._value.any()


def test_default_stiffness_and_parameter():
    filaments, _, system, _ = _crossed()
    force = contact_force(filaments, system, [20, 40])
    assert force.getGlobalParameterDefaultValue(0) == default_stiffness(20, TEMPERATURE)
    assert default_stiffness(20 * unit.nanometer, TEMPERATURE * unit.kelvin) * 20**2 / 2 == pytest.approx(20 * KT)
    assert force.getGlobalParameterName(0) == "contact_stiffness"
    assert force.getCutoffDistance()._value == 120
    assert {force.getParticleParameters(int(i)) for i in filaments.bead_indices[0]} == {(20.0,)}
    assert {force.getParticleParameters(int(i)) for i in filaments.node_indices[0]} == {(0.0,)}


def test_periodic_where_the_system_is():
    for box, periodic in ((None, False), (BOX, True)):
        filaments, _, system, _ = _crossed(box=box)
        assert contact_force(filaments, system, DIAMETER).usesPeriodicBoundaryConditions() is periodic
        assert contact_force(filaments, system, DIAMETER, periodic=False).usesPeriodicBoundaryConditions() is False
        assert contact_force(filaments, system, DIAMETER).getCutoffDistance()._value == 90
    filaments, _, system, _ = _crossed(box=np.diag([600, 600, 100]))
    assert contact_force(filaments, system, DIAMETER).getCutoffDistance()._value == 50
    with pytest.raises(InputError, match="box is 100 nm wide: contacts of 51 nm"):
        contact_force(filaments, system, 51)


def test_barrier_of_crossing_rows():
    """Against rows that are placed by hand; it falls to zero where the gaps are as wide as the rows."""
    stiffness = 0.3
    rows = 18.0 * np.arange(-9, 10)
    energies = []
    for shift in np.random.default_rng(3).uniform(0, 18, size=(3000, 2)):
        distance = np.hypot(rows[:, None] + shift[0], rows[None] + shift[1])
        energies.append(0.5 * stiffness * np.sum(np.maximum(0.0, DIAMETER - distance) ** 2))
    barrier = crossing_barrier(DIAMETER * unit.nanometer, 18, stiffness)
    assert barrier <= min(energies) * (1 + 1e-12) and barrier == pytest.approx(min(energies), rel=0.02)
    assert crossing_barrier(DIAMETER, 1.4 * DIAMETER, 1) > 0 == crossing_barrier(DIAMETER, 1.42 * DIAMETER, 1)
    assert crossing_barrier(DIAMETER, DIAMETER / 2, default_stiffness(DIAMETER, TEMPERATURE)) > 40 * KT


# Beside other forces


def _particles(periodic):
    """Three charged particles, two of them bonded, with a NonbondedForce and a CustomNonbondedForce of their own."""
    topology, system = app.Topology(), openmm.System()
    chain = topology.addChain()
    nonbonded, custom = openmm.NonbondedForce(), openmm.CustomNonbondedForce("strength1*strength2*max(0,1-r/70)")
    custom.addPerParticleParameter("strength")
    for _ in range(3):
        topology.addAtom("P", None, topology.addResidue("PRT", chain))
        system.addParticle(1e4)
        nonbonded.addParticle(0.1, 1.0, 0.5)
        custom.addParticle([1.5])
    nonbonded.setNonbondedMethod(openmm.NonbondedForce.CutoffPeriodic if periodic else nonbonded.CutoffNonPeriodic)
    custom.setNonbondedMethod(openmm.CustomNonbondedForce.CutoffPeriodic if periodic else custom.CutoffNonPeriodic)
    nonbonded.setCutoffDistance(70)
    custom.setCutoffDistance(70)
    nonbonded.addException(0, 1, 0.0, 1.0, 0.0)
    custom.addExclusion(0, 1)
    if periodic:
        system.setDefaultPeriodicBoxVectors(*BOX)
    return topology, system, [nonbonded, custom], np.array([[100.0, 220, 3], [130, 220, 0], [120, 260, 0]])


@pytest.mark.parametrize("engine, platform", ENGINE_PLATFORMS)
@pytest.mark.parametrize("before, periodic", [(True, True), (False, False)])
def test_beside_forces_that_were_there_before_or_come_after(engine, platform, before, periodic):
    topology, system, forces, start = _particles(periodic)
    if before:
        for force in forces:
            system.addForce(force)
    filaments = Filaments(VISCOSITY, TEMPERATURE, engine=engine)
    filaments.add_straight(ACTIN, 4, [0, 200, 0], [1, 0, 0])
    filaments.add_straight(ACTIN, 4, [200, 0, 20], [0, 1, 0])
    for number in range(2):
        filaments.add_beads(number, 15)
    filaments.add_attachment(0, segment=1, fraction=0)
    positions = filaments.add_to(topology, system, start)
    if not before:
        for _ in range(system.getNumParticles() - 3):
            forces[0].addParticle(0, 1, 0)
            forces[1].addParticle([0])
        for force in forces:
            system.addForce(force)
    contact = contact_force(filaments, system, DIAMETER, 0.2, particles=[0, 2], particle_diameter=[40, 50])
    contact.setForceGroup(1)
    system.addForce(contact)
    share_exclusions(system)
    everything = [force for force in system.getForces() if isinstance(force, (type(forces[0]), type(forces[1])))]
    assert len(everything) == 3
    assert len({force.getNumExclusions() for force in everything[1:]} | {everything[0].getNumExceptions()}) == 1
    step = filaments.recommended_time_step(contact_diameter=DIAMETER, contact_stiffness=0.2).step / 100
    integrator = filaments.create_integrator(
        system, min(step, 500), scheme="midpoint", particle_friction=1e6, random_seed=1
    )
    context = new_context(system, positions, integrator, platform)
    state = _state(context)
    placed = state.getPositions(asNumpy=True)._value

    diameter = np.zeros(len(placed))
    diameter[np.concatenate(filaments.bead_indices)] = DIAMETER
    diameter[[0, 2]] = [40, 50]
    filament = np.full(len(placed), -1)
    filament[filaments.bead_indices[0]], filament[filaments.bead_indices[1]] = 0, 1
    one, two = np.triu_indices(len(placed), 1)
    seen = (diameter[one] * diameter[two] > 0) & ((filament[one] != filament[two]) | (filament[one] == -1))
    distance = np.linalg.norm(placed[one] - placed[two], axis=1)
    overlap = np.maximum(0.0, 0.5 * (diameter[one] + diameter[two]) - distance)[seen]
    expected = 0.1 * np.sum(overlap**2)
    pairs = [(0, 2), (1, 2)]
    expected += sum(1.5**2 * (1 - np.linalg.norm(start[a] - start[b]) / 70) for a, b in pairs)
    # The reaction field of a NonbondedForce with cutoff, and no Lennard-Jones energy at these distances.
    dielectric, cutoff = 78.3, 70.0
    k = (dielectric - 1) / (2 * dielectric + 1) / cutoff**3
    c = 3 * dielectric / (2 * dielectric + 1) / cutoff
    r = np.array([np.linalg.norm(start[a] - start[b]) for a, b in pairs])
    expected += np.sum(138.935458 * 0.01 * (1 / r + k * r**2 - c))
    assert state.getPotentialEnergy()._value == pytest.approx(expected, rel=1e-4)
    integrator.step(20)
    assert np.isfinite(_state(context).getPositions(asNumpy=True)._value).all()


@pytest.mark.parametrize("platform", [name for name in PLATFORMS if name != "Reference"])
def test_different_exclusions_are_what_openmm_refuses(platform):
    filaments, _, system, positions = _crossed("portable")
    charges = openmm.NonbondedForce()
    charges.setNonbondedMethod(openmm.NonbondedForce.CutoffNonPeriodic)
    charges.setCutoffDistance(90)
    for _ in range(system.getNumParticles()):
        charges.addParticle(0, 1, 0)
    system.addForce(charges)
    system.addForce(contact_force(filaments, system, DIAMETER))
    with pytest.raises(openmm.OpenMMException, match="identical exc"):
        new_context(system, positions, platform=platform)


# The step


@pytest.mark.parametrize("beads_per_segment", [1.0, 7.0])
@pytest.mark.parametrize("length", [60.0, 360.0])
def test_stiffness_bound_is_where_a_contact_of_two_segments_blows_up(beads_per_segment, length):
    """2/lambda of the fastest mode of two free segments in contact, from matrices that are set up by hand."""
    actin = F_ACTIN.with_segment_length(length)
    friction = actin.segment_friction(VISCOSITY, TEMPERATURE)
    stiffness = 0.3
    ends = np.array([[0.25, 0.25], [0.25, 0.25]]) * friction.perpendicular
    ends = ends + np.array([[1, -1], [-1, 1]]) * friction.rotational / length**2
    single = stiffness * np.diag([0.0, 1.0])
    row = beads_per_segment * stiffness * np.array([[1 / 3, 1 / 6], [1 / 6, 1 / 3]])
    along = 2 * stiffness * (1 / friction.parallel + length**2 / 4 / friction.extensional)
    rates = [along] + [2 * np.linalg.eigvals(np.linalg.solve(ends, k)).real.max() for k in (single, row)]
    if beads_per_segment == 1.0:
        rates = rates[:2]  # one bead on each segment, which is at its end where it hurts
    bound = contact_stiffness_bound(friction, length, stiffness, beads_per_segment)
    assert bound == pytest.approx(2 / max(rates), rel=1e-9)


def test_recommended_step_with_contacts():
    filaments = Filaments(VISCOSITY, TEMPERATURE)
    filaments.add_straight(ACTIN, 10, [0, 0, 0], [1, 0, 0])
    filaments.add_beads(0, 20)
    friction = ACTIN.segment_friction(VISCOSITY, TEMPERATURE)
    alone = filaments.recommended_time_step()
    soft = filaments.recommended_time_step(contact_diameter=30 * unit.nanometer, contact_stiffness=1e-3)
    assert soft.step == pytest.approx(diffusion_bound(friction, 30, 100, TEMPERATURE))
    assert soft.step < alone.step
    assert "eq. (56)" in soft.reason
    assert set(soft.bounds) == {*alone.bounds, "contact diffusion", "contact stiffness"}
    cautious = filaments.recommended_time_step(contact_diameter=30, contact_stiffness=1e-3, confidence=6)
    assert cautious.step == pytest.approx(soft.step / 4)
    stiff = filaments.recommended_time_step(contact_diameter=30)
    stiffness = default_stiffness(30, TEMPERATURE)
    assert stiff.step == pytest.approx(contact_stiffness_bound(friction, 100, stiffness, 51 / 10) / 4)
    assert "stiffness of contacts" in stiff.reason
    assert stiff == filaments.recommended_time_step(contact_diameter=[30], contact_stiffness=stiffness)
    # Contacts that allow more than the filament changes nothing but the bounds.
    wide = filaments.recommended_time_step(contact_diameter=1e4)
    assert (wide.step, wide.reason) == (alone.step, alone.reason)
    filaments.add_straight(DSDNA, 10, [0, 0, 0], [1, 0, 0])
    both = filaments.recommended_time_step(contact_diameter=[30, 10], contact_stiffness=0.1)
    assert both.step == min(
        contact_time_step(DSDNA, VISCOSITY, TEMPERATURE, 10, 0.1, 10).step, filaments.recommended_time_step().step
    )


def test_bad_input_is_refused():
    filaments, _, system, _ = _crossed()
    bare = Filaments(VISCOSITY, TEMPERATURE)
    bare.add_straight(ACTIN, 2, [0, 0, 0], [1, 0, 0])
    bead = int(filaments.bead_indices[0][0])
    cold = Filaments(VISCOSITY, 0.0)
    cold.add_straight(ACTIN, 2, [0, 0, 0], [1, 0, 0])
    cold.add_beads(0, 10)
    with pytest.raises(InputError, match="contacts need a contact_stiffness"):
        cold.recommended_time_step(contact_diameter=30)
    _, cold_system, _ = cold.build()
    for make, message in (
        (lambda: filaments.add_beads(0, 10), "Beads of filament 0 comes too late"),
        (lambda: bare.add_beads(1, 10), "filament 1 does not exist; there are 1"),
        (lambda: bare.add_beads(0, 0), "Beads of filament 0: spacing must be positive"),
        (lambda: bare.add_beads(0, -3), "spacing must be positive"),
        (lambda: bare.add_beads(0, np.nan), "spacing must be finite"),
        (lambda: bare.add_beads(0, [1, 2]), "spacing must be a single number"),
        (lambda: bare.add_beads(0, 1 * unit.kelvin), "spacing has the unit"),
        (lambda: bare.add_beads(0, 50) and bare.add_beads(0, 50), "it has beads already"),
        (lambda: bare.bead_indices, "not in a System yet"),
        (lambda: excluded_pairs(bare), "not in a System yet"),
        (lambda: excluded_pairs(filaments, -1), "distance cannot be negative"),
        (lambda: contact_force(filaments, system, 0), "diameter must be positive"),
        (lambda: contact_force(filaments, system, [30, -1]), "diameter must be positive"),
        (lambda: contact_force(filaments, system, [30, 30, 30]), "diameter must be a number or have 2 entries"),
        (lambda: contact_force(filaments, system, np.nan), "diameter must be finite"),
        (lambda: contact_force(filaments, system, 1 * unit.second), "diameter has the unit"),
        (lambda: contact_force(filaments, system, 30, 0), "stiffness must be positive"),
        (lambda: contact_force(filaments, system, 30, particles=[bead], particle_diameter=9), "belongs to a filament"),
        (lambda: contact_force(filaments, system, 30, particles=[999], particle_diameter=9), "particles contains 999"),
        (lambda: contact_force(cold, cold_system, 30), "needs a stiffness"),
        (lambda: bare.recommended_time_step(contact_stiffness=1), "needs a contact_diameter"),
        (lambda: bare.recommended_time_step(contact_diameter=-1), "diameter must be positive"),
        (lambda: bare.recommended_time_step(contact_diameter=30, confidence=0), "confidence must be positive"),
        (lambda: crossing_barrier(30, 0, 1), "spacing must be positive"),
    ):
        with pytest.raises(InputError, match=message):
            make()
    topology, system, _, start = _particles(False)
    free = Filaments(VISCOSITY, TEMPERATURE)
    free.add_straight(ACTIN, 2, [0, 0, 0], [1, 0, 0])
    free.add_to(topology, system, start)
    with pytest.raises(InputError, match="There are no beads"):
        contact_force(free, system, 30)
    topology, system, _, start = _particles(False)
    free = Filaments(VISCOSITY, TEMPERATURE)
    free.add_straight(ACTIN, 2, [0, 0, 0], [1, 0, 0])
    free.add_beads(0, 30)
    free.add_to(topology, system, start)
    with pytest.raises(InputError, match="particles need a particle_diameter"):
        contact_force(free, system, 30, particles=[0])
    with pytest.raises(InputError, match="particle_diameter must be a number or have 1 entries"):
        contact_force(free, system, 30, particles=[0], particle_diameter=[30, 30])


def test_beads_of_a_ring_are_all_alike():
    filaments = Filaments(VISCOSITY, TEMPERATURE)
    filaments.add_ring(ACTIN, 9, [0, 0, 0])
    numbers = filaments.add_beads(0, 20)
    _, system, positions = filaments.build()
    beads = filaments.bead_indices[0]
    assert len(beads) == len(numbers) == 45
    places = positions._value[beads]
    np.testing.assert_allclose(np.linalg.norm(np.roll(places, -1, axis=0) - places, axis=1), 20, rtol=1e-9)
    pairs = excluded_pairs(filaments)
    assert len(np.unique(pairs, axis=0)) == len(pairs)
    assert np.all(pairs[:, 0] < pairs[:, 1])
    # Every node has the same neighbours but for where it is, and so have the beads in the same place of a segment.
    counts = np.bincount(pairs.ravel(), minlength=system.getNumParticles())
    assert np.ptp(counts[filaments.node_indices[0]]) == 0
    assert np.all(np.ptp(counts[beads].reshape(9, 5), axis=0) == 0)
    # A bead on a joint sees neither of the two segments before it nor of the two behind it: 20 beads and 5 nodes.
    assert counts[beads[0]] == 20 + 5
    # A force between beads is finite where the ring closes.
    system.addForce(contact_force(filaments, system, 40))
    context = new_context(system, positions)
    assert np.isfinite(forces_of(context)).all()


def test_small_rings_exclude_everything_once():
    filaments = Filaments(VISCOSITY, TEMPERATURE)
    filaments.add_ring(ACTIN, 4, [0, 0, 0])
    filaments.add_beads(0, 50)
    filaments.build()
    pairs = excluded_pairs(filaments, 1000)
    assert len(np.unique(pairs, axis=0)) == len(pairs) == 12 * 11 // 2 - 4 * 3 // 2


@pytest.mark.parametrize("spacing, stiffness, warns", [(12.5, None, False), (25, None, True), (12.5, 0.03, True)])
def test_gaps_between_beads_are_warned_of(spacing, stiffness, warns):
    filaments = Filaments(VISCOSITY, TEMPERATURE)
    for height in (0, 50):
        filaments.add_straight(ACTIN, 5, [0, 0, height], [1, 0, 0])
        filaments.add_beads(height // 50, spacing)
    _, system, _ = filaments.build()
    with warnings.catch_warnings(record=True) as record:
        warnings.simplefilter("always")
        contact_force(filaments, system, 30, stiffness)
    assert [issubclass(one.category, ContactWarning) for one in record] == [True] * warns
    assert not warns or f"Filament 0 has beads every {spacing} nm" in str(record[0].message)
