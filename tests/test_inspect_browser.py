"""The page of `ers inspect` in a real browser: read on a desk and on a phone, zoomed, pointed at."""

import os
from importlib.resources import files

import numpy as np
import pytest
from browser import CHROMIUM, Browser

from ers_mj import cli
from ers_mj.data.recording import write_recording

pytestmark = pytest.mark.skipif(
    CHROMIUM is None and "CI" not in os.environ, reason="no Chromium here (Debian: apt install chromium)"
)
N = 20_000
READ = "document.querySelector('[data-chart={}] output').textContent"
PATH = "document.querySelector('[data-chart=recorded-0] path.after').getAttribute('d')"


@pytest.fixture(scope="module")
def page(tmp_path_factory):
    """Of a long recording with a span in which the sensor is stuck, under a name that is markup."""
    folder = tmp_path_factory.mktemp("inspected")
    t = 1e-3 * np.arange(N)
    theta = 0.3 * np.sin(5 * t) + 2e-4 * np.random.default_rng(1).normal(size=N)
    theta[3000:3400] = theta[3000]
    write_recording(folder / "<b>.csv", {"t_s": t, "u_V": 3 * np.sin(5 * t), "theta_rad": theta})
    assert cli.main(["inspect", str(folder / "<b>.csv"), "--out", str(folder / "out")]) == 0
    return folder / "out/report.html"


@pytest.fixture(scope="module")
def browser(tmp_path_factory):
    with Browser(tmp_path_factory.mktemp("profile")) as opened:
        yield opened


@pytest.mark.parametrize("width", [390, 1280])
@pytest.mark.parametrize("dark", [False, True])
def test_everybody_can_read_the_page(browser, page, width, dark):
    browser.show(page, width, dark=dark)
    assert browser.run("document.querySelectorAll('figure svg').length") == 3
    assert browser.run("document.querySelectorAll('main b b').length") == 0
    assert browser.run("document.documentElement.scrollWidth") <= width
    browser.run(files("axe_core_python").joinpath("axe.min.js").read_text(encoding="utf-8") + "; 1")
    found = browser.run("axe.run().then(r => r.violations.map(v => [v.impact, v.id, v.nodes.map(n => n.html)]))")
    assert [v for v in found if v[0] in ("serious", "critical")] == []
    assert browser.said == []


def test_faults_are_shaded_and_keys_zoom_and_read(browser, page):
    browser.show(page)
    assert browser.run("document.querySelectorAll('[data-chart=recorded-0] rect.shade').length") == 2
    whole = browser.run(PATH)
    browser.run("document.querySelector('[data-chart=recorded-0] .plot').focus()")
    browser.press("ArrowRight")
    assert " s · output " in browser.run(READ.format("recorded-0"))
    browser.press("+")
    assert browser.run(PATH) != whole
    browser.press("0")
    assert browser.run(PATH) == whole
    browser.run("document.querySelector('[data-chart=power-0] .plot').focus()")
    browser.press("ArrowRight")
    assert " Hz · input " in browser.run(READ.format("power-0")) and browser.said == []
