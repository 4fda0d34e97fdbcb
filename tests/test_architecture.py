"""Folders of the package lie above each other; nothing imports upwards or in a circle, and no test imports a test."""

import ast
import re
from functools import cache
from graphlib import TopologicalSorter

import pytest

from support.repository import PACKAGE, ROOT, STUDIES, TESTS

# From the lowest to the highest. Modules on one line may import each other, but not in a circle.
FLOORS = (
    ("errors", "version"),
    ("engine_choice",),
    ("units",),
    ("mechanics",),
    ("beams",),
    ("filaments",),
    ("bead_spring",),
    ("theory",),
    ("output",),
    ("couplings",),
    ("kinetics",),
    ("time_steps",),
    ("engines",),
    ("analysis",),
    ("systems",),
    ("runs",),
    ("cytosim",),
    ("rendering",),
    ("export",),
    ("scans",),
    ("",),
    ("cli",),
)
FLOOR = {name: floor for floor, names in enumerate(FLOORS) for name in names}
# The same of plugin_src, where a file is included by its folder's name.
CORE_FLOORS = ("mechanics", "lanes", "couplings", "dynamics", "networks", "beams", "kinetics", "growth")
# Above these, what knows OpenMM includes by "openmm/..." and by names of files alone.
API_FLOORS = ("openmmapi", "serialization", "platforms")
# Written by the build.
BUILT = {"plugin", "plugin_version"}


def module_of(path):
    parts = path.relative_to(PACKAGE).with_suffix("").parts
    return ".".join(parts[:-1] if parts[-1] == "__init__" else parts)


MODULES = {module_of(path): path for path in sorted(PACKAGE.rglob("*.py"))}


@cache
def imports_of(module):
    """Modules of the package that one imports, at its top or within functions."""
    return list(_imports_of(module))


def _imports_of(module):
    path = MODULES[module]
    package = module.split(".") if path.name == "__init__.py" else module.split(".")[:-1]
    for node in ast.walk(ast.parse(path.read_text())):
        if not isinstance(node, ast.ImportFrom) or node.level == 0:
            continue
        base = [part for part in package[: len(package) - node.level + 1] if part]
        target = ".".join([*base, *([node.module] if node.module else [])])
        for name in (alias.name for alias in node.names):
            full = f"{target}.{name}".strip(".")
            yield full if full in MODULES or full in BUILT else target


@pytest.mark.parametrize("module", MODULES)
def test_nothing_imports_upwards(module):
    floor = FLOOR[module.split(".")[0]]
    for imported in imports_of(module):
        if imported not in BUILT:
            assert FLOOR[imported.split(".")[0]] <= floor, f"{module} imports {imported}"


def test_there_is_no_circle_of_imports():
    graph = {module: [other for other in imports_of(module) if other in MODULES] for module in MODULES}
    assert len(graph) > 80
    TopologicalSorter(graph).prepare()


def test_no_cpp_file_includes_upwards():
    source, floors, included = ROOT / "plugin_src", [*CORE_FLOORS, *API_FLOORS], set()
    for path in sorted(file for end in ("*.h", "*.cpp") for file in source.rglob(end)):
        folder = path.relative_to(source).parts[0]
        for name in re.findall(r'#include "(\w+)/[^"]+"', path.read_text()):
            if name in floors:
                assert floors.index(name) <= floors.index(folder), f"{path} includes {name}"
                included.add((folder, name))
        if folder in CORE_FLOORS:
            assert '#include "openmm/' not in path.read_text(), path
    assert len(included) > 20
    assert {path.name for path in source.iterdir() if path.is_dir()} == {*floors, "python"}


def packages_imported_by(path):
    """Names of the packages that a file imports, its own aside."""
    for node in ast.walk(ast.parse(path.read_text())):
        names = [alias.name for alias in node.names] if isinstance(node, ast.Import) else []
        if isinstance(node, ast.ImportFrom) and node.level == 0:
            names.append(node.module)
        yield from (name.split(".")[0] for name in names)


def test_no_module_imports_studies_or_the_package_by_its_name():
    unwanted = {"openmm_cylchain", *(path.stem for path in STUDIES.iterdir())}
    assert {"benchmark", "reproduce"} <= unwanted
    for module, path in MODULES.items():
        assert not unwanted & {*packages_imported_by(path)}, module


def test_benchmarks_import_no_reproduction():
    paths = [*(STUDIES / "benchmark").rglob("*.py")]
    assert len(paths) > 10
    for path in paths:
        assert "reproduce" not in packages_imported_by(path), path


def test_no_test_file_imports_another():
    """What they share is public in ``support``. Their names differ."""
    files = sorted(TESTS.rglob("*.py"))
    tests = [path.stem for path in files if path.stem.startswith("test_")]
    assert len(set(tests)) == len(tests) > 50
    for path in files:
        for node in ast.walk(ast.parse(path.read_text())):
            if not isinstance(node, (ast.Import, ast.ImportFrom)):
                continue
            module = getattr(node, "module", None) or ""
            imported = [part for alias in node.names for part in f"{module}.{alias.name}".split(".")]
            assert not {*tests, "conftest"} & set(imported), path
            if module.startswith("support"):
                assert not [name for name in imported if name.startswith("_")], path
