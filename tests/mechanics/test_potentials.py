"""Energies and forces of the chain's own potentials, from OpenMM on every platform and in NumPy."""

import dataclasses
import itertools
import math

import numpy as np
import pytest
from openmm import unit
from scipy.spatial.transform import Rotation

from openmm_cylchain import Filament, Filaments, FilamentType, InputError
from openmm_cylchain.engines.gpu_platforms import GPU_PLATFORMS
from openmm_cylchain.mechanics.potentials import BENDING_POTENTIALS, STRETCHING_POTENTIALS
from openmm_cylchain.mechanics.tension import segment_end_forces
from support.bending_models import BENDING_MODELS
from support.contexts import forces_of, new_context

ANGLES = (0.0, 1e-4, 0.01, 0.3, 1.0, 2.0, 3.0, 3.1)
BENDING_GROUP, STRETCHING_GROUP = 1, 2
RIGIDITY, STIFFNESS, LENGTH, EXTENSION = 4.4e4, 2.9e4, 100.0, 10.0


def rod(bending_model, stretching_model, **changes):
    arguments = dict(
        name="ROD",
        diameter=6.0,
        segment_length=LENGTH,
        bending_rigidity=RIGIDITY,
        stretching_stiffness=STIFFNESS,
        bending_model=bending_model,
        stretching_model=stretching_model,
        maximum_extension=EXTENSION if stretching_model == "fene" else None,
    )
    return FilamentType(**{**arguments, **changes})


MODELS = list(itertools.product(BENDING_POTENTIALS, STRETCHING_POTENTIALS))
TYPES = {models: rod(*models) for models in MODELS}


def test_every_bending_model_is_there_by_hand():
    assert set(BENDING_MODELS) == set(BENDING_POTENTIALS)


@pytest.mark.parametrize("model", BENDING_POTENTIALS)
def test_bending_energies_are_within_what_averages_assume(model):
    angle = np.linspace(0.01, 3.14, 100)
    energy = BENDING_POTENTIALS[model].energy(3.0, np.cos(angle)) / 3.0
    assert energy[0] == pytest.approx(0.5 * angle[0] ** 2, rel=1e-4)
    assert np.all(energy >= 2 * (angle / np.pi) ** 2)


# The potentials once more, by hand, as functions of node positions.


def bending_energy(model, first, second):
    # The half angle from sums and differences of unit vectors keeps all digits near 0 and near pi.
    t1, t2 = first / np.linalg.norm(first), second / np.linalg.norm(second)
    theta = 2 * math.atan2(np.linalg.norm(t2 - t1), np.linalg.norm(t2 + t1))
    return RIGIDITY / LENGTH * BENDING_MODELS[model].energy(theta)


def stretching_energy(model, segment):
    strain = np.linalg.norm(segment) - LENGTH
    if model == "harmonic":
        return 0.5 * STIFFNESS * strain**2
    return -0.5 * STIFFNESS * EXTENSION**2 * math.log(1 - (strain / EXTENSION) ** 2)


def total_bending(model, nodes):
    segments = np.diff(nodes, axis=0)
    return sum(bending_energy(model, a, b) for a, b in zip(segments[:-1], segments[1:]))


def total_stretching(model, nodes):
    return sum(stretching_energy(model, segment) for segment in np.diff(nodes, axis=0))


def bending_forces(model, nodes):
    """Minus the gradient of the bending energy of three nodes, from dV/dtheta and the geometry of the joint."""
    first, second = np.diff(nodes, axis=0)
    l1, l2 = np.linalg.norm(first), np.linalg.norm(second)
    t1, t2 = first / l1, second / l2
    theta = 2 * math.atan2(np.linalg.norm(t2 - t1), np.linalg.norm(t2 + t1))
    slope = RIGIDITY / LENGTH * BENDING_MODELS[model].slope(theta)
    if theta == 0.0:
        return np.zeros((3, 3))
    axis = np.cross(t1, t2)
    axis /= np.linalg.norm(axis)
    before, after = -slope / l1 * np.cross(axis, t1), -slope / l2 * np.cross(axis, t2)
    return np.array([before, -before - after, after])


def stretching_forces(model, nodes):
    segments = np.diff(nodes, axis=0)
    lengths = np.linalg.norm(segments, axis=1)
    strain = lengths - LENGTH
    slope = STIFFNESS * strain
    if model == "fene":
        slope = slope / (1 - (strain / EXTENSION) ** 2)
    pull = (slope / lengths)[:, None] * segments
    forces = np.zeros_like(nodes)
    forces[:-1] += pull
    forces[1:] -= pull
    return forces


def difference_forces(energy, nodes, step):
    forces = np.empty_like(nodes)
    for index in np.ndindex(nodes.shape):
        values = []
        for factor in (-2, -1, 1, 2):
            moved = nodes.copy()
            moved[index] += factor * step
            values.append(energy(moved))
        forces[index] = -(values[0] - 8 * values[1] + 8 * values[2] - values[3]) / (12 * step)
    return forces


def joint(angle, lengths=(LENGTH, LENGTH)):
    """Three nodes, with exactly straight ones for an angle of zero."""
    directions = np.array([[1.0, 0.0, 0.0], [math.cos(angle), math.sin(angle), 0.0]])
    return np.concatenate([np.zeros((1, 3)), np.cumsum(np.array(lengths)[:, None] * directions, axis=0)])


def moved(nodes, seed):
    """The nodes turned at random and shifted by some hundred nanometres."""
    generator = np.random.default_rng(seed)
    return Rotation.random(rng=generator).apply(nodes) + generator.uniform(-300, 300, 3)


# The last pair is 99.9 % of the way to the limits of the FENE potential.
LENGTHS = ((100.0, 100.0), (103.0, 98.5), (109.99, 90.01))
SHAPES = [(angle, lengths, seed) for angle in ANGLES for lengths in LENGTHS for seed in (None, 1, 2)]
CASES = [(models, *shape) for models in MODELS for shape in SHAPES]


def nodes_of(angle, lengths, seed):
    nodes = joint(angle, lengths)
    return nodes if seed is None else moved(nodes, seed)


@pytest.fixture(scope="module")
def computed(platform):
    """Forces of bending and of stretching of all CASES on one platform."""
    filaments = Filaments(1000.0, 300, "portable")
    for models, angle, lengths, seed in CASES:
        filaments.add_nodes(TYPES[models], nodes_of(angle, lengths, seed))
    _, system, positions = filaments.build(stretching_force_group=STRETCHING_GROUP, bending_force_group=BENDING_GROUP)
    context = new_context(system, positions, platform=platform)
    result = {}
    for name, group in (("bending", BENDING_GROUP), ("stretching", STRETCHING_GROUP)):
        state = context.getState(forces=True, groups={group})
        result[name] = state.getForces(asNumpy=True)._value.reshape(-1, 3, 3)
    return platform.getName(), result


def bending_tolerance(platform, model, angle, nodes, expected):
    if platform not in GPU_PLATFORMS:
        return 1e-7 * np.abs(expected).max() + 1e-9
    # Single precision rounds the positions, and OpenMM takes the angle from its cosine: it is wrong by up to
    # epsilon/sin(theta), or sqrt(2 epsilon) = 5e-4 where the joint is that straight.
    epsilon = 2.0**-23
    angle_error = 4 * epsilon * np.abs(nodes).max() / LENGTH + min(
        math.sqrt(2 * epsilon), 2 * epsilon / max(math.sin(angle), 1e-30)
    )
    slopes = BENDING_MODELS[model].slope(angle + np.array([-1e-4, 1e-4]))
    curvature = max(1.0, np.diff(slopes)[0] / 2e-4)
    return 4 * RIGIDITY / LENGTH**2 * curvature * angle_error + 1e-5 * np.abs(expected).max()


@pytest.mark.parametrize("model", BENDING_POTENTIALS)
def test_bending_forces(computed, model):
    platform, result = computed
    for (models, *shape), forces in zip(CASES, result["bending"]):
        if models[0] != model:
            continue
        nodes = nodes_of(*shape)
        expected = bending_forces(model, nodes)
        assert np.isfinite(forces).all(), shape
        tolerance = bending_tolerance(platform, model, shape[0], nodes, expected)
        assert np.abs(forces - expected).max() <= tolerance, (shape, forces, expected)


def stretching_tolerance(platform, model, nodes, expected):
    if platform not in GPU_PLATFORMS:
        return 1e-7 * np.abs(expected).max() + 1e-7
    strain = np.abs(np.linalg.norm(np.diff(nodes, axis=0), axis=1) - LENGTH).max()
    relative = (strain / EXTENSION) ** 2
    curvature = STIFFNESS * ((1 + relative) / (1 - relative) ** 2 if model == "fene" else 1.0)
    return 4 * curvature * 2.0**-23 * np.abs(nodes).max() + 1e-5 * np.abs(expected).max()


@pytest.mark.parametrize("model", STRETCHING_POTENTIALS)
def test_stretching_forces(computed, model):
    platform, result = computed
    for (models, *shape), forces in zip(CASES, result["stretching"]):
        if models[1] != model:
            continue
        nodes = nodes_of(*shape)
        expected = stretching_forces(model, nodes)
        tolerance = stretching_tolerance(platform, model, nodes, expected)
        assert np.abs(forces - expected).max() <= tolerance, (shape, forces, expected)


@pytest.fixture(scope="module")
def energy_of(platform):
    """A function: the bending and stretching energy of one chain. The others are straight and at rest meanwhile."""
    filaments = Filaments(1000.0, 300, "portable")
    for models in MODELS:
        filaments.add_straight(TYPES[models], 2, [0, 0, 0], [1, 0, 0])
    _, system, rest = filaments.build(stretching_force_group=STRETCHING_GROUP, bending_force_group=BENDING_GROUP)
    context = new_context(system, rest, platform=platform)
    rest = rest.value_in_unit(unit.nanometer)

    def evaluate(models, nodes):
        positions = rest.copy()
        positions[filaments.node_indices[MODELS.index(models)]] = nodes
        context.setPositions(positions)
        states = (context.getState(energy=True, groups={group}) for group in (BENDING_GROUP, STRETCHING_GROUP))
        return tuple(state.getPotentialEnergy()._value for state in states)

    return evaluate


@pytest.mark.parametrize("models", MODELS)
def test_energies(platform, energy_of, models):
    bending, stretching = models
    for shape in SHAPES:
        nodes = nodes_of(*shape)
        found = energy_of(models, nodes)
        expected = total_bending(bending, nodes), total_stretching(stretching, nodes)
        forces = bending_forces(bending, nodes), stretching_forces(stretching, nodes)
        for energy, exact, force in zip(found, expected, forces):
            tolerance = 1e-7 * exact + 1e-9
            if platform.getName() in GPU_PLATFORMS:
                rounding = 4 * 2.0**-23 * np.abs(nodes).max()
                tolerance = rounding * np.abs(force).max() + 0.5 * STIFFNESS * rounding**2 + 1e-4 * exact + 5e-4
            assert abs(energy - exact) <= tolerance, shape


@pytest.mark.parametrize("models", MODELS)
@pytest.mark.parametrize("angle", ANGLES)
def test_forces_by_hand_are_the_gradient_of_energies_by_hand(models, angle):
    bending, stretching = models
    nodes = joint(angle, (103.0, 98.5))
    by_difference = difference_forces(lambda x: total_bending(bending, x), nodes, 1e-2)
    exact = bending_forces(bending, nodes)
    assert np.abs(by_difference - exact).max() <= 1e-5 * np.abs(exact).max() + 1e-7
    by_difference = difference_forces(lambda x: total_stretching(stretching, x), nodes, 1e-2)
    exact = stretching_forces(stretching, nodes)
    assert np.abs(by_difference - exact).max() <= 1e-7 * np.abs(exact).max()


@pytest.mark.parametrize("models", MODELS)
def test_reference_forces_are_the_gradient_of_reference_energies(models, reference):
    filaments = Filaments(1000.0, 300, "portable")
    filaments.add_nodes(TYPES[models], moved(joint(1.2, (103.0, 98.5)), 3))
    _, system, positions = filaments.build()
    context = new_context(system, positions, platform=reference)

    def energy(nodes):
        context.setPositions(nodes)
        return context.getState(energy=True).getPotentialEnergy()._value

    nodes = positions.value_in_unit(unit.nanometer)
    by_difference = difference_forces(energy, nodes, 1e-2)
    context.setPositions(nodes)
    forces = forces_of(context)
    assert np.abs(by_difference - forces).max() <= 1e-6 * np.abs(forces).max()


# The same potentials in NumPy, which equilibrium draws and joint tensions use


@pytest.mark.parametrize("models", MODELS)
def test_numpy_energies(models):
    filament_type = TYPES[models]
    for angle in ANGLES:
        first, second = np.diff(joint(angle), axis=0)
        expected = bending_energy(models[0], first, second)
        # The cosine keeps half the digits of a small angle: 1 - c is good to 1e-16.
        assert float(filament_type.bending_energy(np.cos(angle))) == pytest.approx(expected, rel=1e-12, abs=1e-12)
    for length in (90.01, 97.0, 100.0, 104.0, 109.99):
        expected = stretching_energy(models[1], np.array([length, 0.0, 0.0]))
        assert float(filament_type.stretching_energy(length)) == pytest.approx(expected, rel=1e-12, abs=1e-12)


@pytest.mark.parametrize("models", MODELS)
def test_numpy_derivatives(models):
    filament_type = TYPES[models]
    for cosine in (-0.99, -0.5, 0.0, 0.5, 0.99, 0.99999):
        step = 1e-4 * (1 - abs(cosine))
        slope = (filament_type.bending_energy(cosine + step) - filament_type.bending_energy(cosine - step)) / 2 / step
        assert float(filament_type.bending_derivative(cosine)) == pytest.approx(float(slope), rel=1e-5)
    for length in (91.0, 97.0, 104.0, 109.0):
        pair = filament_type.stretching_energy(np.array([length - 1e-4, length + 1e-4]))
        assert filament_type.stretching_derivative(length) == pytest.approx((pair[1] - pair[0]) / 2e-4, rel=1e-5)


@pytest.mark.parametrize("model", BENDING_POTENTIALS)
def test_every_bending_model_has_the_same_stiffness_when_straight(model):
    # dV/dc = -a/l0 at c = 1
    assert float(TYPES[model, "harmonic"].bending_derivative(np.float64(1.0))) == pytest.approx(-RIGIDITY / LENGTH)


def test_fene_energy_is_infinite_beyond_its_limit():
    filament_type = TYPES["kratky-porod", "fene"]
    assert np.isposinf(filament_type.stretching_energy(np.array([89.0, 90.0, 110.0, 120.0]))).all()


@pytest.mark.parametrize("models", MODELS)
def test_forces_on_the_ends_of_segments_add_up_to_nodal_forces(models):
    generator = np.random.default_rng(4)
    nodes = np.cumsum(generator.normal([95.0, 0.0, 0.0], [2.0, 30.0, 30.0], (6, 3)), axis=0)
    scale = 100 / np.linalg.norm(np.diff(nodes, axis=0), axis=1).mean()
    nodes *= scale
    filament_type = rod(*models, maximum_extension=60.0) if models[1] == "fene" else TYPES[models]
    minus, plus = segment_end_forces(Filament(filament_type, nodes, ()), nodes)
    total = np.zeros_like(nodes)
    total[:-1] += minus
    total[1:] += plus
    expected = difference_forces(
        lambda x: float(
            np.sum(filament_type.stretching_energy(np.linalg.norm(np.diff(x, axis=0), axis=1)))
            + total_bending(models[0], x)
        ),
        nodes,
        1e-2,
    )
    assert np.abs(total - expected).max() <= 1e-7 * np.abs(expected).max()
    # No force on a segment as a whole, eq. (28).
    np.testing.assert_allclose(minus, -plus, rtol=1e-12)


# Where forces are not defined


@pytest.mark.parametrize("models", MODELS)
def test_antiparallel_segments_are_refused(models):
    filaments = Filaments(1000.0, 300, "portable")
    filaments.add_straight(TYPES[models], 2, [0, 0, 0], [1, 0, 0])
    folded = [[0, 0, 0], [100, 0, 0], [200, 0, 0], [100, 0, 0], [0, 0, 0]]
    with pytest.raises(InputError, match=r"Filament 1 \(ROD\).*node 2 are antiparallel.*move the node"):
        filaments.add_nodes(TYPES[models], folded)
    assert len(filaments) == 1


def test_antiparallel_segments_of_a_freely_jointed_chain_are_allowed(reference):
    free = dataclasses.replace(TYPES["inscribed-circle", "harmonic"], bending_rigidity=0.0)
    filaments = Filaments(1000.0, 300, "portable")
    filaments.add_nodes(free, [[0, 0, 0], [100, 0, 0], [0, 0, 0.0]])
    _, system, positions = filaments.build()
    context = new_context(system, positions, platform=reference)
    assert np.isfinite(forces_of(context)).all()


@pytest.mark.parametrize("lengths", [(110.0, 100.0), (100.0, 89.999), (100.0, 130.0)])
def test_fene_segments_beyond_their_limit_are_refused(lengths):
    filaments = Filaments(1000.0, 300, "portable")
    segment = int(np.argmax(np.abs(np.array(lengths) - 100)))
    with pytest.raises(InputError, match=rf"Filament 0 \(ROD\): segment {segment} is .* nm long, outside the FENE"):
        filaments.add_nodes(TYPES["quadratic", "fene"], joint(0.3, lengths))
