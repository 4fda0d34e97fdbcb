"""What is held on surfaces: where it is and its energies, in steps over a factor of 100, against integrals."""

import numpy as np
import pytest

from openmm_cylchain import (
    F_ACTIN,
    Capsule,
    Cylinder,
    Ellipsoid,
    Filaments,
    FilamentType,
    Plane,
    Sphere,
    Torus,
    filament_wall_force,
)
from support.contexts import new_context, positions_of
from support.solvent import KT, TEMPERATURE, VISCOSITY

CENTER, AXIS = np.array([40.0, -30.0, 20.0]), np.array([1.0, 2.0, -2.0]) / 3.0
CIRCLE = 250.0
RADIUS, LENGTH, AXES = 100.0, 150.0, np.array([80.0, 90.0, 100.0])
SHAPES = {
    "plane": Plane(CENTER, AXIS),
    "sphere": Sphere(CENTER, RADIUS),
    "cylinder": Cylinder(CENTER, AXIS, RADIUS),
    "capsule": Capsule(CENTER, AXIS, LENGTH, RADIUS),
    "torus": Torus(CENTER, AXIS, CIRCLE, RADIUS),
    "ellipsoid": Ellipsoid(CENTER, AXES),
}


def _depths(name, points):
    """Signed depths beyond the surfaces, by hand."""
    apart = points - CENTER
    along = apart @ AXIS
    if name == "plane":
        return -along
    if name == "ellipsoid":
        s = np.sqrt(np.sum((apart / AXES) ** 2, axis=-1))
        return (s - 1.0) * s / np.sqrt(np.sum((apart / AXES**2) ** 2, axis=-1))
    if name == "torus":
        return np.hypot(np.linalg.norm(apart - along[..., None] * AXIS, axis=-1) - CIRCLE, along) - RADIUS
    half = {"sphere": 0.0, "cylinder": np.inf, "capsule": 0.5 * LENGTH}[name]
    return np.linalg.norm(apart - np.clip(along, -half, half)[..., None] * AXIS, axis=-1) - RADIUS


def _draw(name, stiffness, count, generator):
    """Points in equilibrium: some of the shape, shrunk or grown, with weights; a part of the cylinder."""
    width = 7.0 * np.sqrt(KT / stiffness)
    directions = generator.normal(size=(count, 3))
    scale = generator.uniform(max(0.0, 1.0 - width / 80.0), 1.0 + width / 80.0, (count, 1))
    if name == "plane":
        return CENTER + directions - ((directions @ AXIS)[:, None] - 80.0 * (scale - 1.0)) * AXIS, np.ones(count)
    if name in ("cylinder", "capsule"):
        caps = generator.uniform(size=(count, 1)) < (0.5 if name == "capsule" else 0.0)
        across = directions - (directions @ AXIS)[:, None] * AXIS
        side = across / np.linalg.norm(across, axis=1)[:, None]
        heights = LENGTH * generator.uniform(-0.5, 0.5, (count, 1))
        ends = directions / np.linalg.norm(directions, axis=1)[:, None]
        heights = np.where(caps, 0.5 * LENGTH * np.sign(ends @ AXIS)[:, None], heights)
        weights = np.where(caps, 4.0 * RADIUS**2 * scale**2, 2.0 * RADIUS * LENGTH * scale)
        return CENTER + heights * AXIS + RADIUS * scale * np.where(caps, ends, side), weights[:, 0]
    if name == "torus":
        angle = generator.uniform(0.0, 2.0 * np.pi, (count, 1))
        side = directions - (directions @ AXIS)[:, None] * AXIS
        side /= np.linalg.norm(side, axis=1)[:, None]
        away = CIRCLE + RADIUS * scale * np.cos(angle)
        return CENTER + away * side + RADIUS * scale * np.sin(angle) * AXIS, (away * scale)[:, 0]
    axes = AXES if name == "ellipsoid" else RADIUS
    return CENTER + scale * axes * directions / np.linalg.norm(directions, axis=1)[:, None], scale[:, 0] ** 2


def _observe(name, points):
    """Depth, its square, and how much of the third axis, or the axis, there is."""
    depths, apart = _depths(name, points), points - CENTER
    if name == "ellipsoid":
        third = apart[..., 2] ** 2
    elif name == "torus":
        third = np.linalg.norm(apart - (apart @ AXIS)[..., None] * AXIS, axis=-1)
    else:
        third = (np.abs(apart @ AXIS) > 0.5 * LENGTH) * (name == "capsule")
    return np.stack([depths, depths**2, third], axis=-1)


@pytest.mark.sample(
    "^plane-20.0-1000|^sphere-20.0-10.0|^capsule-20.0-1000|^torus-20.0-1000|^torus-0.02-10|^ellipsoid-0.02-10"
)
@pytest.mark.parametrize(("stiffness", "relaxations"), [(0.02, 0.1), (0.02, 10.0), (20.0, 10.0), (20.0, 1000.0)])
@pytest.mark.parametrize("name", SHAPES)
def test_particles_on_surfaces(name, stiffness, relaxations):
    """In steps from a tenth of the relaxation time to a thousand of them; soft ones reach a fifth of the radius."""
    count, generator = 1500, np.random.default_rng(1)
    points, weights = _draw(name, stiffness, 150_000, generator)
    weights *= np.exp(-0.5 * stiffness * _depths(name, points) ** 2 / KT)
    weights /= weights.sum()
    exact = weights @ _observe(name, points)
    filaments = Filaments(VISCOSITY, TEMPERATURE)
    filaments.add_straight(F_ACTIN, 1, [0, 0, 0], [1, 0, 0])
    _, system, positions = filaments.build()
    particles = [system.addParticle(1.0) for _ in range(count)]
    wall = filament_wall_force(
        filaments, system, SHAPES[name], stiffness, particles=particles, numbers=[], side="surface"
    )
    system.addForce(wall)
    step = 1e3
    integrator = filaments.create_integrator(
        system, step, particle_friction=stiffness * step / relaxations, random_seed=3, checks=False
    )
    start = points[generator.choice(len(points), size=count, p=weights)]
    context = new_context(system, np.vstack([positions._value, start]), integrator)
    found = []
    for _ in range(30):
        integrator.step(max(1, int(1.0 / relaxations)))
        found.append(_observe(name, positions_of(context)[2:]))
    assert integrator.getNumDividedSteps() < 50
    found = np.mean(found, axis=0)
    errors = found.std(axis=0, ddof=1) / np.sqrt(count)
    errors_of_exact = np.sqrt(weights**2 @ (_observe(name, points) - exact) ** 2)
    errors = np.hypot(errors, errors_of_exact)
    assert 4 * errors[1] < 0.05 * exact[1]
    assert np.all(np.abs(found.mean(axis=0) - exact) <= 4 * errors)


def _rods_on_sphere(length, radius, stiffness):
    """Mean square depth of the ends of rods, and of the cosine to the radius, by an integral over both."""
    width = np.sqrt(KT / stiffness)
    flat = np.sqrt(radius**2 - 0.25 * length**2)
    heights = np.linspace(max(0.0, flat - 13.0 * width), flat + 13.0 * width, 2001)[:, None]
    steepest = min(1.0, 24.0 * width / length)
    cosines = (np.arange(2000) + 0.5) / 2000 * steepest
    ends = [np.sqrt(heights**2 + 0.25 * length**2 + sign * heights * length * cosines) for sign in (1.0, -1.0)]
    squares = sum((end - radius) ** 2 for end in ends)
    weights = heights**2 * np.exp(-0.5 * stiffness * squares / KT)
    return np.array([np.sum(weights * squares / 2), np.sum(weights * cosines**2)]) / weights.sum()


def _on_sphere(radius, length, generator):
    """Start and direction of a rod, the ends of which are on a sphere around the origin."""
    out = generator.normal(size=3)
    out /= np.linalg.norm(out)
    along = np.cross(out, generator.normal(size=3))
    along /= np.linalg.norm(along)
    return np.sqrt(radius**2 - 0.25 * length**2) * out - 0.5 * length * along, along


@pytest.mark.sample("^1.0-100|^100.0-1.0")
@pytest.mark.parametrize(("stiffness", "step"), [(0.01, 10.0), (1.0, 1.0), (1.0, 100.0), (100.0, 1.0), (100.0, 100.0)])
def test_rods_on_a_sphere(stiffness, step):
    """Depths of their ends, and how steep they are, at stiffnesses and steps over factors of 10^4 and 100."""
    length, radius, count, generator = 300.0, 200.0, 700, np.random.default_rng(2)
    exact = _rods_on_sphere(length, radius, stiffness)
    filaments = Filaments(1e-3, TEMPERATURE)
    for _ in range(count):
        filaments.add_straight(F_ACTIN.with_segment_length(length), 1, *_on_sphere(radius, length, generator))
    _, system, positions = filaments.build()
    system.addForce(filament_wall_force(filaments, system, Sphere([0, 0, 0], radius), stiffness, side="surface"))
    integrator = filaments.create_integrator(system, step, random_seed=5, checks=False)
    context = new_context(system, positions, integrator)
    relaxation = int(1.0 / (stiffness * step)) + 1
    integrator.step(8 * relaxation)
    found = []
    for _ in range(25):
        integrator.step(relaxation)
        nodes = positions_of(context).reshape(count, 2, 3)
        along, middles = nodes[:, 1] - nodes[:, 0], nodes.mean(axis=1)
        cosines = np.sum(along * middles, axis=1) / np.linalg.norm(along, axis=1) / np.linalg.norm(middles, axis=1)
        found.append([np.mean((np.linalg.norm(nodes, axis=2) - radius) ** 2, axis=1), cosines**2])
    found = np.mean(found, axis=0)
    errors = found.std(axis=1, ddof=1) / np.sqrt(count)
    assert np.all(4 * errors < np.array([0.05, 0.06]) * exact)
    assert np.all(np.abs(found.mean(axis=1) - exact) < 4 * errors)


def _chain_on_sphere(count, segments, length, radius, joint, stiffness, sweeps, seed):
    """Chains by Metropolis moves: mean square depths, those of ends, and 1-cos of joints, with standard errors.

    Energies are those of joints, ``joint`` (1-cos), and of nodes off the sphere; segments are stiff. Moves turn one
    segment, or all behind a node, also about the radius there, which keeps nodes on the sphere; and shift chains.
    """
    generator = np.random.default_rng(seed)
    angles = 2.0 * np.arcsin(0.5 * length / radius) * np.arange(segments + 1)
    circle = radius * np.stack([np.cos(angles), np.sin(angles), 0.0 * angles], axis=1)
    first = np.tile(circle[0], (count, 1))
    along = np.tile(np.diff(circle, axis=0) / length, (count, 1, 1))

    def nodes(first, along):
        return np.concatenate([first[:, None], first[:, None] + length * np.cumsum(along, axis=1)], axis=1)

    def bends(along):
        return 1.0 - np.sum(along[:, 1:] * along[:, :-1], axis=-1)

    def energies(first, along):
        depths = np.linalg.norm(nodes(first, along), axis=-1) - radius
        return (0.5 * stiffness * np.sum(depths**2, axis=1) + joint * np.sum(bends(along), axis=1)) / KT

    def turned(vectors, axes, angle):
        axes, angle = axes[:, None], angle[:, None, None]
        along_axes = np.sum(vectors * axes, axis=-1)[..., None] * axes * (1.0 - np.cos(angle))
        return (
            vectors * np.cos(angle)
            + np.cross(np.broadcast_to(axes, vectors.shape), vectors) * np.sin(angle)
            + along_axes
        )

    width, before, found = np.sqrt(KT / stiffness), energies(first, along), []
    for sweep in range(sweeps):
        moved, new = first.copy(), along.copy()
        kind, node = sweep % 4, int(generator.integers(segments))
        axes = generator.normal(size=(count, 3))
        sizes = generator.normal(size=count) * min(1.5 * width / length, 0.8)
        if kind == 0:
            moved += axes * min(width, 60.0)
        elif kind == 1:
            axes = nodes(first, along)[:, node]
            sizes = 0.5 * generator.normal(size=count)
        axes /= np.linalg.norm(axes, axis=1)[:, None]
        if kind:
            behind = slice(node, node + 1) if kind == 2 else slice(node, None)
            new[:, behind] = turned(along[:, behind], axes, sizes)
        after = energies(moved, new)
        kept = np.log(generator.uniform(size=count)) < before - after
        first, along = np.where(kept[:, None], moved, first), np.where(kept[:, None, None], new, along)
        before = np.where(kept, after, before)
        if sweep > sweeps // 4 and sweep % 10 == 0:
            found.append(_of_chains(nodes(first, along), radius))
    found = np.mean(found, axis=0)
    return found.mean(axis=1), found.std(axis=1, ddof=1) / np.sqrt(count), nodes(first, along)


def _of_chains(nodes, radius):
    squares = (np.linalg.norm(nodes, axis=-1) - radius) ** 2
    along = np.diff(nodes, axis=1)
    along /= np.linalg.norm(along, axis=-1)[..., None]
    bends = 1.0 - np.sum(along[:, 1:] * along[:, :-1], axis=-1)
    return np.array([squares.mean(axis=1), 0.5 * (squares[:, 0] + squares[:, -1]), bends.mean(axis=1)])


@pytest.mark.slow
@pytest.mark.sample("^100.0-1.8")
@pytest.mark.parametrize(("stiffness", "step"), [(0.01, 0.6), (1.0, 1.8), (100.0, 0.3), (100.0, 1.8)])
def test_filaments_on_a_sphere(stiffness, step):
    """Flexible ones, in steps up to three times the recommended one, against Metropolis moves of the same energies."""
    length, segments, radius, joint, count = 60.0, 5, 150.0, 4.0 * KT, 500
    exact, of_exact, drawn = _chain_on_sphere(3000, segments, length, radius, joint, stiffness, 5000, seed=3)
    kind = FilamentType(
        name="CHN",
        diameter=7.0,
        bending_rigidity=joint * length,
        temperature=None,
        stretching_modulus=2e5,
        segment_length=length,
        bending_model="kratky-porod",
    )
    filaments = Filaments(1e-3, TEMPERATURE)
    for own in drawn[:count]:
        filaments.add_nodes(kind, own)
    _, system, positions = filaments.build()
    system.addForce(filament_wall_force(filaments, system, Sphere([0, 0, 0], radius), stiffness, side="surface"))
    integrator = filaments.create_integrator(system, step, random_seed=5, checks=False)
    context = new_context(system, positions, integrator)
    found = []
    for _ in range(60):
        integrator.step(int(3.0 / step))
        found.append(_of_chains(positions_of(context).reshape(count, segments + 1, 3), radius))
    found = np.mean(found, axis=0)
    errors = np.hypot(found.std(axis=1, ddof=1) / np.sqrt(count), of_exact)
    assert np.all(4 * errors < 0.06 * exact)
    assert np.all(np.abs(found.mean(axis=1) - exact) < 4 * errors)
