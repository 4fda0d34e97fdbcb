"""The Python of a tutorial as a script: ``python docs/extensions/page_scripts.py PAGE.md`` runs it in this folder.

The blocks of a tutorial, one after the other, are a whole program, which writes the page's picture. The built site
has it as a file beside each tutorial.
"""

import re
import sys
from pathlib import Path

BLOCK = re.compile(r"^```python\n(.*?)^```$", flags=re.DOTALL | re.MULTILINE)


def script_of(page):
    """The blocks of a page, given as a path, in their order."""
    return "\n\n".join(BLOCK.findall(Path(page).read_text()))


def setup(app):
    """Write the scripts into the built site, and a link to each on its page."""
    app.connect("source-read", _add_link)
    app.connect("build-finished", _write_scripts)
    return {"parallel_read_safe": True, "parallel_write_safe": True}


def _add_link(app, page, source):
    if page.startswith("tutorials/") and BLOCK.search(source[0]):
        name = page.split("/")[1]
        title, text = source[0].split("\n", 1)
        source[0] = f'{title}\n\n<p><a href="{name}.py" download>The whole program: {name}.py</a></p>\n{text}'


def _write_scripts(app, exception):
    if exception is None and app.builder.format == "html":
        for page in sorted((Path(app.srcdir) / "tutorials").glob("*.md")):
            script = script_of(page)
            if script:
                (Path(app.outdir) / "tutorials" / f"{page.stem}.py").write_text(script)


if __name__ == "__main__":
    exec(compile(script_of(sys.argv[1]), sys.argv[1], "exec"), {})
