"""Crosslinks between places on segments, particles and fixed points: both engines give the same, in the same words."""

import re

import numpy as np
import openmm
import pytest
from openmm import app, unit

from openmm_cylchain import F_ACTIN, CrosslinkReporter, Crosslinks, CrosslinkTable, Filaments, InputError, SegmentPlace
from openmm_cylchain.engines.compiled import CylinderChainForce, plugin
from support.contexts import energy_of, forces_of, new_context, new_simulation, positions_of
from support.crosslinked_filaments import crosslinked_filaments
from support.platforms import ENGINES
from support.solvent import TEMPERATURE, VISCOSITY

POINT = [100.0, -40.0, 5.0]


def two_filaments(engine, model="harmonic", periodic=False, attached=True):
    """Two filaments with two attachment points and a System with crosslinks of their own kind."""
    filaments = Filaments(VISCOSITY, TEMPERATURE, engine=engine)
    for y in (0, 60):
        filaments.add_straight(F_ACTIN, 4, [0, y, 0], [1, 0.1, 0])
    if attached:
        filaments.add_attachment(0, segment=1, fraction=0.3)
        filaments.add_attachment(1, segment=2, fraction=0.75)
    box = [[1800.0, 0, 0], [100.0, 1700.0, 0], [-60.0, 90.0, 1600.0]] * unit.nanometer
    _, system, positions = filaments.build(box)
    links = Crosslinks(0.02, 10.0, model, 2000.0 if model == "fene" else None)
    return filaments, system, positions, links


def places_of(filaments):
    """Pairs of all kinds of places."""
    first, second = filaments.segment_place(0, segment=1, fraction=0.3), filaments.segment_place(1, arc_length=500)
    nodes = [int(node) for nodes in filaments.node_indices for node in nodes[[0, -1]]]
    return [
        (first, second),
        (first, nodes[2]),
        (nodes[1], second),
        (nodes[0], nodes[3]),
        (second, POINT),
        (np.array(POINT) * 10 * unit.angstrom, nodes[3]),
        (int(filaments.attachment_indices[0]), int(filaments.attachment_indices[1])),
    ]


@pytest.mark.parametrize("periodic", [False, True])
@pytest.mark.parametrize("model", ["harmonic", "fene"])
def test_engines_agree(model, periodic):
    results = []
    for engine in ENGINES:
        filaments, system, positions, links = two_filaments(engine, model)
        links.add_many(None, places_of(filaments)[:3])
        force = links.add_to(system, force_group=5, periodic=periodic)
        assert isinstance(force, plugin.CylinderChainLinkForce) == (engine == "compiled")
        assert force.getName() == "Crosslinks" and force.usesPeriodicBoundaryConditions() == periodic
        if periodic:
            positions[filaments.node_indices[1]] += [1700, 100, 0] * unit.nanometer
        moved = positions._value + np.random.default_rng(2).normal(scale=3, size=positions._value.shape)
        context = new_context(system, moved)
        context.computeVirtualSites()
        assert links.add_many(context, places_of(filaments)[3:], stiffness=0.05, rest_length=2.0).tolist() == [
            3,
            4,
            5,
            6,
        ]
        links.set_active(context, [4, 0], False)
        links.set_active(context, 0, True)
        links.remove(context, 2)
        assert links.numbers(context).tolist() == [0, 1, 3, 4, 5, 6]
        table = links.table(context)
        assert table.active.tolist() == [True, True, True, False, True, True]
        assert links.forces(context)[3] == 0 and np.abs(links.forces(context)[[0, 1, 2, 4, 5]]).min() > 0
        at = positions_of(context)
        ends = [table.places.positions(at, side) for side in (0, 1)]
        vectors = ends[1] - ends[0]
        if periodic:
            box = context.getState().getPeriodicBoxVectors(asNumpy=True)._value
            shifts = np.array([[i, j, k] for i in range(-2, 3) for j in (-1, 0, 1) for k in (-1, 0, 1)]) @ box
            lengths = np.linalg.norm(vectors[:, None] + shifts, axis=2).min(axis=1)
        else:
            lengths = np.linalg.norm(vectors, axis=1)
        assert links.lengths(context) == pytest.approx(lengths)
        assert links.extensions(context) == pytest.approx(lengths - table.rest_length)
        assert table.rest_length.tolist() == [10, 10, 2, 2, 2, 2]
        nodes = np.concatenate(filaments.node_indices)
        numbers = [getattr(links, name)(context).tolist() for name in ("numbers", "pairs", "lengths", "forces")]
        results.append((table, numbers, energy_of(context, {5}), forces_of(context, {5})[nodes], lengths))
    (one, numbers, energy, forces, _), (other, others, same_energy, same_forces, _) = results
    assert one == other
    assert (
        numbers[:2] == others[:2] and numbers[2] == pytest.approx(others[2]) and numbers[3] == pytest.approx(others[3])
    )
    assert energy > 0.1 and energy == pytest.approx(same_energy, rel=1e-10)
    assert np.abs(forces).max() > 0.1 and forces == pytest.approx(same_forces, rel=1e-9, abs=1e-12)


@pytest.mark.parametrize("engine", ENGINES)
def test_places_on_segments_are_attachment_points(engine):
    energies, steps = [], []
    for attached in (True, False):
        filaments, system, positions, links = two_filaments(engine)
        places = filaments.attachment_indices
        if not attached:
            places = filaments.segment_place(0, segment=1, fraction=0.3), filaments.segment_place(1, 500 * 0.55)
            places = places[0], filaments.segment_place(1, segment=2, fraction=0.75)
        links.add(None, *places)
        links.add(None, places[0], 7)
        links.add_to(system)
        recommended = filaments.recommended_time_step("midpoint", system=system)
        (step,) = (value for name, value in recommended.allowed.items() if "Crosslinks" in name)
        steps.append(step)
        integrator = filaments.create_integrator(system, 1e4, scheme="midpoint", random_seed=4)
        context = new_context(system, positions, integrator)
        context.computeVirtualSites()
        integrator.step(20)
        energies.append([energy_of(context), *links.lengths(context), *positions_of(context)[:5].ravel()])
    assert energies[0] == pytest.approx(energies[1], rel=1e-9)
    assert steps[0] == pytest.approx(steps[1], rel=1e-6)


def test_the_place_of_a_filament():
    filaments, _, _, _ = two_filaments("portable")
    nodes = filaments.node_indices[1]
    assert filaments.segment_place(1, segment=-1) == SegmentPlace(int(nodes[3]), int(nodes[4]), 0.5)
    length = F_ACTIN.segment_length
    place = filaments.segment_place(1, arc_length=2.25 * length)
    assert (place.first, place.second) == (nodes[2], nodes[3]) and place.fraction == pytest.approx(0.25)
    ring = Filaments(VISCOSITY, TEMPERATURE)
    ring.add_ring(F_ACTIN, 6, [0, 0, 0], [0, 0, 1])
    with pytest.raises(InputError):
        ring.segment_place(0, segment=0)
    ring.build()
    assert ring.segment_place(0, segment=5, fraction=0.1) == SegmentPlace(5, 0, 0.1)
    for arguments, message in (
        ({"segment": 4}, "Place on a segment: segment 4 does not exist"),
        ({}, "Place on a segment: give either"),
        ({"segment": 0, "fraction": 1.5}, "fraction must be a number between 0 and 1"),
    ):
        with pytest.raises(InputError, match=message):
            filaments.segment_place(1, **arguments)
    with pytest.raises(InputError):
        filaments.segment_place(2, segment=0)
    for arguments, message in (
        ((0, 0, 0.5), "between particle 0 and itself"),
        ((-1, 0, 0.5), "particle first must be at least 0"),
        ((0, 1.5, 0.5), "particle second must be a whole number"),
        ((0, 1, 1.1), "fraction must be a number between 0 and 1"),
        ((0, 1, np.nan), "fraction must be a number between 0 and 1"),
        ((0, 1, "x"), "fraction must be a number between 0 and 1"),
    ):
        with pytest.raises(InputError, match=message):
            SegmentPlace(*arguments)


def refusals(engine):
    """What both engines say of the same mistakes."""
    filaments, system, positions, links = two_filaments(engine)
    links.add_many(None, places_of(filaments))
    links.add_to(system)
    context = new_context(system, positions)
    place = filaments.segment_place(0, segment=1, fraction=0.3)
    turned = SegmentPlace(place.second, place.first, 1 - place.fraction)
    before = links.table(context)
    without = new_context(two_filaments(engine)[1], positions)
    calls = [
        lambda: links.add(context, place, turned),
        lambda: links.add(context, place.first, SegmentPlace(place.first, 3, 0.0)),
        lambda: links.add(context, place, SegmentPlace(0, 99, 0.5)),
        lambda: links.add(context, POINT, [0, 0, 1]),
        lambda: links.add(context, 0, [0, 0]),
        lambda: links.add(context, 0, [0, 0, np.nan]),
        lambda: links.add(context, 0, [0, 0, 1] * unit.kelvin),
        lambda: links.add(context, 0, 1, rest_length=-1),
        lambda: links.add_many(context, [(0, 1), (2, 2)]),
        lambda: links.add_many(context, [(0, 1), (2, 99)]),
        lambda: links.add_many(context, [(0, 1, 2)]),
        lambda: links.add_many(context, 3),
        lambda: links.add_many(context, np.array([[0, -1]])),
        lambda: links.set_active(context, 99, True),
        lambda: links.set_active(context, [0, 0], True),
        lambda: links.set_active(context, "a", True),
        lambda: links.set_active(None, 0, True),
        lambda: links.remove(context, [1, 1]),
        lambda: links.remove(context, 99),
        lambda: links.set_pairs(context, [(place, place)]),
        lambda: links.set_table(context, 3),
        lambda: links.add(None, 0, 1),
        lambda: links.add_to(system),
        lambda: links.pairs(without),
    ]
    said = []
    for call in calls:
        with pytest.raises(InputError) as caught:
            call()
        said.append(re.sub("0x[0-9a-f]+", "", str(caught.value)))
    assert links.table(context) == before
    return said


def test_engines_say_the_same_of_mistakes():
    said = refusals("portable")
    assert said == refusals("compiled")
    assert said[0] == "Crosslink 7 joins the place 0.3 from particle 1 to 2 to itself."
    assert said[1] == "Crosslink 7 joins particle 1 to itself."
    assert said[2].startswith("Crosslink 7: particle 99 does not exist; the System has")
    assert said[3].startswith("A crosslink cannot join two fixed points")
    assert said[4].startswith("The fixed point of a crosslink must have three components")
    assert said[8] == "Crosslink 8 joins particle 2 to itself."
    assert said[13] == "Crosslink 99 does not exist."
    assert said[14] == "A crosslink to be switched is named twice."


@pytest.mark.parametrize("engine", ENGINES)
def test_files_and_xml(engine, tmp_path):
    filaments, system, positions, links = two_filaments(engine, "fene")
    links.add_many(None, places_of(filaments))
    links.set_active(None, [1, 4], False)
    links.remove(None, 2)
    links.table(None).save(tmp_path / "table.npz")
    assert CrosslinkTable.load(tmp_path / "table.npz") == links.table(None)
    links.add_to(system)
    duplicate = openmm.XmlSerializer.clone(system)
    (read,) = Crosslinks.from_system(duplicate)
    assert read.table(None) == links.table(None) and read.model == "fene"
    of_force = next(filter(None, map(Crosslinks.of_force, duplicate.getForces())))
    contexts = new_context(system, positions), new_context(duplicate, positions)
    assert energy_of(contexts[0]) == energy_of(contexts[1]) > 0
    for one, context in ((links, contexts[0]), (read, contexts[1]), (of_force, contexts[1])):
        assert one.table(context) == links.table(None)
    assert of_force.add(contexts[1], 0, 9) == read.table(contexts[1]).numbers[-1] == 7
    assert read.table(contexts[1]).maximum_extension[-1] == 2000.0
    with pytest.raises(InputError, match="a System that does not have these crosslinks"):
        of_force.pairs(new_context(two_filaments(engine)[1], positions))
    # Columns that tables did not have at first.
    plain = CrosslinkTable([0], [[0, 1]], [1.0], [0.0], [np.inf], 1)
    assert plain.active.tolist() == [True] and plain.partners.tolist() == [[-1, -1]]
    np.savez(tmp_path / "old.npz", numbers=[0], pairs=[[0, 1]], stiffness=[1.0], rest_length=[0.0],
             maximum_extension=[np.inf], next_number=1)  # fmt: skip
    assert CrosslinkTable.load(tmp_path / "old.npz") == plain
    for bad in ({"fractions": [[0, 2]]}, {"points": [[0, 0, np.nan]]}, {"active": [True, False]}):
        with pytest.raises(InputError, match="table of crosslinks"):
            CrosslinkTable([0], [[0, 1]], [1.0], [0.0], [np.inf], 1, **bad)


@pytest.mark.parametrize("engine", ENGINES)
def test_reports_of_places(engine):
    filaments, system, positions, links = two_filaments(engine)
    links.add_many(None, places_of(filaments)[:5])
    links.set_active(None, 1, False)
    links.add_to(system)
    topology = app.Topology()
    residue = topology.addResidue("X", topology.addChain())
    for _ in range(system.getNumParticles()):
        topology.addAtom("X", None, residue)
    integrator = filaments.create_integrator(system, 1e4, scheme="midpoint", random_seed=2)
    simulation = new_simulation(topology, system, positions, integrator)
    reporter = CrosslinkReporter(None, 5, links)
    simulation.reporters.append(reporter)
    simulation.step(10)
    lengths, forces = links.lengths(simulation.context), links.forces(simulation.context)
    assert reporter["length"][5:] == pytest.approx(lengths) and reporter["force"][5:] == pytest.approx(forces)
    assert np.all((reporter["force"] == 0) == (reporter["crosslink"] == 1)) and reporter.count.tolist() == [5, 5]
    # The first particle of a segment, and none for a point.
    segment = filaments.segment_place(1, arc_length=500)
    assert reporter["particle_1"][4] == segment.first and reporter["particle_2"][4] == -1


def test_which_force_computes_them():
    """That of the compiled engine where its filaments are in the System before the crosslinks."""
    filaments = Filaments(VISCOSITY, TEMPERATURE, engine="compiled")
    filaments.add_straight(F_ACTIN, 2, [0, 0, 0], [1, 0, 0])
    system = openmm.System()
    assert isinstance(Crosslinks(1, 1).add_to(system), openmm.PythonForce)
    assert isinstance(Crosslinks(1, 1).add_to(filaments.build()[1]), plugin.CylinderChainLinkForce)


def test_crosslinks_without_the_compiled_engine(without_compiled):
    filaments, system, positions, links = two_filaments("portable")
    links.add_many(None, places_of(filaments))
    assert isinstance(links.add_to(system), openmm.PythonForce)
    assert len(Crosslinks.from_system(system)) == 1 and len(links.lengths(new_context(system, positions))) == 7


def test_states_that_do_not_hold_the_links_of_the_compiled_engine():
    links, system, positions, integrator = crosslinked_filaments("compiled")
    first = new_context(system, positions, integrator)
    links.add(first, 0, 3)
    state, table = first.getState(positions=True, parameters=True), links.table(first)
    complete = first.getState(positions=True, parameters=True, integratorParameters=True)
    clone = openmm.XmlSerializer.clone(integrator)
    second = new_context(system, positions, clone)
    second.setState(state)
    message = "The crosslinks of this Context are not known.*Crosslinks.set_table"
    for call in (
        links.pairs,
        links.lengths,
        lambda context: links.add(context, 0, 4),
        lambda context: links.remove(context, 0),
    ):
        with pytest.raises(InputError, match=message):
            call(second)
    with pytest.raises(openmm.OpenMMException, match=r"not known.*Crosslinks.set_table"):
        second.getIntegrator().step(1)
    links.set_table(second, table)
    assert links.table(second) == table and energy_of(second) == energy_of(first)
    third = new_context(system, positions, openmm.XmlSerializer.clone(integrator))
    third.setState(complete)
    assert links.table(third) == table
    # An integrator of filaments says it as an error of input.
    links, system, positions, integrator = crosslinked_filaments("compiled")
    context = new_context(system, positions, integrator)
    context.setState(state)
    with pytest.raises(InputError, match="not known"):
        integrator.step(1)


def test_forces_that_crosslinks_have_not_made():
    """A CylinderChainLinkForce of one potential is one of Crosslinks, too; the recommended step knows its stiffness."""
    kind = plugin.CylinderChainLinkForce
    filaments, system, positions, links = two_filaments("compiled")
    links.add(None, *places_of(filaments)[0])
    links.add_to(system)
    step = filaments.recommended_time_step("midpoint", system=system)
    other_filaments, other, _, _ = two_filaments("compiled")
    force = kind()
    ends = [value for place in places_of(filaments)[0] for value in (place.first, place.second, place.fraction)]
    force.addLink(*ends, kind.Harmonic, 10.0, 0.02, 0.0)
    other.addForce(force)
    found = Crosslinks.of_force(force)
    assert found.model == "harmonic" and found.table(None) == links.table(None)
    same = other_filaments.recommended_time_step("midpoint", system=other)
    assert [value for name, value in same.allowed.items() if "CylinderChainLinkForce" in name] == pytest.approx(
        [value for name, value in step.allowed.items() if "Crosslinks" in name]
    )
    context = new_context(other, positions)
    assert found.add(context, 0, 9) == 1
    force.addLinkInContext(context, 0, -1, 0, 8, -1, 0, kind.FENE, 1.0, 1.0, 9.0)
    with pytest.raises(InputError, match="links that are not of model 'harmonic'"):
        found.pairs(context)
    force.addLink(0, -1, 0, 8, -1, 0, kind.FENE, 1.0, 1.0, 9.0)
    assert Crosslinks.of_force(force) is None
    assert any("CylinderChainLinkForce" in name for name in
               other_filaments.recommended_time_step("midpoint", system=other).unknown_forces)  # fmt: skip
    assert Crosslinks.of_force(next(one for one in other.getForces() if CylinderChainForce.isinstance(one))) is None


@pytest.mark.parametrize("engine", ENGINES)
def test_many_at_once(engine):
    filaments, system, positions, links = two_filaments(engine)
    links.add_to(system)
    context = new_context(system, positions)
    generator = np.random.default_rng(3)
    pairs = generator.integers(0, 5, (10_000, 2)) + [0, 6]
    numbers = links.add_many(context, pairs)
    assert np.array_equal(numbers, np.arange(10_000)) and np.array_equal(links.pairs(context), pairs)
    before = energy_of(context)
    links.set_active(context, numbers[::2], False)
    links.remove(context, numbers[1::4])
    kept = links.table(context)
    assert len(kept) == 7500 and np.array_equal(kept.numbers[kept.active], numbers[3::4])
    assert energy_of(context) < 0.3 * before
    assert links.add_many(context, []).tolist() == [] and links.table(context) == kept
    links.set_pairs(context, pairs[:100])
    assert links.numbers(context).tolist() == list(range(100))
