"""The benchmark of networks: its systems, its rows from given timings, and that it runs."""

import json
from dataclasses import replace
from itertools import product

import numpy as np
import pytest

from benchmark import measurement, network_systems, networks
from benchmark.measurement import Estimate
from benchmark.network_systems import NETWORKS, create_network, nearest_places, relaxed_positions
from benchmark.networks import NetworkErrors
from command_line import main
from openmm_cylchain import Filaments
from openmm_cylchain.analysis.crossings import segment_distances

BY_NAME = {network.name: network for network in NETWORKS}
EDGE = 400.0


def small(name, **changed):
    links = 12 if BY_NAME[name].links else 0
    return replace(BY_NAME[name], edge=EDGE, filaments=6, links=links, **changed)


def test_networks_are_those_of_the_rows():
    assert list(BY_NAME) == [
        "contacts",
        "links_very_soft",
        "links_soft",
        "links_stiff",
        "links_35_nm",
        "contacts_and_links",
    ]


def test_nearest_places_are_those_of_a_search_of_all_pairs():
    filaments = Filaments(1e-3, 310.0)
    generator = np.random.default_rng(3)
    for number in range(10):
        filaments.add_equilibrium(network_systems.ACTIN, 4, seed=number, start=generator.uniform(-EDGE, 2 * EDGE, 3))
    positions = filaments.build(box_vectors=EDGE * np.eye(3))[2]._value
    found = nearest_places(filaments, positions, EDGE)
    gaps = []
    for pair in found:
        a, b = ((1 - one.fraction) * positions[one.first] + one.fraction * positions[one.second] for one in pair)
        gaps.append(np.linalg.norm(b - a - EDGE * np.round((b - a) / EDGE)))

    first = np.concatenate([nodes[:-1] for nodes in filaments.node_indices])
    owner = np.repeat(np.arange(10), 4)
    a, b = np.nonzero(owner[:, None] < owner[None, :])
    shifts = EDGE * np.array(list(product((-4, -3, -2, -1, 0, 1, 2, 3, 4), repeat=3)))
    vectors, between = positions[first + 1] - positions[first], positions[first[b]] - positions[first[a]]
    expected = np.min([segment_distances(vectors[a], vectors[b], between + shift) for shift in shifts], axis=0)
    longest = np.linalg.norm(vectors, axis=1).max()
    expected = np.sort(expected[expected <= 0.5 * longest])
    assert len(expected) > 20
    np.testing.assert_allclose(gaps, expected, atol=1e-9)


@pytest.mark.parametrize("name", BY_NAME)
def test_energies_are_those_of_the_context(name):
    network = create_network(small(name), "implicit", 1e-3)
    energies = network.energies()
    kinds = {"stretching", "bending"}
    kinds |= {"link"} if network.system.links else set()
    kinds |= {"contact"} if network.system.contacts else set()
    assert set(energies) == kinds
    assert all(energy > 0 for energy in energies.values())
    kT = 8.31446261815324e-3 * 310.0
    potential = network.context.getState(energy=True).getPotentialEnergy()._value
    assert sum(energies.values()) * kT == pytest.approx(potential, rel=1e-9)
    if network.system.links:
        table = network.links.table(network.context)
        assert len(table.numbers) == 12
        extensions = network.links.extensions(network.context)
        stiffness = network.system.stiffness * 0.602214076
        assert energies["link"] * kT == pytest.approx(0.5 * stiffness * np.sum(extensions**2))


def test_filaments_on_top_of_each_other_come_apart():
    system = small("contacts")
    before = create_network(system, "implicit", 1e-3).energies()["contact"]
    positions = relaxed_positions(system, 5)
    after = create_network(system, "implicit", 1e-3, positions).energies()["contact"]
    assert before > 40.0
    assert after < 0.25 * before


def test_steps_without_a_length_are_the_recommended_ones():
    network = create_network(small("links_soft"), "midpoint", None)
    recommended = network.filaments.recommended_time_step(scheme="midpoint", system=network.context.getSystem())
    assert network.integrator.getStepSize()._value == recommended.step


def test_speeds_and_ratios():
    system = replace(BY_NAME["contacts"], steps=(5.0, 10.0))
    disturbance = np.array([1.0, 3.0, 1.0])
    times = {
        "contacts_5_us": 4e-3 * disturbance,
        "contacts_10_us": 5e-3 * disturbance,
        "contacts_explicit": 1e-3 * disturbance,
        "contacts_explicit_couplings": 2e-3 * disturbance,
    }
    steps = {"contacts": {"explicit": 0.02, "explicit_couplings": 0.5}}
    rows = {row.name: row for row in networks.speed_rows([system], steps, times)}
    assert rows["time_per_step_contacts_5_us"].value == pytest.approx(4.0)
    assert rows["simulated_seconds_per_second_contacts_5_us"].value == pytest.approx(5e-6 / 4e-3)
    assert rows["simulated_seconds_per_second_contacts"].value == pytest.approx(10e-6 / 5e-3)
    assert rows["simulated_seconds_per_second_contacts_explicit"].value == pytest.approx(2e-5)
    assert rows["implicit_over_explicit_contacts"].value == pytest.approx(100.0)
    assert rows["implicit_over_explicit_contacts"].error == pytest.approx(0.0, abs=1e-9)
    assert rows["implicit_over_explicit_couplings_contacts"].value == pytest.approx(8.0)
    assert rows["step_contacts_explicit"].value == 0.02
    without = {row.name for row in networks.speed_rows([system], {"contacts": {}}, times)}
    assert without == {name for name in rows if "explicit" not in name}


@pytest.mark.parametrize("name", ["contacts", "links_soft", "links_35_nm"])
def test_explicit_couplings_are_explicit(name):
    """At steps far beyond their stability they throw filaments apart; implicit ones do not."""
    system = small(name)
    positions = relaxed_positions(system, 5)
    energies = []
    for explicit in (False, True):
        network = create_network(system, "implicit", 1e-3, positions, explicit_couplings=explicit)
        before = network.energies()
        network.integrator.setStepSize(50e6)
        network.integrator.step(20)
        energies.append(network.energies()["bending"])
        assert before == pytest.approx(create_network(system, "implicit", 1e-3, positions).energies())
    assert energies[1] > 3.0 * energies[0]


def test_costs_of_sizes():
    disturbance = np.array([1.0, 3.0, 1.0])
    times = {"small": 2e-3 * disturbance, "large": 30e-3 * disturbance, "two_threads": 20e-3 * disturbance}
    rows = {row.name: row for row in networks.size_rows(BY_NAME["contacts"], times)}
    assert rows["cost_contacts_2000_segments"].value == pytest.approx(1000.0)
    assert rows["cost_contacts_20000_segments"].value == pytest.approx(1500.0)
    assert rows["growth_of_cost_contacts"].value == pytest.approx(1.5)
    assert rows["two_threads_over_one_contacts"].value == pytest.approx(1.5)
    del times["two_threads"]
    assert len(networks.size_rows(BY_NAME["contacts"], times)) == 3


def test_enlarged_networks_have_the_same_density():
    system = network_systems.enlarged(BY_NAME["links_soft"], 8)
    assert (system.filaments, system.links) == (1600, 8000)
    assert system.edge == pytest.approx(2400.0)


def test_rows_of_errors():
    errors = NetworkErrors(10.0, {"link": Estimate(12.34, 0.5), "bending": Estimate(3.0, 0.25)}, 0.005, 2)
    rows = networks.error_rows("links_soft_10_us", errors)
    assert [(row.name, row.value) for row in rows] == [
        ("link_energy_links_soft_10_us", 12.34),
        ("bending_energy_links_soft_10_us", 3.0),
        ("divided_steps_links_soft_10_us", 0.005),
        ("crossings_links_soft_10_us", 2.0),
    ]
    lines = networks.format_energies(rows).splitlines()
    assert len(lines) == 2
    assert lines[1].split() == ["links_soft_10_us", "12.3", "±", "0.5", "3.0", "±", "0.2", "0.005", "2"]


def test_errors_of_means_are_those_of_blocks():
    generator = np.random.default_rng(1)
    estimates = [networks._mean_of_blocks(generator.normal(5.0, 2.0, 40)) for _ in range(400)]
    values, errors = np.array([(one.value, one.error) for one in estimates]).T
    assert np.sqrt(np.mean(errors**2)) == pytest.approx(values.std(), rel=0.12)
    assert values.mean() == pytest.approx(5.0, abs=4 * 2.0 / np.sqrt(16000))


def test_crossings_are_counted_where_there_are_no_contacts():
    network = create_network(small("contacts", contacts=False), "implicit", 10.0)
    assert network.count_crossings(60) > 5


def test_benchmark_of_networks(monkeypatch, tmp_path, capsys):
    def quickly(cases, repetitions, seconds, say=None, minimum_steps=1, clock=None):
        return measurement.time_interleaved(cases, repetitions, 1e-3)

    systems = tuple(small(name, steps=BY_NAME[name].steps[-1:]) for name in BY_NAME)
    monkeypatch.setattr(networks, "QUICK", networks.NetworkEffort(systems, 5, 200.0, 100, 10, 2, 1e-3, ("contacts",)))
    monkeypatch.setattr(networks, "time_interleaved", quickly)
    path = tmp_path / "result.json"
    assert main(["benchmark", "networks", "--quick", "--json", str(path)]) == 0
    content = json.loads(path.read_text())
    assert content["missing"] == {}
    rows = {row["name"]: row for row in content["rows"]}
    assert len(rows) == len(content["rows"])
    for name, system in BY_NAME.items():
        assert rows[f"simulated_seconds_per_second_{name}"]["value"] > 0
        assert rows[f"implicit_over_explicit_{name}"]["value"] > 0
        assert rows[f"implicit_over_explicit_couplings_{name}"]["value"] > 0
        step = f"{name}_{system.steps[-1]:g}_us"
        assert rows[f"bending_energy_{step}"]["error"] > 0
        assert 0 <= rows[f"divided_steps_{step}"]["value"] < 1
        assert (f"link_energy_{step}" in rows) == bool(system.links)
        assert (f"crossings_{step}" in rows) == system.contacts
    assert rows["growth_of_cost_contacts"]["value"] > 0
    assert "energies in k_BT" in capsys.readouterr().out
