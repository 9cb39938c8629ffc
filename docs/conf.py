"""Sphinx configuration."""

from __future__ import annotations

import doctest
import re
import sys
import warnings
from pathlib import Path

sys.path.insert(0, str(Path(__file__).parent))

import generated
from sphinx.util import logging
from study_results import fill_results

import bingham

project = "bingham"
author = "The bingham developers"
copyright = "2026, The bingham developers"
release = version = bingham.__version__

extensions = [
    "sphinx.ext.autodoc",
    "sphinx.ext.autosummary",
    "mathml",
    "names",
    "links",
    "sphinx.ext.viewcode",
    "numpydoc",
    "sphinx_gallery.gen_gallery",
]
exclude_patterns = ["_build", "examples", "_templates"]
templates_path = ["_templates"]
html_theme = "furo"
html_title = "bingham"
html_static_path = ["_static"]
html_css_files = ["page.css"]
html_math_renderer = "mathml"
math_number_all = False
math_eqref_format = "({number})"

autosummary_generate = True
autosummary_ignore_module_all = False
autodoc_typehints = "none"
autodoc_member_order = "bysource"
autodoc_default_options = {"members": True}
viewcode_follow_imported_members = False
numpydoc_show_class_members = False
numpydoc_class_members_toctree = False
default_role = "py:obj"
suppress_warnings = ["ref.python"]

sphinx_gallery_conf = {
    "examples_dirs": "examples",
    "gallery_dirs": "gallery",
    "filename_pattern": r"plot_",
    "download_all_examples": False,
    "show_signature": False,
    "remove_config_comments": True,
    "min_reported_time": 60,
    "write_computation_times": False,  # that page asks the network for its scripts
}


def fill_in(app, docname: str, source: list[str]) -> None:
    """Put what the program tells of itself, and the list of study pages, where a page asks for them."""
    studies = sorted(p.stem for p in (Path(__file__).parent / "studies").glob("*.rst") if p.stem != "index")
    entries = "\n".join(f"   {stem}" for stem in studies)
    tree = f".. toctree::\n   :maxdepth: 1\n\n{entries}" if studies else ""
    source[0] = fill_results(source[0].replace("{{studies}}", tree))
    source[0] = re.sub(r"{{names:([\w\s]+)}}", lambda m: summary_of(m.group(1).split()), source[0])
    if "{{table:" in source[0]:
        for name, table in generated.tables().items():
            source[0] = source[0].replace(f"{{{{table:{name}}}}}", table)
    if "{{commands}}" in source[0]:
        source[0] = source[0].replace("{{commands}}", generated.commands())
    source[0] = re.sub(r"{{results:([\w-]+)}}", lambda m: generated.study_table(m.group(1)), source[0])


def summary_of(names: list[str]) -> str:
    """Return a table of public names with the first line of their descriptions."""
    entries = "\n".join(f"   ~{getattr(bingham, name).__module__}.{name}" for name in names)
    return f".. autosummary::\n\n{entries}"


def escape_bars(app, what: str, name: str, obj: object, options: object, lines: list[str]) -> None:
    """Let |x| in a docstring be an absolute value, not a substitution of reStructuredText."""
    for k, line in enumerate(lines):
        if "|" in line and ">>>" not in line:
            parts = re.split(r"(`+[^`]*`+)", line)
            lines[k] = "".join(part if part.startswith("`") else part.replace("|", r"\|") for part in parts)


def run_tutorials(app) -> None:
    """Run the examples of the tutorials: the site shows none that does not give what it says."""
    flags = doctest.NORMALIZE_WHITESPACE | doctest.ELLIPSIS
    for page in sorted((Path(__file__).parent / "tutorials").glob("*.rst")):
        found = doctest.testfile(str(page), module_relative=False, optionflags=flags, encoding="utf-8")
        if found.failed:
            logging.getLogger(__name__).warning("%d of %d examples fail", *found, location=str(page))


def setup(app) -> None:
    """Register the hooks."""
    app.connect("builder-inited", run_tutorials)
    app.connect("source-read", fill_in)
    app.connect("autodoc-process-docstring", escape_bars, priority=400)


# A page is built from these modules in any case; warnings of third parties are not errors of the documentation.
warnings.filterwarnings("ignore", category=DeprecationWarning)
