"""Rigid bodies that push each other: their equilibrium beside quadrature and Monte Carlo of the same energies."""

import re

import numpy as np
import openmm
import pytest
from openmm import unit
from scipy.spatial.transform import Rotation

from openmm_cylchain import (
    F_ACTIN,
    Body,
    ContactWarning,
    Crosslinks,
    Filaments,
    InputError,
    InstabilityError,
    Slab,
    capsule_contact_force,
    filament_wall_force,
    find_contacts,
    stokes_friction,
)
from openmm_cylchain.couplings.capsule_contacts import default_capsule_stiffness
from support.contexts import new_context, positions_of
from support.solvent import KT, TEMPERATURE, VISCOSITY

DIAMETER = 100.0
STIFFNESS = default_capsule_stiffness(DIAMETER, TEMPERATURE)
SLOW = pytest.mark.slow


def _check_mean(samples, expected, largest):
    """Samples (times, copies) beside an exact mean and its error; an error of the share ``largest`` would fail."""
    exact, uncertainty = expected
    of_copies = np.mean(samples, axis=0)
    error = np.hypot(of_copies.std() / np.sqrt(len(of_copies)), uncertainty)
    assert 4 * error < largest * abs(exact)
    assert of_copies.mean() == pytest.approx(exact, abs=4 * error)


def _step_of_softness(softness):
    """The step in which a force moves two spheres against each other by a share of the force over the stiffness."""
    return softness * stokes_friction(DIAMETER, VISCOSITY) / (2 * STIFFNESS)


def _touching(filaments, system, **options):
    spheres = [
        (body, own, placed.body) for body, (own, placed) in enumerate(zip(filaments.body_indices, filaments.bodies))
    ]
    particles = [int(p) for _, own, body in spheres for p in own[body.radii > 0]]
    diameters = [2 * r for _, _, body in spheres for r in body.radii[body.radii > 0]]
    force = capsule_contact_force(filaments, system, particles=particles, particle_diameter=diameters, **options)
    system.addForce(force)
    return force


def _overlap(distances):
    return 0.5 * STIFFNESS * np.maximum(DIAMETER - distances, 0) ** 2


@pytest.mark.parametrize(
    "softness, interval, samples",
    [(3.0, 1, 50), (0.3, 6, 25), pytest.param(0.03, 60, 15, marks=SLOW)],
)
def test_two_spheres_on_a_spring(softness, interval, samples):
    """The spring presses them two fifths of the way through the softness of their surfaces."""
    count, spring = 250, 0.2 * STIFFNESS
    r = np.linspace(0, 4 * DIAMETER, 100001)[1:]
    weight = r**2 * np.exp((0.5 * spring * DIAMETER**2 - 0.5 * spring * r**2 - _overlap(r)) / KT)
    weight /= weight.sum()
    distances = np.interp(np.random.default_rng(1).uniform(size=count), np.cumsum(weight), r)
    filaments = Filaments(VISCOSITY, TEMPERATURE)
    for number, distance in enumerate(distances):
        for x in (0.0, distance):
            filaments.add_body(Body.sphere(0.5 * DIAMETER), [x, 1e4 * number, 0])
    _, system, positions = filaments.build()
    _touching(filaments, system)
    centres = np.array([own[0] for own in filaments.body_indices])
    links = Crosslinks(spring, 0.0)
    links.add_many(None, centres.reshape(-1, 2).tolist())
    links.add_to(system)
    integrator = filaments.create_integrator(system, _step_of_softness(softness), random_seed=3, checks=False)
    context = new_context(system, positions, integrator, "CPU", {"Threads": "1"})
    found = []
    for _ in range(samples):
        integrator.step(interval)
        places = positions_of(context)[centres]
        found.append(np.linalg.norm(places[1::2] - places[::2], axis=1))
    _check_mean(found, ((weight * r).sum(), 0.0), 0.05)
    _check_mean(_overlap(np.array(found)), ((weight * _overlap(r)).sum(), 0.0), 0.1)


POINTS = np.array([[-80.0, 0, 0], [0, 0, 0], [80.0, 0, 0]])
SPRING, APART = KT / 20.0**2, 50.0


def _of_dumbbells(centres, rotations, spheres):
    """Energies of contacts of dumbbells with spheres, and the cosines of their angles with x."""
    points = centres[:, None] + np.einsum("nij,pj->npi", rotations, POINTS)
    return _overlap(np.linalg.norm(points - spheres[:, None], axis=2)).sum(axis=1), rotations[:, 0, 0] ** 2


def _monte_carlo_of_dumbbells(count):
    """Means and standard errors of energies and squared cosines; and places, drawn with their weights."""
    generator = np.random.default_rng(2)
    centres = generator.normal(scale=20.0, size=(count, 3))
    spheres = generator.normal(scale=20.0, size=(count, 3)) + [APART, 0, 0]
    rotations = Rotation.random(count, generator).as_matrix()
    values = _of_dumbbells(centres, rotations, spheres)
    weights = np.exp(-values[0] / KT)
    weights /= weights.sum()
    means = []
    for value in values:
        mean = (weights * value).sum()
        means.append((mean, np.sqrt((weights**2 * (value - mean) ** 2).sum())))
    return means, (centres, rotations, spheres), weights


@pytest.mark.parametrize(
    "microseconds, interval, samples",
    [(20.0, 2, 40), pytest.param(2.0, 20, 30, marks=SLOW), pytest.param(0.2, 150, 16, marks=SLOW)],
)
def test_a_dumbbell_and_a_sphere(microseconds, interval, samples):
    """Three spheres on a line turn as one that comes between them pushes; springs hold both bodies by their centres."""
    (energy, cosine), drawn, weights = _monte_carlo_of_dumbbells(60000)
    count = 320
    begins = np.random.default_rng(3).choice(len(weights), count, p=weights)
    filaments = Filaments(VISCOSITY, TEMPERATURE)
    dumbbell, sphere = Body(POINTS, 0.5 * DIAMETER), Body.sphere(0.5 * DIAMETER)
    shift = np.array([0, 2000.0, 0])
    for number, (centre, rotation, other) in enumerate(zip(*(own[begins] for own in drawn))):
        filaments.add_body(dumbbell, centre + number * shift, rotation)
        filaments.add_body(sphere, other + number * shift)
    _, system, positions = filaments.build()
    _touching(filaments, system)
    links = Crosslinks(SPRING, 0.0)
    indices = filaments.body_indices
    for number in range(count):
        links.add(None, int(indices[2 * number][1]), tuple(number * shift))
        links.add(None, int(indices[2 * number + 1][0]), tuple(number * shift + [APART, 0, 0]))
    links.add_to(system)
    integrator = filaments.create_integrator(system, microseconds * 1e6, random_seed=4, checks=False)
    context = new_context(system, positions, integrator, "CPU", {"Threads": "1"})
    energies, cosines = [], []
    for _ in range(samples):
        integrator.step(interval)
        places = positions_of(context)
        points = np.array([places[own[:3]] for own in indices[::2]])
        spheres = np.array([places[own[0]] for own in indices[1::2]])
        energies.append(_overlap(np.linalg.norm(points - spheres[:, None], axis=2)).sum(axis=1))
        along = points[:, 2] - points[:, 0]
        cosines.append(along[:, 0] ** 2 / np.sum(along**2, axis=1))
    assert np.linalg.norm(along, axis=1) == pytest.approx(160.0, rel=1e-9)
    _check_mean(energies, energy, 0.15)
    _check_mean(cosines, cosine, 0.25)


LAYERS = 40


def _distances_in_layers(places, edge):
    """Of the pairs of beads in each layer, (layers, pairs), from places (layers, beads, 2) in the periodic box."""
    first, second = np.triu_indices(places.shape[1], 1)
    between = places[:, first] - places[:, second]
    return np.linalg.norm(between - edge * np.round(between / edge), axis=2)


def _monte_carlo_of_layers(sweeps, edge, beads):
    """Energies (sweeps / 4, layers), and where the beads are in the end."""
    generator = np.random.default_rng(5)
    places = generator.uniform(0, edge, size=(LAYERS, beads, 2))
    energies = []
    for sweep in range(sweeps):
        for bead in range(beads):
            moved = places[:, bead] + generator.uniform(-30, 30, size=(LAYERS, 2))
            others = np.delete(places, bead, axis=1)
            energy = []
            for own in (places[:, bead], moved):
                between = others - own[:, None]
                between -= edge * np.round(between / edge)
                energy.append(_overlap(np.sqrt(np.sum(between**2, axis=2))).sum(axis=1))
            taken = generator.uniform(size=LAYERS) < np.exp(np.minimum(0, energy[0] - energy[1]) / KT)
            places[taken, bead] = moved[taken]
        if sweep >= sweeps // 4 and sweep % 4 == 0:
            energies.append(_overlap(_distances_in_layers(places, edge)).sum(axis=1))
    return np.array(energies), places


@pytest.mark.parametrize(
    "softness, interval, samples, edge, beads",
    [(1.6, 2, 30, 400.0, 12), pytest.param(0.16, 10, 120, 260.0, 5, marks=SLOW)],
)
def test_dense_layers_of_planar_beads(softness, interval, samples, edge, beads):
    """Beads that cover six tenths of periodic layers, in which each touches several at once."""
    energies, places = _monte_carlo_of_layers(400 if softness > 1 else 3000, edge, beads)
    filaments = Filaments(VISCOSITY, TEMPERATURE)
    for layer, own in enumerate(places):
        for x, y in own:
            filaments.add_body(Body.sphere(0.5 * DIAMETER), [x, y, 200.0 * layer], planar=True)
    _, system, positions = filaments.build(box_vectors=np.diag([edge, edge, 200.0 * LAYERS]))
    _touching(filaments, system)
    integrator = filaments.create_integrator(system, _step_of_softness(softness), random_seed=6)
    context = new_context(system, positions, integrator, "CPU", {"Threads": "1"})
    centres = np.array([own[0] for own in filaments.body_indices])
    found = []
    integrator.step(5 * interval)
    for _ in range(samples):
        integrator.step(interval)
        now = positions_of(context)[centres].reshape(LAYERS, beads, 3)
        found.append(_overlap(_distances_in_layers(now[:, :, :2], edge)).sum(axis=1))
    assert np.all(now[:, :, 2] == 200.0 * np.arange(LAYERS)[:, None])
    of_layers = energies.mean(axis=0)
    _check_mean(found, (of_layers.mean(), of_layers.std() / np.sqrt(LAYERS)), 0.2)
    assert integrator.getNumDividedSteps() == 0


def _crowd():
    """Two bodies, of which one has two spheres, a bead and filaments between two walls."""
    filaments = Filaments(VISCOSITY, TEMPERATURE)
    actin = F_ACTIN.with_segment_length(100 * unit.nanometer)
    for y in (-60.0, 60.0):
        filaments.add_straight(actin, 4, [-200, y, 45], [1, 0, 0])
    filaments.add_body(Body([[-40, 0, 0], [40, 0, 0]], 50.0), [-60, 0, -20])
    filaments.add_body(Body.sphere(50.0, [[50, 0, 0]]), [70, 0, 20])
    filaments.add_body(Body.sphere(40.0), [0, 90, -30])
    _, system, positions = filaments.build()
    contacts = _touching(filaments, system, diameter=30.0)
    spheres = [contacts.getSphereParticle(i) for i in range(contacts.getNumSpheres())]
    radii = [0.5 * contacts.getSphereDiameter(i)._value for i in range(contacts.getNumSpheres())]
    options = {"particles": spheres, "particle_radius": radii}
    system.addForce(filament_wall_force(filaments, system, Slab([0, 0, 0], [0, 0, 1], 160.0), 1.0, **options))
    return filaments, system, positions, contacts


def test_bodies_filaments_and_walls_restart_to_the_bit():
    filaments, system, positions, _ = _crowd()
    step = filaments.recommended_time_step(system=system)

    def context():
        integrator = filaments.create_integrator(system, step, random_seed=7)
        return new_context(system, positions, integrator, "CPU", {"Threads": "1"})

    whole, resumed = context(), context()
    whole.getIntegrator().step(40)
    checkpoint = whole.createCheckpoint()
    whole.getIntegrator().step(40)
    resumed.loadCheckpoint(checkpoint)
    resumed.getIntegrator().step(40)
    assert np.array_equal(positions_of(whole), positions_of(resumed))
    after = positions_of(whole)
    dumbbell = after[filaments.body_indices[0][:2]]
    assert np.linalg.norm(dumbbell[0] - dumbbell[1]) == pytest.approx(80.0, rel=1e-9)
    copy = openmm.XmlSerializer.deserialize(openmm.XmlSerializer.serialize(system))
    again = new_context(
        copy, positions, filaments.create_integrator(copy, step, random_seed=7), "CPU", {"Threads": "1"}
    )
    again.getIntegrator().step(80)
    assert np.array_equal(positions_of(again), after)


def test_spheres_of_one_body_do_not_touch():
    _, system, positions, contacts = _crowd()
    context = new_context(system, positions)
    found = find_contacts(contacts, context)
    pairs = {tuple(sorted(pair)) for pair in found.segments[np.all(found.filaments == -1, axis=1)].tolist()}
    assert (0, 1) not in pairs and (1, 2) in pairs


def test_a_sphere_does_not_pass_through_another():
    """A step in which one would go to the other side of another: it stays on its own."""
    filaments = Filaments(VISCOSITY, 0.0)
    filaments.add_body(Body.sphere(50.0), [0, 0, 0])
    filaments.add_body(Body.sphere(50.0), [95, 0, 0])
    _, system, positions = filaments.build()
    first, second = (int(own[0]) for own in filaments.body_indices)
    pull = openmm.CustomExternalForce("-fx*x")
    pull.addPerParticleParameter("fx")
    pull.addParticle(first, [1.0])
    pull.addParticle(second, [-1.0])
    system.addForce(pull)
    _touching(filaments, system, stiffness=0.5)
    step = 200.0 * stokes_friction(100.0, VISCOSITY)
    integrator = filaments.create_integrator(system, step, checks=False)
    context = new_context(system, positions, integrator)
    integrator.step(1)
    between = positions_of(context)[second] - positions_of(context)[first]
    assert 95 < between[0] < 100 and between[1] == between[2] == 0


def test_spheres_that_cannot_be_kept_apart_are_named():
    filaments = Filaments(VISCOSITY, TEMPERATURE)
    for x, y in ((0, 0), (99, 0), (0, 99), (99, 99)):
        filaments.add_body(Body.sphere(50.0), [x, y, 0])
    _, system, positions = filaments.build()
    with pytest.warns(ContactWarning, match="hard ones"):
        _touching(filaments, system, stiffness=1e50)
        integrator = filaments.create_integrator(system, 4e7, random_seed=1)
    context = new_context(system, positions, integrator)
    with pytest.raises(InstabilityError, match="Particle .* its contact with particle") as caught:
        context.getIntegrator().step(100)
    first, second = re.findall("article ([0-9]+)", str(caught.value))
    assert int(first) == caught.value.particle != int(second)


def test_what_spheres_without_filaments_need():
    filaments = Filaments(VISCOSITY, TEMPERATURE)
    for x in (0.0, 100.0):
        filaments.add_body(Body.sphere(50.0), [x, 0, 0])
    _, system, _ = filaments.build()
    force = _touching(filaments, system)
    assert force.getStiffness()._value == pytest.approx(STIFFNESS)
    recommended = filaments.recommended_time_step(system=system)
    assert "spheres in contact" in recommended.reason
    both = 2 * KT * 2 / stokes_friction(100.0, VISCOSITY)
    assert recommended.step == pytest.approx((0.2 * 100.0) ** 2 / both)
    with pytest.warns(ContactWarning, match="Sphere 0 has a contact diameter of 100 nm"):
        _touching(filaments, system, stiffness=0.5 * STIFFNESS)
    with pytest.raises(InputError, match="no two spheres"):
        capsule_contact_force(filaments, system, particles=[0], particle_diameter=100.0)
    with pytest.raises(InputError, match="particles contains 3 twice"):
        capsule_contact_force(filaments, system, particles=[0, 3, 3], particle_diameter=100.0)
    filaments = Filaments(VISCOSITY, TEMPERATURE)
    filaments.add_straight(F_ACTIN, 2, [0, 0, 0], [1, 0, 0])
    _, system, _ = filaments.build()
    with pytest.raises(InputError, match="diameter must be a number"):
        capsule_contact_force(filaments, system)
