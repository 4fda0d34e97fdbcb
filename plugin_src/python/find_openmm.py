"""Prints the version of the installed OpenMM, the directory of its headers and libraries, and the directories of
packages in which its platforms for GPUs, and what these need, may be, as a CMake list.

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
# A build may have packages in several directories.
sites = [Path(entry) for entry in sys.path if any(Path(entry, name).is_dir() for name in ("OpenMM.libs", "nvidia"))]
print(version, (package.parent / "OpenMM.libs").as_posix(), *(site.as_posix() for site in sites), sep=";")
