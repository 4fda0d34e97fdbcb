"""Tables as TOML, the same text for the same content."""

import json
import re

_BARE = re.compile(r"[A-Za-z0-9_-]+")


def toml_text(entries):
    """The text of a configuration that tomllib has read: ``entries`` again when tomllib reads it.

    They are texts, numbers, true and false, lists, and tables of these.
    """
    lines = [f"{_key(name)} = {_value(value)}" for name, value in entries.items() if not _is_table(value)]
    for name, value in entries.items():
        if isinstance(value, dict):
            lines += ["", f"[{_key(name)}]", *_pairs(value)]
        elif _is_table(value):
            for own in value:
                lines += ["", f"[[{_key(name)}]]", *_pairs(own)]
    return "\n".join(lines).strip("\n") + "\n"


def _is_table(value):
    return isinstance(value, dict) or (
        isinstance(value, list) and value != [] and all(isinstance(own, dict) for own in value)
    )


def _pairs(table):
    return [f"{_key(name)} = {_value(value)}" for name, value in table.items()]


def _key(name):
    return name if _BARE.fullmatch(name) else json.dumps(name)


def _value(value):
    if isinstance(value, bool):
        return str(value).lower()
    if isinstance(value, (int, float)):
        return repr(value)
    if isinstance(value, str):
        return json.dumps(value, ensure_ascii=False).replace("\x7f", "\\u007f")
    if isinstance(value, list):
        return f"[{', '.join(map(_value, value))}]"
    if isinstance(value, dict):
        return f"{{ {', '.join(_pairs(value))} }}" if value else "{}"
    raise TypeError(f"{value!r} is no value of a configuration.")
