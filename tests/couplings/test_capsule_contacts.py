"""Contacts between capsules: exact two-rod geometry, straight filaments as whole rods, exclusions, and Contexts."""

import copy
import pickle
import warnings
from itertools import product

import numpy as np
import openmm
import pytest
from openmm import app, unit

from openmm_cylchain import F_ACTIN, ContactWarning, Filaments, InputError, capsule_contact_force, engine_choice
from openmm_cylchain.analysis import CrossingCounter
from openmm_cylchain.couplings.capsule_contacts import (
    as_capsule_contact_force,
    default_capsule_stiffness,
    owners_of_chains,
)
from openmm_cylchain.couplings.contacts import contact_force
from openmm_cylchain.engines.compiled import plugin
from openmm_cylchain.time_steps.explicit_forces import ExplicitForces
from support.contexts import energy_of, forces_of, new_context, positions_of
from support.platforms import ON_COMPILED_PLATFORMS
from support.solvent import KT, TEMPERATURE, VISCOSITY

ACTIN = F_ACTIN.with_segment_length(100)
DIAMETER = 30.0
STIFFNESS = 0.3
TRICLINIC = np.array([[1300.0, 0, 0], [400, 1250, 0], [-300, 500, 1400]])
# Of forces, over the largest: OpenMM reads them in single precision but in "double".
ROUNDING = {"single": 1e-4, "mixed": 1e-7, "double": 1e-11, None: 1e-12}


def _filaments(*lines, segments=4, bent=0.0, box=None, type_=ACTIN, seed=0):
    """Filaments from an origin in a direction each; random bends if wanted."""
    filaments = Filaments(VISCOSITY, TEMPERATURE)
    for origin, direction in lines:
        filaments.add_straight(type_, segments, origin, direction)
    topology, system, positions = filaments.build(box_vectors=box)
    positions = np.array(positions._value)
    if bent:
        positions += np.random.default_rng(seed).normal(0, bent, positions.shape)
    return filaments, topology, system, positions


def _random_lines(count, extent, seed):
    rng = np.random.default_rng(seed)
    return [(rng.uniform(0, extent, 3), rng.normal(size=3)) for _ in range(count)]


def _alone(system, force):
    """The System without other forces."""
    result = openmm.System()
    for _ in range(system.getNumParticles()):
        result.addParticle(1.0)
    result.setDefaultPeriodicBoxVectors(*system.getDefaultPeriodicBoxVectors())
    result.addForce(force)
    return result


def _context(system, force, positions, platform="Reference", properties=None):
    return new_context(_alone(system, copy.deepcopy(force)), positions, platform=platform, properties=properties)


def _rod_distance(a0, a1, b0, b1):
    """Of two line segments: that of an end and a segment, or of the lines."""

    def from_segment(point, start, stop):
        along = stop - start
        fraction = np.clip(np.dot(point - start, along) / np.dot(along, along), 0, 1)
        return np.linalg.norm(point - start - fraction * along)

    distances = [from_segment(a0, b0, b1), from_segment(a1, b0, b1), from_segment(b0, a0, a1), from_segment(b1, a0, a1)]
    normal = np.cross(a1 - a0, b1 - b0)
    square = np.dot(normal, normal)
    s = np.dot(np.cross(b0 - a0, b1 - b0), normal) / square
    t = np.dot(np.cross(b0 - a0, a1 - a0), normal) / square
    if 0 <= s <= 1 and 0 <= t <= 1:
        distances.append(abs(np.dot(b0 - a0, normal)) / np.sqrt(square))
    return min(distances)


# Energies and forces


@ON_COMPILED_PLATFORMS
@pytest.mark.parametrize("height", [29.0, 12.0, 31.0])
@pytest.mark.parametrize("place", [130.0, 100.0, 200.0])
def test_two_crossed_rods(platform, height, place):
    """One contact, wherever the joints are; the force is shared by the ends of the two segments that touch."""
    filaments, _, system, positions = _filaments(([0, place, 0], [1, 0, 0]), ([130, 0, height], [0, 1, 0]))
    force = capsule_contact_force(filaments, system, DIAMETER * unit.nanometer, STIFFNESS)
    assert force.getStiffness() == STIFFNESS * unit.kilojoule_per_mole / unit.nanometer**2
    assert force.getChainDiameter(1) == DIAMETER * unit.nanometer
    context = _context(system, force, positions, platform)
    overlap = max(0.0, DIAMETER - height)
    assert energy_of(context) == pytest.approx(0.5 * STIFFNESS * overlap**2, rel=max(1e-12, platform.tolerance))
    forces = forces_of(context)
    expected = np.zeros_like(forces)
    one, other = filaments.node_indices
    pushed = STIFFNESS * overlap
    expected[one[1:3], 2] = -0.7 * pushed, -0.3 * pushed
    segment, fraction = divmod(place / 100, 1)
    segment = int(segment)
    expected[other[segment : segment + 2], 2] = (1 - fraction) * pushed, fraction * pushed
    np.testing.assert_allclose(forces, expected, atol=max(1e-9, 20 * platform.tolerance))


@pytest.mark.sample("^(?!box1)")
@ON_COMPILED_PLATFORMS
@pytest.mark.parametrize("box", [None, pytest.param(1300 * np.eye(3), marks=pytest.mark.slow), TRICLINIC])
def test_straight_filaments_are_whole_rods(box, platform):
    """Every pair of filaments has one contact where the whole rods are nearest, joints or not, in each image."""
    count, extent = (90, 1200) if box is not None else (30, 250)
    filaments, _, system, positions = _filaments(*_random_lines(count, extent, 1), box=box)
    rng = np.random.default_rng(2)
    images = np.zeros((1, 3))
    if box is not None:
        # Whole filaments in other images of the box.
        for nodes in filaments.node_indices:
            positions[nodes] += rng.integers(-1, 2, 3) @ box
        images = np.array([np.array(one) @ box for one in product(range(-3, 4), repeat=3)])
    diameters = rng.uniform(25, 50, len(filaments))
    force = capsule_contact_force(filaments, system, diameters * unit.nanometer, STIFFNESS)
    assert force.usesPeriodicBoundaryConditions() == (box is not None)
    expected, touching = 0.0, 0
    ends = [(positions[nodes[0]], positions[nodes[-1]]) for nodes in filaments.node_indices]
    for a, b in zip(*np.triu_indices(len(ends), 1)):
        touch = 0.5 * (diameters[a] + diameters[b])
        middle = 0.5 * (sum(ends[a]) - sum(ends[b]))
        for image in images[np.linalg.norm(middle + images, axis=1) < 400 + touch]:
            distance = _rod_distance(*(end + image for end in ends[a]), *ends[b])
            expected += 0.5 * STIFFNESS * max(0.0, touch - distance) ** 2
            touching += distance < touch
    assert touching > 15
    # No two of them are nearly parallel where they touch.
    found = energy_of(_context(system, force, positions, platform))
    assert found == pytest.approx(expected, rel=max(1e-9, platform.tolerance))


@ON_COMPILED_PLATFORMS
@pytest.mark.parametrize("box, bent", [(None, 15.0), (TRICLINIC, 5.0)])
def test_forces_and_energies_are_those_of_the_reference_platform(box, bent, platform):
    """Bent filaments have contacts on the inner and outer sides of joints, which belong to one of two segments."""
    filaments, _, system, positions = _filaments(
        *_random_lines(40, 400 if box is None else 1200, 3), segments=6, box=box, bent=bent
    )
    outside = [system.addParticle(1.0) for _ in range(30)]
    places = np.random.default_rng(6).uniform(0, 400 if box is None else 1200, (len(outside), 3))
    force = capsule_contact_force(
        filaments, system, 60.0, STIFFNESS, particles=outside, particle_diameter=120.0, periodic=box is not None
    )
    context = _context(system, force, np.vstack([positions, places]), platform)
    expected = _context(system, force, positions_of(context))
    forces = forces_of(expected)
    assert np.count_nonzero(np.abs(forces).max(axis=1)) > 80 and np.abs(forces[outside]).max() > 1
    bound = ROUNDING[platform.precision] * np.abs(forces).max()
    # On GPUs, what each contact adds is cut off after 2^-32 kJ/(mol nm).
    np.testing.assert_allclose(forces_of(context), forces, atol=max(bound, 50 * 2**-32), rtol=0)
    assert energy_of(context) == pytest.approx(energy_of(expected), rel=1e-10)


@pytest.mark.parametrize("box, bent", [(None, 15.0), (TRICLINIC, 5.0)])
def test_forces_are_the_gradient(box, bent):
    filaments, _, system, positions = _filaments(
        *_random_lines(40, 400 if box is None else 1200, 3), segments=6, box=box, bent=bent
    )
    force = capsule_contact_force(filaments, system, 60.0, STIFFNESS)
    context = _context(system, force, positions)
    forces = forces_of(context)
    assert np.count_nonzero(np.abs(forces).max(axis=1)) > 50
    np.testing.assert_allclose(forces.sum(axis=0), 0, atol=1e-9)
    rng = np.random.default_rng(4)
    for _ in range(30):
        direction = rng.normal(size=positions.shape)
        energies = []
        for sign in (1, -1):
            context.setPositions(positions + sign * 1e-5 * direction)
            energies.append(energy_of(context))
        slope = (energies[0] - energies[1]) / 2e-5
        assert slope == pytest.approx(-np.sum(forces * direction), rel=1e-5, abs=1e-5)


def test_parallel_rods_share_the_stiffness():
    filaments, _, system, positions = _filaments(([0, 0, 0], [1, 0, 0]), ([30, 0, 20], [1, 0, 0]), segments=1)
    context = _context(system, capsule_contact_force(filaments, system, DIAMETER, STIFFNESS), positions)
    assert energy_of(context) == pytest.approx(0.5 * STIFFNESS * 100, rel=1e-12)
    forces = forces_of(context)
    np.testing.assert_allclose(forces[:, 2].reshape(2, 2).sum(axis=1), [-3, 3], rtol=1e-12)
    # At 30 and 100 nm of the first: 0.65 of the force on its second node.
    np.testing.assert_allclose(forces[:2, 2], [-0.5 * 3 * 0.7, -0.5 * 3 * 1.3], rtol=1e-12)


def test_capsules_are_like_many_beads_but_smooth():
    """Rows of beads that are close to each other have the range of a capsule, and what it pushes is as it should."""
    filaments = Filaments(VISCOSITY, TEMPERATURE)
    filaments.add_straight(ACTIN, 4, [0, 150, 0], [1, 0, 0])
    filaments.add_straight(ACTIN, 4, [130, 0, 28], [0, 1, 0])
    for number in range(2):
        filaments.add_beads(number, 1.0)
    _, system, positions = filaments.build()
    beads = contact_force(filaments, system, DIAMETER, STIFFNESS)
    capsules = capsule_contact_force(filaments, system, DIAMETER, STIFFNESS)
    energies = []
    for height in (28.0, 29.5, 30.5):
        moved = np.array(positions._value)
        moved[:, 2] += np.where(moved[:, 2] > 1, height - 28, 0)
        energies.append([energy_of(_context(system, force, moved)) for force in (beads, capsules)])
    assert energies[2] == [0, 0] and np.all(np.array(energies[:2]) > 0)
    # Beads of a spacing s see the integral of (k/2) (d - r)^2 over the plane that the two rows span, over s^2.
    integral = np.polynomial.Polynomial([0, DIAMETER**2, -2 * DIAMETER, 1]).integ()
    for (of_beads, of_capsules), gap in zip(energies, (2.0, 0.5)):
        expected = np.pi * STIFFNESS * (integral(DIAMETER) - integral(DIAMETER - gap)) / 1.0**2
        assert of_beads == pytest.approx(expected, rel=0.02)
        assert of_capsules == pytest.approx(STIFFNESS / 2 * gap**2, rel=1e-12)


# What does not touch


def _hairpin():
    """A filament that turns back along itself, 20 nm above: segments 0 and 4 touch, 1 and 3, and a bit 0 and 3."""
    filaments, _, system, positions = _filaments(([0, 0, 0], [1, 0, 0]), segments=5)
    positions[:] = [[0, 0, 0], [100, 0, 0], [200, 0, 0], [190, 0, 20], [90, 0, 20], [-10, 0, 20]]
    return filaments, system, positions


@ON_COMPILED_PLATFORMS
def test_neighbors_are_excluded(platform):
    filaments, system, positions = _hairpin()
    energies = []
    for neighbors in (1, 2, 3, 4):
        force = capsule_contact_force(filaments, system, DIAMETER, STIFFNESS, excluded_neighbors=neighbors)
        assert force.getChainExcludedNeighbors(0) == neighbors
        energies.append(energy_of(_context(system, force, positions, platform)))
    # Half of the stiffness at each node that has a segment above or below it: at 0, 90, 100 and 190 nm. Without the
    # segments 1 and 3, the last one is missing; without 0 and 3, those at 0 and 90 nm are left.
    one = 0.5 * STIFFNESS * 10**2
    assert energies == pytest.approx([2 * one, 1.5 * one, one, 0], rel=max(1e-12, platform.tolerance))
    force = capsule_contact_force(filaments, system, DIAMETER, STIFFNESS, excluded_neighbors=3)
    force.addExclusion(0, 4, 0, 0)
    assert force.getExclusion(0) == [0, 4, 0, 0]
    assert energy_of(_context(system, force, positions, platform)) == 0


def test_default_exclusions_span_two_diameters():
    for length, diameter, expected in ((100, 30, 1), (100, 50, 1), (100, 51, 2), (20, 30, 3), (20, 31, 4)):
        filaments, _, system, _ = _filaments(([0, 0, 0], [1, 0, 0]), type_=F_ACTIN.with_segment_length(length))
        force = capsule_contact_force(filaments, system, diameter)
        assert force.getChainExcludedNeighbors(0) == expected


def test_rings():
    """Two linked rings touch; the last segment of a ring is a neighbour of the first."""
    filaments = Filaments(VISCOSITY, TEMPERATURE)
    filaments.add_ring(ACTIN, 12, [0, 0, 0])
    filaments.add_ring(ACTIN, 12, [400, 0, 0])
    _, system, positions = filaments.build()
    positions = np.array(positions._value)
    one, other = filaments.node_indices
    force = capsule_contact_force(filaments, system, DIAMETER, STIFFNESS)
    assert force.isChainClosed(0) and force.isChainClosed(1)
    assert energy_of(_context(system, _only(force, 0), positions)) == 0
    # The second one upright, through the first, 12 nm beside its rim.
    upright = positions[other] - positions[other].mean(axis=0)
    upright = upright[:, [0, 2, 1]]
    rim = max(positions[one], key=lambda point: point[0])
    positions[other] = upright - upright[np.argmin(upright[:, 0])] + rim - [12.0, 0, 0]
    context = _context(system, force, positions)
    sides = [(positions[nodes[i - 1]], positions[nodes[i]]) for nodes in (one, other) for i in range(12)]
    distance = min(_rod_distance(*a, *b) for a, b in product(sides[:12], sides[12:]))
    assert 10 < distance < 12
    assert energy_of(context) == pytest.approx(0.5 * STIFFNESS * (DIAMETER - distance) ** 2, rel=1e-9)


def _only(force, chain):
    alone = plugin.CylinderChainContactForce(force.getStiffness())
    arguments = force.getChainDiameter(chain), force.getChainExcludedNeighbors(chain), force.isChainClosed(chain)
    alone.addChain(list(force.getChainParticles(chain)), *arguments)
    return alone


def test_spheres():
    """Particles outside filaments touch segments and each other."""
    topology, system = app.Topology(), openmm.System()
    chain = topology.addChain()
    for _ in range(3):
        topology.addAtom("P", None, topology.addResidue("PRT", chain))
        system.addParticle(1e4)
    filaments = Filaments(VISCOSITY, TEMPERATURE)
    filaments.add_straight(ACTIN, 3, [0, 0, 0], [1, 0, 0])
    positions = filaments.add_to(topology, system, np.array([[100.0, 0, 30], [150, 40, 0], [150, 40, 38]]))
    force = capsule_contact_force(
        filaments, system, DIAMETER, STIFFNESS, particles=[0, 1, 2], particle_diameter=[40, 60, 20] * unit.nanometer
    )
    assert force.getNumSpheres() == 3 and force.getSphereParticle(1) == 1
    assert force.getSphereDiameter(2) == 20 * unit.nanometer
    overlaps = np.array([35 - 30, 45 - 40, 40 - 38])
    context = _context(system, force, positions)
    assert energy_of(context) == pytest.approx(0.5 * STIFFNESS * np.sum(overlaps**2.0), rel=1e-12)
    forces = forces_of(context)
    np.testing.assert_allclose(forces[0], [0, 0, STIFFNESS * 5], atol=1e-12)
    force.addExclusion(-1, 1, -1, 2)
    force.addExclusion(-1, 0, 0, 0)
    force.addExclusion(0, 1, -1, 0)
    assert energy_of(_context(system, force, positions)) == pytest.approx(0.5 * STIFFNESS * 25, rel=1e-12)


# The force as an object


def test_copies_pickles_and_xml():
    filaments, _, system, positions = _filaments(*_random_lines(12, 250, 5))
    topology_particle = system.addParticle(1.0)
    positions = np.vstack([positions, [125.0, 125, 125]])
    force = capsule_contact_force(
        filaments, system, DIAMETER, STIFFNESS, particles=[topology_particle], particle_diameter=200, periodic=False
    )
    force.addExclusion(0, 1, 2, 3)
    force.addExclusion(-1, 0, 1, 2)
    force.setForceGroup(3)
    force.setName("mine")
    expected = energy_of(_context(system, force, positions))
    assert expected > 0
    xml = openmm.XmlSerializer.serialize(force)
    for other in (copy.deepcopy(force), pickle.loads(pickle.dumps(force)), openmm.XmlSerializer.deserialize(xml)):
        assert plugin.CylinderChainContactForce.isinstance(other)
        assert openmm.XmlSerializer.serialize(other) == xml
        assert energy_of(_context(system, plugin.CylinderChainContactForce.cast(other), positions)) == expected
    host = _alone(system, force)
    assert as_capsule_contact_force(host.getForce(0)).getNumExclusions() == 2
    assert as_capsule_contact_force(openmm.HarmonicBondForce()) is None


@ON_COMPILED_PLATFORMS
def test_parameters_in_two_contexts(platform):
    filaments, _, system, positions = _filaments(([0, 150, 0], [1, 0, 0]), ([150, 0, 20], [0, 1, 0]))
    host = _alone(system, capsule_contact_force(filaments, system, DIAMETER, STIFFNESS))
    force = as_capsule_contact_force(host.getForce(0))
    contexts = [new_context(host, positions, platform=platform) for _ in range(2)]
    assert [energy_of(context) for context in contexts] == pytest.approx([15.0, 15.0])
    force.setStiffness(2 * STIFFNESS)
    force.setChainDiameter(0, 50)
    force.updateParametersInContext(contexts[1])
    assert [energy_of(context) for context in contexts] == pytest.approx([15.0, 0.5 * 0.6 * 20**2])
    force.addChain([0, 1], 30)
    with pytest.raises(openmm.OpenMMException, match="cannot be added"):
        force.updateParametersInContext(contexts[1])


@ON_COMPILED_PLATFORMS
@pytest.mark.parametrize("box", [None, TRICLINIC])
def test_pairs_are_found_again_where_particles_have_moved(box, platform):
    """At each of many steps, forces are those of a Context that has just looked for pairs, to the bit."""
    filaments, _, system, positions = _filaments(*_random_lines(40, 900, 6), box=box)
    force = capsule_contact_force(filaments, system, DIAMETER, STIFFNESS)
    context = _context(system, force, positions, platform)
    host = _alone(system, force)
    fresh = new_context(host, positions, platform=platform)
    rng = np.random.default_rng(7)
    velocities = rng.normal(0, 1, positions.shape) + rng.normal(0, 3, (1, 3))
    energies = []
    for step in range(60):
        moved = positions + step * velocities
        context.setPositions(moved)
        if box is not None and step == 30:
            context.setPeriodicBoxVectors(*(1.02 * box))
        fresh.setPositions(moved)
        fresh.setPeriodicBoxVectors(*context.getState().getPeriodicBoxVectors())
        # It must look for pairs again, because its diameters may have changed.
        as_capsule_contact_force(host.getForce(0)).updateParametersInContext(fresh)
        np.testing.assert_array_equal(forces_of(context), forces_of(fresh))
        assert energy_of(context) == energy_of(fresh)
        energies.append(energy_of(fresh))
    assert len(set(energies)) > 30


def test_results_do_not_depend_on_threads():
    filaments, _, system, positions = _filaments(*_random_lines(60, 500, 8), bent=10.0)
    force = capsule_contact_force(filaments, system, 40, STIFFNESS)
    results = [forces_of(_context(system, force, positions, "CPU", {"Threads": str(threads)})) for threads in (1, 2, 3)]
    results.append(forces_of(_context(system, force, positions)))
    for forces in results[1:]:
        np.testing.assert_array_equal(forces, results[0])
    assert np.abs(results[0]).max() > 1


# In a run


def test_filaments_do_not_cross_in_a_run():
    box = 700 * np.eye(3)
    filaments, _, system, positions = _filaments(*_random_lines(30, 700, 9), segments=5, box=box)
    system.addForce(capsule_contact_force(filaments, system, DIAMETER))
    step = filaments.recommended_time_step(system=system)
    assert any("CylinderChainContactForce" in name for name in step.bounds)
    integrator = filaments.create_integrator(system, step, random_seed=1)
    context = new_context(system, positions, integrator, "CPU")
    # What overlaps at the start may end up on either side.
    integrator.step(500)
    counter = CrossingCounter(filaments, positions_of(context), box_vectors=box)
    for _ in range(40):
        integrator.step(10)
        counter.update(positions_of(context))
    assert counter.count == 0


def test_step_is_that_of_springs_of_twice_the_stiffness():
    """Explicit steps know a contact as a spring to a fixed point with twice its stiffness, on the end of a filament."""
    filaments, _, system, _ = _filaments(([0, 0, 0], [1, 0, 0]), ([0, 0, 60], [0, 1, 0]))
    force = capsule_contact_force(filaments, system, DIAMETER, STIFFNESS)
    springs = openmm.CustomExternalForce("0.5*strength*(x^2+y^2+z^2)")
    springs.addPerParticleParameter("strength")
    for nodes in filaments.node_indices:
        for node in (nodes[0], nodes[-1]):
            springs.addParticle(int(node), [2 * STIFFNESS])
    steps = []
    for one in (force, springs):
        host = copy.deepcopy(system)
        host.addForce(one)
        known = ExplicitForces(host, filaments, "midpoint")
        assert known.unknown == ()
        steps.append(known.recommended_step())
    assert steps[0].step == pytest.approx(steps[1].step, rel=1e-6)
    assert "CylinderChainContactForce (force" in steps[0].reason and "end of filament" in steps[0].reason


def test_step_of_contacts_in_the_equations_is_that_of_diffusion():
    filaments, _, system, _ = _filaments(([0, 0, 0], [1, 0, 0]), ([0, 0, 60], [0, 1, 0]))
    free = filaments.recommended_time_step("implicit", system=system)
    force = capsule_contact_force(filaments, system, DIAMETER, STIFFNESS)
    index = system.addForce(force)
    assert ExplicitForces(system, filaments, "implicit").springs == []
    step = filaments.recommended_time_step("implicit", system=system)
    filament = filaments[0]
    friction = filament.type.segment_friction(filaments.viscosity, filaments.temperature, filament.segments)
    expected = (0.6 * DIAMETER) ** 2 / (2 * KT * 2 / friction.perpendicular)
    name = f"CylinderChainContactForce (force {index}): segments in contact"
    assert step.allowed[name] == pytest.approx(expected)
    assert step.step == pytest.approx(min(free.step, expected))


# What is refused and warned of


@pytest.mark.parametrize(
    "stiffness, warns", [(None, False), (52 * KT / DIAMETER**2, False), (48 * KT / DIAMETER**2, True)]
)
def test_low_barriers_are_warned_of(stiffness, warns):
    filaments, _, system, _ = _filaments(([0, 0, 0], [1, 0, 0]))
    with warnings.catch_warnings(record=True) as record:
        warnings.simplefilter("always")
        capsule_contact_force(filaments, system, DIAMETER, stiffness)
    assert [issubclass(one.category, ContactWarning) for one in record] == [True] * warns
    assert not warns or "for 24 k_B T" in str(record[0].message)


def test_messages_have_the_numbers_of_filaments():
    """Of those that take part: in warnings and in recommended steps."""
    filaments, _, system, _ = _filaments(*(([0, 0, 60 * own], [1, 0, 0]) for own in range(3)))
    with pytest.warns(ContactWarning, match="Filament 2 has a contact diameter of 10 nm"):
        force = capsule_contact_force(filaments, system, [10, 30], 1.0, numbers=[2, 1])
    assert [force.getChainDiameter(chain)._value for chain in (0, 1)] == [10.0, 30.0]
    assert list(owners_of_chains(force, filaments)) == [2, 1]
    system.addForce(force)
    allowed = filaments.recommended_time_step("midpoint", system=system).allowed
    numbers = {name.rsplit(" ", 1)[1] for name in allowed if ": end of filament" in name}
    assert numbers and numbers <= {"1", "2"}


def test_default_stiffness_makes_a_barrier_of_forty():
    filaments, _, system, positions = _filaments(([0, 150, 0], [1, 0, 0]), ([150, 0, 1e-6], [0, 1, 0]))
    force = capsule_contact_force(filaments, system, [DIAMETER, 50])
    assert force.getStiffness()._value == default_capsule_stiffness(DIAMETER * unit.nanometer, TEMPERATURE)
    context = _context(system, capsule_contact_force(filaments, system, DIAMETER), positions)
    assert energy_of(context) == pytest.approx(40 * KT, rel=1e-6)


def test_bad_input_is_refused(monkeypatch):
    filaments, _, system, positions = _filaments(([0, 0, 0], [1, 0, 0]), ([0, 0, 60], [0, 1, 0]))
    node = int(filaments.node_indices[0][0])
    cold = Filaments(VISCOSITY, 0.0)
    cold.add_straight(ACTIN, 2, [0, 0, 0], [1, 0, 0])
    _, cold_system, _ = cold.build()
    narrow, _, narrow_system, _ = _filaments(([0, 0, 0], [1, 0, 0]), box=255 * np.eye(3))
    for make, message in (
        (lambda: capsule_contact_force(filaments, system, 0), "diameter must be positive"),
        (lambda: capsule_contact_force(filaments, system, [30, 30, 30]), "diameter must be a number or have 2 entries"),
        (lambda: capsule_contact_force(filaments, system, 1 * unit.second), "diameter has the unit"),
        (lambda: capsule_contact_force(filaments, system, 30, 0), "stiffness must be positive"),
        (lambda: capsule_contact_force(filaments, system, 30, particles=[999], particle_diameter=9), "contains 999"),
        (lambda: capsule_contact_force(filaments, system, 30, particles=[node], particle_diameter=9), "to a filament"),
        (lambda: capsule_contact_force(filaments, system, 30, particles=[node]), "to a filament"),
        (lambda: capsule_contact_force(filaments, system, 30, excluded_neighbors=-1), "excluded_neighbors"),
        (lambda: capsule_contact_force(filaments, system, 30, excluded_neighbors=1.5), "excluded_neighbors"),
        (lambda: capsule_contact_force(filaments, system, 30, particles=5, particle_diameter=9), "must be a sequence"),
        (lambda: capsule_contact_force(filaments, system, 30, particles=5), "must be a sequence .* but is 5"),
        (lambda: capsule_contact_force(filaments, system, None), "diameter must be a number .* but is None"),
        (lambda: capsule_contact_force(filaments, system, 1e20), "1e.20 nm is none of filaments"),
        (lambda: capsule_contact_force(filaments, system, 1e-20), "1e-20 nm is none of filaments"),
        (lambda: capsule_contact_force(filaments, system, [30, 30], numbers=[1]), "must be a number or have 1 entries"),
        (
            lambda: capsule_contact_force(filaments, system, 30, numbers=[0, 2]),
            "Filament 2 does not exist; there are 2",
        ),
        (lambda: capsule_contact_force(filaments, system, 30, numbers=[1, 1]), "those of different filaments"),
        (lambda: capsule_contact_force(filaments, system, numbers=[]), "no filaments that could touch"),
        (lambda: capsule_contact_force(cold, cold_system, 30), "needs a stiffness"),
        (lambda: capsule_contact_force(narrow, narrow_system, 30), "255 nm wide .* need 260 nm"),
    ):
        with pytest.raises(InputError, match=message):
            make()
    capsule_contact_force(narrow, narrow_system, 25)
    # What changes after the force was made is refused by the Context.
    system.setDefaultPeriodicBoxVectors(*(1000 * np.eye(3)))
    force = capsule_contact_force(filaments, system, 30, periodic=True)
    context = _context(system, force, positions)
    context.setPeriodicBoxVectors(*(200 * np.eye(3)))
    with pytest.raises(openmm.OpenMMException, match="too small for contacts"):
        energy_of(context)
    context = _context(system, capsule_contact_force(filaments, system, 30), positions)
    positions[3, 1] = np.nan
    context.setPositions(positions)
    with pytest.raises(openmm.OpenMMException, match="particle 3 is not finite|NaN"):
        energy_of(context)
    monkeypatch.setattr(engine_choice, "_why_compiled_is_missing", lambda: "it is not part of this installation")
    with pytest.raises(InputError, match="compiled engine is missing"):
        capsule_contact_force(filaments, system, 30)
    assert as_capsule_contact_force(force) is None


def test_a_refused_context_leaves_its_integrator_free():
    filaments, _, system, positions = _filaments(([0, 0, 0], [1, 0, 0]), ([0, 0, 60], [0, 1, 0]), box=300 * np.eye(3))
    system.addForce(capsule_contact_force(filaments, system, 30))
    integrator = filaments.create_integrator(system, 1e4)
    with pytest.raises(openmm.OpenMMException, match="in implicit steps: it is 300 nm wide .* 320 nm"):
        new_context(system, positions, integrator=integrator)
    with pytest.raises(openmm.OpenMMException, match="not bound to a context"):
        integrator.step(1)
    system.setDefaultPeriodicBoxVectors(*(450 * np.eye(3)))
    context = new_context(system, positions, integrator=integrator)
    integrator.step(2)
    assert context.getStepCount() == 2


def test_exclusions_cannot_be_added_to_a_context():
    filaments, _, system, positions = _filaments(([0, 0, 0], [1, 0, 0]), ([0, 0, 60], [0, 1, 0]))
    force = capsule_contact_force(filaments, system, 30)
    force.addExclusion(0, 0, 1, 0)
    system.addForce(force)
    context = new_context(system, positions)
    force.updateParametersInContext(context)
    force.addExclusion(0, 1, 1, 0)
    with pytest.raises(openmm.OpenMMException, match="Exclusions cannot be added to a Context"):
        force.updateParametersInContext(context)


def test_bad_input_of_the_force_is_refused():
    force = plugin.CylinderChainContactForce(1)
    force.addChain([0, 1, 2], 10)
    force.addSphere(3, 10)
    for make, message in (
        (lambda: plugin.CylinderChainContactForce(-1), "stiffness cannot be negative"),
        (lambda: plugin.CylinderChainContactForce(np.nan), "stiffness"),
        (lambda: force.setStiffness(np.inf), "stiffness"),
        (lambda: force.addChain([0], 10), "at least two"),
        (lambda: force.addChain([0, 1], 10, 1, True), "at least three"),
        (lambda: force.addChain([0, 0], 10), "twice"),
        (lambda: force.addChain([0, -1], 10), "Illegal particle index: -1"),
        (lambda: force.addChain([0, 1], 0), "diameter of a chain must be positive"),
        (lambda: force.addChain([0, 1], 10, -1), "excluded neighbors cannot be negative"),
        (lambda: force.setChainDiameter(0, -2), "diameter"),
        (lambda: force.setChainDiameter(1, 2), "Index out of range"),
        (lambda: force.addSphere(-2, 10), "Illegal particle index: -2"),
        (lambda: force.addSphere(2, np.nan), "diameter of a sphere"),
        (lambda: force.setSphereDiameter(0, 0), "diameter of a sphere"),
        (lambda: force.getSphereParticle(1), "Index out of range"),
        (lambda: force.addExclusion(0, 2, 0, 0), "has no segment 2"),
        (lambda: force.addExclusion(0, 0, -1, 1), "Index out of range"),
        (lambda: force.addExclusion(1, 0, 0, 0), "Index out of range"),
    ):
        with pytest.raises(openmm.OpenMMException, match=message):
            make()
    system = openmm.System()
    for _ in range(3):
        system.addParticle(1.0)
    system.addForce(force)
    with pytest.raises(openmm.OpenMMException, match="Illegal particle index: 3"):
        new_context(system, np.zeros((3, 3)))


def _planar_pair(first, second, height=0.0, edge=None):
    filaments = Filaments(VISCOSITY, TEMPERATURE, "compiled")
    for start, direction, z in ((*first, 0.0), (*second, height)):
        filaments.add_straight(ACTIN, 3, [*start, z], [*direction, 0], planar=True)
    box = None if edge is None else edge * np.eye(3)
    _, system, _ = filaments.build(box_vectors=box)
    return filaments, system


@pytest.mark.parametrize("edge", [None, 1000])
def test_planar_filaments_across_each_other_are_warned_of(edge):
    shift = 0 if edge is None else 3000
    filaments, system = _planar_pair(((0, 0), (1, 0)), ((150 + shift, -120), (0, 1)), edge=edge)
    with pytest.warns(ContactWarning, match="Segment 1 of filament 0 and segment 1 of filament 1 cross each other in"):
        capsule_contact_force(filaments, system, 30)


def test_planar_filaments_beside_or_above_each_other_are_not_warned_of():
    for second, height in ((((150, 20), (0, 1)), 0.0), (((150, -120), (0, 1)), 40.0), (((0, 40), (1, 0)), 0.0)):
        filaments, system = _planar_pair(((0, 0), (1, 0)), second, height)
        with warnings.catch_warnings():
            warnings.simplefilter("error")
            capsule_contact_force(filaments, system, 30)


def test_neighbors_in_a_planar_filament_do_not_cross():
    filaments = Filaments(VISCOSITY, TEMPERATURE, "compiled")
    filaments.add_ring(ACTIN, 12, [0, 0, 0], planar=True)
    filaments.add_nodes(ACTIN, [[300, 0, 0], [400, 0, 0], [400, 100, 0], [350, -50, 0]], planar=True)
    _, system, _ = filaments.build()
    with pytest.warns(ContactWarning, match="Segment 0 of filament 1 and segment 2 of filament 1 cross"):
        capsule_contact_force(filaments, system, 30)
