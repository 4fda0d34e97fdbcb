"""Where the files of the repository lie."""

from pathlib import Path

ROOT = Path(__file__).parents[2]
EXAMPLES = ROOT / "examples"
PACKAGE = ROOT / "openmm_cylchain"
STUDIES = ROOT / "studies"
TESTS = ROOT / "tests"
