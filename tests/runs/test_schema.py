"""The JSON schema of configurations: what is valid, which mistakes it sees, and the page of all keys."""

import re
import sys

import jsonschema
import pytest

from openmm_cylchain import InputError
from openmm_cylchain.cli import main
from openmm_cylchain.runs.beginnings import START_NAMES, start_text
from openmm_cylchain.runs.configuration import TABLES, parse_configuration
from openmm_cylchain.runs.reference import reference_page
from openmm_cylchain.runs.schema import configuration_schema, format_schema
from support.configurations import BEAMS, BODIES, COMING_AND_GOING, ENDS, EVERYTHING, GROWING
from support.repository import EXAMPLES, ROOT
from support.staged_runs import MANY_CHANGES
from support.twisted_run import WOUND

if sys.version_info >= (3, 11):
    import tomllib
else:
    import tomli as tomllib

VALIDATOR = jsonschema.Draft202012Validator(configuration_schema())
FILES = [
    *(path.read_text() for path in sorted(EXAMPLES.glob("*.toml"))),
    *map(start_text, START_NAMES),
    EVERYTHING,
    BEAMS,
    GROWING,
    COMING_AND_GOING,
    ENDS,
    MANY_CHANGES,
    BODIES,
]


def mistakes(text):
    return [error.json_path for error in VALIDATOR.iter_errors(tomllib.loads(text))]


def test_it_is_a_schema():
    jsonschema.Draft202012Validator.check_schema(configuration_schema())
    assert format_schema(configuration_schema()).startswith(
        '{\n  "$schema": "https://json-schema.org/draft/2020-12/schema"'
    )


def test_command_prints_it(capsys):
    assert main(["schema"]) == 0
    assert capsys.readouterr().out == format_schema(configuration_schema()) + "\n"


@pytest.mark.parametrize("text", FILES, ids=lambda text: text.splitlines()[0][:30])
def test_files_are_valid(text):
    assert mistakes(text) == []
    parse_configuration(text)


def test_everything_has_every_table_and_the_examples_are_there():
    assert len(FILES) == 19
    # Joints are between filaments of beam elements.
    texts = EVERYTHING, BEAMS, BODIES, GROWING, COMING_AND_GOING, WOUND
    tables = {table for text in texts for table in tomllib.loads(text)}
    assert all(kind.name in tables for kind in TABLES)


@pytest.mark.parametrize(
    ("old", "new", "where"),
    [
        ('title = "everything"', "title = 3", "$.title"),
        ('title = "everything"', r'title = "two\nlines"', "$.title"),
        ("[solvent]", "[solvents]", "$"),
        ('temperature = "310 K"\n', "", "$.solvent"),
        ('temperature = "310 K"', "temperature = 310", "$.solvent.temperature"),
        ('temperature = "310 K"', 'temperature = "-310 K"', "$.solvent.temperature"),
        ('temperature = "310 K"', 'temperature = "310"', "$.solvent.temperature"),
        ('temperature = "310 K"', 'temperature = "K"', "$.solvent.temperature"),
        ('temperature = "310 K"', 'temperature = "3,1 K"', "$.solvent.temperature"),
        ('temperature = "310 K"', 'temprature = "310 K"', "$.solvent"),
        ('edges = ["2 um", ', "edges = [", "$.box.edges"),
        ("segments = [4, 6, 8]", "segments = 0", "$.filament[0].segments"),
        ("segments = [4, 6, 8]", "segments = 2.5", "$.filament[0].segments"),
        ("segments = [4, 6, 8]", 'segments = ["4"]', "$.filament[0].segments"),
        ('type = "F_ACTIN"', 'type = "ACTIN"', "$.filament[0].type"),
        ("closed = true", 'closed = "yes"', "$.filament[1].closed"),
        ('orientation = "nematic"', 'orientation = "smectic"', "$.filament[0].orientation"),
        ('shape = "cylinder"', 'shape = "cone"', "$.filament[0].inside.shape"),
        ('radius = "300 nm"', 'radios = "300 nm"', "$.filament[0].inside"),
        ("direction = [1, 0, 0]", "direction = [1, 0]", "$.filament[0].direction"),
        ("direction = [1, 0, 0]", "direction = [1, 0, nan]", None),
        ('type = "ALPHA_ACTININ"', 'type = "ACTININ"', "$.linkers[0].type"),
        ("hand = { reach", "hand = { rich", "$.linkers[0].hand"),
        ("node = 0", 'node = "first"', "$.tether[0].node"),
        ('tension = "0.1 pN"', 'tension = ["0.1 pN"]', "$.pull[0].tension"),
        ('diameter = "15 nm"', "diameter = true", "$.contacts.diameter"),
        ("[[wall]]", "[wall]", "$.wall"),
        ('scheme = "implicit"', 'scheme = "fast"', "$.simulation.scheme"),
        ("threads = 1", "threads = 0", "$.simulation.threads"),
        ("seed = 2", "sed = 2", "$.simulation"),
        ('time_step = "10 us"', "time_step = 10", "$.simulation.time_step"),
        ('duration = "2 ms"', "[[stage]]\nduration = 2\n[tmp]", "$.stage[0].duration"),
        ('duration = "2 ms"', "[[stage]]\nsolvents.temperature = '1 K'\n[tmp]", "$.stage[0]"),
        ('duration = "2 ms"', "[[stage]]\n[[stage.stage]]\nrepeat = 0\n[tmp]", "$.stage[0].stage[0].repeat"),
    ],
)
def test_mistakes_are_seen(old, new, where):
    text = EVERYTHING.replace(old, new, 1)
    assert text != EVERYTHING
    with pytest.raises(InputError):
        parse_configuration(text)
    found = mistakes(text)
    # "where" is None for what JSON does not have.
    assert where is None or where in found, found


def test_reference_page_is_made_from_the_same_list():
    """`python -m openmm_cylchain.runs.reference > docs/configuration.md` writes it anew."""
    page = reference_page()
    assert (ROOT / "docs" / "configuration.md").read_text() == page
    for kind in TABLES:
        assert f"`{kind.header}`" in page
        for key in kind.keys:
            assert re.search(rf"(?m)^\| `{key.name}` \| .+ \| .+ \|$", page), key.name
            assert key.text.endswith("."), key.name
