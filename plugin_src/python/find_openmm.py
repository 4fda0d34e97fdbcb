"""Prints the version of the installed OpenMM and the directory of its headers and libraries, as a CMake list.

The package is found, but not imported: a build may have libraries that this machine cannot load.
"""

import runpy
import sys
from importlib.util import find_spec
from pathlib import Path

spec = find_spec("openmm")
if spec is None:
    sys.exit("OpenMM is not installed for " + sys.executable)
package = Path(spec.submodule_search_locations[0])
version = runpy.run_path(str(package / "version.py"))["short_version"]
print(version, (package.parent / "OpenMM.libs").as_posix(), sep=";")
