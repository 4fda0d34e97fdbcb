"""Expressions in [ ] and [[ ]], of numbers, texts and lists: a small part of Python, computed without running any."""

import ast
import math
import operator

from ..errors import InputError

_MOST_ITEMS, _MOST_DIGITS, _MOST_DEPTH = 10**5, 300, 50
_BINARY = {
    ast.Add: operator.add,
    ast.Sub: operator.sub,
    ast.Mult: operator.mul,
    ast.Div: operator.truediv,
    ast.FloorDiv: operator.floordiv,
    ast.Mod: operator.mod,
    ast.Pow: operator.pow,
}
_UNARY = {ast.UAdd: operator.pos, ast.USub: operator.neg, ast.Not: operator.not_}
_COMPARISONS = {
    ast.Lt: operator.lt,
    ast.LtE: operator.le,
    ast.Gt: operator.gt,
    ast.GtE: operator.ge,
    ast.Eq: operator.eq,
    ast.NotEq: operator.ne,
}


def _range(*arguments):
    values = range(*arguments)
    if len(values) > _MOST_ITEMS:
        raise ValueError("too many values")
    return list(values)


_FUNCTIONS = {
    "range": _range,
    **{name: getattr(math, name) for name in ("sqrt", "exp", "log", "log10", "sin", "cos", "tan", "floor", "ceil")},
    "cosd": lambda angle: math.cos(math.radians(angle)),
    "sind": lambda angle: math.sin(math.radians(angle)),
    **{function.__name__: function for function in (round, int, float, abs, min, max, sum, len, str, sorted, list)},
}
_NAMES = {"pi": math.pi, "PI": math.pi, "e": math.e, "inf": math.inf}


def evaluate(text, names=()):
    """The value of an expression, in which ``names`` (a dict) have values.

    Raises
    ------
    InputError
        For what is no such expression, or has no value.
    """
    try:
        tree = ast.parse(text.strip().replace("^", "**"), mode="eval")
        return _value(tree.body, {**_NAMES, **dict(names)}, 0)
    except InputError:
        raise
    except SyntaxError:
        raise InputError(f"{text.strip()!r} is no expression.") from None
    except (ArithmeticError, TypeError, ValueError, KeyError, IndexError, RecursionError, MemoryError) as error:
        raise InputError(f"{text.strip()!r} has no value: {error}.") from None


def _value(node, names, depth):
    if depth > _MOST_DEPTH:
        raise ValueError("it is nested too deeply")

    def own(part):
        return _value(part, names, depth + 1)

    if isinstance(node, ast.Constant) and isinstance(node.value, (int, float, str)):
        return node.value
    if isinstance(node, ast.Name):
        if node.id not in names:
            raise InputError(f"{node.id!r} has no value here.")
        return names[node.id]
    if isinstance(node, (ast.List, ast.Tuple)):
        return [own(part) for part in node.elts]
    if isinstance(node, ast.UnaryOp) and type(node.op) in _UNARY:
        return _UNARY[type(node.op)](own(node.operand))
    if isinstance(node, ast.BinOp) and type(node.op) in _BINARY:
        return _operation(type(node.op), own(node.left), own(node.right))
    if isinstance(node, ast.BoolOp):
        results = map(own, node.values)
        return all(results) if isinstance(node.op, ast.And) else any(results)
    if isinstance(node, ast.Compare):
        values = [own(part) for part in (node.left, *node.comparators)]
        return all(_COMPARISONS[type(op)](*two) for op, two in zip(node.ops, zip(values, values[1:])))
    if isinstance(node, ast.IfExp):
        return own(node.body) if own(node.test) else own(node.orelse)
    if isinstance(node, ast.Subscript):
        return own(node.value)[own(node.slice)]
    if isinstance(node, ast.Call) and not node.keywords:
        return _call(node, own)
    raise InputError("what stands there is not computed here: write its value in its place.")


def _operation(kind, left, right):
    numbers = all(isinstance(one, (int, float)) for one in (left, right))
    if not numbers and not (kind is ast.Add and type(left) is type(right)):
        raise TypeError("it is no number")
    if kind is ast.Pow and numbers and abs(right) * math.log10(max(abs(left), 2)) > _MOST_DIGITS:
        raise ValueError("it is too large")
    result = _BINARY[kind](left, right)
    if isinstance(result, complex) or (isinstance(result, int) and abs(result) > 10**_MOST_DIGITS):
        raise ValueError("it is too large")
    return result


def _call(node, own):
    # math.cos is cos.
    function = node.func
    if isinstance(function, ast.Attribute) and isinstance(function.value, ast.Name):
        if function.value.id == "random":
            raise InputError("random numbers are drawn there: write a value in their place.")
        name = function.attr if function.value.id in ("math", "np", "numpy") else ""
    else:
        name = function.id if isinstance(function, ast.Name) else ""
    if name not in _FUNCTIONS:
        raise InputError(f"the function {ast.unparse(function)!r} is not known here: write its value in its place.")
    return _FUNCTIONS[name](*map(own, node.args))
