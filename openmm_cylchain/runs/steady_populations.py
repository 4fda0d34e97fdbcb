"""Filaments that begin and vanish, in the long run: how many there are, and how long, from the rates of their ends."""

from dataclasses import dataclass

import numpy as np
import scipy.sparse

from ..kinetics.branching import Branching

_MOST_AT_LONGEST = 1e-3
"""The share of filaments that are the longest, beyond which there is no steady state without that limit."""
_MOST_STATES = 10**6


@dataclass(frozen=True)
class SteadyPopulation:
    """Free filaments in the long run: how many there are at once, and their mean length in nm."""

    number: float
    length: float


def steady_population(groups, box, concentration):
    """The SteadyPopulation of the FilamentGroups of one growth.

    From the master equation of the monomers of a filament and of the states of its ends, from its beginning until it
    vanishes. None where there is none, or where more than these decide: branches, cuts, monomers that age, or that come
    at regular times.

    Parameters
    ----------
    box : (3, 3) array or None
        In nm.
    concentration : float
        Of free monomers, in 1/nm^3.
    """
    growth, kind = groups[0].growth, groups[0].type
    nucleations = [group.nucleation for group in groups if group.nucleation is not None]
    alone = growth.vanishes and not (growth.deterministic or growth.severing or growth.monomers.aging)
    if not (alone and nucleations) or any(isinstance(own, Branching) for own in nucleations):
        return None
    fewest = growth.fewest_monomers(kind)
    most = int(np.ceil(growth.longest / growth.monomers.length))
    ends = growth.states("minus"), growth.states("plus")
    if (most - fewest + 1) * len(ends[0].names) * len(ends[1].names) > _MOST_STATES:
        return None
    number = length = 0.0
    for own in nucleations:
        times = _times(ends, concentration, fewest, own.monomers(growth, kind), most, growth.monomers.length)
        if times is None or times[-1] > _MOST_AT_LONGEST * times.sum():
            return None
        # Of no monomers at first, no power but the zeroth begins filaments.
        share = concentration / growth.pool.concentration if growth.pool.concentration > 0.0 else 0.0
        rate = own.whole_rate(box) * share**own.order
        number += rate * times.sum()
        length += rate * (times @ np.arange(fewest, most + 1)) * growth.monomers.length
    return SteadyPopulation(number, length / number) if number > 0.0 else None


def _times(ends, concentration, fewest, first, most, monomer):
    # For how long, in ps, a filament has each number of monomers before it vanishes; None if it may never do.
    gain, loss, switch, by_length, of_shortest = (sum(parts) for parts in zip(*_rates_of_both(ends, concentration)))
    sizes, states = most - fewest + 1, len(gain)
    if not loss.any():
        return None
    below_most = np.ones(sizes)
    below_most[-1] = 0.0
    up, down = scipy.sparse.diags([below_most[:-1]], [1]), scipy.sparse.diags([np.ones(sizes - 1)], [-1])
    lengths, shortest = monomer * np.arange(fewest, most + 1), np.eye(sizes)[0]
    rates = scipy.sparse.kron(scipy.sparse.identity(sizes), switch)
    rates = rates + scipy.sparse.kron(scipy.sparse.diags([lengths], [0]), by_length)
    rates = rates + scipy.sparse.kron(scipy.sparse.diags([shortest], [0]), of_shortest)
    rates = rates + scipy.sparse.kron(up, gain) + scipy.sparse.kron(down, loss)
    leaving = np.tile((switch + loss).sum(axis=1), sizes) + np.kron(below_most, gain.sum(axis=1))
    leaving += np.kron(lengths, by_length.sum(axis=1)) + np.kron(shortest, of_shortest.sum(axis=1))
    begin = np.zeros(sizes * states)
    begin[(first - fewest) * states] = 1.0
    scale = leaving.max()
    matrix = (scipy.sparse.diags([leaving], [0]) - rates).T / scale
    times = scipy.sparse.linalg.spsolve(matrix.tocsc(), begin, permc_spec="NATURAL") / scale
    return times.reshape(sizes, states).sum(axis=1) if np.all(np.isfinite(times)) else None


def _rates_of_both(ends, concentration):
    # Of each end, among the states of both, from a row to a column: by gains, by losses, by themselves, what there is
    # of these for each nm of length, and what there is more of the shortest.
    identities = [np.eye(len(own.names)) for own in ends]
    for place, own in enumerate(ends):
        count = np.arange(len(own.names))
        gain, loss = np.zeros((2, len(count), len(count)))
        gain[count, own.after_gain] = np.array(own.on_rates) * concentration
        loss[count, own.after_loss] = own.off_rates
        switch, over = np.array(own.switch_rates), np.array(own.switch_lengths)[:, None]
        by_length = np.divide(switch, over, out=np.zeros_like(switch), where=over > 0.0)
        both = [gain, loss, np.where(over > 0.0, 0.0, switch), by_length, np.array(own.shortest_switch_rates)]
        yield [np.kron(one, identities[1]) if place == 0 else np.kron(identities[0], one) for one in both]
