"""How Sphinx builds the documentation: ``make docs``, in which every warning is an error."""

import sys
from pathlib import Path

DOCS = Path(__file__).parent
sys.path[:0] = [str(DOCS / "_extensions"), str(DOCS.parent)]

from jet_gym import __version__  # noqa: E402

project = "jet_gym"
author = "The jet_gym developers"
copyright = f"{author}, MIT licence"
version = release = __version__

extensions = [
    "command_examples",
    "environment_page",
    "layers_picture",
    "mathml",
    "myst_parser",
    "sphinx.ext.autodoc",
    "sphinx.ext.napoleon",
    "sphinx_copybutton",
    "sphinxcontrib.programoutput",
]
exclude_patterns = ["_build", "_generated", "_extensions"]
myst_enable_extensions = ["colon_fence", "dollarmath"]
myst_dmath_double_inline = True
myst_heading_anchors = 4
suppress_warnings = ["myst.header"]  # the environment's docstring begins below a page's title

smartquotes = False  # options begin with two hyphens

autodoc_member_order = "bysource"
autodoc_typehints = "signature"
autodoc_default_options = {"members": True, "show-inheritance": True}
napoleon_attr_annotations = False  # types stand in the signature
napoleon_use_ivar = True
napoleon_use_rtype = False
maximum_signature_line_length = 90

programoutput_prompt_template = "$ {command}\n{output}"
copybutton_exclude = ".linenos, .gp, .go"

html_math_renderer = "mathml"
html_theme = "furo"
html_title = "jet_gym"
html_static_path = ["_static"]
html_css_files = ["jet_gym.css"]
html_copy_source = False
html_show_sphinx = False
html_theme_options = {"navigation_with_keys": True}
