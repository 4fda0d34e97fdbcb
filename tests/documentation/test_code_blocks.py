"""Every block of code on every page: Python runs, TOML is a configuration, commands exist with these options."""

import re
import shlex
import shutil
from pathlib import Path

import matplotlib
import numpy as np
import pytest

import command_line
from openmm_cylchain import analysis, cli
from openmm_cylchain.runs.beginnings import write_start
from openmm_cylchain.runs.configuration import read_configuration
from openmm_cylchain.scans import read_scan
from support.pages import PAGES, blocks_of, name_of
from support.repository import ROOT

matplotlib.use("Agg")

LANGUAGES = {"python", "toml", "sh", "bash", "text", "mermaid", "{toctree}", "{command-help}"}
# That of the README is in tests/test_readme.py.
PYTHON_PAGES = [page for page in PAGES if blocks_of(page, "python") and page.name != "README.md"]
# Pages whose blocks take more than a few seconds.
SLOW = {
    f"docs/tutorials/{name}.md"
    for name in (
        "buckling",
        "contractile_bundle",
        "dna_persistence_length",
        "force_extension",
        "loop_extrusion",
        "magnetic_tweezers",
    )
}

FILAMENTS_IN_A_SYSTEM = """
import openmm
from openmm import app, unit
from openmm_cylchain import *
viscosity = 1.71e-3 * unit.pascal * unit.second
box = [[1500, 0, 0], [0, 1500, 0], [0, 0, 1500]]
filaments = Filaments(viscosity, 310 * unit.kelvin)
short = F_ACTIN.with_segment_length(100 * unit.nanometer)
for y in (0, 60):
    filaments.add_straight(short, 10, [0, y, 0], [1, 0, 0])
"""
BUILT = FILAMENTS_IN_A_SYSTEM + "topology, system, positions = filaments.build()\n"
# A short run in a directory.
RUN = """
from pathlib import Path
from openmm_cylchain import analysis, cli
Path("quick.toml").write_text('''
[solvent]
temperature = "310 K"
viscosity = "1.71 mPa*s"
[[filament]]
type = "F_ACTIN"
segments = 8
count = 4
[simulation]
time_step = "10 ns"
duration = "2 us"
report_interval = "100 ns"
seed = 1
''')
assert cli.main(["run", "quick.toml", "--output", "DIRECTORY"]) == 0
"""
# A scan of one run.
SCAN = (
    RUN.partition("assert")[0].replace("quick.toml", "dna.toml")
    + """
Path("scan.toml").write_text('''
[scan]
base = "dna.toml"
gather = ["persistence length", "mean square end-to-end distance"]
[vary]
solvent.temperature = ["310 K"]
''')
"""
)
# A run of two stages.
STAGED = """
from pathlib import Path
from openmm_cylchain import cli
Path("staged.toml").write_text('''
[solvent]
temperature = "310 K"
viscosity = "1.71 mPa*s"
[[filament]]
type = "F_ACTIN"
segments = 8
count = 4
[[linkers]]
type = "ALPHA_ACTININ"
count = 10
volume = "1 um^3"
[simulation]
time_step = "10 ns"
report_interval = "100 ns"
[[stage]]
duration = "0.5 us"
[[stage]]
duration = "0.5 us"
linkers.count = 20
''')
assert cli.main(["run", "staged.toml", "--output", "staged"]) == 0
"""
# What a page takes as given, by the page and the beginning of the block before which it runs.
GIVEN = {
    ("docs/guide.md", "from openmm_cylchain import analysis"): RUN.replace("DIRECTORY", "output_f_actin"),
    ("docs/kinetics.md", "from openmm_cylchain import analysis"): RUN.replace("DIRECTORY", "extruded"),
    ("docs/pictures.md", "from openmm_cylchain import analysis"): RUN.replace("DIRECTORY", "motor_network"),
    ("docs/stages.md", "from openmm_cylchain import analysis"): STAGED,
    ("docs/scans.md", "from concurrent.futures"): SCAN,
    ("docs/time_step.md", "step = filaments"): BUILT,
    ("docs/walls.md", "from openmm import unit"): BUILT,
    ("docs/walls.md", "simulation.step"): """
integrator = filaments.create_integrator(system, 1 * unit.microsecond)
simulation = app.Simulation(topology, system, integrator, openmm.Platform.getPlatformByName("CPU"))
simulation.context.setPositions(positions)
""",
    ("docs/networks.md", "topology, system, positions"): FILAMENTS_IN_A_SYSTEM,
    ("docs/networks.md", "integrator.setTemperature"): """
context = openmm.Context(system, integrator, openmm.Platform.getPlatformByName("CPU"))
context.setPositions(positions)
""",
}


@pytest.fixture(autouse=True)
def _in_temporary_directory(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)


def slow_ones_marked(pages):
    return [pytest.param(page, marks=pytest.mark.slow) if name_of(page) in SLOW else page for page in pages]


@pytest.mark.parametrize("page", slow_ones_marked(PYTHON_PAGES), ids=name_of)
def test_python_runs(page):
    """All blocks of a page in their order, in one namespace, after what the page takes as given."""
    names, used = {"__name__": "page"}, set()
    for number, block in enumerate(blocks_of(page, "python")):
        for (owner, beginning), setup in GIVEN.items():
            if owner == name_of(page) and block.text.startswith(beginning):
                exec(setup, names)
                used.add(beginning)
        exec(compile(block.text, f"{name_of(page)}, block {number + 1}", "exec"), names)
    assert used == {beginning for owner, beginning in GIVEN if owner == name_of(page)}
    if page.parent.name == "tutorials":
        assert Path(f"{page.stem}.png").stat().st_size > 10000
    if page.name == "own_system.md":
        _assert_that_all_move()
    if "simulation" in names:
        assert names["simulation"].currentStep > 0


def _assert_that_all_move():
    """Nodes and what was there, and nothing is thrown anywhere."""
    for directory, least, most in (("protein", 1e-6, 1.0), ("own_run", 0.01, 60.0)):
        run = analysis.load(directory)
        moved = np.linalg.norm(run.positions(-1) - run.positions(0), axis=1)
        assert len(run) > 3 and moved.min() > least and moved.max() < most, (directory, moved.min(), moved.max())
    assert cli.main(["render", "own_run", "--size", "160x120", "--output", "own_run.png"]) == 0


def test_what_is_given_belongs_to_pages():
    assert {owner for owner, _ in GIVEN} <= {name_of(page) for page in PYTHON_PAGES}
    assert {name_of(page) for page in PYTHON_PAGES} >= SLOW
    assert len(PYTHON_PAGES) > 10


def test_every_block_says_what_it_is():
    """A block without a language, or in one that is not checked here, would be skipped in silence."""
    for page in PAGES:
        for block in blocks_of(page):
            assert block.language in LANGUAGES, (name_of(page), block.text[:60])


def test_toml_is_a_configuration(tmp_path):
    blocks = [block for page in PAGES for block in blocks_of(page, "toml")]
    assert blocks
    for block in blocks:
        path = tmp_path / "block.toml"
        path.write_text(block.text)
        if "[scan]" in block.text:
            write_start("dna", tmp_path / "dna.toml")
            assert len(read_scan(path).runs) > 1
        else:
            read_configuration(path)


def commands_of(block):
    """Commands of this package in a shell block: lists of words."""
    text = block.text.replace("\\\n", " ")
    for line in re.split(r"\n|&&", text):
        words = [word for word in shlex.split(line, comments=True) if not re.match(r"[A-Z_]+=", word)]
        if ">" in words:
            words = words[: words.index(">")]
        if words:
            yield words


COMMANDS = [(page, words) for page in PAGES for block in blocks_of(page, "sh", "bash") for words in commands_of(block)]
INLINE = [
    (page, shlex.split(command))
    for page in PAGES
    for command in re.findall(r"`((?:openmm-cylchain|python studies) [^`\n]*)`", page.read_text())
]


def test_commands_exist_with_these_options(capsys):
    checked = 0
    for page, words in COMMANDS:
        words = [words[0].removeprefix(".venv/bin/"), *words[1:]]
        program = words[0]
        if program == "openmm-cylchain" or words[:2] == ["python", "studies"]:
            parse(page, words, capsys)
            checked += 1
        elif program == "python" and words[1].endswith(".py"):
            assert (ROOT / words[1]).exists(), (name_of(page), words)
        else:
            known = {
                "python3",
                "python",
                "source",
                "pip",
                "pytest",
                "apt",
                "conda",
                "cmake",
                "ctest",
                "pre-commit",
                "mypy",
                "sphinx-build",
            }
            assert program in known or shutil.which(program), (name_of(page), words)
    assert checked >= 6


def parser_and_arguments(words):
    return (command_line.create_parser(), words[2:]) if words[0] == "python" else (cli._parser(), words[1:])


def parse(page, words, capsys):
    parser, arguments = parser_and_arguments(words)
    try:
        parser.parse_args(arguments)
    except SystemExit as refusal:
        assert refusal.code == 0, (name_of(page), words, capsys.readouterr().err)


def test_commands_in_text_exist():
    """In running text, a command may leave its arguments out; its words and options are there."""
    assert len(INLINE) > 20
    for page, words in INLINE:
        parser, arguments = parser_and_arguments(words)
        for word in arguments:
            word = word.strip("[],.")
            choices = next((one.choices for one in parser._actions if hasattr(one.choices, "keys")), {})
            if word in choices:
                parser = choices[word]
            elif word.startswith("--"):
                assert word in parser._option_string_actions, (name_of(page), words)
            else:
                # An argument, never a word where a command must be.
                assert not choices, (name_of(page), words)
