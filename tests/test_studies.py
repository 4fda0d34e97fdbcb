"""``python studies``: the folder is run as it stands in a clone, with the package that is installed."""

import subprocess
import sys

import pytest

from support.repository import ROOT


@pytest.mark.parametrize(
    "arguments",
    [("benchmark", "engines", "--json"), pytest.param(("reproduce", "nobody1999", "--output"), marks=pytest.mark.slow)],
)
def test_running_the_folder(arguments, tmp_path):
    """What is wrong is refused before anything is measured, in the words of openmm-cylchain."""
    command = [sys.executable, "studies", *arguments, str(tmp_path)]
    finished = subprocess.run(command, cwd=ROOT, capture_output=True, text=True)
    assert finished.returncode == 2, finished.stderr
    assert finished.stderr.startswith("error: ") and finished.stdout == ""
