"""Flow of the solvent: what a Flow is, and how filaments and particles drift, turn and stretch in it."""

import copy
from dataclasses import replace

import numpy as np
import openmm
import pytest
from openmm import app, unit
from scipy.integrate import solve_ivp

from openmm_cylchain import F_ACTIN, Filament, Filaments, Flow, InputError
from openmm_cylchain.mechanics.tension import segment_end_forces
from support.contexts import forces_of, new_context, positions_of
from support.dense_mechanics import bent_chain, dense_resistance, virtual_forces
from support.platforms import ENGINE_PLATFORMS, ENGINES
from support.solvent import TEMPERATURE, VISCOSITY

RATE = 1e-9  # 1/ps, a thousand per second
GENERAL = Flow(
    velocity=[1e-6, -2e-6, 5e-7],
    gradient=RATE * np.array([[1.0, 2.0, -1.0], [0.5, -3.0, 0.7], [1.2, -0.4, 2.0]]),
    origin=[100, 0, -50],
)
FLOWS = {
    "uniform": Flow.uniform([1e-6, 2e-6, -3e-6]),
    "shear": Flow.shear(RATE, origin=[0, 0, 300]),
    "extension": Flow.extension(RATE, direction=[1, 1, 0], compression=[1, -1, 0]),
    "general": GENERAL,
}


def _velocity(flow, positions):
    gradient = np.array(flow.gradient)
    return np.array([flow.velocity + gradient @ np.subtract(x, flow.origin) for x in positions])


# What a Flow is


def test_constructors():
    x = [100.0, 200.0, 300.0]
    assert Flow().at(x).tolist() == [0, 0, 0] and Flow().is_at_rest
    assert Flow.uniform([1, 2, 3]).at([x, x]).tolist() == [[1, 2, 3]] * 2
    assert Flow.shear(2.0).at(x) == pytest.approx([600, 0, 0])
    assert Flow.shear(2.0, [0, 2, 0], [-3, 0, 0], [0, 0, 50]).at(x) == pytest.approx([0, -200, 0])
    assert Flow.extension(2.0).at(x) == pytest.approx([200, -400, 0])
    assert Flow.extension(-2.0, [0, 0, 1], [1, 0, 0], x).at([0, 0, 0]) == pytest.approx([-200, 0, 600])
    assert GENERAL.at([x, [0, 0, 0]]) == pytest.approx(_velocity(GENERAL, [x, [0, 0, 0]]))
    assert not GENERAL.is_at_rest and not Flow.shear(1e-30).is_at_rest


def test_units():
    assert Flow.shear(1000 / unit.second) == Flow.shear(1e-9)
    flow = Flow(
        [1 * unit.micrometer / unit.second, 0 * unit.micrometer / unit.second, 0 * unit.micrometer / unit.second],
        np.diag([1, -1, 0]) / unit.second,
        [0, 0, 1] * unit.micrometer,
    )
    assert flow.velocity == pytest.approx((1e-9, 0, 0)) and flow.origin == pytest.approx((0, 0, 1000))
    assert flow.at([1, 0, 1] * unit.micrometer) == pytest.approx([1e-9 + 1e-9, 0, 0])


def test_sum():
    total = FLOWS["uniform"] + FLOWS["shear"] + GENERAL
    for x in ([0, 0, 0], [100, 200, -300]):
        assert total.at(x) == pytest.approx(FLOWS["uniform"].at(x) + FLOWS["shear"].at(x) + GENERAL.at(x))
    with pytest.raises(TypeError):
        GENERAL + 1


@pytest.mark.parametrize(
    ("make", "message"),
    [
        (lambda: Flow([1, 2]), "velocity of the flow must have three components"),
        (lambda: Flow([1, 2, np.nan]), "velocity of the flow must be finite"),
        (lambda: Flow([1, 2, 3] * unit.kelvin), "velocity of the flow has the unit"),
        (lambda: Flow(origin=[1, 2]), "origin of the flow must have three components"),
        (lambda: Flow(gradient=[1, 2, 3]), r"must have the shape \(3, 3\)"),
        (lambda: Flow(gradient=np.full((3, 3), np.inf)), "gradient of the flow must be finite"),
        (lambda: Flow(gradient=np.eye(3)), "has the trace 3, but the solvent is incompressible"),
        (lambda: Flow.shear([1, 2]), "rate of the flow must be a single number"),
        (lambda: Flow.shear(1 * unit.nanometer), "rate of the flow has the unit"),
        (lambda: Flow.shear(1, [0, 0, 0]), "Shear flow: direction must not be the zero vector"),
        (lambda: Flow.shear(1, [1, 0, 0], [1, 0, 1]), "direction and gradient_direction must be perpendicular"),
        (lambda: Flow.extension(1, [1, 0, 0], [1, 0, 1]), "direction and compression must be perpendicular"),
        (lambda: GENERAL.at([1, 2]), r"positions must have the shape \(..., 3\)"),
        (lambda: GENERAL.at(3), r"positions must have the shape \(..., 3\)"),
    ],
)
def test_bad_flows_are_refused(make, message):
    with pytest.raises(InputError, match=message):
        make()


@pytest.mark.parametrize("engine", ENGINES)
def test_what_is_no_flow_is_refused(engine):
    filaments = Filaments(VISCOSITY, TEMPERATURE, engine=engine)
    filaments.add_straight(F_ACTIN, 2, [0, 0, 0], [1, 0, 0])
    _, system, _ = filaments.build()
    for wrong in (1.0, [1, 0, 0], "shear"):
        with pytest.raises(InputError, match="flow must be a Flow"):
            filaments.create_integrator(system, 1.0, flow=wrong)
    integrator = filaments.create_integrator(system, 1.0)
    with pytest.raises(InputError, match="flow must be a Flow"):
        integrator.setFlow(3)


# One segment


# All flows on the Reference platform, one of them on the others.
RUNS = [(*pair, name) for pair in ENGINE_PLATFORMS for name in FLOWS if "Reference" in pair or name == "general"]


def _segment_in_flow(engine, platform, kind, flow, step, steps):
    filaments = Filaments(VISCOSITY, 0, engine=engine)
    filaments.add_straight(kind, 1, [100, 200, 300], [0.8, 0.5, -0.33])
    _, system, positions = filaments.build()
    integrator = filaments.create_integrator(system, step, scheme="midpoint", flow=flow)
    context = new_context(system, positions, integrator, platform)
    integrator.step(steps)
    return positions._value, positions_of(context)


@pytest.mark.sample("^(?!portable-Reference-(shear|uniform))")
@pytest.mark.parametrize(("engine", "platform", "name"), RUNS)
def test_segment_tumbles_stretches_and_drifts(engine, platform, name):
    """A slender segment: t' = (1 - tt) G t, l' = l t.G t - l^2 k (l - l0)/gamma_def, and its middle follows u."""
    flow = FLOWS[name]
    gradient = np.array(flow.gradient)
    # As soft as to be stretched by the flow.
    kind = replace(F_ACTIN, stretching_stiffness=5e-4, extension_relaxation_time=None)
    friction = 2 * kind.segment_friction(VISCOSITY, 0).rotational
    kind = replace(kind, extensional_friction=friction)
    step, steps = 2e6, 1000  # 2 ms, in which the shear is 2
    start, fine = _segment_in_flow(engine, platform, kind, flow, step, steps)
    _, coarse = _segment_in_flow(engine, platform, kind, flow, 2 * step, steps // 2)

    def slope(_, state):
        tangent, length, middle = state[:3], state[3], state[4:]
        stretch = tangent @ gradient @ tangent
        relaxation = kind.segment_stiffness * (length - 360) * length**2 / friction
        drift = flow.velocity + gradient @ (middle - flow.origin)
        return np.concatenate([gradient @ tangent - stretch * tangent, [length * stretch - relaxation], drift])

    first = np.concatenate([(start[1] - start[0]) / 360, [360.0], start.mean(axis=0)])
    last = solve_ivp(slope, (0, step * steps), first, rtol=1e-10, atol=1e-10).y[:, -1]
    half = 0.5 * last[3] * last[:3]
    exact = np.array([last[4:] - half, last[4:] + half])
    # The scheme is of first order in the forces: what two steps are off by extrapolates to zero.
    moved = np.abs(exact - start).max()
    assert np.abs(2 * fine - coarse - exact).max() < 2e-5 * moved
    assert np.abs(fine - exact).max() < 3e-3 * moved
    assert name == "uniform" or np.abs(last[:3] - first[:3]).max() > 0.2
    assert name == "uniform" or abs(last[3] - 360) > 10


# Chains and particles, without noise


def _chains_and_particles(engine, planar=False):
    topology, system = app.Topology(), openmm.System()
    chain = topology.addChain()
    for mass in (1e5, 0.0, 1e5):
        topology.addAtom("B", None, topology.addResidue("BEA", chain))
        system.addParticle(mass)
    beads = np.array([[0.0, 500.0, 100.0], [50.0, 500.0, 0.0], [100.0, 400.0, 0.0]])
    filaments = Filaments(VISCOSITY, TEMPERATURE, engine=engine)
    shape = [1.0, 1.0, 0.0] if planar else 1.0
    for seed, (segments, clamped) in enumerate([(12, ()), (1, ()), (5, (2,)), (6, (0, 1)), (3, (-1,))]):
        filaments.add_nodes(F_ACTIN, bent_chain(F_ACTIN, segments, seed) * shape, clamped=clamped, planar=planar)
    positions = filaments.add_to(topology, system, beads * unit.nanometer)
    pull = openmm.CustomExternalForce("-(fx*x+fy*y+fz*z)")
    for name in ("fx", "fy", "fz"):
        pull.addPerParticleParameter(name)
    generator = np.random.default_rng(3)
    for particle in range(system.getNumParticles()):
        pull.addParticle(particle, generator.normal(size=3))
    system.addForce(pull)
    return filaments, system, positions


def _dense_velocities(filament, nodes, forces, flow):
    """v of the mobile degrees of freedom from Z (v - u) = f, with v = 0 for the others."""
    resistance = dense_resistance(nodes, filament.type.segment_friction(VISCOSITY, TEMPERATURE), filament.closed)
    solvent = _velocity(flow, nodes)
    free = np.ones(nodes.shape, dtype=bool)
    free[list(filament.clamped)] = False
    if filament.planar:
        solvent[:, 2] = 0.0
        free[:, 2] = False
    free = free.reshape(-1)
    right = forces.reshape(-1) + resistance @ solvent.reshape(-1)
    velocities = np.zeros(nodes.size)
    velocities[free] = np.linalg.solve(resistance[np.ix_(free, free)], right[free])
    return velocities.reshape(-1, 3)


@pytest.mark.parametrize("planar", [False, True])
@pytest.mark.parametrize("scheme", ["euler", "midpoint"])
@pytest.mark.parametrize("name", FLOWS)
@pytest.mark.parametrize("engine", ENGINES)
def test_a_step_equals_the_dense_solution(engine, name, scheme, planar):
    flow = FLOWS[name]
    filaments, system, positions = _chains_and_particles(engine, planar)
    step = 2e4
    integrator = filaments.create_integrator(
        system, step, scheme=scheme, temperature=0, particle_friction=[1e5, 1, 3e5], flow=flow
    )
    context = new_context(system, positions, integrator)
    start = positions_of(context)
    forces = forces_of(context)
    integrator.step(1)
    moved = positions_of(context) - start
    for filament, indices in zip(filaments, filaments.node_indices):
        nodes, force = start[indices], forces[indices]
        if scheme == "midpoint":
            nodes = nodes + 0.5 * step * _dense_velocities(filament, nodes, force, flow)
        expected = step * _dense_velocities(filament, nodes, force, flow)
        assert np.abs(moved[indices] - expected).max() < 1e-10 * np.abs(expected).max()
        resting = step * _dense_velocities(filament, start[indices], force, Flow())
        assert np.abs(expected - resting).max() > 1e-4 * np.abs(expected).max()
        assert np.all(moved[indices][list(filament.clamped)] == 0)
        assert not planar or np.all(moved[indices, 2] == 0)
    for bead, friction in ((0, 1e5), (2, 3e5)):
        halfway = start[[bead]] + 0.5 * step * _velocity(flow, start[[bead]])
        expected = step * (_velocity(flow, halfway)[0] + forces[bead] / friction)
        assert moved[bead] == pytest.approx(expected, rel=1e-10)
    assert np.all(moved[1] == 0)


@pytest.mark.sample("compiled|shear")
@pytest.mark.parametrize("name", ["shear", "extension"])
@pytest.mark.parametrize("engine", ENGINES)
def test_chains_follow_the_equation_of_motion(engine, name):
    """A long run against dx/dt = u + Z^-1 f, integrated with a dense Z and forces by differences of the energy."""
    flow = FLOWS[name]
    kind = replace(F_ACTIN, stretching_stiffness=0.1, extension_relaxation_time=None, bending_rigidity=2e4)
    kind = replace(kind, extensional_friction=4 * kind.segment_friction(VISCOSITY, 0).rotational)
    shape = bent_chain(kind, 4, 5)
    filament = Filament(kind, shape, ())

    def slope(_, flat):
        nodes = flat.reshape(-1, 3)
        forces = np.empty(flat.size)
        for index in range(flat.size):
            shift = np.zeros(flat.size)
            shift[index] = 1e-3
            high, low = (sum(filament.energies((flat + sign * shift).reshape(-1, 3))) for sign in (1, -1))
            forces[index] = (low - high) / 2e-3
        return _dense_velocities(filament, nodes, forces.reshape(-1, 3), flow).reshape(-1)

    filaments = Filaments(VISCOSITY, 0, engine=engine)
    filaments.add_nodes(kind, shape)
    _, system, positions = filaments.build()
    step, steps = 2e6, 500
    # Without noise, the fastest modes are quiet, and need not be resolved.
    integrator = filaments.create_integrator(system, step, scheme="midpoint", flow=flow, checks=False)
    context = new_context(system, positions, integrator)
    integrator.step(steps)
    exact = solve_ivp(slope, (0, steps * step), shape.reshape(-1), method="LSODA", rtol=1e-7, atol=1e-4).y[:, -1]
    moved = np.abs(exact - shape.reshape(-1)).max()
    assert moved > 100
    assert np.abs(positions_of(context).reshape(-1) - exact).max() < 2e-3 * moved


@pytest.mark.parametrize("engine", ENGINES)
def test_joint_tensions_are_those_in_the_flow(engine):
    """A linear flow changes none of free chains, which it carries along; clamped chains have to hold against it."""
    filaments, system, positions = _chains_and_particles(engine)
    integrator = filaments.create_integrator(system, 1.0, particle_friction=1e5, flow=GENERAL)
    context = new_context(system, positions, integrator)
    here = filaments.in_context(context)
    start = positions_of(context)
    forces = forces_of(context)
    tensions = here.joint_tensions()
    integrator.setFlow(None)
    resting = here.joint_tensions()
    friction = F_ACTIN.segment_friction(VISCOSITY, TEMPERATURE)
    for number, indices in enumerate(filaments.node_indices):
        filament, nodes, force = filaments[number], start[indices], forces[indices]
        minus, plus = segment_end_forces(filament, nodes)
        external = force.copy()
        external[:-1] -= minus
        external[1:] -= plus
        external[1:-1] /= 2
        minus, plus = minus + external[:-1], plus + external[1:]
        if not filament.clamped:
            _, phi = virtual_forces(nodes, friction, minus, plus)
            scale = np.abs(phi).max(initial=1.0)
            assert np.abs(tensions[number]._value - phi).max(initial=0) < 1e-9 * scale
            assert np.abs(resting[number]._value - phi).max(initial=0) < 1e-9 * scale
            continue
        # The forces on a segment and at its two joints hold against its drag.
        relative = _dense_velocities(filament, nodes, force, GENERAL) - _velocity(GENERAL, nodes)
        phi = tensions[number]._value
        for segment in range(1, filament.segments - 1):
            drag = dense_resistance(nodes[segment : segment + 2], friction) @ relative[segment : segment + 2].reshape(
                -1
            )
            applied = np.concatenate([minus[segment] - phi[segment - 1], plus[segment] + phi[segment]])
            if not {segment, segment + 1} & set(filament.clamped):
                assert np.abs(applied - drag).max() < 1e-9 * np.abs(phi).max()
        assert np.abs(phi - resting[number]._value).max() > 1e-3 * np.abs(phi).max()


# Noise and the life of an integrator


@pytest.mark.parametrize("engine", ENGINES)
def test_noise_is_that_of_a_resting_solvent(engine):
    """In a uniform flow, a trajectory is the one at rest, carried along."""
    ends = []
    velocity = np.array([3e-5, -1e-5, 2e-5])
    for flow in (None, Flow.uniform(velocity)):
        filaments = Filaments(VISCOSITY, TEMPERATURE, engine=engine)
        filaments.add_equilibrium(F_ACTIN, 6, seed=1)
        _, system, positions = filaments.build()
        integrator = filaments.create_integrator(system, 5e3, random_seed=3, flow=flow)
        context = new_context(system, positions, integrator)
        integrator.step(50)
        ends.append(positions_of(context))
    carried = 50 * 5e3 * velocity
    assert np.abs(ends[1] - ends[0] - carried).max() < 1e-6 * np.abs(carried).max()
    assert np.abs(ends[0] - positions._value).max() > 1.0


@pytest.mark.parametrize(("engine", "platform"), ENGINE_PLATFORMS)
def test_flow_can_change_and_survives_restarts(engine, platform):
    filaments, system, positions = _chains_and_particles(engine)
    options = {"particle_friction": 1e5, "random_seed": 4}
    integrator = filaments.create_integrator(system, 5e3, flow=GENERAL, **options)
    assert integrator.getFlow() == GENERAL
    context = new_context(system, positions, integrator, platform)
    integrator.step(5)
    checkpoint = context.createCheckpoint()
    integrator.step(5)
    unbroken = positions_of(context)
    other = filaments.create_integrator(system, 5e3, **options)
    assert other.getFlow() == Flow()
    restarted = new_context(system, positions, other, platform)
    restarted.loadCheckpoint(checkpoint)
    assert other.getFlow() == GENERAL
    other.step(5)
    assert np.array_equal(positions_of(restarted), unbroken)

    context.loadCheckpoint(checkpoint)
    integrator.setFlow(None)
    assert integrator.getFlow().is_at_rest
    integrator.step(5)
    at_rest = positions_of(context)
    assert np.abs(at_rest - unbroken).max() > 1e-3
    context.loadCheckpoint(checkpoint)
    integrator.setFlow(Flow())
    integrator.step(5)
    assert np.array_equal(positions_of(context), at_rest)
    integrator.setFlow(FLOWS["shear"])
    assert integrator.getFlow() == FLOWS["shear"]


@pytest.mark.parametrize("engine", ENGINES)
def test_copied_integrator_keeps_the_flow(engine):
    filaments, system, positions = _chains_and_particles(engine)
    integrator = filaments.create_integrator(system, 5e3, particle_friction=1e5, random_seed=4, flow=GENERAL)
    ends = []
    for one in (copy.deepcopy(integrator), integrator):
        context = new_context(system, positions, one)
        one.step(3)
        ends.append(positions_of(context))
    assert np.array_equal(*ends)


@pytest.mark.parametrize("fraction", [1.0, 0.1])
def test_noise_does_not_turn_stiff_filaments_faster_in_long_steps(fraction):
    """Forty filaments of 6 um turn over in a shear at the recommended step: cot(phi) of a rod grows with the strain."""
    kind, start, strain = F_ACTIN.with_segment_length(500), np.radians(100), 0.8
    rate = 8 / unit.second
    filaments = Filaments(1e-3 * unit.pascal * unit.second, TEMPERATURE, engine="compiled")
    for number in range(40):
        filaments.add_straight(kind, 12, [0, 1e5 * number, 0], [np.cos(start), 0, np.sin(start)])
    _, system, positions = filaments.build()
    step = fraction * filaments.recommended_time_step("implicit").step
    steps = round((strain / rate).value_in_unit(unit.picosecond) / step)
    integrator = filaments.create_integrator(
        system, strain / rate / steps, scheme="implicit", random_seed=2, flow=Flow.shear(rate)
    )
    context = new_context(system, positions, integrator, "CPU")
    integrator.step(steps)
    ends = np.array([positions_of(context)[[nodes[0], nodes[-1]]] for nodes in filaments.node_indices])
    angles = np.arctan2(*np.diff(ends, axis=1)[:, 0, [2, 0]].T)
    expected = np.arctan2(1.0, 1.0 / np.tan(start) + strain)
    error = angles.std() / np.sqrt(len(angles))
    assert error < np.radians(2)
    assert abs(angles.mean() - expected) < 4 * error
    assert integrator.getNumDividedSteps() == 0
