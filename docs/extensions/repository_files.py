"""Links from pages to files of the repository lead to pages that show these files, so that the site stands alone.

A page of an example begins with its description and its picture.
"""

import ast
import html
import posixpath
import re
from pathlib import Path

from docutils import nodes
from sphinx import addnodes
from sphinx.highlighting import PygmentsBridge
from sphinx.transforms.post_transforms import SphinxPostTransform
from sphinx.util import logging

ROOT = Path(__file__).resolve().parents[2]
# Files at the root that are pages.
PAGES = {
    "README.md": "index",
    "CHANGELOG.md": "changelog",
    "CONTRIBUTING.md": "contributing",
    "ARCHITECTURE.md": "architecture",
}
LEXERS = {".py": "python", ".h": "cpp", ".cpp": "cpp", ".toml": "toml", ".md": "markdown", ".cff": "yaml"}
logger = logging.getLogger(__name__)


def setup(app):
    """Register the transform of links and the pages that they lead to."""
    app.connect("source-read", _read_root_files)
    app.connect("builder-inited", lambda app: setattr(app, "linked_files", set(_examples())))
    app.add_post_transform(FileLinks)
    app.connect("html-collect-pages", _file_pages)
    return {"parallel_read_safe": True, "parallel_write_safe": False}


def _examples():
    return (path.relative_to(ROOT).as_posix() for path in sorted((ROOT / "examples").glob("*.py")))


def _read_root_files(app, page, source):
    """Pages of files at the root have their text; links to such files lead to the pages."""
    for name, own in PAGES.items():
        if page == own and page != "index":
            app.env.note_dependency(str(ROOT / name))
            source[0] = re.sub(r"\]\((?!https?:|#)", "](../", (ROOT / name).read_text()).replace("](../docs/", "](")
    source[0] = re.sub(r"^```mermaid\n(.*?)^```$", _table_of_flowchart, source[0], flags=re.DOTALL | re.MULTILINE)
    here = posixpath.dirname(page)
    for name, target in PAGES.items():
        source[0] = re.sub(
            rf"\]\((?:\.\./)+{re.escape(name)}(#[^)]*)?\)",
            lambda link, target=target: f"]({posixpath.relpath(target, here or '.')}.md{link[1] or ''})",
            source[0],
        )


_NODE = re.compile(r"(\w+)(?:\[\"([^\"]*)\"\]|\{(\w+)\})")


def _table_of_flowchart(block):
    """A flowchart of Mermaid, which needs a script of its own to be drawn, as a table of its arrows."""
    labels = {match[1]: match[2] or match[3] for match in _NODE.finditer(block[1])}
    rows = ["| from | by | to |", "|---|---|---|"]
    for start, by, end in re.findall(r"(\w+) -->(?:\|\"?([^|\"]*)\"?\|)? (\w+)", _NODE.sub(r"\1", block[1])):
        rows.append(f"| {labels[start]} | {by} | {labels[end]} |".replace("<br>", ", "))
    return "\n".join(rows)


class FileLinks(SphinxPostTransform):
    """Downloads of files of the repository become links to pages that show them."""

    # Before Sphinx copies what is to be downloaded.
    default_priority = 5

    def run(self, **kwargs):
        """Replace all of a page."""
        for node in list(self.document.findall(addnodes.download_reference)):
            path = Path(self.env.relfn2path(node["reftarget"], self.env.docname)[1]).resolve()
            if not path.is_file() or not path.is_relative_to(ROOT) or path.suffix == ".png":
                logger.warning("no file of the repository: %s", node["reftarget"], location=node)
                continue
            name = path.relative_to(ROOT).as_posix()
            target = PAGES.get(name, f"files/{name}")
            if name not in PAGES:
                self.app.linked_files.add(name)
            uri = self.app.builder.get_relative_uri(self.env.docname, target)
            link = nodes.reference("", "", *node.children, internal=True, refuri=uri)
            node.replace_self(link)


def _file_pages(app):
    bridge = PygmentsBridge("html", app.config.pygments_style)
    for name in sorted(app.linked_files):
        path = ROOT / name
        text = path.read_text()
        code = bridge.highlight_block(text, LEXERS.get(path.suffix, "none"), linenos=False)
        page = f"files/{name}"
        body = f"<h1>{html.escape(name)}</h1>"
        picture = ROOT / "docs" / "gallery" / f"{path.stem}.png"
        if name.startswith("examples/") and path.suffix == ".py":
            title, *paragraphs = ast.get_docstring(ast.parse(text)).split("\n\n")
            body = f"<h1>{html.escape(title)}</h1>" + "".join(
                f"<p>{html.escape(one)}</p>" if not one.startswith("    ") else f"<pre>{html.escape(one.strip())}</pre>"
                for one in paragraphs
            )
            if picture.exists():
                source = posixpath.relpath(f"_images/{picture.name}", posixpath.dirname(page))
                body += f'<img src="{source}" alt="{html.escape(title)}">'
            body += f"<p><code>{html.escape(name)}</code></p>"
        yield page, {"title": name, "body": body + code, "pagename": page}, "page.html"
