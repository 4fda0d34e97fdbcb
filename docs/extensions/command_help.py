"""The directive ``command-help``: what ``--help`` prints, for every command and every study that there is."""

import argparse
import os

from docutils import nodes
from sphinx.util.docutils import SphinxDirective

from command_line import create_parser
from openmm_cylchain import cli


class CommandHelp(SphinxDirective):
    """A section for each command."""

    def run(self):
        """Sections with the texts of the parsers."""
        os.environ["COLUMNS"] = "100"
        commands = [*commands_of(cli._parser()), *commands_of(create_parser())]
        return [section for name, parser in commands for section in self._section(name, parser)]

    def _section(self, name, parser):
        section = nodes.section(ids=[nodes.make_id(name)], names=[name])
        section += nodes.title("", "", nodes.literal("", name))
        section += nodes.literal_block("", parser.format_help(), language="none")
        self.state.document.note_implicit_target(section)
        return [section]


def commands_of(parser):
    """Pairs of the words of a command and its parser, for all that do something."""
    below = [action for action in parser._actions if isinstance(action, argparse._SubParsersAction)]
    if not below:
        return [(parser.prog, parser)]
    return [pair for action in below for one in action.choices.values() for pair in commands_of(one)]


def setup(app):
    """Register the directive."""
    app.add_directive("command-help", CommandHelp)
    return {"parallel_read_safe": True, "parallel_write_safe": True}
