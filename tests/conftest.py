"""Fixtures that several test modules share."""

import openmm
import pytest

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


@pytest.fixture(params=PLATFORMS, scope="session")
def platform(request):
    """Every OpenMM platform of this machine in turn."""
    return openmm.Platform.getPlatformByName(request.param)


@pytest.fixture(scope="session")
def reference():
    """The Reference platform: slow, but in double precision throughout."""
    return openmm.Platform.getPlatformByName("Reference")
