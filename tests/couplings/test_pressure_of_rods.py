"""Pressure of rods on a wall in implicit steps at the recommended step, against that of an ideal gas."""

import numpy as np
import pytest
from openmm import unit

from openmm_cylchain import F_ACTIN, Filaments, Plane, filament_wall_force
from support.contexts import new_context, positions_of
from support.solvent import KT, TEMPERATURE, VISCOSITY

LENGTH = 100.0
ACTIN = F_ACTIN.with_segment_length(LENGTH)


def _rods_above(stiffness, reach, count, generator):
    """Ends (rods, 2, 3) of rods in equilibrium above a wall at z = 0, those with an end below ``reach``.

    Without the wall, lower ends would be as dense at all heights, ``count`` of them below ``reach``, and cosines too.
    """
    lowest = -4 * np.sqrt(KT / stiffness)
    tried = round(count * (reach - lowest) / reach)
    ends = np.zeros((tried, 2, 3))
    cosines = generator.uniform(size=tried)
    ends[:, 0, 2] = lowest + (np.arange(tried) + generator.uniform(size=tried)) / tried * (reach - lowest)
    ends[:, 1] = ends[:, 0] + LENGTH * np.column_stack([np.sqrt(1 - cosines**2), 0 * cosines, cosines])
    depths = np.minimum(0.0, ends[:, :, 2])
    return ends[generator.uniform(size=tried) < np.exp(-0.5 * stiffness / KT * (depths**2).sum(axis=1))]


def _context(stiffness, rods, height):
    """With a wall at a height, and the recommended step."""
    filaments = Filaments(VISCOSITY, TEMPERATURE)
    for _ in range(rods):
        filaments.add_straight(ACTIN, 1, [0, 0, 0], [1, 0, 0])
    step = filaments.recommended_time_step().step
    _, system, positions = filaments.build()
    system.addForce(filament_wall_force(filaments, system, Plane([0, 0, height], [0, 0, 1]), stiffness))
    integrator = filaments.create_integrator(system, step, random_seed=5, checks=False)
    return new_context(system, positions, integrator, "CPU", {"Threads": "1"})


def _impulse(start, end, friction):
    """The sum of what moves rods away from the wall: that of Ito's and Stratonovich's sense would differ by 4 %."""
    middle = 0.5 * (start + end)
    along = middle[:, 1] - middle[:, 0]
    along /= np.linalg.norm(along, axis=1)[:, None]
    moves = (end - start).mean(axis=1)
    parallel = (friction.parallel - friction.perpendicular) * np.einsum("ij,ij->i", along, moves)
    return (friction.perpendicular * moves[:, 2] + parallel * along[:, 2]).sum()


@pytest.mark.slow
@pytest.mark.parametrize("stiffness", [1.0, 20.0])
def test_pressure_of_rods_on_a_wall(stiffness):
    """It is n k_B T for the density n far from the wall, whatever rods do near it.

    A wall gives to rods in a step the friction, half turned, times how much farther they get than with no wall
    there. Ends move by 11 nm at most, on the average: of those above ``reach``, none gets to the wall.
    """
    rods, room, reach, repeats = 1000, 1100, 50.0, 1000
    friction = ACTIN.segment_friction(VISCOSITY, TEMPERATURE)
    generator = np.random.default_rng(2)
    contexts = [_context(stiffness, room, height) for height in (0.0, -1e5)]
    step = contexts[0].getIntegrator().getStepSize().value_in_unit(unit.picosecond)
    far_above = np.tile([[0, 0, 1e5], [LENGTH, 0, 1e5]], (room, 1, 1))
    pushes = []
    for _ in range(repeats):
        start = _rods_above(stiffness, reach, rods, generator)
        nodes = far_above.copy()
        nodes[: len(start)] = start
        ends = []
        for context in contexts:
            context.setPositions(nodes.reshape(-1, 3))
            context.getIntegrator().step(1)
            ends.append(positions_of(context).reshape(room, 2, 3)[: len(start)])
        pushes.append(np.subtract(*[_impulse(start, end, friction) for end in ends]) / step)
    pressure = np.mean(pushes) * reach / (rods * KT)
    error = np.std(pushes, ddof=1) / np.sqrt(repeats) * reach / (rods * KT)
    assert 4 * error < 0.03
    assert pressure == pytest.approx(1.0, abs=0.03)
