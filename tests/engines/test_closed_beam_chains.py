"""Rings of beam elements in the compiled engine: forces, steps, modes, equilibrium, diffusion, States and XML."""

import numpy as np
import openmm
import pytest

from openmm_cylchain.beams.curve import (
    BeamElement,
    curve_points,
    element_energies,
    element_slopes,
    place_weights,
)
from openmm_cylchain.beams.rings import circle
from openmm_cylchain.engines.compiled import CylinderChainForce
from openmm_cylchain.mechanics.geometry import unrolled
from support.beam_contexts import beam_context
from support.contexts import positions_of
from support.solvent import KT

PLATFORMS = ("Reference", "CPU")
SIGMAS = 4.0


def interleaved(nodes, control_points):
    """Particles (..., 2 n, 3) of nodes and control points, (..., n, 3) each."""
    both = np.stack([nodes, control_points], axis=-2)
    return both.reshape(*both.shape[:-3], -1, 3)


def rings(count, elements, element, friction=(1.0, 2.0), planar=False, fixed=(), start=None, propulsion=0.0):
    """A System of rings, circles but for ``start``, and positions; ``fixed`` are particles of each."""
    if start is None:
        start = interleaved(*circle(element, elements, np.zeros(3), np.array([0.0, 0.0, 1.0])))
    system, force = openmm.System(), CylinderChainForce()
    for ring in range(count):
        particles = range(2 * elements * ring, 2 * elements * (ring + 1))
        for particle in particles:
            system.addParticle(0.0 if particle - particles[0] in fixed else 1.0)
        parameters = element.length, element.modulus, element.rigidity, element.shortening
        chain = force.addBeamChain(list(particles), *parameters, *friction, planar, True)
        force.setBeamChainPropulsion(chain, propulsion)
    system.addForce(force)
    return system, force, np.tile(start, (count, 1))


def energies_of(positions, elements, element):
    """Stretching and bending energy of each ring."""
    particles = positions.reshape(-1, 2 * elements, 3)
    return [part.sum(axis=1) for part in element_energies(particles[:, ::2], particles[:, 1::2], element, True)]


def bent(elements, element, seed, scatter, planar=False):
    """Particles of a ring that is far from a circle."""
    start = interleaved(*circle(element, elements, np.zeros(3), np.array([0.0, 0.0, 1.0])))
    moves = np.random.default_rng(seed).normal(0.0, scatter * element.length, start.shape)
    return start + moves * [1.0, 1.0, 0.0 if planar else 1.0]


@pytest.mark.parametrize("platform", PLATFORMS)
@pytest.mark.parametrize("elements", [4, 7])
def test_forces_are_differences_of_the_energy(platform, elements):
    """Of all elements, the last one too, whose energy is that of ``element_energies``."""
    element = BeamElement(1.0, 20.0, 1e3, 0.01)
    system, _, positions = rings(3, elements, element, start=bent(elements, element, 1, 0.05))
    context = beam_context(system, positions, 0.01, platform=platform)
    state = context.getState(forces=True, energy=True)
    assert state.getPotentialEnergy()._value == pytest.approx(np.sum(energies_of(positions, elements, element)))
    forces, width = state.getForces(asNumpy=True)._value, 1e-5
    for particle in range(2 * elements):
        for axis in range(3):
            energies = []
            for sign in (1, -1):
                moved = positions[: 2 * elements].copy()
                moved[particle, axis] += sign * width
                energies.append(np.sum(energies_of(moved, elements, element)))
            slope = (energies[0] - energies[1]) / (2 * width)
            assert forces[particle, axis] == pytest.approx(-slope, rel=1e-5, abs=1e-4)
    assert forces.reshape(3, -1, 3)[:, :].sum(axis=1) == pytest.approx(np.zeros((3, 3)), abs=1e-8)


@pytest.mark.parametrize("elements", [4, 5, 8])
def test_rings_relax_to_circles(elements):
    """The energy of a circle, pi EI/R, and no other; R is (elements h)/2 pi within the error of cubic curves."""
    element = BeamElement(1.0, 20.0, 1e6)
    system, _, positions = rings(1, elements, element, start=bent(elements, element, 2, 0.1))
    context = beam_context(system, positions, 0.02, temperature=0.0)
    context.getIntegrator().step(3000)
    end = positions_of(context)
    stretching, bending = energies_of(end, elements, element)
    assert bending[0] == pytest.approx(2.0 * np.pi**2 * element.rigidity / elements, rel=1e-4)
    assert stretching[0] < 1e-4 * bending[0]
    points = curve_points(end[::2], end[1::2], 20, closed=True)
    radii = np.linalg.norm(points - points.mean(axis=0), axis=1)
    wrong = 0.018 * (4 / elements) ** 4
    assert radii == pytest.approx(np.full(len(radii), elements / (2.0 * np.pi)), rel=wrong)


def dense_resistance(particles, friction, length):
    """Z (6 n, 6 n) of positions P and control vectors Q-P, by Gauss points."""
    nodes, controls = unrolled(particles[::2]), unrolled(particles[1::2])
    elements = len(nodes) - 1
    places, weights = np.polynomial.legendre.leggauss(4)
    places, weights = 0.5 * (1.0 + places), 0.5 * weights * length
    slopes, values = element_slopes(nodes, controls, places, length), place_weights(places)
    matrix = np.zeros((2 * elements, 3, 2 * elements, 3))
    for element in range(elements):
        columns = (2 * element + np.arange(4)) % (2 * elements)
        for slope, value, weight in zip(slopes[element], values, weights):
            t = slope / np.linalg.norm(slope)
            own = friction[1] * np.eye(3) + (friction[0] - friction[1]) * np.outer(t, t)
            for a in range(4):
                for b in range(4):
                    matrix[columns[a], :, columns[b], :] += weight * value[a] * value[b] * own
    return matrix.reshape(6 * elements, 6 * elements)


@pytest.mark.parametrize("planar", [False, True])
def test_short_steps_are_those_of_the_dense_resistance(planar):
    """Without noise, nodes of a bent ring move at Z^-1 f; steps of 1e-7 of what a bend takes to relax."""
    elements, friction, element = 5, (1.0, 3.0), BeamElement(1.0, 20.0, 1e3)
    start = bent(elements, element, 3, 0.05, planar)
    system, _, positions = rings(1, elements, element, friction, planar, start=start)
    step = 1e-9
    context = beam_context(system, positions, step, temperature=0.0)
    forces = context.getState(forces=True).getForces(asNumpy=True)._value
    context.getIntegrator().step(1)
    velocities = (positions_of(context) - positions) / step
    # Forces that do work on P and Q - P.
    right = interleaved(forces[::2] + forces[1::2], forces[1::2])
    expected = np.linalg.solve(dense_resistance(start, friction, 1.0), right.ravel()).reshape(-1, 3)
    expected[1::2] += expected[::2]
    assert velocities == pytest.approx(expected, abs=1e-4 * np.abs(expected).max())


@pytest.mark.parametrize("case", ["free", "planar", "clamped", "hinged", "propelled"])
def test_it_does_not_matter_which_node_is_the_first(case):
    """Long steps of a bent ring, without noise: the same when nodes are counted from the next one.

    The clamped or hinged node is then the first one, which is in the equations twice.
    """
    elements, element = 6, BeamElement(1.0, 20.0, 1e4)
    start = bent(elements, element, 4, 0.05, case == "planar")
    fixed = {"clamped": (10, 11), "hinged": (10,)}.get(case, ())
    propulsion = 3.0 if case == "propelled" else 0.0
    ends = []
    for turn in (0, 2):
        turned = tuple((particle + turn) % (2 * elements) for particle in fixed)
        own = np.roll(start, turn, axis=0)
        system, force, positions = rings(1, elements, element, (1.0, 2.0), case == "planar", turned, own, propulsion)
        force.addTether(0, turn // 2, openmm.Vec3(*(start[0] + 0.5 * (case != "planar"))), 50.0)
        context = beam_context(system, positions, 0.05, temperature=0.0, platform="Reference")
        context.getIntegrator().step(4)
        ends.append(np.roll(positions_of(context), -turn, axis=0))
        assert np.array_equal(ends[-1][list(fixed)], start[list(fixed)])
    assert np.abs(ends[0] - start).max() > 0.05
    # As far as iterations go in solving the equations.
    assert ends[0] == pytest.approx(ends[1], abs=1e-10)


@pytest.mark.parametrize("across", [False, True])
@pytest.mark.parametrize(("mode", "elements", "allowed"), [(2, 12, 0.004), (3, 16, 0.004)])
def test_modes_relax_as_those_of_an_inextensible_ring(across, mode, elements, allowed):
    """EI (m^2-1)^2/(R^4 (zeta_n + zeta_t/m^2)) in the plane of the ring and EI m^2 (m^2-1)/(R^4 zeta_n) across it."""
    along, normal = 1.0, 2.0
    element = BeamElement(2.0 * np.pi / elements, 1.0, 1e6)
    nodes, controls = circle(element, elements, np.zeros(3), np.array([0.0, 0.0, 1.0]))
    angles = np.arctan2(nodes[:, 1], nodes[:, 0])[:, None]
    outwards, tangents = nodes / np.linalg.norm(nodes, axis=1, keepdims=True), 3.0 * (controls - nodes) / element.length
    axis, amplitude = np.array([0.0, 0.0, 1.0]), 0.01
    wave, slope = amplitude * np.cos(mode * angles), -amplitude * mode * np.sin(mode * angles)
    if across:
        rate = mode**2 * (mode**2 - 1) / normal
        nodes, tangents = nodes + wave * axis, tangents + slope * axis
    else:
        rate = (mode**2 - 1) ** 2 / (normal + along / mode**2)
        turn = slope / mode**2
        nodes, tangents = nodes + wave * outwards + turn * tangents, tangents + (slope - turn) * outwards
    tangents /= np.linalg.norm(tangents, axis=1, keepdims=True)
    start = interleaved(nodes, nodes + element.length / 3.0 * tangents)
    system, _, positions = rings(1, elements, element, (along, normal), start=start)
    step = 0.002 / rate
    context = beam_context(system, positions, step, temperature=0.0)

    def amplitude_now():
        particles = positions_of(context)
        points = curve_points(particles[::2], particles[1::2], 16, closed=True)
        values = points[:, 2] if across else np.linalg.norm(points[:, :2], axis=1)
        return 2.0 * np.mean(values * np.cos(mode * np.arctan2(points[:, 1], points[:, 0])))

    context.getIntegrator().step(50)
    before = amplitude_now()
    context.getIntegrator().step(300)
    assert before > 0.7 * amplitude
    assert np.log(before / amplitude_now()) / (300 * step) == pytest.approx(rate, rel=allowed)


def monte_carlo(count, elements, element, planar, leaps, samples, seed):
    """Energies (samples, 2, count) in k_B T of rings by hybrid Monte Carlo, with the measure of the particles."""
    system, _, positions = rings(count, elements, element, planar=planar)
    context = beam_context(system, positions, 1.0, platform="CPU")
    generator, free = np.random.default_rng(seed), np.array([1.0, 1.0, 0.0 if planar else 1.0])
    leap = 0.35 / np.sqrt(40.0 * element.modulus / KT)

    def pull(where):
        context.setPositions(where)
        return context.getState(forces=True).getForces(asNumpy=True)._value * (free / KT)

    def energy(where):
        return sum(energies_of(where, elements, element)) / KT

    def kinetic(velocities):
        return 0.5 * np.sum(velocities.reshape(count, -1) ** 2, axis=1)

    forces, now, found = pull(positions), energy(positions), []
    for _ in range(samples):
        velocities = generator.normal(size=positions.shape) * free
        moved, new, before = positions, forces, kinetic(velocities)
        for _ in range(leaps + generator.integers(leaps // 2)):
            velocities = velocities + 0.5 * leap * new
            moved = moved + leap * velocities
            new = pull(moved)
            velocities = velocities + 0.5 * leap * new
        proposed = energy(moved)
        change = proposed + kinetic(velocities) - now - before
        taken = generator.random(count) < np.exp(-np.maximum(change, 0.0))
        own = np.repeat(taken, 2 * elements)[:, None]
        positions, forces, now = (
            np.where(own, moved, positions),
            np.where(own, new, forces),
            np.where(taken, proposed, now),
        )
        found.append(np.array(energies_of(positions, elements, element)) / KT)
    return np.array(found)


@pytest.mark.parametrize(
    ("elements", "bend", "planar", "count", "leaps", "samples", "runs"),
    [
        (5, 0.1, False, 64, 250, 50, 300),
        pytest.param(5, 0.1, True, 128, 250, 60, 150, marks=pytest.mark.slow),
        pytest.param(6, 0.25, False, 128, 350, 36, 200, marks=pytest.mark.slow),
    ],
)
def test_equilibrium_is_that_of_monte_carlo(elements, bend, planar, count, leaps, samples, runs):
    """Energies of rings whose elements are ``bend`` persistence lengths long, at the recommended step.

    Bends have that of the circle, 2 pi^2 EI/L, and of what it fluctuates by, of which a twentieth must be seen.
    """
    element = BeamElement(1.0, KT / bend, 1e4 * KT)
    reference = monte_carlo(count, elements, element, planar, leaps, samples, 1)[samples // 4 :].mean(axis=0)
    system, _, positions = rings(count, elements, element, (KT, 2.0 * KT), planar)
    step = 2.0 * bend * min(0.0021 / bend, 2e-5 / bend**3)
    relaxation = 2.0 * bend * (elements / 10.9) ** 4
    context = beam_context(system, positions, step)
    context.getIntegrator().step(int(5.0 * relaxation / step) + 10)
    found = []
    for _ in range(runs):
        context.getIntegrator().step(int(np.ceil(0.3 * relaxation / step)))
        found.append(np.array(energies_of(positions_of(context), elements, element)) / KT)
    values = np.mean(found, axis=0)
    # Strains are two for each element, stiff ones.
    fluctuation = reference[1].mean() - 2.0 * np.pi**2 / (elements * bend)
    for own, expected, part in (
        (values[0], np.array([elements]), elements),
        (values[1], reference[1], fluctuation),
    ):
        spread = expected.var(ddof=1) if len(expected) > 1 else 0.0
        error = np.sqrt((own.var(ddof=1) + spread) / count)
        assert error < 0.0125 * part
        assert abs(own.mean() - expected.mean()) < SIGMAS * error


@pytest.mark.parametrize("planar", [False, True])
def test_rings_diffuse_as_wholes(planar):
    """The middle of the curve diffuses by k_B T/zeta L along an axis, whatever the shape, if friction is isotropic.

    Stiff rings in a plane have the mean of both frictions.
    """
    count, elements, steps = 64, 5, 150
    friction = np.array([KT, 3.0 * KT] if planar else [2.0 * KT, 2.0 * KT])
    element = BeamElement(1.0, (1e4 if planar else 10.0) * KT, 1e5 * KT)
    system, _, positions = rings(count, elements, element, friction, planar)
    step = 0.005
    context = beam_context(system, positions, step)
    nodes, weights = np.polynomial.legendre.leggauss(4)
    middle = 0.5 * weights @ place_weights(0.5 * (1.0 + nodes))

    def middles():
        particles = positions_of(context).reshape(count, 2 * elements, 3)
        vectors = particles[:, 1::2] - particles[:, ::2]
        # Of the whole curve; those of control vectors of neighbours take each other away.
        assert middle[1] == pytest.approx(-middle[3])
        return np.mean(particles[:, ::2], axis=1) + np.mean((middle[1] + middle[3]) * vectors, axis=1)

    moves, before = [], middles()
    for _ in range(steps):
        context.getIntegrator().step(1)
        after = middles()
        moves.append((after - before)[:, : 2 if planar else 3])
        before = after
    moves = np.array(moves)
    expected = 2.0 * KT * step / (friction.mean() * elements)
    error = np.sqrt(2.0 / moves.size)
    assert error < 0.0125
    assert np.mean(moves**2) == pytest.approx(expected, rel=SIGMAS * error)
    whole = moves.sum(axis=0)
    error = np.sqrt(2.0 / whole.size)
    assert np.mean(whole**2) == pytest.approx(steps * expected, rel=SIGMAS * error)


def test_steps_are_the_same_on_platforms_and_from_checkpoints_and_xml():
    """With open chains of as many places beside the rings, and rings of other lengths."""
    element = BeamElement(1.0, 20.0 * KT, 1e4 * KT)
    system, force, positions = rings(9, 5, element, (KT, 2 * KT))
    for _ in range(5):
        chain = [system.addParticle(1.0) for _ in range(12)]
        force.addBeamChain(chain, 1.0, 1e4 * KT, 20.0 * KT, 0.0, KT, 2 * KT)
        nodes = np.arange(6.0)[:, None] * np.array([1.0, 0.0, 0.0])
        positions = np.concatenate([positions, interleaved(nodes, nodes + [1.0 / 3.0, 0.0, 0.0])])
    copied = openmm.XmlSerializer.deserialize(openmm.XmlSerializer.serialize(system))
    own = CylinderChainForce.cast(copied.getForce(0))
    assert [own.isChainClosed(chain) for chain in range(14)] == [True] * 9 + [False] * 5
    ends = []
    for platform, each in (("Reference", system), ("CPU", system), ("CPU", copied)):
        context = beam_context(each, positions, 1e-3, platform=platform)
        context.getIntegrator().step(20)
        checkpoint = context.createCheckpoint()
        context.getIntegrator().step(10)
        ends.append(positions_of(context))
        context.loadCheckpoint(checkpoint)
        context.getIntegrator().step(10)
        assert np.array_equal(positions_of(context), ends[-1])
    assert np.allclose(ends[0], ends[1], rtol=0, atol=1e-11)
    assert np.array_equal(ends[1], ends[2])
    # Each ring as if it were alone.
    alone, _, start = rings(1, 5, element, (KT, 2 * KT))
    context = beam_context(alone, start, 1e-3, platform="CPU")
    context.getIntegrator().step(30)
    assert positions_of(context) == pytest.approx(ends[1][:10], abs=1e-11)


def test_divided_steps_keep_rings_whole():
    element = BeamElement(1.0, 2.0 * KT, 1e4 * KT)
    system, _, positions = rings(32, 6, element, (KT, 2 * KT))
    context = beam_context(system, positions, 0.02)
    context.getIntegrator().step(100)
    assert context.getIntegrator().getNumDividedSteps() > 0
    particles = positions_of(context).reshape(32, 12, 3)
    chords = np.linalg.norm(np.roll(particles[:, ::2], -1, axis=1) - particles[:, ::2], axis=2)
    assert np.all((chords > 0.5) & (chords < 1.1))


def test_rings_that_cannot_be():
    force = CylinderChainForce()
    with pytest.raises(openmm.OpenMMException, match="at least three nodes"):
        force.addBeamChain([0, 1, 2, 3], 1.0, 1e3, 20.0, 0.0, 1.0, 2.0, False, True)
