"""Linkers on the curves of beam elements, alone and beside straight segments: equilibrium, motion, tables, restarts."""

from dataclasses import replace

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from openmm_cylchain import F_ACTIN, Crosslinker, Filaments, FilamentType, Hand, InputError
from openmm_cylchain.beams.curve import arc_lengths, control_points_of, element_points
from openmm_cylchain.beams.equilibrium import draw_beam
from support.contexts import energy_of, forces_of, new_context, positions_of, slopes_of
from support.linker_contexts import PICONEWTON, SECOND, check_that_runs_go_on_to_the_bit, glide, same_linkers
from support.solvent import KT, TEMPERATURE, VISCOSITY

# An element bends by about half a radian.
SOFT = FilamentType(
    name="SOFT",
    diameter=6.0,
    segment_length=60.0,
    persistence_length=600.0,
    temperature=TEMPERATURE,
    stretching_modulus=500.0,
    friction_length="filament",
    element="beam",
)
ACTIN = replace(F_ACTIN, name="BEAM", segment_length=200.0, extension_relaxation_time=None, element="beam")
HAND = Hand(binding_rate=3e4 / SECOND, reach=60.0, unbinding_rate=2e3 / SECOND)
SPRING = Crosslinker(hands=HAND, stiffness=0.1 * PICONEWTON)
MOTOR = Crosslinker(
    hands=replace(HAND, speed=8e4 / SECOND, stall_force=6.0 * PICONEWTON, unbinding_force=3.0 * PICONEWTON),
    stiffness=0.1 * PICONEWTON,
    rest_length=20.0,
)
ON_SITES = replace(MOTOR, hands=replace(MOTOR.hands[0], site_spacing=8.0))
TRAP = 0.05 * PICONEWTON


def of_copies(copies, seed):
    """Beams of an element, each tethered by its first node where it is drawn from equilibrium."""
    filaments, generator = Filaments(VISCOSITY, TEMPERATURE, engine="compiled"), np.random.default_rng(seed)
    for copy in range(copies):
        centre = np.array([0.0, 0.0, 1000.0 * copy])
        start = centre + generator.normal(0.0, np.sqrt(KT / TRAP), 3)
        filaments.add_equilibrium(SOFT, 1, seed=seed + copy, start=start)
        filaments.add_tether(copy, 0, point=centre, stiffness=TRAP)
    return filaments


def expected_on_soft_beams(weight, stiffness, rest_length, reach, anchor, shapes=1500, turns=60):
    """Bound over unbound copies, the mean energy of springs and the mean place along the beams, by sums over draws.

    Of many shapes, each is turned and moved with its first node many times.
    """
    generator, per_element = np.random.default_rng(8), 20
    element = SOFT.beam_element(TEMPERATURE, False)
    places = (np.arange(per_element) + 0.5) / per_element
    along = 60.0 * places
    bound, energies, arc = 0.0, 0.0, 0.0
    for _ in range(shapes):
        drawn = draw_beam(element, 1, KT, generator, np.zeros(3), None, False)
        points = element_points(*drawn, places).reshape(-1, 3)
        turned = np.einsum("rij,pj->rpi", Rotation.random(turns, rng=generator).as_matrix(), points)
        distance = np.linalg.norm(turned + generator.normal(-anchor, np.sqrt(KT / TRAP), (turns, 1, 3)), axis=2)
        energy = 0.5 * stiffness * (distance - rest_length) ** 2
        factor = np.where(distance < reach, np.exp(-energy / KT), 0.0)
        bound += factor.sum()
        energies += (factor * energy).sum()
        arc += (factor * along).sum()
    return weight * bound / (shapes * turns) * 60.0 / per_element, energies / bound, arc / bound


@pytest.mark.sample("^25.0-0.1")
@pytest.mark.slow
@pytest.mark.parametrize(("rest_length", "step"), [(25.0, 0.1), (0.0, 0.1), (25.0, 0.02)])
def test_binding_and_bending_are_in_equilibrium_together(rest_length, step):
    """Anchored hands and soft beams: how many are bound, with what energy, and where along the curve.

    Steps are in units in which a hand unbinds about once; a beam turns by a radian in some ten of them.
    """
    copies, stiffness, time = 300, 0.02 * PICONEWTON, 5e6
    hand = Hand(binding_rate=14.0 / time, reach=110.0, unbinding_rate=1.0 / time, strain_share=0.3)
    filaments, anchor = of_copies(copies, 1), np.array([0.0, 30.0, 0.0])
    kind = Crosslinker(hands=hand, stiffness=stiffness, rest_length=rest_length)
    filaments.add_linkers(kind, anchors=anchor + np.array([0.0, 0.0, 1000.0]) * np.arange(copies)[:, None])
    _, system, positions = filaments.build()
    integrator = filaments.create_integrator(system, step * time, random_seed=3, checks=False)
    context = new_context(system, positions, integrator)
    here = filaments.in_context(context)
    interval = max(1, round(1.0 / step))
    integrator.step(8 * interval)
    found = []
    for _ in range(240):
        integrator.step(interval)
        table, pulls = here.linkers(), here.linker_pulls()
        bound = table.bound[:, 1]
        energies = 0.5 * stiffness * (pulls.lengths - rest_length) ** 2
        found.append((bound.mean(), energies.sum() / copies, table.arc_lengths[bound, 1].sum() / copies))
    ratio, energy, along = expected_on_soft_beams(
        hand.rate_per_length / hand.unbinding_rate, stiffness, rest_length, hand.reach, anchor
    )
    share = ratio / (1.0 + ratio)
    assert 0.2 < share < 0.8
    means = np.array(found).reshape(20, -1, 3).mean(axis=1)
    errors = means.std(axis=0, ddof=1) / np.sqrt(len(means))
    for mean, error, exact in zip(means.mean(axis=0), errors, share * np.array([1.0, energy, along]), strict=True):
        assert 4.0 * error < 0.05 * exact
        assert abs(mean - exact) < 0.01 * exact + 4.0 * error


def network(linkers, step=2e7, **options):
    """Beams and straight filaments that cross each other in a small periodic box, with linkers in a Context."""
    filaments = Filaments(VISCOSITY, TEMPERATURE, engine="compiled")
    generator = np.random.default_rng(1)
    for number in range(24):
        kind, segments = (ACTIN, 3) if number % 3 else (F_ACTIN.with_segment_length(100.0), 6)
        filaments.add_equilibrium(kind, segments, seed=number, start=generator.uniform(0.0, 500.0, 3))
    for kind, arguments in linkers:
        filaments.add_linkers(kind, **arguments)
    _, system, positions = filaments.build(box_vectors=500.0 * np.eye(3))
    integrator = filaments.create_integrator(system, step, random_seed=5, checks=False)
    return filaments, new_context(system, positions, integrator, **options)


ALL = [
    (SPRING, {"count": 300, "bound": 200}),
    (MOTOR, {"count": 60, "bound": 40}),
    (ON_SITES, {"count": 60, "bound": 40}),
    (SPRING, {"concentration": 3e-8}),
]


def on_beams(filaments, table):
    """Which hands are bound to beams: (n, 2)."""
    beams = np.array([not filament.type.segment_kind.straight for filament in filaments] + [False])
    return beams[table.filaments]


def test_runs_go_on_from_checkpoints_and_states_to_the_bit():
    filaments, table = check_that_runs_go_on_to_the_bit(lambda: network(ALL))
    assert np.count_nonzero(on_beams(filaments, table).all(axis=1)) > 3


def test_threads_change_nothing():
    results = []
    for number in ("1", "2", "3"):
        filaments, context = network(ALL, platform="CPU", properties={"Threads": number})
        context.getIntegrator().step(60)
        results.append((filaments.in_context(context).linkers(), positions_of(context)))
    for table, positions in results[1:]:
        assert same_linkers(results[0][0], table)
        assert np.array_equal(results[0][1], positions)


def test_filaments_keep_their_numbers():
    """Chains of beam elements come behind all others in the engine; hands that bind to one type show which is which."""
    hands = [replace(HAND, binds_to=F_ACTIN), replace(HAND, binds_to="BEAM")]
    kind = replace(SPRING, hands=hands)
    filaments, context = network([(kind, {"count": 200, "bound": 100})])
    here = filaments.in_context(context)
    seen = np.zeros(2, dtype=int)
    for _ in range(10):
        context.getIntegrator().step(20)
        table = here.linkers()
        places = here.linker_places()._value
        for side in (0, 1):
            bound = table.bound[:, side]
            assert np.all(on_beams(filaments, table)[bound, side] == side)
            seen[side] += np.count_nonzero(bound)
        assert here.linker_pulls().lengths.max(initial=0.0) < 4.0 * HAND.reach
        assert np.all(np.isfinite(places[table.bound]))
    assert seen.min() > 20
    with pytest.raises(InputError, match="bound to filament 1, to which its hand does not bind"):
        here.set_linkers(replace(table, filaments=np.where(table.filaments == 0, 1, table.filaments)))
    with pytest.raises(InputError, match="along filament 2, which is only 600"):
        lengths = np.where(table.filaments == 2, 700.0, table.arc_lengths)
        here.set_linkers(replace(table, arc_lengths=lengths))


def test_forces_are_those_of_springs_on_curves():
    filaments, context = network(ALL)
    here = filaments.in_context(context)
    context.getIntegrator().step(120)
    pulls = here.linker_pulls()
    assert np.count_nonzero(on_beams(filaments, here.linkers()).all(axis=1)) > 3
    forces = [force for force in context.getSystem().getForces() if force.getName() == "Linkers"]
    forces[0].setForceGroup(7)
    context.reinitialize(preserveState=True)
    stiffness, rest = (np.array([getattr(kind, name) for kind, _ in ALL]) for name in ("stiffness", "rest_length"))
    energies = 0.5 * stiffness[pulls.types] * (pulls.lengths - rest[pulls.types]) ** 2
    assert energy_of(context, {7}) == pytest.approx(energies.sum(), rel=1e-9)
    found = forces_of(context, {7})
    moved = np.flatnonzero(np.linalg.norm(found, axis=1) > 0.1)[:8]
    np.testing.assert_allclose(found[moved], -slopes_of(context, positions_of(context), moved, {7}), atol=1e-4)


RADIUS, ARC = 400.0, 1400.0


def an_arc(filaments):
    """A beam along a circle in the x-y plane, which begins at (RADIUS, 0, 0). Only its last tangent is free."""
    h = ACTIN.segment_length
    angles = np.arange(0.0, ARC + 1.0, h) / RADIUS
    nodes = on_circle(angles * RADIUS)
    tangents = np.column_stack([-np.sin(angles), np.cos(angles), np.zeros_like(angles)])
    return filaments.add_nodes(
        ACTIN,
        nodes,
        control_points=control_points_of(nodes, tangents, h),
        clamped=range(len(nodes)),
        clamped_tangents=range(len(nodes) - 1),
    )


def on_circle(along):
    return RADIUS * np.column_stack([np.cos(along / RADIUS), np.sin(along / RADIUS), np.zeros_like(along)])


@pytest.mark.parametrize("direction", [1.0, -1.0])
def test_hands_walk_along_the_arc_at_their_speed(direction):
    """Elements bend by half a radian, and hands go from one to the next, and stop at the end."""
    filaments = Filaments(VISCOSITY, TEMPERATURE, engine="compiled")
    an_arc(filaments)
    speed = 1000.0 / SECOND
    hand = Hand(binding_rate=0.0, reach=60.0, unbinding_rate=0.0, speed=direction * speed, at_end="hold")
    filaments.add_linkers(Crosslinker(hands=hand, stiffness=1.0), count=60, volume=1e9, bound=60, seed=3)
    _, system, positions = filaments.build()
    context = new_context(system, positions, filaments.create_integrator(system, 1e-3 * SECOND, checks=False))
    here = filaments.in_context(context)
    begins = here.linkers().arc_lengths[:, 0]
    context.getIntegrator().step(300)
    lengths = arc_lengths(filaments[0].positions, filaments[0].control_points)
    np.testing.assert_allclose(lengths, ACTIN.segment_length, rtol=1e-4)
    places = here.linker_places()._value[:, 0]
    along = np.clip(begins + direction * 300.0, 0.0, ARC)
    at_end = along == (ARC if direction > 0.0 else 0.0)
    # That of the last element fluctuates.
    seen = (along < ARC - ACTIN.segment_length) | at_end
    assert np.count_nonzero(at_end) > 5 and np.count_nonzero(seen) > 30
    np.testing.assert_allclose(places[seen], on_circle(along[seen]), atol=0.1)


def test_fixed_motors_make_a_beam_glide_at_their_speed():
    filaments = Filaments(VISCOSITY, TEMPERATURE, engine="compiled")
    filaments.add_straight(ACTIN, 10, (0.0, 0.0, 0.0), (1.0, 0.0, 0.0))
    *_, displacement = glide(filaments)
    # Towards the plus end they walk, so the filament goes the other way.
    assert displacement[0] == pytest.approx(-1000.0, rel=0.03)
    assert np.linalg.norm(displacement[1:]) < 60.0


@pytest.mark.parametrize("shift", [0.0, 1.0])
def test_anchored_linkers_begin_in_the_equilibrium_of_their_springs(shift):
    """Inside an arc, also where that is an image in a periodic box."""
    filaments = Filaments(VISCOSITY, TEMPERATURE, engine="compiled")
    an_arc(filaments)
    kind = Crosslinker(hands=replace(HAND, reach=90.0), stiffness=0.02, rest_length=5.0)
    point = np.array([400.0 * np.cos(0.6), 400.0 * np.sin(0.6), 12.0]) * 0.97
    image = point + shift * np.array([1500.0, 0.0, -1500.0])
    filaments.add_linkers(kind, anchors=np.tile(image, (3000, 1)), bound=3000)
    _, system, positions = filaments.build(box_vectors=1500.0 * np.eye(3))
    context = new_context(system, positions)
    here = filaments.in_context(context)
    table, pulls = here.linkers(), here.linker_pulls()
    assert table.counts() == (0, 0, 3000)
    along = np.arange(0.0, ARC, 0.05)
    curve = element_points(filaments[0].positions, filaments[0].control_points, np.arange(4000) / 4000).reshape(-1, 3)
    lengths = np.linalg.norm(curve - point, axis=1)
    within = lengths <= 90.0
    weights = np.exp(-0.5 * kind.stiffness * (lengths - kind.rest_length) ** 2 / KT) * within
    for found, exact in ((pulls.lengths, lengths), (table.arc_lengths[:, 1], along)):
        mean = np.average(exact, weights=weights)
        error = np.sqrt(np.average((exact - mean) ** 2, weights=weights) / len(found))
        assert 4.0 * error < 0.05 * mean
        assert abs(found.mean() - mean) < 4.0 * error
    assert pulls.lengths.max() < 90.0
    # Where the hands of a Context are is where they were drawn.
    np.testing.assert_allclose(np.interp(table.arc_lengths[:, 1], along, lengths), pulls.lengths, atol=1e-3)


def test_recommended_steps_know_linkers_on_beams():
    filaments, context = network([(MOTOR, {"count": 1})])
    found = filaments.recommended_time_step(system=context.getSystem())
    assert any(name.startswith("Linkers: type 0") for name in found.bounds)
    assert not found.unknown_forces
