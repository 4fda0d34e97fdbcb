"""One rule of who is periodic, for all forces between filaments, in whatever order they and the box come."""

import warnings
from itertools import permutations

import numpy as np
import openmm
import pytest
from openmm import app

from openmm_cylchain import (
    F_ACTIN,
    BoxWarning,
    Crosslinker,
    Crosslinks,
    Filaments,
    Flow,
    Hand,
    InputError,
    capsule_contact_force,
    contact_force,
)
from openmm_cylchain.couplings.periodicity import is_periodic
from openmm_cylchain.kinetics.binding_force import find_binding_force
from support.contexts import energy_of, forces_of, new_context, positions_of
from support.solvent import TEMPERATURE, VISCOSITY

BOX = 500.0 * np.eye(3)


def across_the_box(engine="compiled"):
    """Two filaments 465 nm apart, or 35 nm as nearest images in a box of 500 nm."""
    filaments = Filaments(VISCOSITY, TEMPERATURE, engine=engine)
    kind = F_ACTIN.with_segment_length(100.0)
    for y in (10.0, 475.0):
        filaments.add_straight(kind, 2, [100.0, y, 250.0], [1, 0, 0])
    return filaments


def linked(filaments):
    links = Crosslinks(0.15, 35.0)
    links.add(None, filaments.segment_place(0, segment=1), filaments.segment_place(1, segment=1))
    return links


def forces_in_order(order):
    """Crosslinks, contacts, and a force of OpenMM without distances, added in an order; lengths and the energy."""
    filaments = across_the_box()
    _, system, positions = filaments.build(box_vectors=BOX)
    links = linked(filaments)
    adding = {
        "links": lambda: links.add_to(system),
        "contacts": lambda: system.addForce(capsule_contact_force(filaments, system, 40.0)),
        "stock": lambda: system.addForce(openmm.CustomExternalForce("0")),
    }
    for name in order:
        adding[name]()
    context = new_context(system, positions, filaments.create_integrator(system, 1e4, random_seed=1))
    return links.lengths(context), energy_of(context)


def test_links_and_contacts_across_a_box_are_the_same_in_any_order():
    """A link at its rest length, and contacts of 40 nm at 35 nm."""
    found = [forces_in_order(order) for order in permutations(("links", "contacts", "stock"))]
    for lengths, energy in found:
        assert lengths == pytest.approx([35.0])
        assert energy == pytest.approx(found[0][1], rel=1e-12) and energy > 0.0
    lengths, energy = forces_in_order(["links"])
    assert lengths == pytest.approx([35.0]) and energy == pytest.approx(0.0, abs=1e-9)


@pytest.mark.parametrize(("periodic", "length", "force"), [("box", 0.2, 0.3), ("force", 0.8, 0.3), ("no", 2.8, 2.3)])
def test_links_of_systems_without_filaments_take_nearest_images_in_a_box(periodic, length, force):
    """A box of 3 nm, or that of 2 nm which every System has, with a force that is periodic."""
    system = openmm.System()
    for _ in range(2):
        system.addParticle(1.0)
    if periodic == "box":
        system.setDefaultPeriodicBoxVectors(*(3.0 * np.eye(3)))
    if periodic == "force":
        other = openmm.HarmonicBondForce()
        other.setUsesPeriodicBoundaryConditions(True)
        system.addForce(other)
    links = Crosslinks(1.0, 0.5)
    links.add(None, 0, 1)
    links.add_to(system)
    context = new_context(system, [[0.0, 0, 0], [2.8, 0, 0]])
    assert links.lengths(context) == pytest.approx([length])
    assert forces_of(context)[0, 0] == pytest.approx(force)


def test_all_forces_are_periodic_where_a_system_is(engine):
    """Where it has a box, or a force that is periodic; not else. An argument is obeyed."""
    for box in (None, BOX):
        filaments = across_the_box(engine)
        for number in range(2):
            filaments.add_beads(number, 20.0)
        if engine == "compiled":
            hand = Hand(binding_rate=1e-9, reach=20.0, unbinding_rate=1e-9)
            kind = Crosslinker(hands=hand, stiffness=0.1, rest_length=20.0, name="x")
            filaments.add_linkers(kind, count=1, volume=1e8)
        _, system, _ = filaments.build(box_vectors=box)
        expected = box is not None
        assert is_periodic(system) == expected
        forces = [linked(filaments).add_to(system), contact_force(filaments, system, 40.0, 0.1)]
        if engine == "compiled":
            forces += [capsule_contact_force(filaments, system, 40.0, 0.1), find_binding_force(system)]
        assert [force.usesPeriodicBoundaryConditions() for force in forces] == len(forces) * [expected]
        assert not linked(filaments).add_to(system, periodic=False).usesPeriodicBoundaryConditions()


def test_a_box_that_comes_after_forces_is_warned_of():
    """Each force that was added before it, and no other."""
    filaments = across_the_box()
    _, system, _ = filaments.build()
    linked(filaments).add_to(system)
    system.addForce(capsule_contact_force(filaments, system, 30.0))
    with warnings.catch_warnings():
        warnings.simplefilter("error", BoxWarning)
        filaments.create_integrator(system, 1e4)
    system.setDefaultPeriodicBoxVectors(*BOX)
    linked(filaments).add_to(system)
    with pytest.warns(BoxWarning, match=r"images in Crosslinks \(force 1\), CylinderChainContactForce \(force 2\)\. "):
        filaments.create_integrator(system, 1e4)


def test_a_topology_with_a_box_and_a_system_without_one_are_refused():
    filaments, topology, system = across_the_box(), app.Topology(), openmm.System()
    topology.setPeriodicBoxVectors(BOX * openmm.unit.nanometer)
    with pytest.raises(InputError, match="The Topology has a periodic box, but the System has none"):
        filaments.add_to(topology, system, np.zeros((0, 3)))
    system.setDefaultPeriodicBoxVectors(*topology.getPeriodicBoxVectors())
    filaments.add_to(topology, system, np.zeros((0, 3)))


def test_the_box_of_systems_without_one_is_refused():
    with pytest.raises(InputError, match="another size than 2 nm"):
        across_the_box().build(box_vectors=2.0 * np.eye(3))


def test_flows_are_those_of_nearest_images_in_a_box(engine):
    """A filament at rest in its image beside the origin, 480 nm away, where the flow would be 24 times as fast."""
    moved = []
    for box in (None, BOX):
        filaments = Filaments(VISCOSITY, 0.0, engine=engine)
        filaments.add_straight(F_ACTIN.with_segment_length(100.0), 1, [0.0, 0.0, 480.0], [1, 0, 0])
        _, system, positions = filaments.build(box_vectors=box)
        integrator = filaments.create_integrator(system, 1e4, random_seed=1, flow=Flow.shear(rate=1e-9))
        context = new_context(system, positions, integrator)
        integrator.step(1)
        moved.append((positions_of(context) - positions._value)[:, 0].mean())
    assert moved == pytest.approx([480e-9 * 1e4, -20e-9 * 1e4], rel=1e-6)


def test_filaments_that_were_wrapped_are_recognised_without_a_periodic_force():
    filaments = Filaments(VISCOSITY, TEMPERATURE, engine="compiled")
    filaments.add_straight(F_ACTIN.with_segment_length(100.0), 10, [0.0, 0.0, 0.0], [1, 0, 0])
    _, system, positions = filaments.build(box_vectors=BOX)
    integrator = filaments.create_integrator(system, 1e4, random_seed=1)
    context = new_context(system, positions._value % 500.0, integrator)
    with pytest.raises(InputError, match=r"is torn at segment 4: .*make_whole"):
        context.getIntegrator().step(1)
