"""The JSON schema of configurations, from the same lists of keys that read them."""

import json

from .configuration import TABLES
from .keys import Text

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
    return {
        "$schema": DIALECT,
        "title": "A run of openmm-cylchain",
        "type": "object",
        "properties": properties,
        "required": [kind.name for kind in TABLES if kind.required],
        "additionalProperties": False,
    }


def format_schema(schema):
    """A schema as text."""
    return json.dumps(schema, indent=2, ensure_ascii=False)
