"""Filaments of the compiled engine on OpenMM's platforms for GPUs: what is installed, and how to turn it on."""

from pathlib import Path

import openmm

from ..engine_choice import available_engines
from ..errors import InputError
from ..units.quantities import one_of

GPU_PLATFORMS = ("OpenCL", "CUDA", "HIP")
"""OpenMM's platforms for GPUs."""

_LIBRARIES = Path(__file__).parents[1] / "lib"

_enabled: set[str] = set()


def enable_platform(name: str) -> None:
    """Let filaments of the compiled engine be computed on one of OpenMM's platforms for GPUs.

    Afterwards, a Context with filaments can be created on that platform. Without it, filaments are computed on the
    platforms Reference and CPU alone, because OpenMM takes the fastest platform that it can where none is named, and a
    GPU is slower than a processor for a few filaments: see the page on platforms. It lasts until Python ends. Calling
    it again does nothing.

    What the device computes, and what the processor does for it, is on that page, too.

    Parameters
    ----------
    name : {"OpenCL", "CUDA", "HIP"}

    Raises
    ------
    InputError
        If filaments cannot be computed on the platform with this installation, with the reason.

    Examples
    --------
    >>> import openmm_cylchain
    >>> openmm_cylchain.enable_platform("Vulkan")
    Traceback (most recent call last):
    openmm_cylchain.errors.InputError: platform must be one of OpenCL, CUDA, HIP, but is 'Vulkan'.
    """
    one_of(name, GPU_PLATFORMS, "platform")
    if name in _enabled:
        return
    reason = why_not_on(name)
    if reason is not None:
        raise InputError(f"Filaments cannot be computed on the platform {name} here: {reason}.")
    try:
        openmm.Platform.loadPluginLibrary(str(_library(name)))
    except openmm.OpenMMException as error:
        raise InputError(f"OpenMM cannot load the plugin for the platform {name}: {error}") from None
    _enabled.add(name)


def why_not_on(name: str) -> str | None:
    """Why filaments cannot be computed on a platform for GPUs with this installation, or None if they can."""
    one_of(name, GPU_PLATFORMS, "platform")
    missing = available_engines()["compiled"]
    if missing is not None:
        return f"the compiled engine is missing: {missing.rstrip('.')}"
    if _library(name) is None:
        return _reasons().get(name, "openmm_cylchain has no plugin for this platform yet")
    names = [openmm.Platform.getPlatform(index).getName() for index in range(openmm.Platform.getNumPlatforms())]
    if name not in names:
        return "OpenMM has not loaded this platform: is its package installed, and the driver of the device"
    return None


def _library(name):
    found = sorted((_LIBRARIES / "plugins").glob(f"libOpenMMCylinderChain{name}.*"))
    return found[0] if found else None


def _reasons():
    """What the installation said of each platform: why its plugin was not built."""
    file = _LIBRARIES / "platforms.txt"
    lines = file.read_text().splitlines() if file.exists() else []
    return dict(line.split(": ", 1) for line in lines)
