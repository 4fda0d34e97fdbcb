"""Branches: the angle of their joints against Monte Carlo of the same springs, and how they let go."""

import numpy as np
import openmm
import pytest
from openmm import unit

from openmm_cylchain import F_ACTIN, Branching, Filaments, Growth, MonomerPool, Monomers, Severing
from openmm_cylchain.engine_choice import load_plugin
from openmm_cylchain.filaments.grown import rest_lengths

pytest.importorskip("openmm_cylchain.plugin")

TEMPERATURE, WATER = 298.0, 1e-3 * unit.pascal * unit.second
KT = 0.00831446261815324 * TEMPERATURE
MONOMER, PER_SEGMENT = 2.7, 40
ACTIN = F_ACTIN.with_segment_length(PER_SEGMENT * MONOMER)
POOL = MonomerPool(1e-4)
STILL = Growth(monomers=Monomers(length=MONOMER, plus_off_rate=1e-30), pool=POOL, longest=1200.0, minus_capped=True)
"""A growth by which nothing happens."""


def branched(step, count, branches, mother=STILL, seed=3, **options):
    """Mothers of ten segments, each of which is to have so many branches within a few steps."""
    filaments = Filaments(WATER, TEMPERATURE)
    for number in range(count):
        filaments.add_equilibrium(ACTIN, 10, number + 1, start=[0, 0, 3000.0 * number], growth=mother)
    rate = branches / (10.0 * ACTIN.segment_length) / step
    branching = Branching(**{"rate": rate, "length": 189.0, "mothers": list(range(count)), **options})
    branch = Growth(monomers=STILL.monomers, pool=POOL, longest=250.0, shortest=100.0, vanishes=True, minus_capped=True)
    filaments.add_reserve(ACTIN, count * branches, growth=branch, nucleation=branching)
    _, system, positions = filaments.build()
    integrator = filaments.create_integrator(system, step, random_seed=seed, checks=False)
    context = openmm.Context(system, integrator, openmm.Platform.getPlatformByName("CPU"), {"Threads": "1"})
    context.setPositions(positions)
    return filaments, branching, system, context


def joints_of(filaments, context):
    """Angles and lengths of the joints that there are, and numbers of branches, from tangents where springs hold."""
    inside = filaments.in_context(context)
    table, state = inside.linkers(), inside.growth()
    positions = context.getState(positions=True).getPositions(asNumpy=True)._value
    index = {int(number): row for row, number in enumerate(state.filaments)}

    def place(filament, along):
        row = index[filament]
        rest = rest_lengths(state.monomers[row], PER_SEGMENT, MONOMER)
        contour = MONOMER * state.monomers[row, 0] + np.concatenate([[0.0], np.cumsum(rest)])
        nodes = positions[filaments.node_indices[filament]]
        segment = min(max(int(np.searchsorted(contour, along)) - 1, 0), len(rest) - 1)
        vector = nodes[segment + 1] - nodes[segment]
        return nodes[segment] + (along - contour[segment]) / rest[segment] * vector, vector / np.linalg.norm(vector)

    first = (table.types == 0) & (table.filaments >= 0).all(axis=1)
    found = []
    for (mother, branch), along in zip(table.filaments[first].tolist(), table.arc_lengths[first].tolist()):
        (point, tangent), (start, axis) = place(mother, along[0]), place(branch, along[1])
        found.append((np.arccos(np.clip(tangent @ axis, -1.0, 1.0)), np.linalg.norm(start - point), branch))
    return np.array(found).reshape(-1, 3)


def drawn_joints(branching, count=2_000_000):
    """Angles and lengths of joints of straight rods, drawn with the energies of their springs, and their weights."""
    generator = np.random.default_rng(5)
    (_, stiffness, _, _), (strut, against, on_mother, on_branch) = branching.springs
    cosines = generator.uniform(-1.0, 1.0, count)
    axis = np.column_stack([cosines, np.sqrt(1.0 - cosines**2), np.zeros(count)])
    between = generator.normal(scale=np.sqrt(KT / stiffness), size=(count, 3))
    lengths = np.linalg.norm(between + on_branch * axis - [on_mother, 0.0, 0.0], axis=1)
    weights = np.exp(-0.5 * against * (lengths - strut) ** 2 / KT)
    return np.arccos(cosines), np.linalg.norm(between, axis=1), weights


def test_branches_begin_at_the_angle():
    """With sin(theta) exp(-K (theta - theta0)^2/2 k_BT), anywhere on their mothers, the first node on these."""
    filaments, branching, _, context = branched(10.0, 8, 150)
    for _ in range(2):
        context.getIntegrator().step(2)
    found = joints_of(filaments, context)
    assert len(found) > 900 and np.max(found[:, 1]) < 0.5
    angles = np.linspace(0.0, np.pi, 20001)
    weights = np.sin(angles) * np.exp(-0.5 * branching.angular_stiffness * (angles - branching.angle) ** 2 / KT)
    mean = np.average(angles, weights=weights)
    spread = np.sqrt(np.average((angles - mean) ** 2, weights=weights))
    assert abs(found[:, 0].mean() - mean) < 4.0 * spread / np.sqrt(len(found))
    assert found[:, 0].std() == pytest.approx(spread, rel=4.0 / np.sqrt(2.0 * len(found)))
    table = filaments.in_context(context).linkers()
    along = table.arc_lengths[table.types == 0, 0] / (10.0 * ACTIN.segment_length)
    # The strut holds mothers ten nanometers further on, which must be there.
    assert np.max(np.abs(np.histogram(along, 5, (0.0, 1.0))[0] / len(along) - 0.2)) < 4.0 * np.sqrt(0.16 / len(along))
    assert np.all(table.arc_lengths[table.types == 1, 1] == branching.lever)


@pytest.mark.slow
@pytest.mark.parametrize(("microseconds", "between"), [(10.0, 20), (100.0, 4)])
def test_angles_of_branches(microseconds, between):
    filaments, branching, system, context = branched(microseconds * 1e6, 20, 5)
    context.getIntegrator().step(10 * between)
    angles, lengths, energies = [], [], []
    kind = load_plugin().CylinderChainForce
    force = next(kind.cast(force) for force in system.getForces() if kind.isinstance(force))
    for _ in range(120):
        context.getIntegrator().step(between)
        found = joints_of(filaments, context)
        angles.append(found[:, 0])
        lengths.append(found[:, 1])
        stretching = force.computeEnergies(context)[0]._value / KT
        energies.append(stretching / np.sum(filaments.in_context(context).growth().nodes - 1))
    assert len(angles[0]) == 100
    drawn, apart, weights = drawn_joints(branching)
    angles, squares = np.array(angles), np.array(lengths) ** 2
    mean = np.average(drawn, weights=weights)
    # Branches are independent of each other; mothers are some five times as long as joints know of each other.
    error = angles.mean(axis=0).std(ddof=1) / np.sqrt(angles.shape[1])
    assert error < np.deg2rad(0.3) and abs(angles.mean() - mean) < 4.0 * error
    spread = np.sqrt(np.average((drawn - mean) ** 2, weights=weights))
    assert angles.std() == pytest.approx(spread, rel=0.05)
    error = squares.mean(axis=0).std(ddof=1) / np.sqrt(squares.shape[1])
    expected = np.average(apart**2, weights=weights)
    assert error < 0.03 * expected and abs(squares.mean() - expected) < 4.0 * error
    assert np.mean(energies) == pytest.approx(0.5, abs=4.0 * np.std(energies) / np.sqrt(120))


def test_joints_let_go_together():
    """At the rate k of the spring at the first node, all springs of a joint; what branches were stays as it is."""
    step, rate = 10.0, 0.02
    filaments, branching, _, context = branched(step, 8, 40, debranching_rate=rate / step)
    context.getIntegrator().step(40)
    before = filaments.in_context(context).growth()
    bound = []
    for _ in range(100):
        context.getIntegrator().step(1)
        table = filaments.in_context(context).linkers()
        there = (table.filaments >= 0).all(axis=1)
        by_type = [sorted(table.filaments[there & (table.types == kind), 1].tolist()) for kind in (0, 1)]
        assert by_type[0] == by_type[1]
        bound.append(len(by_type[0]))
    # No branches are left to begin: each decays by itself.
    state = filaments.in_context(context).growth()
    assert state.nucleated == before.nucleated == 8 * 40 and np.all(state.nodes > 0)
    survival = np.exp(-rate * 100)
    first = 8 * 40 * np.exp(-rate * 40)
    assert abs(bound[-1] - first * survival) < 4.0 * np.sqrt(first * survival)
    assert bound[0] > 3 * bound[-1]


@pytest.mark.parametrize("distance", [0.0, 7.0])
@pytest.mark.parametrize("force", [5.0, 10.0])
def test_thermal_motion_makes_the_factor_of_rates_of_letting_go(distance, force):
    """The mean of exp(F/F_u) over joints of straight rods, and that under a load, by Monte Carlo."""
    branching = Branching(rate=1.0, distance=distance, debranching_rate=1.0, debranching_force=force)
    generator, count, thermal = np.random.default_rng(5), 1_000_000, np.sqrt(KT / branching.stiffness)
    springs = branching.springs
    start = generator.normal(scale=thermal, size=(count, 3))
    weights = np.ones(count)
    if distance:
        # On a ring around the mother, where two springs hold the first node.
        start *= [1.5, 1.5, 0.0]
        radii = start[:, 1] + distance
        weights = radii * np.exp(0.5 * np.sum(start**2, axis=1) / (1.5 * thermal) ** 2)
        start[:, 1] = radii
    for rest_length, stiffness, on_mother, _ in springs[:-1] if distance else []:
        off = np.linalg.norm(start - [on_mother, 0.0, 0.0], axis=1) - rest_length
        weights *= np.exp(-0.5 * stiffness * off**2 / KT)
    axis = generator.normal(size=(count, 3))
    axis *= branching.lever / np.linalg.norm(axis, axis=1)[:, None]
    rest_length, stiffness, on_mother, _ = springs[-1]
    off = np.linalg.norm(start + axis - [on_mother, 0.0, 0.0], axis=1) - rest_length
    weights *= np.exp(-0.5 * stiffness * off**2 / KT)
    factors = np.exp(branching.stiffness * np.abs(np.linalg.norm(start, axis=1) - distance) / force)
    mean = np.average(factors, weights=weights)
    error = np.sqrt(np.sum((weights * (factors - mean)) ** 2)) / weights.sum()
    factor = branching.thermal_factor(TEMPERATURE)
    assert error < 0.01 * factor and abs(mean - factor) < 4.0 * error
    if distance == 0.0:
        for load in (0.5, 1.0, 3.0):
            pull = branching.stiffness * start + [load * force, 0.0, 0.0]
            loaded = np.exp(np.linalg.norm(pull, axis=1) / force).mean() / factor
            assert 0.98 * np.sinh(load) / load < loaded < 1.02 * np.exp(load)


def test_branches_let_go_by_the_law_of_bell():
    """At k exp(F/F_u)/m with the force of the spring at the first node, which is k on average without a load."""
    step, rate, force, steps = 1e5, 0.012, 10.0, 120
    options = {"debranching_rate": rate / step, "debranching_force": force}
    filaments, branching, _, context = branched(step, 4, 60, **options)
    factor = branching.thermal_factor(TEMPERATURE)
    expected, variance, of_branches = 0.0, 0.0, {}
    for _ in range(steps):
        found = joints_of(filaments, context)
        rates = rate * np.exp(branching.stiffness * found[:, 1] / force) / factor
        gone = 1.0 - np.exp(-rates)
        expected, variance = expected + gone.sum(), variance + (gone * (1.0 - gone)).sum()
        for branch, own in zip(found[:, 2], rates):
            of_branches.setdefault(branch, []).append(own)
        context.getIntegrator().step(1)
    state = filaments.in_context(context).growth()
    released = state.nucleated - len(joints_of(filaments, context))
    # Those that begin and let go in one step are a percent.
    assert abs(released - expected) < 4.0 * np.sqrt(variance) + 0.01 * expected
    assert factor > 3.0 and np.sqrt(variance) < 0.1 * expected
    # Branches that have just begun have springs without forces.
    sums = np.array([(sum(own[8:]), len(own[8:])) for own in of_branches.values() if len(own) > 8])
    mean = sums[:, 0].sum() / sums[:, 1].sum()
    error = np.sqrt(np.sum((sums[:, 0] - mean * sums[:, 1]) ** 2)) / sums[:, 1].sum()
    assert error < 0.0125 * rate and abs(mean - rate) < 4.0 * error


def test_branches_of_mothers_that_shrink():
    """Where a mother shrinks past a branch, it is let go, with all of its joint."""
    step = 1e4
    monomers = Monomers(length=MONOMER, plus_off_rate=2.0 / step)
    shrinks = Growth(monomers=monomers, pool=POOL, longest=1200.0, minus_capped=True, shortest=150.0)
    filaments, branching, _, context = branched(step, 6, 20, mother=shrinks)
    context.getIntegrator().step(100)
    table, state = filaments.in_context(context).linkers(), filaments.in_context(context).growth()
    there = (table.filaments >= 0).all(axis=1)
    assert there.sum() > 20 and (table.filaments >= 0).all(axis=1).sum() % 2 == 0
    mothers, along = table.filaments[there, 0], table.arc_lengths[there, 0]
    assert np.all(along <= MONOMER * state.monomers[mothers, 1])
    assert np.all(np.isin(mothers, range(6)))
    # Branches begin anywhere, and more are free by now than hold.
    by_type = [sorted(table.filaments[there & (table.types == kind), 1].tolist()) for kind in (0, 1)]
    assert by_type[0] == by_type[1] and len(by_type[0]) < (state.nodes[6:] > 0).sum() - 10


def test_joints_stay_on_parts_of_mothers_that_are_cut():
    step = 1e3
    severing = Severing(rate=0.02 / step / 1000.0)
    mother = Growth(
        monomers=STILL.monomers, pool=POOL, longest=1200.0, minus_capped=True, severing=severing, shortest=54.0
    )
    filaments = Filaments(WATER, TEMPERATURE)
    for number in range(6):
        filaments.add_equilibrium(ACTIN, 10, number + 1, start=[0, 0, 3000.0 * number], growth=mother)
    filaments.add_reserve(ACTIN, 40, growth=mother)
    branching = Branching(rate=20.0 / 1080.0 / step, length=189.0, mothers=list(range(6)))
    branch = Growth(monomers=STILL.monomers, pool=POOL, longest=250.0, minus_capped=True)
    filaments.add_reserve(ACTIN, 60, growth=branch, nucleation=branching)
    _, system, positions = filaments.build()
    integrator = filaments.create_integrator(system, step, random_seed=3, checks=False)
    context = openmm.Context(system, integrator, openmm.Platform.getPlatformByName("CPU"), {"Threads": "1"})
    context.setPositions(positions)
    integrator.step(100)
    table, state = filaments.in_context(context).linkers(), filaments.in_context(context).growth()
    there = (table.filaments >= 0).all(axis=1)
    assert state.severed > 5 and there.sum() > 60
    mothers, along = table.filaments[there, 0], table.arc_lengths[there, 0]
    first, last = MONOMER * state.monomers[mothers].T
    assert np.all((first <= along) & (along <= last)) and np.any(mothers >= 6)
    found = joints_of(filaments, context)
    assert np.max(found[:, 1]) < 5.0
    assert abs(np.rad2deg(found[:, 0].mean()) - 70.8) < 4.0 * 7.5 / np.sqrt(len(found))
