"""Links in the equations of implicit steps: forces, relaxation, bits, restarts, periodic boxes, and what goes wrong."""

import itertools
import re

import numpy as np
import openmm
import pytest

from openmm_cylchain import Crosslinks, Filaments, Flow, InstabilityError, capsule_contact_force
from support.contexts import energy_of, new_context, positions_of
from support.linked_networks import ACTIN, MICROSECOND, LinkPotential, Network, Simulation
from support.linked_pairs import PICONEWTON_PER_NANOMETER
from support.solvent import KT, TEMPERATURE, VISCOSITY

SCHEMES = ("implicit", "implicit-second-order")
BOX = 1500.0
FORMS = {
    "zero": LinkPotential(0.25),
    "rest": LinkPotential(0.25, 35.0),
    "stiff": LinkPotential(2.0, 35.0),
    "fene": LinkPotential(0.25, 35.0, 1000.0),
}


def mixed_network(potential, scheme, step, periodic=False, temperature=None, flow=None, threads=1, moved=None, seed=3,
                  precision="automatic", platform="CPU"):  # fmt: skip
    """Filaments that are free, in a ring, planar, clamped and propelled, linked at all kinds of places.

    Links of two forces: between filaments, of a place with several, at nodes and ends, within one filament, along the
    same segment, to a point and to a particle.
    """
    filaments = Filaments(VISCOSITY, TEMPERATURE)
    generator = np.random.default_rng(seed)
    for number in range(4):
        filaments.add_equilibrium(ACTIN, 6, seed=number + 1, start=generator.uniform(0, 200, 3))
    filaments.add_ring(ACTIN, 9, [100, 100, 100], [0, 0, 1])
    filaments.add_straight(ACTIN, 5, [0, 50, 80], [1, 1, 0], clamped=[0, 1])
    filaments.add_straight(ACTIN, 4, [30, 0, 0], [1, 0, 0], propulsion=1e-4)
    planar = Filaments(VISCOSITY, TEMPERATURE)
    planar.add_equilibrium(ACTIN, 5, seed=11, planar=True)
    filaments.add_nodes(ACTIN, planar[0].positions, planar=True)
    topology, system = openmm.app.Topology(), openmm.System()
    topology.addAtom("P", None, topology.addResidue("PRT", topology.addChain()))
    system.addParticle(1.0)
    if periodic:
        system.setDefaultPeriodicBoxVectors(*(BOX * np.eye(3)))
    positions = filaments.add_to(topology, system, [[120.0, 60.0, 40.0]])
    links = [potential.crosslinks(), potential.crosslinks()]

    def at(filament, segment, fraction):
        return filaments.segment_place(filament, segment=segment, fraction=fraction)

    pairs = [(at(i, 2, 0.3), at((i + 1) % 7, 1, 0.5)) for i in range(7)]
    pairs += [(at(0, 2, 0.3), at(i, 3, 1.0)) for i in range(1, 4)]
    pairs += [(at(0, 0, 0.0), at(1, 5, 1.0)), (at(2, 1, 0.2), at(2, 4, 0.9)), (at(3, 1, 0.1), at(3, 1, 0.8))]
    pairs += [(0, at(1, 0, 0.4)), (at(2, 0, 0.0), [50.0, 60.0, 70.0]), (at(5, 0, 0.0), at(4, 0, 0.6))]
    for number, pair in enumerate(pairs):
        links[number % 2].add(None, *pair)
    for one in links:
        one.add_to(system, periodic=periodic)
    integrator = filaments.create_integrator(
        system, step, scheme=scheme, temperature=temperature, particle_friction=5e5, random_seed=seed, checks=False,
        flow=flow, precision=precision,
    )  # fmt: skip
    positions = np.array(positions._value)
    if moved is not None:
        for number, nodes in enumerate(filaments.node_indices):
            positions[nodes] += moved[number]
    properties = {"Threads": str(threads)} if platform == "CPU" else None
    return filaments, system, links, new_context(system, positions, integrator, platform, properties)


def advance(context, steps):
    context.getIntegrator().step(steps)
    return positions_of(context)


@pytest.mark.parametrize("scheme", SCHEMES)
@pytest.mark.parametrize("form", FORMS)
def test_without_noise_steps_converge_to_explicit_ones_with_second_order(form, scheme):
    potential, time = FORMS[form], 4e3
    ends = {}
    for own, steps in (("midpoint", 3200), (scheme, 4), (scheme, 8), (scheme, 16)):
        *_, context = mixed_network(potential, own, time / steps, temperature=0.0)
        start = positions_of(context)
        ends[steps] = advance(context, steps)
    moved = np.abs(ends[3200] - start).max()
    errors = [np.abs(ends[steps] - ends[3200]).max() for steps in (4, 8, 16)]
    assert moved > 0.1
    # With the tolerance of Newton's method, 1 % of a segment, and of explicit steps.
    assert errors[2] < 2e-3 * moved, (moved, errors)
    assert errors[2] < errors[0] / 3 or errors[0] < 1e-3 * moved, (moved, errors)


@pytest.mark.parametrize("scheme", SCHEMES)
@pytest.mark.parametrize("form", FORMS)
@pytest.mark.parametrize("step", [0.1])
def test_without_noise_a_link_relaxes_as_it_should(step, form, scheme):
    """Two straight filaments side by side, pulled together: as in explicit steps."""
    potential = FORMS[form]
    nodes = np.zeros((1, 2, 7, 3))
    nodes[..., 0] = 100 * np.arange(7)
    nodes[0, 1, :, 1] = 80.0
    network = Network((((0, 3, 0.0), (1, 3, 0.0)),), 2)
    lengths = []
    for own, h in ((scheme, step), ("midpoint", 0.0005)):
        simulation = Simulation(network, potential, nodes, np.zeros((1, 0, 3)), own, h * MICROSECOND, temperature=0.0)
        length = [80.0]
        for _ in range(5):
            simulation.integrator.step(round(max(step, 1) / h))
            length.append(simulation.crosslinks[0].lengths(simulation.context)[0])
        lengths.append(np.array(length))
        assert simulation.integrator.getNumDividedSteps() == 0
    ours, explicit = lengths
    distances = np.abs(ours - potential.rest_length)
    assert np.all(np.diff(distances) < 0.02 * distances[0]), ours
    # Lags of ten steps.
    assert explicit[0] - explicit[-1] > 1
    assert ours[1:] == pytest.approx(explicit[1:], abs=0.02 * (explicit[0] - explicit[-1])), (ours, explicit)


@pytest.mark.parametrize("scheme", SCHEMES)
@pytest.mark.parametrize("form", FORMS)
@pytest.mark.parametrize("step", [0.1, 5])
def test_without_noise_energy_falls(step, form, scheme):
    filaments, _, links, context = mixed_network(FORMS[form], scheme, step * MICROSECOND, temperature=0.0)
    energies = [energy_of(context)]
    for _ in range(60):
        advance(context, 1)
        energies.append(energy_of(context))
    assert np.isfinite(energies).all()
    # Propulsion puts in some.
    assert np.all(np.diff(energies) < 1e-3 * energies[0]), energies
    assert energies[-1] < 0.7 * energies[0]


@pytest.mark.parametrize("scheme", SCHEMES)
@pytest.mark.parametrize("form", FORMS)
def test_threads_platforms_contexts_and_calls_change_no_bit(form, scheme):
    ends, kinds = [], [(1, "CPU", None), (2, "CPU", None), (3, "CPU", None), (1, "Reference", None)]
    for threads, platform, _ in kinds:
        *_, context = mixed_network(FORMS[form], scheme, MICROSECOND, threads=threads, platform=platform)
        ends.append(advance(context, 20))
    _, system, _, context = mixed_network(FORMS[form], scheme, MICROSECOND)
    start = positions_of(context)
    duplicate = openmm.XmlSerializer.clone(system)
    others = [
        new_context(own, start, openmm.XmlSerializer.clone(context.getIntegrator()), "CPU", {"Threads": "1"})
        for own in (system, duplicate)
    ]
    for _ in range(20):
        for other in others:
            advance(other, 1)
    ends += [positions_of(other) for other in others]
    for end in ends[1:]:
        assert np.array_equal(ends[0], end)
    assert np.abs(ends[0] - start).max() > 1


@pytest.mark.parametrize("scheme", SCHEMES)
@pytest.mark.parametrize("form", FORMS)
def test_restarts_go_on_to_the_bit(form, scheme):
    filaments, system, links, context = mixed_network(FORMS[form], scheme, MICROSECOND)
    advance(context, 5)
    links[0].add(context, 5, filaments.segment_place(3, segment=2, fraction=0.3))
    links[1].set_active(context, 1, False)
    links[0].remove(context, 2)
    advance(context, 5)
    checkpoint = context.createCheckpoint()
    state = openmm.XmlSerializer.serialize(
        context.getState(positions=True, velocities=True, parameters=True, integratorParameters=True)
    )
    end = advance(context, 10)
    for kind in (0, 1):
        *_, other_links, other = mixed_network(FORMS[form], scheme, MICROSECOND)
        if kind == 0:
            other.loadCheckpoint(checkpoint)
        else:
            other.setState(openmm.XmlSerializer.deserialize(state))
        assert np.array_equal(advance(other, 10), end)
        for one, same in zip(links, other_links):
            assert one.table(context) == same.table(other)


def change_of_last_iteration(potential):
    """A tenth of the thermal fluctuation of a link that turns, with which its iteration ends; others end at once."""
    return 0.1 * np.sqrt(KT / (potential.stiffness * PICONEWTON_PER_NANOMETER)) if potential.rest_length else 1e-4


@pytest.mark.parametrize("precision", ["double", "mixed"])
@pytest.mark.parametrize("scheme", SCHEMES)
@pytest.mark.parametrize("form", FORMS)
def test_periodic_images_are_the_same(form, scheme, precision):
    generator, ends = np.random.default_rng(8), []
    shifts = BOX * generator.integers(-2, 3, (8, 1, 3))
    shifts[7, :, 2] = 0
    for moved in (None, shifts):
        filaments, _, _, context = mixed_network(
            FORMS[form], scheme, 0.02 * MICROSECOND, periodic=True, moved=moved, precision=precision
        )
        # Links of hundreds of nm that are far too long go to and fro in long steps. Each of these makes a thousand
        # times as much of rounding, and of what an iteration more or less has changed: there is one of them.
        advance(context, 100)
        context.getIntegrator().setStepSize(MICROSECOND)
        end = advance(context, 1)
        for number, nodes in enumerate(filaments.node_indices):
            end[nodes] -= 0 if moved is None else moved[number]
        ends.append(end)
    # Rounding may take an iteration more or less.
    assert ends[1] == pytest.approx(ends[0], abs=max(1e-4, 0.2 * change_of_last_iteration(FORMS[form])))


@pytest.mark.parametrize("scheme", SCHEMES)
@pytest.mark.parametrize("form", FORMS)
def test_mixed_precision_and_flow(form, scheme):
    ends = []
    for precision in ("double", "mixed"):
        *_, context = mixed_network(FORMS[form], scheme, MICROSECOND, precision=precision)
        start = positions_of(context)
        ends.append(advance(context, 1))
    rounding = 2e-3 * np.abs(ends[0] - start).max()
    assert ends[1] == pytest.approx(ends[0], abs=rounding + change_of_last_iteration(FORMS[form]))
    still = [mixed_network(FORMS[form], scheme, 1e4, temperature=0.0, flow=flow)[3]
             for flow in (None, Flow(velocity=[1e-3, 0, 0]))]  # fmt: skip
    ends = [advance(context, 1) for context in still]
    particle = ends[1][0] - ends[0][0]
    assert particle[0] == pytest.approx(10.0, rel=0.2)


@pytest.mark.parametrize("scheme", SCHEMES)
def test_links_that_are_off_are_not_there(scheme):
    ends = []
    for kind in ("off", "removed"):
        filaments, _, links, context = mixed_network(FORMS["rest"], scheme, MICROSECOND)
        advance(context, 3)
        links[0].set_active(context, 1, False) if kind == "off" else links[0].remove(context, 1)
        ends.append(advance(context, 10))
    assert np.array_equal(*ends)


def pair(potential, distance, scheme, step, copies=1, temperature=None, links=1, seed=2, apart=0.0):
    network = Network((((0, 3, 0.0), (1, 3, 0.0)),) * links, 2)
    nodes, particles = network.draw(potential, copies, np.random.default_rng(seed))
    nodes -= nodes[:, :, 3:4]
    nodes[:, 1, :, 0] += distance
    nodes[:, :, :, 1] += apart * np.arange(copies)[:, None, None]
    return Simulation(network, potential, nodes, particles, scheme, step * MICROSECOND, temperature=temperature)


@pytest.mark.parametrize("scheme", SCHEMES)
@pytest.mark.parametrize("rest_length", [0.0, 5.0, 35.0])
def test_ends_that_coincide_come_apart(rest_length, scheme):
    simulation = pair(LinkPotential(0.25, rest_length), 0.0, scheme, 1)
    simulation.integrator.step(200)
    assert abs(simulation.crosslinks[0].lengths(simulation.context)[0] - rest_length) < 20


@pytest.mark.parametrize("scheme", SCHEMES)
@pytest.mark.parametrize(
    "rest_length, stiffness",
    [
        *((rest_length, stiffness) for rest_length in (0.0, 35.0) for stiffness in (1e-9, 1e4)),
        (0.0, 1e6),
        (35.0, 1e6),
    ],
)
def test_any_stiffness(rest_length, stiffness, scheme):
    simulation = pair(LinkPotential(stiffness, rest_length), rest_length, scheme, 1, 20)
    energies = simulation.measure(200, 1)["links"]
    assert np.isfinite(energies).all()
    if stiffness > 1:
        exact = 0.5 if rest_length else 1.5
        assert energies.mean() == pytest.approx(exact, rel=0.15)


def test_stiff_links_beside_contacts():
    # Where there are contacts, filaments that have converged rest. Ends of links as stiff as these must not move alone:
    # their energies were 5 % too large.
    copies, samples = 40, 800
    simulation = pair(LinkPotential(1e5, 35.0), 35.0, "implicit", 1, copies, apart=3000.0)
    contacts = capsule_contact_force(simulation.filaments, simulation.system, 8.0, 5.0)
    segments = range(simulation.network.segments)
    for copy, first, second in itertools.product(range(copies), segments, segments):
        contacts.addExclusion(2 * copy, first, 2 * copy + 1, second)
    simulation.system.addForce(contacts)
    simulation.context.reinitialize(preserveState=True)
    simulation.integrator.step(100)
    energies = simulation.measure(samples, 1)["links"]
    # Drawn afresh in each step, but for what the relaxation of filaments leaves of one in the next.
    assert energies.mean() == pytest.approx(0.5, abs=4 * np.sqrt(0.5 / (copies * samples)))


@pytest.mark.parametrize("scheme", SCHEMES)
def test_thousands_of_links_on_one_place_are_one_stiff_link(scheme):
    simulation = pair(LinkPotential(0.25), 30.0, scheme, 1, links=3000)
    simulation.integrator.step(30)
    # The relaxation time of all of them is 10 ns.
    assert simulation.crosslinks[0].lengths(simulation.context)[0] < 1


@pytest.mark.parametrize("scheme", SCHEMES)
@pytest.mark.parametrize("temperature", [0.0, None])
@pytest.mark.parametrize(
    "potential", [LinkPotential(0.25, 35.0), LinkPotential(10.0), LinkPotential(100.0, 35.0)], ids=str
)
def test_links_that_are_stretched_by_micrometers(potential, temperature, scheme):
    """Up to 300 nN: either the link shortens, or there is an error."""
    simulation = pair(potential, 3000.0, scheme, 1, temperature=temperature)
    try:
        simulation.integrator.step(5)
    except InstabilityError:
        pass
    else:
        assert simulation.crosslinks[0].lengths(simulation.context)[0] < 3000


@pytest.mark.parametrize("scheme", SCHEMES)
@pytest.mark.parametrize("seed", [1, 2, 3])
def test_stiff_short_links_in_loops_hold_or_say_so(seed, scheme):
    """Five of 100 pN/nm a filament between random places, also of one segment: some are pulled by nN at first."""
    generator, count, segments = np.random.default_rng(seed), 6, 4
    places = [(int(f), int(s), float(u)) for f, s, u in zip(
        generator.integers(count, size=5 * count), generator.integers(segments, size=5 * count),
        generator.uniform(size=5 * count))]  # fmt: skip
    places += [(0, 1, 0.1), (0, 1, 0.8)]
    network = Network(tuple(zip(places[::2], places[1::2])), count, segments)
    potential = LinkPotential(100.0, 35.0)
    nodes = np.zeros((1, count, segments + 1, 3))
    nodes[..., 0] = 100 * np.arange(segments + 1)
    nodes[0, ..., 1:] += generator.uniform(0, 60, (count, 1, 2))
    simulation = Simulation(network, potential, nodes, np.zeros((1, 0, 3)), scheme, 5 * MICROSECOND, seed=seed)
    start, before = simulation.crosslinks[0].lengths(simulation.context), energy_of(simulation.context)
    integrator = simulation.integrator
    try:
        for step in (1e-3, 1e-2, 0.1, 1.0, 5.0):
            integrator.setStepSize(step * MICROSECOND)
            integrator.step(20)
    except InstabilityError as error:
        assert re.search("[Cc]rosslink|[Ff]ilament", str(error)), str(error)
        # The positions are those before the step that could not be taken.
        assert np.abs(simulation.crosslinks[0].lengths(simulation.context)).max() < 1.1 * np.abs(start).max()
    else:
        assert energy_of(simulation.context) < 0.5 * before
    assert np.isfinite(positions_of(simulation.context)).all()


@pytest.mark.parametrize("scheme", SCHEMES)
@pytest.mark.parametrize("distance", [14.9, 55.1, 80.0])
def test_fene_links_out_of_their_range_are_refused(distance, scheme):
    simulation = pair(LinkPotential(0.25, 35.0, 20.0), distance, scheme, 1)
    with pytest.raises(InstabilityError, match="rosslink|Link 0"):
        simulation.integrator.step(1)


@pytest.mark.parametrize("scheme", SCHEMES)
@pytest.mark.parametrize("distance", [15.001, 54.999])
def test_fene_links_near_their_limit_come_back(distance, scheme):
    simulation = pair(LinkPotential(0.25, 35.0, 20.0), distance, scheme, 1, 20)
    try:
        simulation.integrator.step(50)
    except InstabilityError as error:
        # 50 nN may be too much.
        assert "rosslink" in str(error), str(error)
    assert np.abs(simulation.crosslinks[0].extensions(simulation.context)).max() < 20


@pytest.mark.parametrize("scheme", SCHEMES)
@pytest.mark.parametrize("value", [np.nan, np.inf])
def test_positions_that_are_not_finite(value, scheme):
    simulation = pair(LinkPotential(0.25, 35.0), 35.0, scheme, 1)
    positions = positions_of(simulation.context)
    positions[simulation.filaments.node_indices[1][4], 0] = value
    simulation.context.setPositions(positions)
    with pytest.raises(
        (InstabilityError, openmm.OpenMMException), match="not finite|coordinate is NaN|cannot be solved"
    ):
        simulation.integrator.step(1)


@pytest.mark.parametrize("scheme", SCHEMES)
@pytest.mark.parametrize("form", ["zero", "rest", "stiff"])
def test_a_hundred_times_too_long_steps_are_right_or_counted(form, scheme):
    potential = FORMS[form]
    simulation = pair(potential, potential.rest_length, scheme, 100, 100)
    simulation.integrator.step(10)
    energies = simulation.measure(30, 1)["links"]
    divided = simulation.integrator.getNumDividedSteps() / (200 * 40)
    exact = potential.mean(potential.energy)
    assert divided > 1e-3 or energies.mean() == pytest.approx(exact, rel=0.05), (divided, energies.mean(), exact)


@pytest.mark.parametrize("scheme", SCHEMES)
@pytest.mark.parametrize("stiffness", [0.25, 100.0])
@pytest.mark.parametrize("offset", [0.0, 1e3, 1e5])
def test_links_come_to_rest_without_noise(offset, stiffness, scheme):
    """Wherever they are: when nothing but rounding moves them, a step has converged."""
    filaments = Filaments(VISCOSITY, TEMPERATURE)
    filaments.add_straight(ACTIN, 4, [offset, offset, offset], [1, 0, 0])
    filaments.add_straight(ACTIN, 4, [offset, offset + 1, offset], [0, 1, 0])
    _, system, positions = filaments.build()
    links = Crosslinks(stiffness * PICONEWTON_PER_NANOMETER, 0.0)
    links.add(None, filaments.segment_place(0, segment=1, fraction=0.3), filaments.segment_place(1, segment=0))
    links.add_to(system)
    integrator = filaments.create_integrator(system, MICROSECOND, scheme=scheme, random_seed=1, checks=False)
    context = new_context(system, positions, integrator, "CPU", {"Threads": "1"})
    integrator.setTemperature(0.0)
    integrator.step(500)
    # Of thermal fluctuations, it is a thousandth.
    assert links.lengths(context)[0] < 1e-4
    assert integrator.getNumDividedSteps() == 0


def test_links_of_no_stiffness_and_no_links_do_nothing():
    filaments = Filaments(VISCOSITY, TEMPERATURE)
    filaments.add_equilibrium(ACTIN, 5, seed=1)
    filaments.add_equilibrium(ACTIN, 5, seed=2)
    _, system, positions = filaments.build()
    ends = []
    for stiffness in (None, 0.25):
        own = openmm.XmlSerializer.clone(system)
        if stiffness is not None:
            links = Crosslinks(stiffness * PICONEWTON_PER_NANOMETER, 0.0)
            links.add(None, 0, 7)
            links.set_active(None, 0, False)
            links.add_to(own)
        integrator = filaments.create_integrator(own, MICROSECOND, random_seed=4, checks=False)
        ends.append(advance(new_context(own, positions, integrator), 20))
    assert ends[1] == pytest.approx(ends[0], abs=1e-9)
