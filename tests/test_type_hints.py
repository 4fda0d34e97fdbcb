"""All that users call, and what it is made of, has type hints; ``mypy`` checks that they are right."""

import ast
from pathlib import Path

import pytest

PACKAGE = Path(__file__).parents[1] / "openmm_cylchain"
TYPED = (
    "units",
    "mechanics",
    "filaments",
    "bead_spring",
    "theory",
    "output",
    "couplings",
    "time_steps",
    "analysis",
    "systems",
    "rendering",
)
MODULES = [
    *(path for folder in TYPED for path in sorted((PACKAGE / folder).glob("*.py")) if path.stem != "command"),
    PACKAGE / "engine_choice.py",
    PACKAGE / "engines" / "protocol.py",
]


def is_public(name):
    return not name.startswith("_") or name.startswith("__")


def functions_of(body):
    for node in body:
        if isinstance(node, ast.ClassDef) and is_public(node.name):
            yield from functions_of(node.body)
        elif isinstance(node, ast.FunctionDef) and is_public(node.name):
            yield node


def without_hint(function):
    arguments = function.args
    every = [*arguments.posonlyargs, *arguments.args, *arguments.kwonlyargs, arguments.vararg, arguments.kwarg]
    missing = [one.arg for one in every if one and one.annotation is None and one.arg not in ("self", "cls")]
    return missing + ([] if function.returns else ["return"])


@pytest.mark.parametrize("path", MODULES, ids=lambda path: str(path.relative_to(PACKAGE)))
def test_public_functions_have_hints(path):
    missing = {function.name: without_hint(function) for function in functions_of(ast.parse(path.read_text()).body)}
    assert not {name: names for name, names in missing.items() if names}


def test_there_is_something_to_look_at():
    assert len(MODULES) > 50
    assert (PACKAGE / "py.typed").exists()
