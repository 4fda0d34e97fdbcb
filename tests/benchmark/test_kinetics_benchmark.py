"""The benchmark of kinetics: its bundle, its rows from given courses and timings, and that it runs."""

import json
from dataclasses import replace

import numpy as np
import pytest
from openmm import unit
from scipy.integrate import quad

from benchmark import kinetic_systems, kinetics, many_linkers, measurement
from benchmark.kinetic_systems import BundleSystem, create_bundle, relaxed_positions
from benchmark.kinetics import Course
from command_line import main

SMALL = BundleSystem(filaments=8, motors=20, crosslinkers=15, length=2500.0)
FEW = many_linkers.NetworkSystem(filaments=12, segments=8, linkers=900, edge=300.0, steps=40)
THERMAL_ENERGY = 8.31446261815324e-3 * 298.15


@pytest.fixture(scope="module")
def relaxed():
    return relaxed_positions(SMALL, 5)


def test_rates_are_those_of_filaments_at_the_rest_length():
    """The rate per length, integrated over a filament in reach, is 1/s."""
    end = np.sqrt(80.0**2 - 50.0**2)
    for kind in kinetic_systems.linker_types(SMALL):

        def weight(s, stiffness=kind.stiffness):
            return np.exp(-0.5 * stiffness * (np.hypot(50.0, s) - 50.0) ** 2 / THERMAL_ENERGY)

        whole = quad(weight, -end, end)[0]
        assert kind.hands[0].rate_per_length * whole == pytest.approx(1e-12, rel=1e-9)


def test_motors_and_crosslinkers_are_those_of_the_benchmark():
    motor, crosslinker = kinetic_systems.linker_types(SMALL)
    force, micrometer = unit.piconewton * unit.AVOGADRO_CONSTANT_NA, unit.micrometer
    in_plain = (100 * force / micrometer).value_in_unit(unit.kilojoule_per_mole / unit.nanometer**2)
    assert motor.stiffness == pytest.approx(in_plain)
    assert crosslinker.stiffness == pytest.approx(0.8 * in_plain)
    assert motor.rest_length == crosslinker.rest_length == 50.0
    hand = motor.hands[0]
    assert hand.speed == pytest.approx((0.5 * micrometer / unit.second)._value * 1e3 * 1e-12)
    assert hand.stall_force == pytest.approx((4 * force).value_in_unit(unit.kilojoule_per_mole / unit.nanometer))
    assert crosslinker.hands[0].unbinding_rate == 0.0 and crosslinker.hands[0].speed == 0.0


def test_bundle_of_the_benchmark_is_what_it_says():
    bundle = create_bundle(BundleSystem(), 1.0)
    segments = np.array([len(nodes) - 1 for nodes in bundle.nodes])
    assert len(segments) == 150
    assert segments.mean() == pytest.approx(20.0, abs=4 * 6.0 / np.sqrt(150))
    assert segments.std() == pytest.approx(6.0, rel=0.25)
    positions = bundle.positions()
    assert np.abs(positions[:, 0]).max() <= 2500.0
    assert np.hypot(positions[:, 1], positions[:, 2]).max() <= 90.0 + 1e-9
    forward = np.array([positions[nodes[-1], 0] > positions[nodes[0], 0] for nodes in bundle.nodes])
    assert 0.3 < forward.mean() < 0.7
    table = bundle.linkers()
    assert table.counts(0) == table.counts(1) == (0, 1000, 0)


def test_energies_are_those_of_the_context(relaxed):
    bundle = create_bundle(SMALL, 1000.0, positions=relaxed)
    bundle.integrator.step(2000)
    energies = bundle.energies()
    assert min(energies["bending"], energies["stretching"], energies["motor"], energies["crosslinker"]) > 0.0
    potential = bundle.context.getState(energy=True).getPotentialEnergy()._value
    assert sum(energies.values()) * THERMAL_ENERGY == pytest.approx(potential, rel=1e-6)


def test_filaments_on_top_of_each_other_come_apart():
    crowded = replace(SMALL, filaments=30)
    before = create_bundle(crowded, 1.0).energies()["contact"]
    after = create_bundle(crowded, 1.0, positions=relaxed_positions(crowded, 5)).energies()["contact"]
    assert before > 100.0
    assert after < 0.05 * before


def test_bundle_without_contacts_has_none():
    crowded = replace(SMALL, filaments=60)
    assert create_bundle(crowded, 1.0).energies()["contact"] > 100.0
    assert create_bundle(replace(crowded, contacts=False), 1.0).energies()["contact"] == 0.0


def test_length_of_filaments_that_lie_evenly():
    bundle = create_bundle(replace(SMALL, filaments=1, motors=0, crosslinkers=0), 1.0)
    segments = len(bundle.nodes[0]) - 1
    assert bundle.length() == pytest.approx(50.0 * np.sqrt(segments**2 - 1), rel=1e-6)


def test_course(relaxed):
    course = kinetics.follow(create_bundle(SMALL, 1000.0, positions=relaxed), 1000.0, 40e3, 4)
    np.testing.assert_allclose(course.times, [10e3, 20e3, 30e3, 40e3])
    assert {name: values.shape for name, values in course.energies.items()} == dict.fromkeys(
        ("bending", "stretching", "motor", "crosslinker", "contact", "wall"), (4,)
    )
    assert (course.numbers["motor"].sum(axis=1) == 20).all()
    assert (course.numbers["crosslinker"].sum(axis=1) == 15).all()
    assert (course.numbers["crosslinker"][:, 0] == 0).all()
    np.testing.assert_allclose(course.shortening, 1.0 - course.lengths[1:] / course.lengths[0])
    assert 0 <= course.divided < 1
    assert course.speed > 0


def given_courses(factor, shift):
    """Of two seeds, with energies that differ by ``shift`` between them."""
    times = np.array([1e5, 2e5])
    for own in (-shift, shift):
        energies = {name: factor * np.array([50.0, 100.0 + own]) for name in ("bending", "motor", "crosslinker")}
        numbers = {"motor": np.array([[1, 5, 4], [0, 4, 6]])}
        yield Course(times, energies, numbers, np.array([1000.0, 950.0, 900.0]), 0.25, 0.1)


def test_rows_of_courses():
    rows = kinetics.course_rows("bundle_2000_us", list(given_courses(1.0, 3.0)), 7)
    values = {row.name: row for row in rows}
    assert values["bending_energy_bundle_2000_us"].value == 100.0
    assert values["bending_energy_bundle_2000_us"].error == pytest.approx(3.0)
    assert values["motor_both_hands_bound_bundle_2000_us"].value == 6.0
    assert values["crossings_bundle_2000_us"].value == 7.0
    assert values["divided_steps_bundle_2000_us"].value == 0.25
    assert values["simulated_seconds_per_second_course_bundle_2000_us"].value == pytest.approx(0.1)
    assert values["shortening_bundle_2000_us_at_0.1_s"].value == pytest.approx(0.05)
    assert values["shortening_bundle_2000_us_at_0.2_s"].value == pytest.approx(0.1)
    assert len(values) == len(rows)


def test_ratios_to_the_reference():
    courses = {200.0: list(given_courses(1.0, 3.0)), 2000.0: list(given_courses(1.5, 4.0))}
    rows = {row.name: row for row in kinetics.ratio_rows("bundle", [2000.0], courses)}
    bending = rows["bending_energy_over_reference_bundle_2000_us"]
    assert bending.value == pytest.approx(1.5)
    assert bending.error == pytest.approx(1.5 * 0.05)
    assert rows["shortening_over_reference_bundle_2000_us"].value == pytest.approx(1.0)


def test_ratios_of_means_have_errors_where_a_mean_is_zero():
    ratio = kinetics.ratio_of_means([2.0, 4.0], [5.0, 7.0])
    assert ratio.value == pytest.approx(0.5)
    assert ratio.error == pytest.approx(0.5 * np.hypot(1 / 3, 1 / 6))
    around_zero = kinetics.ratio_of_means([-1.0, 1.0], [5.0, 7.0])
    assert around_zero.value == 0.0
    assert around_zero.error == pytest.approx(1 / 6)
    assert kinetics.ratio_of_means([0.0, 0.0], [5.0, 7.0]).value == 0.0


def test_speeds():
    times = {"bundle_1000_us": np.array([2e-3, 2e-3]), "bundle_5000_us": np.array([4e-2, 4e-2])}
    rows = {row.name: row.value for row in kinetics.speed_rows("bundle", (1000.0, 5000.0), times)}
    assert rows["time_per_step_bundle_1000_us"] == pytest.approx(2.0)
    assert rows["simulated_seconds_per_second_bundle_1000_us"] == pytest.approx(0.5)
    assert rows["time_per_step_bundle"] == rows["time_per_step_bundle_5000_us"] == pytest.approx(40.0)
    assert rows["simulated_seconds_per_second_bundle"] == pytest.approx(0.125)


def test_benchmark_of_kinetics(monkeypatch, tmp_path, capsys):
    def quickly(cases, repetitions, seconds, say=None, minimum_steps=1, clock=None):
        return measurement.time_interleaved(cases, repetitions, 1e-3)

    bare = replace(SMALL, name="bare", contacts=False)
    monkeypatch.setattr(
        kinetics, "QUICK", kinetics.KineticsEffort((SMALL, bare), (1000.0,), 2, 2e4, 2, 2, 3, 2, 1e-3, FEW)
    )
    monkeypatch.setattr(kinetics, "time_interleaved", quickly)
    path = tmp_path / "result.json"
    assert main(["benchmark", "kinetics", "--quick", "--json", str(path)]) == 0
    content = json.loads(path.read_text())
    rows = {row["name"]: row for row in content["rows"]}
    assert len(rows) == len(content["rows"])
    assert content["missing"] == {}
    assert rows["simulated_seconds_per_second_bundle"]["value"] > 0
    assert rows["bending_energy_over_reference_bundle_1000_us"]["error"] > 0
    assert rows["crossings_bundle_1000_us"]["value"] == 0
    assert rows["time_per_step_many_linkers_alone"]["value"] > 0
    assert np.isfinite(rows["bytes_per_linker"]["value"])
    assert "crossings_bundle_100_us" not in rows
    assert rows["simulated_seconds_per_second_bare"]["value"] > 0
    assert "crossings_bare_1000_us" not in rows
    output = capsys.readouterr().out
    assert "Shortening" in output and "energies in k_BT" in output


def test_springs_of_many_linkers_are_those_of_their_network():
    networks, joined = many_linkers.linked_networks(FEW)
    with_linkers, with_springs = networks["with_linkers"], networks["with_springs"]
    table = with_linkers.filaments.in_context(with_linkers.context).linkers()
    assert joined == table.counts()[2] > 20
    assert table.counts()[0] == 0
    energies = []
    for network in (with_linkers, with_springs):
        forces = network.context.getState(energy=True, forces=True)
        energies.append(forces.getPotentialEnergy()._value)
    assert energies[0] == pytest.approx(energies[1], rel=1e-9)
    positions = with_linkers.positions()
    for case, network in zip(many_linkers.linker_cases(networks), networks.values()):
        case.advance(2)
        case.advance(0)
        np.testing.assert_array_equal(network.positions(), positions)
        assert case.name.startswith("many_linkers_")
    alone = networks["alone"].context.getState(energy=True).getPotentialEnergy()._value
    assert energies[0] - alone > 0.1 * joined * THERMAL_ENERGY


def test_rows_of_many_linkers():
    times = {"with_linkers": [6e-3, 5e-3, 7e-3], "with_springs": [4e-3, 4e-3, 4e-3], "alone": [1e-3, 1e-3, 1e-3]}
    times = {f"many_linkers_{name}": values for name, values in times.items()}
    rows = {row.name: row for row in many_linkers.linker_rows(times, 7)}
    assert rows["time_per_step_many_linkers_with_linkers"].value == pytest.approx(6.0)
    assert rows["time_per_step_kinetics_of_many_linkers"].value == pytest.approx(2.0)
    assert rows["kinetics_over_mechanics_of_many_linkers"].value == pytest.approx(0.5)
    assert rows["kinetics_over_mechanics_of_many_linkers"].error > 0.1
    assert rows["linkers_with_both_hands_bound_of_many_linkers"].value == 7.0
