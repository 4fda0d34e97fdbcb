"""Crosslinks: forces, coming and going in the middle of a run, restarts, and equilibrium."""

import csv
import os
import resource
import subprocess
import sys
import threading
import tracemalloc

import numpy as np
import openmm
import pytest
from openmm import app, unit

from openmm_cylchain import F_ACTIN, Filaments, InputError, InstabilityError
from openmm_cylchain.couplings import crosslink_tables
from openmm_cylchain.couplings.crosslink_tables import CrosslinkTable
from openmm_cylchain.couplings.crosslinks import Crosslinks
from openmm_cylchain.couplings.link_places import as_places
from openmm_cylchain.engines.gpu_platforms import GPU_PLATFORMS
from openmm_cylchain.output.reporters import CrosslinkReporter
from support.contexts import energy_of, forces_of, new_context, new_simulation, positions_of
from support.crosslinked_filaments import crosslinked_filaments
from support.equilibrium_cases import CASES
from support.platforms import ENGINE_PLATFORMS, ENGINE_SCHEMES
from support.repository import TESTS
from support.solvent import KT, TEMPERATURE, VISCOSITY

BOX = np.array([[3.0, 0.0, 0.0], [0.5, 3.1, 0.0], [-0.4, 0.6, 2.9]])
PAIRS = [(0, 1), (0, 2), (0, 1), (4, 0), (3, 4), (2, 5)]


def _particles(count=6):
    system = openmm.System()
    for _ in range(count):
        system.addParticle(1.0)
    system.setDefaultPeriodicBoxVectors(*BOX)
    return system


def _linked(pairs=PAIRS, model="harmonic", periodic=False, **options):
    system = _particles()
    options = options or {"stiffness": 30.0, "rest_length": 0.4, "maximum_extension": 9.0 if model == "fene" else None}
    links = Crosslinks(model=model, **options)
    links.set_pairs(None, pairs)
    links.add_to(system, periodic=periodic)
    return links, system


def _stock(pairs, model, periodic):
    system = _particles()
    harmonic, fene = "15*(r-0.4)^2", "-15*9^2*log(1-((r-0.4)/9)^2)"
    force = openmm.CustomBondForce(harmonic if model == "harmonic" else fene)
    if model == "harmonic":
        force = openmm.HarmonicBondForce()
    for pair in pairs:
        force.addBond(*pair, *((0.4, 30.0) if model == "harmonic" else ()))
    force.setUsesPeriodicBoundaryConditions(periodic)
    system.addForce(force)
    return system


@pytest.mark.parametrize("periodic", [False, True])
@pytest.mark.parametrize("model", ["harmonic", "fene"])
def test_forces_are_those_of_stock_bonds(model, periodic, platform):
    positions = np.random.default_rng(1).uniform(-4, 4, (6, 3))
    _, system = _linked(model=model, periodic=periodic)
    linked, stock = (new_context(one, positions, platform=platform) for one in (system, _stock(PAIRS, model, periodic)))
    tolerance = {"rel": 1e-5, "abs": 1e-3} if platform.getName() in GPU_PLATFORMS else {"rel": 1e-12, "abs": 1e-9}
    assert np.abs(forces_of(stock)).max() > 10
    assert forces_of(linked) == pytest.approx(forces_of(stock), **tolerance)
    assert energy_of(linked) == pytest.approx(energy_of(stock), **tolerance)


@pytest.mark.parametrize("periodic", [False, True])
@pytest.mark.parametrize("model", ["harmonic", "fene"])
def test_forces_are_derivatives_of_the_energy(model, periodic):
    positions = np.random.default_rng(2).uniform(-4, 4, (6, 3))
    _, system = _linked(model=model, periodic=periodic)
    context = new_context(system, positions)
    expected = forces_of(context)
    step = 1e-5
    for particle in range(6):
        for axis in range(3):
            energies = []
            for sign in (1, -1):
                moved = positions.copy()
                moved[particle, axis] += sign * step
                context.setPositions(moved)
                energies.append(energy_of(context))
            numerical = -(energies[0] - energies[1]) / (2 * step)
            assert numerical == pytest.approx(expected[particle, axis], rel=1e-6, abs=1e-5)


def test_crosslinks_differ_and_may_have_no_length():
    links, system = _linked([(0, 1)], stiffness=2.0, rest_length=0.0)
    positions = np.zeros((6, 3))
    positions[2] = [0, 0, 3]
    context = new_context(system, positions)
    assert energy_of(context) == 0 and np.all(forces_of(context) == 0)
    links.add(context, 0, 2, rest_length=10 * unit.angstrom, stiffness=1 * unit.piconewton / unit.nanometer)
    assert energy_of(context) == pytest.approx(0.5 * 0.602214076 * 4)
    assert forces_of(context)[2] == pytest.approx([0, 0, -2 * 0.602214076])
    assert links.lengths(context) == pytest.approx([0, 3])
    assert links.extensions(context) == pytest.approx([0, 2])
    assert links.forces(context) == pytest.approx([0, 2 * 0.602214076])


def test_force_groups():
    links, system = Crosslinks(1.0, 0.0), _particles()
    links.add(None, 0, 1)
    links.add_to(system, force_group=7)
    context = new_context(system, np.eye(6, 3))
    assert energy_of(context, {7}) == pytest.approx(1.0)
    assert energy_of(context, {0}) == 0


def test_changes_are_seen_at_once_and_in_their_context_alone():
    links, system = _linked([(0, 1)])
    positions = 2.0 * np.random.default_rng(3).uniform(size=(6, 3))
    first, second = (new_context(system, positions) for _ in range(2))
    for context in (first, second):
        assert links.pairs(context).tolist() == [[0, 1]] and links.numbers(context).tolist() == [0]
    assert links.add(first, 2, 3) == 1
    assert links.add(first, 3, 4) == 2
    links.remove(first, 1)
    assert links.add(first, 3, 2) == 3
    assert links.numbers(first).tolist() == [0, 2, 3]
    assert links.pairs(first).tolist() == [[0, 1], [3, 4], [3, 2]]
    assert links.pairs(second).tolist() == links.pairs(None).tolist() == [[0, 1]]
    for context, pairs in ((first, [(0, 1), (3, 4), (3, 2)]), (second, [(0, 1)])):
        expected = forces_of(new_context(_stock(pairs, "harmonic", False), positions))
        assert forces_of(context) == pytest.approx(expected, abs=1e-12)
    links.remove(first, [0, 2])
    assert links.pairs(first).tolist() == [[3, 2]]
    links.set_pairs(first, [(5, 4), (0, 3)])
    assert links.numbers(first).tolist() == [0, 1]
    links.set_pairs(first, [])
    assert energy_of(first) == 0 and len(links.numbers(first)) == 0
    with pytest.raises(ValueError):
        links.pairs(second)[0, 0] = 3


@pytest.mark.parametrize("engine, platform", ENGINE_PLATFORMS)
def test_a_crosslink_that_goes_during_a_run_is_a_stock_bond_that_is_taken_out(engine, platform):
    ends = []
    for stock in (True, False):
        links, system, positions, integrator = crosslinked_filaments(engine, stock)
        context = new_context(system, positions, integrator, platform)
        integrator.step(10)
        if stock:
            links.setBondParameters(1, *links.getBondParameters(1)[:3], 0.0)
            context.reinitialize(preserveState=True)
        else:
            links.remove(context, 1)
        integrator.step(10)
        ends.append(positions_of(context))
    tolerance = 0.002 if platform in GPU_PLATFORMS else 1e-9
    assert np.abs(ends[0] - ends[1]).max() < tolerance
    links, system, positions, integrator = crosslinked_filaments(engine)
    context = new_context(system, positions, integrator, platform)
    integrator.step(20)
    assert np.abs(positions_of(context) - ends[1]).max() > 20 * tolerance


def test_two_contexts_in_two_threads(engine):
    def run(context, integrator):
        for step in range(30):
            number = links.add(context, 0, 1 + step % 5)
            integrator.step(2)
            if step % 3:
                links.remove(context, number)

    results = []
    for parallel in (False, True):
        contexts, integrators = [], []
        links, system, positions, first = crosslinked_filaments(engine)
        for displacement in (0.0, 5.0):
            integrator = first if not integrators else openmm.XmlSerializer.clone(first)
            integrators.append(integrator)
            contexts.append(new_context(system, positions._value + [0, 0, displacement], integrator))
        threads = [threading.Thread(target=run, args=pair) for pair in zip(contexts, integrators)]
        for thread in threads:
            thread.start()
            if not parallel:
                thread.join()
        for thread in threads:
            thread.join()
        results.append([positions_of(context) for context in contexts])
        assert [len(links.numbers(context)) for context in contexts] == [13, 13]
    assert np.array_equal(results[0], results[1])


def test_going_back_to_a_state_of_this_process():
    links, system = _linked()
    positions = np.random.default_rng(4).uniform(size=(6, 3))
    context = new_context(system, positions)
    links.remove(context, [1, 3])
    state = context.getState(positions=True, velocities=True, parameters=True)
    checkpoint = context.createCheckpoint()
    energy, pairs = energy_of(context), links.pairs(context).tolist()
    for restore in (lambda: context.setState(state), lambda: context.loadCheckpoint(checkpoint)):
        links.remove(context, links.numbers(context)[0])
        links.add(context, 4, 5)
        assert energy_of(context) != pytest.approx(energy)
        restore()
        assert energy_of(context) == energy and links.pairs(context).tolist() == pairs
    # Another Context may take the State, and is not touched by what happens in the first.
    other = new_context(system, positions)
    other.setState(state)
    for _ in range(2 * crosslink_tables.RECENT_TABLES):
        links.add(context, 0, 5)
        assert links.pairs(other).tolist() == pairs
    assert energy_of(other) == pytest.approx(energy)


RUN = """
import numpy as np
from openmm_cylchain import CrosslinkTable
from support.contexts import new_context, positions_of
from support.crosslinked_filaments import crosslinked_filaments
for name in {names}:
    links, system, positions, integrator = crosslinked_filaments({engine!r})
    context = new_context(system, positions, integrator)
    for each in name.split("-"):
        if each == "first":
            integrator.step(5)
            links.remove(context, 1)
            links.add(context, 0, 9)
            integrator.step(5)
            open("checkpoint", "wb").write(context.createCheckpoint())
            links.table(context).save("links.npz")
        elif each == "checkpoint":
            context.loadCheckpoint(open("checkpoint", "rb").read())
        else:
            links.set_table(context, CrosslinkTable.load("links.npz"))
    try:
        integrator.step(5)
        print(links.add(context, 0, 4))
        integrator.step(5)
        np.save(name, positions_of(context))
    except Exception as error:
        print(*str(error).split())
"""


def _run_process(folder, *names, engine):
    environment = {**os.environ, "PYTHONPATH": str(TESTS)}
    command = [sys.executable, "-c", RUN.format(names=names, engine=engine)]
    process = subprocess.run(command, cwd=folder, env=environment, capture_output=True, text=True)
    assert process.returncode == 0, process.stderr
    return process.stdout.splitlines()


def test_a_restart_in_another_process_goes_on_to_the_bit(engine, tmp_path):
    # A process knows the crosslinks that it has had, so that those without a table come first.
    calls = ("first",), ("table-checkpoint",), ("checkpoint", "checkpoint-table")
    (*_, number), (*_, before), (*_, without, after) = (
        _run_process(tmp_path, *names, engine=engine) for names in calls
    )
    assert number == after == before == "4"
    ends = [np.load(tmp_path / f"{name}.npy") for name in ("first", "table-checkpoint", "checkpoint-table")]
    assert np.array_equal(ends[1], ends[0]) and np.array_equal(ends[2], ends[0])
    if engine == "compiled":
        # Its integrator writes crosslinks into checkpoints.
        assert without == "4" and np.array_equal(np.load(tmp_path / "checkpoint.npy"), ends[0])
        return
    assert "The crosslinks of this Context are not known" in without
    assert "Crosslinks.set_table" in without and not (tmp_path / "checkpoint.npy").exists()


def test_tables_are_kept_in_files(tmp_path):
    links = Crosslinks(1.0, 2.0, "fene", 3.0)
    links.set_pairs(None, PAIRS)
    links.remove(None, [0, 5])
    links.add(None, 1, 5, stiffness=4.0)
    links.table(None).save(tmp_path / "table.npz")
    table = CrosslinkTable.load(tmp_path / "table.npz")
    assert table == links.table(None) and table != CrosslinkTable()
    assert table.next_number == 7 and table.numbers.tolist() == [1, 2, 3, 4, 6]
    assert table.stiffness.tolist() == [1, 1, 1, 1, 4]
    np.savez(tmp_path / "other.npz", numbers=[1])
    with pytest.raises(InputError, match="holds no table of crosslinks: it lacks maximum_extension, next_number"):
        CrosslinkTable.load(tmp_path / "other.npz")
    for bad in (
        {"numbers": [1, 0]},
        {"numbers": [-1, 0]},
        {"numbers": [0, 7]},
        {"stiffness": [1, np.nan]},
        {"rest_length": [-1, 1]},
        {"maximum_extension": [0, 1]},
        {"pairs": [[0, 1]]},
    ):
        good = {name: [1, 2] for name in ("numbers", "stiffness", "rest_length", "maximum_extension")}
        with pytest.raises(InputError, match="table of crosslinks"):
            CrosslinkTable(**{**good, "pairs": [[0, 1], [1, 2]], **bad}, next_number=3)


def test_systems_are_written_to_xml_with_their_crosslinks(engine):
    links, system, positions, integrator = crosslinked_filaments(engine)
    more = Crosslinks(0.03, 5.0, "fene", 1000.0)
    more.add(None, 0, 1)
    more.add_to(system)
    duplicate = openmm.XmlSerializer.deserialize(openmm.XmlSerializer.serialize(system))
    clone = openmm.XmlSerializer.clone(integrator)
    read, read_more = Crosslinks.from_system(duplicate)
    assert (read.model, read_more.model) == ("harmonic", "fene")
    ends = []
    for one, two, context in (
        (links, more, new_context(system, positions, integrator)),
        (read, read_more, new_context(duplicate, positions, clone)),
    ):
        assert energy_of(context) > 0
        one.remove(context, 0)
        one.add(context, 0, 2)
        two.add(context, 1, 2)
        context.getIntegrator().step(5)
        ends.append(positions_of(context))
        assert one.pairs(context)[-1].tolist() == [0, 2] and two.pairs(context).tolist() == [[0, 1], [1, 2]]
    assert np.array_equal(*ends)
    assert Crosslinks.from_system(_particles()) == []


def test_fene_crosslinks_that_are_too_long_are_named(engine, tmp_path):
    filaments = Filaments(VISCOSITY, TEMPERATURE, engine=engine)
    for y in (0, 500):
        filaments.add_straight(F_ACTIN, 2, [0, y, 0], [1, 0, 0])
    _, system, positions = filaments.build()
    links = Crosslinks(1.0, 20.0, "fene", 10.0)
    links.add_to(system)
    integrator = filaments.create_integrator(system, 1.0, scheme="midpoint")
    context = new_context(system, positions, integrator)
    integrator.step(1)
    number = links.add(context, 1, 4, maximum_extension=1000.0)
    integrator.step(1)
    links.remove(context, number)
    links.add(context, 1, 5)
    message = "[Ll]ink 1 between particles 1 and 5 has blown up: its length of 616[.].* nm is outside 20 -/. 10 nm"
    with pytest.raises(InstabilityError, match=message):
        integrator.step(1)
    with pytest.raises(openmm.OpenMMException, match=message):
        energy_of(context)
    with pytest.raises(InputError, match=message):
        links.forces(context)
    links.remove(context, 1)
    integrator.step(1)


def test_many_changes_take_no_memory():
    links, system = _linked()
    context = new_context(system, np.random.default_rng(5).uniform(size=(6, 3)))

    def change(times):
        for _ in range(times):
            links.remove(context, links.add(context, 0, 5))

    tracemalloc.start()
    try:
        # Free lists of Python fill as well. A snapshot would take as much memory as it shall find.
        change(2 * crosslink_tables.RECENT_TABLES)
        before = tracemalloc.get_traced_memory()[0]
        change(400)
        growth = tracemalloc.get_traced_memory()[0] - before
    finally:
        tracemalloc.stop()
    assert len(links.numbers(context)) == len(PAIRS) and links.table(context).next_number == len(PAIRS) + 912
    # A table takes more than a kilobyte, so a leak would be of four times as much.
    assert growth < 1e5


@pytest.mark.slow
def test_twenty_thousand_changes_and_steps_take_no_memory():
    links, system = _linked()
    context = new_context(system, np.random.default_rng(5).uniform(size=(6, 3)))
    sizes = []
    for round_ in range(20_000):
        links.remove(context, links.add(context, 0, 5))
        context.getIntegrator().step(1)
        if round_ % 2_000 == 0:
            sizes.append(resource.getrusage(resource.RUSAGE_SELF).ru_maxrss)
    assert sizes[-1] - sizes[1] < 1000, sizes


BY_DEFAULT = [("compiled", "implicit", "filament")]
OTHERS = [(*which, partner) for which in ENGINE_SCHEMES for partner in ("particle", "filament")]
OTHERS = [pytest.param(*which, marks=pytest.mark.slow) for which in OTHERS if which not in BY_DEFAULT]


@pytest.mark.sample("compiled|portable-midpoint-particle")
@pytest.mark.parametrize("engine, scheme, partner", BY_DEFAULT + OTHERS)
def test_thermal_length_of_a_crosslink(engine, scheme, partner):
    """The only crosslink between two free bodies has d distributed as d^2 exp(-V/k_BT), whatever they are."""
    kind = CASES["freely-jointed"].type
    copies, rest, stiffness = 700, 30.0, 25 * KT / 100**2
    friction = kind.segment_friction(VISCOSITY, TEMPERATURE)

    def mobility(fraction):
        return 1 / friction.parallel + (fraction - 0.5) ** 2 * kind.segment_length**2 / friction.rotational

    # The variance of an explicit scheme is too large by up to half the step over the relaxation time, here 1 %.
    step = 0.02 / stiffness / (mobility(0.25) + (1 / friction.parallel if partner == "particle" else mobility(0)))
    grid = np.linspace(0, 400, 40001)
    density = grid**2 * np.exp(-0.5 * stiffness * (grid - rest) ** 2 / KT)
    mean = np.sum(grid * density) / density.sum()
    variance = np.sum((grid - mean) ** 2 * density) / density.sum()
    generator = np.random.default_rng(8)
    draws = np.interp(generator.random(copies), np.cumsum(density) / density.sum(), grid)
    directions = generator.normal(size=(copies, 3))
    vectors = draws[:, None] * directions / np.linalg.norm(directions, axis=1)[:, None]

    filaments = Filaments(VISCOSITY, TEMPERATURE, engine=engine)
    topology, system = app.Topology(), openmm.System()
    places = []
    for number in range(copies):
        filaments.add_equilibrium(kind, 1, seed=number)
        filaments.add_attachment(number, segment=0, fraction=0.25)
        places.append(filaments[number].positions.T @ [0.75, 0.25] + vectors[number])
    if partner == "particle":
        chain = topology.addChain()
        for _ in range(copies):
            topology.addAtom("P", None, topology.addResidue("PRT", chain))
            system.addParticle(1.0)
    else:
        for place in places:
            filaments.add_straight(kind, 1, place, [1, 0, 0])
        places = np.zeros((0, 3))
    positions = filaments.add_to(topology, system, places)
    others = range(copies) if partner == "particle" else [nodes[0] for nodes in filaments.node_indices[copies:]]
    links = Crosslinks(stiffness, rest)
    links.set_pairs(None, list(zip(filaments.attachment_indices, others)))
    links.add_to(system)
    integrator = filaments.create_integrator(
        system, step, scheme=scheme, particle_friction=friction.parallel, random_seed=11
    )
    context = new_context(system, positions, integrator)
    assert links.lengths(context) == pytest.approx(draws)
    samples = []
    for _ in range(40):
        integrator.step(60)
        samples.append(links.lengths(context))
    samples = np.array(samples)[3:]
    for values, expected in ((samples, mean), ((samples - mean) ** 2, variance)):
        of_copies = values.mean(axis=0)
        error = of_copies.std(ddof=1) / np.sqrt(copies)
        assert 4 * error < 0.045 * expected
        assert abs(of_copies.mean() - expected) < 4 * error + 0.01 * expected


def test_reporter(tmp_path):
    links, system, positions, integrator = crosslinked_filaments("compiled")
    topology = app.Topology()
    chain = topology.addChain()
    for _ in range(system.getNumParticles()):
        topology.addAtom("X", None, topology.addResidue("X", chain))
    simulation = new_simulation(topology, system, positions, integrator)
    context = simulation.context
    path = tmp_path / "links.csv"
    reporter = CrosslinkReporter(path, 2, links)
    simulation.reporters.append(reporter)
    simulation.step(2)
    links.remove(context, 0)
    links.add(context, 0, 3, stiffness=0.5)
    links.add(context, 0, 4)
    simulation.step(2)
    lengths = links.lengths(context)
    links.set_pairs(context, [])
    simulation.step(2)
    reporter.close()
    simulation.reporters[0] = CrosslinkReporter(path, 2, links, append=True)
    links.add(context, 3, 4)
    simulation.step(2)
    with open(path, newline="") as file:
        rows = list(csv.DictReader(file))
    columns = ["step", "time_ps", "crosslink", "particle_1", "particle_2", "length", "extension", "force"]
    assert list(rows[0]) == columns
    assert [(int(row["step"]), int(row["crosslink"])) for row in rows] == [
        *((2, number) for number in (0, 1, 2)),
        *((4, number) for number in (1, 2, 3, 4)),
        (8, 0),
    ]
    assert reporter.step.tolist() == [2, 4, 6] and reporter.count.tolist() == [3, 4, 0]
    for column in columns:
        assert reporter[column].shape == (7,)
        assert [float(row[column]) for row in rows[:7]] == pytest.approx(reporter[column], rel=1e-9)
    assert reporter["length"][3:] == pytest.approx(lengths)
    assert reporter["extension"] == pytest.approx(reporter["length"] - 10)
    assert reporter["force"] == pytest.approx(reporter["extension"] * np.where(reporter["crosslink"] == 3, 0.5, 0.02))
    assert (reporter["particle_1"][-2:].tolist(), reporter["particle_2"][-2:].tolist()) == ([0, 0], [3, 4])
    with pytest.raises(InputError, match="no column 'energy': known are step, time_ps, crosslink, particle_1"):
        reporter["energy"]


@pytest.mark.parametrize("engine", ["compiled", "portable"])
def test_rest_lengths_that_nearest_images_never_have_are_refused(engine):
    # A point is farthest from another one's images where it is in the middle between eight of them.
    box = np.array([[500.0, 0.0, 0.0], [200.0, 480.0, 0.0], [-100.0, 150.0, 600.0]])
    farthest = 0.5 * np.sqrt(500.0**2 + 480.0**2 + 600.0**2)
    filaments = Filaments(VISCOSITY, TEMPERATURE, engine=engine)
    for y in (0.0, 40.0):
        filaments.add_straight(F_ACTIN.with_segment_length(100.0), 3, [0.0, y, 0.0], [1.0, 0.0, 0.0])
    _, system, positions = filaments.build(box_vectors=box)
    message = f"rest length of .* never more than {farthest:.6g} nm apart"
    too_long = Crosslinks(0.1, farthest + 1.0)
    too_long.add(None, 0, 4)
    with pytest.raises(InputError, match=message):
        too_long.add_to(system, periodic=True)
    links = Crosslinks(0.1, 10.0)
    links.add_to(system, periodic=True)
    context = new_context(system, positions)
    table = links.table(context).with_links(as_places([(0, 4)]), 0.1, farthest + 1.0, np.inf)
    for change in (
        lambda: links.add(context, 0, 4, rest_length=farthest + 1.0),
        lambda: links.add_many(context, [(0, 4), (1, 5)], rest_length=farthest + 1.0),
        lambda: links.set_table(context, table),
    ):
        with pytest.raises(InputError, match=message):
            change()
        assert len(links.table(context)) == 0
    links.add(context, 0, 4, rest_length=farthest - 1.0)


def test_bad_input_is_refused():
    for arguments, message in (
        ((0, 1), "stiffness must be positive"),
        ((np.nan, 1), "stiffness must be finite"),
        ((1 * unit.nanometer, 1), "stiffness has the unit nanometer"),
        (([1, 2], 1), "stiffness must be a single number"),
        ((1, -1), "rest_length cannot be negative"),
        ((1, 1 * unit.kelvin), "rest_length has the unit"),
        ((1, 1, "spring"), "model must be one of harmonic, fene, but is 'spring'"),
        ((1, 1, ["fene"]), "model must be one of harmonic, fene, but is"),
        ((None, 1), "stiffness must be a number"),
        ((1, 1, "fene"), "maximum_extension must be given for model 'fene'"),
        ((1, 1, "harmonic", 1), "maximum_extension must be given for model 'fene', and only for it"),
        ((1, 1, "fene", 0), "maximum_extension must be positive"),
    ):
        with pytest.raises(InputError, match=message):
            Crosslinks(*arguments)
    links, system = _linked()
    context = new_context(system, np.random.default_rng(6).uniform(size=(6, 3)))
    for arguments, message in (
        ((0, 0), "Crosslink 6 joins particle 0 to itself"),
        ((0, 6), "Crosslink 6: particle 6 does not exist; the System has 6"),
        ((-1, 0), "particle must be at least 0"),
        ((0.5, 0), "particle must be a whole number"),
        ((0, 1, -1), "Crosslink 6: stiffness must be positive"),
        ((0, 1, 1, np.inf), "Crosslink 6: rest_length must be finite"),
        ((0, 1, 1, 1, 1), "Crosslink 6: maximum_extension belongs to model 'fene' alone"),
    ):
        with pytest.raises(InputError, match=message):
            links.add(context, *arguments)
    for numbers, message in (
        (6, "Crosslink 6 does not exist"),
        ([0, 7], "Crosslink 7 does not exist"),
        (-1, "must be at least 0"),
        ("a", "must be a whole number"),
        ([0, 0], "named twice"),
    ):
        with pytest.raises(InputError, match=message):
            links.remove(context, numbers)
    for pairs, message in (
        ([[0, 1, 2]], r"pairs must have the shape \(n, 2\)"),
        ([0, 1], r"pairs must have the shape \(n, 2\)"),
        ([[0, 1], [2]], r"pairs must have the shape \(n, 2\)"),
        (None, r"pairs must have the shape \(n, 2\)"),
        ([[0, np.nan]], "particle must be a whole number"),
        ([[0, 1], [3, 3]], "Crosslink 1 joins particle 3 to itself"),
        ([[0, 9]], "Crosslink 0: particle 9 does not exist"),
    ):
        with pytest.raises(InputError, match=message):
            links.set_pairs(context, pairs)
    assert links.table(context) == links.table(None)
    fene = Crosslinks(1, 1, "fene", 1)
    fene.add(None, 0, 1)
    with pytest.raises(InputError, match="not one of crosslinks with model 'harmonic'"):
        links.set_table(context, fene.table(None))
    with pytest.raises(InputError, match="table must be a CrosslinkTable"):
        links.set_table(context, PAIRS)
    with pytest.raises(InputError, match="in a System already: give the Context"):
        links.add(None, 0, 1)
    with pytest.raises(InputError, match="already in a System"):
        links.add_to(_particles())
    with pytest.raises(InputError, match="not in a System yet"):
        fene.pairs(context)
    with pytest.raises(InputError, match="Crosslink 0: particle 1 does not exist; the System has 1"):
        fene.add_to(_particles(1))
    with pytest.raises(InputError, match="force_group must be between 0 and 31"):
        fene.add_to(_particles(), force_group=32)
    longer = Crosslinks(1, 1e4)
    longer.add(None, 0, 1)
    with pytest.raises(
        InputError, match="Crosslink 0 has a rest length of 10000 nm, but .* never more than 2.59904 nm apart"
    ):
        longer.add_to(_particles(), periodic=True)
    longer.add_to(_particles(), periodic=False)
    with pytest.raises(InputError, match="context must be an openmm.Context"):
        links.add(system, 0, 1)
    with pytest.raises(InputError, match="a System that does not have these crosslinks"):
        links.pairs(new_context(_particles(), np.zeros((6, 3))))
