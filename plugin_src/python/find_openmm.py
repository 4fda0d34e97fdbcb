"""Which OpenMM is there, for CMake and for the metadata of the package.

The package openmm is found, but not imported: a build may have libraries that this machine cannot load.

As a program, it prints the version of OpenMM, its Python module, the directory of its headers and libraries, and the
directories of packages in which its platforms for GPUs, and what these need, may be, as a CMake list. As a provider of
metadata, it asks for the minor version of OpenMM that is there: that is part of the binary interface of the plugin.
"""

import runpy
import sys
from importlib.util import find_spec
from pathlib import Path

# The build requirements in pyproject.toml say the same.
OLDEST, NEWEST = (8, 3), (8, 6)
PLATFORM_PACKAGES = {"cuda12": "OpenMM-CUDA-12", "cuda13": "OpenMM-CUDA-13", "hip6": "OpenMM-HIP-6"}


def find_openmm():
    """The version of OpenMM as a text, and the directory of its Python package."""
    spec = find_spec("openmm")
    if spec is None:
        sys.exit(f"OpenMM is not installed for {sys.executable}: with --no-build-isolation, install it first.")
    package = Path(spec.submodule_search_locations[0])
    version = runpy.run_path(str(package / "version.py"))["short_version"]
    if not OLDEST <= minor_version(version) <= NEWEST:
        oldest, newest = (".".join(map(str, bound)) for bound in (OLDEST, NEWEST))
        sys.exit(f"OpenMM {version} is installed, but openmm_cylchain needs one from {oldest} to {newest}.")
    return version, package


def minor_version(version):
    """The first two numbers of a version."""
    return tuple(int(number) for number in version.split(".")[:2])


def dynamic_metadata(settings, project):
    """What scikit-build-core adds to the metadata in pyproject.toml."""
    major, minor = minor_version(find_openmm()[0])
    versions = f">={major}.{minor},<{major}.{minor + 1}"
    return {
        "dependencies": [f"openmm{versions}"],
        "optional-dependencies": {extra: [name + versions] for extra, name in PLATFORM_PACKAGES.items()},
    }


def dynamic_wheel(settings):
    """What the metadata of a wheel may say otherwise than those of the sources it is built from."""
    return {"dependencies": True, "optional-dependencies": True}


def main():
    version, package = find_openmm()
    (module,) = package.glob("_openmm.*so")
    libraries = package.parent / "OpenMM.libs"
    # That of conda lies in its environment, with all other libraries.
    if not libraries.is_dir():
        libraries = Path(sys.prefix)
    # A build may have packages in several directories.
    names = ("openmm", "OpenMM.libs", "nvidia")
    sites = [Path(entry) for entry in sys.path if any(Path(entry, name).is_dir() for name in names)]
    print(version, *(path.as_posix() for path in (module, libraries, *sites)), sep=";")


if __name__ == "__main__":
    main()
