"""Beam elements in a flow of the solvent: how they drift, turn, bend, are pulled, and tumble with noise."""

from dataclasses import replace

import numpy as np
import pytest
from scipy.integrate import solve_ivp

from openmm_cylchain import Crosslinks, Filaments, Flow
from openmm_cylchain.beams.curve import arc_lengths, curve_points
from support.contexts import new_context, positions_of
from support.linked_beams import BEAM, LENGTH
from support.solvent import KT, TEMPERATURE, VISCOSITY

SIGMAS = 4.0
RATE = 1e-9  # 1/ps, a thousand per second
GENERAL = Flow(
    velocity=[1e-6, -2e-6, 5e-7],
    gradient=RATE * np.array([[1.0, 2.0, -1.0], [0.5, -3.0, 0.7], [1.2, -0.4, 2.0]]),
    origin=[100, 0, -50],
)
STIFF = replace(BEAM, persistence_length=None, bending_rigidity=1e8 * KT)


def _carried(filaments, flow, step, steps, platform="Reference", couple=None, box_vectors=None):
    _, system, positions = filaments.build(box_vectors=box_vectors)
    if couple is not None:
        couple(filaments, system)
    integrator = filaments.create_integrator(system, step, flow=flow, random_seed=1, checks=False)
    context = new_context(system, positions, integrator, platform)
    start = positions_of(context)
    integrator.step(steps)
    return start, positions_of(context)


def _friction(kind, elements):
    """Along and across, per length."""
    own = kind.segment_friction(VISCOSITY, TEMPERATURE, elements)
    return own.parallel / kind.segment_length, own.perpendicular / kind.segment_length


def _add_link(filaments, system):
    links = Crosslinks(0.5, 0.0)
    links.add(None, *(filaments.segment_place(number, arc_length=0.3 * LENGTH) for number in (0, 1)))
    links.add_to(system)


@pytest.mark.parametrize("platform", ["Reference", "CPU"])
@pytest.mark.parametrize("couple", [None, _add_link])
def test_a_uniform_flow_carries_them_along(platform, couple):
    """Otherwise they move as at rest, with noise, whether a link joins them or not; through a periodic box."""
    ends = []
    for flow in (Flow(), Flow.uniform([3e-5, 2e-5, -1e-5])):
        filaments = Filaments(VISCOSITY, TEMPERATURE, engine="compiled")
        filaments.add_straight(BEAM, 3, [100, 0, 50], [1, 1, 0])
        filaments.add_straight(BEAM, 2, [100, 0, 90], [1, -1, 0])
        start, end = _carried(filaments, flow, 1e7, 10, platform, couple, 5000.0 * np.eye(3))
        ends.append(end)
    assert np.abs(ends[0] - start).max() > 10.0
    np.testing.assert_allclose(ends[1] - ends[0], np.tile([3000.0, 2000.0, -1000.0], (len(start), 1)), rtol=1e-6)


def _slope(_, state):
    # Of the direction of a slender rod, and of its middle.
    gradient, tangent, middle = np.array(GENERAL.gradient), state[:3], state[3:]
    turn = gradient @ tangent
    drift = GENERAL.velocity + gradient @ (middle - GENERAL.origin)
    return np.concatenate([turn - (tangent @ turn) * tangent, drift])


def test_a_rod_turns_with_the_flow():
    """t' = (1 - tt) G t, and its middle follows u: in steps that strain the solvent by 0.03, to second order."""
    errors = []
    for share in (1, 2):
        filaments = Filaments(VISCOSITY, 0, engine="compiled")
        filaments.add_straight(STIFF, 2, [100, 200, 300], [0.8, 0.5, -0.33])
        step, steps = 1e7 / share, 60 * share
        start, end = _carried(filaments, GENERAL, step, steps)
        nodes = filaments.node_indices[0]
        length = np.linalg.norm(start[nodes[-1]] - start[nodes[0]])
        first = np.concatenate([(start[nodes[-1]] - start[nodes[0]]) / length, start[nodes[1]]])
        last = solve_ivp(_slope, (0, step * steps), first, rtol=1e-10, atol=1e-10).y[:, -1]
        tangent = (end[nodes[-1]] - end[nodes[0]]) / np.linalg.norm(end[nodes[-1]] - end[nodes[0]])
        assert np.abs(last[:3] - first[:3]).max() > 0.3
        errors.append(
            [np.abs(tangent - last[:3]).max(), np.abs(end[nodes[1]] - last[3:]).max() / np.abs(last[3:]).max()]
        )
    assert np.max(errors[0]) < 2e-3
    assert np.max(np.divide(errors[1], errors[0])) < 0.35


@pytest.mark.parametrize("elements", [1, 3])
def test_an_extensional_flow_pulls_a_rod(elements):
    """Its tension is zeta rate (L^2/4 - s^2)/2 at the distance s from its middle."""
    kind = replace(STIFF, stretching_modulus=1e4)
    filaments = Filaments(VISCOSITY, 0, engine="compiled")
    filaments.add_straight(kind, elements, [-0.5 * elements * LENGTH, 0, 0], [1, 0, 0])
    rate = 1e-7
    _, end = _carried(filaments, Flow.extension(rate), 1e4, 400)
    along, _ = _friction(kind, elements)
    lengths = arc_lengths(end[filaments.node_indices[0]], end[filaments.control_point_indices[0]])
    total = elements * LENGTH
    ends = LENGTH * np.arange(elements + 1) - 0.5 * total
    tensions = 0.5 * along * rate * (total**2 / 4 * LENGTH - np.diff(ends**3) / 3) / LENGTH
    strains = lengths / LENGTH - 1.0
    assert strains.max() > 5e-5
    np.testing.assert_allclose(strains, tensions / 1e4, rtol=5e-3)


def test_a_bent_filament_in_a_shear_is_that_of_straight_segments():
    """Four elements beside 48 segments, clamped at nothing, after a shear of 1.2 that bends and turns them."""
    length, rate = 4 * LENGTH, 3e-8
    curves = []
    for kind, number in ((BEAM, 4), (replace(BEAM, element="straight", segment_length=length / 48), 48)):
        kind = replace(kind, friction_length="filament")
        filaments = Filaments(VISCOSITY, 0, engine="compiled")
        angles = 0.8 * np.linspace(0.0, 1.0, 48001)
        points = np.cumsum(np.stack([np.cos(angles), 0 * angles, np.sin(angles)], axis=1), axis=0) * length / 48000
        nodes = points[:: 48000 // number][: number + 1]
        if kind.segment_kind.straight:
            filaments.add_nodes(kind, nodes)
        else:
            bends = 0.8 * np.linspace(0.0, 1.0, number + 1)
            filaments.add_nodes(kind, nodes, tangents=np.stack([np.cos(bends), 0 * bends, np.sin(bends)], axis=1))
        _, end = _carried(filaments, Flow.shear(rate), 4e5, 100)
        nodes = end[filaments.node_indices[0]]
        if kind.segment_kind.straight:
            curves.append(nodes)
        else:
            curves.append(curve_points(nodes, end[filaments.control_point_indices[0]], 12))
    moved = np.abs(curves[1] - points[::1000]).max()
    assert moved > 0.2 * length
    assert np.abs(curves[0] - curves[1]).max() < 0.01 * moved


def _mean_orientation(peclet):
    """<sin 2 phi> of rods that diffuse in a plane, in a shear of the rate Pe D: a Fourier series of their density."""
    modes = 40
    matrix = np.zeros((2 * modes + 1, 2 * modes + 1), dtype=complex)
    for k in range(-modes, modes + 1):
        row = k + modes
        # 0 = p'' + Pe (p (1 - cos 2 phi)/2)', by exp(2 i k phi)
        matrix[row, row] += -4.0 * k**2 + 1j * k * peclet
        for other in (k - 1, k + 1):
            if abs(other) <= modes:
                matrix[row, other + modes] -= 0.5j * k * peclet
    matrix[modes] = 0
    matrix[modes, modes] = 1
    right = np.zeros(2 * modes + 1)
    right[modes] = 1
    density = np.linalg.solve(matrix, right)
    # The mean of sin 2 phi of the density sum_k c_k exp(2 i k phi)/(2 pi).
    return -density[modes + 1].imag


@pytest.mark.slow
def test_rods_that_diffuse_lie_along_a_shear():
    """Single elements in a plane, at a Peclet number of two; a twentieth of the mean would fail."""
    kind = replace(STIFF, friction_length="segment")
    _, across = _friction(kind, 1)
    diffusion = KT / (across * LENGTH**3 / 12)
    filaments = Filaments(VISCOSITY, TEMPERATURE, engine="compiled")
    generator = np.random.default_rng(2)
    for angle in generator.uniform(0, 2 * np.pi, 700):
        filaments.add_straight(kind, 1, [0, 0, 0], [np.cos(angle), np.sin(angle), 0], planar=True)
    _, system, positions = filaments.build()
    flow = Flow.shear(2 * diffusion, direction=(1, 0, 0), gradient_direction=(0, 1, 0))
    integrator = filaments.create_integrator(system, 0.01 / diffusion, flow=flow, random_seed=5, checks=False)
    context = new_context(system, positions, integrator, "CPU")
    integrator.step(200)
    means = []
    nodes = np.array(filaments.node_indices)
    for _ in range(160):
        integrator.step(50)
        x = positions_of(context)[nodes]
        vectors = x[:, 1] - x[:, 0]
        means.append(np.sin(2 * np.arctan2(vectors[:, 1], vectors[:, 0])))
    of_filaments = np.mean(means, axis=0)
    expected, error = _mean_orientation(2.0), np.std(of_filaments) / np.sqrt(len(of_filaments))
    assert SIGMAS * error < 0.05 * expected
    assert np.mean(of_filaments) == pytest.approx(expected, abs=SIGMAS * error)
