"""The pages of the documentation, and the blocks of code on them."""

import re
from dataclasses import dataclass
from pathlib import Path

from support.repository import ROOT

PAGES = [ROOT / "README.md", ROOT / "ARCHITECTURE.md", ROOT / "CONTRIBUTING.md", ROOT / "CHANGELOG.md"]
PAGES += sorted(ROOT.glob("docs/**/*.md"))

_FENCE = re.compile(r"^( *)```([^\n]*)\n(.*?)^\1```$", flags=re.DOTALL | re.MULTILINE)
# README's commands beside the two that are run word for word.
_INDENTED_COMMAND = re.compile(r"^    ((?:openmm-cylchain|python studies) .*)$", flags=re.MULTILINE)


@dataclass(frozen=True)
class Block:
    """A block of code of a page."""

    page: Path
    language: str
    text: str


def name_of(page):
    """The path of a page in the repository."""
    return page.relative_to(ROOT).as_posix()


def blocks_of(page, *languages):
    """The blocks of a page that are in one of the languages, or all of them."""
    text = page.read_text()
    blocks = [Block(page, match[2].strip(), match[3]) for match in _FENCE.finditer(text)]
    blocks += [Block(page, "bash", command) for command in _INDENTED_COMMAND.findall(_FENCE.sub("", text))]
    return [block for block in blocks if not languages or block.language in languages]


def headings_of(text):
    """The names by which links lead to the headings of a page, as GitHub and the site make them."""
    titles = re.findall(r"^#+ +(.*?) *$", _FENCE.sub("", text), flags=re.MULTILINE)
    return {re.sub(r"[^\w\- ]", "", title.lower()).replace(" ", "-") for title in titles}
