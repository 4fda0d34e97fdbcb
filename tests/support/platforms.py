"""The platforms, precisions, engines and schemes that are tested here, and how well platforms agree."""

import openmm
import pytest

from openmm_cylchain.engines.gpu_platforms import GPU_PLATFORMS, why_not_on
from openmm_cylchain.time_steps.schemes import EXPLICIT_SCHEMES

from .compiled_platform import CompiledPlatform

_WANTED = ("Reference", "CPU", *GPU_PLATFORMS)


def _usable(name):
    """Whether a Context can be created on the platform: OpenCL may be installed without a device."""
    system = openmm.System()
    system.addParticle(1.0)
    try:
        openmm.Context(system, openmm.VerletIntegrator(0.001), openmm.Platform.getPlatformByName(name))
    except openmm.OpenMMException:
        return False
    return True


PLATFORMS = [name for name in _WANTED if _usable(name)]

ENGINES = ("portable", "compiled")
ENGINES_PORTABLE_SLOW = (pytest.param("portable", marks=pytest.mark.slow), "compiled")
"""For statistics, of which the portable engine takes many times as long."""

ENGINE_SCHEMES = [(engine, scheme) for engine in ENGINES for scheme in EXPLICIT_SCHEMES] + [("compiled", "implicit")]


# OpenMM adds forces on GPUs in units of 2^-32 kJ/(mol nm), and computes its own in single precision but in "double".
TOLERANCES = {"double": (1e-9, 0.0, 1e-5), "mixed": (1e-6, 0.0, 1e-4), "single": (1e-3, 2**-13, 0.05)}
"""Of platforms for GPUs, as in ``CompiledPlatform``."""

GPU_NAMES = [name for name in GPU_PLATFORMS if why_not_on(name) is None and _usable(name)]
"""The platforms for GPUs on which filaments are tested here."""

NOT_TESTED = {name: why_not_on(name) or "there is no device" for name in GPU_PLATFORMS if name not in GPU_NAMES}
"""Why they are not on the others."""

CPU_CASES = [CompiledPlatform(name, None, 1e-9, 0.0, 1e-9) for name in PLATFORMS if name in ("Reference", "CPU")]
GPU_CASES = [
    CompiledPlatform(name, precision, *TOLERANCES[precision]) for name in GPU_NAMES for precision in TOLERANCES
]
COMPILED_PLATFORMS = CPU_CASES + GPU_CASES


def _marks(case):
    return [pytest.mark.slow] if case.precision in ("single", "double") else []


ON_COMPILED_PLATFORMS = pytest.mark.parametrize(
    "platform", [pytest.param(case, marks=_marks(case), id=str(case)) for case in COMPILED_PLATFORMS]
)
"""Runs a test of the compiled engine on all platforms; in all precisions where slow tests run."""

ENGINE_PLATFORMS = [("portable", platform) for platform in PLATFORMS]
ENGINE_PLATFORMS += [("compiled", case.name) for case in CPU_CASES]

EVERYWHERE = [*ENGINE_PLATFORMS]
EVERYWHERE += [pytest.param("compiled", case, marks=pytest.mark.slow, id=f"compiled-{case}") for case in GPU_CASES]
"""Engines and platforms; with those for GPUs where slow tests run."""
