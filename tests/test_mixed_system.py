"""Everything in one System, for every engine and platform: two kinds of filaments, crosslinks, Lennard-Jones particles,
walls and a trap, at rest and in shear. The System is that of ``examples/mixed_system.py``.
"""

import importlib.util

import numpy as np
import pytest

from openmm_cylchain.engines.gpu_platforms import GPU_PLATFORMS
from openmm_cylchain.mechanics.flow import Flow
from support.contexts import energy_of, forces_of, new_context, positions_of
from support.platforms import ENGINE_PLATFORMS
from support.repository import EXAMPLES

_SPECIFICATION = importlib.util.spec_from_file_location("mixed_system", EXAMPLES / "mixed_system.py")
example = importlib.util.module_from_spec(_SPECIFICATION)
_SPECIFICATION.loader.exec_module(example)

SHEAR = Flow.shear(example.SHEAR_RATE)
FLOWS = pytest.mark.parametrize("flow", [None, SHEAR], ids=["rest", "shear"])
EVERYWHERE = pytest.mark.parametrize("engine, platform", ENGINE_PLATFORMS)


def simulate(engine, platform, flow=None, seed=3):
    """The parts of the system, a Context of it and its integrator."""
    mixed = example.build(engine)
    # An explicit scheme resolves the lengths of the microtubules' segments.
    step = mixed.filaments.recommended_time_step().step if engine == "portable" else example.STEP
    integrator = mixed.integrator(step, flow=flow, random_seed=seed)
    properties = {"CPU": {"DeterministicForces": "true"}}.get(platform, {})
    if platform in GPU_PLATFORMS:
        properties = {"Precision": "mixed"}
    context = new_context(mixed.system, mixed.positions, integrator, platform, properties)
    return mixed, context, integrator


@EVERYWHERE
def test_forces_are_the_sum_of_their_parts(engine, platform):
    mixed, context, integrator = simulate(engine, platform, SHEAR)
    integrator.step(20)
    groups = {force.getForceGroup() for force in mixed.system.getForces()}
    parts = [forces_of(context, {group}) for group in sorted(groups)]
    total = forces_of(context)
    scale = np.abs(total).max()
    tolerance = 1e-12 if platform == "Reference" else 2e-5
    np.testing.assert_allclose(np.sum(parts, axis=0), total, atol=tolerance * scale)
    assert len([part for part in parts if np.abs(part).max() > 1e-6 * scale]) >= 3
    state = context.getState(energy=True)
    energies = [energy_of(context, {group}) for group in groups]
    np.testing.assert_allclose(sum(energies), state.getPotentialEnergy()._value, rtol=1e-5)


@EVERYWHERE
def test_crosslinks_and_trap_pull_as_they_should(engine, platform):
    mixed, context, integrator = simulate(engine, platform)
    integrator.step(20)
    positions, index = positions_of(context), mixed.filaments.attachment_indices
    expected = np.zeros((mixed.system.getNumParticles(), 3))
    for first, second in mixed.crosslinks.pairs(context):
        between = positions[second] - positions[first]
        between -= example.BOX * np.round(between / example.BOX)
        length = np.linalg.norm(between)
        pull = example.STIFFNESS * (length - example.LINK_LENGTH) * between / length
        expected[first] += pull
        expected[second] -= pull
    assert np.abs(expected[index]).max() > 0.1
    # OpenMM hands the forces on virtual sites to the nodes.
    for number, attachment in enumerate(mixed.filaments.attachments):
        nodes = mixed.filaments.node_indices[attachment.filament][attachment.segment :][:2]
        for node, share in zip(nodes, (1.0 - attachment.fraction, attachment.fraction)):
            expected[node] += share * expected[index[number]]
    nodes = np.concatenate(mixed.filaments.node_indices)
    found = forces_of(context, {1})
    tolerance = 1e-9 if platform == "Reference" else 1e-3
    np.testing.assert_allclose(found[nodes], expected[nodes], atol=tolerance)


@EVERYWHERE
@FLOWS
def test_restart_from_a_checkpoint_is_identical(engine, platform, flow):
    mixed, context, integrator = simulate(engine, platform, flow)
    integrator.step(15)
    number = int(mixed.crosslinks.numbers(context)[3])
    mixed.crosslinks.remove(context, number)
    checkpoint, table = context.createCheckpoint(), mixed.crosslinks.table(context)
    integrator.step(15)
    uninterrupted = positions_of(context)

    mixed, context, integrator = simulate(engine, platform, flow)
    mixed.crosslinks.set_table(context, table)
    context.loadCheckpoint(checkpoint)
    integrator.step(15)
    # A NonbondedForce on the CPU platform adds its pairs in the order of a list that it makes anew after the restart.
    tolerance = 1e-8 if platform == "CPU" else 0
    np.testing.assert_allclose(positions_of(context), uninterrupted, rtol=0, atol=tolerance)
    assert len(mixed.crosslinks.pairs(context)) == 19


@EVERYWHERE
def test_shear_carries_everything_along(engine, platform):
    # With the same noise, what the flow adds in one step is u at the particles, and to filaments that are free on the
    # whole, u at their middle.
    moved = []
    for flow in (None, SHEAR):
        mixed, context, integrator = simulate(engine, platform)
        integrator.setFlow(flow)
        integrator.step(1)
        moved.append(positions_of(context))
    start, step = np.array(mixed.positions._value), integrator.getStepSize()._value
    added = (moved[1] - moved[0]) / step
    fluid = SHEAR.at(start)
    scale = np.abs(fluid).max()
    # Mixed precision has displacements of 0.1 nm with seven digits.
    tolerance = scale * (1e-6 if platform not in GPU_PLATFORMS else 1e-2)
    particles = slice(0, example.PARTICLES)
    np.testing.assert_allclose(added[particles], fluid[particles], atol=tolerance)
    for number, nodes in enumerate(mixed.filaments.node_indices[:-1]):
        weights = np.ones(len(nodes))
        weights[[0, -1]] = 0.5
        drift = np.average(added[nodes], axis=0, weights=weights)
        expected = np.average(fluid[nodes], axis=0, weights=weights)
        np.testing.assert_allclose(drift, expected, atol=1e-2 * scale, err_msg=f"filament {number}")


@pytest.mark.parametrize("engine", ["portable", "compiled"])
def test_platforms_agree(engine):
    ends = []
    for platform in [name for one, name in ENGINE_PLATFORMS if one == engine]:
        mixed, context, integrator = simulate(engine, platform, SHEAR)
        integrator.step(25)
        ends.append(positions_of(context))
    for end in ends[1:]:
        np.testing.assert_allclose(end, ends[0], rtol=0, atol=0.1)
    assert np.abs(ends[0] - mixed.positions._value).max() > 0.1
