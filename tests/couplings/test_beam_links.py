"""Links at places on the curves of beam elements: energies, forces, equilibrium, balance of momentum, and States."""

import numpy as np
import openmm
import pytest
from openmm import unit
from scipy.spatial.transform import Rotation

from openmm_cylchain import Crosslinks, Filaments, InputError, InstabilityError, SegmentPlace
from openmm_cylchain.beams.curve import element_energies, element_points
from openmm_cylchain.beams.equilibrium import draw_beam
from openmm_cylchain.engines.compiled import CylinderChainForce, CylinderChainIntegrator, plugin
from support.contexts import energy_of, forces_of, new_context, positions_of, slopes_of
from support.linked_beams import BEAM, STRAIGHT, linked_pairs, mean_energy
from support.solvent import KT, TEMPERATURE, VISCOSITY

SIGMAS = 4.0
LINKS = 7


def network(periodic=False, attached=False):
    """Two beams, one of them in a plane, a straight filament and a particle, with links of all kinds in a group."""
    filaments = Filaments(VISCOSITY, TEMPERATURE, engine="compiled")
    filaments.add_equilibrium(BEAM, 3, seed=1)
    filaments.add_equilibrium(BEAM, 2, seed=2, start=[100, 200, 0], planar=True)
    filaments.add_equilibrium(STRAIGHT, 4, seed=3, start=[0, -200, 50])
    places = [(0, 1, 0.3), (1, 0, 0.6), (2, 1, 0.25)]
    if attached:
        for filament, segment, fraction in places:
            filaments.add_attachment(filament, segment=segment, fraction=fraction)
    box = [[1500.0, 0, 0], [100.0, 1500.0, 0], [-60.0, 90.0, 1600.0]] * unit.nanometer
    _, system, positions = filaments.build(box if periodic else None)
    particle = system.addParticle(1.0)
    positions = np.concatenate([positions._value, [[300.0, 300.0, 300.0]]])
    if attached:
        ends = filaments.attachment_indices.tolist()
    else:
        ends = [filaments.segment_place(filament, segment=s, fraction=f) for filament, s, f in places]
    node = int(filaments.node_indices[0][-1])
    links = Crosslinks(0.02, 30.0)
    pairs = [(ends[0], ends[1]), (ends[0], ends[2]), (ends[1], particle), (ends[0], [5.0, 6.0, 700.0]), (node, ends[1])]
    links.add_many(None, pairs)
    links.add_to(system, LINKS, periodic)
    return filaments, system, positions, links


@pytest.mark.parametrize("periodic", [False, True])
@pytest.mark.parametrize("platform", ["Reference", "CPU"])
def test_forces_are_differences_of_the_energy(platform, periodic):
    filaments, system, positions, links = network(periodic)
    if periodic:
        # Each particle in the box by itself.
        positions[:, 2] %= 1600.0
        positions[::2, 0] += 1500.0
    integrator = openmm.VerletIntegrator(0.001)
    context = new_context(system, positions, integrator, platform)
    forces, groups = forces_of(context, 1 << LINKS), 1 << LINKS
    energy = energy_of(context, groups)
    assert energy == pytest.approx(0.01 * np.sum(links.extensions(context) ** 2), rel=1e-12)
    assert np.sum(forces, axis=0) == pytest.approx(-0.02 * pull_of_point(links, context, positions), abs=1e-9)
    slopes = slopes_of(context, positions, range(len(positions)), groups)
    assert forces == pytest.approx(-slopes, abs=1e-5)
    moved = {int(node) for own in (*filaments.node_indices, *filaments.control_point_indices) for node in own}
    assert np.any(forces[sorted(moved)])


def pull_of_point(links, context, positions):
    """The extension of the link to a fixed point, as a vector: what is not balanced."""
    lengths = links.lengths(context)
    first = links.table(context).places.positions(positions, 0, *boxes_of(links, context))[3]
    box = context.getState().getPeriodicBoxVectors(asNumpy=True)._value
    vector = first - [5.0, 6.0, 700.0]
    if context.getSystem().usesPeriodicBoundaryConditions():
        for row in (2, 1, 0):
            vector = vector - box[row] * np.rint(vector[row] / box[row, row])
    assert np.linalg.norm(vector) == pytest.approx(lengths[3])
    return vector * (1.0 - 30.0 / lengths[3])


def boxes_of(links, context):
    store = links._store_in(context)
    return store.boxes(context, context.getState())[1], store.curves(context)


def test_places_are_on_the_curve():
    filaments, system, positions, links = network()
    context = new_context(system, positions)
    nodes, controls = (positions[own[0]] for own in (filaments.node_indices, filaments.control_point_indices))
    on_curve = element_points(nodes, controls, [0.3])[1, 0]
    other = element_points(positions[filaments.node_indices[1]], positions[filaments.control_point_indices[1]], [0.6])[
        0, 0
    ]
    assert links.lengths(context)[0] == pytest.approx(np.linalg.norm(on_curve - other), rel=1e-12)
    chord = 0.7 * nodes[1] + 0.3 * nodes[2]
    assert np.linalg.norm(on_curve - chord) > 1.0
    # The same place, from the other end.
    first, second = (int(filaments.node_indices[0][node]) for node in (1, 2))
    number = links.add(context, SegmentPlace(second, first, 0.7), int(filaments.node_indices[1][0]))
    apart = np.linalg.norm(on_curve - positions[filaments.node_indices[1][0]])
    assert links.lengths(context)[number] == pytest.approx(apart, rel=1e-12)
    with pytest.raises(InputError, match="to itself"):
        links.add(context, SegmentPlace(second, first, 0.7), SegmentPlace(first, second, 0.3))
    control = int(filaments.control_point_indices[0][1])
    with pytest.raises(InputError, match=f"particle {control}, a control point of beam elements"):
        links.add(context, control, first)


def test_links_to_attachment_points_are_those_to_their_places():
    results = []
    for attached in (False, True):
        filaments, system, positions, links = network(attached=attached)
        # The noise of the particle belongs to its number, which is another one.
        integrator = filaments.create_integrator(system, 1e5, random_seed=4, temperature=0.0, particle_friction=100.0)
        context = new_context(system, positions, integrator)
        before = links.lengths(context)
        integrator.step(20)
        after = positions_of(context)
        results.append((before, links.lengths(context), after[filaments.node_indices[0]], after[-1]))
        assert np.abs(after - positions).max() > 1.0
        if attached:
            nodes, controls = (after[own[0]] for own in (filaments.node_indices, filaments.control_point_indices))
            place = after[filaments.attachment_indices[0]]
            assert place == pytest.approx(element_points(nodes, controls, [0.3])[1, 0], abs=1e-9)
    for one, other in zip(*results):
        assert one == pytest.approx(other, rel=1e-6)


PAIRS = {
    "two beams": (((BEAM, 3), (BEAM, 3)), ((1, 0.3), (2, 0.8))),
    "two ends": (((BEAM, 1), (BEAM, 1)), ((0, 1.0), (0, 0.0))),
    "a beam and a straight filament": (((BEAM, 2), (STRAIGHT, 6)), ((1, 0.5), (2, 0.4))),
}
BENDS = 1.93
"""Of an element of a quarter of a persistence length in space, in k_B T: see the tests of chains without links."""


@pytest.mark.sample(r"two ends-0|1\.0-60\.0|straight filament-0")
@pytest.mark.parametrize(("stiffness", "rest_length"), [(0.01, 0.0), (100.0, 0.0), (1.0, 60.0)])
@pytest.mark.parametrize(
    "pair", [pytest.param(pair, marks=[] if pair == "two ends" else pytest.mark.slow) for pair in PAIRS]
)
def test_links_and_bends_keep_their_energies_at_the_recommended_step(pair, stiffness, rest_length):
    """Exactly 3/2 k_B T in a link without a rest length; bends and strains are those of chains without links."""
    kinds, places = PAIRS[pair]
    filaments, system, positions, links = linked_pairs(kinds, places, stiffness, 300, rest_length=rest_length)
    step = filaments.recommended_time_step(system=system)
    integrator = filaments.create_integrator(system, step, random_seed=2)
    context = new_context(system, positions, integrator, "CPU")
    integrator.step(50)
    energies, bends, strains = [], [], []
    beams = [number for number, own in enumerate(filaments) if own.control_points is not None]
    for _ in range(80):
        integrator.step(4)
        now = positions_of(context)
        energies.append(0.5 * stiffness * links.extensions(context) ** 2 / KT)
        indices = filaments.node_indices, filaments.control_point_indices
        nodes, controls = (now[np.array([own[number] for number in beams])] for own in indices)
        stretching, bending = element_energies(nodes, controls, filaments[0].beam_element(TEMPERATURE))
        bends.append(bending.mean(axis=1) / KT)
        strains.append(stretching.sum(axis=1) / KT)
    divided = integrator.getNumDividedSteps() / (len(filaments) * 370)
    assert divided < 5e-3
    elements = kinds[0][1]
    for values, expected, allowed, power in (
        (energies, mean_energy(stiffness, rest_length), 0.005, 0.012),
        (bends, BENDS, 0.01 * BENDS, 0.012),
        (strains, 0.5 * (2 * elements + 1), 0.01 * elements, 0.01),
    ):
        mean = np.mean(values, axis=0)
        error = np.std(mean, ddof=1) / np.sqrt(len(mean))
        assert error < power * expected
        assert abs(np.mean(mean) - expected) < SIGMAS * error + allowed


@pytest.mark.sample(r"beams-10(00)?\.0|segments-100\.")
@pytest.mark.parametrize("stiffness", [pytest.param(10.0, marks=pytest.mark.slow), 100.0, 1000.0])
@pytest.mark.parametrize("kind", [(BEAM, 1), (STRAIGHT, 4)], ids=["beams", "segments"])
def test_a_link_between_two_ends_leaves_their_angle_free(kind, stiffness):
    """Its cosine is 0 on average, as that of a free joint, which a step that is solved badly straightens."""
    filaments, system, positions, _ = linked_pairs((kind, kind), ((kind[1] - 1, 1.0), (0, 0.0)), stiffness, 300)
    step = filaments.recommended_time_step(system=system)
    integrator = filaments.create_integrator(system, step, random_seed=2)
    context = new_context(system, positions, integrator, "CPU")
    integrator.step(150)
    cosines = []
    for _ in range(10):
        integrator.step(5)
        now = positions_of(context)
        chords = np.array([now[nodes[-1]] - now[nodes[0]] for nodes in filaments.node_indices])
        chords /= np.linalg.norm(chords, axis=1)[:, None]
        cosines.append(np.sum(chords[::2] * chords[1::2], axis=1))
    mean = np.mean(cosines, axis=0)
    error = np.std(mean, ddof=1) / np.sqrt(len(mean))
    assert error < 0.04
    assert abs(np.mean(mean)) < SIGMAS * error


@pytest.mark.slow
def test_a_loop_of_two_links_is_that_of_weighted_draws():
    """Elements that are linked at one place are drawn exactly; a second, soft link weighs them by its energy.

    Bends and the stiff link are held to 5 %. The energy of the soft one, which relaxes with the turns of elements, has
    its own, larger error.
    """
    stiffness, soft, draws, copies, elements, samples = 1.0, 3e-4, 20000, 600, 1, 40
    generator, element = np.random.default_rng(11), BEAM.beam_element(TEMPERATURE)
    kT = KT
    # The elements of one chain, of which each is as good as one that is alone, but for the strains of its ends.
    chain = draw_beam(element, 2 * draws, kT, generator, np.zeros(3), None, False)
    nodes, controls = (np.stack([own[:-1], own[1:]], axis=1) for own in chain)
    turns = Rotation.random(2 * draws, random_state=1)
    origins = nodes[:, :1].copy()
    nodes, controls = (
        np.stack([turns.apply(own[:, end] - origins[:, 0]) for end in (0, 1)], axis=1) for own in (nodes, controls)
    )
    places = [(0, 0.2), (0, 0.9)]

    def at(place):
        return element_points(nodes, controls, [place[1]])[:, place[0], 0]

    vectors = generator.normal(0.0, np.sqrt(kT / stiffness), (draws, 3))
    moved = at(places[0])[::2] - at(places[0])[1::2] + vectors
    nodes[1::2] += moved[:, None]
    controls[1::2] += moved[:, None]
    apart = at(places[1])[::2] - at(places[1])[1::2]
    energy = 0.5 * soft * np.sum(apart**2, axis=1) / kT
    weights = np.exp(-energy)
    weights /= weights.sum()
    assert 1.0 / np.sum(weights**2) > 0.05 * draws
    bends = element_energies(nodes, controls, element)[1].reshape(draws, -1).mean(axis=1) / kT
    expected = [float(weights @ values) for values in (energy, bends)]
    errors = [np.sqrt(np.sum((weights * (v - e)) ** 2)) for v, e in zip((energy, bends), expected)]
    # Copies begin in the equilibrium of the loop.
    chosen = generator.choice(draws, copies, p=weights)
    filaments = Filaments(VISCOSITY, TEMPERATURE, engine="compiled")
    for _ in range(2 * copies):
        filaments.add_straight(BEAM, elements, [0, 0, 0], [1, 0, 0])
    _, system, positions = filaments.build()
    positions = positions._value
    rows = np.ravel([2 * chosen, 2 * chosen + 1], order="F")
    positions[np.array(filaments.node_indices)] = nodes[rows]
    positions[np.array(filaments.control_point_indices)] = controls[rows]
    links = Crosslinks(stiffness, 0.0)
    for number in range(0, 2 * copies, 2):
        for (segment, fraction), own in zip(places, (stiffness, soft)):
            ends = [filaments.segment_place(number + i, segment=segment, fraction=fraction) for i in (0, 1)]
            links.add(None, *ends, stiffness=own)
    links.add_to(system)
    integrator = filaments.create_integrator(system, filaments.recommended_time_step(system=system), random_seed=7)
    context = new_context(system, positions, integrator, "CPU")
    integrator.step(100)
    measured = [[], [], []]
    for _ in range(samples):
        integrator.step(10)
        lengths = links.lengths(context)
        measured[0].append(0.5 * soft * lengths[1::2] ** 2 / kT)
        now = positions_of(context)
        indices = (np.array(own) for own in (filaments.node_indices, filaments.control_point_indices))
        curves = (now[own] for own in indices)
        measured[1].append(element_energies(*curves, element)[1].reshape(copies, -1).mean(axis=1) / kT)
        measured[2].append(0.5 * stiffness * lengths[::2] ** 2 / kT)
    for values, value, uncertainty in zip(measured, [*expected, 1.5], [*errors, 0.0]):
        mean = np.mean(values, axis=0)
        error = np.hypot(np.std(mean, ddof=1) / np.sqrt(copies), uncertainty)
        assert error < (0.05 if value == expected[0] else 0.01) * value
        assert abs(np.mean(mean) - value) < SIGMAS * error + 0.01 * value


def sums_of(particles, positions, before=None):
    """The integral of r along a beam, or of (r_before + r)/2 x (r - r_before), which isotropic friction weighs."""
    places, weights = np.polynomial.legendre.leggauss(4)
    places, weights = 0.5 * (1.0 + places), 0.5 * weights

    def points(now):
        return element_points(now[particles[::2]], now[particles[1::2]], places)

    now = points(positions)
    values = now if before is None else np.cross(0.5 * (now + points(before)), now - points(before))
    return np.einsum("epx,p->x", values, weights)


@pytest.mark.parametrize("step", [0.02, 1e-4])
def test_links_exert_neither_a_force_nor_a_torque_on_the_whole(step):
    """Beams with isotropic friction: the integral of r along both stays, and that of r x dr in short steps."""
    system, force = openmm.System(), CylinderChainForce()
    generator = np.random.default_rng(5)
    chains = []
    for _ in range(2):
        chain = [system.addParticle(1.0) for _ in range(6)]
        chains.append(np.array(chain))
        force.addBeamChain(chain, 1.0, 1e3, 20.0, 0.0, 2.0, 2.0, False)
    system.addForce(force)
    links = plugin.CylinderChainLinkForce()
    links.addLink(0, 2, 0.3, 8, 10, 0.9, links.Harmonic, 0.5, 300.0, 0.0)
    links.addLink(2, 4, 0.5, 6, 8, 0.2, links.Harmonic, 0.0, 50.0, 0.0)
    system.addForce(links)
    x = np.array([0, 1 / 3, 1, 4 / 3, 2, 7 / 3])
    first, second = np.stack([x, 0 * x, 0 * x], axis=1), np.stack([0 * x + 1, x - 0.5, 0 * x + 1], axis=1)
    positions = np.concatenate([first, second])
    positions += generator.normal(0.0, 0.02, positions.shape)
    integrator = CylinderChainIntegrator(0.0, 1.0, step)
    context = new_context(system, positions, integrator)
    energy = energy_of(context)
    for _ in range(20):
        before = positions_of(context)
        integrator.step(1)
        after = positions_of(context)
        moved = np.abs(after - before).max()
        centers = [sum(sums_of(own, now) for own in chains) for now in (before, after)]
        assert centers[1] == pytest.approx(centers[0], abs=1e-3 * moved)
        turned = sum(sums_of(own, after, before) for own in chains)
        assert step > 1e-3 or turned == pytest.approx(np.zeros(3), abs=1e-2 * moved)
    assert energy_of(context) < 0.9 * energy


def test_steps_do_not_depend_on_threads_and_go_on_from_a_checkpoint():
    kinds, places = PAIRS["a beam and a straight filament"]
    results = []
    for threads in ("1", "2"):
        filaments, system, positions, _ = linked_pairs(kinds, places, 1.0, 10)
        step = filaments.recommended_time_step(system=system)
        integrator = filaments.create_integrator(system, step, random_seed=3)
        context = new_context(system, positions, integrator, "CPU", {"Threads": threads})
        integrator.step(10)
        checkpoint = context.createCheckpoint()
        integrator.step(10)
        results.append(positions_of(context))
        context.loadCheckpoint(checkpoint)
        integrator.step(10)
        assert np.array_equal(positions_of(context), results[-1])
    assert np.array_equal(*results)


def test_steps_that_cannot_be_solved_are_divided_for_all_that_is_linked():
    """At ten times the recommended step, one in fifty is; links keep their energy, which has no error of the step."""
    kinds, places = PAIRS["two beams"]
    filaments, system, positions, links = linked_pairs(kinds, places, 1.0, 150)
    step = 10.0 * filaments.recommended_time_step(system=system).step
    integrator = filaments.create_integrator(system, step, random_seed=2, checks=False)
    context = new_context(system, positions, integrator, "CPU")
    energies = []
    for _ in range(40):
        integrator.step(2)
        energies.append(0.5 * links.lengths(context) ** 2 / KT)
    assert 0.005 < integrator.getNumDividedSteps() / (300 * 80) < 0.1
    mean = np.mean(energies, axis=0)
    error = np.std(mean, ddof=1) / np.sqrt(len(mean))
    assert error < 0.012 * 1.5
    assert abs(np.mean(mean) - 1.5) < SIGMAS * error


def test_errors_name_the_link_and_both_filaments():
    filaments = Filaments(VISCOSITY, TEMPERATURE, engine="compiled")
    filaments.add_straight(STRAIGHT, 4, [0, 100, 0], [1, 0, 0])
    filaments.add_straight(BEAM, 2, [0, 0, 0], [1, 0, 0])
    filaments.add_straight(BEAM, 2, [0, 50, 0], [1, 0, 0])
    _, system, positions = filaments.build()
    # Both ends of one are held at the middle of the other, from two sides that it cannot reach.
    links = Crosslinks(1.0, 0.0, "fene", 60.0)
    links.add(None, filaments.segment_place(1, segment=1), filaments.segment_place(2, segment=1))
    links.add_to(system)
    pull = openmm.CustomExternalForce("-1e6*y")
    pull.addParticle(int(filaments.node_indices[2][1]))
    system.addForce(pull)
    integrator = filaments.create_integrator(system, 1e6, checks=False, temperature=0.0)
    context = new_context(system, positions, integrator)
    before = positions_of(context)
    with pytest.raises(InstabilityError, match=r"Filament [12] \(BEAM\) has blown up") as raised:
        integrator.step(100)
    assert "Positions are those before this step" in str(raised.value)
    assert np.all(np.isfinite(positions_of(context))) and before.shape == positions.shape
