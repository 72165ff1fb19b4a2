"""The report is one page that stands alone, says what is known, and invents nothing."""

import re
from dataclasses import replace
from html.parser import HTMLParser

import numpy as np
import pytest

from ers_mj.data.prepared import Signals, make_trace
from ers_mj.diagnosis.evidence import Evidence, RecordView, ResidualMap, Rung
from ers_mj.diagnosis.mismatch_spectrum import mismatch
from ers_mj.report.diagnosis_report import VERDICTS, report_page
from ers_mj.report.display import figure, interval, pretty, shown, spoken
from ers_mj.report.drawing import decimate
from ers_mj.report.traces import merged

VOID = {"meta", "br", "hr", "img", "input", "link"}
NASTY = '<script>alert("1 & 2")</script>'


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


def view(name="run1.csv", held_out=False, n=900, **changes) -> RecordView:
    t = np.arange(n) * 1e-2
    y = 0.3 * np.sin(t)
    fields = {
        "t": t,
        "u": 5 * np.cos(t),
        "measured": y,
        "before": y + 0.05 * np.sin(3 * t),
        "after": y + 1e-3,
        "shaded": ((1.0, 1.5), (1.52, 2.0)),
    }
    return RecordView(name, held_out, **{**fields, **changes})


def evidence(unit="rad") -> Evidence:
    rng = np.random.default_rng(3)
    rms = rng.uniform(size=(6, 4))
    rms[0] = np.nan
    rungs = (
        Rung((), 0.0, 0.0, 0.05, False, "", 6),
        Rung(("stribeck",), 30.0, 5.0, 0.01, True, NASTY, 3),
        Rung(("backlash", "end_stop"), 2.0, 0.3, None, False, "did not converge", 6),
    )
    maps = ResidualMap(np.linspace(-1, 1, 7), np.linspace(-2, 2, 5), rms, 0.1 * rms)
    return Evidence((view(), view("held.csv", True)), rungs, maps, 1e-3, unit, "V")


def document(verdict="missing_physics", **changes) -> dict:
    fit = {
        f"{kind}_rmse_{when}_rad": x
        for kind in ("train", "heldout", "recalibrated")
        for when, x in (("before", 0.05), ("after", 0.01))
    }
    number = {"value": 0.1, "unit": "N m", "ci95": [0.08, 0.12]}
    full = {
        "version": 1,
        "verdict": verdict,
        "sentence": f"A sentence with {NASTY}.",
        "where": [
            {
                "axis": "angle",
                "region": [0.1, 0.2],
                "unit": "rad",
                "label": None,
                "share_of_error": 0.78,
                "share_of_time": 0.09,
                "sentence": NASTY,
            },
            {
                "axis": "subsystem",
                "region": None,
                "unit": None,
                "label": "load",
                "share_of_error": None,
                "share_of_time": None,
                "sentence": None,
            },
        ],
        "missing": [
            {
                "effect": "stribeck",
                "sentence": NASTY,
                "subsystem": "load",
                "parameters": {"F_s": number, NASTY: number},
                "evidence": {
                    "heldout_rmse_without_rad": 0.05,
                    "heldout_rmse_with_rad": 0.01,
                    "delta_bic": -40.0,
                    "p_value": 1e-6,
                },
                "alternatives": [{"effect": "presliding", "probability": 0.2, "why_not_excluded": NASTY}],
            }
        ],
        "remainder": {"explained_share": 0.93, "significant": True, "sentence": NASTY},
        "record_state": [
            {"name": "gain", "unit": "-", "values": [1.0, 1.16], "ci95": [[1.0, 1.0], [1.1, 1.2]], "sentence": NASTY}
        ],
        "fit": {
            **fit,
            "noise_floor_rad": 1e-3,
            "mujoco_heldout_rmse_before_rad": None,
            "mujoco_heldout_rmse_after_rad": None,
        },
        "parameters": {
            "J": {
                "value": 0.0031,
                "unit": "kg m^2",
                "ci95": [0.003, 0.0032],
                "datasheet": 0.0031,
                "identifiable": True,
            },
            "k_s": {"value": None, "unit": "N m/rad", "ci95": None, "datasheet": 0.09, "identifiable": False},
        },
        "next_recording": {
            "sentence": NASTY,
            "excitation": {"kind": "ramp", "amplitude_V": 3.8, "levels": [1, 2.5, None]},
        },
        "data": {
            "files": [NASTY, "held.csv"],
            "sha256": ["ab" * 32, "cd" * 32],
            "output_unit": "rad",
            "input_unit": "V",
            "problems": [NASTY],
        },
        "seed": 7,
        "versions": {"ers_mj": "0.1.0"},
    }
    return full | changes


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
    assert not {"script", "link", "iframe", "img", "object"} & set(reader.tags)
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
    read(report_page(document(**changes), Evidence((), evidence().ladder, None, 1e-3, "rad", "V")))


def test_a_page_of_nothing_at_all():
    read(report_page({}, EMPTY))
    page = report_page(emptied(document()), evidence())
    assert "None" not in "".join(read(page).words).replace("None.", "")
    assert "nan" not in re.findall(r"\w+", "".join(read(page).words))


def test_all_text_is_escaped():
    page = report_page(document(), evidence())
    assert "<script" not in page and page.count("&lt;script&gt;") >= 8


def test_verdict_and_sentence_come_first_and_all_sections_follow_in_order():
    page = report_page(document(), evidence())
    order = [
        "<h1>",
        "Measured and simulated",
        "Where it fails",
        "The physics that was left out",
        "Residual over angle and speed",
        "The candidates",
        "How well it fits",
        "Parameters",
        "What differs between recordings",
        "Problems found in the data",
        "What to record next",
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
    assert {r[1:] for r in reader.references} | set(re.findall(r"url\(#([^)]+)\)", page)) <= set(reader.ids)


def test_the_same_diagnosis_gives_the_same_page():
    assert report_page(document(), evidence()) == report_page(document(), evidence())


def test_a_long_recording_stays_a_small_page():
    long = view(n=200_000, t=np.arange(200_000) * 1e-3)
    whole = Evidence(tuple(view(f"r{k}", n=200_000, t=long.t) for k in range(6)) + (long,), (), None, 1e-3, "rad", "V")
    assert len(report_page(document(), whole).encode()) < 3_000_000


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
    random = np.random.default_rng(1)
    t, u = np.arange(6000) * 1e-3, random.standard_normal(6000)
    x = np.cumsum(u) * 1e-3
    traces = [make_trace("made", Signals(t, u, x * gain, np.ones(6000, bool)), 1e-5) for gain in (1.0, 1.1)]
    told = [
        replace(evidence(), spectrum=mismatch(traces, [e, e], 1e-9))
        for e in (0.1 * x + 1e-5 * random.standard_normal(6000), 1e-5 * random.standard_normal(6000))
    ]
    drawn, silent = (report_page(document(), found) for found in told)
    assert "measured over simulated motion" in drawn and "measured over simulated motion" not in silent
    assert "measured over simulated motion" not in report_page(document(where=[]), told[0])
    read(drawn)
