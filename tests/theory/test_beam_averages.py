"""Averages of free chains of beam elements against draws from their equilibrium, and where they are known."""

from dataclasses import replace

import numpy as np
import pytest
from openmm import unit

from openmm_cylchain import FilamentType, InputError, theory
from openmm_cylchain.beams.curve import element_energies, node_tangents
from openmm_cylchain.beams.equilibrium import draw_beam
from openmm_cylchain.theory import beam_elements

KT, DRAWS, ELEMENTS = 8.31446261815324e-3 * 300.0, 2000, 6


def kind(bend, modulus=6e4):
    """Elements of 100 nm that are ``bend`` persistence lengths long."""
    return FilamentType(
        name="BEAM",
        diameter=4.0,
        segment_length=100.0,
        bending_rigidity=100.0 * KT / bend,
        stretching_modulus=modulus,
        element="beam",
    )


@pytest.mark.sample(r"-(?!0\.3)\d\.\d+-")
@pytest.mark.parametrize(
    ("bend", "modulus"), [(0.05, 6e4), (0.3, 6e4), (1.0, 6e4), pytest.param(0.05, 6.0, marks=pytest.mark.slow)]
)
@pytest.mark.parametrize("planar", [False, True])
def test_averages_are_those_of_draws(bend, modulus, planar):
    own, generator = kind(bend, modulus), np.random.default_rng(4)
    element = own.beam_element(300.0, planar)
    nodes, controls = zip(*(draw_beam(element, ELEMENTS, KT, generator, [0, 0, 0], None, planar) for _ in range(DRAWS)))
    nodes, controls = np.array(nodes), np.array(controls)
    stretching, bending = (values.mean(axis=1) for values in element_energies(nodes, controls, element))
    tangents = node_tangents(nodes, controls, 100.0)
    tangents /= np.linalg.norm(tangents, axis=2, keepdims=True)
    cosines = np.sum(tangents[:, 1:] * tangents[:, :-1], axis=2).mean(axis=1)
    squares = np.sum((nodes[:, -1] - nodes[:, 0]) ** 2, axis=1)
    exact = beam_elements.beam_averages(own, 300.0, planar)
    compared = [
        (stretching, beam_elements.beam_stretching_energy_mean(own, ELEMENTS, 300.0, planar)),
        (bending, exact.bending * KT),
        (cosines, exact.cosine),
    ]
    soft = modulus < 1e3
    if not soft:
        compared.append((squares, beam_elements.beam_mean_square_end_to_end(own, ELEMENTS, 300.0, planar)))
    for values, expected in compared:
        error = np.std(values, ddof=1) / np.sqrt(DRAWS)
        assert error < 0.0125 * expected
        # Of soft lengths, products of strains and bends are left out.
        assert abs(values.mean() - expected) < 4.0 * error + (0.01 if soft else 0.0) * expected


@pytest.mark.parametrize("planar", [False, True])
def test_short_elements_are_the_continuous_chain(planar):
    own = kind(0.01)
    length = own.persistence_length_at(300.0)
    assert beam_elements.beam_persistence_length(own, 300.0, planar) == pytest.approx(length, rel=2e-3)
    square = theory.wlc_mean_square_end_to_end(4000.0, length, planar)
    assert beam_elements.beam_mean_square_end_to_end(own, 40, 300.0, planar) == pytest.approx(square, rel=2e-3)
    # Two bends of an element in each direction, and seven strains of a chain of three.
    assert beam_elements.beam_averages(own, 300.0, planar).bending == pytest.approx(1.0 if planar else 2.0, rel=5e-3)
    assert beam_elements.beam_stretching_energy_mean(own, 3, 300.0, planar) == pytest.approx(3.5 / 3.0 * KT, rel=1e-2)


def test_a_type_with_a_persistence_length_has_it():
    own = FilamentType(
        name="BEAM",
        diameter=4.0,
        segment_length=100.0,
        persistence_length=250.0,
        temperature=300.0,
        stretching_modulus=6e4,
        element="beam",
    )
    assert beam_elements.beam_persistence_length(own, 300.0) == pytest.approx(250.0, rel=1e-6)


def test_functions_of_chains_take_them_or_say_which_do():
    own, warm = kind(0.3), 300.0 * unit.kelvin
    averages = beam_elements.beam_averages(own, warm)
    assert theory.chain_persistence_length(own, warm) == theory.beam_persistence_length(own, 300.0)
    assert theory.chain_mean_square_end_to_end(own, 6, warm) == theory.beam_mean_square_end_to_end(own, 6, 300.0)
    correlation = theory.chain_tangent_correlation(own, [0, 2], warm)
    np.testing.assert_allclose(correlation, [1.0, averages.cosine**2])
    assert theory.beam_bending_energy_mean(own, warm) == pytest.approx(averages.bending * KT)
    for function in (
        lambda: theory.bending_energy_mean(own, warm),
        lambda: theory.bending_energy_variance(own, warm),
        lambda: theory.stretching_energy_mean(own, warm),
        lambda: theory.stretching_energy_variance(own, warm),
        lambda: theory.mean_joint_cosine(own, warm),
        lambda: theory.chain_mean_square_radius_of_gyration(own, 6, warm),
        lambda: theory.chain_bending_mode_variance(own, 6, 1, warm),
        lambda: theory.chain_planar_bending_mode_variance(own, 6, 1, warm),
        lambda: theory.chain_extension(own, 6, 1.0, warm),
    ):
        with pytest.raises(InputError, match=r"'BEAM' has no straight segments.*theory\.beam_"):
            function()


@pytest.mark.parametrize(
    "arguments, message",
    [
        ((0, 300.0), "elements must be"),
        ((2.5, 300.0), "elements must be"),
        ((3, 0.0), "temperature"),
        ((3, float("nan")), "temperature"),
    ],
)
@pytest.mark.parametrize("function", [theory.beam_mean_square_end_to_end, theory.beam_stretching_energy_mean])
def test_bad_input_is_refused(function, arguments, message):
    with pytest.raises(InputError, match=message):
        function(kind(0.3), *arguments)


def test_straight_segments_are_refused():
    straight = replace(kind(0.3), element="straight")
    with pytest.raises(InputError, match="straight"):
        theory.beam_persistence_length(straight, 300.0)
