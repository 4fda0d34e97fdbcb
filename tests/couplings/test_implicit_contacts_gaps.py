"""Gaps of two filaments, or of one and a sphere, in implicit steps, against draws of the equilibrium by other means."""

import numpy as np
import pytest

from openmm_cylchain import F_ACTIN, Filaments, capsule_contact_force
from openmm_cylchain.engines.compiled import plugin
from support.contexts import new_context, positions_of
from support.gap_draws import draw_distances, filament_distance
from support.solvent import KT, TEMPERATURE, VISCOSITY

LENGTH = 100.0
ACTIN = F_ACTIN.with_segment_length(LENGTH)
DIAMETER = 30.0
STIFFNESS = 80 * KT / DIAMETER**2
# Links between the middles, with exact equilibrium at any step, keep the two together.
SPREAD = 50.0
# Distances: gaps of 10 nm and more.
EDGES = np.arange(40.0, 81.0, 5.0)
FRICTION = 2.9e5


def _shares(distances, weights=None):
    """Of the distances within the edges."""
    counts = np.histogram(distances, EDGES, weights=weights)[0]
    return counts / counts.sum()


def _expected(segments, sphere):
    draws = [
        draw_distances(
            segments,
            LENGTH,
            ACTIN.joint_stiffness / KT,
            SPREAD,
            DIAMETER,
            STIFFNESS / KT,
            200000,
            seed=seed,
            sphere=sphere,
        )
        for seed in range(15 if segments == 1 else 8)
    ]
    return _shares(*(np.concatenate(values) for values in zip(*draws)))


def _pairs(segments, sphere, pairs):
    """Filaments in a System with contacts and links, and the particles of each pair."""
    generator = np.random.default_rng(1)
    filaments = Filaments(VISCOSITY, TEMPERATURE)
    centers = 3000.0 * np.array(list(np.ndindex(8, 8, 8)))[:pairs]
    for center in centers:
        for height in (0, 45) if not sphere else (0,):
            direction = generator.normal(size=3)
            direction /= np.linalg.norm(direction)
            start = center + [0, 0, height] - 0.5 * segments * LENGTH * direction
            filaments.add_straight(ACTIN, segments, start, direction)
    _, system, positions = filaments.build()
    nodes = np.array(filaments.node_indices)
    spheres = [system.addParticle(1.0) for _ in range(pairs)] if sphere else []
    positions = np.vstack([positions._value, centers + [0, 0, 45]]) if sphere else positions
    first, second = (nodes, np.array(spheres)[:, None]) if sphere else (nodes[::2], nodes[1::2])
    options = {"particles": spheres, "particle_diameter": DIAMETER} if sphere else {}
    system.addForce(capsule_contact_force(filaments, system, DIAMETER, STIFFNESS, **options))
    links, middle = plugin.CylinderChainLinkForce(), segments // 2
    for one, other in zip(first, second):
        places = [[int(one[middle]), int(one[middle + 1]), 0.5]]
        places.append([int(other[0]), -1, 0.0] if sphere else [int(other[middle]), int(other[middle + 1]), 0.5])
        links.addLink(*places[0], *places[1], links.Harmonic, 0.0, KT / SPREAD**2, 1.0)
    system.addForce(links)
    return filaments, system, positions, first, second


def _check(segments, sphere, share_of_step, samples, pairs=400):
    filaments, system, positions, first, second = _pairs(segments, sphere, pairs)
    friction = FRICTION if sphere else None
    allowed = filaments.recommended_time_step(system=system, particle_friction=friction).allowed
    # What contacts allow: filaments of several segments relax faster.
    step = share_of_step * next(value for name, value in allowed.items() if name.endswith("segments in contact"))
    integrator = filaments.create_integrator(system, step, random_seed=1, checks=False, particle_friction=friction)
    context = new_context(system, positions, integrator, "CPU", {"Threads": "1"})
    integrator.step(int(1e9 / step))
    distances = []
    for _ in range(samples):
        integrator.step(max(1, round(4e6 / step)))
        particles = positions_of(context)
        distances.append(filament_distance(*(particles[own].swapaxes(0, 1) for own in (first, second))))
    blocks = np.array([_shares(np.concatenate(block)) for block in np.array_split(distances, 20)])
    found, errors = _shares(np.concatenate(distances)), blocks.std(axis=0, ddof=1) / np.sqrt(20)
    ratios, errors = found / _expected(segments, sphere), errors / found
    assert (4 * errors < 0.05).all(), errors
    assert (np.abs(ratios - 1) < 0.05).all(), ratios


@pytest.mark.slow
def test_gaps_of_two_rods_at_the_recommended_step():
    _check(1, False, 1.0, 800)


@pytest.mark.slow
@pytest.mark.parametrize("share_of_step", [1.0, 0.5])
@pytest.mark.parametrize("segments, sphere", [(1, True), (3, False)])
def test_gaps_at_the_recommended_step(segments, sphere, share_of_step):
    _check(segments, sphere, share_of_step, 1500)


@pytest.mark.slow
def test_gaps_of_two_rods_at_half_the_recommended_step():
    _check(1, False, 0.5, 1200)
