"""The chains of Panja, Barkema and van Leeuwen, PRE 2015, 92, 032603: base pairs of DNA, in the units of the paper.

Lengths are in units of d, times in units of xi/lambda, tau. N bonds join N + 1 beads.

As in ``simulation``, what is simulated is stated here apart from what the theory is evaluated for.
"""

import numpy as np
import openmm

from bead_spring_observables import mean_squares_of_observables, observables
from benchmark.base_pairs import MODES_STEPS
from openmm_cylchain import DSDNA_BASE_PAIRS, Filaments
from openmm_cylchain.bead_spring.draws import draw_bonds

from . import simulation

BASE_PAIRS = DSDNA_BASE_PAIRS
SIMULATED = DSDNA_BASE_PAIRS
TEMPERATURE = 296.15
"""23 C."""
SIMULATED_TEMPERATURE = 296.15
BONDS = (63, 127, 255, 511)
LARGEST_STEPS = MODES_STEPS
"""The final column of Table II, in tau."""
PRINTED_UNIT = 0.34e-1 * (1 - 2 * 0.35) ** 2 * 52.0
"""tau in ps, of (70) with the 52.0 ps of (71)."""
OBSERVABLES = ("end_to_end_vector", "middle_bond", "middle_bead")

# Beads have a friction of their own; the solvent has no part in it.
_VISCOSITY = 1.0


def mean_squares(bonds, kind=BASE_PAIRS):
    """Exact mean squares of the three ``OBSERVABLES`` in units of d^2."""
    return mean_squares_of_observables(kind, bonds, TEMPERATURE) / kind.natural_length**2


def drawn_positions(kind, bonds, copies, seed):
    """Positions (copies, beads, 3) in nm of chains drawn from their exact equilibrium, first beads at the origin."""
    generator = np.random.default_rng(seed)
    drawn = draw_bonds(kind.nu, kind.reduced_temperature(SIMULATED_TEMPERATURE), bonds, generator, copies)
    return np.concatenate([np.zeros((copies, 1, 3)), kind.natural_length * np.cumsum(drawn, axis=1)], axis=1)


def start(scheme, step, positions, seed, kind=None, flow=None, platform="CPU"):
    """A Context of chains of beads, ready to step.

    Parameters
    ----------
    scheme : str
    step : float
        In tau of the kind.
    positions : (copies, beads, 3) array
        In nm.
    seed : int
    kind : BeadSpringType, optional
        ``SIMULATED`` if not given.
    flow : Flow, optional
    platform : str
    """
    kind = SIMULATED if kind is None else kind
    filaments = Filaments(_VISCOSITY, SIMULATED_TEMPERATURE, engine="compiled")
    for nodes in positions:
        filaments.add_nodes(kind, nodes)
    _, system, built = filaments.build()
    # Steps are those of the paper, some of them too long on purpose.
    integrator = filaments.create_integrator(
        system, step * kind.time_unit, scheme=scheme, random_seed=seed, flow=flow, checks=False
    )
    context = openmm.Context(system, integrator, openmm.Platform.getPlatform(platform))
    context.setPositions(built)
    return context


def motion(bonds, copies, groups, scheme, step, spacing, frames, lags, seed):
    """How the three observables move and what they are on average, from exact equilibrium on.

    Parameters
    ----------
    bonds, copies, groups : int
        Groups of copies are averaged over.
    scheme : str
    step, spacing : float
        In tau; ``spacing``, of frames, a multiple of ``step``.
    frames : int
    lags : list of int
        In frames.
    seed : int

    Returns
    -------
    dict of arrays
        In units of d^2: ``squares`` (3, groups), means of the squares over all but the first third of the frames;
        ``losses`` (lags, 3, groups), <|Q(t) - Q(0)|^2> over all; ``starts`` (3, groups), the squares at the start.
    """
    series = np.empty((frames + 1, copies, 3, 3))
    kind = SIMULATED
    context = start(scheme, step, drawn_positions(kind, bonds, copies, seed), seed, kind)
    steps = round(spacing / step) * np.arange(frames + 1)
    for number, nodes in enumerate(simulation.frames(context, copies, steps)):
        series[number] = observables(nodes) / kind.natural_length
    squares = np.sum(series**2, axis=-1)
    losses = [np.sum((series[lag:] - series[:-lag]) ** 2, axis=-1).mean(axis=0) for lag in lags]
    return {
        "starts": simulation.groups(squares[0].T, groups),
        "squares": simulation.groups(squares[frames // 3 :].mean(axis=0).T, groups),
        "losses": simulation.groups(np.swapaxes(losses, 1, 2), groups),
    }
