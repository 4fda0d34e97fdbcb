"""Links between pages, and to files; every page is on the site; every public name is in its reference."""

import inspect
import re

import pytest

import openmm_cylchain
from openmm_cylchain import Crosslinker, analysis, rendering, scans, theory
from openmm_cylchain.analysis import statistics
from openmm_cylchain.kinetics import presets
from support.pages import PAGES, headings_of, name_of
from support.repository import EXAMPLES, ROOT

DOCS = ROOT / "docs"
REFERENCE = {page.stem: page.read_text() for page in sorted((DOCS / "api").glob("*.rst"))}


@pytest.mark.parametrize("page", PAGES, ids=name_of)
def test_links_lead_somewhere(page):
    text = page.read_text()
    for target, heading in re.findall(r"\]\(([^)#\s]*)(?:#([^)\s]+))?\)", text):
        if target.startswith("http"):
            continue
        path = page.parent / target if target else page
        assert path.exists(), target
        if heading:
            assert heading in headings_of(path.read_text()), (target, heading)
    # Files that are named in code style.
    for path in re.findall(r"`([\w-]+/[\w/.-]+\.(?:py|h|cpp|md|toml|i))`", text):
        found = any((ROOT / folder / path).exists() for folder in ("", "openmm_cylchain", "plugin_src"))
        assert found or "yours" in path, path


def test_every_page_is_in_a_table_of_contents():
    """And in one only, so that there is one way to it."""
    listed = []
    for page in sorted(DOCS.rglob("*.md")):
        for block in re.findall(r"^```\{toctree\}\n(.*?)^```$", page.read_text(), flags=re.DOTALL | re.MULTILINE):
            listed += [(page.parent / line).resolve() for line in block.split("\n") if line and line[0] != ":"]
    pages = [page.with_suffix("").resolve() for page in sorted(DOCS.rglob("*.md"))]
    assert sorted(listed) == sorted({*pages, DOCS / "api" / "index"} - {DOCS / "index"})
    assert set(re.findall(r"^   (\w+)$", REFERENCE["index"], flags=re.MULTILINE)) == {*REFERENCE} - {"index"}


def entries(stem):
    directive = r"^\.\. auto(?:class|function|exception|data):: (?:[\w.]+\.)?(\w+)$"
    return re.findall(directive, REFERENCE[stem], flags=re.MULTILINE)


def test_every_public_name_is_in_the_reference():
    """Once, and nothing else is."""
    modules = {"analysis", "rendering", "scans", "theory"}
    named = [name for stem in REFERENCE if stem not in modules for name in entries(stem)]
    assert ".. automodule:: openmm_cylchain.kinetics.presets" in REFERENCE["linkers"]
    named += [name for name, thing in vars(presets).items() if isinstance(thing, Crosslinker)]
    # What a method returns, which nobody makes.
    named = [name for name in named if name != "LinkerPulls"]
    assert sorted(named) == sorted({*openmm_cylchain.__all__} - modules - {"__version__"})
    assert sorted(entries("analysis")) == sorted({*analysis.__all__} - {"statistics"})
    assert f".. automodule:: {statistics.__name__}" in REFERENCE["analysis"]
    assert sorted(entries("theory")) == sorted(theory.__all__)
    assert sorted(entries("rendering")) == sorted(rendering.__all__)


def test_public_names_have_docstrings():
    for module in (openmm_cylchain, analysis, rendering, theory):
        for name in module.__all__:
            thing = getattr(module, name)
            if inspect.isclass(thing) or inspect.isfunction(thing):
                assert len(thing.__doc__ or "") > 20, name


def test_every_example_is_in_the_gallery_with_its_picture():
    text = (DOCS / "gallery.md").read_text()
    for path in EXAMPLES.glob("*.py"):
        assert f"](../examples/{path.name})" in text, path.name
        assert f"](gallery/{path.stem}.png)" in text, path.name


def test_scans_are_in_the_reference():
    assert sorted(entries("scans")) == sorted(scans.__all__)


@pytest.mark.parametrize(
    "module", [openmm_cylchain, analysis, theory, rendering, scans, statistics], ids=lambda own: own.__name__
)
def test_signatures_are_short(module):
    """``help`` shows names of types, rather than what they stand for."""
    for name, thing in vars(module).items():
        for own in (thing, *(vars(thing).values() if inspect.isclass(thing) else ())):
            if inspect.isfunction(own):
                assert "numpy._typing" not in str(inspect.signature(own)), (name, own)
