"""The JSON schema of configurations, from the same lists of keys that read them."""

import json

from .configuration import TABLES
from .keys import Text
from .tables.stages import CHANGES, STAGE

DIALECT = "https://json-schema.org/draft/2020-12/schema"


def configuration_schema():
    """A JSON schema (draft 2020-12) of the TOML files of runs: a dict.

    Editors complete and check with it. It knows keys, types, choices, ranges and how quantities are written, but not
    what depends on several keys, nor dimensions of units: ``read_configuration`` checks everything.
    """
    properties = {"title": {"description": "Of the run, for its summary.", **Text().schema()}}
    for kind in TABLES:
        content = {"description": kind.text, **kind.schema()}
        if kind.repeated:
            content = {"type": "array", "items": content, **({"minItems": 1} if kind.required else {})}
        properties[kind.name] = content
    properties[STAGE.name] = {"type": "array", "items": {"$ref": "#/$defs/stage"}, "minItems": 1}
    return {
        "$schema": DIALECT,
        "title": "A run of openmm-cylchain",
        "type": "object",
        "properties": properties,
        "required": [kind.name for kind in TABLES if kind.required],
        "additionalProperties": False,
        "$defs": {STAGE.name: _stage()},
    }


def _stage():
    # What its tables change may also be ramps, and of several tables by their names or numbers.
    content = {"description": STAGE.text, **STAGE.schema()}
    headers = {kind.name: kind.header for kind in TABLES}
    for name, keys in CHANGES.items():
        text = f"What changes of {headers[name]}: {', '.join(keys)}."
        content["properties"][name] = {"description": text, "type": "object"}
    content["properties"][STAGE.name] = {
        "description": "Stages within it, which come one after the other, as often as repeat says.",
        "type": "array",
        "items": {"$ref": "#/$defs/stage"},
        "minItems": 1,
    }
    return content


def format_schema(schema):
    """A schema as text."""
    return json.dumps(schema, indent=2, ensure_ascii=False)
