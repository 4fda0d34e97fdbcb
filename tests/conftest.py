"""Fixtures that several test modules share."""

import os

import openmm
import pytest

from openmm_cylchain.dynamics.schemes import EXPLICIT_SCHEMES

_WANTED = ("Reference", "CPU", "OpenCL")


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


def pytest_configure():
    """Fail early if a platform that must be tested is missing, rather than test less in silence."""
    required = filter(None, os.environ.get("OPENMM_CYLCHAIN_TEST_PLATFORMS", "").split(","))
    missing = set(required) - set(PLATFORMS)
    if missing:
        raise pytest.UsageError(f"OpenMM platforms that must be tested are missing: {', '.join(sorted(missing))}")


def pytest_report_header():
    """Name the platforms under test."""
    return f"OpenMM platforms: {', '.join(PLATFORMS)}"


@pytest.fixture(params=PLATFORMS, scope="session")
def platform(request):
    """Every OpenMM platform of this machine in turn."""
    return openmm.Platform.getPlatformByName(request.param)


@pytest.fixture(scope="session")
def reference():
    """The Reference platform: slow, but in double precision throughout."""
    return openmm.Platform.getPlatformByName("Reference")


ENGINES = ("portable", "compiled")
ENGINE_SCHEMES = [(engine, scheme) for engine in ENGINES for scheme in EXPLICIT_SCHEMES] + [("compiled", "implicit")]


@pytest.fixture(params=ENGINES)
def engine(request):
    """Every engine in turn."""
    return request.param
