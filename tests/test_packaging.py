"""Which OpenMM the package can be built against, and which one is asked for by what was built."""

import importlib.util
import re
import sys

import openmm
import pytest

from support.repository import ROOT

if sys.version_info >= (3, 11):
    import tomllib
else:
    import tomli as tomllib


@pytest.fixture
def find_openmm():
    spec = importlib.util.spec_from_file_location("find_openmm", ROOT / "plugin_src" / "python" / "find_openmm.py")
    module = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(module)
    return module


@pytest.fixture
def installed(monkeypatch, tmp_path, find_openmm):
    """A function that puts a package openmm of some version in the place of that which is installed."""

    def install(version):
        package = tmp_path / version / "openmm"
        package.mkdir(parents=True)
        (package / "__init__.py").touch()
        (package / "version.py").write_text(f"short_version = '{version}'\n")
        spec = importlib.util.spec_from_file_location(
            "openmm", package / "__init__.py", submodule_search_locations=[str(package)]
        )
        monkeypatch.setattr(find_openmm, "find_spec", lambda name: spec)

    return install


def test_what_is_built_asks_for_the_minor_version_that_it_is_built_against(find_openmm, installed):
    major, minor = openmm.Platform.getOpenMMVersion().split(".")[:2]
    here = f">={major}.{minor},<{major}.{int(minor) + 1}"
    assert find_openmm.dynamic_metadata({}, {})["dependencies"] == [f"openmm{here}"]
    installed("8.4.0.post2")
    fields = find_openmm.dynamic_metadata({}, {})
    assert fields["dependencies"] == ["openmm>=8.4,<8.5"]
    assert fields["optional-dependencies"]["cuda12"] == ["OpenMM-CUDA-12>=8.4,<8.5"]
    assert set(fields) == {field for field, differs in find_openmm.dynamic_wheel({}).items() if differs}


def test_an_openmm_that_is_too_old_or_new_is_refused(find_openmm, installed, monkeypatch):
    for version in ("8.2.0", "7.9", "8.7.0", "9.0.1"):
        installed(version)
        with pytest.raises(SystemExit, match=f"OpenMM {version} is installed, but .* needs one from 8.3 to 8.6"):
            find_openmm.find_openmm()
    monkeypatch.setattr(find_openmm, "find_spec", lambda name: None)
    with pytest.raises(SystemExit, match="OpenMM is not installed for .*: with --no-build-isolation, install it first"):
        find_openmm.find_openmm()


def test_files_agree_on_the_versions_of_openmm(find_openmm):
    """Whoever raises a bound in one of them must do so in all."""
    oldest, newest = find_openmm.OLDEST, find_openmm.NEWEST
    with open(ROOT / "pyproject.toml", "rb") as file:
        project = tomllib.load(file)
    overrides = project["tool"]["scikit-build"]["overrides"]
    parts = [project["build-system"], *(each["build"] for each in overrides if "build" in each)]
    of_openmm = [need for part in parts for need in part["requires"] if need.lower().startswith("openmm")]
    assert len(of_openmm) == 1 + len(find_openmm.PLATFORM_PACKAGES)
    above = f"<{newest[0]}.{newest[1] + 1}"
    for need in of_openmm:
        assert need.endswith(f",{above}"), need
    assert f"openmm>={oldest[0]}.{oldest[1]},{above}" in of_openmm
    page = (ROOT / "docs" / "supported.md").read_text()
    (row,) = re.findall(r"\| OpenMM \| ([\d.]+) to ([\d.]+)", page)
    assert row == (".".join(map(str, oldest)), ".".join(map(str, newest)))
    run = (ROOT / ".ci" / "run").read_text()
    assert set(re.findall(r"OpenMM-\w+-\d+>=([\d.]+),(<[\d.]+)", run)) == {(".".join(map(str, newest)), above)}
    assert f"openmm=={oldest[0]}.{oldest[1]}.*" in run
