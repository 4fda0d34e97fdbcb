"""What is installed and what works: versions, engines and platforms."""

import platform
import sys
import warnings
from pathlib import Path

import numpy as np
import openmm
import scipy

from ..engine_choice import available_engines
from ..engines.gpu_platforms import GPU_PLATFORMS
from ..version import __version__
from .platform_trial import try_platform


def versions():
    """Versions of this package and of what it stands on, by name."""
    return {
        "openmm-cylchain": __version__,
        "openmm": openmm.Platform.getOpenMMVersion(),
        "numpy": np.__version__,
        "scipy": scipy.__version__,
        "python": platform.python_version(),
    }


def platforms():
    """The name of every OpenMM platform with None if a Context can be created on it, or with the reason why not."""
    installed = [openmm.Platform.getPlatform(index) for index in range(openmm.Platform.getNumPlatforms())]
    return {each.getName(): _why_platform_is_unusable(each) for each in installed}


def _why_platform_is_unusable(each):
    system = openmm.System()
    system.addParticle(1.0)
    try:
        with warnings.catch_warnings():
            warnings.simplefilter("ignore")
            openmm.Context(system, openmm.VerletIntegrator(0.001), each)
    except openmm.OpenMMException as error:
        return str(error) or type(error).__name__
    return None


def format_information():
    """Versions, engines, platforms and plugins that failed to load, as text for people."""
    failures = openmm.Platform.getPluginLoadFailures()
    sections = [
        ("Versions", versions()),
        ("Engines", {name: _availability(reason) for name, reason in available_engines().items()}),
        ("OpenMM platforms", {name: _availability(reason) for name, reason in platforms().items()}),
        ("Filaments of the compiled engine on GPUs", {name: try_platform(name) for name in GPU_PLATFORMS}),
    ]
    lines = []
    for title, entries in sections:
        lines.append(title)
        lines.extend(f"  {name:<16} {text}" for name, text in entries.items())
    lines.append(f"OpenMM plugins that failed to load{'' if failures else ': none'}")
    lines.extend(f"  {failure}" for failure in failures)
    lines.append(f"Directory of OpenMM's own plugins\n  {openmm.Platform.getDefaultPluginsDirectory()}")
    lines.append(f"Directory of the compiled engine's plugin\n  {_plugin_directory() or 'none'}")
    lines.append(f"Python\n  {sys.executable}")
    return "\n".join(lines)


def _plugin_directory():
    directory = Path(__file__).parents[1] / "lib" / "plugins"
    return directory if directory.is_dir() else None


def _availability(reason):
    return "available" if reason is None else f"missing: {reason}"
