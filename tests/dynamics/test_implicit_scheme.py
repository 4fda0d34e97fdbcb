"""Scheme "implicit": equilibrium at large steps, and what happens when a step cannot be taken."""

from dataclasses import replace

import numpy as np
import openmm
import pytest
from openmm import unit

from openmm_cylchain import F_ACTIN, MICROTUBULE, Filaments, InputError, InstabilityError
from openmm_cylchain.time_steps.recommended_step import recommended_time_step
from openmm_cylchain.time_steps.schemes import IMPLICIT_SCHEMES
from support.bending_models import BENDING_MODELS
from support.contexts import energy_of, new_context, positions_of
from support.equilibrium_cases import CASES, Case, exact_means, measured_means
from support.solvent import KT, TEMPERATURE, VISCOSITY

SIGMAS = 4.0
# Of the energies, at the recommended step.
STEP_ERROR = 0.02
MICROSECOND = 1e6


@pytest.fixture(params=IMPLICIT_SCHEMES)
def scheme(request):
    return request.param


def _context(
    filaments, step, temperature=None, platform="Reference", seed=1, properties=None, checks=True, scheme="implicit"
):
    topology, system, positions = filaments.build()
    integrator = filaments.create_integrator(
        system, step, scheme=scheme, temperature=temperature, random_seed=seed, checks=checks
    )
    return new_context(system, positions, integrator, platform, properties)


def _actin(chains=3, segments=8, **options):
    filaments = Filaments(VISCOSITY, TEMPERATURE, engine="compiled")
    for chain in range(chains):
        filaments.add_equilibrium(F_ACTIN, segments, seed=chain, **options)
    return filaments


@pytest.mark.sample(r"^(?!0\.05-.*(fene|quadratic|kratky)|1-implicit-second-order-(fene|quadratic))")
@pytest.mark.parametrize("name", CASES)
@pytest.mark.parametrize(
    ("step_over_recommended", "scheme"),
    [
        pytest.param(step, scheme, marks=[] if (step, scheme) == (1, "implicit") else pytest.mark.slow)
        for step in (1, 0.05)
        for scheme in IMPLICIT_SCHEMES
    ],
)
def test_equilibrium_at_the_recommended_step(name, step_over_recommended, scheme):
    # Samples of short steps are worth less.
    case = CASES[name] if step_over_recommended < 1 else replace(CASES[name], chains=CASES[name].chains // 2)
    recommended = recommended_time_step(case.type, VISCOSITY, TEMPERATURE, scheme, case.segments).step
    measured = measured_means(case, "compiled", "Reference", scheme, step=step_over_recommended * recommended)
    exact = exact_means(case)
    for name in exact:
        mean, error = measured[name]
        allowed = STEP_ERROR * abs(exact[name]) if name.endswith("energy") else 0.002
        assert abs(mean - exact[name]) < allowed + SIGMAS * error, (name, measured, exact)
        if name.endswith("energy"):
            assert 0.05 * exact[name] > SIGMAS * error


@pytest.mark.sample("^implicit-5$|order-50")
@pytest.mark.slow
@pytest.mark.parametrize("microseconds", [5, 50])
def test_energies_of_actin_within_three_percent(microseconds, scheme):
    case = Case(F_ACTIN, 16, 2000, 400, None)
    measured = measured_means(case, "compiled", "Reference", scheme, step=microseconds * MICROSECOND)
    exact = exact_means(case)
    for name in ("stretching energy", "bending energy"):
        mean, error = measured[name]
        assert SIGMAS * error < 0.03 * exact[name]
        assert abs(mean - exact[name]) < 0.03 * exact[name], (name, mean, error, exact[name])


@pytest.mark.parametrize("scheme", ["implicit", pytest.param("implicit-second-order", marks=pytest.mark.slow)])
def test_equilibrium_of_lengths_much_stiffer_than_the_step_resolves(scheme):
    """Joints that are free, in chains whose lengths are all but fixed: <cos> = 0 and <cos^2> = 1/3.

    A scheme that treats lengths as constraints would give the distribution of rigid rods, <cos^2> = 0.32.
    """
    base = CASES["freely-jointed"]
    stiff = replace(base.type, stretching_stiffness=1e4 * base.type.segment_stiffness)
    case = replace(base, type=stiff, chains=3000, steps=1200 if scheme == "implicit" else 2400)
    step = recommended_time_step(case.type, VISCOSITY, TEMPERATURE, scheme, case.segments).step / 4
    measured = measured_means(case, "compiled", "Reference", scheme, step=step)
    mean, error = measured["squared cosine"]
    assert SIGMAS * error < 0.008
    assert abs(mean - 1 / 3) < SIGMAS * error
    mean, error = measured["stretching energy"]
    assert abs(mean - 0.5) < 0.005 + SIGMAS * error


@pytest.mark.parametrize("micrometers, segments", [(1, 1), (10, 1), (100, 1), (10, 4)])
def test_rods_turn_as_they_should_however_stiff(micrometers, segments, scheme):
    """Microtubules, of which 100 um would stretch by 1e-5 of their length with k_B T: <t.t'> = exp(-2 D_r h).

    Turning is of weak second order, so that the recommended step leaves D_r within 1 %.
    """
    kind = MICROTUBULE.with_segment_length(1e3 * micrometers / segments)
    filaments = Filaments(VISCOSITY, TEMPERATURE, engine="compiled")
    directions = np.random.default_rng(1).normal(size=(400, 3))
    for direction in directions:
        filaments.add_straight(kind, segments, [0, 0, 0], direction)
    whole = MICROTUBULE.with_segment_length(1e3 * micrometers)
    step = recommended_time_step(whole, VISCOSITY, TEMPERATURE, scheme, 1).step
    # In pieces, they also bend, which is not resolved.
    context = _context(filaments, step, checks=False, scheme=scheme)
    ends = np.array(filaments.node_indices)[:, [0, -1]]
    axes = []
    for _ in range(41):
        first, last = positions_of(context)[ends].transpose(1, 0, 2)
        axes.append((last - first) / np.linalg.norm(last - first, axis=1)[:, None])
        context.getIntegrator().step(1)
    missing = 1 - np.sum(np.array(axes[1:]) * axes[:-1], axis=2).ravel()
    mean, error = missing.mean(), missing.std(ddof=1) / np.sqrt(len(missing))
    friction = kind.segment_friction(VISCOSITY, TEMPERATURE, segments)
    places = kind.segment_length * (np.arange(segments) - 0.5 * (segments - 1))
    turning = segments * friction.rotational + friction.perpendicular * np.sum(places**2)
    exact = 1 - np.exp(-2 * KT / turning * step)
    assert SIGMAS * error < 0.04 * exact
    assert abs(mean - exact) < SIGMAS * error + 0.01 * exact, (mean / exact, error / exact)


def test_relaxation_without_noise_converges_with_order_one():
    """A chain that is stretched and bent relaxes to where very small steps lead."""
    nodes = np.array([[0, 0, 0], [380, 0, 0], [700, 150, 0], [900, 400, 100], [950, 800, 100.0]])
    ends = []
    for steps in (50, 100, 6400):
        filaments = Filaments(VISCOSITY, TEMPERATURE, engine="compiled")
        filaments.add_nodes(F_ACTIN, nodes)
        context = _context(filaments, 200 * MICROSECOND / steps, temperature=0)
        context.getIntegrator().step(steps)
        ends.append(positions_of(context))
    coarse, fine = (np.abs(end - ends[2]).max() for end in ends[:2])
    assert coarse < 0.02 * np.abs(ends[2] - nodes).max()
    assert fine < 0.6 * coarse


def test_external_forces_drag_a_filament():
    """A filament of any shape, pulled at all nodes alike, moves at F/gamma along and across."""
    filaments = Filaments(VISCOSITY, TEMPERATURE, engine="compiled")
    filaments.add_straight(F_ACTIN, 4, [0, 0, 0], [1, 0, 0])
    topology, system, positions = filaments.build()
    force = openmm.CustomExternalForce("-fx*x-fy*y")
    force.addGlobalParameter("fx", 0.01)
    force.addGlobalParameter("fy", 0.01)
    # Ends belong to one segment and get half of what the others get.
    force.addPerParticleParameter("share")
    force.setEnergyFunction("-share*(fx*x+fy*y)")
    for node in range(5):
        force.addParticle(node, [0.5 if node in (0, 4) else 1.0])
    system.addForce(force)
    step = 10 * MICROSECOND
    integrator = filaments.create_integrator(system, step, scheme="implicit", temperature=0)
    context = new_context(system, positions, integrator)
    start = positions_of(context)
    integrator.step(20)
    moved = (positions_of(context) - start).mean(axis=0) / (20 * step)
    friction = F_ACTIN.segment_friction(VISCOSITY, TEMPERATURE)
    assert moved[0] == pytest.approx(0.01 / friction.parallel, rel=1e-3)
    assert moved[1] == pytest.approx(0.01 / friction.perpendicular, rel=1e-3)


@pytest.mark.parametrize("platform", ["Reference", "CPU"])
def test_steps_at_once_threads_and_restarts_do_not_matter(platform, scheme):
    def context(**options):
        return _context(_actin(chains=11, segments=9), 20 * MICROSECOND, platform=platform, scheme=scheme, **options)

    contexts = [context() for _ in range(3)]
    if platform == "CPU":
        contexts.append(context(properties={"Threads": "1"}))
    contexts[0].getIntegrator().step(40)
    for _ in range(40):
        contexts[1].getIntegrator().step(1)
    contexts[2].getIntegrator().step(25)
    checkpoint = contexts[2].createCheckpoint()
    contexts[2].getIntegrator().step(3)
    contexts[2].loadCheckpoint(checkpoint)
    contexts[2].getIntegrator().step(15)
    for context in contexts[3:]:
        context.getIntegrator().step(40)
    for context in contexts[1:]:
        assert np.array_equal(positions_of(context), positions_of(contexts[0]))


def test_fixed_nodes_stay_and_pass_nothing_on(scheme):
    filaments = _actin(chains=1, segments=8, clamped=[3])
    context = _context(filaments, 50 * MICROSECOND, scheme=scheme)
    start = positions_of(context)
    context.getIntegrator().step(30)
    assert np.array_equal(positions_of(context)[3], start[3])
    assert np.all(np.abs(positions_of(context) - start)[[0, 1, 2, 4, 5, 6, 7, 8]].max(axis=1) > 1)


def test_shorter_chains_in_a_pack_move_as_they_would_alone():
    """Chains of several lengths are computed side by side."""
    together = Filaments(VISCOSITY, TEMPERATURE, engine="compiled")
    for chain, segments in enumerate((10, 9, 8, 10, 1)):
        together.add_equilibrium(F_ACTIN, segments, seed=chain)
    context = _context(together, 50 * MICROSECOND)
    context.getIntegrator().step(10)
    alone = Filaments(VISCOSITY, TEMPERATURE, engine="compiled")
    alone.add_equilibrium(F_ACTIN, 10, seed=0)
    other = _context(alone, 50 * MICROSECOND)
    other.getIntegrator().step(10)
    assert np.allclose(positions_of(context)[:11], positions_of(other), rtol=0, atol=1e-6)


def test_a_hard_pull_is_taken_in_parts(scheme):
    """A node that is moved by two segment lengths between steps: the step is divided, and energy falls."""
    filaments = _actin(chains=1, segments=12)
    context = _context(filaments, 50 * MICROSECOND, temperature=0, scheme=scheme)
    moved = positions_of(context)
    moved[6] += [0, 0, 700]
    context.setPositions(moved)
    before = energy_of(context)
    for _ in range(20):
        try:
            context.getIntegrator().step(1)
        except InstabilityError as error:
            assert "Filament 0 (ACT)" in str(error)
            return
        after = energy_of(context)
        assert np.isfinite(positions_of(context)).all()
        assert after < before
        before = after
    assert before < 50 * KT
    assert context.getIntegrator().getNumDividedSteps() > 0


@pytest.mark.parametrize("direction", [(1, 0, 0), (-1, 0, 0), (0, 1, 0)])
@pytest.mark.parametrize("nanonewton", [0.1, 1, 10])
def test_filaments_that_are_pulled_and_pushed_hard_come_back(direction, nanonewton):
    """Ends are pulled apart, pushed together or sheared, and let go: equilibrium comes back, or the run stops."""
    filaments = Filaments(VISCOSITY, TEMPERATURE, engine="compiled")
    for chain in range(24):
        filaments.add_equilibrium(F_ACTIN, 16, seed=chain, direction=[1, 0, 0])
    _, system, positions = filaments.build()
    force = openmm.CustomExternalForce("-pull*(fx*x+fy*y+fz*z)")
    force.addGlobalParameter("pull", nanonewton * 602.214)
    for component in ("fx", "fy", "fz"):
        force.addPerParticleParameter(component)
    for nodes in filaments.node_indices:
        force.addParticle(int(nodes[0]), [-each for each in direction])
        force.addParticle(int(nodes[-1]), direction)
    system.addForce(force)
    # Kicked so that steps are divided.
    integrator = filaments.create_integrator(system, 5 * MICROSECOND, scheme="implicit", random_seed=1, checks=False)
    context = new_context(system, positions, integrator)
    try:
        integrator.step(100)
    except InstabilityError as error:
        assert "the equations of the implicit scheme cannot be solved" in str(error)
        assert np.isfinite(positions_of(context)).all()
        assert nanonewton > 1
        return
    context.setParameter("pull", 0.0)
    integrator.step(2000)
    energy = energy_of(context) / KT
    expected = 24 * (0.5 * 16 + 0.98 * 15)
    assert abs(energy - expected) < 4 * np.sqrt(expected)


@pytest.mark.parametrize("model", BENDING_MODELS)
@pytest.mark.parametrize("angle", [np.pi, np.pi - 1e-9, np.pi - 0.01, 3.0])
def test_segments_that_are_folded_back_open_or_stop_the_run(model, angle):
    filaments = Filaments(VISCOSITY, TEMPERATURE, engine="compiled")
    filaments.add_straight(replace(F_ACTIN, bending_model=model), 3, [0, 0, 0], [1, 0, 0])
    context = _context(filaments, MICROSECOND)
    nodes = np.zeros((4, 3))
    nodes[1:3] = [[360, 0, 0], [720, 0, 0]]
    nodes[3] = nodes[2] + 360 * np.array([np.cos(angle), np.sin(angle), 0])
    context.setPositions(nodes)
    try:
        context.getIntegrator().step(1500)
    except InstabilityError as error:
        assert "Filament 0 (ACT) has blown up" in str(error)
        assert np.array_equal(positions_of(context), nodes)
        return
    tangents = np.diff(positions_of(context), axis=0)
    lengths = np.linalg.norm(tangents, axis=1)
    assert np.all(np.abs(lengths - 360) < 10)
    cosines = np.sum(tangents[1:] * tangents[:-1], axis=1) / (lengths[1:] * lengths[:-1])
    assert np.all(cosines > 0.5)


def test_forces_that_are_not_finite_are_named_and_nothing_moves():
    filaments = _actin()
    topology, system, positions = filaments.build()
    force = openmm.CustomExternalForce("k*sqrt(x-1e9)")
    force.addGlobalParameter("k", 1.0)
    force.addParticle(12, [])
    system.addForce(force)
    integrator = filaments.create_integrator(system, MICROSECOND, scheme="implicit", random_seed=1)
    context = new_context(system, positions, integrator)
    start = positions_of(context)
    with pytest.raises(InstabilityError, match=r"Filament 1 \(ACT\) has blown up at segment 2 in step 1"):
        integrator.step(5)
    assert np.array_equal(positions_of(context), start)


def test_reported_forces_are_those_of_all_forces():
    filaments = _actin(chains=1)
    context = _context(filaments, MICROSECOND)
    context.getIntegrator().step(3)
    state = context.getState(forces=True, energy=True)
    other = _context(_actin(chains=1), MICROSECOND)
    other.setPositions(positions_of(context))
    expected = other.getState(forces=True, energy=True)
    assert np.array_equal(state.getForces(asNumpy=True)._value, expected.getForces(asNumpy=True)._value)
    assert np.abs(expected.getForces(asNumpy=True)._value).max() > 0
    assert state.getPotentialEnergy() == expected.getPotentialEnergy()


def test_portable_engine_refuses():
    filaments = Filaments(VISCOSITY, TEMPERATURE, engine="portable")
    filaments.add_straight(F_ACTIN, 2, [0, 0, 0], [1, 0, 0])
    _, system, _ = filaments.build()
    with pytest.raises(InputError, match="portable engine does not have scheme 'implicit'"):
        filaments.create_integrator(system, 1 * unit.microsecond, scheme="implicit")
