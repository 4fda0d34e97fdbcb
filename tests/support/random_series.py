"""Random series with known correlations."""

import math


def correlated_series(generator, frames, factor, shape=()):
    """A stationary Gaussian series of unit variance with the autocorrelation factor^k."""
    noise = generator.normal(size=(frames, *shape))
    noise[1:] *= math.sqrt(1 - factor**2)
    for frame in range(1, frames):
        noise[frame] += factor * noise[frame - 1]
    return noise
