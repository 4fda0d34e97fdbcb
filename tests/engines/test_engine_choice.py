"""Which engines there are, which of them work here, and which is taken if none is named."""

import sys
import types

import openmm
import pytest

from openmm_cylchain import Filaments, InputError, engine_choice

COMPILED = "openmm_cylchain.engines.compiled"


@pytest.fixture
def with_compiled(monkeypatch):
    """An engine in the place of the compiled one."""
    module = types.ModuleType(COMPILED)
    module.ENGINE = object()
    monkeypatch.setitem(sys.modules, COMPILED, module)
    return module.ENGINE


def test_engines(without_compiled):
    reasons = engine_choice.available_engines()
    assert set(reasons) == set(engine_choice.ENGINES)
    assert reasons["portable"] is None and reasons["compiled"] == "it is not part of this installation"
    assert engine_choice.load_engine() is engine_choice.load_engine("portable")
    with pytest.raises(InputError, match="compiled engine is missing: it is not part"):
        engine_choice.load_engine("compiled")
    with pytest.raises(InputError, match="engine must be one of compiled, portable"):
        Filaments(1.0, 300.0, engine="fast")


def test_compiled_engine_comes_first(with_compiled):
    assert engine_choice.available_engines() == {"portable": None, "compiled": None}
    assert engine_choice.load_engine() is with_compiled
    assert engine_choice.load_engine("portable") is not with_compiled


@pytest.mark.parametrize("error", [OSError("no such library"), openmm.OpenMMException("no such library")])
def test_reason_why_a_plugin_does_not_load(error, monkeypatch):
    def fail(name):
        raise error

    monkeypatch.setattr(engine_choice.importlib, "import_module", fail)
    assert engine_choice.available_engines()["compiled"] == "no such library"
