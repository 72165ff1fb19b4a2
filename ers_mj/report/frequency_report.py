"""The report of `ers frequency`: how much room the loops have, where they cycle, and what recordings say of the models.

sentence -> loops: table, Bode, Nyquist, Nichols, sensitivities -> plants -> limit cycles -> recordings
"""

from __future__ import annotations

import math
from collections.abc import Mapping

from ers_mj.control.frequency.study import Compared, Study
from ers_mj.report import frequency_figures, page
from ers_mj.report.display import Unit
from ers_mj.report.display import figure as digits
from ers_mj.report.drawing import restart_ids

HEADS = (
    "loop",
    ">gain margin",
    ">phase margin",
    ">crossover",
    ">disk margin",
    ">bears at once",
    ">peak |S|",
    ">bandwidth",
    ">",
)


def frequency_page(document: Mapping, found: Study) -> str:
    """The page as HTML, of what `ers frequency --json` prints and the study behind it."""
    restart_ids()
    sections = [
        _loops(document, found),
        _plants(document, found) if found.plants else page.section("Plants", "", page.listed(document["notes"])),
        _cycles(document, found),
        *(_recording(c) for c in found.recordings),
    ]
    body = "\n".join([_header(document), *sections, _footer(document, found)])
    return page.frame("Loops over frequency", "consistent", body)


def _header(document: Mapping) -> str:
    first = document["loops"][0]
    name = page.text(f"{first['controller']}, {first['plant']}")
    tiles = [
        (f"{name}: {label}", f'<span class="a">{Unit(unit)(document[key])}</span>')
        for label, key, unit in (
            ("gain margin", "gain_margin_db", "dB"),
            ("phase margin", "phase_margin_deg", "°"),
            ("peak |S|", "sensitivity_peak", ""),
            ("bandwidth", "bandwidth_hz", "Hz"),
        )
    ]
    return page.header("consistent", "Loops over frequency", "ers frequency", document["sentence"], tiles)


def _loops(document: Mapping, found: Study) -> str:
    rows = []
    for loop in document["loops"]:
        once = f"{Unit('dB')(loop['disk_gain_margin_db'])}, {Unit('°')(loop['disk_phase_margin_deg'])}"
        rows.append(
            (
                (
                    page.text(f"{loop['controller']}, {loop['plant']}"),
                    Unit("dB")(loop["gain_margin_db"]),
                    Unit("°")(loop["phase_margin_deg"]),
                    Unit("Hz")(loop["gain_crossover_hz"]),
                    digits(loop["disk_margin"], 3),
                    once,
                    digits(loop["sensitivity_peak"], 3),
                    Unit("Hz")(loop["bandwidth_hz"]),
                    "" if loop["stable"] else "<b>unstable</b>",
                ),
                "",
            )
        )
    c = document["conditions"]
    lead = (
        f"The output swings by ±{math.degrees(c['amplitude_rad']):.3g}° about {math.degrees(c['start_rad']):.3g}°:"
        " plant and controller each stand for the first harmonic of what they do then, friction and its compensation"
        " included; the drive's limit is left out. The disk margin is that of gain and phase changing at once."
        " Bandwidth: |T| of the feedback 3 dB below its low end; a feed-forward follows further."
    )
    drawn = (
        page.figure(frequency_figures.open_loops(found.loops), "Open loops (Bode).")
        + page.figure(
            frequency_figures.planes(found.loops),
            "Nyquist with the disk that the least robust loop keeps out of; Nichols with contours of |T|.",
        )
        + page.figure(frequency_figures.sensitivities(found.loops), "Sensitivity and complementary sensitivity.")
    )
    return page.section("Loops", lead, page.table(HEADS, rows) + drawn)


def _plants(document: Mapping, found: Study) -> str:
    lead = (
        "Linear while the output slips, where friction and preload are constant: the reduced model from its"
        " coefficients, MuJoCo from its own derivatives (mjd_transitionFD). Described: with the friction and the"
        " preload of the amplitude."
    )
    return page.section(
        "Plants", lead, page.figure(frequency_figures.plants(found.plants)) + page.listed(document["notes"])
    )


def _cycles(document: Mapping, found: Study) -> str:
    h = 1.0 / document["conditions"]["rate_hz"]
    drawn = "".join(
        page.figure(frequency_figures.cycles(c, h), page.text(f"{c.controller}: how it ends, beside the prediction."))
        for c in found.cycles
    )
    lead = (
        "Predicted where the first harmonics of friction, preload, play and limit balance about the rest angle; seen"
        " where the loop, let go 2° away, still oscillates after three seconds. The prediction takes the twist of a"
        " play for a sine: it holds for a springy contact and fails for one that swallows each blow."
    )
    return page.section("Limit cycles", lead, page.listed(document["cycle_sentences"]) + drawn)


def _recording(compared: Compared) -> str:
    r = compared.response
    how = (
        f"the last {r.periods} period{'s' if r.periods > 1 else ''} of its input"
        if r.kind == "periodic"
        else "parabolas through neighbouring lines"
    )
    said = page.listed(
        f"{name}: {gap.sentence}" if gap else f"{name}: nowhere coherent enough to be compared"
        for name, gap in compared.gaps.items()
    )
    lead = (
        "Best linear approximation from "
        + how
        + ". Sure: coherence above 0.95. <i>Friction described</i>: the friction and the preload that "
        "a motion of this size meets, its speed and angle taken as normal."
    )
    return page.section(
        f"Recording {page.text(r.name)}", lead, said + page.figure(frequency_figures.recording(compared))
    )


def _footer(document: Mapping, found: Study) -> str:
    c = document["conditions"]
    told_volts = [f"±{c['u_max_V']:g} V", f"speed filter {1e3 * c['filter_s']:g} ms", *page.rig(c)]
    told = [
        f"{c['rate_hz']:g} Hz",
        *(told_volts if found.plants else ()),
        *(f"effect {_effect(effect)}" for effect in c["effects"]),
        *page.origin(document),
    ]
    return page.footer(told)


def _effect(effect: Mapping) -> str:
    return f"{effect['name']} ({', '.join(f'{key} {value:.4g}' for key, value in effect['parameters'].items())})"
