"""Ends with states: monomers that age, and caps of two units, against theory and a simulation of their own."""

from types import SimpleNamespace

import numpy as np
import openmm
import pytest
import scipy.stats
from openmm import unit

from openmm_cylchain import (
    F_ACTIN,
    DynamicInstability,
    EndStates,
    Filaments,
    Growth,
    InputError,
    MonomerPool,
    Monomers,
    MonomerState,
    Nucleation,
    Sphere,
    TwoUnitCap,
)
from openmm_cylchain.kinetics.growth_force import find_growth_force
from openmm_cylchain.runs.steady_populations import steady_population
from support.contexts import new_context

pytest.importorskip("openmm_cylchain.plugin")

TEMPERATURE, WATER = 300.0, 1e-3 * unit.pascal * unit.second
MONOMER, PER_SEGMENT = 2.7, 40
ACTIN = F_ACTIN.with_segment_length(PER_SEGMENT * MONOMER)
POOL = MonomerPool(1e-4)
STEP = 1e7
FEWEST = 4


def contexts_of(growth, count, segments, step=STEP):
    filaments = Filaments(WATER, TEMPERATURE)
    for number in range(count):
        filaments.add_straight(ACTIN, segments, [0, 0, 50.0 * number], [1, 0, 0], growth=growth)
    return filaments, context_of(filaments, step)


def context_of(filaments, step=STEP):
    _, system, positions = filaments.build()
    integrator = filaments.create_integrator(system, step, random_seed=3, checks=False)
    return new_context(system, positions, integrator, "CPU", {"Threads": "1"})


def mean_within(samples, expected, bias):
    """The mean of samples is as expected; their error is so small that a bias would show."""
    samples = np.asarray(samples, dtype=float)
    error = samples.std(ddof=1) / np.sqrt(len(samples))
    assert error < bias * abs(expected) / 4.0, (samples.mean(), expected, error)
    assert abs(samples.mean() - expected) < 4.0 * error, (samples.mean(), expected, error)


def simulated_aging(gain, losses, aging, count, monomers, steps, most, parts=200):
    """Filaments whose monomers age: plus ends gain and lose as what is last there; rates are per step.

    Of what each end has moved by after so many steps, (count, 2), minus and plus; gain is that of the plus end, and
    losses are those of the minus and the plus end in each state.
    """
    generator = np.random.default_rng(11)
    ripe = np.full((len(aging), count, most), -1.0)
    first, last = np.full(count, most // 4), np.full(count, most // 4 + monomers)
    which, moved = np.arange(count), np.zeros((count, 2), dtype=int)
    for part in range(steps * parts):
        now = part / parts
        state = [np.sum(ripe[:, which, end] < now, axis=0) for end in (first, last - 1)]
        chances = generator.uniform(size=(3, count)) * parts
        lost_minus, lost_plus = (chances[end] < losses[end][state[end]] for end in (0, 1))
        gained = chances[2] < gain
        first, last = first + lost_minus, last - lost_plus
        moved += np.column_stack([-1 * lost_minus, gained.astype(int) - lost_plus])
        new = np.flatnonzero(gained)
        ripe[:, new, last[new]] = now + np.cumsum(
            generator.exponential(1.0 / aging[:, None], (len(aging), len(new))), 0
        )
        last = last + gained
    return moved


@pytest.mark.parametrize(
    ("count", "steps"),
    [(400, 12), pytest.param(3000, 30, marks=pytest.mark.slow)],
)
def test_ends_of_monomers_that_age(count, steps):
    """Both ends gain and lose as a simulation of a few lines does; monomers of the start are old."""
    gain, losses, aging = 2.0, np.array([[0.1, 0.05, 0.5], [0.1, 0.3, 6.0]]), np.array([2.0, 1.0])
    states = [
        MonomerState(
            name=f"state {number}",
            rate=aging[number] / STEP,
            minus_off_rate=losses[0, number + 1] / STEP,
            plus_off_rate=losses[1, number + 1] / STEP,
        )
        for number in (0, 1)
    ]
    monomers = Monomers(
        length=MONOMER,
        plus_on_rate=gain / STEP / POOL.concentration,
        plus_off_rate=losses[1, 0] / STEP,
        minus_off_rate=losses[0, 0] / STEP,
        aging=states,
    )
    filaments, context = contexts_of(Growth(monomers=monomers, pool=POOL, longest=1500.0), count, 4)
    context.getIntegrator().step(steps)
    found = filaments.in_context(context).growth()
    moved = (found.gained - found.lost).astype(float)
    expected = simulated_aging(gain, losses, aging, count, 4 * PER_SEGMENT, steps, 800)
    for end in (0, 1):
        error = np.hypot(*(own[:, end].std(ddof=1) / np.sqrt(count) for own in (moved, expected)))
        assert abs(moved[:, end].mean() - expected[:, end].mean()) < 4.0 * error, (end, moved[:, end].mean(), error)
        spread = expected[:, end].var(ddof=1)
        assert moved[:, end].var(ddof=1) == pytest.approx(spread, rel=4.0 * np.sqrt(4.0 / count))
    # An end whose monomers were all new, or all old, would be far from that.
    error = moved[:, 1].std() / np.sqrt(count)
    for state in (0, 2):
        assert abs(steps * (gain - losses[1, state]) - moved[:, 1].mean()) > 8.0 * error
    assert np.all(found.end_states[:, 0] == 2) and set(found.end_states[:, 1]) == {0, 1, 2}


@pytest.mark.parametrize(("count", "steps"), [(100, 300), pytest.param(400, 1000, marks=pytest.mark.slow)])
def test_caps_of_two_units(count, steps):
    """The mean time to a catastrophe, 1/h + (g+h)^2/(h^2 (3g+2h)), from the rate of their cycles with fast rescues."""
    gain, hydrolysis, rescue = 3.0, 1.0, 2.0
    cap = TwoUnitCap(hydrolysis_rate=hydrolysis / STEP, shrinking_off_rate=100.0 / STEP, rescue_rate=rescue / STEP)
    monomers = Monomers(length=MONOMER, plus_on_rate=gain / STEP / POOL.concentration)
    growth = Growth(monomers=monomers, pool=POOL, longest=500.0, plus_instability=cap, minus_capped=True)
    filaments, context = contexts_of(growth, count, 1)
    context.getIntegrator().step(20)
    before = filaments.in_context(context).growth().catastrophes[:, 1]
    context.getIntegrator().step(steps)
    found = filaments.in_context(context).growth()
    mean = 1.0 / hydrolysis + (gain + hydrolysis) ** 2 / (hydrolysis**2 * (3.0 * gain + 2.0 * hydrolysis))
    mean_within(found.catastrophes[:, 1] - before, steps / (mean + 1.0 / rescue), 0.05)
    assert 0.1 < found.shrinking[:, 1].mean() < 0.3


def test_models_of_states():
    """A gain that changes the state, and a state that is left by itself: shares of the states in the long run."""
    states = EndStates(
        on_rates=np.array([2.0, 0.0, 0.0]) / STEP / POOL.concentration,
        off_rates=np.array([0.0, 0.0, 1.0]) / STEP,
        switch_rates=np.array([[0.0, 0.0, 0.0], [0.0, 0.0, 0.5], [3.0, 0.0, 0.0]]) / STEP,
        after_gain=[1, 1, 2],
        after_loss=[0, 1, 0],
        names=["open", "shut", "loose"],
    )
    monomers = Monomers(length=MONOMER)
    growth = Growth(monomers=monomers, pool=POOL, longest=1200.0, plus_instability=states, minus_capped=True)
    filaments, context = contexts_of(growth, 200, 4)
    shares = np.zeros(3)
    context.getIntegrator().step(20)
    before = filaments.in_context(context).growth()
    for _ in range(40):
        context.getIntegrator().step(5)
        found = filaments.in_context(context).growth()
        shares += np.bincount(found.end_states[:, 1], minlength=3) / (200.0 * 40.0)
    # Each cycle is 1/2 open, 2 shut and 1/4 loose, and gains a monomer; it loses it with the chance 1/4.
    np.testing.assert_allclose(shares, np.array([0.5, 2.0, 0.25]) / 2.75, atol=0.02)
    mean_within((found.gained - before.gained)[:, 1], 200.0 / 2.75, 0.05)
    mean_within((found.lost - before.lost)[:, 1], 200.0 / 2.75 / 4.0, 0.12)
    assert states.net_rate(POOL.concentration) * STEP == pytest.approx(0.75 / 2.75)


def turning(**options):
    """Ends that gain 40 monomers per step, turn as often as options say, and shrink to nothing at once."""
    return DynamicInstability(
        catastrophe_rate=options.pop("rate", 0.4) / STEP, rescue_rate=0.0, shrinking_off_rate=4e4 / STEP, **options
    )


def growing_until_it_turns(instability, longest):
    monomers = Monomers(length=MONOMER, plus_on_rate=40.0 / STEP / POOL.concentration)
    return Growth(
        monomers=monomers,
        pool=POOL,
        longest=longest,
        shortest=FEWEST * MONOMER,
        plus_instability=instability,
        minus_capped=True,
        vanishes=True,
    )


def test_catastrophes_that_come_with_the_length():
    # With the rate a L at the length L, lengths are distributed as exp(-a L^2/2v) while filaments grow at v: a normal
    # distribution from the fewest monomers on.
    growth = growing_until_it_turns(turning(catastrophe_length=100 * MONOMER), longest=700 * MONOMER)
    nucleation = Nucleation(rate=40.0 / STEP, region=Sphere([0, 0, 0], 500.0))
    group = SimpleNamespace(type=ACTIN, growth=growth, nucleation=nucleation)
    expected = steady_population([group], None, POOL.concentration)
    deviation = np.sqrt(40.0 / 0.004)
    normal = scipy.stats.norm.pdf(FEWEST / deviation) / scipy.stats.norm.sf(FEWEST / deviation) * deviation
    assert expected.length / MONOMER == pytest.approx(normal, rel=0.01)
    filaments = Filaments(WATER, TEMPERATURE)
    filaments.add_reserve(ACTIN, 250, growth=growth, nucleation=nucleation)
    context = context_of(filaments)
    context.getIntegrator().step(20)
    lengths, numbers = [], []
    for _ in range(45):
        context.getIntegrator().step(8)
        state = filaments.in_context(context).growth()
        there = state.nodes > 0
        numbers.append(there.sum())
        lengths.append(state.lengths._value[there].mean())
    assert state.without_place == 0
    mean_within(lengths, expected.length, 0.06)
    mean_within(numbers, expected.number, 0.06)


@pytest.mark.parametrize("step", [1.0, *(pytest.param(own, marks=pytest.mark.slow) for own in (10.0, 0.1))])
def test_filaments_that_begin_anew_where_they_are_shortest(step):
    """With gains g, losses s, f, r, and nu at the shortest: P(growing, n) ~ rho^n, P(shrinking, n+1) ~ (g/s) rho^n.

    rho = g (s + r)/(s (g + f)), and P(shrinking, 0) ~ (g + f)/nu, which the balance of each number of monomers gives.
    """
    g, s, f, r, nu = 8.0, 16.0, 0.8, 0.2, 0.5
    instability = DynamicInstability(
        catastrophe_rate=f / STEP, rescue_rate=r / STEP, shrinking_off_rate=s / STEP, renucleation_rate=nu / STEP
    )
    growth = Growth(
        monomers=Monomers(length=MONOMER, plus_on_rate=g / STEP / POOL.concentration),
        pool=POOL,
        longest=900.0,
        shortest=FEWEST * MONOMER,
        plus_instability=instability,
        minus_capped=True,
    )
    filaments, context = contexts_of(growth, 300, 1, step * STEP)
    context.getIntegrator().step(round(40 / step))
    waiting, mean, far = [], [], []
    for _ in range(100):
        context.getIntegrator().step(round(10 / step))
        state = filaments.in_context(context).growth()
        more, shrinks = np.rint(state.lengths._value / MONOMER) - FEWEST, state.end_states[:, 1] == 1
        waiting.append(np.mean((more == 0) & shrinks))
        mean.append(more.mean())
        far.append(np.mean((more >= 5) & ~shrinks))
    rho = g * (s + r) / (s * (g + f))
    weights = (g + f) / nu, 1.0 / (1.0 - rho), g / s / (1.0 - rho)
    mean_within(waiting, weights[0] / sum(weights), 0.05)
    mean_within(far, weights[1] * rho**5 / sum(weights), 0.05)
    growing = rho / (1.0 - rho)
    mean_within(mean, (weights[1] * growing + weights[2] * (growing + 1.0)) / sum(weights), 0.05)
    assert state.waited.sum() == 0
    # In the limit of small monomers, as the docstring says.
    length = g * s / (s * f - g * r)
    assert 1.0 / (1.0 + nu * length * (1.0 / g + 1.0 / s)) == pytest.approx(weights[0] / sum(weights), rel=0.1)


@pytest.mark.parametrize("deterministic", [False, True])
def test_waiting_times_at_the_shortest_length_are_exponential(deterministic):
    """From the checkpoint of a moment on again to the bit; longer filaments have no such rate."""
    states = EndStates(
        on_rates=[0.0, 0.0],
        off_rates=[3.0 / STEP, 0.0],
        switch_rates=[[0.0, 0.0], [0.0, 0.0]],
        shortest_switch_rates=[[0.0, 0.25 / STEP], [0.0, 0.0]],
    )
    own = dict(monomers=Monomers(length=MONOMER), pool=POOL, longest=900.0, plus_instability=states)
    own |= dict(minus_capped=True, deterministic=deterministic)
    filaments = Filaments(WATER, TEMPERATURE)
    growths = [Growth(**own, shortest=PER_SEGMENT * MONOMER), Growth(**own, shortest=FEWEST * MONOMER)]
    for number in range(1000):
        filaments.add_straight(ACTIN, 1, [0, 0, 50.0 * number], [1, 0, 0], growth=growths[number % 2])
    context = context_of(filaments)
    shares = []
    for step in range(1, 9):
        if step == 4:
            checkpoint = context.createCheckpoint()
        context.getIntegrator().step(1)
        now = filaments.in_context(context).growth().end_states[:, 1]
        shares.append(np.mean(now[::2] == 0))
        # The others need 36 losses first, of 3 in a step.
        assert step > 4 or not now[1::2].any()
    expected = np.exp(-0.25 * np.arange(1, 9))
    errors = np.sqrt(expected * (1.0 - expected) / 500)
    assert np.all(np.abs(shares - expected) < 4.0 * errors) and np.all(4.0 * errors < 0.3 * expected + 0.05)
    context.getIntegrator().step(8)
    found = filaments.in_context(context).growth()
    if deterministic:
        # 12 of 16 steps until they are the shortest.
        assert found.end_states[1::2, 1].mean() == pytest.approx(1.0 - np.exp(-1.0), abs=4.0 * 0.022)
    context.loadCheckpoint(checkpoint)
    context.getIntegrator().step(13)
    again = filaments.in_context(context).growth()
    assert np.array_equal(found.end_states, again.end_states) and np.array_equal(found.lengths, again.lengths)


def test_filaments_that_vanish_may_be_saved_by_beginning_anew():
    """The steady population against one that is counted: at the shortest, a monomer is lost or growth begins again."""
    turns = DynamicInstability(
        catastrophe_rate=0.4 / STEP,
        rescue_rate=0.0,
        shrinking_off_rate=40.0 / STEP,
        renucleation_rate=60.0 / STEP,
    )
    growth = growing_until_it_turns(turns, longest=900 * MONOMER)
    nucleation = Nucleation(rate=8.0 / STEP, region=Sphere([0, 0, 0], 500.0))
    group = SimpleNamespace(type=ACTIN, growth=growth, nucleation=nucleation)
    expected = steady_population([group], None, POOL.concentration)
    # At the shortest with the chance 0.6 it grows on: 1/0.4 lives of 1/f + 1/f, but for what it takes to vanish.
    assert expected.number == pytest.approx(8.0 * 2.5 * (2.0 / 0.4 + 1.0 / 100.0), rel=0.01)
    filaments = Filaments(WATER, TEMPERATURE)
    filaments.add_reserve(ACTIN, 250, growth=growth, nucleation=nucleation)
    context = context_of(filaments)
    context.getIntegrator().step(60)
    numbers = []
    for _ in range(40):
        context.getIntegrator().step(15)
        state = filaments.in_context(context).growth()
        numbers.append((state.nodes > 0).sum())
    assert state.without_place == 0
    mean_within(numbers, expected.number, 0.08)


@pytest.mark.parametrize(
    ("options", "message"),
    [
        (dict(blocked_catastrophe_rate=0.1 / STEP), "must not be below"),
        (dict(renucleation_rate=-1.0), "renucleation_rate"),
        (dict(blocked_catastrophe_rate=60.0 / STEP), "only .* monomers/s come"),
        (dict(blocked_catastrophe_rate=float("nan")), "blocked_catastrophe_rate"),
        (dict(catastrophe_length=0.0), "catastrophe_length"),
    ],
)
def test_wrong_catastrophes_are_refused(options, message):
    with pytest.raises(InputError, match=message):
        growing_until_it_turns(turning(**options), longest=700 * MONOMER)


def test_a_system_keeps_what_rates_of_ends_depend_on():
    both = turning(catastrophe_length=300.0, blocked_catastrophe_rate=2.0 / STEP, renucleation_rate=0.3 / STEP)
    filaments = Filaments(WATER, TEMPERATURE)
    filaments.add_straight(ACTIN, 3, [0, 0, 0], [1, 0, 0], growth=growing_until_it_turns(both, longest=700 * MONOMER))
    _, system, _ = filaments.build()
    text = openmm.XmlSerializer.serialize(system)
    assert openmm.XmlSerializer.serialize(openmm.XmlSerializer.deserialize(text)) == text
    again = openmm.XmlSerializer.deserialize(text)
    force = find_growth_force(again)
    assert force.getSwitchingOfShortest(0, 1) == pytest.approx((0.0, 0.0, 0.3 / STEP, 0.0))
    lengths, blocked = force.getEndSwitching(0, 1)
    assert lengths == (300.0, 0.0) and blocked == pytest.approx((0.0, 1.6 / STEP, 0.0, 0.0))
