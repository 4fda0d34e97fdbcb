"""The reporter of linkers: what it writes and keeps, and files that it goes on with."""

import csv

import numpy as np
import pytest
from openmm import unit

from openmm_cylchain import F_ACTIN, Crosslinker, Filaments, Hand, InputError, LinkerReporter
from openmm_cylchain.output.linker_records import LINKER_RECORD, LinkerFile
from openmm_cylchain.output.record_file import read_records
from support.contexts import new_simulation, positions_of
from support.solvent import TEMPERATURE, VISCOSITY

EDGES = np.array([300.0, 300.0, 400.0])
COLUMNS = "unbound one_hand_bound both_hands_bound mean_tension maximum_tension bindings unbindings".split()


@pytest.fixture
def simulated():
    """Crosslinkers and linkers on points, in a small periodic box of which filaments stick out."""
    filaments = Filaments(VISCOSITY, TEMPERATURE)
    generator = np.random.default_rng(2)
    for number in range(12):
        start = generator.uniform(0.0, EDGES)
        filaments.add_equilibrium(F_ACTIN.with_segment_length(60.0), 6, seed=number + 1, start=start)
    second = 1 / unit.second
    hand = Hand(binding_rate=5e6 * second, reach=60.0, unbinding_rate=5e4 * second)
    filaments.add_linkers(Crosslinker(hands=hand, stiffness=0.1, rest_length=30.0), 60, bound=30)
    points = np.concatenate([filament.positions[:3] for filament in filaments]) + generator.normal(0.0, 3.0, (36, 3))
    filaments.add_linkers(Crosslinker(hands=hand, stiffness=0.1, name="on points"), anchors=points)
    topology, system, positions = filaments.build(np.diag(EDGES))
    integrator = filaments.create_integrator(system, 5e6, random_seed=1, checks=False)
    return filaments, points, new_simulation(topology, system, positions, integrator)


def read(path):
    with open(path, newline="") as file:
        return list(csv.DictReader(file))


def places_by_hand(filaments, positions, table, points):
    """Where the two hands of linkers are, or the anchor of those of the second type."""
    places = np.full((len(table), 2, 3), np.nan)
    for row in range(len(table)):
        for side in range(2):
            filament = table.filaments[row, side]
            if filament >= 0:
                segment, rest = divmod(table.arc_lengths[row, side], 60.0)
                nodes = positions[filaments.node_indices[filament]]
                segment = min(int(segment), 5)
                places[row, side] = nodes[segment] + rest / 60.0 * (nodes[segment + 1] - nodes[segment])
        if table.anchors[row] >= 0:
            places[row, 0] = points[table.anchors[row]]
    return places


def test_table_and_places(simulated, tmp_path):
    filaments, points, simulation = simulated
    here = filaments.in_context(simulation.context)
    reporter = LinkerReporter(tmp_path / "linkers.csv", 5, filaments, places=str(tmp_path / "linkers.npy"))
    simulation.reporters.append(reporter)
    seen = 0
    for report in range(4):
        simulation.step(5)
        table = here.linkers()
        places = places_by_hand(filaments, positions_of(simulation.context), table, points)
        vectors = places[:, 1] - places[:, 0]
        vectors -= EDGES * np.round(vectors / EDGES)
        lengths = np.linalg.norm(vectors, axis=1)
        np.testing.assert_allclose(here.linker_places()._value[:, 0], places[:, 0], atol=1e-6, equal_nan=True)
        events = [here.linker_events(number) for number in range(2)]
        assert here.linker_events() == tuple(np.sum(events, axis=0))
        assert np.subtract(*np.sum(events, axis=0)) == table.bound.sum() - 30
        for number, rest in enumerate((30.0, 0.0)):
            of_type = table.types == number
            held = table.held[of_type]
            tensions = 0.1 * (lengths[of_type & (table.held == 2)] - rest)
            assert len(tensions) > 0
            assert np.subtract(*events[number]) == table.bound[of_type].sum() - (30, 0)[number]
            expected = [
                *(int((held == n).sum()) for n in range(3)),
                tensions.mean(),
                tensions.max(),
                *events[number],
            ]
            found = [reporter[column][report, number] for column in COLUMNS]
            np.testing.assert_allclose(found, expected, rtol=1e-6)
        records = np.load(tmp_path / "linkers.npy")[seen:]
        seen += len(records)
        bound = table.bound.any(axis=1)
        assert (records["step"] == simulation.currentStep).all()
        for name in ("number", "type", "anchor"):
            np.testing.assert_array_equal(records[name], getattr(table, f"{name}s")[bound])
        np.testing.assert_array_equal(records["filaments"], table.filaments[bound])
        np.testing.assert_array_equal(records["arc_lengths"], table.arc_lengths[bound])
        np.testing.assert_allclose(records["places"][:, 0], places[bound, 0], atol=1e-3, equal_nan=True)
        np.testing.assert_allclose(
            records["places"][:, 1] - records["places"][:, 0], vectors[bound], atol=1e-3, equal_nan=True
        )
    reporter.close()
    np.testing.assert_array_equal(reporter.step, [5, 10, 15, 20])
    rows = read(tmp_path / "linkers.csv")
    assert list(rows[0]) == ["step", "time_ps", "linkers", *COLUMNS]
    assert [row["linkers"] for row in rows] == ["0", "1"] * 4
    written = np.array([[float(row[column]) for column in COLUMNS] for row in rows]).reshape(4, 2, -1)
    np.testing.assert_allclose(written, np.stack([reporter[column] for column in COLUMNS], axis=2), rtol=1e-9)


def test_a_run_that_goes_on_from_a_checkpoint_writes_the_same(simulated, tmp_path):
    filaments, _, simulation = simulated
    checkpoint = simulation.context.createCheckpoint()
    contents = []
    for parts in ((6,), (3, 3)):
        simulation.context.loadCheckpoint(checkpoint)
        paths = tmp_path / f"{len(parts)}.csv", tmp_path / f"{len(parts)}.npy"
        for number, steps in enumerate(parts):
            reporter = LinkerReporter(paths[0], 1, filaments, append=number > 0, places=paths[1])
            simulation.reporters = [reporter]
            simulation.step(steps)
            reporter.close()
            # A kill in the middle of a report.
            if number + 1 < len(parts):
                for path in paths:
                    path.write_bytes(path.read_bytes() + b"12")
        contents.append([path.read_bytes() for path in paths])
    assert contents[0] == contents[1]


def test_files_of_places_that_are_continued(tmp_path):
    path = tmp_path / "places.npy"
    records = np.zeros(5, dtype=LINKER_RECORD)
    records["number"] = np.arange(5)
    file = LinkerFile(path)
    assert len(np.load(path)) == 0
    file.write(records)
    file.write(records[:0])
    assert len(np.load(path)) == file.synchronise() == 5
    file.close()
    file = LinkerFile(path, 3)
    file.write(records[:1])
    file.close()
    np.testing.assert_array_equal(np.load(path)["number"], [0, 1, 2, 0])
    with pytest.raises(InputError, match="has 4 whole records, but had 7"):
        LinkerFile(path, 7)
    # Cut off, within the third record: it must not be filled up with zeros.
    whole = path.read_bytes()
    path.write_bytes(whole[: 512 + 5 * LINKER_RECORD.itemsize // 2])
    for count, needed in ((3, 3), (-1, 4)):
        with pytest.raises(InputError, match=f"has 2 whole records, but had {needed}"):
            LinkerFile(path, count)
    with pytest.raises(InputError, match=r"places.npy is damaged"):
        read_records(path)
    LinkerFile(path, 2).close()
    np.testing.assert_array_equal(read_records(path)["number"], [0, 1])
    np.save(path, np.zeros(3))
    with pytest.raises(InputError, match="places.npy is not a file of places of linkers"):
        LinkerFile(path, 0)
    path.write_bytes(b"")
    with pytest.raises(InputError, match="is not a file of places"):
        LinkerFile(path, -1)
    with pytest.raises(InputError, match="is missing"):
        LinkerFile(tmp_path / "other.npy", 0)


def test_bad_input_is_refused(simulated):
    filaments, _, simulation = simulated
    with pytest.raises(InputError, match="places must be the path of a file"):
        LinkerReporter(None, 1, filaments, places=3)
    with pytest.raises(InputError, match="no column 'bound': known are unbound"):
        LinkerReporter(None, 1, filaments)["bound"]
    without = Filaments(VISCOSITY, TEMPERATURE)
    without.add_straight(F_ACTIN, 2, [0, 0, 0], [1, 0, 0])
    without.build()
    with pytest.raises(InputError, match="no linkers to report"):
        LinkerReporter(None, 1, without)
