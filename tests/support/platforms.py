"""The platforms, engines and schemes that are tested here."""

import openmm

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

ENGINES = ("portable", "compiled")
ENGINE_SCHEMES = [(engine, scheme) for engine in ENGINES for scheme in EXPLICIT_SCHEMES] + [("compiled", "implicit")]

# The compiled engine has no kernels for GPU platforms yet.
ENGINE_PLATFORMS = [("portable", platform) for platform in PLATFORMS]
ENGINE_PLATFORMS += [("compiled", platform) for platform in PLATFORMS if platform in ("Reference", "CPU")]
