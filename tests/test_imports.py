"""What ``import openmm_cylchain`` loads: nothing that takes long and that a simulation may never need."""

import subprocess
import sys

import pytest

import openmm_cylchain

LATE = ("analysis", "rendering", "scans", "theory")
SLOW = (
    "matplotlib",
    "mdtraj",
    "openmm.app",
    "openmm_cylchain.analysis",
    "openmm_cylchain.rendering",
    "openmm_cylchain.runs",
    "openmm_cylchain.scans",
    "pint",
    "pymbar",
    *(f"scipy.{name}" for name in ("fft", "integrate", "interpolate", "linalg", "optimize", "sparse", "spatial")),
    *(f"scipy.{name}" for name in ("special", "stats")),
)


def in_a_fresh_interpreter(code):
    command = [sys.executable, "-c", code]
    return subprocess.run(command, capture_output=True, text=True, check=True, timeout=120).stdout.split()


def test_what_is_slow_is_not_loaded():
    loaded = in_a_fresh_interpreter("import openmm_cylchain, sys; print(*sys.modules)")
    assert "openmm_cylchain.systems.filaments" in loaded
    assert not {*SLOW} & {*loaded}


def test_the_command_starts_without_what_is_slow():
    loaded = in_a_fresh_interpreter("import openmm_cylchain.cli, sys; print(*sys.modules)")
    assert "openmm_cylchain.scans.command" in loaded
    assert not {name for name in SLOW if not name.startswith("openmm_cylchain.")} & {*loaded}


def test_modules_for_users_are_loaded_when_they_are_asked_for():
    names = ", ".join(f"openmm_cylchain.{name}.__name__" for name in LATE)
    found = in_a_fresh_interpreter(f"import openmm_cylchain; print({names})")
    assert found == [f"openmm_cylchain.{name}" for name in LATE]


def test_all_names_are_there():
    assert {*LATE, *openmm_cylchain.__all__} <= {*dir(openmm_cylchain)}
    assert all(hasattr(openmm_cylchain, name) for name in openmm_cylchain.__all__)
    given = {}
    exec("from openmm_cylchain import *", given)
    assert {*openmm_cylchain.__all__} <= {*given}
    with pytest.raises(AttributeError, match="no attribute 'analyses'"):
        _ = openmm_cylchain.analyses
