"""Templates: configurations with [[ expressions ]], which Cytosim's preconfig makes many files of.

Here, as there, each one becomes its value, and a list the first of its values, which is said.
"""

import re

from ..errors import InputError
from .arithmetic import evaluate
from .grammar import ScriptError

_MOST_SHOWN = 60
_SNIPPET = re.compile(r"\[\[(.*?)\]\](?!\])", re.DOTALL)
_ASSIGNMENT = re.compile(r"\s*\(?\s*([A-Za-z_]\w*)\s*\)?\s*=(?!=)(.*)", re.DOTALL)


def expand_template(text, given=None):
    """The text with values in the place of its expressions, and a (line, sentence) for each choice.

    Parameters
    ----------
    text : str
    given : dict, optional
        Values of names, which assignments to them do not change.

    Raises
    ------
    ScriptError
        For an expression whose value cannot be had.
    """
    given = dict(given or {})
    names, choices = dict(given), []

    def value_of(match):
        line = text.count("\n", 0, match.start()) + 1
        code = match[1]
        shown = f"[[{code.strip().splitlines()[0][:_MOST_SHOWN] if code.strip() else ''}]]"
        assignment = _ASSIGNMENT.fullmatch(code)
        name, expression = (assignment[1], assignment[2]) if assignment else (None, code)
        if name in given:
            return _in_place(match[0], "")
        try:
            value = evaluate(expression, names)
        except InputError as error:
            raise ScriptError(line, f"{shown}: {error}") from None
        if isinstance(value, list):
            if not value:
                raise ScriptError(line, f"{shown} has no values.")
            choices.append((line, f"{shown} has {len(value)} values: the first is taken, {value[0]}"))
            value = value[0]
        if name is not None:
            names[name] = value
            return _in_place(match[0], "")
        return _in_place(match[0], str(value))

    return _SNIPPET.sub(value_of, text), choices


def _in_place(snippet, value):
    # Lines keep their numbers.
    return value + "\n" * snippet.count("\n")
