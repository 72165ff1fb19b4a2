"""The diagnosis's page in a real browser: nothing goes wrong, its switches and its zoom work, everybody can read it."""

import os
from dataclasses import replace
from importlib.resources import files

import pytest
from browser import CHROMIUM, Browser
from reported import document, evidence, spectral, view

from ers_mj.report.diagnosis_report import Made, report_page

pytestmark = pytest.mark.skipif(
    CHROMIUM is None and "CI" not in os.environ, reason="no Chromium here (Debian: apt install chromium)"
)
SEEN = replace(evidence(), records=(view("held.csv", True, n=3000), view()), spectrum=spectral())
MADE = Made("ers diagnose run1.csv --holdout held.csv", "1 May 2026", ("diagnosis.json", "next_recording.csv"))
AFTER = "document.querySelector('[data-chart=trace-0] path.after').getAttribute('d')"
TIMES = (
    "[...document.querySelectorAll('[data-chart=trace-0] .number.middle')].map(n => +n.textContent.replace('−', '-'))"
)
SAID = "document.querySelector('#switches output').textContent"
READ = "document.querySelector('[data-chart={}] output').textContent"


@pytest.fixture(scope="module")
def browser(tmp_path_factory):
    with Browser(tmp_path_factory.mktemp("profile")) as opened:
        yield opened


@pytest.fixture(scope="module")
def page(tmp_path_factory):
    path = tmp_path_factory.mktemp("page") / "report.html"
    path.write_text(report_page(document(), SEEN, None, MADE), encoding="utf-8")
    return path


def middle(browser: Browser, chart: str, share: float = 0.5) -> tuple[float, float]:
    """A place in the window over a chart, at this share of its width, in its uppermost panel."""
    browser.run(f"document.querySelector('[data-chart={chart}]').scrollIntoView()")
    box = browser.run(
        f"(b => [b.x, b.y, b.width])(document.querySelector('[data-chart={chart}] svg').getBoundingClientRect())"
    )
    return box[0] + share * box[2], box[1] + 90


@pytest.mark.parametrize("width", [390, 1280])
@pytest.mark.parametrize("dark", [False, True])
def test_everybody_can_read_the_page(browser, page, width, dark):
    """Nothing is said on the console, nothing is wider than the window, and no rule of axe of weight is broken."""
    browser.show(page, width, dark=dark)
    for one in ("details", "svg"):
        assert browser.run(f"document.querySelectorAll('{one}').length") > 0
    browser.run("for (const one of document.querySelectorAll('details')) one.open = true")
    browser.settle()
    assert browser.run("document.documentElement.scrollWidth") <= width
    assert (
        browser.run("[...document.querySelectorAll('.scroll')].filter(b => b.scrollWidth > b.clientWidth).length") == 0
    )
    browser.run(files("axe_core_python").joinpath("axe.min.js").read_text(encoding="utf-8") + "; 1")
    found = browser.run("axe.run().then(r => r.violations.map(v => [v.impact, v.id, v.nodes.map(n => n.html)]))")
    assert [v for v in found if v[0] in ("serious", "critical")] == []
    assert browser.said == []


def test_an_effect_is_switched_off_and_on(browser, page):
    browser.show(page)
    whole, boxes = browser.run(AFTER), "[...document.querySelectorAll('#switches input')].map(b => b.checked)"
    assert browser.run(boxes) == [True] * 4 and "has all named effects" in browser.run(SAID)
    browser.run("document.querySelectorAll('#switches input')[1].click()")
    first = browser.run(AFTER)
    assert (
        first != whole and browser.run(boxes) == [False, False, True, True] and "Without stribeck" in browser.run(SAID)
    )
    browser.run("document.querySelectorAll('#switches input')[2].click()")
    assert browser.run(AFTER) not in (whole, first) and browser.run(boxes) == [False, True, False, True]
    browser.run("document.querySelectorAll('#switches input')[0].click()")
    assert browser.run(AFTER) == whole and browser.run(boxes) == [True] * 4
    browser.run("document.querySelectorAll('#switches input')[0].click()")
    before = "document.querySelector('[data-chart=trace-0] path.before').getAttribute('d')"
    assert browser.run(AFTER) == browser.run(before) and browser.run(boxes) == [False] * 4
    assert browser.said == []


def test_the_zoom_is_one_for_all_recordings(browser, page):
    browser.show(page)
    browser.run("document.querySelector('details').open = true")
    browser.settle()
    whole, other = browser.run(TIMES), TIMES.replace("trace-0", "trace-1")
    assert max(whole) - min(whole) > 20
    left, right = middle(browser, "trace-0", 0.2), middle(browser, "trace-0", 0.25)
    browser.drag(left, right)
    near = browser.run(TIMES)
    assert 0 < max(near) - min(near) < 3 and browser.run(other) == near
    browser.pointer("mousePressed", *left, 2)
    browser.pointer("mouseReleased", *left, 2)
    browser.settle()
    assert browser.run(TIMES) == whole


def test_the_worst_span_shows_every_sample(browser, page):
    """A long recording is thinned as a whole, but not where the model before does worst."""
    browser.show(page)
    browser.run("document.querySelector('.tools button').click()")
    browser.settle()
    ends = browser.run(TIMES)
    shown = browser.run(AFTER).count("L") + 1
    assert 0 < max(ends) - min(ends) < 5 and shown > 330  # of 12 % of 3000 samples


def test_the_keyboard_zooms_and_reads(browser, page):
    browser.show(page)
    whole = browser.run(TIMES)
    browser.run("document.querySelector('[data-chart=trace-0] .plot').focus()")
    browser.press("ArrowRight")
    assert " s · measured " in browser.run(READ.format("trace-0"))
    browser.press("+")
    assert max(browser.run(TIMES)) - min(browser.run(TIMES)) < 0.8 * (max(whole) - min(whole))
    browser.press("0")
    assert browser.run(TIMES) == whole
    for chart, told in (("map", "before "), ("spectrum", " Hz · motion ")):
        browser.run(f"document.querySelector('[data-chart={chart}] .plot').focus()")
        browser.press("ArrowRight")
        assert told in browser.run(READ.format(chart))


@pytest.mark.parametrize(("chart", "told"), [("trace-0", "residual"), ("map", "after"), ("spectrum", "error")])
def test_a_pointer_reads_values(browser, page, chart, told):
    browser.show(page)
    rest = browser.run(READ.format(chart))
    browser.pointer("mouseMoved", *middle(browser, chart, 0.3))
    browser.settle()
    assert told in browser.run(READ.format(chart)) != rest


def test_what_is_printed_is_light_and_open(browser, page):
    browser.show(page, dark=True, printed=True)
    assert browser.run("getComputedStyle(document.querySelector('header')).backgroundColor") == "rgb(255, 255, 255)"
    browser.run("dispatchEvent(new Event('beforeprint'))")
    assert browser.run("document.querySelectorAll('details:not([open])').length") == 0
    assert browser.run("document.querySelectorAll('[data-chart=trace-1] path').length") > 0
    browser.run("dispatchEvent(new Event('afterprint'))")
    assert browser.run("document.querySelectorAll('details[open]').length") == 0


def test_text_from_files_is_never_run(browser, page):
    browser.show(page)
    assert browser.run("document.querySelectorAll('script').length") == 2
    assert browser.run("document.querySelectorAll('#switches label')[3].textContent").strip().startswith("<script>")
