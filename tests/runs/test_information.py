"""``openmm-cylchain info``: versions, engines and platforms, and what is missing and why."""

import importlib
from pathlib import Path

import numpy as np
import openmm
import pytest

from openmm_cylchain import cli
from openmm_cylchain.engines.gpu_platforms import GPU_PLATFORMS, why_not_on
from openmm_cylchain.runs import information
from openmm_cylchain.runs.platform_trial import try_platform


def test_information(without_compiled, monkeypatch, capsys):
    monkeypatch.setattr(openmm.Platform, "getPluginLoadFailures", staticmethod(lambda: ("libBroken.so: symbol",)))
    monkeypatch.setattr(information, "platforms", lambda: {"Reference": None, "CUDA": "no device"})
    assert cli.main(["info"]) == 0
    text = capsys.readouterr().out
    for part in ("openmm-cylchain", openmm.Platform.getOpenMMVersion(), np.__version__, "missing: it is not part"):
        assert part in text
    assert "libBroken.so: symbol" in text and "missing: no device" in text
    assert all(
        f"  {name:<16} missing: the compiled engine is missing: it is not part" in text for name in GPU_PLATFORMS
    )


def test_directory_of_the_plugin():
    directory = Path(importlib.import_module("openmm_cylchain").__file__).parent / "lib" / "plugins"
    assert f"compiled engine's plugin\n  {directory}\n" in information.format_information()
    assert list(directory.glob("libOpenMMCylinderChainReference*"))


@pytest.mark.parametrize("name", GPU_PLATFORMS)
def test_filaments_are_tried_on_gpus(name):
    reason = why_not_on(name)
    if reason is None:
        assert try_platform(name).startswith("present, tested: 5 steps agree")
    else:
        assert len(reason) > 20 and try_platform(name) == f"missing: {reason}"


def test_platforms():
    assert information.platforms()["Reference"] is None
