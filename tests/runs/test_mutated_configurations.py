"""Configurations changed by chance are refused in words or run: nothing hangs, fails otherwise or gives NaN."""

from collections import Counter

import numpy as np
import pytest

from openmm_cylchain.runs.beginnings import START_NAMES, start_text
from support.configurations import BEAMS, BODIES, EVERYTHING
from support.mutations import mutated, outcome

# Without comments, so that there is something to change in every line, and with few filaments.
SMALL = [
    "\n".join(line.partition(" #")[0].rstrip() for line in start_text(kind).splitlines() if line and line[0] != "#")
    for kind in START_NAMES
]
SMALL = [text.replace("count = 60\n", "count = 4\n").replace("count = 40\n", "count = 4\n") for text in SMALL]
TEXTS = [EVERYTHING.strip(), BEAMS.strip(), BODIES.strip(), *SMALL]


def outcomes(seed, count):
    generator = np.random.default_rng(seed)
    found = Counter()
    for _ in range(count):
        text = mutated(TEXTS[generator.integers(len(TEXTS))], generator)
        try:
            found[outcome(text)] += 1
        except BaseException:
            print(text)
            raise
    return found


def test_mutated_configurations():
    found = outcomes(0, 150)
    assert found["refused"] > 40 and found["runs"] > 6


@pytest.mark.slow
def test_many_mutated_configurations():
    found = outcomes(99, 200)
    assert found["refused"] > 80 and found["runs"] > 16


def test_without_mistakes_they_run():
    assert [outcome(text) for text in TEXTS] == ["runs"] * len(TEXTS)
