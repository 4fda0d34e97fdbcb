"""What begins during runs of Cytosim, or begins bound, and the first steps of what is written."""

import math

import numpy as np
import pytest

from openmm_cylchain.cytosim.command import import_file
from openmm_cylchain.cytosim.translation import translate
from openmm_cylchain.runs.configuration import read_configuration
from openmm_cylchain.runs.created_simulation import begin, create_simulation
from openmm_cylchain.runs.dry_run import take_first_steps
from openmm_cylchain.runs.stages import stages_of
from support.cytosim_files import CELL, RUN, SECOND, SYSTEM, TUBE, translated

# Steps are those of Cytosim, which resolve less.
pytestmark = pytest.mark.filterwarnings("ignore::openmm_cylchain.TimeStepWarning")

FLAT = SYSTEM.replace("dim = 3", "dim = 2")
DISC = "set space cell { shape = circle }\nnew cell { radius = 2 }\n"
THICK = TUBE.replace("rigidity", "steric = 1, 0.02; rigidity") + "new 3 tube { length = 1 }\n"
GROWING = "set fiber tube { rigidity = 20; activity = grow; growing_speed = 0.01; confine = inside, 1000 }\n"


def event(settings, rate=3.0):
    """A command that begins fibers."""
    return f"new event {{ rate = {rate}; code = ( new tube {{ length = 0.1; plus_end = grow; {settings} }} ) }}\n"


@pytest.mark.parametrize(
    ("place", "lower", "upper"),
    [
        ("position = 1 2 3", (1000, 2000, 3000), (1000, 2000, 3000)),
        ("position = rectangle 2 4", (-1000, -2000, 0), (1000, 2000, 0)),
        ("position = (cylinder 3 0)", (-1500, 0, 0), (1500, 0, 0)),
        ("position = line 3 at 0 1 0", (-1500, 1000, 0), (1500, 1000, 0)),
        ("position = center", (0, 0, 0), (0, 0, 0)),
    ],
)
def test_events_are_at_points_and_in_thin_regions(tmp_path, place, lower, upper):
    found, document = translated(tmp_path, GROWING + event(place))
    region = found.filaments[0].nucleation.region
    np.testing.assert_allclose([region.lower, region.upper], [lower, upper], atol=2e-3)
    assert np.all(region.lower < region.upper)
    assert document.missing == []


def test_half_of_those_with_the_direction_of_a_letter_have_the_opposite_one(tmp_path):
    found, document = translated(tmp_path, GROWING + event("position = ball 1; direction = X"))
    first, second = (group.nucleation for group in found.filaments)
    assert first.rate == second.rate == pytest.approx(1.5 / SECOND)
    np.testing.assert_array_equal([first.direction, second.direction], [[1, 0, 0], [-1, 0, 0]])
    assert document.missing == []


def test_fibers_that_do_not_grow_begin_too(tmp_path):
    text = TUBE + event("position = ball 1").replace("plus_end = grow;", "")
    found, document = translated(tmp_path, text)
    (group,) = found.filaments
    assert group.is_reserve and group.growth.plus_capped and group.growth.minus_capped
    assert document.missing == []


def test_as_many_begin_in_a_disc_as_the_rate_says(tmp_path):
    # Anywhere in a circle, whose walls keep out those of the square around it.
    rate, seconds = 8000.0, 0.05
    text = GROWING + event("", rate)
    found, document = translated(tmp_path, text, FLAT, DISC, "run 50 system\n")
    assert document.missing == []
    simulation, built = create_simulation(found)
    begin(found, simulation, built)
    simulation.step(50)
    state = built.filaments.in_context(simulation.context).growth()
    count = int(np.sum(state.nodes > 0))
    expected = rate * seconds
    # A hundredth of them begin partly outside, within the softness of the wall.
    assert abs(count - expected) < 4 * math.sqrt(expected) + 0.01 * expected
    positions = simulation.context.getState(positions=True).getPositions(asNumpy=True)._value
    there = [nodes[0] for nodes, present in zip(built.filaments.node_indices, state.nodes > 0) if present]
    first = positions[there]
    assert np.all(np.abs(first[:, 2]) < 2e-3)
    # Evenly in the disc: the mean square of the distance from its middle is half of that of its radius.
    squares = np.sum(first[:, :2] ** 2, axis=1) / 2000.0**2
    assert abs(squares.mean() - 0.5) < 4 * math.sqrt(1.0 / 12.0 / count) + 0.02


COUPLE = "set hand binder { binding = 5, 0.05; unbinding = 1, 3 }\n"
COUPLE += "set couple bridge { hand1 = binder; hand2 = binder; stiffness = 100; diffusion = 1 }\n"
COUPLE += "set single pin { hand = binder; activity = fixed; stiffness = 100 }\n"


def test_hands_begin_where_they_are_attached(tmp_path):
    text = TUBE + COUPLE + "new 2 tube { length = 2; attach1 = bridge, 0.5; attach2 = bridge, 0.5, plus_end }\n"
    text += "new 3 bridge\nnew bridge { attach1 = tube2, 0.2, center }\n"
    text += "new 2 pin { position = 0 1 0 }\nnew pin { position = 0 2 0; attach = tube1, 0.25 }\n"
    found, document = translated(tmp_path, text)
    couples, pins = found.linkers
    assert couples.count == 8 and couples.bound == 5
    assert couples.bound_at == ((0, 500.0), (1, 500.0), (0, 1500.0), (1, 1500.0), (1, 1200.0))
    assert pins.bound_at == ((0, 250.0),)
    np.testing.assert_allclose(pins.anchors, [[0, 2000, 0], [0, 1000, 0], [0, 1000, 0]])
    assert document.missing == []
    simulation, built = create_simulation(found)
    begin(found, simulation, built)
    table = built.filaments.in_context(simulation.context).linkers()
    bound = [(int(own), at) for own, at in zip(table.filaments[:8, 0], table.arc_lengths[:8, 0]) if own >= 0]
    np.testing.assert_allclose(bound, couples.bound_at)
    assert table.filaments[8:, 1].tolist() == [0, -1, -1]


@pytest.mark.parametrize(
    ("unbinding", "growth"),
    [("0.1, 3", ""), ("0, inf", "; activity = grow; growing_speed = 0.1; growing_force = inf")],
)
def test_couples_begin_where_both_hands_are_attached(unbinding, growth, tmp_path):
    """Those that let go, and those that join filaments that grow for ever."""
    text = TUBE.replace(" }", growth + " }") + f"set hand glue {{ binding = 10, 0.05; unbinding = {unbinding} }}\n"
    text += "set couple joint { hand1 = glue; hand2 = glue; stiffness = 100; diffusion = 1 }\n"
    text += f"new 2 tube {{ length = 2{'; plus_end = grow' if growth else ''} }}\n"
    text += "new joint { attach1 = tube1, 0.2; attach2 = tube2, 0.5 }\n"
    found, document = translated(tmp_path, text)
    assert document.missing == []
    (couples,) = found.linkers
    assert couples.bound_at == (((0, 200.0), (1, 500.0)),)
    simulation, built = create_simulation(found)
    begin(found, simulation, built)
    table = built.filaments.in_context(simulation.context).linkers()
    assert table.filaments[0].tolist() == [0, 1]
    np.testing.assert_allclose(table.arc_lengths[0], [200.0, 500.0])


@pytest.mark.parametrize(("rate", "held"), [(0, 2), (3, 1)])
def test_hands_are_attached_to_fibers_to_which_they_do_not_bind(tmp_path, rate, held):
    """If they never bind, so that they do not come back to them."""
    text = (
        TUBE + "set fiber rod { rigidity = 20; binding_key = 2 }\nnew 2 tube { length = 2 }\nnew 2 rod { length = 2 }\n"
    )
    text += f"set hand glue {{ binding = {rate}, 0.05; unbinding = 0.1; binding_key = 1 }}\n"
    text += "set couple bridge { hand1 = glue; hand2 = glue; stiffness = 100; diffusion = 1 }\n"
    text += "new bridge { attach1 = tube1, 0.5; attach2 = rod1, 1 }\nnew bridge { attach1 = tube2, 0.5 }\n"
    found, document = translated(tmp_path, text)
    (group,) = found.linkers
    assert len(group.bound_at) == held and group.count == 2
    assert document.missing == ([] if held == 2 else ["linkers that begin bound at given places"])
    simulation, built = create_simulation(found)
    begin(found, simulation, built)
    assert np.sum(built.filaments.in_context(simulation.context).linkers().filaments >= 0) == (3 if held == 2 else 1)


NUCLEATOR = """set hand maker { unbinding = 0, 3; activity = nucleate;
 nucleate = 40, tube, ( length = 0.2; plus_end = grow ) }
set single seed { hand = maker; activity = fixed; stiffness = 1000 }
new 20 seed { position = ball 3 }
"""


def test_nucleators_make_one_fiber_each_and_hold_it(tmp_path):
    found, document = translated(tmp_path, GROWING + NUCLEATOR, run="run 100 system\n")
    assert document.missing == []
    assert [group.count for group in found.filaments] == [1] * 20
    simulation, built = create_simulation(found)
    begin(found, simulation, built)
    there = []
    for _ in range(4):
        simulation.step(15)
        growth = built.filaments.in_context(simulation.context).growth()
        there.append(int(np.sum(growth.nodes > 0)))
    # Each at its own rate: after a time t, a share of 1 - exp(-rate t) has one.
    expected = 20 * (1.0 - np.exp(-40 * 0.015 * np.arange(1, 5)))
    assert np.all(np.abs(there - expected) < 4 * np.sqrt(20 * 0.25))
    table = built.filaments.in_context(simulation.context).linkers()
    bound = np.flatnonzero(table.filaments[:, 1] >= 0)
    assert len(bound) >= there[-1] - 1
    positions = simulation.context.getState(positions=True).getPositions(asNumpy=True)._value
    for number in bound:
        first = positions[built.filaments.node_indices[table.filaments[number, 1]][0]]
        assert np.linalg.norm(first - found.linkers[0].anchors[number]) < 20.0
        assert table.arc_lengths[number, 1] < 10.0


def test_nucleators_that_diffuse_make_one_fiber_each_where_they_are(tmp_path):
    cell = "set space cell { shape = square }\nnew cell { length = 8, 8, 8 }\n"
    cell += "set space floor { shape = strip }\nnew floor { length = 6, 4; bottom = -1; top = -1 }\n"
    single = "set single seed { hand = maker; diffusion = 1; confine = on,, floor }\nnew 60 seed\n"
    maker = NUCLEATOR.partition("set single")[0]
    found, document = translated(tmp_path, GROWING + maker + single, cell=cell, run="run 100 system\n")
    assert document.missing == [] and document.tables_called("[[linkers]]") == []
    assert [group.count for group in found.filaments] == [1] * 60
    simulation, built = create_simulation(found)
    begin(found, simulation, built)
    simulation.step(20)
    nodes = built.filaments.in_context(simulation.context).growth().nodes
    # A share of 1 - exp(-rate t), uniform in the floor.
    share = 1.0 - math.exp(-40 * 0.02)
    assert abs(np.sum(nodes > 0) - 60 * share) < 4 * math.sqrt(60 * share * (1 - share))
    positions = simulation.context.getState(positions=True).getPositions(asNumpy=True)._value
    first = np.array([positions[own[0]] for own, count in zip(built.filaments.node_indices, nodes) if count])
    assert np.abs(first[:, 2] + 1000).max() < 300
    assert np.all(first[:, :2].max(axis=0) < [3100, 2100]) and np.all(np.ptp(first[:, :2], axis=0) > [4000, 2700])


def test_nucleators_that_let_go_make_others(tmp_path):
    maker = NUCLEATOR.partition("set single")[0].replace("unbinding = 0, 3", "unbinding = 10")
    text = GROWING + maker + "set single seed { hand = maker; diffusion = 1 }\nnew 30 seed\n"
    found, document = translated(tmp_path, text)
    assert document.missing == []
    (group,) = found.filaments
    # In each, 1/40 s for making one and 1/10 s for letting go.
    assert group.nucleation.rate == pytest.approx(30 / (1 / 40 + 1 / 10) / SECOND, rel=1e-6)
    assert "each of which makes one at nucleate = 40 and lets go at 10" in document.text()


@pytest.mark.parametrize("single", ["confine = surface", "diffusion = 1; hand = other"])
def test_other_nucleators_are_left_out(tmp_path, single):
    maker = NUCLEATOR.partition("set single")[0]
    text = GROWING + maker + maker.replace("maker", "other").replace("unbinding", "addictive = 1; unbinding")
    text += f"set single seed {{ hand = maker; {single} }}\nnew 5 seed\nnew tube {{ length = 1 }}\n"
    _, document = translated(tmp_path, text)
    assert "hands: nucleate" in document.missing


def test_steps_are_shorter_where_the_first_ones_have_no_solution(tmp_path):
    # An aster outside of its cell, whose walls push it in.
    text = "set fiber tube { rigidity = 30; segmentation = 1; confine = inside, 100 }\nset solid core { }\n"
    text += "set aster star { stiffness = 1000, 500 }\n"
    text += "new star { solid = core; radius = 0.5; point1 = center, 0.5; fibers = 2, tube, ( length = 1 ); "
    text += "type = custom; fiber1 = 0 0 0, 0 1 0; fiber2 = 0 0 0, 0 -1 0; position = -5 0 0; direction = 1 0 0 }\n"
    system = "set simul system { time_step = 0.005; viscosity = 0.01; kT = 0.0042; dim = 3 }\n"
    path = tmp_path / "my.cym"
    cell = "set space cell { shape = sphere }\nnew cell { radius = 5 }\n"
    path.write_text(system + cell + text + RUN)
    steps = {}
    for trial in (False, True):
        output = tmp_path / f"{trial}.toml"
        import_file(path, output, trial=trial)
        found = read_configuration(output)
        steps[trial] = found.simulation.time_step
        assert found.simulation.steps * found.simulation.time_step == pytest.approx(5 * SECOND)
    assert steps[False] == 5e9
    assert steps[True] < 5e9
    assert "0.005 s in Cytosim, in which the first steps have no solution" in (tmp_path / "True.toml").read_text()
    simulation, built = create_simulation(found)
    begin(found, simulation, built)
    simulation.step(100)


def test_steps_are_shorter_where_later_ones_have_no_solution(tmp_path):
    # Crossed in a plane, in which neither lets the other one through: it takes 300 steps to tell.
    text = "set simul system { time_step = 0.005; kT = 0.0042; steric = 1, 400; dim = 2 }\n"
    text += "set space dish { shape = circle }\nnew dish { radius = 1.1 }\n"
    text += "set fiber rod { rigidity = 1; segmentation = 0.2; confine = inside, 100; steric = 1, 0.05 }\n"
    text += "new rod { length = 1; position = 0 0 0; direction = 1 0 0 }\n"
    text += "new rod { length = 1; position = 0 0 0; direction = 0 1 0 }\nrun 10000 system { nb_frames = 10 }\n"
    path, output = tmp_path / "my.cym", tmp_path / "my.toml"
    path.write_text(text)
    said = import_file(path, output, trial=True)
    found = read_configuration(output)
    assert found.simulation.time_step < 5e9
    assert not any("were tried" in line for line in said)
    simulation, built = create_simulation(found)
    begin(found, simulation, built)
    simulation.step(1000)


@pytest.mark.parametrize(("system", "change"), [("steric = 1, 10", ""), ("", "change system { steric = 1, 10 }\n")])
def test_contacts_with_which_no_step_can_be_taken_are_turned_off(tmp_path, monkeypatch, system, change):
    """From the beginning, and in a later stage."""

    def trouble(configuration):
        touch = any(stage.configuration.contacts is not None for stage in stages_of(configuration))
        return ("Filament 0 would pass through filament 1." if touch else None), None

    monkeypatch.setattr("openmm_cylchain.cytosim.trial._trouble", trouble)
    path, output = tmp_path / "my.cym", tmp_path / "my.toml"
    path.write_text(SYSTEM.replace("dim", f"{system}; dim") + CELL + THICK + RUN + change + RUN)
    said = import_file(path, output, trial=True)
    assert any(
        "contacts, with which the first steps have no solution, however short: Filament 0" in own for own in said
    )
    found = read_configuration(output)
    assert found.simulation.time_step == 1e9
    assert not any(stage.configuration.contacts for stage in stages_of(found))
    # They can be turned on again.
    assert output.read_text().count("active = false") == 1
    output.write_text(output.read_text().replace("active = false", "active = true"))
    assert stages_of(read_configuration(output))[-1].configuration.filaments[0].contact_diameter == 40


@pytest.mark.parametrize(("longest", "parts"), [(0.3e9, 5), (0.0, 1)])
def test_slow_steps_that_are_divided_are_shorter_where_these_are_not(tmp_path, monkeypatch, longest, parts):
    def few_steps(stages, current, count, most_seconds, stop):
        for stage in stages:
            yield stage, 3, 0.2 if stage.configuration.simulation.time_step > longest else 0.05

    monkeypatch.setattr("openmm_cylchain.runs.dry_run.take_first_steps", few_steps)
    path, output = tmp_path / "my.cym", tmp_path / "my.toml"
    path.write_text(SYSTEM.replace("dim", "steric = 1, 10; dim") + CELL + THICK + RUN)
    said = import_file(path, output, trial=True)
    assert "  Not all of the first steps were tried, since they are slow: the run." in said
    assert "  left out: nothing" in said
    assert read_configuration(output).simulation.time_step == pytest.approx(1e9 / parts)


def test_the_share_of_divided_steps_is_that_of_each_stage(tmp_path):
    path, output = tmp_path / "my.cym", tmp_path / "my.toml"
    change = "change tube { rigidity = 10 }\n"
    path.write_text(SYSTEM + CELL + TUBE + "new 3 tube { length = 1 }\n" + RUN + change + RUN)
    import_file(path, output)
    stages = stages_of(read_configuration(output))
    first = create_simulation(stages[0].configuration)
    begin(stages[0].configuration, *first)
    counts = iter([10, 16])
    first[0].integrator.checks = False
    first[0].integrator.getNumDividedSteps = lambda: next(counts)
    assert [taken[1:] for taken in take_first_steps(stages, first, 4)] == [(4, 0.5), (4, 0.0)]


def test_first_steps_of_beads_in_a_periodic_space(tmp_path):
    text = SYSTEM.replace("dim", "steric = 1, 100; dim") + "set space cell { shape = periodic }\n"
    text += "new cell { length = 4, 4, 4 }\nset bead ball { steric = 1 }\nnew 20 ball { radius = 0.3 }\n" + RUN
    path = tmp_path / "my.cym"
    path.write_text(text)
    said = import_file(path, tmp_path / "my.toml", trial=True)
    assert "  left out: nothing" in said
    found = read_configuration(tmp_path / "my.toml")
    assert found.contacts is not None and found.filaments == ()


def test_what_there_was_no_time_to_try_is_said(tmp_path, monkeypatch):
    path = tmp_path / "my.cym"
    path.write_text(FLAT + DISC + TUBE + "new 3 tube { length = 1 }\n" + RUN + "change tube { rigidity = 10 }\n" + RUN)
    assert not any("were tried" in line for line in import_file(path, tmp_path / "tried.toml", trial=True))
    monkeypatch.setattr("openmm_cylchain.cytosim.trial._MOST_SECONDS", 0.0)
    said = import_file(path, tmp_path / "my.toml", trial=True)
    assert "  Not all of the first steps were tried, since they are slow: run 1, run 2." in said
    # Nor for filaments to come apart, those of a later run among them.
    thick = path.read_text().replace("rigidity", "steric = 1, 0.05; rigidity", 1).replace("dim", "steric = 1, 9; dim")
    path.write_text(thick)
    said = import_file(path, tmp_path / "thick.toml", trial=True)
    assert "  Its filaments overlap, and do not come apart within 0 s: it may not run." in said


def test_spaces_that_deform_keep_their_shapes_and_say_so(tmp_path):
    cell = "set space cell { shape = dynamic_ellipse; tension = 1 }\nnew cell { length = 5, 5, 4 }\n"
    path = tmp_path / "my.cym"
    path.write_text(SYSTEM + cell + TUBE + "new 3 tube { length = 1 }\n" + RUN)
    document = translate(path, "my").document
    assert document.missing == ["spaces: dynamic_ellipse"]
    assert document.tables_called("[[filament]]")[0].value("inside")["shape"] == "ellipsoid"
