"""Hooks of pytest, and fixtures that several test files share."""

import os

# Tests run side by side: threads of each would wait for those of others. Libraries ask for this when they are loaded.
# What several threads must not change is tested with numbers of them that a Context is given.
os.environ.setdefault("OPENBLAS_NUM_THREADS", "1")
os.environ.setdefault("OPENMM_CPU_THREADS", "1")

# ruff: noqa: E402
import re
import sys

import openmm
import pytest

import openmm_cylchain
from openmm_cylchain.engine_choice import why_no_python_forces
from support import run_figures
from support.platforms import COMPILED_PLATFORMS, ENGINES, GPU_NAMES, NOT_TESTED, PLATFORMS


def pytest_configure():
    """Fail early if a platform that must be tested is missing, rather than test less in silence.

    Where a test names no platform, it gets the processor, whatever others have turned on before in the same process.
    """
    os.environ["OPENMM_DEFAULT_PLATFORM"] = "CPU"
    required = filter(None, os.environ.get("OPENMM_CYLCHAIN_TEST_PLATFORMS", "").split(","))
    missing = set(required) - set(PLATFORMS)
    if missing:
        raise pytest.UsageError(f"OpenMM platforms that must be tested are missing: {', '.join(sorted(missing))}")


def pytest_report_header():
    """Name the platforms under test, and why filaments are not on the others."""
    untested = [f"not on {name}: {reason}" for name, reason in NOT_TESTED.items()]
    filaments = "; ".join([", ".join(map(str, COMPILED_PLATFORMS)), *untested])
    return [f"OpenMM platforms: {', '.join(PLATFORMS)}", f"Filaments of the compiled engine: {filaments}"]


@pytest.hookimpl(tryfirst=True)
def pytest_collection_modifyitems(config, items):
    """Of cases with a sample, those that are not in it are exhaustive: slow ones that run before a release."""
    has_cases = {}
    for item in items:
        sample = item.get_closest_marker("sample")
        if sample:
            test, taken = item.nodeid.partition("[")[0], re.search(sample.args[0], item.callspec.id)
            has_cases[test] = has_cases.get(test, False) or bool(taken)
            if not taken:
                item.add_marker("exhaustive")
        if item.get_closest_marker("exhaustive"):
            item.add_marker("slow")
    # Who names single cases may name those outside the sample.
    if not any("::" in argument for argument in config.args):
        for test, has_case in has_cases.items():
            if not has_case:
                raise pytest.UsageError(f"{test}: its sample is none of its cases")


@pytest.hookimpl(wrapper=True)
def pytest_pyfunc_call():
    """Where OpenMM has no forces that are computed in Python, what is refused for that reason is skipped with it."""
    return (yield from _skipped_without_python_forces())


@pytest.hookimpl(wrapper=True)
def pytest_fixture_setup():
    """The same of fixtures."""
    return (yield from _skipped_without_python_forces())


def _skipped_without_python_forces():
    reason = why_no_python_forces()
    try:
        return (yield)
    except Exception as error:
        # The text is also that of a process that a test has started.
        if reason is None or reason not in str(error):
            raise
        pytest.skip(reason)


@pytest.fixture(scope="session", autouse=True)
def blank_figures_of_runs():
    """Figures of runs are rendered where tests look at them, and in processes of their own."""
    with run_figures.blank():
        yield


@pytest.fixture(scope="module")
def rendered_figures_of_runs():
    """Figures of runs are rendered in a test file."""
    with run_figures.rendered():
        yield


@pytest.fixture(params=PLATFORMS, scope="session")
def platform(request):
    """Every OpenMM platform of this machine in turn."""
    return openmm.Platform.getPlatformByName(request.param)


@pytest.fixture(scope="session")
def reference():
    """The Reference platform: slow, but in double precision throughout."""
    return openmm.Platform.getPlatformByName("Reference")


@pytest.fixture(params=GPU_NAMES, scope="module")
def gpu(request):
    """Every platform for GPUs on which filaments are tested here, turned on."""
    openmm_cylchain.enable_platform(request.param)
    return request.param


@pytest.fixture(params=ENGINES)
def engine(request):
    """Every engine in turn."""
    return request.param


@pytest.fixture
def without_compiled(monkeypatch):
    """An installation without the compiled engine."""
    # None in sys.modules makes an import fail as if the module did not exist.
    monkeypatch.setitem(sys.modules, "openmm_cylchain.engines.compiled", None)
