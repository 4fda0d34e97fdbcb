"""The command line of the studies, with progress, errors and exit codes of ``openmm-cylchain``."""

import argparse

import benchmark.command
import reproduce.command
from openmm_cylchain.cli import run_command


def main(arguments=None):
    """Run a study and return the exit code.

    Parameters
    ----------
    arguments : list of str, optional
        Those of the command line if not given.
    """
    return run_command(create_parser(), arguments)


def create_parser():
    """The parser of all studies."""
    parser = argparse.ArgumentParser(
        prog="python studies", description="Speed of openmm_cylchain, and the results of papers computed again."
    )
    commands = parser.add_subparsers(required=True, metavar="STUDY")
    benchmark.command.add_command(commands)
    reproduce.command.add_command(commands)
    return parser
