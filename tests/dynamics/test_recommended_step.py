"""The recommended step of a System: forces beside filaments, flow, FENE lengths, zero temperature, and its warnings."""

import time
import warnings
from dataclasses import replace

import numpy as np
import openmm
import pytest
from openmm import unit
from scipy.linalg import eigh, eigvals, solve_discrete_lyapunov

from openmm_cylchain import (
    DSDNA,
    F_ACTIN,
    MICROTUBULE,
    Filaments,
    Flow,
    InputError,
    Plane,
    TimeStepWarning,
    capsule_contact_force,
    filament_wall_force,
    recommended_time_step,
)
from openmm_cylchain.couplings import contacts, pulling
from openmm_cylchain.couplings import walls as confinement
from openmm_cylchain.couplings.crosslinks import Crosslinks
from openmm_cylchain.time_steps.mobility import FilamentResponse
from openmm_cylchain.time_steps.recommended_step import fene_steps
from openmm_cylchain.time_steps.schemes import IMPLICIT_SCHEMES, SCHEMES, amplification_of_second_order
from openmm_cylchain.time_steps.springs import ACCURATE
from openmm_cylchain.time_steps.time_step import as_step
from support.contexts import new_context, positions_of
from support.dense_mechanics import straight_matrices, straight_resistance
from support.linked_pairs import PICONEWTON_PER_NANOMETER, linked_pairs, pairs_of_filaments
from support.solvent import KT, TEMPERATURE, VISCOSITY

SIGMAS = 4.0


# The theory


def linear_step(scheme, resistance, stiffness, spring, theta):
    """What a step makes of the nodes, without noise, for linear forces of its own and an explicit spring."""
    if scheme == "implicit":
        return np.eye(len(stiffness)) - np.linalg.solve(resistance + theta * stiffness, stiffness + spring)
    diagonal = 1 - np.sqrt(0.5)
    matrix = resistance + diagonal * stiffness
    first = np.linalg.solve(matrix, resistance - diagonal * spring)
    return np.linalg.solve(matrix, resistance - (1 - diagonal) * stiffness @ first - spring)


@pytest.mark.parametrize("kind, segments", [(DSDNA, 8), (F_ACTIN, 16), (MICROTUBULE, 8)])
@pytest.mark.parametrize("place", [0, 0.5])
@pytest.mark.parametrize("scheme", IMPLICIT_SCHEMES)
def test_no_variance_is_larger_than_the_bound(kind, segments, place, scheme):
    # The linear schemes in full, with noise that keeps k_B T K^-1.
    node = round(place * segments)
    step = recommended_time_step(kind, VISCOSITY, TEMPERATURE, scheme, segments).step
    filaments, *_ = pairs_of_filaments(kind, segments)
    friction = kind.segment_friction(VISCOSITY, TEMPERATURE, segments)
    response = FilamentResponse(filaments[0], friction, scheme)
    for h in (1e-6 * step, 1e-2 * step, step):
        resistance, stiffness, theta = straight_matrices(kind, segments, h)
        own = np.linalg.inv(resistance / h + (theta - 0.5) * stiffness)[node, node]
        if scheme == "implicit-second-order":
            rates, modes = eigh(stiffness, resistance)
            z = np.maximum(h * rates, 1e-9)
            left = amplification_of_second_order(z)
            own = np.sum(modes[node] ** 2 * h * 2 * (1 - left) / (z * (1 + left)))
        # Across or along, whichever is more.
        assert response.at(0, [min(node, segments - 1)], [float(node == segments)], h)[0] >= own * (1 - 1e-6)
        for strength in (0.1, 0.5, 1.5, 2.5):
            spring = np.zeros_like(stiffness)
            spring[node, node] = strength / own
            # A weak trap at every node keeps the filament in place, so that variances exist.
            held = stiffness + 1e-6 * np.eye(len(stiffness)) * np.trace(stiffness) / len(stiffness)
            free = linear_step(scheme, resistance / h, held, np.zeros_like(held), theta)
            advance = linear_step(scheme, resistance / h, held, spring, theta)
            if strength > 2:
                assert np.max(np.abs(eigvals(advance))) > 1
                continue
            equilibrium = np.linalg.inv(held)
            noise = equilibrium - free @ equilibrium @ free.T
            variance = solve_discrete_lyapunov(advance, noise)[node, node]
            excess = variance / np.linalg.inv(held + spring)[node, node]
            assert 1 - 1e-6 < excess <= (1 + 1e-3) / (1 - strength / 2)


def test_response_to_short_steps_is_the_mobility_of_the_nodes():
    filaments, *_ = pairs_of_filaments(F_ACTIN, 5)
    friction = F_ACTIN.segment_friction(VISCOSITY, TEMPERATURE)
    across = straight_resistance(F_ACTIN, 5, friction.perpendicular, friction.rotational)
    along = straight_resistance(F_ACTIN, 5, friction.parallel, friction.extensional)
    mobility = np.maximum(np.diag(np.linalg.inv(across)), np.diag(np.linalg.inv(along)))
    for scheme in SCHEMES:
        response = FilamentResponse(filaments[0], friction, scheme)
        assert response.at(0, np.arange(5), np.zeros(5), 1e-3) == pytest.approx(1e-3 * mobility[:5], rel=1e-9)
    one, *_ = pairs_of_filaments(F_ACTIN, 1)
    rod = FilamentResponse(one[0], friction, "implicit")
    quarter = 360**2 / 4
    across = 1 / friction.perpendicular + quarter / friction.rotational
    end = max(across, 1 / friction.parallel + quarter / friction.extensional)
    assert rod.at(0, [0], [0.0], 7.0)[0] == pytest.approx(7 * end, rel=1e-9)
    middle = 1 / friction.parallel
    assert rod.at(0, [0], [0.5], 7.0)[0] == pytest.approx(7 * middle, rel=1e-9)


def test_filaments_in_pieces_move_no_less_than_whole_ones():
    filaments = Filaments(VISCOSITY, TEMPERATURE)
    filaments.add_straight(F_ACTIN, 128, [0, 0, 0], [1, 0, 0])
    filaments.add_straight(F_ACTIN, 160, [0, 0, 0], [1, 0, 0])
    friction = F_ACTIN.segment_friction(VISCOSITY, TEMPERATURE)
    whole, cut = (FilamentResponse(one, friction, "implicit") for one in filaments)
    for step in (1e3, 1e9):
        interior = whole.at(0, [64], [0.0], step)[0]
        assert cut.at(0, [64], [0.0], step)[0] == pytest.approx(interior, rel=1e-3)
        assert cut.at(1, [144], [0.0], step)[0] > 0.9 * interior


# Against simulations: two free filaments whose middles a spring joins have 3/2 k_B T in it, whatever the chain


def link_energies(kind, segments, stiffness, step, count, steps, seed=1):
    """Mean energy of the springs in k_B T and its error, from ``count`` pairs of filaments, and divided steps."""
    filaments, system, positions, pairs = linked_pairs(kind, segments, stiffness, count)
    step = filaments.recommended_time_step("implicit", system=system) if step is None else step
    integrator = filaments.create_integrator(system, step, scheme="implicit", random_seed=seed)
    context = new_context(system, positions, integrator)
    first, second = np.transpose(pairs)
    samples = []
    for block in range(steps // 5):
        integrator.step(5)
        if block >= steps // 25:
            nodes = positions_of(context)
            squares = np.sum((nodes[first] - nodes[second]) ** 2, axis=1)
            samples.append(0.5 * stiffness * PICONEWTON_PER_NANOMETER * squares / KT)
    by_pair = np.mean(samples, axis=0)
    return by_pair.mean(), by_pair.std(ddof=1) / np.sqrt(count), integrator.getNumDividedSteps()


LINKS = [(DSDNA, 8, 10.0), (MICROTUBULE, 8, 0.03), (MICROTUBULE, 8, 0.1), (F_ACTIN, 16, 1e-3), (F_ACTIN, 16, 3e-3)]


@pytest.mark.sample("kind[034]")
@pytest.mark.slow
@pytest.mark.parametrize("kind, segments, stiffness", LINKS)
def test_links_have_their_energy_at_the_recommended_step(kind, segments, stiffness):
    mean, error, divided = link_energies(kind, segments, stiffness, None, 200, 5000)
    assert SIGMAS * error < 0.05 * 1.5
    assert abs(mean - 1.5) < 0.05 * 1.5 + SIGMAS * error, (mean, error)
    assert divided == 0


def test_a_link_has_its_energy_at_the_recommended_step():
    mean, error, divided = link_energies(DSDNA, 4, 10.0, None, 200, 1500)
    assert SIGMAS * error < 0.05 * 1.5
    assert abs(mean - 1.5) < 0.05 * 1.5 + SIGMAS * error, (mean, error)
    assert divided == 0


def test_a_link_has_too_much_energy_at_the_step_of_filaments_alone():
    step = recommended_time_step(DSDNA, VISCOSITY, TEMPERATURE, "implicit", 8)
    with pytest.warns(TimeStepWarning, match="too long for (the )?forces"):
        mean, error, _ = link_energies(DSDNA, 8, 10.0, step, 50, 500)
    assert mean > 1.15 * 1.5 + SIGMAS * error


# Which forces, and what they are called


def two_particles_with(force, friction):
    """A filament far from two particles of a friction between which a force acts; they are particles 0 and 1."""
    system, topology = openmm.System(), openmm.app.Topology()
    residue = topology.addResidue("X", topology.addChain())
    for _ in range(2):
        system.addParticle(1.0)
        topology.addAtom("X", None, residue)
    if force is not None:
        system.addForce(force)
    filaments = Filaments(VISCOSITY, TEMPERATURE)
    filaments.add_straight(F_ACTIN, 2, [0, 0, 0], [1, 0, 0])
    filaments.add_to(topology, system, np.array([[0.0, 99, 0], [0, 99, 1]]) * unit.nanometer)
    return filaments, system, friction


def bond(stiffness, first=0, second=1):
    force = openmm.HarmonicBondForce()
    force.addBond(first, second, 1.0, stiffness)
    return force


def external(expression, names=(), values=(), particle=0):
    force = openmm.CustomExternalForce(expression)
    for name in names:
        force.addPerParticleParameter(name)
    force.addParticle(particle, values)
    return force


def custom_bond(expression, names=(), values=()):
    force = openmm.CustomBondForce(expression)
    for name in names:
        force.addPerBondParameter(name)
    force.addBond(0, 1, values)
    return force


FRICTION = 500.0


@pytest.mark.parametrize(
    "force, name, rate",
    [
        (lambda: bond(40.0), "HarmonicBondForce (force 0): bond 0", 2 * 40.0 / FRICTION),
        (lambda: custom_bond("0.5*k*(r-3)^2", ["k"], [40.0]), "CustomBondForce (force 0): bond 0", 2 * 40.0 / FRICTION),
        (
            lambda: external("k*((x-x0)^2+2*y^2+z^2)", ["k", "x0"], [5.0, 70.0]),
            "CustomExternalForce (force 0): entry 0",
            20.0 / FRICTION,
        ),
        (
            lambda: confinement.wall_force(confinement.Sphere([0, 0, 0], 200), 40.0, [0]),
            "Wall (sphere) (force 0): entry 0",
            40.0 / FRICTION,
        ),
    ],
)
@pytest.mark.parametrize(
    "friction", [FRICTION, FRICTION * unit.kilojoule_per_mole * unit.picosecond / unit.nanometer**2]
)
def test_particles_outside_filaments(force, name, rate, friction):
    filaments, system, friction = two_particles_with(force(), friction)
    recommended = filaments.recommended_time_step(system=system, particle_friction=friction)
    assert recommended.allowed[name] == pytest.approx(ACCURATE / rate, rel=2e-3)
    assert recommended.bounds[name] == pytest.approx(2 / rate, rel=2e-3)
    assert recommended.step == recommended.allowed[name]
    assert name in recommended.reason
    assert recommended.unknown_forces == ()


@pytest.mark.parametrize(
    "force",
    [
        lambda: pulling.constant_force([0], [1.0, 2.0, 3.0]),
        lambda: external("2*x-y", ()),
        openmm.CMMotionRemover,
        lambda: bond(0.0),
    ],
)
def test_forces_without_stiffness_do_not_bind(force):
    filaments, system, friction = two_particles_with(force(), FRICTION)
    recommended = filaments.recommended_time_step(system=system, particle_friction=friction)
    assert recommended.step == filaments.recommended_time_step().step
    assert recommended.unknown_forces == ()


@pytest.mark.parametrize(
    "force",
    [
        lambda: external("max(0, x-30)^2"),
        lambda: external("k*periodicdistance(x,y,z,0,0,0)^2", ["k"], [3.0]),
        lambda: custom_bond("4*(r^-12-r^-6)"),
        openmm.PeriodicTorsionForce,
    ],
)
def test_forces_of_unknown_stiffness_are_named(force):
    filaments, system, friction = two_particles_with(force(), FRICTION)
    recommended = filaments.recommended_time_step(system=system, particle_friction=friction)
    label = f"{system.getForce(0).getName()} (force 0)"
    assert recommended.unknown_forces == (label,)
    assert f"not known: {label}" in str(recommended)


def test_particles_without_friction_are_refused():
    filaments, system, _ = two_particles_with(bond(1.0), None)
    with pytest.raises(InputError, match="give particle_friction"):
        filaments.recommended_time_step(system=system)
    with pytest.raises(InputError, match="too few particles"):
        filaments.recommended_time_step(system=openmm.System())


def test_the_spring_that_binds_is_named():
    filaments, system, _, pairs = linked_pairs(F_ACTIN, 4, 1e-3, count=4)
    force = system.getForce(system.getNumForces() - 1)
    force.setBondParameters(2, *pairs[2], 0.0, 0.5)
    name = f"HarmonicBondForce (force {system.getNumForces() - 1}): bond 2"
    recommended = filaments.recommended_time_step("implicit", system=system)
    assert name in recommended.bounds and name in recommended.reason


def test_several_springs_add():
    filaments, system, _, pairs = linked_pairs(F_ACTIN, 4, 0.05)
    one = filaments.recommended_time_step("implicit", system=system).step
    system.getForce(system.getNumForces() - 1).addBond(*pairs[0], 0.0, 0.05 * PICONEWTON_PER_NANOMETER)
    both = filaments.recommended_time_step("implicit", system=system).step
    assert both < 0.51 * one
    system.addForce(bond(0.05 * PICONEWTON_PER_NANOMETER, *pairs[0]))
    recommended = filaments.recommended_time_step("implicit", system=system)
    assert recommended.step < 0.68 * both
    assert "explicit forces together" in recommended.reason


def test_places_on_filaments():
    filaments = Filaments(VISCOSITY, TEMPERATURE)
    filaments.add_straight(F_ACTIN, 4, [0, 0, 0], [1, 0, 0])
    filaments.add_straight(F_ACTIN, 4, [0, 9, 0], [1, 0, 0], clamped=[0])
    filaments.add_attachment(0, segment=0, fraction=0.0)
    filaments.add_attachment(0, segment=0, fraction=0.5)
    _, system, _ = filaments.build()
    end, half = (int(index) for index in filaments.attachment_indices)
    node = int(filaments.node_indices[0][0])
    steps = []
    for particle in (node, end, half):
        force = external("0.05*(x^2+y^2+z^2)", particle=particle)
        index = system.addForce(force)
        steps.append(filaments.recommended_time_step("implicit", system=system).step)
        system.removeForce(index)
    assert steps[0] == pytest.approx(steps[1], rel=1e-9)
    assert steps[2] > 1.5 * steps[0]
    # What a clamped node feels moves nothing.
    system.addForce(external("5e9*(x^2+y^2+z^2)", particle=int(filaments.node_indices[1][0])))
    alone = filaments.recommended_time_step("implicit")
    assert filaments.recommended_time_step("implicit", system=system).step == alone.step


def system_with_crosslinks(model, first_only, rest_length=10.0):
    filaments, system, _, pairs = pairs_of_filaments(F_ACTIN, 8)
    extension = 100.0 if model == "fene" else None
    links = Crosslinks(0.5, rest_length, model, extension)
    if first_only:
        links.add(None, *pairs[0])
    links.add_to(system)
    return filaments, system, pairs, f"Crosslinks (force {system.getNumForces() - 1}): "


@pytest.mark.parametrize("first_only, model", [(True, "harmonic"), (False, "harmonic"), (False, "fene")])
def test_crosslinks_where_they_are_explicit(first_only, model):
    filaments, system, pairs, label = system_with_crosslinks(model, first_only)
    recommended = filaments.recommended_time_step("midpoint", system=system)
    name = next(name for name in recommended.allowed if name.startswith(label))
    assert ("crosslink 0" if first_only else "crosslink to come") in name
    if first_only:
        system.removeForce(system.getNumForces() - 1)
        system.addForce(bond(0.5, *pairs[0]))
        alone = filaments.recommended_time_step("midpoint", system=system)
        of_bond = next(value for key, value in alone.allowed.items() if "bond" in key)
        assert recommended.allowed[name] == pytest.approx(of_bond)


@pytest.mark.parametrize("scheme", IMPLICIT_SCHEMES)
@pytest.mark.parametrize("first_only, model", [(True, "harmonic"), (False, "harmonic"), (False, "fene")])
def test_crosslinks_in_the_equations_bind_by_their_rest_length(first_only, model, scheme):
    filaments, system, _, label = system_with_crosslinks(model, first_only)
    recommended = filaments.recommended_time_step(scheme, system=system)
    assert recommended.reason.startswith(label)
    assert ("crosslink 0" if first_only else "crosslink to come") in recommended.reason
    friction = F_ACTIN.segment_friction(filaments.viscosity, filaments.temperature, 8).perpendicular
    assert recommended.step == pytest.approx((0.6 * 10.0) ** 2 / (2 * KT * 2 / friction))
    # Those without a direction do not bind, however stiff they are.
    filaments, system, _, label = system_with_crosslinks("harmonic", first_only, 0.0)
    free = filaments.recommended_time_step(scheme)
    assert filaments.recommended_time_step(scheme, system=system).step == free.step


@pytest.mark.parametrize("rest_length", [0.0, 35.0])
def test_links_of_filaments_that_touch_bind_by_both_stiffnesses(rest_length):
    """The two springs in series, a wall or a contact; one alone does not bind."""
    kind, link, contact, wall = F_ACTIN.with_segment_length(100.0), 0.15, 0.23, 0.4

    def recommended(*forces):
        filaments = Filaments(VISCOSITY, TEMPERATURE, engine="compiled")
        for y in (0.0, 40.0, 80.0):
            filaments.add_straight(kind, 1, [0.0, y, 0.0], [1.0, 0.0, 0.0])
        _, system, _ = filaments.build()
        if "links" in forces:
            links = Crosslinks(link, rest_length)
            links.add(None, *(filaments.segment_place(number, segment=0) for number in (0, 1)))
            links.add(None, filaments.segment_place(2, segment=0), [0.0, 80.0, 0.0], 2 * link)
            links.add_to(system)
        if "contacts" in forces:
            system.addForce(capsule_contact_force(filaments, system, 30.0, contact))
        if "wall" in forces:
            system.addForce(filament_wall_force(filaments, system, Plane([0, -5, 0], [0, 1, 0]), wall))
        return filaments.recommended_time_step("implicit", system=system)

    friction = kind.segment_friction(VISCOSITY, TEMPERATURE)
    end = 1 / friction.perpendicular + 100.0**2 / (4 * friction.rotational)
    for forces, stiffness in ((["contacts"], contact), (["wall"], wall), (["contacts", "wall"], wall)):
        step = recommended("links", *forces)
        assert "crosslink 0: beside contacts or walls, " in step.reason
        assert step.step == pytest.approx(0.6 / (2 * end * link * stiffness / (link + stiffness)))
        for others in (["links"], forces):
            assert "beside contacts" not in str(recommended(*others).allowed)
            assert recommended(*others).step > 1.5 * step.step


@pytest.mark.parametrize("scheme", IMPLICIT_SCHEMES)
@pytest.mark.parametrize("stiffness", [3.0, 100.0])
def test_fene_links_without_a_rest_length_bind_by_their_length_in_equilibrium(stiffness, scheme):
    count, extension = 100, 60.0
    filaments = Filaments(VISCOSITY, TEMPERATURE, engine="compiled")
    kind = F_ACTIN.with_segment_length(100.0)
    for pair in range(count):
        for y in (0.0, 0.5):
            filaments.add_straight(kind, 3, [0.0, y, 500.0 * pair], [1.0, 0.0, 0.0])
    _, system, positions = filaments.build()
    links = Crosslinks(stiffness, 0.0, "fene", extension)
    for pair in range(count):
        ends = (filaments.segment_place(2 * pair + k, segment=1) for k in (0, 1))
        links.add(None, *ends)
    links.add_to(system)
    step = filaments.recommended_time_step(scheme, system=system)
    assert "its length in equilibrium" in step.reason
    friction = kind.segment_friction(VISCOSITY, TEMPERATURE, 3).perpendicular
    assert step.step == pytest.approx(0.36 * 3 * KT / stiffness / (2 * KT * 2 / friction))
    integrator = filaments.create_integrator(system, step, scheme, random_seed=1)
    context = new_context(system, positions, integrator, "CPU")
    integrator.step(100)
    squares = np.empty((160, count))
    for row in squares:
        integrator.step(3)
        row[:] = links.lengths(context) ** 2
    assert integrator.getNumDividedSteps() <= 1e-4 * count * 580
    # The mean of u^2 with the weight (1-u^2)^(b/2) u^2, b = k D^2/k_B T.
    ratio = squares.mean(axis=0) / (3.0 * extension**2 / (stiffness * extension**2 / KT + 5.0))
    error = ratio.std(ddof=1) / np.sqrt(count)
    assert error < 0.01
    assert abs(ratio.mean() - 1.0) < 0.01 + SIGMAS * error


def test_tethers_bind_where_they_are_explicit():
    filaments = Filaments(VISCOSITY, TEMPERATURE, engine="compiled")
    filaments.add_straight(F_ACTIN, 4, [0, 0, 0], [1, 0, 0])
    filaments.add_tether(0, 0, [0, 0, 0], 500.0)
    _, system, _ = filaments.build()
    assert "Tethers: tether 0" in filaments.recommended_time_step("midpoint", system=system).reason
    assert not any("ether" in name for name in filaments.recommended_time_step("implicit", system=system).bounds)


def test_contacts_of_a_system():
    filaments = Filaments(VISCOSITY, TEMPERATURE)
    for number in range(3):
        filaments.add_straight(F_ACTIN.with_segment_length(100), 10, [0, 50 * number, 0], [1, 0, 0])
        filaments.add_beads(number, 15)
    _, system, _ = filaments.build()
    system.addForce(contacts.contact_force(filaments, system, 30.0, 2.0))
    recommended = filaments.recommended_time_step("implicit", system=system)
    label = f"Contact (force {system.getNumForces() - 1})"
    names = {name.rsplit(" ", 1)[0] for name in recommended.bounds}
    assert {f"{label}: end of filament", f"{label}: all along filament", "contact"} <= names
    # The older bound, which knows no bending, is that for all beads of a segment.
    old = filaments.recommended_time_step("implicit", contact_diameter=30.0, contact_stiffness=2.0)
    assert 0.2 * old.step < recommended.step <= 1.05 * old.step
    assert recommended.allowed["contact diffusion"] == pytest.approx(old.allowed["contact diffusion"])


def test_a_network_takes_little_time():
    generator = np.random.default_rng(1)
    filaments = Filaments(VISCOSITY, TEMPERATURE)
    for _ in range(200):
        filaments.add_straight(
            F_ACTIN.with_segment_length(100), 20, generator.uniform(0, 3000, 3), generator.normal(size=3)
        )
    for number in range(1800):
        filaments.add_attachment(number % 200, segment=int(generator.integers(20)), fraction=float(generator.uniform()))
    _, system, _ = filaments.build()
    links = Crosslinks(0.05, 10.0)
    places = generator.permutation(filaments.attachment_indices)
    for first, second in zip(places[:900], places[900:]):
        links.add(None, int(first), int(second))
    links.add_to(system)
    start = time.process_time()
    recommended = filaments.recommended_time_step("implicit", system=system)
    assert time.process_time() - start < 10.0
    # No more than one link on the end of a filament, with many beside it.
    assert 0.0 < recommended.step < filaments.recommended_time_step("implicit").step


# Flow, temperature, FENE lengths


def test_flow_may_strain_by_three_per_cent():
    filaments = Filaments(VISCOSITY, TEMPERATURE)
    filaments.add_straight(F_ACTIN, 8, [0, 0, 0], [1, 0, 0])
    rate = 1e5 / unit.second
    recommended = filaments.recommended_time_step(flow=Flow.shear(rate))
    assert recommended.step == pytest.approx(0.03 * 1e7)
    assert "flow" in recommended.reason
    of_type = recommended_time_step(F_ACTIN, VISCOSITY, TEMPERATURE, segments=8, flow=Flow.shear(1e-7))
    assert recommended.step == of_type.step
    assert "flow" not in filaments.recommended_time_step(flow=Flow.uniform([1, 0, 0])).bounds


def test_temperature_of_the_run():
    filaments = Filaments(VISCOSITY, TEMPERATURE)
    filaments.add_straight(DSDNA, 16, [0, 0, 0], [1, 0, 0])
    warm, cold = (filaments.recommended_time_step("implicit", temperature=kelvin) for kelvin in (310, 31 * unit.kelvin))
    assert cold.step > 5 * warm.step


@pytest.mark.parametrize("scheme", ["implicit", "midpoint", "euler"])
@pytest.mark.parametrize("segments, rigidity", [(1, None), (4, 0.0)])
def test_rods_at_zero_temperature_have_a_finite_step(scheme, segments, rigidity):
    kind = F_ACTIN if rigidity is None else replace(F_ACTIN, bending_rigidity=rigidity)
    recommended = recommended_time_step(kind, VISCOSITY, 0, scheme, segments)
    friction = kind.segment_friction(VISCOSITY, 0)
    relaxation = friction.extensional / kind.segment_stiffness / 360**2
    assert recommended.step == pytest.approx(relaxation / (20 if scheme == "implicit" else 10))
    assert "length" in recommended.reason


def test_what_else_moves_a_rod_at_zero_temperature_sets_its_step():
    filaments = Filaments(VISCOSITY, 0)
    filaments.add_straight(F_ACTIN, 1, [0, 0, 0], [1, 0, 0])
    _, system, _ = filaments.build()
    idle = filaments.recommended_time_step("implicit", system=system)
    system.addForce(external("1e-6*(x^2+y^2+z^2)", particle=0))
    pulled = filaments.recommended_time_step("implicit", system=system)
    assert "CustomExternalForce" in pulled.reason and pulled.step > 100 * idle.step
    sheared = filaments.recommended_time_step("implicit", flow=Flow.shear(1e-9))
    assert sheared.step == pytest.approx(0.03 * 1e9)
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        filaments.create_integrator(system, 100 * idle.step)


def test_a_hot_run_keeps_the_friction_of_its_filaments():
    # Eq. (20) has no friction at this temperature.
    soft = replace(F_ACTIN, stretching_stiffness=1.0, bending_rigidity=10.0)
    filaments = Filaments(VISCOSITY, TEMPERATURE, engine="compiled")
    filaments.add_straight(soft, 4, [0, 0, 0], [1, 0, 0])
    _, system, _ = filaments.build()
    recommended = filaments.recommended_time_step(temperature=1e7, system=system)
    assert recommended.step < filaments.recommended_time_step().step
    filaments.create_integrator(system, recommended, temperature=1e7)


@pytest.mark.parametrize("engine", ["compiled", "portable"])
def test_forces_of_the_engines_are_known(engine):
    filaments = Filaments(VISCOSITY, TEMPERATURE, engine=engine)
    filaments.add_straight(F_ACTIN, 4, [0, 0, 0], [1, 0, 0], propulsion=0.1)
    filaments.add_tether(0, 0, [0, 0, 0], 0.5)
    _, system, _ = filaments.build()
    filaments.create_integrator(system, 1.0)
    recommended = filaments.recommended_time_step(system=system)
    assert recommended.unknown_forces == ()
    assert ("Tethers: tether 0" in recommended.bounds) == (engine == "portable")


def test_lengths_however_stiff_or_slow_do_not_bind_the_implicit_scheme():
    usual = recommended_time_step(F_ACTIN, VISCOSITY, TEMPERATURE, "implicit", 8).step
    for changed in (
        replace(F_ACTIN, stretching_stiffness=1e8 * unit.piconewton / unit.nanometer),
        replace(F_ACTIN, extension_relaxation_time=1 * unit.second),
    ):
        assert recommended_time_step(changed, VISCOSITY, TEMPERATURE, "implicit", 8).step == usual


def fene_actin(extension):
    return replace(F_ACTIN, stretching_model="fene", maximum_extension=extension)


def test_fene_lengths_bind_explicit_schemes():
    steps = [
        recommended_time_step(fene_actin(extension), VISCOSITY, TEMPERATURE, "midpoint", 16).step
        for extension in (10.0, 3.6, 1.0, 0.5)
    ]
    assert np.all(np.diff(steps) < 0)
    # Half the step that noise takes beyond the range, at five sigma, and less where the range is narrow.
    friction = F_ACTIN.segment_friction(VISCOSITY, TEMPERATURE)
    for extension in (3.6, 1.0):
        explicit = recommended_time_step(fene_actin(extension), VISCOSITY, TEMPERATURE, "midpoint", 16)
        noise = np.sqrt(2 * KT * explicit.step * 360**2 / friction.extensional)
        assert 5 * noise < extension
    assert explicit.step < 0.01 * recommended_time_step(F_ACTIN, VISCOSITY, TEMPERATURE, "midpoint", 16).step


def test_fene_lengths_bind_the_implicit_scheme_only_where_it_gets_them_wrong():
    usual = recommended_time_step(F_ACTIN, VISCOSITY, TEMPERATURE, "implicit", 16).step
    for extension in (360.0, 36.0, 3.6, 1.0, 0.1):
        recommended = recommended_time_step(fene_actin(extension), VISCOSITY, TEMPERATURE, "implicit", 16)
        assert recommended.step == usual and recommended.allowed["range"] == np.inf
    # Its steps are no longer than what these lengths take.
    soft = replace(DSDNA, stretching_stiffness=0.1, stretching_modulus=None)
    kind = replace(soft, stretching_model="fene", maximum_extension=4.0)
    friction = kind.segment_friction(VISCOSITY, TEMPERATURE)
    resolved, drawn = fene_steps(kind, friction, TEMPERATURE * unit.kelvin)
    assert (resolved, drawn) == fene_steps(kind, friction, TEMPERATURE)
    nu = 0.1 * 16 / KT
    assert resolved == pytest.approx((1.5e-5 + 6e-4 * nu**2) * 16 * friction.extensional / 144 / KT)
    assert drawn == pytest.approx(200 * friction.extensional / 0.1 / 64 / nu)
    recommended = recommended_time_step(kind, VISCOSITY, TEMPERATURE, "implicit", 4)
    assert recommended.step == resolved < 0.1 * recommended_time_step(DSDNA, VISCOSITY, TEMPERATURE, "implicit", 4).step
    assert "FENE" in recommended.reason
    stiff = replace(kind, stretching_stiffness=30 * KT / 16)
    assert fene_steps(stiff, friction, TEMPERATURE) == (np.inf, 0.0) == fene_steps(kind, friction, 0)


def test_soft_lengths_bind():
    length = 100.0
    for segments, stiffness, binds in (
        (1, 100, True),
        (1, 1900, True),
        (1, 2100, False),
        (2, 100, True),
        (8, 260, False),
        (8, 30, True),
    ):
        kind = replace(
            F_ACTIN.with_segment_length(length), stretching_stiffness=stiffness * KT / length**2, bending_rigidity=0
        )
        recommended = recommended_time_step(kind, VISCOSITY, TEMPERATURE, "implicit", segments)
        assert ("soft lengths" in recommended.bounds) == binds
        if binds:
            friction = kind.segment_friction(VISCOSITY, TEMPERATURE, segments)
            assert recommended.bounds["soft lengths"] == pytest.approx(0.0008 * segments * friction.extensional / KT)


@pytest.mark.sample(r"36|3\.6|0\.6")
@pytest.mark.slow
@pytest.mark.parametrize("extension", [36.0, 10.8, 3.6, 1.0, 0.6])
def test_fene_energies_at_the_recommended_step(extension):
    kind, segments, chains = fene_actin(extension), 8, 64
    filaments = Filaments(VISCOSITY, TEMPERATURE)
    for number in range(chains):
        filaments.add_equilibrium(kind, segments, seed=number + 1)
    _, system, positions = filaments.build()
    integrator = filaments.create_integrator(system, filaments.recommended_time_step("implicit"), random_seed=1)
    context = new_context(system, positions, integrator)
    width = min(1.0, 12 / np.sqrt(kind.segment_stiffness * extension**2 / KT))
    u = width * (np.arange(20000) + 0.5) / 20000 * np.repeat([[-1], [1]], 20000, axis=1)
    energy = kind.stretching_energy(360 + extension * u) / KT
    weight = (360 + extension * u) ** 2 * np.exp(-energy)
    exact = np.sum(energy * weight) / np.sum(weight)
    samples = []
    for _ in range(400):
        integrator.step(10)
        nodes = positions_of(context)
        samples.append([one.energies(nodes[of])[0] for one, of in zip(filaments, filaments.node_indices)])
    by_chain = np.mean(samples, axis=0) / segments / KT
    error = by_chain.std(ddof=1) / np.sqrt(chains)
    assert SIGMAS * error < 0.08 * exact
    assert abs(by_chain.mean() - exact) < 0.03 * exact + SIGMAS * error, (by_chain.mean(), exact, error)
    assert integrator.getNumDividedSteps() <= 1e-3 * 4000 * chains


# TimeSteps in place of numbers, and warnings


@pytest.mark.parametrize("engine", ["compiled", "portable"])
def test_integrators_take_a_time_step(engine):
    filaments, system, *_ = pairs_of_filaments(F_ACTIN, 2, engine=engine)
    recommended = filaments.recommended_time_step()
    integrator = filaments.create_integrator(system, recommended)
    assert integrator.getStepSize()._value == recommended.step
    integrator.setStepSize(0.5 * recommended.step * unit.picosecond)
    assert integrator.getStepSize()._value == pytest.approx(0.5 * recommended.step)
    integrator.setStepSize(recommended)
    assert integrator.getStepSize()._value == recommended.step
    assert as_step(2 * unit.nanosecond) == 2000.0
    with pytest.raises(InputError, match="step_size must be positive"):
        as_step(-1.0)


@pytest.mark.parametrize("scheme, factor", [("implicit", 4), ("midpoint", 4)])
def test_steps_far_above_the_recommended_one_warn(scheme, factor):
    filaments, system, *_ = pairs_of_filaments(F_ACTIN, 8, engine="compiled")
    recommended = filaments.recommended_time_step(scheme)
    with pytest.warns(TimeStepWarning, match="times as long as the recommended one of filament type 'ACT'") as caught:
        filaments.create_integrator(system, 1.01 * factor * recommended.step, scheme)
    assert len(caught) == 1 and str(recommended) in str(caught[0].message)
    assert caught[0].filename == __file__
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        filaments.create_integrator(system, 0.99 * factor * recommended.step, scheme)
        filaments.create_integrator(system, 100 * recommended.step, scheme, checks=False)


def test_stiff_forces_warn():
    filaments, system, _, _ = linked_pairs(MICROTUBULE, 8, 0.1)
    recommended = filaments.recommended_time_step("implicit")
    with pytest.warns(TimeStepWarning, match=r"HarmonicBondForce \(force \d+\): bond 0.*Recommended") as caught:
        filaments.create_integrator(system, recommended, "implicit")
    assert len(caught) == 1 and caught[0].filename == __file__
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        filaments.create_integrator(system, recommended, "implicit", checks=False)
        filaments.create_integrator(system, filaments.recommended_time_step("implicit", system=system), "implicit")


@pytest.mark.parametrize("scheme", ["implicit", "midpoint"])
def test_springs_are_warned_of_from_ten_per_cent_on(scheme):
    """A particle in a trap has the variance k_B T/k / (1 - k h/(2 gamma)), exactly."""
    for percent, warned in ((9.0, None), (11.0, "fluctuations may be 11 % too large"), (29.0, "29 %")):
        step = 2.0 * FRICTION / 40.0 * (1.0 - 1.0 / (1.0 + 0.01 * percent))
        filaments, system, friction = two_particles_with(external("20*x^2"), FRICTION)
        with warnings.catch_warnings(record=True) as caught:
            warnings.simplefilter("always", TimeStepWarning)
            filaments.create_integrator(system, step, scheme, particle_friction=friction)
        messages = [str(one.message) for one in caught if "CustomExternalForce (force 0): entry 0" in str(one.message)]
        assert len(messages) == (warned is not None), percent
        assert warned is None or warned in messages[0]


def test_links_of_microtubules_at_the_step_of_filaments_alone_are_warned_of():
    """A soft one, 0.03 pN/nm, has variances that are a third too large there."""
    filaments, system, _, _ = linked_pairs(MICROTUBULE, 8, 0.03)
    with pytest.warns(
        TimeStepWarning, match=r"HarmonicBondForce \(force \d+\): bond 0: fluctuations may be \d\d\.?\d? %"
    ):
        filaments.create_integrator(system, filaments.recommended_time_step("implicit"), "implicit")
