"""Places on the curves of beam elements: attachment points, beads, and steps of forces on them."""

from dataclasses import replace

import numpy as np
import openmm
import pytest
from openmm import unit

from openmm_cylchain import Filaments, InputError, contact_force
from openmm_cylchain.beams.curve import element_points, particle_weights
from openmm_cylchain.time_steps.beam_response import BeamResponse
from support.contexts import forces_of, new_context, positions_of
from support.linked_beams import BEAM, LENGTH, place_of
from support.solvent import KT, TEMPERATURE, VISCOSITY

SIGMAS = 4.0


def curved(places):
    filaments = Filaments(VISCOSITY, TEMPERATURE, engine="compiled")
    filaments.add_straight(BEAM, 1, [0, 900, 0], [1, 0, 0])
    filaments.add_equilibrium(BEAM, 3, seed=1)
    for segment, fraction in places:
        filaments.add_attachment(1, segment=segment, fraction=fraction)
    return filaments


def test_attachment_points_are_on_the_curve_and_follow_it():
    places = [(0, 0.0), (1, 0.3), (2, 1.0), (0, 0.5)]
    filaments = curved(places)
    assert filaments.add_attachment(1, arc_length=LENGTH * 1.25 * unit.nanometer) == 4
    assert filaments.attachments[4].segment == 1 and filaments.attachments[4].fraction == pytest.approx(0.25)
    topology, system, positions = filaments.build()
    names = [atom.name for atom in topology.atoms()]
    assert names == 2 * ["NOD"] + 2 * ["CTL"] + 4 * ["NOD"] + 4 * ["CTL"] + 5 * ["ATT"]
    expected = [place_of(filaments[1], *place) for place in [*places, (1, 0.25)]]
    assert positions._value[filaments.attachment_indices] == pytest.approx(np.array(expected))
    for platform in ("Reference", "CPU"):
        integrator = filaments.create_integrator(system, filaments.recommended_time_step(), random_seed=1)
        context = new_context(system, positions, integrator, platform)
        integrator.step(3)
        now = positions_of(context)
        nodes, controls = (now[own[1]] for own in (filaments.node_indices, filaments.control_point_indices))
        for (segment, fraction), particle in zip(places, filaments.attachment_indices):
            on_curve = element_points(nodes, controls, [fraction])[segment, 0]
            assert now[particle] == pytest.approx(on_curve, abs=1e-9)
        assert np.abs(now - positions._value).max() > 1.0


@pytest.mark.parametrize("direction", [[1, 0, 0], [0.3, -0.2, 0.9]])
def test_forces_are_handed_to_four_particles(direction):
    """In a straight filament as well, whose particles are in one line."""
    filaments = Filaments(VISCOSITY, TEMPERATURE, engine="compiled")
    filaments.add_straight(BEAM, 2, [0, 0, 0], direction)
    filaments.add_attachment(0, segment=1, fraction=0.3)
    _, system, positions = filaments.build()
    force = openmm.CustomExternalForce("-x-2*y-3*z")
    force.addParticle(int(filaments.attachment_indices[0]))
    force.setForceGroup(3)
    system.addForce(force)
    forces = forces_of(new_context(system, positions), 1 << 3)
    parents = [own[0][node] for node in (1, 2) for own in (filaments.node_indices, filaments.control_point_indices)]
    expected = np.array(particle_weights(0.3))[:, None] * np.array([1.0, 2.0, 3.0])
    assert forces[parents] == pytest.approx(expected, abs=1e-12)
    assert np.sum(expected, axis=0) == pytest.approx([1.0, 2.0, 3.0])


@pytest.mark.sample(r"^0\.1-1|^0\.02-3")
@pytest.mark.parametrize(("elements", "place"), [(1, (0, 1.0)), (3, (1, 0.4))])
@pytest.mark.parametrize("stiffness", [0.02, 0.1])
def test_springs_at_places_are_as_accurate_as_the_recommended_step_says(elements, place, stiffness):
    """A spring to a point, which is explicit: at most 5 % too much energy, and hardly less than k_B T/2 an axis."""
    filaments = Filaments(VISCOSITY, TEMPERATURE, engine="compiled")
    copies, generator = 500, np.random.default_rng(3)
    points = []
    for copy in range(copies):
        number = filaments.add_equilibrium(BEAM, elements, seed=copy)
        filaments.add_attachment(number, segment=place[0], fraction=place[1])
        points.append(place_of(filaments[number], *place) + generator.normal(0.0, np.sqrt(KT / stiffness), 3))
    _, system, positions = filaments.build()
    trap = openmm.CustomExternalForce("0.5*k*((x-x0)^2+(y-y0)^2+(z-z0)^2)")
    trap.addGlobalParameter("k", stiffness)
    for name in ("x0", "y0", "z0"):
        trap.addPerParticleParameter(name)
    for particle, point in zip(filaments.attachment_indices, points):
        trap.addParticle(int(particle), point)
    system.addForce(trap)
    free = filaments.recommended_time_step().step
    step = filaments.recommended_time_step(system=system)
    assert not step.unknown_forces
    assert step.step < free and "explicit" in step.reason
    integrator = filaments.create_integrator(system, step, random_seed=2)
    context = new_context(system, positions, integrator, "CPU")
    energies = []
    for _ in range(120):
        integrator.step(4)
        apart = positions_of(context)[filaments.attachment_indices] - points
        energies.append(0.5 * stiffness * np.sum(apart**2, axis=1) / KT)
    mean = np.mean(energies, axis=0)
    error = np.std(mean, ddof=1) / np.sqrt(copies)
    assert error < 0.012 * 1.5
    assert 1.5 * 0.99 - SIGMAS * error < np.mean(mean) < 1.5 * 1.05 + SIGMAS * error


def test_responses_of_places():
    """Of an element that is alone: that of friction in short steps, and of a rod in long ones."""
    filaments = Filaments(VISCOSITY, TEMPERATURE, engine="compiled")
    kind = replace(BEAM, temperature=None, bending_rigidity=1e5 * KT)
    filaments.add_straight(kind, 1, [0, 0, 0], [1, 0, 0])
    filaments.add_straight(kind, 4, [0, 0, 0], [1, 0, 0], clamped=0, clamped_tangents=0)
    friction = kind.segment_friction(VISCOSITY, TEMPERATURE, 1)
    least = min(friction.perpendicular, friction.parallel)
    alone = BeamResponse(filaments[0], friction, filaments[0].beam_element(TEMPERATURE))
    ends, middle = np.array([0.0, 1.0]), np.array([0.5])
    zeros = np.zeros(2, dtype=int)
    assert alone.at(0, zeros, ends, 1e-3) == pytest.approx(1e-3 * 16.0 / least, rel=1e-6)
    assert alone.at(0, zeros[:1], middle, 1e-3) == pytest.approx(1e-3 * 2.25 / least, rel=1e-6)
    long = 1e12
    assert alone.at(0, zeros, ends, long) == pytest.approx(long * 4.0 / friction.perpendicular, rel=1e-3)
    clamped = BeamResponse(filaments[1], friction, filaments[1].beam_element(TEMPERATURE))
    # Half of a cantilever's compliance L^3/3EI, because theta is 1 and what counts is theta - 1/2: twice as much.
    compliance = (4 * LENGTH) ** 3 / (3.0 * filaments[1].beam_element(TEMPERATURE).rigidity)
    assert clamped.at(0, np.array([3]), np.array([1.0]), 1e20) == pytest.approx(2.0 * compliance, rel=1e-3)
    assert clamped.at(0, np.array([0]), np.array([0.0]), 1e20) == 0.0


def test_beads_keep_beams_apart():
    """Contacts of beads along the curve, on the nodes and control points of two filaments."""
    filaments = Filaments(VISCOSITY, 0.0, engine="compiled")
    kind = replace(BEAM, temperature=None, bending_rigidity=1000.0 * KT)
    filaments.add_straight(kind, 2, [0, 0, 0], [1, 0, 0])
    filaments.add_straight(kind, 2, [250, -250, 20], [0, 1, 0])
    for number in range(2):
        filaments.add_beads(number, 25.0)
    _, system, positions = filaments.build()
    system.addForce(contact_force(filaments, system, 50.0, 1.0))
    integrator = filaments.create_integrator(system, 1e4, checks=False)
    context = new_context(system, positions, integrator)
    integrator.step(300)
    now = positions_of(context)
    heights = [now[beads][:, 2] for beads in filaments.bead_indices]
    assert heights[1][10] - heights[0][10] > 45.0
    # The filaments are bent away from each other where they cross.
    assert heights[1][10] - heights[1][[0, -1]].mean() > 0.1


def test_what_is_refused():
    filaments = curved([])
    with pytest.raises(InputError, match="segment 3 does not exist"):
        filaments.add_attachment(1, segment=3)
    with pytest.raises(InputError, match="fraction must be a number between 0 and 1"):
        filaments.add_attachment(1, segment=0, fraction=1.5)
    filaments.build()
    place = filaments.segment_place(1, arc_length=0.5 * unit.micrometer)
    assert (place.first, place.second) == tuple(filaments.node_indices[1][2:4]) and place.fraction == 0.0
