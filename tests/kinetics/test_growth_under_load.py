"""Filaments that grow against loads: where they stall, and how fast they push, beside closed forms."""

from dataclasses import replace

import numpy as np
import openmm
import pytest
from openmm import unit

from openmm_cylchain import (
    ACTIN_ATP,
    F_ACTIN,
    ContactWarning,
    Cylinder,
    Filaments,
    FilamentType,
    Growth,
    Monomers,
    Plane,
    capsule_contact_force,
    filament_wall_force,
)
from reproduce.ratchets import (
    KT,
    OFF_RATE,
    STALL,
    TEMPERATURE,
    Ratchet,
    exact_speed,
    speed_of_fast_obstacle,
    speed_of_slow_obstacle,
)

pytest.importorskip("openmm_cylchain.plugin")


@pytest.mark.parametrize("load", [0.5, 1.0, 3.0])
def test_the_master_equation_has_the_limits_of_fast_and_slow_obstacles(load):
    # Of a fast one however soft its contact is, of a slow one if it is hard.
    for stiffness in (1.0, 10.0):
        fast = Ratchet(load, diffusion=1e4, stiffness=stiffness)
        assert exact_speed(fast) == pytest.approx(speed_of_fast_obstacle(load), rel=0.002)
    # Monomers that come at a finite rate let it move farther, by some D^(1/2).
    slow = [Ratchet(load, diffusion, off_rate=0.0, stiffness=1e5) for diffusion in (1e-4, 4e-4)]
    shares = [exact_speed(one, 400) / speed_of_slow_obstacle(load, one.diffusion) for one in slow]
    assert 0.9 < shares[1] < shares[0] and 2.0 * shares[0] - shares[1] == pytest.approx(1.0, abs=0.005)
    assert exact_speed(Ratchet(STALL, 0.1)) == pytest.approx(0.0, abs=1e-6)


def stall(speeds_at, share=0.05):
    """The load at which ends stand still, over that of theory, with its error: from speeds at two loads about it."""
    below, above = (speeds_at(STALL * factor, seed) for factor, seed in ((1.0 - share, 1), (1.0 + share, 2)))
    slope = (below.mean() - above.mean()) / (2.0 * share * STALL)
    error = 0.5 * np.sqrt(below.var(ddof=1) / len(below) + above.var(ddof=1) / len(above)) / slope
    return 1.0 + 0.5 * (below.mean() + above.mean()) / slope / STALL, error / STALL


def test_an_end_stalls_at_the_force_of_theory():
    load, error = stall(lambda load, seed: Ratchet(load, step=0.5).speeds(40, 1000, seed))
    assert 4.0 * error < 0.06
    assert abs(load - 1.0) < 4.0 * error


@pytest.mark.sample("diffusion|'step': 1|obstacle.*step")
@pytest.mark.slow
@pytest.mark.parametrize(
    "options",
    [
        {},
        {"diffusion": 10.0},
        {"step": 1.0},
        {"obstacle": "rod"},
        {"monomer": 8.0 / 13.0},
        {"obstacle": "rod", "monomer": 8.0 / 13.0, "step": 0.5},
    ],
    ids=str,
)
def test_ends_stall_at_the_force_of_theory_whatever_they_push_and_in_which_steps(options):
    steps = round(4000 * min(1.0, (0.2 / options.get("step", 0.2)) ** 0.5))
    load, error = stall(lambda load, seed: replace(Ratchet(load), **options).speeds(100, steps, seed))
    assert 4.0 * error < 0.03
    assert abs(load - 1.0) < 4.0 * error


@pytest.mark.sample(r"^0\.5-(0\.1|10)|^1\.0-1\.0")
@pytest.mark.slow
@pytest.mark.parametrize("diffusion, stiffness", [(0.1, 40.0), (1.0, 4.0), (10.0, 4.0)])
@pytest.mark.parametrize("load", [0.5, 1.0])
def test_ends_push_at_the_speed_of_theory(load, diffusion, stiffness):
    ratchet = Ratchet(load, diffusion, stiffness=stiffness)
    speeds, exact = ratchet.speeds(100, 5000, 3), exact_speed(ratchet)
    error = speeds.std(ddof=1) / np.sqrt(len(speeds))
    # Monomers that come within a step do not see each other's obstacle move.
    assert 4.0 * error < 0.07 * exact
    assert abs(speeds.mean() - exact) < 0.05 * exact + 4.0 * error


def test_the_recommended_step_resolves_contacts_that_ends_push():
    filaments = Filaments(1e-3 * unit.pascal * unit.second, TEMPERATURE)
    growth = Growth(monomers=ACTIN_ATP, pool=unit.Quantity(5e-6, unit.molar), longest=2000.0)
    filaments.add_straight(F_ACTIN.with_segment_length(108.0), 10, [0, 0, 0], [1, 0, 0], growth=growth)
    _, system, _ = filaments.build()
    sphere, friction, stiffness = system.addParticle(1.0), 100.0, 3.0
    options = {"particles": [sphere], "particle_diameter": 1000.0}
    system.addForce(capsule_contact_force(filaments, system, 7.0, stiffness, **options))
    found = filaments.recommended_time_step(system=system, particle_friction=friction)
    (name,) = (name for name in found.allowed if "hard contacts" in name)
    # So far does a force move the sphere, which moves more easily than the end.
    assert 2.0 * stiffness * found.allowed[name] / friction == pytest.approx(18.0)
    with pytest.warns(ContactWarning, match="for hard ones"):
        filaments.create_integrator(system, 1.01 * found.allowed[name], particle_friction=friction)


DELTA, PER_SEGMENT, SEGMENTS = 2.7, 40, 3


@pytest.mark.slow
@pytest.mark.parametrize("step", [0.2, 0.5])
def test_rods_that_propel_themselves_against_a_wall_grow_until_they_push_with_the_force_of_theory(step):
    """The more monomers a rod has, the harder it pushes: P(N) ~ z^N exp(-a N^2/2) if each monomer pushes with a."""
    filaments = Filaments(1.0 * unit.pascal * unit.second, TEMPERATURE)
    rod = FilamentType(
        name="ROD", diameter=7.0, bending_rigidity=1e9 * KT, stretching_modulus=1e5, segment_length=PER_SEGMENT * DELTA
    )
    mean = PER_SEGMENT * SEGMENTS
    friction = rod.segment_friction(filaments.viscosity, TEMPERATURE, 1).parallel * SEGMENTS
    rate = KT / friction / DELTA**2
    monomers = Monomers(length=DELTA, plus_on_rate=rate, plus_off_rate=OFF_RATE * rate)
    growth = Growth(monomers=monomers, pool=1.0, longest=2.0 * mean * DELTA, shortest=100.0, minus_capped=True)
    start, push = [mean * DELTA + 3.0, 0, 0], STALL / mean
    for _ in range(100):
        options = {"growth": growth, "propulsion": push * PER_SEGMENT * KT / DELTA}
        filaments.add_straight(rod, SEGMENTS, start, [-1, 0, 0], **options)
    _, system, positions = filaments.build()
    for shape in (Plane([0, 0, 0], [1, 0, 0]), Cylinder([0, 0, 0], [1, 0, 0], 10.0)):
        system.addForce(filament_wall_force(filaments, system, shape, 4.0 * KT / DELTA**2))
    integrator = filaments.create_integrator(system, step / rate, random_seed=1, checks=False)
    context = openmm.Context(system, integrator, openmm.Platform.getPlatform("CPU"), {"Threads": "1"})
    context.setPositions(positions)
    found = []
    for _ in range(30):
        integrator.step(round(50 / step))
        numbers = filaments.in_context(context).growth().monomers
        found.append(numbers[:, 1] - numbers[:, 0])
    # A rod forgets how long it was within some 600/(k_on c).
    means = np.mean(found[10:], axis=0)
    error = means.std(ddof=1) / np.sqrt(len(means))
    numbers = np.arange(40, 200)
    weights = np.exp(STALL * numbers - 0.5 * push * numbers**2 - 0.5 * STALL * mean)
    expected = np.average(numbers, weights=weights)
    assert 4.0 * error < 0.04 * expected
    assert abs(means.mean() - expected) < 4.0 * error


def speeds_of_rods_between_a_wall_and_an_obstacle(load, seed, diffusion, step, copies=60, duration=1000.0):
    """Rods that slide along cylinders, behind them a wall and before them spheres, as large as planes, under a load."""
    filaments = Filaments(1.0 * unit.pascal * unit.second, TEMPERATURE)
    rod = FilamentType(
        name="ROD", diameter=7.0, bending_rigidity=1e9 * KT, stretching_modulus=1e6, segment_length=PER_SEGMENT * DELTA
    )
    friction = 4 * rod.segment_friction(filaments.viscosity, TEMPERATURE, 1).parallel
    rate, length, sphere, diameter = KT / friction / diffusion / DELTA**2, 4 * PER_SEGMENT * DELTA, 6000.0, 30.0
    monomers = Monomers(length=DELTA, plus_on_rate=rate, plus_off_rate=OFF_RATE * rate)
    growth = Growth(monomers=monomers, pool=1.0, longest=10 * length, shortest=173.0, minus_capped=True)
    apart = 1.5 * sphere * np.arange(copies)
    for y in apart:
        filaments.add_straight(rod, 4, [0, y, 0], [1, 0, 0], growth=growth)
    _, system, positions = filaments.build()
    spheres = [system.addParticle(1.0) for _ in apart]
    gaps = np.random.default_rng(seed).exponential(DELTA / load, copies)
    centres = np.stack([length + 0.5 * (sphere + diameter) + gaps, apart, 0.0 * gaps], axis=1)
    positions = np.concatenate([positions._value, centres])
    pressed = openmm.CustomExternalForce("load*x+0.5*stiffness*((y-y0)^2+z^2)")
    pressed.addGlobalParameter("load", load * KT / DELTA)
    pressed.addGlobalParameter("stiffness", friction * diffusion * rate / step / 20.0)
    pressed.addPerParticleParameter("y0")
    for particle, y in zip(spheres, apart):
        pressed.addParticle(particle, [y])
    system.addForce(pressed)
    stiffness, obstacles = 4.0 * KT / DELTA**2, {"particles": spheres, "particle_diameter": sphere}
    system.addForce(capsule_contact_force(filaments, system, diameter, stiffness, **obstacles))
    system.addForce(filament_wall_force(filaments, system, Plane([0, 0, 0], [1, 0, 0]), stiffness))
    for number, y in enumerate(apart):
        tube = Cylinder([0, y, 0], [1, 0, 0], 8.0)
        system.addForce(filament_wall_force(filaments, system, tube, 0.5 * KT, numbers=[number]))
    options = {"random_seed": seed, "checks": False, "particle_friction": friction * diffusion}
    integrator = filaments.create_integrator(system, step / rate, **options)
    context = openmm.Context(system, integrator, openmm.Platform.getPlatform("CPU"), {"Threads": "1"})
    context.setPositions(positions)
    here, steps = filaments.in_context(context), round(duration / step)
    integrator.step(steps // 10)
    before = here.growth().monomers
    integrator.step(steps)
    return (here.growth().monomers - before)[:, 1] / duration


@pytest.mark.slow
@pytest.mark.parametrize("step", [0.2, 0.05])
def test_rods_that_are_pressed_at_both_ends_stall_at_the_force_of_theory(step):
    """Nothing holds the rod but two contacts: one pushes the other one shut."""
    load, error = stall(lambda load, seed: speeds_of_rods_between_a_wall_and_an_obstacle(load, seed, 1.0, step))
    assert 4.0 * error < 0.035
    assert abs(load - 1.0) < 4.0 * error
