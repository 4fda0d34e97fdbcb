"""What the recommended step promises, case by case, as docs/promises.md lists them: right, warned of, or refused."""

import warnings
from dataclasses import replace

import numpy as np
import pytest
from openmm import unit
from scipy.linalg import eigh
from scipy.spatial.transform import Rotation

from openmm_cylchain import (
    DSDNA,
    F_ACTIN,
    MICROTUBULE,
    Filaments,
    FilamentType,
    Flow,
    TimeStepError,
    TimeStepWarning,
    recommended_time_step,
)
from openmm_cylchain.couplings import walls as confinement
from openmm_cylchain.time_steps.recommended_step import fene_steps
from openmm_cylchain.time_steps.time_step import effective_rate
from support.chain_energies import energies_of, exact_energies
from support.closed_shapes import ClosedShape
from support.contexts import new_context, positions_of
from support.dense_mechanics import straight_matrices
from support.linked_pairs import PICONEWTON_PER_NANOMETER, linked_pairs
from support.solvent import KT, TEMPERATURE, VISCOSITY

SIGMAS = 4.0
LARGEST_DIVIDED_SHARE = 1e-3
MICROMETER = 1e3


def chain_of(stiffness, joint, **options):
    """Segments of 100 nm with k l0^2 and joints in k_B T."""
    length = 100.0
    return FilamentType(
        name="PROM",
        diameter=6,
        segment_length=length,
        bending_rigidity=joint * KT * length,
        stretching_stiffness=stiffness * KT / length**2,
        **options,
    )


def fene(kind, extension):
    return replace(kind, stretching_model="fene", maximum_extension=extension)


def context_of(filaments, step=None, checks=True, seed=1, scheme="implicit", system=None, positions=None, **options):
    if system is None:
        _, system, positions = filaments.build()
    step = filaments.recommended_time_step(scheme, system=system) if step is None else step
    integrator = filaments.create_integrator(system, step, scheme, random_seed=seed, checks=checks, **options)
    context = new_context(system, positions, integrator)
    return context, integrator


def in_equilibrium(kind, segments, chains, **options):
    filaments = Filaments(VISCOSITY, TEMPERATURE, engine="compiled")
    for chain in range(chains):
        filaments.add_equilibrium(kind, segments, seed=chain, **options)
    return filaments


def assert_energies(
    kind, filaments, exact, bound, steps, every=4, closed=False, step=None, bending_bound=None, scheme="implicit"
):
    """V_el and V_b within a bound, with errors of less than a quarter of it, and hardly a step divided."""
    context, integrator = context_of(filaments, step, checks=step is None, scheme=scheme)
    chains = len(filaments.node_indices)
    integrator.step(steps // 5)
    samples = []
    for _ in range(steps // every):
        integrator.step(every)
        samples.append(energies_of(kind, positions_of(context).reshape(chains, -1, 3), closed))
    by_chain = np.mean(samples, axis=0)
    bounds = (bound, bound if bending_bound is None else bending_bound)
    for name, values, expected, allowed in zip(("stretching", "bending"), by_chain, exact, bounds):
        if expected == 0.0:
            continue
        ratio, error = values.mean() / expected, values.std(ddof=1) / np.sqrt(chains) / expected
        print(f"{name}: {ratio:.4f} +- {error:.4f} of exact")
        assert SIGMAS * error < allowed, (name, error)
        assert abs(ratio - 1.0) < allowed + SIGMAS * error, (name, ratio, error)
    taken = steps // 5 + steps // every * every
    assert integrator.getNumDividedSteps() < LARGEST_DIVIDED_SHARE * taken * chains


def slow(*values):
    return pytest.param(*values, marks=pytest.mark.slow)


# A: rods of one segment


def rods(kind, count, seed=1):
    filaments = Filaments(VISCOSITY, TEMPERATURE, engine="compiled")
    for direction in np.random.default_rng(seed).normal(size=(count, 3)):
        filaments.add_straight(kind, 1, [0, 0, 0], direction)
    return filaments


RODS = [
    (MICROTUBULE, 10),
    (F_ACTIN, 5),
    *(slow(MICROTUBULE, length) for length in (1, 2, 5, 20)),
    *(slow(F_ACTIN, length) for length in (1, 3)),
]


@pytest.mark.parametrize("kind, micrometers", RODS)
def test_rods_diffuse_without_jumps(kind, micrometers):
    kind = kind.with_segment_length(micrometers * MICROMETER)
    filaments = rods(kind, 2000)
    context, integrator = context_of(filaments)
    step = integrator.getStepSize()._value
    friction = kind.segment_friction(VISCOSITY, TEMPERATURE)
    along, across = (np.sqrt(2 * KT * step / gamma) for gamma in (friction.parallel, friction.perpendicular))
    squares, farthest = [], 0.0
    before = positions_of(context).reshape(-1, 2, 3)
    for _ in range(80):
        integrator.step(1)
        after = positions_of(context).reshape(-1, 2, 3)
        moved = (after - before).mean(axis=1)
        axes = before[:, 1] - before[:, 0]
        ahead = np.einsum("ij,ij->i", moved, axes) / np.linalg.norm(axes, axis=1)
        squares.append(np.sum(moved**2, axis=1))
        aside = np.sqrt(np.maximum(squares[-1] - ahead**2, 0.0))
        farthest = max(farthest, np.abs(ahead).max() / along, aside.max() / across)
        before = after
    by_rod = np.mean(squares, axis=0) / (along**2 + 2 * across**2)
    error = by_rod.std(ddof=1) / np.sqrt(len(by_rod))
    assert SIGMAS * error < 0.01
    assert abs(by_rod.mean() - 1.0) < 0.01, (by_rod.mean(), error)
    assert farthest < 8.0
    assert integrator.getNumDividedSteps() == 0


@pytest.mark.parametrize("turn", [0.05, slow(0.01), slow(0.02)])
@pytest.mark.parametrize("kind, micrometers", [(MICROTUBULE, 10), slow(MICROTUBULE, 20), slow(F_ACTIN, 1)])
def test_rods_turn_at_the_exact_rate(kind, micrometers, turn):
    # <t.t'> = exp(-2 D_r h)
    kind = kind.with_segment_length(micrometers * MICROMETER)
    filaments = rods(kind, 4000)
    step = turn * kind.segment_friction(VISCOSITY, TEMPERATURE).rotational / KT
    context, integrator = context_of(filaments, step, checks=False)
    missing, before = [], None
    for _ in range(81):
        ends = positions_of(context).reshape(-1, 2, 3)
        axes = ends[:, 1] - ends[:, 0]
        axes /= np.linalg.norm(axes, axis=1)[:, None]
        if before is not None:
            missing.append(1.0 - np.einsum("ij,ij->i", axes, before))
        before = axes
        integrator.step(1)
    by_rod = np.mean(missing, axis=0)
    rate = -np.log1p(-by_rod.mean()) / (2 * turn)
    error = by_rod.std(ddof=1) / np.sqrt(len(by_rod)) / (1 - by_rod.mean()) / (2 * turn)
    assert SIGMAS * error < 0.01
    assert abs(rate - 1.0) < 0.01, (rate, error)


# B: forces beside filaments (links: dynamics/test_recommended_step.py)


def wall_of(thickness):
    return confinement.Slab([0, 0, 0], [0, 0, 1], thickness)


@pytest.mark.slow
def test_walls_have_their_energy_at_the_recommended_step():
    """Actin between walls of 0.1 pN/nm: starts, and the exact energy, from free chains put there by weight."""
    stiffness, thickness, segments, chains = 0.1 * PICONEWTON_PER_NANOMETER, 60.0, 2, 1200
    generator = np.random.default_rng(1)
    shapes = np.array([filament.positions for filament in in_equilibrium(F_ACTIN, segments, 2000)])
    shapes -= shapes.mean(axis=1, keepdims=True)
    shape = generator.integers(len(shapes), size=1_400_000)
    # The normal of the walls, as a filament has it, at most 0.2 along its axis: no other leaves it between them.
    axis = shapes[shape, -1] - shapes[shape, 0]
    axis /= np.linalg.norm(axis, axis=1)[:, None]
    across = np.cross(axis, generator.normal(size=axis.shape))
    across /= np.linalg.norm(across, axis=1)[:, None]
    along = generator.uniform(-0.2, 0.2, (len(shape), 1))
    up = along * axis + np.sqrt(1.0 - along**2) * across
    heights = np.einsum("cni,ci->cn", shapes[shape], up) + generator.uniform(-100, 100, (len(shape), 1))
    energy = 0.5 * stiffness * np.sum(np.maximum(0.0, np.abs(heights) - thickness / 2) ** 2, axis=1) / KT
    weight = np.exp(-energy)
    exact = np.sum(weight * energy) / np.sum(weight)
    assert weight.sum() ** 2 / np.sum(weight**2) > 1e5
    filaments = Filaments(VISCOSITY, TEMPERATURE, engine="compiled")
    for index in generator.choice(len(shape), chains, p=weight / weight.sum()):
        nodes = Rotation.align_vectors([[0.0, 0.0, 1.0]], [up[index]])[0].apply(shapes[shape[index]])
        filaments.add_nodes(F_ACTIN, nodes + [0, 0, heights[index, 0] - nodes[0, 2]])
    _, system, positions = filaments.build()
    system.addForce(confinement.wall_force(wall_of(thickness), stiffness, range(chains * (segments + 1))))
    assert "Wall" in filaments.recommended_time_step("implicit", system=system).reason
    context, integrator = context_of(filaments, system=system, positions=positions)
    samples = []
    for _ in range(750):
        integrator.step(4)
        nodes = positions_of(context).reshape(chains, -1, 3)
        depth = np.maximum(0.0, np.abs(nodes[..., 2]) - thickness / 2)
        samples.append(0.5 * stiffness * np.sum(depth**2, axis=1) / KT)
    by_chain = np.mean(samples, axis=0)
    ratio, error = by_chain.mean() / exact, by_chain.std(ddof=1) / np.sqrt(chains) / exact
    print(f"wall: {ratio:.4f} +- {error:.4f} of exact")
    assert SIGMAS * error < 0.05
    assert abs(ratio - 1.0) < 0.05 + SIGMAS * error, (ratio, error)
    assert integrator.getNumDividedSteps() == 0


def test_a_link_at_too_long_a_step_warns_and_stops_the_run():
    filaments, system, positions, _ = linked_pairs(MICROTUBULE, 8, 0.1, count=8)
    step = filaments.recommended_time_step("implicit")
    with pytest.warns(TimeStepWarning, match="HarmonicBondForce"):
        context, integrator = context_of(filaments, step, system=system, positions=positions)
    with warnings.catch_warnings(), pytest.raises(TimeStepError, match="were divided"):
        warnings.simplefilter("ignore")
        integrator.step(100)


def test_a_wall_at_too_long_a_step_warns():
    filaments = in_equilibrium(F_ACTIN, 8, 8)
    _, system, positions = filaments.build()
    system.addForce(confinement.wall_force(wall_of(500.0), 0.01 * PICONEWTON_PER_NANOMETER, range(72)))
    with pytest.warns(TimeStepWarning, match="Wall"):
        context_of(filaments, 4e8, system=system, positions=positions)


# C: any stiffness, joints, held ends and rings

STIFFNESSES = (1e2, 1e5, 1e8, 1e11)
FREE = [(k, joint, ()) for k in STIFFNESSES for joint in (0, 10, 1000)]
FREE += [(k, joint, (0,)) for k in (1e2, 1e11) for joint in (0, 10, 1000)]


@pytest.mark.slow
@pytest.mark.sample(r"^100000\.0-|^100000000000\.0-(0|1000)-|^100\.0-10-clamped1$")
@pytest.mark.parametrize("stiffness, joint, clamped", FREE)
def test_energies_of_chains_of_any_stiffness(stiffness, joint, clamped):
    kind = chain_of(stiffness, joint)
    filaments = in_equilibrium(kind, 3, 2500 if clamped else 2000, clamped=clamped)
    # Beside stiff joints, soft lengths relax slowly.
    soft = {0: 4500, 10: 8000, 1000: 24000}[joint]
    steps = soft if stiffness < 1e3 else 240 if joint == 0 else 1400
    bound = 0.02 if (stiffness, joint, clamped) == (1e2, 1000, (0,)) else 0.01
    assert_energies(
        kind, filaments, exact_energies(kind), bound, steps, every=max(4, steps // (300 if stiffness < 1e3 else 100))
    )


HELD = [(stiffness, joint) for stiffness in STIFFNESSES for joint in (0, 10, 1000)]


@pytest.mark.sample(r"-100000\.0-10$|held-100\.0-10$|100000000000\.0-1000")
@pytest.mark.slow
@pytest.mark.parametrize("stiffness, joint", HELD)
@pytest.mark.parametrize("shape", ["both ends held", "ring"])
def test_energies_of_held_chains_and_rings_of_any_stiffness(stiffness, joint, shape):
    kind = chain_of(stiffness, joint)
    about_rest = (stiffness, joint) in ((1e5, 1000), (1e2, 10), (1e2, 1000))
    held_at = 300.0 if about_rest else 250.0 if joint < 100 else 295.0
    distance = None if shape == "ring" else held_at
    draws = 400_000 if stiffness > 1e3 else 1_000_000
    exact = ClosedShape(kind, distance, TEMPERATURE, draws, about_rest)
    assert exact.effective > 1e5
    square = kind.bending_energy(0.0) / KT if distance is None else 0.0
    energies = exact.stretching, exact.bending - square if joint else 0.0
    if stiffness > 1e3:
        chains, steps = 2000, 2400 if about_rest else 1600 if distance is None else 640
    else:
        chains, steps = (2000, 40000) if joint == 1000 else (1000, 14000)
    filaments = Filaments(VISCOSITY, TEMPERATURE, engine="compiled")
    for nodes in exact.draw(chains):
        filaments.add_nodes(kind, nodes, clamped=(0, -1) if distance else (), closed=distance is None)
    # Beside stiff joints, soft lengths of rings relax too slowly for more.
    bound = 0.04 if (stiffness, joint, shape) == (1e2, 1000, "ring") else 0.01
    assert_energies(kind, filaments, energies, bound, steps, max(4, steps // 700), closed=distance is None)


@pytest.mark.sample("^[12]-")
@pytest.mark.parametrize("segments, stiffness", [slow(1, 100), slow(1, 10), slow(1, 300), slow(2, 100), slow(4, 30)])
def test_soft_lengths_are_right_at_the_recommended_step(segments, stiffness):
    kind = chain_of(stiffness, 0)
    filaments = in_equilibrium(kind, segments, 2000)
    assert "soft lengths" in filaments.recommended_time_step("implicit").reason
    steps = {10: 18000, 30: 6000, 100: 6000, 300: 4000}[stiffness]
    assert_energies(kind, filaments, exact_energies(kind), 0.01, steps, every=steps // 800)


LONG = [(360.0, 64, 600, "implicit", 0.01), (360.0, 64, 1000, "implicit-second-order", 0.01)]
LONG += [(360.0, 256, 200, "implicit", 0.02), (120.0, 150, 200, "implicit-second-order", 0.03)]


@pytest.mark.sample("implicit-0")
@pytest.mark.slow
@pytest.mark.parametrize("length, segments, chains, scheme, bound", LONG)
def test_energies_of_long_filaments(length, segments, chains, scheme, bound):
    kind = F_ACTIN.with_segment_length(length)
    filaments = in_equilibrium(kind, segments, chains)
    assert_energies(kind, filaments, exact_energies(kind), bound, 400, scheme=scheme)


STIFF_MATERIALS = {
    "actin of 4 x 5 um": (F_ACTIN.with_segment_length(5000.0), 4),
    "freely jointed microtubules of 4 x 10 um": (
        replace(MICROTUBULE.with_segment_length(1e4), bending_rigidity=0.0),
        4,
    ),
    # F: the recommended step ignores stretching, and may.
    "actin of 1e5 pN/nm": (replace(F_ACTIN, stretching_stiffness=1e5 * PICONEWTON_PER_NANOMETER), 6),
    "actin of 1e8 pN/nm": (replace(F_ACTIN, stretching_stiffness=1e8 * PICONEWTON_PER_NANOMETER), 6),
    "DNA": (DSDNA, 6),
}


@pytest.mark.slow
@pytest.mark.parametrize("name", STIFF_MATERIALS)
def test_energies_of_stiff_materials(name):
    kind, segments = STIFF_MATERIALS[name]
    filaments = in_equilibrium(kind, segments, 1500)
    assert_energies(kind, filaments, exact_energies(kind), 0.02, 1000)


def test_lengths_that_relax_in_seconds_divide_no_step():
    kind = replace(F_ACTIN, extension_relaxation_time=1 * unit.second)
    context, integrator = context_of(in_equilibrium(kind, 8, 100))
    integrator.step(200)
    assert integrator.getNumDividedSteps() == 0
    _, bending = energies_of(kind, positions_of(context).reshape(100, 9, 3))
    assert abs(bending.mean() / exact_energies(kind)[1] - 1.0) < SIGMAS * bending.std() / 10


# D: how fast modes relax


@pytest.mark.parametrize("factor", [1, slow(0.3), slow(2)])
def test_rates_of_bending_modes_are_those_that_are_stated(factor):
    kind, segments, chains = MICROTUBULE.with_segment_length(1000.0), 8, 2000
    recommended = recommended_time_step(kind, VISCOSITY, TEMPERATURE, "implicit", segments)
    step = factor * recommended.step
    resistance, stiffness, _ = straight_matrices(kind, segments, step)
    rates, shapes = eigh(stiffness, resistance)
    modes = shapes[:, 2:5].T @ resistance
    context, integrator = context_of(in_equilibrium(kind, segments, chains), step, checks=False)
    amplitudes = []
    for _ in range(60):
        integrator.step(1)
        amplitudes.append(np.einsum("mn,cni->cmi", modes, positions_of(context).reshape(chains, -1, 3)))
    amplitudes = np.array(amplitudes)
    product = np.sum(amplitudes[1:] * amplitudes[:-1], axis=3).mean(axis=0)
    square = 0.5 * np.sum(amplitudes[1:] ** 2 + amplitudes[:-1] ** 2, axis=3).mean(axis=0)
    left = product.mean(axis=0) / square.mean(axis=0)
    error = np.std(product - left * square, axis=0, ddof=1) / np.sqrt(chains) / square.mean(axis=0) / left
    fastest = 4 * kind.joint_stiffness / kind.segment_friction(VISCOSITY, TEMPERATURE, segments).rotational
    for mode, rate in enumerate(rates[2:5]):
        measured, uncertain = -np.log(left[mode]) / (rate * step), error[mode] / (rate * step)
        stated = effective_rate(step, "implicit", rate, fastest) / rate
        assert mode == 0 or SIGMAS * uncertain < 0.05
        assert abs(measured - stated) < 0.01 + SIGMAS * uncertain, (mode, measured, stated, uncertain)
        # The limits that a TimeStep states are where the error of a rate is that large.
        for share in (0.05, 0.10):
            limit = replace(recommended, step=step).resolved_relaxation_time(share)
            assert (1 / rate >= limit) == (stated >= 1 - share)


# E: FENE lengths

FENE = [
    (F_ACTIN, 36.0),
    (F_ACTIN, 0.1),
    *(slow(F_ACTIN, extension) for extension in (28.8, 18.0, 10.8, 3.6, 3.0, 1.0, 0.3)),
    slow(replace(DSDNA, stretching_stiffness=70.0, stretching_modulus=None), 2.0),
]


@pytest.mark.parametrize("kind, extension", FENE)
def test_energies_of_fene_lengths(kind, extension):
    kind = fene(kind, extension)
    soft = kind.segment_stiffness * extension**2 / KT < 30
    filaments = in_equilibrium(kind, 8, 240)
    assert_energies(kind, filaments, exact_energies(kind), 0.05 if soft else 0.02, 360, bending_bound=0.05)


@pytest.mark.sample("drawn|-3$")
@pytest.mark.slow
@pytest.mark.parametrize("nu", [10, 3, 1])
@pytest.mark.parametrize("which", ["resolved", "drawn anew"])
def test_energies_of_soft_fene_lengths_are_within_five_per_cent(nu, which):
    # At the longest step that resolves them, and the shortest that draws them anew.
    kind = fene(replace(DSDNA, stretching_stiffness=nu * KT / 0.05**2, stretching_modulus=None), 0.05)
    resolved, drawn = fene_steps(kind, kind.segment_friction(VISCOSITY, TEMPERATURE), TEMPERATURE)
    filaments = in_equilibrium(kind, 2, 1000)
    exact = exact_energies(kind)[0], 0.0
    if which == "drawn anew":
        assert_energies(kind, filaments, exact, 0.05, 400, step=drawn)
    else:
        assert_energies(kind, filaments, exact, 0.05, {10: 1600, 3: 4000, 1: 8000}[nu], every=20, step=resolved)


def test_fene_lengths_that_a_step_gets_wrong_are_warned_of():
    kind = fene(F_ACTIN, 1.0)
    resolved, drawn = fene_steps(kind, kind.segment_friction(VISCOSITY, TEMPERATURE), TEMPERATURE)
    filaments = in_equilibrium(kind, 8, 1)
    _, system, _ = filaments.build()
    for step in (1.2 * resolved, 0.8 * drawn):
        with pytest.warns(TimeStepWarning, match="neither resolves .* nor is long enough.*at least"):
            filaments.create_integrator(system, step, "implicit")
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        for step in (resolved, drawn, filaments.recommended_time_step("implicit")):
            filaments.create_integrator(system, step, "implicit")


# G: the label of DNA


@pytest.mark.slow
def test_dna_has_the_persistence_length_of_its_label():
    length = 43.3
    context, integrator = context_of(in_equilibrium(DSDNA, 6, 3000))
    integrator.step(100)
    cosines = []
    for _ in range(150):
        integrator.step(4)
        vectors = np.diff(positions_of(context).reshape(3000, 7, 3), axis=1)
        tangents = vectors / np.linalg.norm(vectors, axis=2)[..., None]
        cosines.append(np.einsum("ijk,ijk->i", tangents[:, 1:], tangents[:, :-1]) / 5)
    by_chain = np.mean(cosines, axis=0)
    persistence = -DSDNA.segment_length / np.log(by_chain.mean()) / length
    error = by_chain.std(ddof=1) / np.sqrt(3000) / (1 - by_chain.mean())
    print(f"persistence length: {persistence:.4f} +- {error:.4f} of its label")
    assert SIGMAS * error < 0.02
    assert abs(persistence - 1.0) < 0.02, (persistence, error)


# H, I: what is warned of


def test_flows_that_a_step_does_not_resolve_are_warned_of():
    filaments = in_equilibrium(F_ACTIN, 4, 1)
    _, system, _ = filaments.build()
    step = 1e7
    for strain, warned in ((0.03, False), (0.09, True)):
        with warnings.catch_warnings(record=True) as caught:
            warnings.simplefilter("always")
            filaments.create_integrator(system, step, "implicit", flow=Flow.shear(strain / step))
        assert [one.category for one in caught] == [TimeStepWarning] * warned


def test_dna_at_a_step_far_too_long_is_warned_of():
    filaments = in_equilibrium(DSDNA, 16, 50)
    with pytest.warns(TimeStepWarning, match="times as long as the recommended one"):
        _, integrator = context_of(filaments, 1e5)
    with pytest.warns(TimeStepWarning, match="were divided"):
        integrator.step(100)
