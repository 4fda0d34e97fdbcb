"""Filaments in a narrow slab in equilibrium, drawn without the package: numpy alone."""

import numpy as np


def draw_heights(segments, length, rigidity, thickness, stiffness, count, seed, cells=61):
    """Heights of nodes (count, segments + 1) of nearly straight filaments between two soft walls.

    Each height depends on the two before it: bends have the energy rigidity/(2 length^3) (z1 - 2 z2 + z3)^2 in k_BT,
    and nodes that of a wall, stiffness/2 d^2, at the depth d. Nodes are drawn one by one, with what the rest of the
    filament weighs for each height.
    """
    edge = 0.5 * thickness + 4.0 / np.sqrt(stiffness)
    z = np.linspace(-edge, edge, cells)
    wall = np.exp(-0.5 * stiffness * np.maximum(0.0, np.abs(z) - 0.5 * thickness) ** 2)
    bends = z[:, None, None] - 2.0 * z[None, :, None] + z[None, None, :]
    moves = np.exp(-0.5 * rigidity / length**3 * bends**2) * wall
    # What the nodes behind two of them weigh.
    behind = [np.ones((cells, cells))]
    for _ in range(segments - 1):
        behind.append(np.einsum("ijk,jk->ij", moves, behind[-1]))
        behind[-1] /= behind[-1].max()
    generator = np.random.default_rng(seed)
    weight = wall[:, None] * wall[None, :] * behind[-1]
    first = generator.choice(cells**2, size=count, p=weight.ravel() / weight.sum())
    nodes = [first // cells, first % cells]
    for left in range(segments - 2, -1, -1):
        shares = np.cumsum(moves[nodes[-2], nodes[-1]] * behind[left][nodes[-1]], axis=1)
        nodes.append(np.sum(generator.uniform(size=count)[:, None] * shares[:, -1:] > shares, axis=1))
    return z[np.array(nodes)].T
