"""Systems of rods of actin whose equilibrium is known by Monte Carlo or quadrature: contacts at 30 nm, 0.38 pN/nm."""

import numpy as np

from support.rod_simulations import rod_system

# Links of 0.25 pN/nm.
PAIR = rod_system(2, links=[((0, 0.5), (1, 0.5), 0.25, 35.0)])
LOOP = rod_system(3, links=[((i, 0.8), ((i + 1) % 3, 0.2), 0.25, 35.0) for i in range(3)])
RODS_IN_SPACE = rod_system(100, box=(400.0, 400.0, 400.0))
RODS_IN_A_PLANE = rod_system(40, box=(650.0, 650.0, 1000.0), planar=True)
RODS_IN_A_SLAB = rod_system(24, box=(340.0, 340.0, 1000.0), height=100.0, wall=0.5)
# Volume fractions of 0.02, 0.05 and 0.1 between walls 400 nm apart.
RODS_IN_A_WIDE_SLAB = {
    f"{percent} %": rod_system(rods, box=(400.0, 400.0, 1200.0), height=400.0, wall=0.5)
    for percent, rods in ((2, 15), (5, 38), (10, 75))
}
CASES = {
    "pair": PAIR,
    "loop": LOOP,
    "space": RODS_IN_SPACE,
    "plane": RODS_IN_A_PLANE,
    "slab": RODS_IN_A_SLAB,
    **RODS_IN_A_WIDE_SLAB,
}


def rods_between_walls(stiffness):
    """Rods that do not touch each other, between walls 100 nm apart with so many pN/nm."""
    return rod_system(1, contact=0.0, height=100.0, wall=stiffness)


def quadrature_between_walls(system):
    """What ``rod_observables.observe`` means of a rod of fixed length between walls, without contacts."""
    cosines = (np.arange(1000) + 0.5) / 1000
    heights = np.linspace(-80.0, system.height + 80.0, 5201)
    ends = heights[:, None] + 0.5 * system.length * np.array([-1.0, 1.0])[:, None, None] * cosines
    depths = np.maximum(np.maximum(-ends, ends - system.height), 0.0)
    energies = 0.5 * system.wall * (depths**2).sum(axis=0)
    weights = np.exp(-energies)
    middle = np.abs(heights - 0.5 * system.height) < system.height / 8
    averaged = [energies, system.wall * depths.sum(axis=0), 1.5 * cosines**2 - 0.5, middle[:, None]]
    return np.array([(weights * values).sum() for values in averaged]) / weights.sum()
