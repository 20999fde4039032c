"""Settings of Sphinx; see build.py."""

from __future__ import annotations

from tcrctl import __version__

project = "tcrctl"
author = "the tcrctl contributors"
copyright = author
version = release = __version__

extensions = ["myst_nb", "sphinx.ext.autodoc", "sphinx.ext.napoleon"]
root_doc = "index"
html_theme = "furo"
html_title = f"tcrctl {release}"
#: Indented blocks in the documents are commands and their output.
highlight_language = "none"
nitpicky = False

#: So deep are headings that links lead to.
myst_heading_anchors = 4
nb_execution_mode = "force"
nb_execution_raise_on_error = True
nb_execution_timeout = 300
nb_execution_show_tb = True

autodoc_member_order = "bysource"
autodoc_typehints = "description"
napoleon_use_ivar = True
