"""Filaments that grow: what they are given, what is refused, nodes that come and go, restarts, reporters, steps."""

import copy
import pickle
import warnings
from dataclasses import replace

import numpy as np
import openmm
import pytest
from openmm import app, unit

from openmm_cylchain import (
    ACTIN_ATP,
    ALPHA_ACTININ,
    F_ACTIN,
    MICROTUBULE,
    BeadSpringType,
    Crosslinks,
    DynamicInstability,
    Filaments,
    Growth,
    InputError,
    InstabilityError,
    LinkerTable,
    MonomerPool,
    Monomers,
    Sphere,
    TensionReporter,
    TimeStepWarning,
    analysis,
    capsule_contact_force,
    check_time_step,
    constant_force,
    constant_tension,
    filament_wall_force,
    make_whole,
    wall_force,
)
from openmm_cylchain.filaments.grown import (
    GrownChain,
    count_nodes_of_monomers,
    longest_segment,
    monomers_of_segments,
)
from support.contexts import energy_of, new_context, positions_of
from support.solvent import TEMPERATURE, VISCOSITY

NM, MICROMOLAR, SECOND = unit.nanometer, unit.Quantity(1e-6, unit.molar), unit.second
KIND = F_ACTIN.with_segment_length(54 * NM)
PER_SEGMENT = 20
STEP = 2e8
RATES = ("plus_on_rate", "plus_off_rate", "minus_on_rate", "minus_off_rate")


def growth(**changes):
    return Growth(**{"monomers": ACTIN_ATP, "pool": 50 * MICROMOLAR, "longest": 600 * NM, **changes})


def turning(**changes):
    return DynamicInstability(**{"catastrophe_rate": 0.0, "rescue_rate": 0.0, "shrinking_off_rate": 0.0, **changes})


def growing(count=1, kind=KIND, segments=4, still=0, apart=30.0, **options):
    """Straight filaments side by side that grow, and some that do not."""
    filaments = Filaments(VISCOSITY, TEMPERATURE, engine="compiled")
    for number in range(count + still):
        own = {"growth": growth(), **options} if number < count else {}
        filaments.add_straight(kind, segments, [0, apart * number, 0], [1, 0, 0], **own)
    return filaments


def in_context(filaments, system, positions, threads=1, step=STEP, **arguments):
    integrator = filaments.create_integrator(system, step, random_seed=4, checks=False, **arguments)
    cpu = openmm.Platform.getPlatformByName("CPU")
    context = openmm.Context(system, integrator, cpu, {"Threads": str(threads)})
    context.setPositions(positions)
    return context


def built(filaments, **box):
    _, system, positions = filaments.build(**box)
    return filaments, system, positions


def live_nodes(filaments, context):
    """Positions of the particles of each filament, and how many of them are nodes."""
    positions = positions_of(context)
    return [positions[nodes] for nodes in filaments.node_indices], filaments.in_context(context).growth().nodes


@pytest.mark.parametrize(
    ("quantities", "numbers"),
    [
        (
            Monomers(length=2.7 * NM, plus_on_rate=11.6 / MICROMOLAR / SECOND, minus_off_rate=0.8 / SECOND),
            Monomers(length=2.7, plus_on_rate=11.6e6 * 1e24 / 6.02214076e23 * 1e-12, minus_off_rate=0.8e-12),
        ),
        (
            Monomers(length=0.0027 * unit.micrometer, minus_on_rate=3e-6 * unit.micrometer**3 / SECOND),
            Monomers(length=2.7, minus_on_rate=3e-9),
        ),
        (
            MonomerPool(5 * MICROMOLAR, 0.5 * unit.micrometer**3),
            MonomerPool(5e-6 * 6.02214076e23 / 1e24, 0.5e9),
        ),
        (MonomerPool(2 / unit.micrometer**3), MonomerPool(2e-9)),
        (
            DynamicInstability(
                catastrophe_rate=0.5 / SECOND,
                rescue_rate=30 / unit.minute,
                shrinking_off_rate=0.7 / unit.millisecond,
                shrinking_on_rate=1e-6 * unit.micrometer**3 / SECOND,
            ),
            DynamicInstability(
                catastrophe_rate=5e-13, rescue_rate=5e-13, shrinking_off_rate=7e-10, shrinking_on_rate=1e-9
            ),
        ),
        (growth(shortest=0.1 * unit.micrometer), growth(longest=600.0, shortest=100.0)),
    ],
)
def test_quantities_and_plain_numbers_are_the_same(quantities, numbers):
    for name, value in vars(quantities).items():
        other = getattr(numbers, name)
        if isinstance(value, MonomerPool):
            assert value.concentration == pytest.approx(other.concentration)
        else:
            assert value is other or value == pytest.approx(other, rel=1e-12)


@pytest.mark.parametrize("name", [*RATES, "length"])
@pytest.mark.parametrize("value", [-1.0, np.nan, np.inf, "fast", 1 * unit.kelvin, [1.0, 2.0], None])
def test_monomers_of_wrong_values(name, value):
    with pytest.raises(InputError, match=name if name != "length" else "length of a monomer"):
        Monomers(**{"length": 2.7, name: value})


@pytest.mark.parametrize(
    ("make", "message"),
    [
        (lambda: MonomerPool(-1.0), "concentration"),
        (lambda: MonomerPool(1 * NM), "concentration"),
        (lambda: MonomerPool(1.0, 0.0), "volume"),
        (lambda: MonomerPool(1.0, 1 * NM), "volume"),
        (lambda: growth(monomers=2.7), "monomers"),
        (lambda: growth(pool="actin"), "concentration"),
        (lambda: growth(longest=-1.0), "longest"),
        (lambda: growth(longest=1 * SECOND), "longest"),
        (lambda: growth(shortest=700.0), "longest must exceed shortest"),
        (lambda: growth(plus_capped=True, minus_capped=True), "two capped ends"),
        (lambda: growth(plus_capped="yes"), "plus_capped"),
        (lambda: growth(plus_instability=1.0), "plus_instability"),
        (lambda: growth(plus_capped=True, plus_instability=turning()), "plus end is capped"),
        (lambda: turning(catastrophe_rate=-1.0), "catastrophe_rate"),
        (lambda: turning(rescue_rate=np.nan), "rescue_rate"),
        (lambda: turning(shrinking_off_rate=1 * NM), "shrinking_off_rate"),
        (lambda: turning(shrinking_on_rate=1 / SECOND), "shrinking_on_rate"),
        (lambda: Monomers(length=2.7).treadmilling_concentration, "never grow"),
        (lambda: growing(growth=ACTIN_ATP), "growth"),
        (lambda: growing(growth=growth(longest=200.0)), "216 nm long, but its growth has filaments between"),
        (lambda: growing(growth=growth(longest=1 * unit.meter)), "Check the unit of longest"),
        (lambda: growing(growth=growth(shortest=300.0)), "216 nm long, but its growth has filaments between"),
        (lambda: growing(kind=F_ACTIN.with_segment_length(55.0)), r"with_segment_length\(54\)"),
        (lambda: growing(clamped=0), "minus_capped=True"),
        (lambda: growing(clamped=-1, growth=growth(minus_capped=True)), "first node alone"),
        (lambda: growing(kind=MICROTUBULE), "whole number of them"),
        (lambda: growing(kind=F_ACTIN.with_segment_length(16.2)), "8.1 nm long, for which they have no friction"),
        (lambda: growing(kind=replace(KIND, friction_length="filament")), "Give its type a friction_length"),
    ],
)
def test_wrong_growth_is_refused(make, message):
    with pytest.raises(InputError, match=message):
        make()


def test_other_kinds_of_filaments_do_not_grow():
    filaments = Filaments(VISCOSITY, TEMPERATURE, engine="compiled")
    beads = BeadSpringType(
        name="BSP", diameter=2.0, bead_spacing=0.5, bead_friction=1e3, stretching_modulus=600.0, bending_rigidity=120.0
    )
    beam = replace(KIND, element="beam", extension_relaxation_time=None)
    for add in (
        lambda: filaments.add_ring(KIND, 8, [0, 0, 0], growth=growth()),
        lambda: filaments.add_nodes(KIND, 54.0 * np.eye(4, 3), closed=True, growth=growth()),
        lambda: filaments.add_straight(beam, 2, [0, 0, 0], [1, 0, 0], growth=growth()),
        lambda: filaments.add_straight(beads, 2, [0, 0, 0], [1, 0, 0], growth=growth()),
    ):
        with pytest.raises(InputError, match="Filament 0 .*: only open filaments of straight segments grow"):
            add()
    with pytest.raises(InputError, match="portable engine has no filaments that grow"):
        Filaments(VISCOSITY, TEMPERATURE, engine="portable").add_straight(
            KIND, 2, [0, 0, 0], [1, 0, 0], growth=growth()
        )


@pytest.mark.parametrize(
    "ask",
    [
        lambda f: f.add_tether(0, 0, [0, 0, 0], 1.0),
        lambda f: f.add_attachment(0, segment=0),
        lambda f: f.add_beads(0, 10.0),
        lambda f: (f.build(), f.segment_place(0, segment=0)),
        lambda f: (f.build(), constant_tension(f, 1.0, [1, 0, 0])),
        lambda f: f.chain_set(f.build()[1]),
        lambda f: TensionReporter(None, 1, f),
        lambda f: TensionReporter(None, 1, f, joints=True, mean=True),
        lambda f: (lambda x: analysis.CrossingCounter(f, x))(f.build()[2]),
        lambda f: (lambda x: analysis.find_crossings(f, x, x))(f.build()[2]),
        lambda f: (lambda _, s, x: check_time_step(f, s, x, STEP))(*f.build()),
        lambda f: f.in_context(in_context(*built(f))).joint_tensions(),
        lambda f: f.create_integrator(f.build()[1], STEP, scheme="midpoint"),
        lambda f: with_force(f, constant_force([0], [1.0, 0, 0])),
        lambda f: with_force(f, constant_force([12], [1.0, 0, 0])),
        lambda f: with_force(f, wall_force(Sphere([0, 0, 0], 1e3), 1.0, range(13))),
        lambda f: with_force(f, bond()),
        lambda f: with_links(f, before=True),
        lambda f: with_links(f, before=False),
        lambda f: (f.add_linkers(ALPHA_ACTININ, anchors=[3]), f.create_integrator(f.build()[1], STEP)),
    ],
)
def test_what_needs_nodes_that_stay_is_refused(ask):
    with pytest.raises(InputError, match=r"ilament 0 \(ACT\) grows, so that its nodes come and go"):
        ask(growing(2))


def with_force(filaments, force):
    _, system, _ = filaments.build()
    system.addForce(force)
    filaments.create_integrator(system, STEP, checks=False)


def bond():
    force = openmm.HarmonicBondForce()
    force.addBond(0, 13, 1.0, 1.0)
    return force


def with_links(filaments, before):
    _, system, positions = filaments.build()
    links = Crosslinks(1.0, 1.0)
    if before:
        links.add(None, 0, 13)
    links.add_to(system)
    links.add(in_context(filaments, system, positions), 0, 13)


def test_forces_that_divide_by_all_distances_are_refused():
    """Spare nodes are in one place; a NonbondedForce leaves them out pair by pair."""
    for kind, possible in ((openmm.NonbondedForce, True), (openmm.GBSAOBCForce, False)):
        topology, system, filaments = app.Topology(), openmm.System(), growing()
        topology.addAtom("A", None, topology.addResidue("A", topology.addChain()))
        system.addParticle(10.0)
        force = kind()
        force.addParticle(1.0, 1.0, 1.0)
        if not possible:
            force.setSurfaceAreaEnergy(0.0)
        system.addForce(force)
        if not possible:
            with pytest.raises(InputError, match="spare nodes of filaments that grow"):
                filaments.add_to(topology, system, [[0, 50, 0]])
            continue
        positions = filaments.add_to(topology, system, [[0, 50, 0]])
        context = in_context(filaments, system, positions, particle_friction=1e5)
        context.getIntegrator().step(20)
        assert np.all(np.isfinite(positions_of(context)))


def test_spare_nodes_are_where_the_last_node_is():
    filaments, system, positions = built(growing(2, still=1, segments=5), box_vectors=240.0 * np.eye(3))
    assert [len(nodes) for nodes in filaments.node_indices] == [13, 13, 6]
    system.addForce(capsule_contact_force(filaments, system, 8.0))
    context = in_context(filaments, system, positions)
    for _ in range(3):
        context.getIntegrator().step(150)
        particles, counts = live_nodes(filaments, context)
        for own, count in zip(particles, counts):
            assert analysis.count_nodes(own) == count
        state = filaments.in_context(context).growth()
        assert state.filaments.tolist() == [0, 1]
        for monomers, count, length in zip(state.monomers, counts, state.lengths):
            segments = monomers_of_segments(monomers, PER_SEGMENT)
            assert len(segments) == count - 1 and segments.sum() * 2.7 * NM == length
            assert np.all(segments[1:-1] == PER_SEGMENT)
            assert np.all((segments[[0, -1]] >= PER_SEGMENT // 2) & (segments[[0, -1]] < 3 * PER_SEGMENT // 2))
        np.testing.assert_array_equal(state.monomers - [0, 100], (state.gained - state.lost) * [-1, 1])
    assert np.all(counts > 6)
    wrapped = positions_of(context) - 240.0 * np.floor(positions_of(context) / 240.0)
    whole = make_whole(wrapped, filaments, 240.0 * np.eye(3))._value
    for nodes, count in zip(filaments.node_indices, counts):
        assert analysis.count_nodes(whole[nodes]) == count
    with pytest.raises(InputError, match="at rest"):
        make_whole(wrapped, filaments, 200.0 * np.eye(3))
    assert longest_segment(filaments[0]) == pytest.approx(39 * 2.7)
    with pytest.raises(InputError, match=r"contacts of 8 nm between segments of 105\.3 nm"):
        capsule_contact_force(filaments, small_box(system), 8.0)


def small_box(system):
    narrow = copy.deepcopy(system)
    narrow.setDefaultPeriodicBoxVectors(*(220.0 * np.eye(3)))
    return narrow


def test_energies_tensions_and_virial_of_what_has_grown():
    """By the compiled engine, and by strains."""
    filaments, system, positions = built(growing(2))
    context = in_context(filaments, system, positions)
    context.getIntegrator().step(200)
    particles, counts = live_nodes(filaments, context)
    ends = filaments.in_context(context).growth().monomers
    chains = [GrownChain(KIND, 2.7, own, nodes) for own, nodes in zip(ends, particles)]
    assert [chain.nodes for chain in chains] == counts.tolist()
    assert sum(sum(chain.energies) for chain in chains) == pytest.approx(energy_of(context), rel=1e-9)
    strain, size = np.random.default_rng(1).normal(size=(3, 3)), 1e-6
    both = (particles[0] @ (np.eye(3) + sign * size * strain) for sign in (1, -1))
    more, less = (sum(GrownChain(KIND, 2.7, ends[0], nodes).energies) for nodes in both)
    expected = (more - less) / (2.0 * size)
    assert np.sum(chains[0].virial * strain) == pytest.approx(expected, rel=1e-5)
    with pytest.raises(InputError, match="nodes are needed for so many monomers"):
        GrownChain(KIND, 2.7, ends[0], particles[0][:3])


@pytest.fixture(scope="module", params=[None, 1e7], ids=["concentration", "volume"])
def crowded(request):
    """Filaments in a sphere that touch each other, with a pool that stays or runs dry; and how far they are."""
    pool = MonomerPool(50 * MICROMOLAR, request.param)
    unstable = turning(catastrophe_rate=2e-11, rescue_rate=2e-11, shrinking_off_rate=1e-10)
    filaments = growing(3, apart=9.0, segments=3, growth=growth(pool=pool, plus_instability=unstable))
    _, system, positions = filaments.build()
    system.addForce(capsule_contact_force(filaments, system, 8.0))
    system.addForce(filament_wall_force(filaments, system, Sphere([80, 9, 0], 200.0), 10.0))
    context = in_context(filaments, system, positions)
    context.getIntegrator().step(60)
    saved = (
        context.createCheckpoint(),
        openmm.XmlSerializer.serialize(context.getState(positions=True, parameters=True, integratorParameters=True)),
        context.getState(positions=True, parameters=True),
    )
    context.getIntegrator().step(60)
    return filaments, system, positions, saved, all_of(filaments, context)


def all_of(filaments, context):
    state = filaments.in_context(context).growth()
    counts = (
        state.monomers,
        state.gained,
        state.lost,
        state.waited,
        state.shrinking,
        state.catastrophes,
        state.rescues,
    )
    columns = positions_of(context), state.concentrations._value, *counts
    return np.concatenate([column.ravel() for column in columns])


@pytest.mark.parametrize("of", ["checkpoint", "State"])
def test_a_restart_goes_on_to_the_bit(crowded, of):
    filaments, system, positions, (checkpoint, xml, _), expected = crowded
    context = in_context(filaments, system, positions)
    context.getIntegrator().step(5)
    if of == "checkpoint":
        context.loadCheckpoint(checkpoint)
    else:
        context.setState(openmm.XmlSerializer.deserialize(xml))
    context.getIntegrator().step(60)
    np.testing.assert_array_equal(all_of(filaments, context), expected)


@pytest.mark.parametrize("change", ["other Context", "threads", "XML", "deepcopy"])
def test_runs_are_the_same_wherever_they_run(crowded, change):
    filaments, system, positions, _, expected = crowded
    if change == "XML":
        system = openmm.XmlSerializer.deserialize(openmm.XmlSerializer.serialize(system))
    if change == "deepcopy":
        filaments, system = copy.deepcopy((filaments, system))
        assert filaments[0].growth.pool is filaments[1].growth.pool
    context = in_context(filaments, system, positions, threads=2 if change == "threads" else 1)
    context.getIntegrator().step(120)
    np.testing.assert_array_equal(all_of(filaments, context), expected)


def test_a_state_that_does_not_say_how_far_filaments_have_grown(crowded):
    filaments, system, positions, (_, _, state), _ = crowded
    context = in_context(filaments, system, positions)
    context.setState(state)
    for ask in (lambda: context.getIntegrator().step(1), filaments.in_context(context).growth):
        with pytest.raises(InputError, match=r"is not known: it has got a State .*integratorParameters=True"):
            ask()


def test_descriptions_are_pickled():
    shared = growth()
    first, second = pickle.loads(pickle.dumps([shared, growth(pool=shared.pool)]))
    assert first.pool is second.pool and first.monomers == ACTIN_ATP and first.longest == 600.0


def test_steps_that_resolve_how_ends_push():
    filaments, system, _ = built(growing())
    rate = ACTIN_ATP.plus_on_rate * filaments[0].growth.pool.concentration
    free = filaments.recommended_time_step(system=system)
    assert not any("monomers" in name for name in free.bounds) and not free.unknown_forces
    system.addForce(filament_wall_force(filaments, system, Sphere([108, 0, 0], 500.0), 1.0))
    found = filaments.recommended_time_step(system=system)
    (name,) = (name for name in found.bounds if "monomers" in name)
    assert found.allowed[name] == pytest.approx(0.2 / rate) and "plus end of filament 0" in name
    for share, warned in ((0.45, False), (0.55, True)):
        with warnings.catch_warnings(record=True) as caught:
            warnings.simplefilter("always")
            filaments.create_integrator(system, share / rate)
        assert any("gains 0.55 monomers" in str(one.message) for one in caught) == warned
        assert all(one.category is TimeStepWarning for one in caught)
    for own in (filaments, growing(growth=growth(plus_instability=turning(shrinking_off_rate=rate)))):
        with pytest.raises(InputError, match="Filament 0 .*monomers per second.*Check the units"):
            own.create_integrator(system if own is filaments else own.build()[1], 2e5 / rate)


def test_the_shortest_segment_at_an_end_counts_for_steps():
    """Filaments whose segments turn freely: a step allows as much as that of half as long ones."""
    joints = replace(KIND, persistence_length=None, temperature=None, bending_rigidity=0.0)
    steps = []
    for kind, segments, own in ((joints, 4, growth()), (joints.with_segment_length(27.0), 8, None)):
        filaments = Filaments(VISCOSITY, TEMPERATURE, engine="compiled")
        filaments.add_straight(kind, segments, [0, 0, 0], [1, 0, 0], growth=own)
        steps.append(filaments.recommended_time_step().allowed["rotation"])
    assert steps[0] == pytest.approx(steps[1])


def test_filaments_become_longer_than_longest_by_less_than_two_segments():
    """As many nodes as it has in the worst places of its joints, which others need less of."""
    for per_segment in (4, 7, 40):
        kind = F_ACTIN.with_segment_length(per_segment * 2.7)
        for monomers in range(per_segment, 5 * per_segment):
            nodes = growth(longest=2.7 * monomers - 1e-9).count_nodes(kind)
            ends = np.arange(per_segment)[:, None] + np.array([0, 1])
            needed = [
                count_nodes_of_monomers(ends + [0, many - 1], per_segment)
                for many in range(monomers, monomers + 2 * per_segment)
            ]
            assert needed[0].max() == nodes and needed[-1].min() > nodes


def test_places_of_linkers_on_what_has_grown():
    """Lengths along filaments go on from where their minus ends were at the start."""
    filaments = growing(2, apart=35.0)
    filaments.add_linkers(ALPHA_ACTININ, 20, volume=1e9)
    _, system, positions = filaments.build()
    context = in_context(filaments, system, positions)
    context.getIntegrator().step(300)
    here = filaments.in_context(context)
    lengths = 2.7 * here.growth().monomers
    assert lengths[0, 0] < -2.0
    ends = np.array([lengths[[0, 1], [0, 1]], lengths[[0, 1], [1, 0]]])
    none = np.full(2, -1)
    here.set_linkers(LinkerTable(np.arange(2), 0 * none, none, np.array([[0, 1], [0, 1]]), ends, 2))
    particles, counts = live_nodes(filaments, context)
    first = [own[[0, count - 1]] for own, count in zip(particles, counts)]
    places = here.linker_places()._value
    np.testing.assert_allclose(places[0], [first[0][0], first[1][1]], atol=1e-6)
    np.testing.assert_allclose(places[1], [first[0][1], first[1][0]], atol=1e-6)
    assert np.all(here.linker_pulls().lengths > 0.0)


def test_a_context_by_default(tmp_path):
    """The platform of the tests, and growth that is asked of filaments without any."""
    filaments, system, positions = built(growing())
    context = new_context(system, positions, filaments.create_integrator(system, STEP, random_seed=1, checks=False))
    context.getIntegrator().step(10)
    assert filaments.in_context(context).growth().waited.sum() == 0
    still, system, positions = built(growing(0, still=1))
    with pytest.raises(InputError, match="No filaments grow"):
        still.in_context(in_context(still, system, positions)).growth()


def test_positions_of_another_length():
    """Segments of the present one have no place there."""
    filaments, system, positions = built(growing())
    context = in_context(filaments, system, positions)
    context.getIntegrator().step(100)
    context.setPositions(positions)
    with pytest.raises(InstabilityError, match="Positions of filaments that grow are those of a length"):
        context.getIntegrator().step(1)
