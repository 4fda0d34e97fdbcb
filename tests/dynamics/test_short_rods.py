"""Short free filaments at steps from far below to far above the times in which they turn and bend."""

import numpy as np
import openmm
import pytest
from openmm import unit

from openmm_cylchain import F_ACTIN, Filaments

pytest.importorskip("openmm_cylchain.plugin")

TEMPERATURE, WATER = 300.0, 1e-3 * unit.pascal * unit.second
KT = 0.00831446261815324 * TEMPERATURE
MICROSECOND = 1e6


def trajectory(length, segments, step, count, frames, per_frame=1):
    """Positions (frames, count, nodes, 3) of free filaments that begin in equilibrium, and their description."""
    kind = F_ACTIN.with_segment_length(length / segments)
    filaments = Filaments(WATER, TEMPERATURE)
    for number in range(count):
        filaments.add_equilibrium(kind, segments, number + 1)
    _, system, positions = filaments.build()
    integrator = filaments.create_integrator(system, step, random_seed=9, checks=False)
    context = openmm.Context(system, integrator, openmm.Platform.getPlatformByName("CPU"), {"Threads": "1"})
    context.setPositions(positions)
    found = [positions._value]
    for _ in range(frames):
        integrator.step(per_frame)
        found.append(context.getState(positions=True).getPositions(asNumpy=True)._value)
    return np.array(found).reshape(frames + 1, count, segments + 1, 3), filaments


def mean_within(samples, expected, bias):
    """The mean of independent samples is as expected; their error is so small that a bias would show."""
    samples = np.asarray(samples, dtype=float)
    error = samples.std(ddof=1) / np.sqrt(len(samples))
    assert error < bias * abs(expected) / 4.0, (samples.mean(), expected, error)
    assert abs(samples.mean() - expected) < 4.0 * error, (samples.mean(), expected, error)


STEPS = [1.0, 30.0, 1000.0, pytest.param(10000.0, marks=pytest.mark.slow)]


@pytest.mark.parametrize("microseconds", STEPS)
@pytest.mark.parametrize(("length", "segments"), [(54.0, 1), (108.0, 1), (108.0, 2)])
def test_diffusion_and_energies(length, segments, microseconds):
    """The middle of a filament diffuses with k_BT (1/zeta_par + 2/zeta_perp)/3 of all of it, however long a step is.

    A rod turns by exp(-2 D_r t); lengths and bends keep their energies.
    """
    step, count, frames = microseconds * MICROSECOND, 250, 12
    positions, filaments = trajectory(length, segments, step, count, frames)
    kind = filaments[0].type
    friction = kind.segment_friction(filaments.viscosity, TEMPERATURE, segments)
    diffusion = KT * (1.0 / friction.parallel + 2.0 / friction.perpendicular) / 3.0 / segments
    middles = 0.5 * (positions[:, :, 1:] + positions[:, :, :-1]).mean(axis=2)
    squares = np.sum(np.diff(middles, axis=0) ** 2, axis=2)
    mean_within(squares.mean(axis=0), 6.0 * diffusion * step, 0.08)
    # From the start to the end.
    whole = np.sum((middles[-1] - middles[0]) ** 2, axis=1)
    mean_within(whole, 6.0 * diffusion * step * frames, 0.25)
    energies = np.array([[own.energies(frame[i]) for i, own in enumerate(filaments)] for frame in positions[2:]])
    mean_within(energies[..., 0].mean(axis=0) / KT, 0.5 * segments, 0.15)
    if segments > 1:
        mean_within(energies[..., 1].mean(axis=0) / KT, segments - 1.0, 0.15)
        return
    axes = positions[:, :, 1] - positions[:, :, 0]
    axes /= np.linalg.norm(axes, axis=2)[..., None]
    decay = np.exp(-2.0 * KT / friction.rotational * step)
    cosines = np.sum(axes[1:] * axes[:-1], axis=2)
    mean_within(1.0 - cosines.mean(axis=0), 1.0 - decay, 0.1)
