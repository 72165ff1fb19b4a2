"""The data of the diagnosis's charts: traces, the map of residuals, the error over frequency, the candidates.

Each chart is a plain record that script/*.js draws; series are thinned and packed.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from ers_mj.diagnosis.evidence import Evidence, LatentForce, RecordView, ResidualMap, Rung
from ers_mj.diagnosis.mismatch_spectrum import Mismatch
from ers_mj.report.charts import packed
from ers_mj.report.display import Unit, noun, shown
from ers_mj.report.thinning import decimate, largest, merged, worst_span

MOST_RUNGS = 16  # candidates in the ladder
POINTS = 1600  # of a series: two for every pixel of a chart
COARSEST = 1 / 600  # of a recording: spans nearer than this are shaded as one

# -- traces --------------------------------------------------------------------------------------------------------


def trace(view: RecordView, evidence: Evidence, effects: Sequence[str]) -> dict:
    """A recording over its free runs, before, after, and after without each of these effects; the residuals; the
    input. Told twice where it is long: whole, and the span where the model before does worst.
    """
    unit = shown(evidence.output_unit, largest(view.measured))
    fine = shown(evidence.output_unit, largest(view.measured - view.before)) if unit.label != "mm" else unit
    worst, n = worst_span(view), view.t.size
    spans = [slice(0, n)]
    if worst is not None and n > POINTS:
        begin, end = np.searchsorted(view.t, worst)
        room = (end - begin) // 10 + 1  # so that a zoom to the span lies within what is told of it
        spans.append(slice(max(begin - room, 0), end + room))
    closest = float(view.t[-1] - view.t[0]) * COARSEST if n else 0.0
    given = shown(evidence.input_unit, largest(view.u))
    called = "input" if evidence.input_unit not in ("rad", "m") else "position command"
    return {
        "kind": "trace",
        "output": {"name": f"{noun(evidence.output_unit)} [{unit.label}]", "unit": unit.label},
        "residual": {
            "name": f"residual [{fine.label}], measured less simulated",
            "unit": fine.label,
            "band": _finite(2 * evidence.noise * fine.factor),
        },
        "input": {"name": f"{called} [{given.label}]", "unit": given.label},
        "shaded": [[begin, max(end, begin + closest)] for begin, end in merged(view.shaded, closest)],
        "worst": worst,
        "levels": [_level(view, effects, span, (unit, fine, given)) for span in spans],
    }


def _level(view: RecordView, effects: Sequence[str], span: slice, units: tuple[Unit, Unit, Unit]) -> dict:
    """The samples of a span, thinned, in the units of output, residual and input; runs that leave all bounds are cut
    where no chart would show them.
    """
    unit, fine, given = units
    t, measured = view.t[span], view.measured[span]
    runs = {"before": view.before[span], "after": view.after[span]}
    out = {name: view.without[name][span] for name in effects if name in view.without}
    low, high = _ends(np.concatenate([measured, *runs.values()]))
    room = high - low
    out = {name: np.clip(x, low - room, high + room) for name, x in out.items()}

    def drawn(x: np.ndarray, factor: float) -> dict:
        return packed(decimate(t, x * factor, POINTS)[1])

    def each(made, factor: float) -> dict:
        told = {name: drawn(made(x), factor) for name, x in runs.items()}
        return told | {"without": [drawn(made(out[name]), factor) if name in out else None for name in effects]}

    return {
        "t": packed(decimate(t, measured, POINTS)[0]),
        "measured": drawn(measured, unit.factor),
        "output": each(lambda x: x, unit.factor),
        "residual": each(lambda x: measured - x, fine.factor),
        "u": _input(t, view.u[span] * given.factor),
    }


def _input(t: np.ndarray, u: np.ndarray) -> dict:
    """The input where it changes, as it is held between samples; thinned where that is more than can be seen."""
    changed = np.flatnonzero(np.concatenate([[True], ~(u[1:] == u[:-1])])) if t.size else np.zeros(0, int)
    at, held = (t[changed], u[changed]) if changed.size <= POINTS else decimate(t, u, POINTS)
    if t.size and at[-1] < t[-1]:
        at, held = np.append(at, t[-1]), np.append(held, u[-1])
    return {"t": packed(at), "y": packed(held)}


def switched(view: RecordView, effects: Sequence[str], unit: Unit) -> dict[str, str]:
    """A sentence for each place of the switches: all effects on, one off, all off."""
    error = {name: _rms(view, x) for name, x in {"": view.after, "before": view.before, **view.without}.items()}
    told, before = f"rms error on {view.name}: {unit(error[''])}", unit(error["before"])
    out = {
        "none": f"The curve “after” has all named effects in it; {told}.",
        "all": f"Without any named effect, refitted, which is “before”; {told} with them, {before} without.",
    }
    for k, name in enumerate(effects):
        without = unit(error[name]) if name in error else "not at work there"
        out[str(k)] = (
            f"Without {name.replace('_', ' ')}, nothing refitted in its place; {told} with it, {without} without."
        )
    return out


def _rms(view: RecordView, x: np.ndarray) -> float:
    error = (view.measured - x)[np.isfinite(view.measured)]
    return float(np.sqrt(np.mean(error**2))) if error.size else float("nan")


# -- what stays unknown --------------------------------------------------------------------------------------------


def latent(force: LatentForce, evidence: Evidence) -> dict:
    """The acceleration that a recording asks for beside the answer, and what the tables give of it, over time."""
    unit = f"{evidence.output_unit}/s²"
    drawn = [("asked for beside the answer", "before", force.asked)]
    if force.tabled is not None:
        drawn.append(("of which the tables give", "after", force.tabled))
    return {
        "kind": "recorded",
        "panels": [{"name": f"{name} [{unit}]", "unit": unit, "kind": kind, "held": False} for name, kind, _ in drawn],
        "shaded": [],
        "levels": [[_over_time(force.t, x) for *_, x in drawn]],
    }


def _over_time(t: np.ndarray, x: np.ndarray) -> dict:
    at, thinned = decimate(t, x, POINTS)
    return {"t": packed(at), "y": packed(thinned)}


# -- the map of residuals ------------------------------------------------------------------------------------------


def residual_map(residuals: ResidualMap, evidence: Evidence) -> dict:
    """Rms residual over (angle, speed), before and after on one scale of colour."""
    residuals = _known(residuals)
    angle = shown(evidence.output_unit, largest(residuals.angle_edges))
    speed = Unit("mm/s", 1e3) if angle.label == "mm" else shown(f"{evidence.output_unit}/s")
    size = shown(evidence.output_unit, largest(residuals.rms_before))
    before, after = (x * size.factor for x in (residuals.rms_before, residuals.rms_after))
    tops = [float(np.nanquantile(x, 0.98)) for x in (before, after) if np.isfinite(x).any()]
    return {
        "kind": "map",
        "x": _digits(residuals.angle_edges * angle.factor),
        "y": _digits(residuals.speed_edges * speed.factor),
        "x_name": f"{noun(evidence.output_unit)} [{angle.label}]",
        "y_name": f"speed [{speed.label}]",
        "x_unit": angle.label,
        "y_unit": speed.label,
        "unit": size.label,
        "top": max(tops, default=1.0) or 1.0,
        "before": packed(before.ravel()),
        "after": packed(after.ravel()),
    }


def _known(residuals: ResidualMap) -> ResidualMap:
    """The part of the map in which some bin holds data."""
    known = np.isfinite(residuals.rms_before) | np.isfinite(residuals.rms_after)
    if not known.any():
        return residuals
    (a, b), (c, d) = ((k[0], k[-1] + 1) for k in (np.flatnonzero(known.any(axis=axis)) for axis in (1, 0)))
    return ResidualMap(
        residuals.angle_edges[a : b + 1],
        residuals.speed_edges[c : d + 1],
        residuals.rms_before[a:b, c:d],
        residuals.rms_after[a:b, c:d],
    )


# -- the error over frequency --------------------------------------------------------------------------------------


def spectrum(found: Mismatch, evidence: Evidence) -> dict:
    """The error's amplitude over frequency with what is linear in it and what is not, and the gap between measured and
    simulated motion.
    """
    f, step = found.f_hz, found.f_hz[1] - found.f_hz[0]
    unit = shown(evidence.output_unit, float(np.sqrt(found.error.max() * step)))
    levels = (
        ("measured", "motion", found.motion),
        ("before", "error", found.error),
        ("after", "linear in it", found.linear),
        ("distortion", "distortion in it", found.distortion),
        ("noise-line", "noise", found.noise),
    )
    sure = found.response.sure & found.beyond
    size, phase = np.full(f.size, np.nan), np.full(f.size, np.nan)
    size[sure] = 20 * np.log10(np.abs(found.response.g[sure]))
    phase[sure] = np.degrees(np.unwrap(np.angle(found.response.g[sure])))
    return {
        "kind": "spectrum",
        "f": packed(f),
        "levels": [
            {
                "kind": kind,
                "name": name,
                "y": packed(np.log10(unit.factor * np.sqrt(np.where(x > 0, x, np.nan) * step))),
            }
            for kind, name, x in levels
        ],
        "bottom": 0.2 * float(np.sqrt(found.noise.min() * step)) * unit.factor,
        "size": packed(size),
        "phase": packed(phase),
        "region": list(found.region or ()),
        "unit": unit.label,
        "names": [
            f"rms in {step:.2g} Hz [{unit.label}]",
            "measured over simulated motion, size [dB]",
            "measured over simulated motion, phase [°]",
        ],
    }


# -- the ladder of candidates --------------------------------------------------------------------------------------


def ladder(rungs: Sequence[Rung], evidence: Evidence) -> dict:
    """What each candidate takes off the training cost of the baseline, and its held-out error where it was scored;
    once, where several rounds compared it.
    """
    once: dict[str, Rung] = {}
    for rung in rungs:
        once.setdefault(rung_name(rung), rung)
    unit = shown(evidence.output_unit, max((rung.heldout_rmse or 0.0 for rung in rungs), default=0.0) or None)
    return {
        "kind": "ladder",
        "name": "taken off the baseline’s cost of the training recordings",
        "rungs": [
            {
                "name": name,
                "chosen": rung.chosen,
                "gain": _finite(rung.total),
                "scored": "" if rung.heldout_rmse is None else f"held out {unit(rung.heldout_rmse)}",
            }
            for name, rung in list(once.items())[:MOST_RUNGS]
        ],
    }


def has_totals(rungs: Sequence[Rung]) -> bool:
    """Whether what the candidates take off the baseline's cost is told."""
    return any(np.isfinite(rung.total) for rung in rungs)


def rung_name(rung: Rung) -> str:
    """The effects of a rung, "baseline" where there are none."""
    return " + ".join(name.replace("_", " ") for name in rung.effects) or "baseline"


# -- numbers -------------------------------------------------------------------------------------------------------


def effects_of(records: Sequence[RecordView]) -> list[str]:
    """The effects whose absence is known in some of these recordings."""
    return list(dict.fromkeys(name for view in records for name in view.without))


def _finite(x: float) -> float | None:
    return float(x) if np.isfinite(x) else None


def _ends(x: np.ndarray) -> tuple[float, float]:
    known = x[np.isfinite(x)]
    return (float(known.min()), float(known.max())) if known.size else (-1.0, 1.0)


def _digits(x: np.ndarray) -> list[float]:
    return [float(f"{value:.6g}") for value in x]
