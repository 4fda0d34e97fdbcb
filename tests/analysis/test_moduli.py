"""The relaxation modulus of dumbbells, which has a closed form."""

import numpy as np
import pytest

from openmm_cylchain import InputError, analysis
from openmm_cylchain.analysis import CrosslinkFrame
from openmm_cylchain.couplings.contact_frames import joined_contacts
from openmm_cylchain.output.linker_records import LINKER_RECORD
from openmm_cylchain.units.quantities import thermal_energy

TEMPERATURE, STIFFNESS, RELAXATION_TIME, INTERVAL, VOLUME = 300.0, 0.2, 40.0, 10.0, 1e6
KT = thermal_energy(TEMPERATURE)


class Dumbbells:
    """A run of Hookean dumbbells: springs of rest length zero whose vectors relax in exp(-t/tau)."""

    temperature, box, filaments = TEMPERATURE, None, ()

    def __init__(self, count, frames, seed):
        generator = np.random.default_rng(seed)
        decay, width = np.exp(-INTERVAL / RELAXATION_TIME), np.sqrt(KT / STIFFNESS)
        self.linkers = [np.zeros(0, LINKER_RECORD)] * frames
        self.times = 7.0 + INTERVAL * np.arange(frames)
        self._vectors = np.empty((frames, count, 3))
        vectors = width * generator.normal(size=(count, 3))
        for frame in range(frames):
            self._vectors[frame] = vectors
            vectors = decay * vectors + width * np.sqrt(1.0 - decay**2) * generator.normal(size=(count, 3))

    def __len__(self):
        return len(self.times)

    def positions(self, frame):
        return np.zeros((0, 3))

    def nodes(self, frame):
        return []

    def crosslinks(self, frame):
        vectors = self._vectors[frame]
        places = np.stack([np.zeros_like(vectors), vectors], axis=1)
        on = np.ones(len(vectors), dtype=bool)
        tensions = STIFFNESS * np.linalg.norm(vectors, axis=1)
        return CrosslinkFrame(np.arange(len(on)), places, tensions, on, ~on)

    def contacts(self, frame):
        return joined_contacts([])

    def warn_of_rounding(self):
        pass


def test_dumbbells_relax_as_rouse_says():
    """G(t) = n k_BT/V exp(-2t/tau), and the errors are those that are there."""
    count = 4
    run = Dumbbells(count, 16000, 3)
    found = analysis.relaxation_modulus(run, 12, volume=VOLUME)
    expected = count * KT / VOLUME * np.exp(-2.0 * found.times / RELAXATION_TIME)
    np.testing.assert_allclose(found.times, INTERVAL * np.arange(13))
    assert np.all(found.errors[:4] < 0.0198 * expected[0])
    assert np.all(np.abs(found.values - expected) < 4.0 * found.errors)


@pytest.mark.slow
def test_errors_are_those_of_many_runs():
    runs = [analysis.relaxation_modulus(Dumbbells(2, 600, 100 + seed), 3, volume=VOLUME) for seed in range(40)]
    spread = np.std([found.values for found in runs], axis=0, ddof=1)
    told = np.mean([found.errors for found in runs], axis=0)
    # 40 runs tell a spread to 11 percent.
    np.testing.assert_allclose(told, spread, rtol=0.45)


def test_frames_at_equal_distances():
    run = Dumbbells(2, 400, 5)
    found = analysis.relaxation_modulus(run, 4, slice(50, None, 2), VOLUME)
    np.testing.assert_allclose(found.times, 2.0 * INTERVAL * np.arange(5))
    again = analysis.relaxation_modulus(run, 4, list(range(50, 400, 2)), VOLUME)
    np.testing.assert_array_equal(found.values, again.values)
    with pytest.raises(InputError, match="equal distances"):
        analysis.relaxation_modulus(run, 1, [0, 1, 3, 4, 5], VOLUME)
    with pytest.raises(InputError, match="equal distances"):
        analysis.relaxation_modulus(run, 1, [5, 4, 3, 2, 1], VOLUME)
    with pytest.raises(InputError, match="15 frames are too few for a maximum_lag of 4"):
        analysis.relaxation_modulus(run, 4, slice(15), VOLUME)
    with pytest.raises(InputError, match="give the volume"):
        analysis.relaxation_modulus(run, 4)
