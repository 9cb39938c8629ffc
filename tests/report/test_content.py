"""What a report page holds, read back as a browser would."""

import base64
import json
import re

import numpy as np
import pytest

from bingham import Bingham, BinghamFilter
from bingham.decimate import envelope, envelope_indices
from bingham.errors import InvalidArgumentError
from bingham.report import render_report, write_report
from bingham.report.content import report_content


@pytest.fixture(scope="module")
def walk():
    rng = np.random.default_rng(3)
    return np.cumsum(rng.standard_normal(100_003))


@pytest.mark.parametrize("stretches", [7, 1000, 30_000])
def test_each_stretch_keeps_its_smallest_and_largest_value(walk, stretches):
    index, value = envelope(walk, stretches)
    starts = np.linspace(0, len(walk), stretches + 1).astype(int)
    for k in range(0, stretches, max(1, stretches // 50)):
        part = walk[starts[k] : starts[k + 1]]
        assert sorted(value[2 * k : 2 * k + 2]) == [part.min(), part.max()]
    assert np.all(np.diff(index) > 0)
    chosen = envelope_indices(walk, stretches)
    assert np.all(np.diff(chosen) > 0) and chosen[0] == 0 and chosen[-1] == len(walk) - 1
    assert {int(walk.argmin()), int(walk.argmax())} <= set(chosen.tolist())


def test_missing_samples_stay_missing_and_hide_no_peak():
    y = np.zeros(10_000)
    y[4000:5000] = np.nan
    y[[3999, 7003]] = 9.0, -4.0
    index, value = envelope(y, 100)
    assert (
        np.isnan(value[(index >= 4000) & (index < 5000)]).all() and np.nanmax(value) == 9.0 and np.nanmin(value) == -4.0
    )
    chosen = envelope_indices(y, 100)
    assert {3999, 4000, 4999, 5000, 7003} <= set(chosen.tolist())


def rotating(count, rate_hz):
    t = np.arange(count) / rate_hz
    q = np.stack([np.cos(0.25 * t), 0 * t, 0 * t, np.sin(0.25 * t)], axis=1)
    return t, q, np.tile(np.diag([1e-4, 1e-4, 4e-4]), (count, 1, 1))


def decoded(text, kind="<i2"):
    return np.frombuffer(base64.b64decode(text), dtype=kind)


def curve(content, panel, name):
    (found,) = [c for c in content["panels"][panel]["curves"] if c["name"] == name]
    coded = decoded(found["value"]).astype(float)
    return np.where(coded == -32768, np.nan, coded * found["scale"] + found["offset"])


def test_curves_come_back_within_their_rounding():
    t, q, c = rotating(5000, 100.0)
    content = report_content(t, q, c, title="x")
    yaw = (np.degrees(0.5 * t) + 180.0) % 360.0 - 180.0
    seen = curve(content, 0, "yaw")
    off = np.abs((seen - yaw + 180.0) % 360.0 - 180.0)
    assert np.nanmax(off) < 360.0 / 65000.0 and np.isnan(seen).sum() == round(0.5 * t[-1] / (2.0 * np.pi))
    np.testing.assert_allclose(curve(content, 1, "95 % bound"), 1.959964 * np.degrees(0.02), rtol=1e-6)
    np.testing.assert_allclose(decoded(content["time"], "<f8"), t)


def test_gaps_unknown_orientations_and_truth():
    t, q, c = rotating(1000, 100.0)
    t[500:] += 3.0
    unknown = q.copy()
    unknown[:10] = np.nan
    truth = q.copy()
    truth[200:300] = np.nan
    c[:10] = np.nan
    content = report_content(t, unknown, c, title="x", truth=truth, scored=t > 1.0, rejected=t > 12.9)
    assert content["gaps"] == [[pytest.approx(4.99), pytest.approx(8.0)]]
    assert content["unscored"] == [[0.0, 1.0]]
    assert content["rejected"][0] == pytest.approx(12.91)
    error = curve(content, 1, "error")
    assert np.isnan(error[:10]).all() and np.isnan(error[200:300]).all() and np.nanmax(np.abs(error)) < 1e-9
    assert not decoded(content["orientation"]).reshape(-1, 4)[:10].any()


def test_the_page_asks_for_nothing_and_escapes_names(tmp_path):
    t, q, c = rotating(300, 100.0)
    evil = '</script><img src="http://example.org/x">'
    write_report(tmp_path / "x.html", t, q, c, title=evil, warnings=[evil], summary={evil: evil})
    page = (tmp_path / "x.html").read_text(encoding="utf-8")
    data = re.search(r'<script type="application/json" id="content">(.*?)</script>', page, re.DOTALL)
    assert json.loads(data.group(1))["warnings"] == [evil]
    assert evil not in page and "<img" not in page
    without_links = re.sub(r'<a href="[^"]*">', "", page.split('id="content"')[0])
    assert not re.search(r'(src|href)="(?!data:)', without_links)


def test_an_hour_stays_small():
    t, q, c = rotating(720_000, 200.0)
    bias = np.random.default_rng(0).normal(0.0, 0.01, (len(t), 3))
    page = render_report(t, q, c, title="hour", truth=q, bias=bias, bias_std=np.abs(bias))
    assert len(page.encode()) < 15e6


def test_a_track_shows_itself(tmp_path):
    noise = Bingham([-500.0, -500.0, -500.0, 0.0], np.eye(4)[:, [1, 2, 3, 0]])
    z = noise.rvs(30, rng=1)
    page = BinghamFilter(noise, noise).run(Bingham.uniform(4), z).report(tmp_path / "t.html", title="a <b> track")
    assert (tmp_path / "t.html").read_text(encoding="utf-8") == page.html
    shown = page._repr_html_()
    assert shown.startswith('<iframe title="a &lt;b&gt; track"') and "<script" not in shown
    assert repr(page) == "Report(title='a <b> track')"
    plane = Bingham([-50.0, 0.0], np.eye(2))
    with pytest.raises(InvalidArgumentError) as caught:
        BinghamFilter(plane, plane).run(Bingham.uniform(2), plane.rvs(5, rng=1)).report()
    assert caught.value.argument == "track"


def test_shapes_that_do_not_fit_are_named():
    t, q, c = rotating(10, 100.0)
    with pytest.raises(InvalidArgumentError) as caught:
        report_content(t[:5], q, c, title="x")
    assert caught.value.argument == "modes"
