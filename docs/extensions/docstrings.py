"""Docstrings and signatures as they are written.

A type reads ``Scalar`` and not ``float | openmm.unit.quantity.Quantity``, and a bar in an equation is a bar.
"""

import ast
import dataclasses
import inspect
import re
import textwrap


def setup(app):
    """Replace the signatures that autodoc would write, and keep bars."""
    app.connect("autodoc-process-docstring", _keep_bars)
    app.connect("autodoc-process-signature", _write_signature)
    return {"parallel_read_safe": True, "parallel_write_safe": True}


def _keep_bars(app, what, name, thing, options, lines):
    """To reStructuredText, text between bars is a substitution."""
    lines[:] = re.sub(r"(``.*?``)|\|", lambda match: match[1] or r"\|", "\n".join(lines), flags=re.DOTALL).split("\n")


def _write_signature(app, what, name, thing, options, signature, return_annotation):
    if what == "class":
        if dataclasses.is_dataclass(thing) and "__init__" in vars(thing):
            return _signature_of_fields(thing), None
        thing = thing.__init__
    thing = inspect.unwrap(getattr(thing, "__func__", thing)) if thing is not None else None
    if not inspect.isfunction(thing) or thing.__module__.split(".")[0] != "openmm_cylchain":
        return None
    (function,) = ast.parse(textwrap.dedent(inspect.getsource(thing))).body
    arguments = function.args
    if "." in thing.__qualname__ and not any("staticmethod" in ast.unparse(one) for one in function.decorator_list):
        del (arguments.posonlyargs or arguments.args)[0]
    returned = ast.unparse(function.returns) if function.returns and what != "class" else None
    return f"({ast.unparse(arguments)})", returned


def _signature_of_fields(kind):
    (tree,) = ast.parse(textwrap.dedent(inspect.getsource(kind))).body
    for line in ast.walk(tree):
        # What may be given, where attributes hold something else.
        if isinstance(line, ast.FunctionDef) and line.name == "__init__":
            del (line.args.posonlyargs or line.args.args)[0]
            return f"({ast.unparse(line.args)})"
    written = {}
    for base in reversed(kind.__mro__):
        if dataclasses.is_dataclass(base):
            (tree,) = ast.parse(textwrap.dedent(inspect.getsource(base))).body
            written |= {line.target.id: line for line in tree.body if isinstance(line, ast.AnnAssign)}
    texts, keywords = [], False
    for field in dataclasses.fields(kind):
        if not field.init:
            continue
        if field.kw_only and not keywords:
            texts.append("*")
            keywords = True
        text = f"{field.name}: {ast.unparse(written[field.name].annotation)}"
        if field.default is not dataclasses.MISSING:
            text += f" = {field.default!r}"
        elif field.default_factory is not dataclasses.MISSING:
            text += " = ..."
        texts.append(text)
    return f"({', '.join(texts)})"
