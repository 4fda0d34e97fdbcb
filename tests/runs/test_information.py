"""``openmm-cylchain info``: versions, engines and platforms, and what is missing and why."""

import importlib
from pathlib import Path

import numpy as np
import openmm

from openmm_cylchain import cli
from openmm_cylchain.runs import information


def test_information(without_compiled, monkeypatch, capsys):
    monkeypatch.setattr(openmm.Platform, "getPluginLoadFailures", staticmethod(lambda: ("libBroken.so: symbol",)))
    monkeypatch.setattr(information, "platforms", lambda: {"Reference": None, "CUDA": "no device"})
    assert cli.main(["info"]) == 0
    text = capsys.readouterr().out
    for part in ("openmm-cylchain", openmm.Platform.getOpenMMVersion(), np.__version__, "missing: it is not part"):
        assert part in text
    assert "libBroken.so: symbol" in text and "missing: no device" in text


def test_directory_of_the_plugin():
    directory = Path(importlib.import_module("openmm_cylchain").__file__).parent / "lib" / "plugins"
    assert f"compiled engine's plugin\n  {directory}\n" in information.format_information()
    assert list(directory.glob("libOpenMMCylinderChainReference*"))


def test_platforms():
    assert information.platforms()["Reference"] is None
