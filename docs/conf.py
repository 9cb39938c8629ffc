"""Sphinx configuration."""

from __future__ import annotations

import warnings

import bingham

project = "bingham"
author = "The bingham developers"
copyright = "2026, The bingham developers"
release = version = bingham.__version__

extensions = [
    "sphinx.ext.autodoc",
    "sphinx.ext.autosummary",
    "sphinx.ext.mathjax",
    "sphinx.ext.viewcode",
    "numpydoc",
    "sphinx_gallery.gen_gallery",
]
exclude_patterns = ["_build", "examples", "_templates"]
templates_path = ["_templates"]
html_theme = "furo"
html_title = "bingham"
html_static_path = ["_static"]
math_number_all = False
math_eqref_format = "({number})"

autosummary_generate = True
autosummary_ignore_module_all = False
autodoc_typehints = "none"
autodoc_member_order = "bysource"
autodoc_default_options = {"members": True, "show-inheritance": False}
numpydoc_show_class_members = False
numpydoc_class_members_toctree = False
default_role = "code"

sphinx_gallery_conf = {
    "examples_dirs": "examples",
    "gallery_dirs": "gallery",
    "filename_pattern": r"plot_",
    "download_all_examples": False,
    "show_signature": False,
    "remove_config_comments": True,
    "min_reported_time": 60,
    "reset_argv": lambda *_: [],
}

# A page is built from these modules in any case; warnings of third parties are not errors of the documentation.
warnings.filterwarnings("ignore", category=DeprecationWarning)
