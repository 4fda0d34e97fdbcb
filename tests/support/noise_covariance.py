"""Displacements of many equal filaments in one step, and their covariance against an exact one."""

import numpy as np

from support.contexts import new_context, positions_of


def moves_of_a_step(filaments, step, draws):
    """Displacements (draws * filaments, nodes, 3) in a step of scheme "midpoint" that begins anew for each draw."""
    _, system, positions = filaments.build()
    integrator = filaments.create_integrator(system, step, scheme="midpoint", random_seed=3)
    context = new_context(system, positions, integrator)
    moves = []
    for _ in range(draws):
        context.setPositions(positions)
        integrator.step(1)
        moves.append((positions_of(context) - positions._value).reshape(len(filaments), -1, 3))
    return np.concatenate(moves)


def assert_covariance(moves, expected):
    """The covariance of moves (samples, n) is as expected within five standard errors, five of which are below 5 %."""
    variances = np.diag(expected)
    error = np.sqrt((np.outer(variances, variances) + expected**2) / len(moves))
    assert np.abs((np.cov(moves.T) - expected) / error).max() < 5
    assert np.all(0.05 * variances > 5 * np.diag(error))
