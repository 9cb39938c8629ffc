import numpy as np
import pytest

pytest.importorskip("matplotlib")

from bingham.plot.studies import draw
from bingham.studies import load_study
from bingham.studies.execute import run_study
from bingham.studies.glover2013 import TABLE


def test_histograms_of_the_2014_study_are_densities_of_its_probabilities():
    result = run_study(load_study("kurz2014"), runs=3, seed=1)
    figures = draw(result)
    assert set(figures) == {"rmse", "time", "calibration"}
    panels = figures["calibration"].axes
    assert [ax.get_title() for ax in panels] == [
        "2-D bingham noise", "2-D gaussian noise", "4-D bingham noise", "4-D gaussian noise"
    ]  # fmt: skip
    for ax in panels:
        for patch, name in zip(ax.patches, ("bingham", "axial_kalman"), strict=True):
            heights, edges, _ = patch.get_data()
            assert heights @ np.diff(edges) == pytest.approx(1.0)
            p = result.curves[f"{ax.get_title().removesuffix(' noise')}/pit/{name}"]
            assert heights[-1] * 0.05 == pytest.approx(np.mean(p >= 0.95))


def test_cells_of_the_2013_study_stand_beside_the_published_ones(monkeypatch):
    monkeypatch.setattr("bingham.studies.glover2013.STEPS", 20)
    monkeypatch.setattr("bingham.studies.glover2013_composition.COMPOSED_STEPS", 8)
    result = run_study(load_study("glover2013"), runs=9, seed=1)
    figures = draw(result)
    assert set(figures) == {"signals", "cells", "composition", "runs"}
    drawn = {c.get_label(): c.lines[0].get_xdata() for c in figures["cells"].axes[0].containers}
    assert set(drawn) == {"EKF, fixed noise", "EKF, fixed and padded noise", "EKF, rotated noise", "published ±"}
    np.testing.assert_array_equal(drawn["published ±"], [value for value, _ in TABLE.values()])
    ours = [r.value for r in result.table if r.case.endswith("against ekf_fair") and r.metric == "improvement_percent"]
    np.testing.assert_array_equal(drawn["EKF, rotated noise"], ours)
