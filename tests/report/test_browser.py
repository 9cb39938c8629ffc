"""The report in a browser: it opens, the slider moves the body, curves zoom together, nothing is loaded or logged."""

import json
import shutil

import numpy as np
import pytest

from bingham.report import write_report

webdriver = pytest.importorskip("selenium.webdriver", reason="selenium is not installed")
CHROMIUM, DRIVER = shutil.which("chromium"), shutil.which("chromedriver")
pytestmark = pytest.mark.skipif(not (CHROMIUM and DRIVER), reason="Chromium and its driver are not installed")

SIZES = {"desktop": (1400, 1000), "phone": (420, 900)}


@pytest.fixture(scope="module")
def recording():
    t = np.arange(6000) / 100.0
    angle = np.stack([0.3 * np.sin(t), 0.2 * np.cos(0.7 * t), 0.4 * t], axis=1)
    from scipy.spatial.transform import Rotation

    q = Rotation.from_rotvec(angle).as_quat(scalar_first=True)
    return t, q, np.tile(np.diag([1e-4, 1e-4, 1e-2]), (len(t), 1, 1))


@pytest.fixture(params=SIZES)
def browser(request, tmp_path, recording):
    write_report(tmp_path / "r.html", *recording, title="walk", truth=recording[1], bias=np.zeros((6000, 3)))
    options = webdriver.ChromeOptions()
    options.binary_location = CHROMIUM
    width, height = SIZES[request.param]
    flags = f"""headless no-sandbox disable-gpu use-angle=swiftshader enable-unsafe-swiftshader no-first-run
        disable-sync disable-background-networking disable-component-update window-size={width},{height}"""
    for flag in [*flags.split(), f"user-data-dir={tmp_path / 'profile'}"]:
        options.add_argument(f"--{flag}")
    options.set_capability("goog:loggingPrefs", {"browser": "ALL", "performance": "ALL"})
    driver = webdriver.Chrome(options=options, service=webdriver.ChromeService(DRIVER))
    driver.get((tmp_path / "r.html").as_uri())
    yield driver
    driver.quit()


def test_report(browser, recording):
    t, q, _ = recording
    assert browser.title == "walk"
    slider = browser.find_element("id", "slider")
    for share in (0.25, 0.73):
        browser.execute_script(
            "arguments[0].value = arguments[1]; arguments[0].dispatchEvent(new Event('input'));", slider, share
        )
        now = browser.execute_script("return window.binghamReport.now")
        assert now == pytest.approx(share * t[-1])
        shown = np.array(browser.execute_script("return window.binghamReport.quaternion()"))
        true = q[np.searchsorted(t, now)]
        assert 2 * np.degrees(np.arccos(min(1.0, abs(shown @ true)))) < 0.5
    browser.execute_script("window.binghamReport.zoom(10, 20)")
    scales = browser.execute_script("return window.binghamReport.plots.map((p) => [p.scales.x.min, p.scales.x.max])")
    assert len(scales) == 4 and all(scale == [10, 20] for scale in scales)
    browser.execute_script("document.getElementById('play').click()")
    browser.implicitly_wait(1)
    browser.find_element("id", "theme").click()
    wide = browser.execute_script("return document.documentElement.scrollWidth - window.innerWidth")
    assert wide <= 0
    assert [entry["message"] for entry in browser.get_log("browser") if entry["level"] == "SEVERE"] == []
    events = [json.loads(entry["message"])["message"] for entry in browser.get_log("performance")]
    sent = [e["params"] for e in events if e["method"] == "Network.requestWillBeSent"]
    asked = [p["request"]["url"] for p in sent if p["documentURL"].startswith("file:")]
    assert asked
    assert [url for url in asked if not url.startswith(("file:", "data:"))] == []
