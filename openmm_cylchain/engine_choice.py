"""Which engines there are, which of them work here, and what they do if nothing is asked for."""

import importlib
import warnings
from typing import Any

import openmm

from .errors import EngineWarning, InputError

ENGINES = ("compiled", "portable")
"""All engines that there are, the fastest first."""

_MODULES = {"compiled": "openmm_cylchain.engines.compiled", "portable": "openmm_cylchain.engines.portable"}

_NOT_INSTALLED = "it is not part of this installation"

_DEFAULT_SCHEMES = {"compiled": "implicit", "portable": "midpoint"}


def default_scheme(engine: str | None = None) -> str:
    """The integration scheme that an engine, or the fastest one, uses if none is named; InputError if it is not
    available."""
    return _DEFAULT_SCHEMES[choose_engine(engine)]


def load_engine(name: str | None = None) -> Any:
    """The Engine of a name (see ``engines.protocol``), or the fastest one; InputError if it is not available."""
    return importlib.import_module(_MODULES[choose_engine(name)]).ENGINE


def choose_engine(name: str | None = None) -> str:
    """The name of an engine that is available: that which is asked for, or the fastest; else InputError.

    An EngineWarning says why the compiled engine is left out, where it is installed.
    """
    if name is not None and not (isinstance(name, str) and name in ENGINES):
        raise InputError(f"engine must be one of {', '.join(ENGINES)}, but is {name!r}.")
    reasons = available_engines()
    if name is None:
        if None not in reasons.values():
            raise InputError(f"No engine works here. {' '.join(_is_missing(each, reasons[each]) for each in ENGINES)}")
        reason = reasons["compiled"]
        if reason not in (None, _NOT_INSTALLED):
            # The line that makes the Filaments, which come in layers.
            warnings.warn(_about_slow_engine(reason), EngineWarning, stacklevel=4)
        return next(each for each in ENGINES if reasons[each] is None)
    reason = reasons[name]
    if reason is not None:
        raise InputError(_is_missing(name, reason))
    return name


def available_engines() -> dict[str, str | None]:
    """The name of every engine with None if it works here, or with the reason why it does not."""
    return {"portable": why_no_python_forces(), "compiled": _why_compiled_is_missing()}


def _is_missing(engine, reason):
    return f"The {engine} engine is missing: {reason.rstrip('.')}."


def why_no_python_forces() -> str | None:
    """Why OpenMM has no forces that are computed in Python, and what to do; None if it has them."""
    if hasattr(openmm, "PythonForce"):
        return None
    return (
        f"it needs OpenMM 8.5 or newer, but OpenMM {openmm.Platform.getOpenMMVersion()} is installed: install a newer "
        "one, and then openmm_cylchain again"
    )


def prepare_openmm() -> None:
    """Load the plugin into OpenMM, where it is installed.

    Without it, OpenMM reads no System of the compiled engine. An EngineWarning says if the plugin was built against
    another minor version of OpenMM than is installed; any other reason is given where the engine is needed.
    """
    available_engines()
    reason = why_openmm_differs()
    if reason is not None:
        warnings.warn(_about_slow_engine(reason), EngineWarning, stacklevel=3)


def why_openmm_differs() -> str | None:
    """What OpenMM the plugin was built against, which one is installed and what to do; None if they are alike."""
    try:
        built = importlib.import_module(".plugin_version", __package__).OPENMM_VERSION
    except ModuleNotFoundError:
        return None
    installed = openmm.Platform.getOpenMMVersion()
    if installed.split(".")[:2] == built.split(".")[:2]:
        return None
    minor = ".".join(built.split(".")[:2])
    return (
        f"the plugin was built against OpenMM {built}, but OpenMM {installed} is installed: run "
        f"pip install 'openmm~={minor}.0', or install openmm_cylchain again"
    )


def _about_slow_engine(reason):
    instead = why_no_python_forces()
    return f"The compiled engine does not work: {reason.rstrip('.')}. " + (
        "The portable engine is taken in its place, whose steps are a thousand times as short; "
        'engine="portable" asks for it without this warning.'
        if instead is None
        else f"Neither does the portable engine: {instead}."
    )


def load_plugin() -> Any:
    """The module of the compiled plugin; None where that engine is missing: then no System has a force of it."""
    if available_engines()["compiled"] is not None:
        return None
    return importlib.import_module(".plugin", __package__)


def _why_compiled_is_missing():
    try:
        importlib.import_module(_MODULES["compiled"])
    except ModuleNotFoundError as error:
        return _NOT_INSTALLED if error.name == _MODULES["compiled"] else str(error)
    # Whatever keeps a plugin from loading is a reason to report, not to stop.
    except Exception as error:
        return str(error) or type(error).__name__
    return None
