"""The documentation's settings; `make docs` builds it."""

import sys
import tomllib
from pathlib import Path

ROOT = Path(__file__).parent.parent
sys.path[:0] = [str(ROOT / "docs" / "_extensions")]

project = "capsule-sym"
author = "the capsule-sym authors"
with (ROOT / "pyproject.toml").open("rb") as file:
    release = version = tomllib.load(file)["project"]["version"]

extensions = [
    "myst_parser",
    "sphinx.ext.autodoc",
    "sphinx.ext.viewcode",
    "numpydoc",
    "sphinx_click",
    "sphinx_copybutton",
    "drawn",
    "commands",
    "headers",
    "mathml",
    "outside",
    "signatures",
]
exclude_patterns = ["_build"]
nitpicky = False  # types of private modules stand in signatures
myst_enable_extensions = ["colon_fence", "deflist", "dollarmath"]
myst_heading_anchors = 3
smartquotes = False  # they take -- for a dash
default_role = "code"  # single backticks in docstrings
html_math_renderer = "mathml"

autodoc_member_order = "bysource"
autodoc_typehints = "signature"
autodoc_typehints_format = "short"
numpydoc_show_class_members = False
numpydoc_xref_param_type = True  # by the aliases of `outside`
numpydoc_xref_ignore = "all"
python_use_unqualified_type_names = True

copybutton_prompt_text = "$ "  # of a session only the commands are copied

pygments_dark_style = "github-dark"
html_theme = "furo"
html_title = "capsule-sym"
html_static_path = ["_static", "explorer.png", "../capsule_sym/_explorer/page.html"]
html_css_files = ["pages.css"]
html_js_files = ["pages.js"]
html_copy_source = False
html_domain_indices = False
html_show_sourcelink = False
html_show_copyright = False

# DOIs lead to publishers that refuse robots.
linkcheck_ignore = [r"https://doi\.org/.*"]
