"""How Sphinx makes the site: ``make docs`` writes it to build/docs."""

import sys
from pathlib import Path

from stickslip import _core

sys.path.insert(0, str(Path(__file__).parent / "extensions"))

project = "stickslip"
author = "the stickslip authors"
copyright = author  # noqa: A001 - the name that Sphinx reads
version = release = _core.__version__

extensions = [
    "myst_parser",
    "sphinx.ext.autodoc",
    "sphinx.ext.napoleon",
    "command_line",
    "docstrings",
    "live",
    "mathml",
    "pictures",
]
source_suffix = {".md": "markdown"}
exclude_patterns = ["figures/**", "extensions/**"]
nitpicky = False
suppress_warnings = ["myst.header"]

myst_enable_extensions = ["colon_fence", "deflist", "dollarmath", "attrs_block"]
myst_heading_anchors = 3

autodoc_typehints = "none"
autodoc_member_order = "bysource"
autodoc_inherit_docstrings = False
napoleon_google_docstring = False
napoleon_use_rtype = False
napoleon_use_ivar = True

html_theme = "furo"
html_title = "stickslip"
html_static_path = ["static"]
html_css_files = ["site.css"]
html_show_sphinx = False
html_copy_source = False
html_show_sourcelink = False
smartquotes_action = "qe"  # two hyphens stay: they begin an option
html_math_renderer = "mathml"
html_theme_options = {
    "light_css_variables": {"color-brand-primary": "#0072b2", "color-brand-content": "#0072b2"},
    "dark_css_variables": {"color-brand-primary": "#56b4e9", "color-brand-content": "#56b4e9"},
}
