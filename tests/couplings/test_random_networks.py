"""Networks drawn at random, at up to ten times their recommended step: right, or an error or a warning that says so."""

import warnings

import numpy as np
import pytest

from openmm_cylchain import ContactWarning, InstabilityError, SegmentLengthWarning, TimeStepError, TimeStepWarning
from support.contexts import energy_of, positions_of
from support.random_networks import GROUPS, RandomNetwork
from support.solvent import KT

STEPS = 60


def _mean_energies(network, share):
    """By groups of forces in k_B T over the second half of a run; None if the run stopped with an error."""
    steps = round(STEPS / share)
    try:
        context = network.context(share)
        context.getIntegrator().step(steps)
    except InstabilityError:
        return None
    energies = np.zeros(len(GROUPS))
    for _ in range(steps):
        before = positions_of(context)
        try:
            context.getIntegrator().step(1)
        except TimeStepError:
            return None
        except InstabilityError:
            np.testing.assert_array_equal(positions_of(context), before)
            return None
        energies += [energy_of(context, {group}) for group in GROUPS]
    assert np.isfinite(positions_of(context)).all()
    return energies / steps / KT


def _check(seed):
    with warnings.catch_warnings(record=True) as caught:
        warnings.simplefilter("always")
        network = RandomNetwork(seed)
        long, short = (_mean_energies(network, share) for share in (1, 0.1))
    assert {warning.category for warning in caught} <= {ContactWarning, SegmentLengthWarning, TimeStepWarning}
    if long is None or short is None or caught:
        return False
    # Some networks still relax, and all fluctuate: what is wrong in silence is wrong by far more.
    assert (np.abs(long - short) < 20 + 0.5 * short).all(), (seed, long, short)
    return True


@pytest.mark.sample("^0")
@pytest.mark.parametrize("first", range(0, 20, 10))
def test_random_networks_are_right_or_say_that_they_are_not(first):
    assert sum(_check(seed) for seed in range(first, first + 10)) >= 4


@pytest.mark.exhaustive
@pytest.mark.parametrize("first", range(140, 290, 50))
def test_more_random_networks(first):
    assert sum(_check(seed) for seed in range(first, first + 50)) >= 25
