"""Filaments that begin in planes, hands that begin bound at places, and filaments that have to be shifted."""

import numpy as np
import openmm
import pytest

from openmm_cylchain import find_contacts
from openmm_cylchain.couplings.capsule_contacts import as_capsule_contact_force
from openmm_cylchain.couplings.planar_crossings import find_planar_crossing
from openmm_cylchain.errors import InputError, InstabilityError
from openmm_cylchain.runs.configuration import parse_configuration
from openmm_cylchain.runs.created_simulation import begin, create_simulation
from openmm_cylchain.runs.initial_state import build_system
from openmm_cylchain.runs.keys import ConfigurationError, Place
from openmm_cylchain.runs.relaxation import relaxed_positions
from openmm_cylchain.runs.tables.shapes import REGION, Region
from openmm_cylchain.systems.filaments import Filaments
from openmm_cylchain.time_steps.hard_contacts import longest_resolving_step

HEAD = '[solvent]\ntemperature = "298 K"\nviscosity = "10 mPa*s"\n'
TAIL = '[simulation]\ntime_step = "20 us"\nduration = "20 ms"\nreport_interval = "10 ms"\nplatform = "Reference"\n'
FILAMENTS = (
    '[[filament]]\ntype = "MICROTUBULE"\nsegment_length = "500 nm"\nsegments = 2\ncount = 3\nstart = "straight"\n'
)
LINKERS = (
    '[[linkers]]\nname = "own"\ncount = 6\nvolume = "1 um^3"\nstiffness = "0.1 pN/nm"\nrest_length = "40 nm"\n'
    'hand = { binding_rate = "1 1/s", reach = "50 nm", unbinding_rate = "0 1/s" }\n'
    'bound_at = [{ filament = [0, 2], arc_length = "1 um" }, { filament = 1, arc_length = "250 nm" }]\n'
)
NUCLEATION = (
    '[[monomers]]\nname = "own"\nlength = "4 nm"\nplus_on_rate = "1 1/(uM*s)"\nconcentration = "1 uM"\n'
    '[[nucleation]]\nname = "MINE"\ndiameter = "7 nm"\nsegment_length = "100 nm"\npersistence_length = "2 um"\n'
    'stretching_modulus = "20 nN"\ngrowth = { monomers = "own", longest = "600 nm" }\nlength = "300 nm"\n'
    'count = 40\ntotal_rate = "4000 1/s"\nplanar = true\n'
    'inside = { shape = "box", lower = ["-1 um", "-1 um", "-0.2 um"], upper = ["1 um", "1 um", "0.2 um"] }\n'
)
pytestmark = pytest.mark.filterwarnings("ignore::openmm_cylchain.TimeStepWarning")


def begun(text):
    """The Simulation and the BuiltSystem of a text."""
    configuration = parse_configuration(HEAD + text + TAIL)
    simulation, built = create_simulation(configuration)
    begin(configuration, simulation, built)
    return simulation, built


def test_hands_are_bound_where_they_are_told():
    simulation, built = begun(FILAMENTS + LINKERS)
    table = built.filaments.in_context(simulation.context).linkers()
    assert table.filaments[:, 0].tolist() == [0, 2, 1, -1, -1, -1]
    assert np.all(table.filaments[:, 1] == -1)
    np.testing.assert_allclose(table.arc_lengths[:3, 0], [1000.0, 1000.0, 250.0])


def test_both_hands_are_bound_where_they_are_told():
    both = 'arc_length = "1 um", second_filament = [1, 0], second_arc_length = "500 nm"'
    simulation, built = begun(FILAMENTS + LINKERS.replace('arc_length = "1 um"', both))
    table = built.filaments.in_context(simulation.context).linkers()
    assert table.filaments[:4].tolist() == [[0, 1], [2, 0], [1, -1], [-1, -1]]
    np.testing.assert_allclose(table.arc_lengths[:2], [[1000.0, 500.0], [1000.0, 500.0]])


@pytest.mark.parametrize(
    ("old", "new", "message"),
    [
        ('"1 um" }', '"1 um", second_filament = 1, second_arc_length = "0 nm" }', "2 numbers, and second_filament 1"),
        ('"1 um" }', '"1 um", second_filament = [1, 1] }', "second_arc_length"),
        ('"1 um" }', '"1 um", second_arc_length = "0 nm" }', "needs a second_filament"),
        ("bound_at", "bound = 2\nbound_at", "bound.*cannot be with bound_at"),
        ("[0, 2]", "[0, 3]", "filament 3 does not exist"),
        ('"1 um" }, {', '"2 um" }, {', "beyond the end of filament 0"),
        ("count = 6", "count = 2", "3 are to begin bound, but there are only 2"),
    ],
)
def test_places_that_are_none_are_refused(old, new, message):
    text = HEAD + FILAMENTS + LINKERS.replace(old, new) + TAIL
    with pytest.raises(ConfigurationError, match=message):
        configuration = parse_configuration(text)
        build_system(configuration, configuration.simulation.engine, 1)


def test_filaments_begin_and_stay_in_planes():
    simulation, built = begun(NUCLEATION)
    simulation.step(500)
    positions = simulation.context.getState(positions=True).getPositions(asNumpy=True)._value
    growth = built.filaments.in_context(simulation.context).growth()
    there = np.flatnonzero(growth.nodes > 0)
    assert len(there) > 20
    shapes = [positions[built.filaments.node_indices[own][: growth.nodes[own]]] for own in there]
    assert max(float(np.ptp(nodes[:, 2])) for nodes in shapes) < 1e-9
    assert np.ptp([nodes[0, 2] for nodes in shapes]) > 100.0
    with pytest.raises(ConfigurationError, match="direction must lie in the xy plane"):
        parse_configuration(HEAD + NUCLEATION + "direction = [0, 0, 1]\n" + TAIL)


@pytest.mark.parametrize("planar", [False, True])
def test_filaments_that_cannot_come_apart_are_shifted(planar, monkeypatch):
    flat = "planar = true\n" if planar else ""
    text = "".join(
        FILAMENTS.replace("count = 3", f'position = ["0 nm", "{y} nm", "0 nm"]\ndirection = [1, 0, 0]\n{flat}')
        for y in (0, 30)
    )
    contacts = '[contacts]\ndiameter = "40 nm"\nstiffness = "1 pN/nm"\n'
    configuration = parse_configuration(HEAD + text + contacts + TAIL)
    built = build_system(configuration, configuration.simulation.engine, configuration.simulation.seed)
    apart = relaxed_positions(configuration, built)._value
    begun_at, failures = [], 1
    make = Filaments.create_integrator

    def failing(*arguments, **options):
        integrator = make(*arguments, **options)
        step = integrator.step

        def one(count):
            if len(begun_at) < failures:
                begun_at.append(0)
                raise InstabilityError("Filament 1 has blown up", filament=1, segment=0)
            step(count)

        integrator.step = one
        return integrator

    monkeypatch.setattr(Filaments, "create_integrator", failing)
    shifted = relaxed_positions(configuration, built)._value
    ends = [positions[own].mean(axis=0) for positions in (apart, shifted) for own in built.filaments.node_indices]
    # By a tenth of 40 nm along each axis, and what thermal motion does to that.
    assert 0.1 < np.linalg.norm(ends[3] - ends[1]) < 30.0
    assert not planar or abs(ends[3][2]) < 1e-9
    begun_at.clear()
    np.testing.assert_array_equal(relaxed_positions(configuration, built)._value, shifted)
    begun_at.clear()
    failures = 10
    with pytest.raises(InputError, match="have not come apart"):
        relaxed_positions(configuration, built)
    assert len(begun_at) == 4


PILE = """
[solvent]
temperature = "298 K"
viscosity = "1 mPa*s"
[[filament]]
name = "ROD"
diameter = "8 nm"
segment_length = "100 nm"
persistence_length = "10 um"
stretching_modulus = "1 nN"
segments = 2
count = 100
inside = { shape = "sphere", radius = "180 nm" }
KIND
[contacts]
diameter = "25 nm"
[simulation]
time_step = "1 us"
duration = "1 ms"
report_interval = "1 ms"
seed = 3
"""


def relaxed_with_steps(configuration, monkeypatch):
    """The System, relaxed positions, the lengths of the steps that they took, and how many were divided."""
    built = build_system(configuration, configuration.simulation.engine, configuration.simulation.seed)
    integrators, steps = [], []
    make = Filaments.create_integrator

    def noted(*arguments, **options):
        integrators.append(make(*arguments, **options))
        return integrators[-1]

    monkeypatch.setattr(Filaments, "create_integrator", noted)
    relaxed = relaxed_positions(configuration, built, stop=lambda: steps.append(integrators[0].getStepSize()._value))
    return built, relaxed._value, steps, integrators[0].getNumDividedSteps()


def contacts_at(built, positions):
    (force,) = (own for own in built.system.getForces() if as_capsule_contact_force(own))
    context = openmm.Context(built.system, openmm.VerletIntegrator(1.0), openmm.Platform.getPlatform("Reference"))
    context.setPositions(positions)
    found = find_contacts(force, context)
    return 0.5 * np.abs(found.forces * found.gaps) / (8.31446261815324e-3 * 298.0)


@pytest.mark.parametrize(("kind", "radius", "contacts"), [("", "180 nm", 600), ("planar = true", "500 nm", 200)])
def test_dense_piles_come_apart_in_few_steps(monkeypatch, kind, radius, contacts):
    configuration = parse_configuration(PILE.replace("KIND", kind).replace("180 nm", radius))
    built, positions, steps, divided = relaxed_with_steps(configuration, monkeypatch)
    before, after = contacts_at(built, built.positions), contacts_at(built, positions)
    # Each filament lies on several others, some almost axis on axis. Equilibrium has less than one k_B T of each.
    assert len(before) > contacts and before.max() > 39.0 and before.sum() > 2000 > 400 > after.sum()
    assert len(after) * np.exp(-after.max()) > 3e-4
    assert len(steps) < 400 and divided == 0
    assert find_planar_crossing(built.filaments, None, positions) is None
    np.testing.assert_array_equal(relaxed_positions(configuration, built)._value, positions)


@pytest.mark.parametrize("time_step", [1e3, 1e6, 1e8])
def test_contacts_are_hard_while_piles_come_apart_if_those_of_the_run_are(monkeypatch, time_step):
    configuration = parse_configuration(PILE.replace("KIND", "").replace("1 us", f"{1e-6 * time_step} us"))
    built, positions, steps, divided = relaxed_with_steps(configuration, monkeypatch)
    after = contacts_at(built, positions)
    (force,) = filter(None, map(as_capsule_contact_force, built.system.getForces()))
    resolving = longest_resolving_step(built.filaments, built.system, force, None)
    assert 1e4 < resolving < 1e8
    assert (min(steps[-60:]) > resolving) == (time_step > resolving)
    assert divided == 0 and len(after) * np.exp(-after.max()) > 3e-4 and 400 > after.sum()


FULL = """
[solvent]
temperature = "300 K"
viscosity = "10 mPa*s"
[box]
edges = ["200 nm", "200 nm", "200 nm"]
[[filament]]
name = "ROD"
diameter = "8 nm"
segment_length = "60 nm"
persistence_length = "10 um"
stretching_modulus = "1 nN"
segments = 1
count = COUNT
KIND
[contacts]
diameter = "20 nm"
[simulation]
time_step = "1 ns"
duration = "10 ns"
report_interval = "10 ns"
"""


@pytest.mark.parametrize(
    ("count", "kind", "share"),
    # pi d^2/4 of 60 nm in (200 nm)^3, or 60 nm times d in (200 nm)^2.
    [(400, "", "94 %"), (34, "planar = true", "102 %"), (384, "", None), (33, "planar = true", None)],
)
def test_filaments_that_fill_a_box_are_refused_at_once(monkeypatch, count, kind, share):
    configuration = parse_configuration(FULL.replace("COUNT", str(count)).replace("KIND", kind))
    built = build_system(configuration, None, 1)
    begun = []
    monkeypatch.setattr(Filaments, "create_integrator", lambda *_, **__: begun.append(1) or 1 / 0)
    if share is None:
        with pytest.raises(ZeroDivisionError):
            relaxed_positions(configuration, built)
    else:
        with pytest.raises(InputError, match=f"would fill {share} of the box"):
            relaxed_positions(configuration, built)
        assert not begun


def test_places_in_a_torus_have_the_same_chance():
    """The mean distance from the axis is R + r^2/4R, and half of all are below the plane of the circle."""
    table = {"shape": "torus", "axis": [0, 0, 1], "major_radius": "300 nm", "minor_radius": "200 nm"}
    region, generator = Region(REGION.read(table, Place("inside", ()))), np.random.default_rng(2)
    points = np.array([region.draw(generator) for _ in range(20000)])
    assert region.contains(points) and region.volume == pytest.approx(2 * np.pi**2 * 300 * 200**2)
    distances = np.hypot(*points[:, :2].T)
    error = distances.std() / np.sqrt(len(distances))
    assert distances.mean() == pytest.approx(300 + 200**2 / 1200, abs=4 * error) and error < 0.05 * 200**2 / 1200
    assert np.mean(points[:, 2] < 0) == pytest.approx(0.5, abs=2 / np.sqrt(len(points)))
