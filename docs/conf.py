"""Settings of Sphinx: the pages of this folder, the API reference from docstrings, and files of the repository."""

import sys
from pathlib import Path

HERE = Path(__file__).parent
sys.path[:0] = [str(HERE / "extensions"), str(HERE.parent / "studies")]

from openmm_cylchain import __version__  # noqa: E402

project = "openmm_cylchain"
author = "the authors of openmm_cylchain"
version = release = __version__

extensions = [
    "myst_parser",
    "sphinx.ext.autodoc",
    "sphinx.ext.napoleon",
    "docstrings",
    "equations",
    "repository_files",
    "page_scripts",
    "command_help",
    "built_links",
]
exclude_patterns = ["extensions", "_build"]

# Pages are Markdown that GitHub shows as well: equations between dollars, headings with names to link to.
myst_enable_extensions = ["dollarmath"]
myst_heading_anchors = 4
highlight_language = "none"
pygments_style = "tango"
pygments_dark_style = "github-dark"

autodoc_member_order = "bysource"
autodoc_default_options = {"members": True}
autodoc_typehints = "none"
napoleon_numpy_docstring = True
napoleon_google_docstring = False
napoleon_use_ivar = True
napoleon_use_rtype = False
napoleon_preprocess_types = False
add_module_names = False
toc_object_entries_show_parents = "hide"

html_theme = "furo"
html_title = "openmm_cylchain"
html_math_renderer = "mathml"
html_static_path = ["style"]
html_css_files = ["pages.css"]
html_show_sphinx = False
html_show_copyright = False
html_copy_source = False
html_theme_options = {"navigation_with_keys": True}
