"""Reproduction of Chandran and Mofrad 2009: closed forms, cases, and that faults turn verdicts."""

from dataclasses import replace

import numpy as np
import pytest

from command_line import main
from openmm_cylchain import theory
from reproduce import cantilevers, chromosome, rod_diffusion, rods_on_string, thin_film
from reproduce.records import Records
from reproduce.rods_on_string import ACTIN, CHROMOSOME, MICROMETER, ROD, SECOND
from reproduce.transverse_modes import transverse_modes
from support.verdicts import verdicts

# Closed forms


def test_diffusion_of_the_rods_of_the_paper():
    """k_B T = 4.047e-21 J, ln(12.5) = 2.5257: 1.627 and 0.8135 um^2/s and 9.762 1/s for 1 um."""
    whole = rod_diffusion.rod_diffusion(1000.0)
    assert whole["parallel"] * SECOND / MICROMETER**2 == pytest.approx(1.627, rel=1e-3)
    assert whole["normal"] == pytest.approx(0.5 * whole["parallel"])
    assert whole["rotational"] * SECOND == pytest.approx(9.762, rel=1e-3)


@pytest.mark.parametrize("segments", [1, 2, 5, 20])
def test_cut_rods_diffuse_as_the_whole_with_its_logarithm(segments):
    whole = rod_diffusion.rod_diffusion(3000.0)
    assert rod_diffusion.cut_rod_diffusion(3000.0, segments) == pytest.approx(whole)


@pytest.mark.parametrize("segments", [2, 5])
def test_diffusion_of_cut_rods_is_the_inverse_of_the_summed_resistance(segments):
    one = 5000.0 / segments
    own = ROD.friction(one, segments, **rod_diffusion._FRICTIONS["own"])
    places = one * (np.arange(segments) - 0.5 * (segments - 1))
    turning = segments * own.rotational + own.perpendicular * np.sum(places**2)
    cut = rod_diffusion.cut_rod_diffusion(5000.0, segments, "own")
    assert cut["rotational"] == pytest.approx(ROD.thermal_energy / turning)
    assert cut["normal"] == pytest.approx(ROD.thermal_energy / (segments * own.perpendicular))


def test_elastica():
    """Small loads, and the table of Mattiasson, Int. J. Numer. Methods Eng. 1981, 17, 145, for P L^2/EI = 1 and 10."""
    for load, tip in (((1e-4, 0.0), 1e-4 / 3), ((0.0, 1e-4), 1e-4 / 8)):
        assert cantilevers.elastica(*load, 2)[0][-1, 1] == pytest.approx(tip, rel=1e-5)
    for load, down, back in ((1.0, 0.30172, 0.05643), (10.0, 0.81061, 0.55500)):
        shape, _ = cantilevers.elastica(load, 0.0, 2)
        assert (shape[-1, 1], 1.0 - shape[-1, 0]) == pytest.approx((down, back), abs=1e-5)


@pytest.mark.parametrize(("clamped", "roots"), [(True, (1.8751, 4.6941)), (False, (4.7300, 7.8532))])
def test_transverse_modes_tend_to_those_of_a_beam(clamped, roots):
    segments, length = 100, CHROMOSOME.diameter * 10
    friction = CHROMOSOME.friction(length / segments, segments)
    modes = transverse_modes(CHROMOSOME.rigidity, friction, length / segments, segments, clamped)
    beam = (np.array(roots) / length) ** 4 * CHROMOSOME.rigidity * (length / segments) / friction.perpendicular
    assert modes.rates[:2] == pytest.approx(beam, rel=3e-3)
    assert modes.projections @ modes.shapes == pytest.approx(np.eye(len(modes.rates)), abs=1e-6)
    weights = modes.projections[1]
    decay = np.exp(-modes.rates[1] * np.array([0.0, 1.0 / modes.rates[1]]))
    assert modes.autocorrelation(weights, np.array([0.0, 1.0 / modes.rates[1]])) == pytest.approx(decay, rel=1e-5)


def test_transverse_modes_have_the_fluctuations_of_a_clamped_chain():
    one, persistence = chromosome._ONE, CHROMOSOME.persistence_length
    friction = CHROMOSOME.friction(one, 26)
    modes = transverse_modes(CHROMOSOME.rigidity, friction, one, 25, clamped=True)
    covariance = modes.shapes * (CHROMOSOME.thermal_energy / modes.rates) @ modes.shapes.T
    assert np.diag(covariance) == pytest.approx(chromosome._deflection_variances(), rel=1e-6)
    angle = np.eye(25)[-1] - np.eye(25)[-2]
    assert angle @ covariance @ angle / one**2 == pytest.approx(chromosome._angle_variance(), rel=1e-6)
    assert chromosome._angle_variance() == pytest.approx(0.98 * 5000.0 / persistence)


def test_amplitudes_of_the_free_chain_have_the_exact_variance():
    one, segments = thin_film._ONE, thin_film._SEGMENTS
    modes = thin_film._modes_of_the_rod()
    cosines = np.cos(2 * np.pi * (np.arange(segments) + 0.5) / segments)
    weights = np.sqrt(2.0 / thin_film._LENGTH) * np.diff(np.eye(segments + 1), axis=0).T @ cosines
    variance = np.sum((weights @ modes.shapes) ** 2 * ACTIN.thermal_energy / modes.rates)
    # Of harmonic joints; those of the inscribed circle, at angles of 0.1 rad, have 1.4 % less.
    assert variance == pytest.approx(one**2 / (4 * ACTIN.persistence_length * np.sin(np.pi / segments) ** 2))
    exact = theory.chain_planar_bending_mode_variance(ACTIN.filament_type(one), segments, 2, ACTIN.temperature)
    assert variance == pytest.approx(1.014 * exact, rel=0.002)
    # The second mode of a beam with free ends, 7.8532, but for what faster ones add.
    beam = thin_film._ONE * ACTIN.rigidity * (7.8532 / thin_film._LENGTH) ** 4
    beam /= ACTIN.friction(one, segments).perpendicular
    assert modes.rates[1] == pytest.approx(beam, rel=0.01)
    assert thin_film._mode_correlation(2, np.array([1.0 / modes.rates[1]]))[0] == pytest.approx(np.exp(-1), abs=0.03)


# Cases and planted faults


def planted(monkeypatch, column, **changes):
    name = f"SIMULATED_{column}"
    original = getattr(rods_on_string, name)
    factors = {attribute: factor * getattr(original, attribute) for attribute, factor in changes.items()}
    monkeypatch.setattr(rods_on_string, name, replace(original, **factors))


@pytest.mark.slow
def test_rods_and_a_planted_fault(tmp_path, monkeypatch):
    monkeypatch.setattr(rod_diffusion, "_LENGTHS", (1, 5))
    monkeypatch.setattr(rod_diffusion, "_SEGMENTS", (1, 20))
    (case,) = rod_diffusion.CASES
    assert set(verdicts(case, tmp_path / "right").values()) == {"agrees"}
    planted(monkeypatch, "ROD", viscosity=1.1)
    wrong = [name for name, verdict in verdicts(case, tmp_path / "viscous").items() if verdict == "differs"]
    assert {name.split("_")[0] for name in wrong} == {"parallel", "normal", "rotational"}


@pytest.mark.slow
def test_cantilevers_and_a_planted_fault(tmp_path, monkeypatch):
    arguments = ["reproduce", "diffusion", "--quick", "--figure", "8", "--output", str(tmp_path / "page")]
    assert main(arguments) == 0
    page = (tmp_path / "page" / "diffusion.md").read_text()
    assert "Chandran" in page and "92 of 92 results agree" in page and "(figure-08b.png)" in page
    assert "| deflection end load 10 2 beam elements |" in page and "ruler deflection loads of the text 2 beam" in page
    planted(monkeypatch, "ACTIN", bending_rigidity=1.01)
    (case,) = cantilevers.CASES
    stiff = verdicts(case, tmp_path / "stiff")
    assert stiff["deflection_end_load_1"] == "differs"
    assert stiff["deflection_end_load_1_1_beam_element"] == "differs"
    assert stiff["ruler_deflection_loads_of_the_text_2_beam_elements"] == "differs"


@pytest.mark.slow
def test_chromosome_and_planted_faults(tmp_path, monkeypatch):
    monkeypatch.setattr(chromosome, "_VISCOSITIES", {"water": 1.0})
    monkeypatch.setattr(chromosome, "_COPIES", {True: 400})
    (case,) = chromosome.CASES
    right = verdicts(case, tmp_path / "right")
    assert {name for name, verdict in right.items() if verdict == "differs"} == {
        "persistence_length_over_length",
        "relaxation_time_in_water",
    }
    results = case.evaluate(Records(tmp_path / "right"), True).results
    assert not [each.name for each in results if each.unexplained]
    planted(monkeypatch, "CHROMOSOME", bending_rigidity=1.1)
    stiff = verdicts(case, tmp_path / "stiff")
    assert stiff["angle_variance_over_(42)_in_water"] == "differs"
    assert stiff["angle_variance_over_(42)_3_beam_elements"] == "differs"


def test_statistics_of_filaments_in_a_thin_film():
    settings = {"copies": 48, "stride": 1, "discarded": 10, "frames": 200, "seed": 3}
    data = thin_film.filaments_in_a_thin_film(step_microseconds=500.0, **settings)
    assert data["correlation"][0] == pytest.approx(np.ones(thin_film._GROUPS))
    kind = ACTIN.filament_type(thin_film._ONE)
    for mode in (5, 10, 15):
        exact = theory.chain_planar_bending_mode_variance(kind, thin_film._SEGMENTS, mode, ACTIN.temperature)
        copies = data["modes"][mode - 1]
        error = copies.std(ddof=1) / np.sqrt(len(copies))
        assert abs(copies.mean() - exact) < 4 * error < 0.5 * exact
    # Stiff filaments of nearly the contour length.
    assert np.all(data["square"] < (15.6 * MICROMETER) ** 2)


def test_beams_in_a_thin_film_and_a_planted_fault(tmp_path, monkeypatch):
    monkeypatch.setattr(thin_film, "_BEAM_COPIES", {True: 256})
    monkeypatch.setattr(thin_film, "_BEAM_FRAMES", {True: 6})
    monkeypatch.setattr(thin_film, "_BEAM_SQUARE_RULE", replace(thin_film._BEAM_SQUARE_RULE, resolution=0.015))
    monkeypatch.setattr(thin_film, "_BEAM_MODE_RULE", replace(thin_film._BEAM_MODE_RULE, resolution=0.1))
    right = list(thin_film._beam_results(Records(tmp_path / "right"), True))
    assert len(right) == 6 and {each.verdict for each in right} == {"agrees"}
    planted(monkeypatch, "ACTIN", bending_rigidity=1.5)
    wrong = {each.name: each.verdict for each in thin_film._beam_results(Records(tmp_path / "stiff"), True)}
    assert wrong["end_to_end_square_12_beam_elements"] == "differs"
    assert wrong["variance_of_bending_mode_1_12_beam_elements"] == "differs"
