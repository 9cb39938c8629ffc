import numpy as np
import pytest

from bingham.errors import MissingExtraError
from bingham.report import write_rerun


def walk():
    t = np.arange(200) / 50.0
    q = np.stack([np.cos(0.2 * t), 0 * t, 0 * t, np.sin(0.2 * t)], axis=1)
    q[:3] = np.nan
    return t, q, np.tile(np.diag([1e-4, 3e-4, 9e-4]), (200, 1, 1))


def test_the_log_holds_transforms_and_deviations(tmp_path):
    pytest.importorskip("rerun", reason="rerun-sdk is not installed")
    write_rerun(tmp_path / "x.rrd", *walk(), title="walk")
    content = (tmp_path / "x.rrd").read_bytes()
    assert content[:4] == b"RRF2" and len(content) > 5000
    for name in (b"world/body", b"deviation_deg/heading", b"deviation_deg/inclination"):
        assert name in content


def test_without_the_package_the_extra_is_named(tmp_path, monkeypatch):
    monkeypatch.setitem(__import__("sys").modules, "rerun", None)
    with pytest.raises(MissingExtraError) as caught:
        write_rerun(tmp_path / "x.rrd", *walk(), title="walk")
    assert caught.value.extra == "rerun" and not (tmp_path / "x.rrd").exists()
