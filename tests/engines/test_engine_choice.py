"""Which engines there are, which of them work here, and which is taken if none is named."""

import re
import subprocess
import sys
import types

import openmm
import pytest

from openmm_cylchain import F_ACTIN, Crosslinks, EngineWarning, Filaments, InputError, engine_choice
from openmm_cylchain.engine_choice import why_no_python_forces

COMPILED = "openmm_cylchain.engines.compiled"
# Elsewhere there is no portable engine.
with_python_forces = pytest.mark.skipif(not hasattr(openmm, "PythonForce"), reason=str(why_no_python_forces()))


@pytest.fixture
def with_compiled(monkeypatch):
    """An engine in the place of the compiled one."""
    module = types.ModuleType(COMPILED)
    module.ENGINE = object()
    monkeypatch.setitem(sys.modules, COMPILED, module)
    return module.ENGINE


@pytest.fixture
def without_python_forces(monkeypatch):
    """An OpenMM before 8.5."""
    monkeypatch.delattr(openmm, "PythonForce", raising=False)
    monkeypatch.setattr(openmm.Platform, "getOpenMMVersion", staticmethod(lambda: "8.4"))


@with_python_forces
def test_engines(without_compiled):
    reasons = engine_choice.available_engines()
    assert set(reasons) == set(engine_choice.ENGINES)
    assert reasons["portable"] is None and reasons["compiled"] == "it is not part of this installation"
    assert engine_choice.load_engine() is engine_choice.load_engine("portable")
    with pytest.raises(InputError, match="compiled engine is missing: it is not part"):
        engine_choice.load_engine("compiled")
    with pytest.raises(InputError, match="engine must be one of compiled, portable"):
        Filaments(1.0, 300.0, engine="fast")


@with_python_forces
def test_compiled_engine_comes_first(with_compiled):
    assert engine_choice.available_engines() == {"portable": None, "compiled": None}
    assert engine_choice.load_engine() is with_compiled
    assert engine_choice.load_engine("portable") is not with_compiled


@with_python_forces
@pytest.mark.parametrize("error", [OSError("no such library"), openmm.OpenMMException("no such library")])
def test_reason_why_a_plugin_does_not_load(error, monkeypatch):
    def fail(name):
        raise error

    monkeypatch.setattr(engine_choice.importlib, "import_module", fail)
    assert engine_choice.available_engines()["compiled"] == "no such library"
    with pytest.warns(EngineWarning, match="no such library.*portable engine is taken"):
        assert engine_choice.choose_engine() == "portable"


@with_python_forces
def test_another_minor_version_of_openmm(tmp_path):
    # A fresh interpreter, since an engine that has been loaded stays so.
    program = (
        "import openmm; openmm.Platform.getOpenMMVersion = staticmethod(lambda: '7.9.1')\n"
        "import openmm_cylchain as package\n"
        "package.Filaments(1.0, 300.0)\n"
        "from openmm_cylchain import engine_choice as choice; print(choice.available_engines()['compiled'])\n"
    )
    result = subprocess.run([sys.executable, "-c", program], capture_output=True, text=True, cwd=tmp_path, check=True)
    sentence = r"built against OpenMM [0-9.]+, but OpenMM 7.9.1 is installed: run pip install 'openmm~=[0-9.]+'"
    assert re.search(sentence, result.stdout)
    assert len(re.findall(f"EngineWarning: The compiled engine does not work: .*{sentence}", result.stderr)) == 2
    assert "portable engine is taken in its place" in result.stderr
    # It names the line that makes the Filaments.
    assert "<string>:3: EngineWarning" in result.stderr


def test_no_warning_where_all_is_well(tmp_path):
    program = "import openmm_cylchain; openmm_cylchain.Filaments(1.0, 300.0)"
    command = [sys.executable, "-W", "always", "-c", program]
    result = subprocess.run(command, capture_output=True, text=True, cwd=tmp_path, check=True)
    # Packages that others import may have warnings of their own.
    assert not re.search(r"EngineWarning|site-packages/openmm_cylchain/.*Warning", result.stderr), result.stderr


def test_a_system_is_read_where_the_package_is_imported(tmp_path):
    filaments = Filaments(1.0, 300.0)
    filaments.add_equilibrium(F_ACTIN, segments=2, seed=1)
    _, system, _ = filaments.build()
    (tmp_path / "system.xml").write_text(openmm.XmlSerializer.serialize(system))
    program = (
        "import openmm, openmm_cylchain\n"
        "system = openmm.XmlSerializer.deserialize(open('system.xml').read())\n"
        "openmm.Context(system, openmm.VerletIntegrator(1.0), openmm.Platform.getPlatformByName('Reference'))\n"
    )
    subprocess.run([sys.executable, "-c", program], check=True, cwd=tmp_path)


def two_filaments():
    filaments = Filaments(1.0, 300.0)
    for y in (0.0, 100.0):
        filaments.add_straight(F_ACTIN, 2, [0.0, y, 0.0], [1.0, 0.0, 0.0])
    return filaments


def test_the_compiled_engine_needs_no_python_forces(without_python_forces):
    """Whatever looks at the forces of a System does without the class, too."""
    filaments = two_filaments()
    assert filaments.engine == "compiled"
    links = Crosslinks(stiffness=10.0, rest_length=100.0)
    links.add(None, 1, 4)
    _, system, positions = filaments.build()
    links.add_to(system)
    assert len(Crosslinks.from_system(system)) == 1
    integrator = filaments.create_integrator(system, filaments.recommended_time_step(system=system))
    context = openmm.Context(system, integrator, openmm.Platform.getPlatform("Reference"))
    context.setPositions(positions)
    integrator.step(1)


def test_what_needs_python_forces_is_refused(without_python_forces, without_compiled):
    sentence = "it needs OpenMM 8.5 or newer, but OpenMM 8.4 is installed: install a newer one"
    with pytest.raises(InputError, match=f"The portable engine is missing: {sentence}"):
        Filaments(1.0, 300.0, engine="portable")
    with pytest.raises(
        InputError, match=f"No engine works here. The compiled .* not part .* The portable .* {sentence}"
    ):
        Filaments(1.0, 300.0)
    system = openmm.System()
    links = Crosslinks(stiffness=10.0, rest_length=1.0)
    with pytest.raises(InputError, match=f"crosslinks are computed in Python: {sentence}"):
        links.add_to(system)
    assert system.getNumForces() == 0


def test_no_engine_is_promised_that_is_not_there(without_python_forces):
    assert "Neither does the portable engine: it needs OpenMM 8.5" in engine_choice._about_slow_engine("a reason.")
