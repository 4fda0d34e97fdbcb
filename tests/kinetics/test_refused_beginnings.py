"""Nucleation, branching, severing, states of ends and of monomers, and reserves, that are not what they should be."""

import dataclasses
import warnings

import numpy as np
import openmm
import pytest
from openmm import unit

from openmm_cylchain import (
    ACTIN_ATP,
    F_ACTIN,
    Branching,
    DynamicInstability,
    EndStates,
    Filaments,
    Growth,
    InputError,
    MonomerPool,
    Monomers,
    MonomerState,
    Nucleation,
    Severing,
    Slab,
    Sphere,
    TwoUnitCap,
    filament_wall_force,
)
from support.solvent import TEMPERATURE, VISCOSITY

NM, SECOND = unit.nanometer, unit.second
PER_SECOND = 1.0 / SECOND
PER_LENGTH = 1.0 / unit.micrometer / SECOND
NAN = float("nan")
KIND = F_ACTIN.with_segment_length(54.0)
REGION = Sphere([0, 0, 0], 100.0)
POOL = unit.Quantity(5e-6, unit.molar)


@pytest.fixture(autouse=True)
def _no_warnings():
    with warnings.catch_warnings():
        warnings.simplefilter("error", RuntimeWarning)
        yield


def growth(**changes):
    return Growth(**{"monomers": ACTIN_ATP, "pool": POOL, "longest": 500.0, **changes})


@pytest.mark.parametrize(
    ("changes", "message"),
    [
        ({"rate": NAN}, "rate of nucleation must be finite"),
        ({"rate": -1.0}, "rate of nucleation cannot be negative"),
        ({"rate": 1 * NM}, "rate of nucleation has the unit nanometer"),
        ({"rate": PER_SECOND / NM**2}, "rate of nucleation has the unit"),
        ({"rate": [1.0, 2.0]}, "single number"),
        ({"rate": "fast"}, "must be a number"),
        ({"region": Slab([0, 0, 0], [0, 0, 1], 3.0)}, "must be a Sphere, a Box or None"),
        ({"region": "box"}, "must be a Sphere, a Box or None"),
        ({"length": 0.0}, "length of new filaments must be positive"),
        ({"length": NAN}, "length of new filaments must be finite"),
        ({"length": 1 * SECOND}, "length of new filaments has the unit second"),
        ({"direction": [0, 0, 0]}, "direction must not be the zero vector"),
        ({"direction": [0, 1]}, "must have three components"),
        ({"direction": [NAN, 0, 0]}, "must be finite"),
        ({"order": -1}, "order of nucleation must be at least 0"),
        ({"order": 1.5}, "order of nucleation must be a whole number"),
    ],
)
def test_nucleation(changes, message):
    with pytest.raises(InputError, match=message):
        Nucleation(**{"rate": PER_SECOND, "region": REGION, **changes})


def test_small_directions():
    np.testing.assert_allclose(Nucleation(rate=0.0, direction=[0, 1e-200, 0]).direction, [0, 1, 0])


@pytest.mark.parametrize(
    ("changes", "message"),
    [
        ({"rate": PER_SECOND}, "rate of branching has the unit"),
        ({"rate": NAN}, "rate of branching must be finite"),
        ({"angle": 0.0}, "angle must be positive"),
        ({"angle": 180 * unit.degree}, "does not hold an angle of 180 degrees"),
        ({"angle": NAN}, "angle must be finite"),
        ({"angular_stiffness": 0.0}, "angular_stiffness must be positive"),
        ({"stiffness": -1.0}, "stiffness must be positive"),
        ({"lever": 0.0}, "lever must be positive"),
        ({"distance": -1.0}, "distance cannot be negative"),
        ({"debranching_rate": -PER_SECOND}, "debranching_rate cannot be negative"),
        ({"debranching_force": 1 * SECOND}, "debranching_force has the unit second"),
        ({"direction": [1, 0, 0]}, "leave direction out"),
        ({"mothers": [-1]}, "at least 0"),
        ({"mothers": 3}, "must be a sequence"),
        ({"mothers": [1, 1]}, "mothers has a filament twice"),
        ({"mothers": []}, "mothers has no filament"),
    ],
)
def test_branching(changes, message):
    with pytest.raises(InputError, match=message):
        Branching(**{"rate": PER_LENGTH, **changes})


@pytest.mark.parametrize(
    ("changes", "message"),
    [
        ({"rate": PER_SECOND}, "rate of severing has the unit"),
        ({"rate": NAN}, "rate of severing must be finite"),
        ({"rate": -1.0}, "rate of severing cannot be negative"),
        ({"of_states": "ADP"}, "of_states must be a sequence"),
        ({"of_states": ["ADP"]}, "Monomers that do not age have no states"),
        ({"shrinks": 1}, "shrinks must be True or False"),
        ({"shrinks": True}, "There is no end state 'shrinking'"),
    ],
)
def test_severing(changes, message):
    with pytest.raises(InputError, match=message):
        growth(severing=Severing(**{"rate": PER_LENGTH, **changes}))


@pytest.mark.parametrize("read", [growth().states, growth().rates, ACTIN_ATP.states])
def test_other_ends(read):
    with pytest.raises(InputError, match="end must be one of minus, plus, but is 'side'"):
        read("side")


STATES = {"on_rates": [0.0, 0.0], "off_rates": [0.0, 0.0], "switch_rates": [[0.0, 1.0], [1.0, 0.0]]}


@pytest.mark.parametrize(
    ("changes", "message"),
    [
        ({"on_rates": []}, "from 1 to 64 states"),
        ({"on_rates": 3.0}, "on_rates must be a sequence"),
        ({"on_rates": [NAN, 0.0]}, "on_rates must be finite"),
        ({"on_rates": [1 * SECOND, 0.0]}, "on_rates has the unit second"),
        ({"off_rates": [1.0]}, "off_rates must have as many"),
        ({"off_rates": [-1.0, 0.0]}, "off_rates cannot be negative"),
        ({"switch_rates": 3.0}, "switch_rates must be a sequence"),
        ({"switch_rates": [0.0, 0.0]}, "switch_rates must be a sequence"),
        ({"switch_rates": [[0.0, 1.0]]}, "2 x 2"),
        ({"switch_rates": [[1.0, 0.0], [0.0, 0.0]]}, "zero from a state to itself"),
        ({"after_gain": 1}, "after_gain must be a sequence"),
        ({"after_gain": [0, 2]}, "from 0 to 1"),
        ({"after_loss": [0.0, 1.0]}, "from 0 to 1"),
        ({"names": "ab"}, "names must be a sequence"),
        ({"names": ["a"]}, "a string of its own"),
        ({"names": ["a", "a"]}, "a string of its own"),
    ],
)
def test_states_of_ends(changes, message):
    with pytest.raises(InputError, match=message):
        EndStates(**{**STATES, **changes})


def test_states_of_ends_with_units():
    states = EndStates(**{**STATES, "off_rates": unit.Quantity([1.0, 2.0], PER_SECOND.unit)})
    assert states.off_rates == (1e-12, 2e-12)
    with pytest.raises(InputError, match="There is no end state 'c': there are 0, 1"):
        states.find("c")
    with pytest.raises(InputError, match="hydrolysis_rate must be finite"):
        TwoUnitCap(hydrolysis_rate=NAN, shrinking_off_rate=0.0)


@pytest.mark.parametrize(
    ("aging", "message"),
    [
        (3, "aging must be a sequence"),
        (None, "aging must be a sequence"),
        (MonomerState(name="old", rate=0.0), "aging must be a sequence"),
        ([3], "aging must be an object of the class MonomerState"),
        ([MonomerState(name="new", rate=0.0)], "names of their own"),
        ([MonomerState(name="old", rate=0.0)] * 2, "names of their own"),
    ],
)
def test_aging(aging, message):
    with pytest.raises(InputError, match=message):
        Monomers(length=2.7, aging=aging)


@pytest.mark.parametrize(
    ("changes", "message"),
    [
        ({"name": 3}, "The name of a state"),
        ({"rate": NAN}, "old: rate must be finite"),
        ({"plus_off_rate": -1.0}, "old: plus_off_rate cannot be negative"),
        ({"plus_on_rate": 1 * SECOND}, "old: plus_on_rate has the unit second"),
    ],
)
def test_states_of_monomers(changes, message):
    with pytest.raises(InputError, match=message):
        MonomerState(**{"name": "old", "rate": PER_SECOND, **changes})


def test_monomers_that_age_have_no_other_states():
    aging = dataclasses.replace(ACTIN_ATP, aging=[MonomerState(name="old", rate=PER_SECOND)])
    instability = DynamicInstability(catastrophe_rate=0.0, rescue_rate=0.0, shrinking_off_rate=0.0)
    with pytest.raises(InputError, match="Monomers that age decide"):
        growth(monomers=aging, plus_instability=instability)
    with pytest.raises(InputError, match="There is no end state 'older': there are new, old"):
        growth(monomers=aging, severing=Severing(rate=PER_LENGTH, of_states=["older"]))


def mothers(filaments):
    for number in range(2):
        filaments.add_straight(KIND, 6, [0, 30 * number, 0], [1, 0, 0], growth=growth())


BRANCHES = Branching(rate=PER_LENGTH, length=54.0)


@pytest.mark.parametrize(
    ("options", "message"),
    [
        ({"count": 0}, "count must be at least 1"),
        ({"count": 1.5}, "count must be a whole number"),
        ({"engine": "portable"}, "the portable engine has no filaments that grow"),
        ({"kind": "actin"}, "filament_type must be a FilamentType"),
        ({"kind": F_ACTIN.with_segment_length(55.0)}, "55 nm have 20.3704 monomers"),
        ({"growth": None}, "growth must be an object of the class Growth"),
        ({"growth": growth(longest=20.0)}, "27 nm long where it is shortest, which exceeds its longest, 20 nm"),
        ({"nucleation": 3}, "nucleation must be an object of the class Nucleation"),
        ({"nucleation": Nucleation(rate=PER_SECOND)}, "needs a region"),
        ({"nucleation": Nucleation(rate=0.0, region=REGION, length=600.0)}, "600 nm are not between .* 27 and 500 nm"),
        ({"nucleation": Nucleation(rate=0.0, region=REGION, length=20.0)}, "20 nm are not between"),
        ({"nucleation": Nucleation(rate=1e9, region=REGION)}, "reserve from filament 2 .* on, 1e\\+21 would begin per"),
        ({"nucleation": Nucleation(rate=1.0 / NM**3 / SECOND, region=Sphere([0, 0, 0], 1e20))}, "would begin per"),
        ({"nucleation": dataclasses.replace(BRANCHES, mothers=[9])}, "Filament 9 cannot have branches"),
        ({"nucleation": dataclasses.replace(BRANCHES, lever=60.0)}, "Branches begin with 54 nm, on which the strut"),
        ({"nucleation": dataclasses.replace(BRANCHES, rate=1e9)}, "would begin per second"),
        ({"growth": growth(severing=Severing(rate=1e9))}, "or is cut so often"),
        ({"planar": 1}, "planar must be True or False"),
        ({"propulsion": 1 * SECOND}, "propulsion has the unit second"),
    ],
)
def test_reserves(options, message):
    options = {"kind": KIND, "count": 2, "growth": growth(), "engine": "compiled", **options}
    filaments = Filaments(VISCOSITY, TEMPERATURE, engine=options.pop("engine"))
    if filaments.engine == "compiled":
        mothers(filaments)
    with pytest.raises(InputError, match=message):
        filaments.add_reserve(options.pop("kind"), options.pop("count"), **options)
        _, system, _ = filaments.build()
        filaments.create_integrator(system, 1e8, checks=False)


def test_reserves_of_filaments_that_are_in_a_system():
    filaments = Filaments(VISCOSITY, TEMPERATURE, engine="compiled")
    mothers(filaments)
    filaments.build()
    with pytest.raises(InputError, match="comes too late"):
        filaments.add_reserve(KIND, 2, growth=growth())


@pytest.mark.parametrize("tie", ["add_tether", "add_attachment", "add_beads"])
def test_nothing_is_tied_to_reserves(tie):
    filaments = Filaments(VISCOSITY, TEMPERATURE, engine="compiled")
    filaments.add_reserve(KIND, 2, growth=growth())
    arguments = {"add_tether": (0, 0, [0, 0, 0], 1.0), "add_attachment": (0, 0, 0.5), "add_beads": (0, 10.0)}[tie]
    with pytest.raises(InputError, match="filament 0 .* grows"):
        getattr(filaments, tie)(*arguments)


def begun(nucleation, count=3, walls=None, own_growth=None, before=mothers):
    filaments = Filaments(VISCOSITY, TEMPERATURE, engine="compiled")
    before(filaments)
    numbers = filaments.add_reserve(KIND, count, growth=own_growth or growth(), nucleation=nucleation)
    _, system, positions = filaments.build()
    if walls is not None:
        system.addForce(filament_wall_force(filaments, system, walls, 1.0))
    integrator = filaments.create_integrator(system, 1e7, random_seed=1, checks=False)
    context = openmm.Context(system, integrator, openmm.Platform.getPlatformByName("CPU"), {"Threads": "1"})
    context.setPositions(positions)
    integrator.step(10)
    found = filaments.in_context(context).growth()
    return found, (found.nodes[np.isin(found.filaments, numbers)] > 0).sum()


def test_more_nuclei_than_places_are_counted():
    found, there = begun(Nucleation(rate=1e5 / SECOND, region=REGION))
    assert there == found.nucleated == 3
    # 10 are expected in 0.1 ms.
    assert 1 <= found.without_place + 3 <= 25


@pytest.mark.parametrize(
    "options",
    [
        {"nucleation": Nucleation(rate=0.0, region=REGION)},
        {
            "nucleation": Nucleation(rate=1e5 / SECOND, region=Sphere([1e5, 0, 0], 10.0)),
            "walls": Sphere([0, 0, 0], 500),
        },
        {
            "nucleation": Nucleation(rate=1e5 / SECOND, region=REGION, order=3),
            "own_growth": growth(pool=MonomerPool(0.0, 1e6)),
        },
        {"nucleation": dataclasses.replace(BRANCHES, rate=1e-7, region=Sphere([1e5, 0, 0], 10.0))},
        {"nucleation": dataclasses.replace(BRANCHES, rate=1e-7), "before": lambda filaments: None},
    ],
)
def test_where_none_can_begin(options):
    """Without a rate, outside of walls, without monomers, and without mothers."""
    found, there = begun(**options)
    assert there == 0 and found.nucleated == 0
