"""The papers' comparisons, one file a paper: simulate, filter, and set the figures beside the published ones."""

from __future__ import annotations

from importlib import import_module

from bingham.errors import InvalidArgumentError
from bingham.studies.study import Study

__all__ = ["STUDIES", "load_study"]

# Study → module that defines its STUDY.
STUDIES = {
    "kurz2013": "kurz2013",
    "kurz2014": "kurz2014",
    "glover2013": "glover2013",
    "glover2013-ball": "glover2013_ball",
    "madaan2017": "madaan2017",
    "li2019": "li2019",
    "madaan2017-planes": "madaan2017_planes",
}


def load_study(name: str) -> Study:
    """Return the study of that name.

    Raises
    ------
    InvalidArgumentError
        If there is no such study.
    """
    if name not in STUDIES:
        raise InvalidArgumentError("study", f"one of {', '.join(STUDIES)}", repr(name))
    return import_module(f"bingham.studies.{STUDIES[name]}").STUDY
