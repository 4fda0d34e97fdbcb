"""Which forces are in the equations of implicit schemes: what is said of them is what steps do, and steps are right."""

import numpy as np
import openmm
import pytest

from openmm_cylchain import (
    F_ACTIN,
    Crosslinks,
    Filaments,
    InstabilityError,
    SegmentPlace,
    TimeStepWarning,
    capsule_contact_force,
    filament_wall_force,
)
from openmm_cylchain.couplings.shapes import Plane
from openmm_cylchain.time_steps.coupled_forces import CoupledForces
from openmm_cylchain.time_steps.explicit_forces import ExplicitForces
from support.contexts import new_context
from support.solvent import KT, TEMPERATURE, VISCOSITY

ACTIN = F_ACTIN.with_segment_length(100.0)
SIGMAS = 4.0
STEP = 1e5
STIFF = 50.0
"""In kJ/(mol nm^2): an explicit link of that moves a node by many times its extension in a step."""


def two_filaments(sites=(), fixed=(), closed=False):
    """Two filaments 40 nm apart, behind them virtual sites between particles, and particles that do not move."""
    filaments = Filaments(VISCOSITY, TEMPERATURE, engine="compiled")
    for y in (0.0, 40.0):
        if closed:
            angles = 2.0 * np.pi * np.arange(5) / 5
            radius = 50.0 / np.sin(np.pi / 5)
            ring = radius * np.stack([np.cos(angles), np.sin(angles), np.zeros(5)], axis=1)
            filaments.add_nodes(ACTIN, ring + [0.0, 0.0, y], closed=True)
        else:
            filaments.add_straight(ACTIN, 4, [0.0, y, 0.0], [1.0, 0.0, 0.0])
    _, system, positions = filaments.build()
    positions = positions._value
    for point in fixed:
        system.addParticle(0.0)
        positions = np.vstack([positions, point])
    for first, second, weight in sites:
        index = system.addParticle(0.0)
        system.setVirtualSite(index, openmm.TwoParticleAverageSite(first, second, weight, 1.0 - weight))
        positions = np.vstack([positions, weight * positions[first] + (1.0 - weight) * positions[second]])
    return filaments, system, positions


PLACES = {
    "node": (2, {}, None),
    "point": ([0.0, 20.0, 0.0], {}, None),
    "place on a segment": (SegmentPlace(1, 2, 0.3), {}, None),
    "the same from its end": (SegmentPlace(2, 1, 0.7), {}, None),
    "virtual site on a segment": (10, {"sites": [(1, 2, 0.3)]}, None),
    "particle that does not move": (10, {"fixed": [[100.0, 20.0, 0.0]]}, None),
    "place between two of these": (
        SegmentPlace(10, 11, 0.5),
        {"fixed": [[100.0, 20.0, 0.0], [200.0, 20.0, 0.0]]},
        None,
    ),
    "segment that closes a ring": (SegmentPlace(4, 0, 0.5), {"closed": True}, None),
    "place off the segments": (SegmentPlace(0, 3, 0.5), {}, "the place between particles 0 and 3"),
    "place from end to end": (SegmentPlace(4, 0, 0.5), {}, "the place between particles 4 and 0"),
    "place across a ring": (SegmentPlace(3, 0, 0.5), {"closed": True}, "the place between particles 3 and 0"),
    "virtual site off the segments": (10, {"sites": [(0, 3, 0.5)]}, "the place between particles 0 and 3"),
    "virtual site beyond a segment": (10, {"sites": [(1, 2, 1.5)]}, "virtual site 10"),
    "place from a node to a fixed particle": (
        SegmentPlace(1, 10, 0.5),
        {"fixed": [[100.0, 20.0, 0.0]]},
        "the place between particles 1 and 10",
    ),
}


@pytest.mark.parametrize("name", PLACES)
def test_a_stiff_link_is_as_stable_as_it_is_said_to_be(name):
    place, arguments, outside = PLACES[name]
    filaments, system, positions = two_filaments(**arguments)
    links = Crosslinks(STIFF, 0.0)
    links.add(None, 7, place)
    links.add_to(system)
    assert CoupledForces(system).place_outside(system.getNumForces() - 1) == outside
    springs = ExplicitForces(system, filaments, "implicit").springs
    assert len(springs) == (0 if outside is None else 1)
    if outside is not None:
        assert outside in springs[0].force
    integrator = filaments.create_integrator(system, 1e-3, temperature=0.0, checks=False)
    integrator.setStepSize(STEP)
    context = new_context(system, positions, integrator=integrator)
    before = links.lengths(context)[0]
    try:
        integrator.step(1)
        is_stable = links.lengths(context)[0] < before
    except InstabilityError:
        is_stable = False
    assert is_stable == (outside is None)


def test_one_place_makes_all_links_of_a_force_explicit_and_their_step_is_right():
    count = 8
    filaments = Filaments(VISCOSITY, TEMPERATURE, engine="compiled")
    for pair in range(count):
        for y in (0.0, 10.0):
            filaments.add_straight(ACTIN, 5, [0.0, y, 500.0 * pair], [1.0, 0.0, 0.0])
    _, system, positions = filaments.build()
    links = Crosslinks(0.4, 0.0)
    for pair in range(count):
        ends = (filaments.segment_place(2 * pair + k, segment=4) for k in (0, 1))
        links.add(None, *ends)
    links.add_to(system)
    alone = filaments.recommended_time_step(system=system)
    system.removeForce(system.getNumForces() - 1)
    again = Crosslinks(0.4, 0.0)
    again.set_table(None, links.table(None))
    again.add(None, SegmentPlace(0, 3, 0.5), filaments.segment_place(1, segment=1))
    force = again.add_to(system)
    step = filaments.recommended_time_step(system=system)
    assert step.step < 0.1 * alone.step
    assert (
        f"{force.getName()} (force {system.getNumForces() - 1}), explicit because of the place between" in step.reason
    )
    with pytest.warns(TimeStepWarning, match="explicit because of the place between particles 0 and 3"):
        filaments.create_integrator(system, alone)
    integrator = filaments.create_integrator(system, step, random_seed=1)
    context = new_context(system, positions, integrator=integrator, platform="CPU")
    integrator.step(2000)
    squares = np.empty((3000, count))
    for row in squares:
        integrator.step(8)
        row[:] = again.lengths(context)[:count] ** 2
    blocks = squares.reshape(20, -1).mean(axis=1) / (3.0 * KT / 0.4)
    error = blocks.std(ddof=1) / np.sqrt(len(blocks))
    assert error < 0.02
    # The recommended step allows explicit forces 5 %.
    assert -SIGMAS * error < blocks.mean() - 1.0 < 0.05 + SIGMAS * error


def test_spheres_at_virtual_sites_make_contacts_explicit():
    filaments, system, positions = two_filaments(fixed=[[0, 0, 5e3], [9, 0, 5e3]], sites=[(10, 11, 0.5)])
    free = filaments.recommended_time_step(system=system)
    for particles, outside in (([10], None), ([12], "virtual site 12")):
        force = capsule_contact_force(filaments, system, 30.0, particles=particles, particle_diameter=30.0)
        index = system.addForce(force)
        assert CoupledForces(system).place_outside(index) == outside
        step = filaments.recommended_time_step(system=system)
        if outside is None:
            assert step.step == free.step
        else:
            assert step.step < 0.1 * free.step
            assert f"explicit because of {outside}" in step.reason
        system.removeForce(index)


def test_virtual_sites_at_walls_make_them_explicit():
    filaments, system, positions = two_filaments(fixed=[[0, 0, 5e3], [9, 0, 5e3]], sites=[(10, 11, 0.5)])
    for particles, names in (([10], []), ([12], ["virtual site 12"])):
        force = filament_wall_force(
            filaments, system, Plane([0, 0, -100.0], [0, 0, 1]), 1.0, particles=particles, particle_radius=5.0
        )
        index = system.addForce(force)
        springs = ExplicitForces(system, filaments, "implicit").springs
        assert [one.force.split("because of ")[1] for one in springs] == names
        system.removeForce(index)
