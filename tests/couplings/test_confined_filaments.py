"""Filaments that walls press into narrow slabs, in steps in which bends of half a segment relax: how they are bent."""

import numpy as np
import pytest
from scipy.fft import dst

from openmm_cylchain import Filaments, FilamentType, Slab, filament_wall_force
from support.contexts import new_context, positions_of
from support.slab_draws import draw_heights
from support.solvent import KT, TEMPERATURE

PICONEWTON = 0.602214
LENGTH, SEGMENTS, RIGIDITY = 50.0, 20, 0.06e6 * PICONEWTON
ACTIN = FilamentType(
    name="ACT",
    diameter=6.0,
    bending_rigidity=RIGIDITY,
    temperature=TEMPERATURE,
    stretching_modulus=4.37e4 * PICONEWTON,
    segment_length=LENGTH,
    friction_length="filament",
)
# Of cytoplasm for filaments of 1 um, in kJ ps/(mol nm^3): 1 Pa s.
VISCOSITY = 1e3 * 602.214
THICKNESS, STIFFNESS = 12.0, 0.8 * PICONEWTON


def _modes(heights):
    """Mean squares of bends in modes: the first, the second, the third, the others."""
    squares = np.mean(dst(np.diff(heights, n=2, axis=-1), axis=-1, type=1, norm="ortho") ** 2, axis=0)
    return np.array([squares[0], squares[1], squares[2], squares[3:].mean()])


def _bends_in_steps(step, steps, count):
    """Modes of filaments that begin in equilibrium, each over that of equilibrium, and standard errors of these."""
    start = draw_heights(SEGMENTS, LENGTH, RIGIDITY / KT, THICKNESS, STIFFNESS / KT, count, seed=7)
    filaments = Filaments(VISCOSITY, TEMPERATURE)
    for number in range(count):
        filaments.add_straight(ACTIN, SEGMENTS, [0, 100 * number, 0], [1, 0, 0])
    _, system, positions = filaments.build()
    positions, nodes = positions._value.copy(), np.array(filaments.node_indices)
    positions[nodes, 2] = start
    system.addForce(filament_wall_force(filaments, system, Slab([0, 0, 0], [0, 0, 1], THICKNESS), STIFFNESS))
    integrator = filaments.create_integrator(system, step, random_seed=1, checks=False)
    context = new_context(system, positions, integrator, "CPU", {"Threads": "1"})
    integrator.step(steps // 8)
    found = []
    for _ in range(steps):
        integrator.step(1)
        found.append(_modes(positions_of(context)[nodes, 2]))
    assert integrator.getNumDividedSteps() == 0
    blocks = np.array([block.mean(axis=0) for block in np.array_split(found, 10)])
    return blocks.mean(axis=0), blocks.std(axis=0, ddof=1) / np.sqrt(len(blocks))


@pytest.mark.slow
@pytest.mark.parametrize(("milliseconds", "steps"), [(5.0, 200), (1.0, 150), (0.2, 1500)])
def test_bends_between_walls(milliseconds, steps):
    """Against draws from equilibrium, which NumPy makes. Steps of any length are within 8 % of it."""
    drawn = _modes(draw_heights(SEGMENTS, LENGTH, RIGIDITY / KT, THICKNESS, STIFFNESS / KT, 40000, seed=3))
    found, errors = _bends_in_steps(1e9 * milliseconds, steps, 200)
    # The fourth is the mean of all modes but three.
    bound = np.array([0.08, 0.08, 0.08, 0.035])
    assert np.all(4 * errors / drawn < 1.2 * bound)
    assert np.all(np.abs(found / drawn - 1.0) < bound + 4 * errors / drawn)
