"""The JSON schema of the files of scans, from the same lists of keys that read them."""

from ..runs.configuration import TABLES
from ..runs.keys import Inline, Text
from ..runs.schema import DIALECT, configuration_schema
from .scan_file import SCAN


def scan_schema():
    """A JSON schema (draft 2020-12) of the TOML files of scans: a dict; see ``configuration_schema``."""
    base = {name: value for name, value in configuration_schema().items() if not name.startswith("$")}
    return {
        "$schema": DIALECT,
        "title": "A scan of openmm-cylchain",
        "type": "object",
        "properties": {
            "title": {"description": "Of the scan, for its figure.", **Text().schema()},
            SCAN.name: {"description": SCAN.text, **SCAN.schema()},
            "base": base,
            "vary": {
                "description": "Keys that vary, with the list of their values.",
                "type": "object",
                "properties": {kind.name: _values(kind, kind.repeated) for kind in TABLES},
                "additionalProperties": False,
            },
        },
        "required": [SCAN.name],
        "additionalProperties": False,
    }


def _values(kind, repeated=False):
    properties = {}
    for key in kind.keys:
        values = {"type": "array", "items": key.kind.schema(), "minItems": 1}
        nested = isinstance(key.kind, Inline)
        properties[key.name] = {"description": key.text} | (
            {"anyOf": [values, _values(key.kind.table)]} if nested else values
        )
    content = {"type": "object", "properties": properties, "additionalProperties": False}
    return {**content, "patternProperties": {"^[1-9][0-9]*$": _values(kind)}} if repeated else content
