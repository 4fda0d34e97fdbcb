"""Closed filaments: how they are built, their mechanics against dense matrices, and their equilibrium."""

import mdtraj
import numpy as np
import openmm
import pytest
from openmm import app, unit
from scipy.integrate import simpson
from scipy.spatial.transform import Rotation

from openmm_cylchain import F_ACTIN, Filaments, InputError, analysis
from openmm_cylchain.filaments.equilibrium import SegmentLengthDistribution
from openmm_cylchain.mechanics import redistribution
from openmm_cylchain.output.reporters import FilamentReporter
from support.contexts import forces_of, new_context, new_simulation, positions_of
from support.dense_mechanics import bent_chain, dense_resistance
from support.equilibrium_cases import Case as EquilibriumCase
from support.equilibrium_cases import soft_chain, time_step
from support.noise_covariance import assert_covariance, moves_of_a_step
from support.platforms import ENGINES, ENGINES_PORTABLE_SLOW, EVERYWHERE
from support.solvent import KT, TEMPERATURE, VISCOSITY

FRICTION = F_ACTIN.segment_friction(VISCOSITY, TEMPERATURE)
SIGMAS = 4.0


def _polygon(segments, generator, scatter=30.0):
    angles = 2 * np.pi * np.arange(segments) / segments
    radius = 180 / np.sin(np.pi / segments)
    nodes = radius * np.stack([np.cos(angles), np.sin(angles), np.zeros(segments)], axis=1)
    return nodes + generator.normal(scale=scatter, size=nodes.shape)


# How they are built


@pytest.mark.parametrize("segments", [4, 5, 32])
def test_ring_is_a_regular_polygon(segments):
    filaments = Filaments(VISCOSITY, TEMPERATURE, engine="portable")
    number = filaments.add_ring(F_ACTIN, segments, [1, 2, 3] * unit.micrometer, [1, -2, 2])
    nodes = filaments[number].positions
    assert nodes.shape == (segments, 3) and filaments[number].segments == segments
    vectors = np.roll(nodes, -1, axis=0) - nodes
    assert np.linalg.norm(vectors, axis=1) == pytest.approx(360)
    assert nodes.mean(axis=0) == pytest.approx([1000, 2000, 3000])
    turns = np.cross(np.roll(vectors, 1, axis=0), vectors)
    assert turns / np.linalg.norm(turns, axis=1)[:, None] == pytest.approx(
        np.tile([1 / 3, -2 / 3, 2 / 3], (segments, 1))
    )
    assert np.einsum("ij,ij->i", vectors, np.roll(vectors, 1, axis=0)) == pytest.approx(
        360**2 * np.cos(2 * np.pi / segments), abs=1e-6
    )


@pytest.mark.parametrize("engine", ENGINES)
def test_particles_bonds_and_points_of_a_ring(engine, tmp_path):
    filaments = Filaments(VISCOSITY, TEMPERATURE, engine=engine)
    filaments.add_ring(F_ACTIN, 5, [0, 0, 0])
    filaments.add_straight(F_ACTIN, 2, [0, 0, 0], [1, 0, 0])
    filaments.add_attachment(0, segment=-1, fraction=0.25)
    filaments.add_attachment(0, arc_length=4.5 * 360)
    with pytest.raises(InputError, match="the filament is 1800 nm long"):
        filaments.add_attachment(0, arc_length=1801)
    topology, system, positions = filaments.build()
    bonds = {tuple(sorted(atom.index for atom in bond)) for bond in topology.bonds()}
    assert bonds == {(0, 1), (1, 2), (2, 3), (3, 4), (0, 4), (7, 8), (8, 9)}
    masses = [system.getParticleMass(node)._value for node in (*range(5), 7, 8, 9)]
    assert masses == pytest.approx([1.26e6] * 5 + [0.63e6, 1.26e6, 0.63e6])
    nodes = positions._value
    assert nodes[5] == pytest.approx(0.75 * nodes[4] + 0.25 * nodes[0])
    assert nodes[6] == pytest.approx(0.5 * nodes[4] + 0.5 * nodes[0])
    context = new_context(system, positions, filaments.create_integrator(system, 1.0, random_seed=1))
    context.getIntegrator().step(3)
    after = positions_of(context)
    assert after[5] == pytest.approx(0.75 * after[4] + 0.25 * after[0], abs=1e-9)
    with open(tmp_path / "ring.cif", "w") as file:
        app.PDBxFile.writeFile(topology, positions, file, keepIds=True)
    assert mdtraj.load(str(tmp_path / "ring.cif")).topology.n_bonds == 7


def test_analysis_knows_rings_by_their_bonds(tmp_path):
    filaments = Filaments(VISCOSITY, TEMPERATURE, engine="portable")
    nodes = _polygon(6, np.random.default_rng(1))
    filaments.add_straight(F_ACTIN, 3, [0, 0, 0], [1, 0, 0])
    filaments.add_nodes(F_ACTIN, nodes, closed=True)
    topology, _, positions = filaments.build()
    with open(tmp_path / "ring.cif", "w") as file:
        app.PDBxFile.writeFile(topology, positions, file, keepIds=True)
    trajectory = mdtraj.load(str(tmp_path / "ring.cif"))
    assert analysis.ring_filaments(trajectory).tolist() == [False, True]
    vectors = np.roll(nodes, -1, axis=0) - nodes
    lengths = np.linalg.norm(vectors, axis=1)
    tangents = vectors / lengths[:, None]
    assert analysis.segment_lengths(trajectory)[1][0] == pytest.approx(lengths, rel=1e-4)
    assert analysis.segment_lengths(trajectory)[0][0] == pytest.approx([360] * 3, rel=1e-4)
    assert analysis.contour_lengths(trajectory)[0] == pytest.approx([1080, lengths.sum()], rel=1e-4)
    cosines = np.einsum("ij,ij->i", np.roll(tangents, 1, axis=0), tangents)
    assert analysis.joint_cosines(trajectory, 1)[0][0] == pytest.approx(cosines, abs=1e-4)
    assert analysis.centers_of_mass(trajectory, [1, 0])[0] == pytest.approx(
        np.array([nodes.mean(axis=0), [540, 0, 0]]), abs=0.01
    )
    assert analysis.end_to_end_vectors(trajectory, 0)[0, 0] == pytest.approx([1080, 0, 0], abs=0.01)
    for function in (analysis.end_to_end_vectors, analysis.tangent_correlation, analysis.persistence_length):
        with pytest.raises(InputError, match="Filament 1 is a ring"):
            function(trajectory)
    with pytest.raises(InputError, match="Filament 1 is a ring, which has no bending modes"):
        analysis.bending_mode_amplitudes(trajectory, 1, [1])


@pytest.mark.parametrize("engine", ENGINES)
def test_reporter_and_forces_know_the_last_segment(engine):
    """Energies against a sum over all segments and joints, forces against their differences."""
    generator = np.random.default_rng(8)
    nodes = _polygon(6, generator)
    filaments = Filaments(VISCOSITY, TEMPERATURE, engine=engine)
    filaments.add_nodes(F_ACTIN, nodes, closed=True)

    def energies(flat):
        x = flat.reshape(-1, 3)
        lengths = [np.linalg.norm(x[(i + 1) % 6] - x[i]) for i in range(6)]
        tangents = [(x[(i + 1) % 6] - x[i]) / lengths[i] for i in range(6)]
        bending = sum(F_ACTIN.bending_energy(tangents[i - 1] @ tangents[i]) for i in range(6))
        return sum(F_ACTIN.stretching_energy(length) for length in lengths), bending, sum(lengths)

    topology, system, positions = filaments.build()
    integrator = filaments.create_integrator(system, 1e-6, temperature=0)
    simulation = new_simulation(topology, system, positions, integrator)
    state = simulation.context.getState(energy=True, forces=True)
    stretching, bending, contour = energies(nodes.reshape(-1))
    assert state.getPotentialEnergy()._value == pytest.approx(stretching + bending, rel=1e-9)
    forces = state.getForces(asNumpy=True)._value.reshape(-1)
    for index in range(18):
        shift = 1e-3 * np.eye(18)[index]
        difference = sum(energies(nodes.reshape(-1) - shift)[:2]) - sum(energies(nodes.reshape(-1) + shift)[:2])
        assert forces[index] == pytest.approx(difference / 2e-3, rel=1e-4, abs=1e-4 * np.abs(forces).max())
    reporter = FilamentReporter(None, 1, filaments)
    simulation.reporters.append(reporter)
    simulation.step(1)
    assert reporter["stretching_energy"][0, 0] == pytest.approx(stretching, rel=1e-4)
    assert reporter["bending_energy"][0, 0] == pytest.approx(bending, rel=1e-4)
    assert reporter["contour_length"][0, 0] == pytest.approx(contour, rel=1e-6)
    assert reporter["end_to_end_distance"][0, 0] == 0.0


def test_bad_rings_are_refused():
    filaments = Filaments(VISCOSITY, TEMPERATURE, engine="portable")
    square = np.array([[0, 0, 0], [360, 0, 0], [360, 360, 0], [0, 360, 0.0]])
    stiff = F_ACTIN
    folded = np.array([[0, 0, 0], [360, 0, 0], [360, 360, 0], [720, 0, 0.0], [360, 0, 0.1]])
    folded[4] = [180, 0, 0]  # Segment 4 goes on from 180 to 0 and the first one back.
    for add, message in (
        (lambda: filaments.add_ring(F_ACTIN, 3, [0, 0, 0]), "a ring needs at least 4 segments, but has 3"),
        (lambda: filaments.add_ring(F_ACTIN, 4.5, [0, 0, 0]), "segments must be a whole number"),
        (lambda: filaments.add_ring(F_ACTIN, 5, [0, 0]), "center must have three components"),
        (lambda: filaments.add_ring(F_ACTIN, 5, [0, 0, np.nan]), "center must be finite"),
        (lambda: filaments.add_ring(F_ACTIN, 5, [0, 0, 0] * unit.kelvin), "center has the unit"),
        (lambda: filaments.add_ring(F_ACTIN, 5, [0, 0, 0], [0, 0, 0]), "normal must not be the zero vector"),
        (lambda: filaments.add_ring(F_ACTIN, 5, [0, 0, 0], clamped=[5]), "node 5 does not exist; there are 5 nodes"),
        (lambda: filaments.add_ring(F_ACTIN, 4, [0, 0, 0], clamped=range(4)), "all of its nodes clamped"),
        (lambda: filaments.add_nodes(F_ACTIN, square[:3], closed=True), "a ring needs at least 4 segments"),
        (lambda: filaments.add_nodes(F_ACTIN, square, closed=1), "closed must be True or False"),
        (lambda: filaments.add_nodes(F_ACTIN, square[[0, 1, 2, 3, 0]], closed=True), "nodes 4 and 0 coincide"),
        (lambda: filaments.add_nodes(stiff, folded, closed=True), "after node 0 are antiparallel"),
    ):
        with pytest.raises(InputError, match=message):
            add()
    assert len(filaments) == 0


# Mechanics against dense matrices


def _chain_set(counts, closed, fixed=()):
    segments = sum(count - (not ring) for count, ring in zip(counts, closed))
    mask = np.zeros(sum(counts), dtype=bool)
    mask[list(fixed)] = True
    names = ("parallel", "perpendicular", "rotational", "extensional")
    return redistribution.ChainSet(
        node_counts=np.array(counts),
        fixed=mask,
        closed=np.array(closed),
        **{name: np.full(segments, getattr(FRICTION, name)) for name in names},
    )


@pytest.mark.parametrize("fixed", [(), (0,), (3, 4), (3, 8), (11, 12, 13)])
@pytest.mark.parametrize(
    ("counts", "closed"),
    [
        ((4, 5, 6, 7), (True, True, True, True)),
        ((5, 3, 8, 2, 64), (True, False, True, False, True)),
        ((9, 33), (False, True)),
    ],
)
def test_redistribution_equals_dense_solution(counts, closed, fixed):
    chains = _chain_set(counts, closed, fixed)
    generator = np.random.default_rng(1)
    shapes = [_polygon(n, generator) if ring else bent_chain(F_ACTIN, n - 1, n) for n, ring in zip(counts, closed)]
    nodes = np.concatenate(shapes)
    forces = generator.normal(size=nodes.shape)
    velocities = redistribution.redistribute(chains, nodes, forces)
    start = 0
    for shape, ring in zip(shapes, closed):
        mine = slice(start, start + len(shape))
        resistance = dense_resistance(shape, FRICTION, ring)
        free = np.repeat(~chains.fixed[mine], 3)
        expected = np.zeros(3 * len(shape))
        expected[free] = np.linalg.solve(resistance[np.ix_(free, free)], forces[mine].reshape(-1)[free])
        assert np.abs(velocities[mine].reshape(-1) - expected).max() < 1e-10 * np.abs(expected).max()
        start += len(shape)


def test_open_chains_have_the_narrow_band():
    assert redistribution.resistance_bands(_chain_set((6,), (False,)), bent_chain(F_ACTIN, 5, 1)).shape == (6, 18)
    ring = _polygon(6, np.random.default_rng(1))
    assert redistribution.resistance_bands(_chain_set((6,), (True,)), ring).shape == (9, 18)


@pytest.fixture(scope="module", params=ENGINES)
def mixed_system(request):
    """Rings and an open chain in one System, with forces on all nodes."""
    generator = np.random.default_rng(4)
    filaments = Filaments(VISCOSITY, TEMPERATURE, engine=request.param)
    filaments.add_nodes(F_ACTIN, _polygon(9, generator), closed=True)
    filaments.add_nodes(F_ACTIN, bent_chain(F_ACTIN, 4, 2))
    filaments.add_nodes(F_ACTIN, _polygon(6, generator), clamped=[1, 2], closed=True)
    _, system, positions = filaments.build()
    pull = openmm.CustomExternalForce("-(fx*x+fy*y+fz*z)")
    for name in ("fx", "fy", "fz"):
        pull.addPerParticleParameter(name)
    for particle in range(system.getNumParticles()):
        pull.addParticle(particle, 5 * generator.normal(size=3))
    system.addForce(pull)
    return filaments, system, positions


def _dense_velocities(filament, nodes, forces):
    free = np.ones(nodes.shape, dtype=bool)
    free[list(filament.clamped)] = False
    free = free.reshape(-1)
    resistance = dense_resistance(nodes, FRICTION, filament.closed)
    velocities = np.zeros(nodes.size)
    velocities[free] = np.linalg.solve(resistance[np.ix_(free, free)], forces.reshape(-1)[free])
    return velocities.reshape(-1, 3)


@pytest.mark.parametrize("scheme", ["euler", "midpoint"])
def test_a_step_equals_the_dense_solution(mixed_system, scheme):
    filaments, system, positions = mixed_system
    step = 1000.0
    context = new_context(system, positions, filaments.create_integrator(system, step, scheme=scheme, temperature=0))
    start = positions_of(context)
    forces = forces_of(context)
    context.getIntegrator().step(1)
    moved = positions_of(context) - start
    for filament, indices in zip(filaments, filaments.node_indices):
        nodes = start[indices]
        if scheme == "midpoint":
            nodes = nodes + 0.5 * step * _dense_velocities(filament, nodes, forces[indices])
        expected = step * _dense_velocities(filament, nodes, forces[indices])
        assert np.abs(moved[indices] - expected).max() < 1e-10 * np.abs(expected).max()


def test_joint_tensions_balance_every_segment(mixed_system):
    """Drag of each segment = its own and the external forces, and those of its two neighbours."""
    filaments, system, positions = mixed_system
    context = new_context(system, positions, filaments.create_integrator(system, 1.0, temperature=0))
    start = positions_of(context)
    forces = forces_of(context)
    tensions = filaments.in_context(context).joint_tensions()
    assert [phi.shape for phi in tensions] == [(9, 3), (3, 3), (6, 3)]
    for number in (0, 2):
        filament, indices = filaments[number], filaments.node_indices[number]
        nodes, phi = start[indices], tensions[number]._value
        velocities = _dense_velocities(filament, nodes, forces[indices])
        own = _own_forces(filament, nodes)
        external = forces[indices] - own[:, :3] - np.roll(own[:, 3:], 1, axis=0)
        for segment in range(len(nodes)):
            ends = [segment, (segment + 1) % len(nodes)]
            if set(ends) & set(filament.clamped):
                continue
            drag = dense_resistance(nodes[ends], FRICTION) @ velocities[ends].reshape(-1)
            applied = (
                own[segment] + 0.5 * external[ends].reshape(-1) + np.concatenate([-phi[segment - 1], phi[segment]])
            )
            assert np.abs(drag - applied).max() < 1e-9 * np.abs(phi).max()


def _own_forces(filament, nodes):
    # Stretching and bending on both ends of every segment: (segments, 6), bending as torques around its middle.
    kind, count = filament.type, len(nodes)
    vectors = np.roll(nodes, -1, axis=0) - nodes
    lengths = np.linalg.norm(vectors, axis=1)
    tangents = vectors / lengths[:, None]
    plus = -(kind.stretching_derivative(lengths))[:, None] * tangents
    for joint, stiffness in enumerate(filament.joint_stiffnesses):
        cosine = tangents[joint - 1] @ tangents[joint]
        slope = float(kind.bending_derivative(cosine, stiffness))
        for one, other in ((joint - 1, joint), (joint, joint - 1)):
            plus[one] -= slope * (tangents[other] - cosine * tangents[one]) / lengths[one]
    assert count == len(plus)
    return np.concatenate([-plus, plus], axis=1)


@pytest.mark.parametrize("engine", ENGINES)
def test_noise_covariance(engine):
    """Cov(dx) = 2 k_B T dt Z^-1 between all nodes of a ring."""
    nodes = _polygon(4, np.random.default_rng(2))
    copies, draws = 1000, 24
    filaments = Filaments(VISCOSITY, TEMPERATURE, engine=engine)
    for _ in range(copies):
        filaments.add_nodes(F_ACTIN, nodes, closed=True)
    step = 1.0
    moves = moves_of_a_step(filaments, step, draws).reshape(-1, 12)
    expected = 2 * KT * step * np.linalg.inv(dense_resistance(nodes, FRICTION, True))
    assert_covariance(moves, expected)


# Equilibrium


def _observables(kind, nodes):
    vectors = np.roll(nodes, -1, axis=1) - nodes
    lengths = np.linalg.norm(vectors, axis=2)
    tangents = vectors / lengths[..., None]
    cosines = np.einsum("ijk,ijk->ij", tangents, np.roll(tangents, 1, axis=1))
    across = np.roll(nodes, -(nodes.shape[1] // 2), axis=1) - nodes
    return {
        "stretching energy": kind.stretching_energy(lengths).mean(axis=1) / KT,
        "bending energy": kind.bending_energy(cosines).mean(axis=1) / KT,
        "squared distance across": np.sum(across**2, axis=2).mean(axis=1),
        "squared radius of gyration": np.var(nodes, axis=1).sum(axis=1),
    }


def _metropolis(kind, segments, copies, sweeps, seed):
    """Rings drawn by moves of single nodes and by turning nodes around the line between the two beside them.

    Returns their last configurations, and averages of the last half of the sweeps for each of them.
    """
    generator = np.random.default_rng(seed)
    nodes = np.tile(_polygon(segments, generator, scatter=0) * kind.segment_length / 360, (copies, 1, 1))

    def energy(rings):
        vectors = np.roll(rings, -1, axis=1) - rings
        lengths = np.linalg.norm(vectors, axis=2)
        tangents = vectors / lengths[..., None]
        cosines = np.einsum("ijk,ijk->ij", tangents, np.roll(tangents, 1, axis=1))
        return kind.stretching_energy(lengths).sum(axis=1) + kind.bending_energy(cosines).sum(axis=1)

    present = energy(nodes)
    samples = []
    for sweep in range(sweeps):
        for first in range(segments):
            for turning in (False, True):
                trial = nodes.copy()
                if turning:
                    length = generator.integers(2, segments - 1)
                    between = (first + np.arange(1, length)) % segments
                    axis = Rotation.from_rotvec(
                        _turns(generator, nodes[:, first], nodes[:, (first + length) % segments])
                    )
                    for node in between:
                        trial[:, node] = nodes[:, first] + axis.apply(nodes[:, node] - nodes[:, first])
                else:
                    trial[:, first] += generator.normal(scale=0.1 * kind.segment_length, size=(copies, 3))
                proposed = energy(trial)
                accepted = generator.random(copies) < np.exp(np.minimum(0, (present - proposed) / KT))
                nodes[accepted], present[accepted] = trial[accepted], proposed[accepted]
        if sweep >= sweeps // 2:
            samples.append(_observables(kind, nodes))
    return nodes, {name: np.mean([one[name] for one in samples], axis=0) for name in samples[0]}


def _turns(generator, start, end):
    axis = end - start
    return axis * (generator.uniform(-np.pi, np.pi, len(axis)) / np.linalg.norm(axis, axis=1))[:, None]


def _simulated(engine, kind, shapes, steps):
    filaments = Filaments(VISCOSITY, TEMPERATURE, engine=engine)
    for nodes in shapes:
        filaments.add_nodes(kind, nodes, closed=True)
    _, system, positions = filaments.build()
    step = time_step(EquilibriumCase(kind, shapes.shape[1], len(shapes), steps, 0.01))
    integrator = filaments.create_integrator(system, step, scheme="midpoint", random_seed=6)
    context = new_context(system, positions, integrator)
    integrator.step(steps // 4)
    samples = []
    for _ in range(30):
        integrator.step(steps // 40)
        samples.append(_observables(kind, positions_of(context).reshape(shapes.shape)))
    return {name: np.mean([one[name] for one in samples], axis=0) for name in samples[0]}


def _mean(values):
    return values.mean(), values.std(ddof=1) / np.sqrt(len(values))


@pytest.mark.parametrize("engine", ENGINES_PORTABLE_SLOW)
def test_equilibrium_of_stiff_rings_equals_monte_carlo(engine):
    kind = soft_chain("RING", bending_rigidity=2 * KT * 100)
    shapes, expected = _metropolis(kind, 6, 800, 80, seed=7)
    measured = _simulated(engine, kind, shapes, 600)
    for name in expected:
        exact, exact_error = _mean(expected[name])
        mean, error = _mean(measured[name])
        error = np.hypot(error, exact_error)
        # An explicit scheme of weak order one, at a hundredth of the stability bound, is off by up to 1 %.
        assert abs(mean - exact) < SIGMAS * error + 0.01 * exact * name.endswith("energy"), name
        assert 0.05 * exact > SIGMAS * error, name


def _freely_jointed_ring(kind, segments):
    """Exact averages: a segment and the rest of the ring, or its two halves, are chains that meet at both ends.

    The end-to-end vector of n segments has the density P_n(r) = int q sin(qr) f(q)^n dq/(2 pi^2 r), with the mean
    f(q) of sin(ql)/(ql) over the lengths of a segment.
    """
    length = kind.segment_length
    lengths = SegmentLengthDistribution(kind, TEMPERATURE)
    wave = np.linspace(1e-6, 80.0, 2001) / length
    factor = np.array([lengths.mean(lambda value, q=q: np.sinc(q * value / np.pi)) for q in wave])
    r = np.linspace(1e-3, 1.0, 1200) * length * (0.5 * segments + 1)

    def density(count):
        return simpson(wave * np.sin(np.outer(r, wave)) * factor**count, x=wave, axis=1) / r

    halves = density(segments // 2) * density(segments - segments // 2) * r**2
    bond = r**2 * np.exp(-kind.stretching_energy(r) / KT) * density(segments - 1)
    return {
        "squared distance across": simpson(halves * r**2, x=r) / simpson(halves, x=r),
        "stretching energy": simpson(bond * kind.stretching_energy(r), x=r) / simpson(bond, x=r) / KT,
    }


def _check_freely_jointed_rings(engine, segments, copies, steps):
    kind = soft_chain("FJR", bending_rigidity=0.0)
    shapes, drawn = _metropolis(kind, segments, copies, 60, seed=9)
    expected = _freely_jointed_ring(kind, segments)
    measured = _simulated(engine, kind, shapes, steps)
    for name, exact in expected.items():
        for values in (drawn[name], measured[name]):
            mean, error = _mean(values)
            assert abs(mean - exact) < SIGMAS * error + 0.01 * exact * name.endswith("energy"), name
            assert 0.05 * exact > SIGMAS * error, name


@pytest.mark.parametrize("engine", ENGINES_PORTABLE_SLOW)
def test_equilibrium_of_freely_jointed_rings_is_exact(engine):
    _check_freely_jointed_rings(engine, 4, 1200, 600)


@pytest.mark.sample("compiled")
@pytest.mark.slow
@pytest.mark.parametrize("engine", ENGINES)
def test_equilibrium_of_longer_freely_jointed_rings_is_exact(engine):
    _check_freely_jointed_rings(engine, 9, 1500, 2000)


@pytest.mark.parametrize(("engine", "platform"), EVERYWHERE)
def test_rings_run_on_every_platform(engine, platform):
    """A few steps with noise: the same on all platforms, to their precision."""
    ends = []
    for where in ("Reference", platform):
        filaments = Filaments(VISCOSITY, TEMPERATURE, engine=engine)
        filaments.add_ring(F_ACTIN, 12, [0, 0, 0], [1, 1, 1])
        filaments.add_equilibrium(F_ACTIN, 5, seed=1)
        _, system, positions = filaments.build()
        integrator = filaments.create_integrator(system, 5e3, random_seed=3)
        context = new_context(system, positions, integrator, where)
        integrator.step(20)
        ends.append(positions_of(context))
    assert np.abs(ends[1] - ends[0]).max() < 0.05
    assert np.abs(ends[0] - positions._value).max() > 1.0
