"""Self-propelled filaments of beam elements: forces along their curves, and how they move."""

from dataclasses import replace

import numpy as np
import openmm
import pytest
from numpy.polynomial import Legendre, Polynomial
from scipy.linalg import eigvals

from openmm_cylchain import Filaments, FilamentType, TimeStepWarning
from openmm_cylchain.beams.curve import element_slopes, place_weights
from support.contexts import energy_of, forces_of, new_context, positions_of
from support.solvent import KT, TEMPERATURE, VISCOSITY

KIND = FilamentType(
    name="BEAM",
    diameter=6.0,
    segment_length=300.0,
    persistence_length=1500.0,
    temperature=TEMPERATURE,
    stretching_modulus=1e4,
    friction_length="filament",
    element="beam",
)
FORCE = 0.8


def states_of(shape, propulsions, **options):
    """Forces and energies of one shape with each propulsion."""
    found = []
    for propulsion in propulsions:
        filaments = Filaments(VISCOSITY, TEMPERATURE, engine="compiled")
        nodes, controls = shape
        filaments.add_nodes(KIND, nodes, control_points=controls, propulsion=propulsion, **options)
        _, system, positions = filaments.build()
        context = new_context(system, positions)
        found.append((forces_of(context), energy_of(context)))
    return filaments, found


def bent(planar=False):
    filaments = Filaments(VISCOSITY, TEMPERATURE, engine="compiled")
    filaments.add_equilibrium(KIND, 4, seed=2, planar=planar)
    return filaments[0].positions, filaments[0].control_points


@pytest.mark.parametrize("planar", [False, True])
def test_state_holds_the_forces_but_no_energy(planar):
    """Those that do the work of a force F0 t dx on each part of the curve, by another quadrature than the engine's."""
    shape = bent(planar)
    filaments, (with_force, without) = states_of(shape, (FORCE, 0.0), planar=planar)
    assert with_force[1] == without[1]
    forces = with_force[0] - without[0]
    places, shares = np.polynomial.legendre.leggauss(20)
    places, shares = 0.5 * (1.0 + places), 0.5 * shares
    slopes = element_slopes(*shape, places, KIND.segment_length)
    density = FORCE * shares[:, None] * slopes / np.linalg.norm(slopes, axis=-1, keepdims=True)
    weights = place_weights(places)
    expected = np.zeros((2, 5, 3))
    for element, own in enumerate(density):
        position, control, other, other_control = weights.T @ own
        expected[0, element] += position - control
        expected[1, element] += control
        expected[0, element + 1] += other - other_control
        expected[1, element + 1] += other_control
    nodes, controls = filaments.node_indices[0], filaments.control_point_indices[0]
    np.testing.assert_allclose(forces[nodes], expected[0], atol=3e-4 * FORCE)
    np.testing.assert_allclose(forces[controls], expected[1], atol=3e-4 * FORCE)
    # All of it is along the line from end to end, and as long, where curves are hardly stretched.
    ends = FORCE * (shape[0][-1] - shape[0][0]) / KIND.segment_length
    np.testing.assert_allclose(forces.sum(axis=0), ends, atol=0.02 * FORCE * 4)


@pytest.mark.parametrize("propulsion", [5.0, -2.0])
def test_straight_filaments_glide(propulsion):
    """v = F0 t/gamma_par, with any number of elements, beside one that has no propulsion."""
    kind = replace(KIND, friction_length="segment")
    filaments = Filaments(VISCOSITY, 0.0, engine="compiled")
    for elements in (1, 5):
        filaments.add_straight(kind, elements, [0, 0, 100 * elements], [3, 4, 0], propulsion=propulsion)
    filaments.add_straight(kind, 2, [0, 0, -100], [3, 4, 0])
    _, system, positions = filaments.build()
    step = 1e5
    context = new_context(system, positions, filaments.create_integrator(system, step))
    context.getIntegrator().step(20)
    moved = (positions_of(context) - positions._value) / (20 * step)
    speed = propulsion / kind.segment_friction(VISCOSITY, 0.0).parallel
    for number in range(3):
        particles = np.concatenate([filaments.node_indices[number], filaments.control_point_indices[number]])
        expected = np.tile((speed if number < 2 else 0.0) * np.array([0.6, 0.8, 0.0]), (len(particles), 1))
        np.testing.assert_allclose(moved[particles], expected, rtol=1e-6, atol=1e-12)


@pytest.mark.parametrize("propulsion", [0.3, -0.3])
def test_elements_carry_what_those_beyond_push(propulsion):
    """At rest, one that a hinge holds at its first node is stretched by f (L s - s^2/2)/K at s, with f = F0/h."""
    filaments = Filaments(VISCOSITY, 0.0, engine="compiled")
    filaments.add_straight(KIND, 4, [0, 0, 0], [1, 0, 0], clamped=[0], propulsion=propulsion)
    _, system, positions = filaments.build()
    context = new_context(system, positions, filaments.create_integrator(system, 1e5, checks=False))
    context.getIntegrator().step(2000)
    h, length = KIND.segment_length, 4 * KIND.segment_length
    along = h * np.arange(5)
    stretch = propulsion / h * (length * along - 0.5 * along**2) / KIND.beam_element(0.0).modulus
    nodes = positions_of(context)[filaments.node_indices[0]]
    np.testing.assert_allclose(nodes[:, 0] - along, stretch, rtol=2e-3, atol=1e-9)
    np.testing.assert_allclose(nodes[:, 1:], 0.0, atol=1e-9)


def growth_rate(force, terms=12):
    """The largest one of small deflections y of a clamped filament that pushes itself towards its clamp.

    zeta dy/dt = -EI d^4y/ds^4 - f (L - s) d^2y/ds^2 for zeta = EI = L = 1: the tension -f (L - s) bends it, and the
    part of the force across the filament turns with it. By Galerkin's method with s^2 times polynomials, which meet the
    clamp, and the free end weakly.
    """
    places, shares = np.polynomial.legendre.leggauss(40)
    places, shares = 0.5 * (1.0 + places), 0.5 * shares
    shapes = [
        Polynomial([0.0, 0.0, 1.0]) * Legendre.basis(n, [0.0, 1.0]).convert(kind=Polynomial) for n in range(terms)
    ]
    values = np.array([shape(places) for shape in shapes])
    curvatures = np.array([shape.deriv(2)(places) for shape in shapes])
    mass, bending = values * shares @ values.T, curvatures * shares @ curvatures.T
    pushing = values * (shares * (1.0 - places)) @ curvatures.T
    return eigvals(-bending - force * pushing, mass).real.max()


def test_a_clamped_filament_flutters_beyond_the_critical_force():
    """Small deflections of one that pushes itself towards its clamp die out or grow at rates of the linear theory."""
    elements, stiffness = 6, KIND.beam_element(0.0).rigidity
    length = elements * KIND.segment_length
    friction = KIND.segment_friction(VISCOSITY, 0.0, elements).perpendicular / KIND.segment_length
    time = friction * length**4 / stiffness
    assert growth_rate(0.0) == pytest.approx(-(1.8751**4), rel=1e-4)
    # The critical f L^3/EI.
    assert growth_rate(75.9) < 0.0 < growth_rate(76.3)
    for force in (60.0, 90.0):
        filaments = Filaments(VISCOSITY, 0.0, engine="compiled")
        nodes = np.linspace([0, 0, 0], [length, 0, 0], elements + 1)
        nodes[:, 1] = 1e-6 * nodes[:, 0] ** 2 / length
        controls = nodes.copy()
        controls[:, 0] += KIND.segment_length / 3.0
        controls[:, 1] += 2e-6 * nodes[:, 0] / length * KIND.segment_length / 3.0
        propulsion = -force * stiffness / length**3 * KIND.segment_length
        filaments.add_nodes(
            KIND,
            nodes,
            control_points=controls,
            clamped=[0],
            clamped_tangents=[0],
            planar=True,
            propulsion=propulsion,
        )
        _, system, positions = filaments.build()
        step = 2e-5 * time
        context = new_context(system, positions, filaments.create_integrator(system, step, checks=False))
        ends = []
        for _ in range(500):
            context.getIntegrator().step(10)
            ends.append(positions_of(context)[filaments.node_indices[0][-1], 1])
        # An oscillation in which each number follows from the two before it.
        late = np.array(ends[200:])
        late /= np.abs(late).max()
        parts = np.linalg.lstsq(np.column_stack([late[1:-1], late[:-2]]), late[2:], rcond=None)[0]
        measured = np.log(np.abs(np.roots([1.0, *-parts])).max()) / (10 * 2e-5)
        assert measured == pytest.approx(growth_rate(force), rel=0.05)


@pytest.mark.parametrize("elements", [1, 2])
def test_gliding_rods_turn_and_diffuse(elements):
    """In a plane: <x> = v tau (1 - exp(-t/tau)) along the first direction, v = F0/gamma_par, tau = gamma_rot/k_B T."""
    count, steps = 2500, 100
    kind = replace(KIND, bending_rigidity=1e8, persistence_length=None, temperature=None, friction_length="segment")
    filaments = Filaments(VISCOSITY, TEMPERATURE, engine="compiled")
    friction, length = kind.segment_friction(VISCOSITY, TEMPERATURE), kind.segment_length * elements
    parallel, perpendicular = friction.parallel * elements, friction.perpendicular * elements
    tau = perpendicular * length**2 / 12.0 / KT
    speed = 3 * length / tau
    for number in range(count):
        propulsion = speed * friction.parallel
        filaments.add_straight(kind, elements, [0, 0, number], [1, 0, 0], planar=True, propulsion=propulsion)
    _, system, positions = filaments.build()
    integrator = filaments.create_integrator(system, tau / steps, random_seed=5, checks=False)
    context = new_context(system, positions, integrator)
    integrator.step(steps)
    nodes = np.array(filaments.node_indices)
    middles = (positions_of(context) - positions._value)[nodes].mean(axis=1)
    along = middles[:, 0]
    expected = speed * tau * (1 - np.exp(-1))
    error = along.std(ddof=1) / np.sqrt(count)
    assert abs(along.mean() - expected) < 4 * error + 0.005 * expected
    assert 4 * error < 0.05 * expected
    # <r^2> = 2 v^2 tau (t - tau + tau exp(-t/tau)) + 2 k_B T (1/gamma_par + 1/gamma_perp) t
    squares = np.sum(middles[:, :2] ** 2, axis=1)
    active = 2 * (speed * tau) ** 2 * np.exp(-1)
    passive = 2 * KT * (1 / parallel + 1 / perpendicular) * tau
    error = squares.std(ddof=1) / np.sqrt(count)
    assert abs(squares.mean() - active - passive) < 4 * error + 0.01 * active
    assert 4 * error < 0.1 * (active + passive)


def test_systems_survive_xml_and_checkpoints():
    filaments = Filaments(VISCOSITY, TEMPERATURE, engine="compiled")
    for number in range(3):
        filaments.add_equilibrium(KIND, 4, seed=number, start=[0, 500 * number, 0], propulsion=0.5 * number)
    _, system, positions = filaments.build()
    restored = openmm.XmlSerializer.deserialize(openmm.XmlSerializer.serialize(system))
    forces = [forces_of(new_context(one, positions)) for one in (system, restored)]
    np.testing.assert_array_equal(*forces)
    integrator = filaments.create_integrator(system, 1e4, random_seed=2, checks=False)
    context = new_context(system, positions, integrator)
    integrator.step(20)
    checkpoint = context.createCheckpoint()
    integrator.step(20)
    expected = positions_of(context)
    context.loadCheckpoint(checkpoint)
    integrator.step(20)
    np.testing.assert_array_equal(positions_of(context), expected)


def test_the_recommended_step_is_short_for_fast_elements():
    filaments = Filaments(VISCOSITY, TEMPERATURE, engine="compiled")
    friction = KIND.segment_friction(VISCOSITY, TEMPERATURE, 4).parallel
    filaments.add_straight(KIND, 4, [0, 0, 0], [1, 0, 0], propulsion=-0.2 * KIND.segment_length * friction / 1e5)
    recommended = filaments.recommended_time_step()
    assert "propulsion" in recommended.reason and recommended.step == pytest.approx(0.5e5, rel=1e-6)


def test_steps_that_take_elements_too_far_are_warned_of():
    filaments = Filaments(VISCOSITY, TEMPERATURE, engine="compiled")
    step = 1e6
    friction = KIND.segment_friction(VISCOSITY, TEMPERATURE, 4).parallel
    filaments.add_equilibrium(KIND, 4, seed=2, propulsion=0.2 * KIND.segment_length * friction / step)
    _, system, _ = filaments.build()
    recommended = filaments.recommended_time_step(system=system)
    assert recommended.allowed["propulsion"] == pytest.approx(0.5 * step, rel=1e-6)
    with pytest.warns(TimeStepWarning, match="propelled segment of filament type 'BEAM' advances by 0.6"):
        filaments.create_integrator(system, 3.0 * step)
