"""The report of trials: who follows best, the paper's claims beside what was measured, and the curves.

sentence -> claims -> each case and plant: table, curves, the close-up -> how it was made
"""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence

from ers_mj.control.monte_carlo import Spread
from ers_mj.control.paper_claims import claims, degrees
from ers_mj.control.trial import Trial
from ers_mj.report import page, trial_figures
from ers_mj.report.display import NONE, Unit
from ers_mj.report.display import figure as digits
from ers_mj.report.drawing import restart_ids

HEADS = ("controller", ">settles", ">overshoot", ">steady-state error", ">RMSE", ">peak", ">RMS", ">chatter", ">energy")
VERDICT = {True: "holds", False: "<b>does not hold</b>", None: NONE}
TITLES = {"step": "Step", "square": "Square (Case 1)", "ramp": "Ramp (Case 2)", "chirp": "Chirp, 1 to 20 Hz (Case 3)"}


def trial_page(document: Mapping, trials: Sequence[Trial], spreads: Sequence[Spread] = ()) -> str:
    """The page as HTML, of what `ers trial --json` prints and the runs behind it."""
    restart_ids()
    groups = dict.fromkeys((t.case, t.plant) for t in trials)
    sections = [
        _claims(trials) if document["papers_settings"] else "",
        *(_group([t for t in trials if (t.case, t.plant) == key]) for key in groups),
        _robustness(document, spreads),
        _laws(document),
    ]
    body = "\n".join([_header(document, trials), *sections, _footer(document, trials[0].run.has_volts)])
    return page.frame("Controllers on trial", "consistent", body)


def _header(document: Mapping, trials: Sequence[Trial]) -> str:
    tiles = []
    for case in list(dict.fromkeys(t.case for t in trials))[:4]:
        ran = [t for t in trials if (t.case, t.plant) == (case, trials[0].plant) and t.measures.stable]
        if ran:
            best = min(ran, key=lambda t: t.measures.rmse_rad)
            tiles.append(
                (
                    page.text(f"{case}, {best.plant}: {best.controller}"),
                    f'<span class="a">{degrees(best.measures.rmse_rad)}</span>',
                )
            )
    return page.header("consistent", "Controllers on trial", "ers trial", document["sentence"], tiles)


def _claims(trials: Sequence[Trial]) -> str:
    rows = [
        ((page.text(c.claim), page.text(c.case), page.text(c.measured), VERDICT[c.holds]), "") for c in claims(trials)
    ]
    lead = (
        "Claims for FTRC. What it gains over PID and H-infinity comes from the feed-forward: the line with PID beside"
        " the same feed-forward tells how much is left to the law."
    )
    return page.section("The paper's claims", lead, page.table(["claim", "case", "measured", ""], rows))


def _group(trials: Sequence[Trial]) -> str:
    first = trials[0]
    stable = [t.measures.rmse_rad for t in trials if t.measures.stable]
    rows = [(_cells(t), "chosen" if t.measures.stable and t.measures.rmse_rad == min(stable) else "") for t in trials]
    drawn = page.figure(trial_figures.curves(trials)) + page.figure(
        trial_figures.close_up(trials), "A short span, enlarged."
    )
    return page.section(
        page.text(f"{TITLES.get(first.case, first.case)}, {first.plant} plant"), "", page.table(HEADS, rows) + drawn
    )


def _robustness(document: Mapping, spreads: Sequence[Spread]) -> str:
    if not spreads:
        return ""
    rows = [
        (
            (
                page.text(f"{s.controller}, {s.plant}, {s.case}"),
                _range(s, "rmse_rad", math.degrees(1.0), "°"),
                _range(s, "settling_time_s", 1e3, " ms"),
                _range(s, "overshoot_pct", 1.0, " %"),
                _range(s, "chatter_V", 1.0, " V"),
                str(s.as_document()["never_settled"]),
                str(s.unstable),
            ),
            "",
        )
        for s in spreads
    ]
    lead = (
        f"{len(spreads[0].measures)} servos, every parameter and the size of every effect within a factor"
        f" {document['scatter']:g} of the plant's, the controllers knowing only their own. Median, and 5 to 95 % of the"
        " servos."
    )
    heads = ("", ">RMSE", ">settles", ">overshoot", ">chatter", ">never settle", ">unstable")
    return page.section(
        "Scattered servos",
        lead,
        page.table(heads, rows)
        + page.figure(trial_figures.spreads(spreads), "RMS error: every servo, and the median."),
    )


def _range(spread: Spread, name: str, factor: float, unit: str) -> str:
    q = spread.quantiles(name)
    return (
        NONE
        if q is None
        else (
            f'{digits(factor * q[1])}{unit}<br><span class="why">{digits(factor * q[0])} …'
            f" {digits(factor * q[2])}</span>"
        )
    )


def _cells(trial: Trial) -> tuple[str, ...]:
    m = trial.measures
    if not m.stable:
        return (page.text(trial.controller), "unstable", *[NONE] * (len(HEADS) - 2))
    settles = "never" if m.settling_time_s is None else f"{1e3 * m.settling_time_s:.1f} ms"
    return (
        page.text(trial.controller),
        settles,
        NONE if m.overshoot_pct is None else f"{m.overshoot_pct:.2f} %",
        degrees(m.steady_state_error_rad),
        degrees(m.rmse_rad),
        Unit("V")(m.peak_u_V),
        Unit("V")(m.rms_u_V),
        Unit("V")(m.chatter_V),
        Unit("J")(m.energy_J),
    )


def _laws(document: Mapping) -> str:
    rows = [
        ((page.text(name), page.text(sentence), page.text(document["gains"][name] or NONE)), "")
        for name, sentence in document["controllers"].items()
    ]
    lead = (
        "Settling: within 2 % of a jump's height, the longest of all jumps, or of the amplitude where nothing jumps."
        " Steady-state error: mean absolute error over the last 20 % of the time. Chatter: mean change of the voltage"
        " from sample to sample. Energy: the integral of u i, mostly holding current; with Table 1's K_t and K_e, which"
        " differ by 1.69, 41 % of the back-EMF's power has nowhere to go."
    )
    if not document["papers_settings"]:
        lead += " The paper's claims are for its own servo, gains, references, rate and voltage: not compared here."
    return page.section(
        "Laws and measures", lead, page.table(["law", "", "gains"], rows) + page.listed(document["notes"])
    )


def _footer(document: Mapping, has_volts: bool) -> str:
    c = document["conditions"]
    electric = [f"±{c['u_max_V']:g} V", f"noise {math.degrees(c['noise_rad']):.3g}°", *page.rig(c)]
    told = [
        f"amplitude {math.degrees(c['amplitude_rad']):.4g}° from rest at {math.degrees(c['start_rad']):.4g}°",
        f"{c['rate_hz']:g} Hz",
        *(electric if has_volts else ()),
        *(f"effect {effect['name']}" for effect in c["effects"]),
        *page.origin(document),
    ]
    return page.footer(told)
