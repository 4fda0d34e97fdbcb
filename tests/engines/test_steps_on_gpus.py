"""What single steps on OpenMM's platforms for GPUs must show: how near they are to Reference, and what they cost."""

import os
import subprocess
import sys
from functools import partial
from pathlib import Path

import numpy as np
import openmm
import pytest

from openmm_cylchain import Filaments
from openmm_cylchain.engines.compiled import plugin
from support.contexts import energy_of, new_context, positions_of
from support.mixed_systems import mixed_context
from support.platform_variants import ACTIN, SHEAR, VARIANTS, filaments_of_variant, step_of_variant
from support.platforms import GPU_NAMES, NOT_TESTED
from support.solvent import KT, TEMPERATURE, VISCOSITY

pytestmark = pytest.mark.skipif(not GPU_NAMES, reason=str(NOT_TESTED))

# Of one step at zero temperature, in nm.
STEP_TOLERANCES = {"double": 1e-9, "mixed": 1e-6, "single": 1e-3}

FAR = {"double": 0.0, "mixed": 0.0, "single": 1e4}
"""The coordinates around which such a step is taken, in nm."""

SCHEMES = ("implicit", "implicit-second-order", "euler", "midpoint")


def _marks(precision, variant, scheme, flow):
    if precision == "double" and scheme == "implicit":
        in_sample = flow == "in a flow"
    else:
        in_sample = variant == "open" and flow == "at rest" and (precision == "double" or scheme == "implicit")
    return [] if in_sample else pytest.mark.exhaustive


def _cases():
    for precision in STEP_TOLERANCES:
        for variant in VARIANTS:
            for scheme in SCHEMES:
                for flow in ("at rest", "in a flow"):
                    if precision == "double" or flow == "at rest":
                        yield pytest.param(
                            precision,
                            variant,
                            scheme,
                            SHEAR if flow == "in a flow" else None,
                            id=f"{precision}-{variant}-{scheme}-{flow}",
                            marks=_marks(precision, variant, scheme, flow),
                        )


def _context(variant, scheme, platform, precision=None, flow=None, positions=None, temperature=None):
    filaments, system, start, arguments = filaments_of_variant(variant, flow)
    step = step_of_variant(variant, scheme)
    integrator = filaments.create_integrator(
        system, step, scheme, random_seed=4, precision="double", checks=False, temperature=temperature, **arguments
    )
    properties = {"Precision": precision} if precision else {}
    return new_context(system, start if positions is None else positions, integrator, platform, properties)


def _compare_one_step(variant, scheme, gpu, precision, flow, far=0.0):
    start = filaments_of_variant(variant)[2]._value + far
    found = _context(variant, scheme, gpu, precision, flow, start, temperature=0.0)
    # What the platform has stored.
    start = positions_of(found)
    expected = _context(variant, scheme, "Reference", None, flow, start, temperature=0.0)
    for context in (expected, found):
        context.getIntegrator().step(1)
    end = positions_of(expected)
    moved = np.abs(end - start).max()
    # Here the flow takes filaments hundreds of nm far, and Newton's method may end an iteration earlier or later.
    tolerance = max(STEP_TOLERANCES[precision], 1e-8 * moved if flow else 0.0)
    assert moved > 2 * tolerance
    assert np.abs(positions_of(found) - end).max() < tolerance


@pytest.mark.slow
@pytest.mark.parametrize(("precision", "variant", "scheme", "flow"), list(_cases()))
def test_one_step_without_noise_is_that_of_reference(gpu, precision, variant, scheme, flow):
    """In single precision 10 um from the origin in x, y and z, where its numbers are 0.001 nm apart."""
    # Points of tethers, and places where the flow is slow, are near the origin.
    far = 0.0 if variant == "tethered" or flow else FAR[precision]
    _compare_one_step(variant, scheme, gpu, precision, flow, far)


def test_one_step_without_noise_of_open_filaments(gpu):
    _compare_one_step("open", "implicit", gpu, "mixed", SHEAR)


@pytest.mark.parametrize("precision", ["mixed", pytest.param("double", marks=pytest.mark.slow)])
def test_one_step_among_particles_with_virtual_sites(gpu, precision):
    (filaments, expected), (_, found) = (
        mixed_context(platform, own, temperature=0.0) for platform, own in (("Reference", None), (gpu, precision))
    )
    start = positions_of(expected)
    for context in (expected, found):
        context.getIntegrator().step(1)
    end = positions_of(expected)
    assert np.abs(end - start)[filaments.attachment_indices].max() > 1e-3
    assert np.abs(positions_of(found) - end).max() < STEP_TOLERANCES[precision]


@pytest.mark.parametrize(
    "precision", ["mixed", *(pytest.param(one, marks=pytest.mark.slow) for one in ("single", "double"))]
)
@pytest.mark.parametrize("far", [0.0, 1e4])
def test_energies_are_those_of_the_cpu(gpu, precision, far):
    """To 0.5 %, in equilibrium, of the same positions and after 100 steps with noise from there."""
    filaments, system, positions, arguments = filaments_of_variant("open", pushed=False)
    contexts = []
    for platform, properties in (("CPU", None), (gpu, {"Precision": precision})):
        integrator = filaments.create_integrator(system, 2e6, "implicit", random_seed=4, checks=False, **arguments)
        contexts.append(new_context(system, positions._value + far, integrator, platform, properties))
    for _ in range(2):
        expected, found = map(energy_of, contexts)
        assert expected > 20 * KT and found == pytest.approx(expected, rel=5e-3)
        for context in contexts:
            context.getIntegrator().step(100)


def _order(context, positions):
    """Where the platform keeps some particles, by the places of their coordinates in a checkpoint."""
    checkpoint = context.createCheckpoint()
    double = context.getPlatform().getPropertyValue(context, "Precision") == "double"
    kind = np.float64 if double else np.float32
    places = [checkpoint.find(np.asarray(position, kind).tobytes()) for position in positions]
    assert min(places) >= 0
    return np.argsort(places)


@pytest.mark.parametrize(
    "precision", ["mixed", *(pytest.param(one, marks=pytest.mark.slow) for one in ("single", "double"))]
)
def test_trajectories_are_the_same_whether_particles_are_reordered_or_not(gpu, precision):
    """Bit by bit. OpenMM reorders equal filaments, and particles, where there is a force with a cutoff."""
    ends, orders = [], []
    for method in (openmm.CustomNonbondedForce.CutoffNonPeriodic, openmm.CustomNonbondedForce.NoCutoff):
        filaments = Filaments(VISCOSITY, TEMPERATURE, "compiled")
        generator = np.random.default_rng(3)
        for number in range(12):
            filaments.add_equilibrium(ACTIN, 10, seed=number, start=generator.uniform(0.0, 3000.0, 3))
        _, system, positions = filaments.build()
        nothing = openmm.CustomNonbondedForce("0*r")
        nothing.setNonbondedMethod(method)
        nothing.setCutoffDistance(100.0)
        for _ in range(system.getNumParticles()):
            nothing.addParticle([])
        for particle in range(4):
            nothing.addExclusion(particle, particle + 1)
        system.addForce(nothing)
        integrator = filaments.create_integrator(system, 2e6, "implicit", random_seed=4, checks=False)
        context = new_context(system, positions, integrator, gpu, {"Precision": precision})
        integrator.step(601)
        ends.append(positions_of(context))
        orders.append(_order(context, ends[-1][[nodes[0] for nodes in filaments.node_indices]]))
    assert np.abs(ends[0] - positions._value).max() > 100
    assert np.any(np.diff(orders[0]) < 0) and np.all(np.diff(orders[1]) > 0)
    assert np.array_equal(*ends)


def _work_of_windows(platform, properties=None):
    filaments, system, positions, arguments = filaments_of_variant("open")
    trap = openmm.CustomExternalForce("0.5*k*(x^2+y^2+z^2)")
    trap.addGlobalParameter("k", 2.0**-10)
    for particle in range(system.getNumParticles()):
        trap.addParticle(particle, [])
    system.addForce(trap)
    integrator = filaments.create_integrator(
        system, 2e6, "implicit", random_seed=4, precision="double", checks=False, **arguments
    )
    context = new_context(system, positions, integrator, platform, properties)
    # NativeIntegrator.step takes the work itself.
    step = partial(plugin.CylinderChainIntegrator.step, integrator)
    integrator.setWorkWindow(10)
    found = []
    for taken in (11, 10, 3):
        step(taken)
        found.append(integrator.takeExplicitWork())
    # What does not follow on from a step is left out.
    context.setPositions(positions)
    step(8)
    found.append(integrator.takeExplicitWork())
    return found


@pytest.mark.parametrize("precision", ["mixed", pytest.param("double", marks=pytest.mark.slow)])
def test_work_of_forces_is_summed_on_the_device(gpu, precision):
    """The check of a step that is too long finds on the device what it finds on the processor."""
    expected, found = _work_of_windows("Reference"), _work_of_windows(gpu, {"Precision": precision})
    assert [window[2] for window in expected] == [10, 10, 0, 10]
    for one, other in zip(expected, found, strict=True):
        assert other[1:] == one[1:]
        assert other[0] == pytest.approx(one[0], rel=1e-4 if precision == "mixed" else 1e-7)
    assert len({window[0] for window in expected}) == 3 and abs(expected[0][0]) > 1e-4


_COUNT_LAUNCHES = """
import sys
sys.path.insert(0, {folder!r})
import openmm_cylchain
from support.contexts import new_context, positions_of
from support.mixed_systems import mixed_context
openmm_cylchain.enable_platform({gpu!r})
filaments, context = mixed_context({gpu!r}, "mixed")
context.getIntegrator().checks = True
context.getIntegrator().step(int(sys.argv[1]))
print(context.getPlatform().getPropertyValue(context, "OpenCLPlatformName"))
"""

OURS = {"sumWork", "copyToProcessor", "copyFromProcessor", "displaceParticles", "moveParticles"}


def _launches(gpu, steps, folder):
    """How often PoCL runs kernels in some steps of a System, with checks, and reads back what went wrong in a step."""
    file = folder / f"trace_{steps}.txt"
    done = subprocess.run(
        [sys.executable, "-c", _COUNT_LAUNCHES.format(folder=str(Path(__file__).parents[1]), gpu=gpu), str(steps)],
        check=True,
        env={**os.environ, "POCL_TRACING": "text", "POCL_TRACING_OPT": str(file)},
        cwd=folder,
        stdout=subprocess.PIPE,
        text=True,
    )
    if "Portable Computing Language" not in done.stdout:
        pytest.skip(f"{done.stdout.strip()} does not say what it runs")
    lines = [line for line in file.read_text().splitlines() if " | queued | " in line]
    kernels = [line.split("name=")[1].split()[0] for line in lines if "ndrange_kernel" in line]
    return {name: kernels.count(name) for name in kernels} | {
        "read": sum("read_buffer" in line and int(line.split("size=")[1].split()[0]) > 1000 for line in lines)
    }


def test_a_step_has_five_launches_of_ours_and_reads_filaments_once(gpu, tmp_path):
    """An implicit step of filaments of one kind, among particles, whose work is watched."""
    if gpu != "OpenCL":
        pytest.skip("only PoCL says what it runs")
    few, more = (_launches(gpu, steps, tmp_path) for steps in (5, 15))
    added = {name: count - few.get(name, 0) for name, count in more.items() if count != few.get(name, 0)}
    assert {name: added[name] for name in OURS} == dict.fromkeys(OURS, 10)
    assert added["read"] == 10 and "clearBuffer" not in added
