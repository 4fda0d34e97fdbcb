"""Gaps of rods, and of a rod and a sphere, in implicit steps against draws of the equilibrium by other means."""

import numpy as np

from openmm_cylchain import F_ACTIN, Filaments, capsule_contact_force
from openmm_cylchain.engines.compiled import plugin
from support.contexts import new_context, positions_of
from support.solvent import KT, TEMPERATURE, VISCOSITY

ROD = F_ACTIN.with_segment_length(100)
LENGTH = 100.0
DIAMETER = 30.0
STIFFNESS = 80 * KT / DIAMETER**2
# Links between the middles, with exact equilibrium at any step, keep the two together.
LINK = KT / 50**2
# Distances: gaps of 10 nm and more.
EDGES = np.arange(40.0, 81.0, 5.0)
# At 10 us, two segments diffuse against each other by 0.6 diameters.
LARGEST_STEP = 1e7
FRICTION = 2.9e5


def _to_segment(point, start, along):
    fraction = np.einsum("ij,ij->i", point - start, along) / np.einsum("ij,ij->i", along, along)
    return np.linalg.norm(point - start - np.clip(fraction, 0, 1)[:, None] * along, axis=1)


def _distance(start, p, other, q):
    """Of two segments: that of an end of one from the other, or of the lines where these are nearest within both."""
    ends = [_to_segment(start, other, q), _to_segment(start + p, other, q)]
    ends += [_to_segment(other, start, p), _to_segment(other + q, start, p)]
    normal = np.cross(p, q)
    square = np.einsum("ij,ij->i", normal, normal)
    between = other - start
    s = np.einsum("ij,ij->i", np.cross(between, q), normal) / square
    t = np.einsum("ij,ij->i", np.cross(between, p), normal) / square
    within = (s > 0) & (s < 1) & (t > 0) & (t < 1)
    lines = np.abs(np.einsum("ij,ij->i", between, normal)) / np.sqrt(square)
    return np.where(within, lines, np.min(ends, axis=0))


def _shares(counts):
    return counts / counts.sum()


def _expected(sphere, count=3000000):
    generator = np.random.default_rng(7)
    counts = np.zeros(len(EDGES) - 1)
    for _ in range(count // 250000):
        between = generator.normal(0, np.sqrt(KT / LINK), (250000, 3))
        p, q = (LENGTH * v / np.linalg.norm(v, axis=1)[:, None] for v in generator.normal(size=(2, 250000, 3)))
        distances = _to_segment(between, -0.5 * p, p) if sphere else _distance(-0.5 * p, p, between - 0.5 * q, q)
        # Beyond the diameter contacts have no energy.
        counts += np.histogram(distances, EDGES)[0]
    return _shares(counts)


def _found(sphere, scheme, step, samples, pairs=400):
    """Shares of the distances, and their standard errors."""
    generator = np.random.default_rng(1)
    filaments = Filaments(VISCOSITY, TEMPERATURE)
    centers = 3000.0 * np.array(list(np.ndindex(8, 8, 8)))[:pairs]
    for center in centers:
        for height in (0, 45) if not sphere else (0,):
            direction = generator.normal(size=3)
            direction /= np.linalg.norm(direction)
            filaments.add_straight(ROD, 1, center + [0, 0, height] - 0.5 * LENGTH * direction, direction)
    _, system, positions = filaments.build()
    nodes = np.array(filaments.node_indices)
    spheres = [system.addParticle(1.0) for _ in range(pairs)] if sphere else []
    positions = np.vstack([positions._value, centers + [0, 0, 45]]) if sphere else positions
    options = {"particles": spheres, "particle_diameter": DIAMETER} if sphere else {}
    system.addForce(capsule_contact_force(filaments, system, DIAMETER, STIFFNESS, **options))
    links = plugin.CylinderChainLinkForce()
    for pair in range(pairs):
        first = [int(node) for node in nodes[pair if sphere else 2 * pair]] + [0.5]
        second = [spheres[pair], -1, 0.0] if sphere else [int(node) for node in nodes[2 * pair + 1]] + [0.5]
        links.addLink(*first, *second, links.Harmonic, 0.0, LINK, 1.0)
    system.addForce(links)
    integrator = filaments.create_integrator(
        system, step, scheme=scheme, random_seed=1, checks=False, particle_friction=FRICTION if sphere else None
    )
    context = new_context(system, positions, integrator, "CPU", {"Threads": "1"})
    integrator.step(int(1e9 / step))
    histograms = []
    for _ in range(samples):
        integrator.step(max(1, int(4e6 / step)))
        positions = positions_of(context)
        starts, along = positions[nodes[:, 0]], positions[nodes[:, 1]] - positions[nodes[:, 0]]
        if sphere:
            distances = _to_segment(positions[spheres], starts, along)
        else:
            distances = _distance(starts[::2], along[::2], starts[1::2], along[1::2])
        histograms.append(np.histogram(distances, EDGES)[0])
    blocks = np.array([_shares(block.sum(axis=0)) for block in np.array_split(histograms, 20)])
    return _shares(np.sum(histograms, axis=0)), blocks.std(axis=0, ddof=1) / np.sqrt(20)


def _check(sphere, scheme, step, samples):
    found, errors = _found(sphere, scheme, step, samples)
    ratios, errors = found / _expected(sphere), errors / found
    assert (4 * errors < 0.05).all(), errors
    assert (np.abs(ratios - 1) < 0.05).all(), ratios


def test_gaps_of_a_sphere_at_a_tenth_of_the_largest_step():
    _check(True, "implicit", LARGEST_STEP / 10, 700)
