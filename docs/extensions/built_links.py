"""Links within the built site lead to files and places that are there, and nothing is loaded from outside."""

import re
from functools import cache
from pathlib import Path
from urllib.parse import unquote

from sphinx.errors import ExtensionError


def setup(app):
    """Look when everything has been written."""
    app.connect("build-finished", _check, priority=900)
    return {"parallel_read_safe": True, "parallel_write_safe": True}


@cache
def _places(page):
    return set(re.findall(r' id="([^"]+)"', page.read_text()))


def _check(app, exception):
    if exception is not None or app.builder.name != "html":
        return
    _places.cache_clear()
    lost = []
    for page in sorted(Path(app.outdir).rglob("*.html")):
        for markup, link in re.findall(r'(<(?:a|img|link|script)\b)[^>]*?\b(?:href|src)="([^"]+)"', page.read_text()):
            target, _, place = unquote(link).partition("#")
            target = target.split("?")[0]
            if re.match(r"[a-z]+:", link):
                if not markup.startswith("<a"):
                    lost.append(f"{page.relative_to(app.outdir)} loads {link}")
                continue
            path = (page.parent / target).resolve() if target else page
            if not path.exists() or (place and path.suffix == ".html" and place not in _places(path)):
                lost.append(f"{page.relative_to(app.outdir)}: {link}")
    if lost:
        raise ExtensionError("links that lead nowhere:\n" + "\n".join(lost))
