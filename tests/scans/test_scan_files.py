"""Files of scans: points, replicas and seeds, what is refused with its line, the schema, and TOML that is written."""

import sys

import jsonschema
import pytest

from openmm_cylchain import InputError
from openmm_cylchain.cli import main
from openmm_cylchain.runs.beginnings import START_NAMES, start_text
from openmm_cylchain.runs.configuration import parse_configuration
from openmm_cylchain.runs.reference import section
from openmm_cylchain.scans import read_scan
from openmm_cylchain.scans.scan_file import SCAN
from openmm_cylchain.scans.schema import scan_schema
from openmm_cylchain.scans.toml_text import toml_text
from support.configurations import EVERYTHING
from support.repository import ROOT
from support.small_runs import NETWORK, TWO_TYPES

if sys.version_info >= (3, 11):
    import tomllib
else:
    import tomli as tomllib

SCAN_TEXT = """title = "grid"
[scan]
base = "run.toml"
replicas = 3
gather = ["persistence length"]
[vary]
solvent.temperature = ["300 K", "310 K"]
filament.1.segments = [4, 6, 8]
filament.2.clamped = [[0], [0, 1]]
"""


@pytest.fixture
def base(tmp_path):
    (tmp_path / "run.toml").write_text(TWO_TYPES)
    return tmp_path


def scan_of(folder, text):
    path = folder / "scan.toml"
    path.write_text(text)
    return read_scan(path)


def test_all_points_with_their_replicas(base):
    scan = scan_of(base, SCAN_TEXT)
    assert len(scan.runs) == 2 * 3 * 2 * 3
    assert scan.title == "grid" and scan.gather == ("persistence length",) and scan.attempts == 3
    assert [axis.label for axis in scan.axes] == ["solvent.temperature", "filament.1.segments", "filament.2.clamped"]
    assert [axis.numbers for axis in scan.axes] == [([300.0, 310.0], "K"), ([4, 6, 8], ""), None]
    run = scan.runs[-1]
    assert run.label == ("solvent.temperature = 310 K, filament.1.segments = 8, filament.2.clamped = [0, 1], replica 3")
    configuration = parse_configuration(run.text)
    first, second = configuration.filaments
    assert configuration.solvent.temperature == 310.0 and configuration.simulation.seed == run.seed
    assert first.segments == 8 and second.clamped == (0, 1)
    assert len({run.seed for run in scan.runs}) == len({run.name for run in scan.runs}) == 36
    assert all(1 <= run.seed < 2**31 for run in scan.runs)


def test_seeds_and_digests_stay_when_a_scan_grows(base):
    before = {run.label: run for run in scan_of(base, SCAN_TEXT).runs}
    grown = SCAN_TEXT.replace("replicas = 3", "replicas = 5").replace('"300 K"', '"290 K", "300 K"')
    after = {run.label: run for run in scan_of(base, grown).runs}
    assert len(after) == 90 and before.items() <= after.items()
    other = scan_of(base, SCAN_TEXT.replace("replicas = 3", "replicas = 3\nseed = 2"))
    assert not {run.seed for run in other.runs} & {run.seed for run in before.values()}
    # Comments change nothing, and the content of files to start from does.
    (base / "run.toml").write_text(f"# remark\n{TWO_TYPES}")
    assert {run.label: run for run in scan_of(base, SCAN_TEXT).runs} == before


def test_base_within_the_scan(tmp_path):
    inline = "\n".join(
        line.replace("[[", "[[base.") if line.startswith("[[") else line.replace("[", "[base.", line.startswith("["))
        for line in TWO_TYPES.replace('title = "two types"', "").splitlines()
    )
    text = f"[scan]\nreplicas = 2\n[vary]\nsolvent.viscosity = ['1 mPa*s', '2 mPa*s']\n{inline}"
    scan = scan_of(tmp_path, text)
    assert [parse_configuration(run.text).simulation.steps for run in scan.runs] == [300] * 4
    with pytest.raises(InputError, match=r"scan.toml, line 8: \[solvent\] temperature must be positive"):
        scan_of(tmp_path, text.replace('"310 K"', '"-310 K"'))


@pytest.mark.parametrize(
    ("old", "new", "message"),
    [
        ("replicas = 3", "replicas = 0", r"line 4: \[scan\] replicas must be at least 1, but is 0"),
        ("replicas = 3", "replica = 3", r"line 4: \[scan\] has an unknown key 'replica'. Did you mean 'replicas'"),
        ("replicas = 3", "replicas = 99999", r"line 4: .* make 1199988 runs: there can be 100000"),
        ('base = "run.toml"', 'base = "no.toml"', r"line 3: \[scan\] base .*no.toml' does not exist"),
        ('base = "run.toml"\n', "", r"line 2: \[scan\] needs a run on which all are based"),
        (
            '["persistence length"]',
            '["persistance"]',
            r"line 5: .*gather\[0\] must be one of .*mean 'persistence length'",
        ),
        ("solvent.temperature", "solvent.temperatur", r"line 7: .*solvent has an unknown key.*mean 'temperature'"),
        ("solvent.temperature", "sovent.temperature", r"line 7: \[vary\] has an unknown key 'sovent'. Did you mean"),
        ('["300 K", "310 K"]', '"300 K"', r"line 7: \[vary\] solvent.temperature must be a list of values"),
        ('"310 K"]', '"310 nm"]', r"line 7: \[vary\] solvent.temperature\[1\] has the unit nm"),
        ('"310 K"]', '"300 K"]', r"line 7: \[vary\] solvent.temperature\[1\] is '300 K' again"),
        ("filament.1.segments", "filament.segments", r"line 8: .*does not say which: the run has 2 \[\[filament\]\]"),
        ("filament.1.segments", "filament.3.segments", r"line 8: .*filament.3 does not exist: .*counted from 1"),
        ("filament.1.segments", "linkers.count", r"line 8: .*varies nothing: the run has no \[\[linkers\]\] table"),
        (
            "[0, 1]]",
            "[0, 9]]",
            r"line 9: .*filament.*9.* That is with solvent.temperature = 300 K, .*clamped = \[0, 9\]",
        ),
        ("[vary]", "[very]", r"the scan has an unknown key 'very'. Did you mean 'vary'"),
        ("title", "title = 3 #", r"line 1: title must be a text"),
        ("[vary]", "[vary", r"not valid TOML"),
    ],
)
def test_mistakes_are_named_with_their_line(base, old, new, message):
    assert SCAN_TEXT.count(old) == 1
    with pytest.raises(InputError, match=f"scan.toml.*{message}"):
        scan_of(base, SCAN_TEXT.replace(old, new))


def test_seeds_cannot_vary(base):
    with pytest.raises(InputError, match=r"line 7: \[vary\] simulation.seed is derived for each run"):
        scan_of(base, SCAN_TEXT.replace('solvent.temperature = ["300 K", "310 K"]', "simulation.seed = [1, 2]"))


def test_mistakes_of_the_base_are_those_of_its_file(base):
    (base / "run.toml").write_text(TWO_TYPES.replace('"310 K"', '"310"'))
    with pytest.raises(InputError, match=r"run.toml, line 4: \[solvent\] temperature"):
        scan_of(base, SCAN_TEXT)


@pytest.mark.parametrize("text", [EVERYTHING, NETWORK, TWO_TYPES, *map(start_text, START_NAMES)])
def test_toml_is_read_as_it_was_written(text):
    entries = tomllib.loads(text)
    again = toml_text(entries)
    assert tomllib.loads(again) == entries and toml_text(tomllib.loads(again)) == again


def test_toml_of_unusual_values():
    entries = {"title": 'a "b" \\ ü\t', "x y": {"a": [[1, 2.5e-7], [True]], "b": {}, "c": {"d.e": 1e20}}, "l": []}
    assert tomllib.loads(toml_text(entries)) == entries


def test_schema_takes_scans_and_refuses_mistakes(capsys):
    schema = scan_schema()
    jsonschema.Draft202012Validator.check_schema(schema)
    validator = jsonschema.Draft202012Validator(schema)
    content = tomllib.loads(SCAN_TEXT)
    validator.validate(content)
    for old, new in (("temperature", "temperatur"), ("[4, 6, 8]", "[4, -6]"), ("replicas = 3", "replicas = 0")):
        assert not validator.is_valid(tomllib.loads(SCAN_TEXT.replace(old, new)))
    assert main(["schema", "--scan"]) == 0
    assert '"A scan of openmm-cylchain"' in capsys.readouterr().out


def test_the_page_has_all_keys():
    page = (ROOT / "docs" / "scans.md").read_text()
    assert "\n".join(section(SCAN, "##", SCAN.header)) in page
