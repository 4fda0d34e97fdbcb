"""What motors make of filaments, which no equilibrium does: bundles that shorten, and asters."""

from dataclasses import replace

import numpy as np
import pytest
from openmm import unit
from scipy.spatial import cKDTree

from benchmark.kinetic_systems import BundleSystem, create_bundle, relaxed_positions
from openmm_cylchain import MICROTUBULE, Crosslinker, Cylinder, Filaments, Hand, filament_wall_force
from support.contexts import new_context, positions_of

MILLISECOND = 1e3
BUNDLE = BundleSystem(filaments=20, motors=267, crosslinkers=67, length=3000.0)


def _shortening(system, positions, step, seeds):
    """By which part a bundle shortens in 2 s, for each seed."""
    parts = []
    for seed in seeds:
        bundle = create_bundle(system, step * MILLISECOND, seed=seed, positions=positions)
        start = bundle.length()
        bundle.integrator.step(round(2000.0 / step))
        parts.append(1.0 - bundle.length() / start)
    return np.array(parts)


@pytest.mark.slow
def test_motors_shorten_a_bundle_and_crosslinkers_alone_do_not():
    """As fast in steps of 2.5 ms as in steps of 0.8 ms, which resolve contacts, within what seeds differ by."""
    positions = relaxed_positions(BUNDLE, 100)
    with_motors = _shortening(BUNDLE, positions, 2.5, range(1, 9))
    in_short_steps = _shortening(BUNDLE, positions, 0.8, range(31, 33))
    without = _shortening(replace(BUNDLE, speed=0.0), positions, 2.5, range(1, 4))
    error = np.sqrt(with_motors.var(ddof=1) * (1 / len(with_motors) + 1 / len(in_short_steps)))
    assert with_motors.mean() > 0.1
    assert abs(without.mean()) < 0.25 * with_motors.mean()
    assert 3 * error < with_motors.mean()
    assert abs(with_motors.mean() - in_short_steps.mean()) < 3 * error


BEAM = replace(MICROTUBULE, segment_length=1000.0, extension_relaxation_time=None, element="beam")


def _disc(at_end, kind, segments, seed):
    """Microtubules at random in a disc, and motors that walk to their plus ends."""
    count, length, radius = 30, kind.segment_length, 2200.0
    generator = np.random.default_rng(3)
    filaments = Filaments(0.05 * unit.pascal * unit.second, 310.0)
    for number in range(count):
        angle, turn = generator.uniform(0, 2 * np.pi, 2)
        middle = 0.7 * radius * np.sqrt(generator.uniform()) * np.array([np.cos(angle), np.sin(angle), 0])
        direction = np.array([np.cos(turn), np.sin(turn), 0])
        start = middle - 0.5 * segments * length * direction
        filaments.add_equilibrium(kind, segments, number, start, direction, planar=True)
    head = Hand(
        binding_rate=10 / unit.second,
        reach=60 * unit.nanometer,
        unbinding_rate=0.2 / unit.second,
        speed=0.5 * unit.micrometer / unit.second,
        stall_force=5 * unit.piconewton,
        at_end=at_end,
    )
    motor = Crosslinker(hands=head, stiffness=0.02 * unit.piconewton / unit.nanometer)
    filaments.add_linkers(motor, 500, volume=np.pi * radius**2 * 500.0)
    _, system, positions = filaments.build()
    wall = Cylinder([0, 0, 0], [0, 0, 1], radius)
    system.addForce(filament_wall_force(filaments, system, wall, 0.1 * unit.piconewton / unit.nanometer))
    integrator = filaments.create_integrator(system, 4 * unit.millisecond, random_seed=seed, checks=False)
    return filaments, new_context(system, positions, integrator, "CPU", {"Threads": "1"})


def _neighbours(ends):
    """How many other ends are within 300 nm of an end, on average."""
    return 2 * len(cKDTree(ends).query_pairs(300.0)) / len(ends)


@pytest.mark.parametrize(
    ("kind", "segments"),
    [(MICROTUBULE.with_segment_length(500.0), 4), pytest.param(BEAM, 2, marks=pytest.mark.slow)],
    ids=["straight", "beam"],
)
def test_motors_that_hold_at_ends_make_an_aster(kind, segments):
    """The plus ends of filaments at random come together; minus ends do not, nor do plus ends that motors leave."""
    found = {}
    for at_end in ("hold", "release"):
        counts = []
        for seed in (1, 2, 3):
            filaments, context = _disc(at_end, kind, segments, seed)
            nodes = np.array(filaments.node_indices)
            first = positions_of(context)[nodes]
            context.getIntegrator().step(1000)
            last = positions_of(context)[nodes]
            counts.append([_neighbours(shape[:, end]) for shape in (first, last) for end in (-1, 0)])
        found[at_end] = np.mean(counts, axis=0)
    plus_before, minus_before, plus, minus = found["hold"]
    assert plus > 8.0 > 1.0 > max(plus_before, minus_before)
    assert plus > 4.0 * max(minus, found["release"][2])
