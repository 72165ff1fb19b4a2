"""The report is one page that stands alone, says what is known, and invents nothing."""

import base64
import json
import re
import subprocess
import sys
from dataclasses import replace
from html.parser import HTMLParser

import numpy as np
import pytest
from reported import NASTY, document, evidence, spectral, view

from ers_mj.diagnosis.evidence import Evidence
from ers_mj.report.charts import packed
from ers_mj.report.diagnosis_report import VERDICTS, Made, report_page, summary_page
from ers_mj.report.display import figure, interval, pretty, shown, spoken
from ers_mj.report.thinning import decimate, merged

VOID = {"meta", "br", "hr", "img", "input", "link"}


class Reader(HTMLParser):
    """Collects what a page refers to, and whether its elements close in order."""

    def __init__(self):
        super().__init__(convert_charrefs=True)
        self.open, self.tags, self.references, self.ids, self.words = [], [], [], [], []

    def handle_starttag(self, tag, attributes):
        self.tags.append(tag)
        self.references += [v for k, v in attributes if k in ("src", "href", "xlink:href", "data", "srcset", "action")]
        self.ids += [v for k, v in attributes if k == "id"]
        if tag not in VOID:
            self.open.append(tag)

    def handle_startendtag(self, tag, attributes):
        self.handle_starttag(tag, attributes)
        if tag not in VOID:
            self.open.pop()

    def handle_endtag(self, tag):
        assert self.open and self.open[-1] == tag, f"</{tag}> closes {self.open[-1:]}"
        self.open.pop()

    def handle_data(self, data):
        self.words.append(data)


def read(page: str) -> Reader:
    reader = Reader()
    reader.feed(page)
    reader.close()
    assert reader.open == []
    return reader


def emptied(x):
    """The document with every number and text null, every list empty."""
    if isinstance(x, dict):
        return {key: emptied(value) for key, value in x.items()}
    return [] if isinstance(x, list) else None


EMPTY = Evidence((), (), None, float("nan"), "rad", "V")


@pytest.mark.parametrize("verdict", VERDICTS)
@pytest.mark.parametrize("full", [True, False])
def test_the_page_stands_alone_and_parses(verdict, full):
    doc = document(verdict) if verdict == "missing_physics" else document(verdict, missing=[])
    page = report_page(
        doc if full else emptied(doc) | {"verdict": verdict, "sentence": "Nothing."}, evidence() if full else EMPTY
    )
    reader = read(page)
    assert not re.search(r"https?:", page)
    assert all(reference.startswith("#") for reference in reader.references)
    assert not {"link", "iframe", "img", "object"} & set(reader.tags)
    assert reader.tags.count("script") == (2 if full else 0)  # the data, and what draws it
    assert "@import" not in page and "@font-face" not in page
    assert VERDICTS[verdict] in page and verdict in page


@pytest.mark.parametrize(
    "changes",
    [
        {},
        {"missing": [], "suspects": [{"effect": "end_stop", "sentence": "it might"}, "or this"]},
        {"fit": {}},
        {"parameters": {}},
        {"record_state": []},
        {"where": []},
        {"data": {}},
        {"next_recording": {}},
    ],
)
def test_a_document_may_lack_parts(changes):
    some = Evidence((), evidence().ladder, None, 1e-3, "rad", "V")
    read(report_page(document(**changes), some))
    read(summary_page(document(**changes), some))


def test_a_page_of_nothing_at_all():
    read(report_page({}, EMPTY))
    page = report_page(emptied(document()), evidence())
    assert "None" not in "".join(read(page).words).replace("None.", "")
    assert "nan" not in re.findall(r"\w+", "".join(read(page).words))


def test_all_text_is_escaped():
    whole = replace(evidence(), records=(view(NASTY), view("</script>", True)))
    made = Made(NASTY, NASTY, (NASTY, "model.toml"))
    page = report_page(document(), whole, None, made)
    assert page.count("<script") == 2 and page.count("</script>") == 2 and page.count("&lt;script&gt;") >= 10
    assert "rms error on </script>:" in data_of(page)["switched"]["none"]


def data_of(page: str) -> dict:
    """What the charts of a page are drawn from."""
    return json.loads(re.search(r'id="chart-data">(.*?)</script>', page).group(1))


def unpacked(series: dict) -> np.ndarray:
    steps = np.frombuffer(base64.b64decode(series["b"]), "<u2").astype(float)
    return np.where(steps == 65535, np.nan, series["o"] + series["s"] * steps)


@pytest.mark.parametrize("x", [[0.1, -2.0, np.nan, 3.0, np.inf], [5.0, 5.0], [np.nan], []])
def test_a_packed_series_comes_back(x):
    x = np.array(x, float)
    back = unpacked(packed(x))
    known = np.isfinite(x)
    assert np.isnan(back[~known]).all()
    np.testing.assert_allclose(back[known], x[known], atol=1e-4)


def test_curves_hold_what_was_measured_and_simulated():
    data = data_of(report_page(document(), evidence()))
    trace = data["charts"]["trace-0"]["levels"][0]
    one, factor = view(), 180 / np.pi
    np.testing.assert_allclose(unpacked(trace["measured"]), one.measured * factor, atol=1e-3)
    np.testing.assert_allclose(unpacked(trace["output"]["without"][0]), (one.measured + 0.02) * factor, atol=1e-3)
    np.testing.assert_allclose(unpacked(trace["residual"]["before"]), (one.measured - one.before) * factor, atol=1e-3)
    assert data["charts"]["trace-0"]["shaded"] == [[1.0, 1.5], [1.52, 2.0]]


def test_the_input_keeps_its_steps():
    t = np.arange(50_000) * 1e-3
    stepped = view(t=t, n=t.size, u=np.where((t > 10) & (t < 10.004), 5.0, 0.0))
    u = data_of(report_page({}, replace(EMPTY, records=(stepped,))))["charts"]["trace-0"]["levels"][0]["u"]
    np.testing.assert_allclose(unpacked(u["y"]), [0, 5, 0, 0], atol=1e-3)
    np.testing.assert_allclose(unpacked(u["t"])[1:3], [10.001, 10.004], atol=1e-3)


def test_a_run_that_leaves_all_bounds_does_not_flatten_the_others():
    away = view(without={"end_stop": np.where(np.arange(900) > 800, 1e9, 0.3)})
    level = data_of(report_page({}, replace(EMPTY, records=(away,))))["charts"]["trace-0"]["levels"][0]
    assert np.nanmax(unpacked(level["output"]["without"][0])) < 100


def test_a_page_tells_how_it_was_made_and_what_lies_beside_it():
    page = report_page(document(), evidence(), None, Made("ers diagnose a.csv", "1 May 2026", ("next_recording.csv",)))
    assert "1 May 2026 · <code>ers diagnose a.csv</code>" in page
    assert page.count('href="next_recording.csv" download') == 2
    assert "1 May 2026" not in report_page(document(), evidence())


def test_a_page_is_made_without_matplotlib():
    made = (
        "from ers_mj.report import diagnosis_report; import ers_mj.view.frames, sys; print('matplotlib' in sys.modules)"
    )
    told = subprocess.run([sys.executable, "-c", made], capture_output=True, text=True, check=True).stdout
    assert told.strip() == "False"


def test_verdict_and_sentence_come_first_and_all_sections_follow_in_order():
    page = report_page(document(), evidence())
    order = [
        "<h1>",
        "<h2>What to record next",
        "<h2>Problems found in the data",
        '<nav aria-label="Contents">',
        "<h2>Measured and simulated",
        "<h2>Where it fails",
        "<h2>The physics that was left out",
        "<h2>Residual over angle and speed",
        "<h2>The candidates",
        "<h2>How well it fits",
        "<h2>Parameters",
        "<h2>What differs between recordings",
        "<footer>",
    ]
    places = [page.index(title) for title in order]
    assert places == sorted(places)


def test_nulls_are_dashes_with_a_word_why():
    fit = dict.fromkeys(document()["fit"])
    page = report_page(document(fit=fit), evidence())
    assert "— no recording could be held out" in page and "— no record state was refitted" in page
    assert "not identifiable from these recordings" in page


def test_held_out_recordings_come_first_the_others_unfold():
    page = report_page(document(), evidence())
    assert page.index("held.csv · held out") < page.index("<summary>run1.csv · training")


def test_angles_are_in_degrees_other_outputs_in_their_unit():
    page = report_page(document(), evidence())
    assert "2.86" in page and "0.573°" in page  # 0.05 and 0.01 rad
    metres = document(data=document()["data"] | {"output_unit": "m"})
    assert "10.0 mm" in report_page(metres, evidence("m"))


def test_ids_are_unique_and_every_reference_is_met():
    page = report_page(document(), evidence())
    reader = read(page)
    assert len(reader.ids) == len(set(reader.ids))
    assert {r[1:] for r in reader.references} <= set(reader.ids)


def test_the_same_diagnosis_gives_the_same_page():
    assert report_page(document(), evidence()) == report_page(document(), evidence())


def test_a_long_recording_stays_a_small_page():
    long = view(n=200_000, t=np.arange(200_000) * 1e-3)
    whole = Evidence(tuple(view(f"r{k}", n=200_000, t=long.t) for k in range(6)) + (long,), (), None, 1e-3, "rad", "V")
    assert len(report_page(document(), whole).encode()) < 1_500_000


@pytest.mark.parametrize("hole", [slice(0, 300), slice(200, 700), slice(0, 900)])
def test_missing_samples_leave_holes(hole):
    y = view().measured.copy()
    y[hole] = np.nan
    read(report_page(document(), Evidence((view(measured=y),), (), None, float("nan"), "rad", "V")))


def test_decimation_keeps_every_extreme():
    t = np.arange(10_000) / 1000.0
    x = np.random.default_rng(1).normal(size=t.size)
    x[4567], x[1234] = 50.0, -40.0
    s, z = decimate(t, x, 400)
    assert s.size == z.size == 400 and z.max() == 50.0 and z.min() == -40.0 and (np.diff(s) >= 0).all()
    assert abs(s[np.argmax(z)] - t[4567]) < 0.06


def test_spans_that_touch_become_one():
    assert list(merged(((3, 4), (0, 1), (1.05, 2)), 0.1)) == [(0, 2), (3, 4)]
    assert list(merged((), 0.1)) == []


@pytest.mark.parametrize(
    ("x", "text"),
    [(0, "0"), (1234.5, "1234"), (0.0031, "0.00310"), (3.1e-6, "3.10×10⁻⁶"), (-2.5, "−2.50"), (9.999e6, "1.00×10⁷")],
)
def test_figures(x, text):
    assert figure(x) == text


def test_units_read_well():
    assert pretty("kg m^2") == "kg m²" and pretty("rad/s^2/V") == "rad/s²/V" and pretty("-") == ""
    assert spoken(np.pi / 2, "rad") == "90.0°" and spoken(0.004, "m") == "4.00 mm" and spoken(None, "m") == "—"
    assert interval([0.1, None], shown("V")) == "0.100 …" and interval(None, shown("V")) == "—"


def test_an_error_beyond_the_noise_is_drawn_over_frequency():
    told = [replace(evidence(), spectrum=spectral(is_off)) for is_off in (True, False)]
    drawn, silent = (data_of(report_page(document(), found))["charts"] for found in told)
    assert "spectrum" in drawn and "spectrum" not in silent
    assert "spectrum" not in data_of(report_page(document(where=[]), told[0]))["charts"]
    read(report_page(document(), told[0]))


def test_the_page_says_how_its_errors_are_measured():
    doc = document("missing_physics")
    free = report_page(doc, evidence())
    doc["fit"] = {**doc["fit"], "measure": "windows", "window_s": 2.0}
    windows = report_page(doc, evidence())
    assert "Each model runs free" in free and "free-run rms error" in free and "in windows" not in free
    assert "in windows of 2 s" in windows and "windowed rms error" in windows and "runs free" not in windows
