"""Nematic order of segments whose order is known."""

import numpy as np
import pytest

from openmm_cylchain import InputError, analysis


def test_parallel_and_crossed_segments():
    axis = np.array([1.0, -2.0, 2.0]) / 3.0
    vectors = np.outer([5.0, -1.0, 0.3], axis)
    assert analysis.order_parameter(vectors) == pytest.approx(1.0)
    np.testing.assert_allclose(np.cross(analysis.director(vectors), axis), 0.0, atol=1e-12)
    np.testing.assert_allclose(analysis.order_tensor(vectors), 1.5 * np.outer(axis, axis) - 0.5 * np.eye(3), atol=1e-12)
    # In a plane and isotropic there: S is 1/4, and Q has the eigenvalue -1/2 across.
    np.testing.assert_allclose(analysis.order_tensor(np.eye(3)[:2]), np.diag([0.25, 0.25, -0.5]), atol=1e-12)
    np.testing.assert_allclose(analysis.order_tensor(np.eye(3)), 0.0, atol=1e-12)


def test_order_does_not_depend_on_how_filaments_are_cut():
    vectors = np.random.default_rng(1).normal(size=(20, 3))
    halves = np.repeat(0.5 * vectors, 2, axis=0)
    np.testing.assert_allclose(analysis.order_tensor(halves), analysis.order_tensor(vectors), atol=1e-12)


def test_a_distribution_of_maier_and_saupe():
    """Density exp(b x^2) of the cosine x with the axis: S = <(3 x^2 - 1)/2> by an integral."""
    generator = np.random.default_rng(2)
    x = np.linspace(-1.0, 1.0, 20001)
    density = np.exp(3.0 * x**2)
    expected = 1.5 * np.average(x**2, weights=density) - 0.5
    cosines = generator.choice(x, 40000, p=density / density.sum())
    angles, sines = generator.uniform(0, 2 * np.pi, 40000), np.sqrt(1.0 - cosines**2)
    vectors = np.stack([sines * np.cos(angles), sines * np.sin(angles), cosines], axis=1)
    error = 1.5 * np.std(cosines**2) / np.sqrt(40000)
    assert error < 0.0125 * expected
    assert analysis.order_parameter(vectors) == pytest.approx(expected, abs=4 * error)
    assert analysis.director(vectors)[2] > 0.999


def test_refusals():
    for vectors in (np.zeros((0, 3)), np.zeros(3), np.zeros((4, 2))):
        with pytest.raises(InputError, match="must have the shape"):
            analysis.order_tensor(vectors)
    with pytest.raises(InputError, match="no length"):
        analysis.order_parameter(np.zeros((4, 3)))
