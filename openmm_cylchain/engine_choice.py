"""Which engines there are, which of them work here, and what they do if nothing is asked for."""

import importlib
from typing import Any

from .errors import InputError

ENGINES = ("compiled", "portable")
"""All engines that there are, the fastest first."""

_MODULES = {"compiled": "openmm_cylchain.engines.compiled", "portable": "openmm_cylchain.engines.portable"}


_DEFAULT_SCHEMES = {"compiled": "implicit", "portable": "midpoint"}


def default_scheme(engine: str | None = None) -> str:
    """The integration scheme that an engine uses if none is named.

    Parameters
    ----------
    engine : {"compiled", "portable"}, optional
        The fastest that is available if not given.

    Raises
    ------
    InputError
        If there is no such engine, or it is not available.
    """
    return _DEFAULT_SCHEMES[choose_engine(engine)]


def load_engine(name: str | None = None) -> Any:
    """The Engine of a name (see ``engines.protocol``).

    Parameters
    ----------
    name : {"compiled", "portable"}, optional
        The fastest that is available if not given.

    Raises
    ------
    InputError
        If there is no such engine, or it is not available.
    """
    return importlib.import_module(_MODULES[choose_engine(name)]).ENGINE


def choose_engine(name: str | None = None) -> str:
    """The name of an engine that is available: that which is asked for, or else the fastest.

    Raises
    ------
    InputError
        If there is no such engine, or it is not available.
    """
    if name is not None and name not in ENGINES:
        raise InputError(f"engine must be one of {', '.join(ENGINES)}, but is {name!r}.")
    reasons = available_engines()
    if name is None:
        return next(each for each in ENGINES if reasons[each] is None)
    reason = reasons[name]
    if reason is not None:
        raise InputError(f"The {name} engine is missing: {reason.rstrip('.')}.")
    return name


def available_engines() -> dict[str, str | None]:
    """Which engines work here.

    Returns
    -------
    dict
        The name of every engine with None if it is available, or with the reason why it is not.
    """
    return {"portable": None, "compiled": _why_compiled_is_missing()}


def load_plugin() -> Any:
    """The module of the compiled plugin; None where that engine is missing: then no System has a force of it."""
    if available_engines()["compiled"] is not None:
        return None
    return importlib.import_module(".plugin", __package__)


def _why_compiled_is_missing():
    try:
        importlib.import_module(_MODULES["compiled"])
    except ModuleNotFoundError as error:
        return "it is not part of this installation" if error.name == _MODULES["compiled"] else str(error)
    # Whatever keeps a plugin from loading is a reason to report, not to stop.
    except Exception as error:
        return str(error) or type(error).__name__
    return None
