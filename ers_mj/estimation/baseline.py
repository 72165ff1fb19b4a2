"""The baseline: Eq. (1) where the datasheet gives L, else Eq. (5), its identifiable parameters refitted to the
recordings.
"""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np

from ers_mj.data.prepared import Trace, counted
from ers_mj.decisions.thresholds import POLICY
from ers_mj.effects import BY_NAME
from ers_mj.effects.quantities import Scales
from ers_mj.errors import InputError
from ers_mj.estimation.fit import Along, descend, fit, hopped
from ers_mj.estimation.initial_state import with_starts, without_spikes
from ers_mj.estimation.objective import Fit, cost_of, run_of, tau_of
from ers_mj.servo.datasheet import Datasheet
from ers_mj.servo.model import OBSERVER_RATE, Model

SHARE_PRIOR = 0.03  # standard deviation of ln(emf_share) about the datasheet's: B of a servo scatters by half of itself
OPENING_RATES = (20.0, 5.0)  # observer rates [1/s] of the search from scratch
OPENING_TAU = 1e3  # and the misfit at which its cost turns to logarithms
STARTS = 6  # guesses that are refitted
OPENED = {
    "preload": STARTS,
    "spring": 2,
    "bare": 2,
}  # of these in a search that is only opened, in which the first has the most terms
BEHIND = 0.25  # of C per block, by which a kind is too far behind to be finished
SPRINGS = {"bare": (), "spring": ("a_1",), "preload": ("a_1", "c_1")}
OVER_INERTIA, INERTIAS = (
    ("a_1", "a_2", "b", "c_1", "c_2", "ampere"),
    (0.6, 0.7, 0.8, 1.2, 1.4, 1.8),
)  # what the inertia divides, and how it is tried beside what was found


def scales_of(traces: Sequence[Trace], values: Mapping[str, float], is_angle: bool, tau_e: float | None) -> Scales:
    """Typical sizes in these recordings."""
    y = np.concatenate([t.y[t.valid] for t in traces])
    low, high = float(y.min()), float(y.max())
    lags = [max(1, round(0.02 / t.sample_time)) for t in traces]
    speeds = np.concatenate([np.abs(t.y[k:] - t.y[:-k]) / (k * t.sample_time) for t, k in zip(traces, lags)])
    peak = max(float(np.max(np.abs(t.u))) for t in traces)
    supplies = [t.supply for t in traces if t.supply is not None]
    return Scales(
        position=0.5 * (high - low),
        low=low,
        high=high,
        speed=float(np.nanquantile(speeds, 0.95)) + 1e-12,
        acceleration=max(values.get("c_2", 0.0), 0.05 * abs(values["b"]) * peak),
        input=peak,
        sample_time=float(np.median([t.sample_time for t in traces])),
        noise=float(np.median([t.sigma for t in traces])),
        quantum=max(t.quantum for t in traces),
        is_angle=is_angle,
        tau_e_datasheet=tau_e,
        duration=max(float(t.t[-1] - t.t[0]) for t in traces),
        recordings=len(traces),
        supply=float(np.median(np.concatenate(supplies))) if supplies else None,
    )


@dataclass(frozen=True)
class Start:
    """The refitted baseline, the traces with their fitted initial states, and other values that fits may start from.

    A refitted baseline has swallowed what it could of a missing effect; the datasheet's values, or those found under a
    scaffold, have not.
    """

    fit: Fit
    traces: Sequence[Trace]
    anchors: tuple[Mapping[str, float], ...] = ()


def baseline(traces: Sequence[Trace], datasheet: Datasheet | None, is_angle: bool, jobs: int = 1) -> Start:
    """The refitted baseline of these recordings.

    Raises:
        InputError: no motion of the model resembles the recordings.
    """
    known = datasheet.to_lumped() if datasheet is not None else {}
    if {"a_2", "b"} <= known.keys():
        sheet = _from_datasheet(traces, known, is_angle)
        refitted, traces, others = _refined(sheet, traces, jobs)
        found = Start(refitted, traces, ({**sheet.values, "theta_0": refitted.model.values["theta_0"]}, *others))
    else:
        found = _from_scratch(traces, known, is_angle, jobs)
    if not np.isfinite(found.fit.cost):
        raise InputError(
            "no motion that the reduced model can make resembles these recordings: check units and signs of input and"
            " output"
        )
    model, gear = found.fit.model, datasheet.parameters.get("n") if datasheet is not None else None
    # a turn of a motor: the least common multiple of its poles and slots, of which the smallest have two and three
    cogs = 3
    drive = max(float(np.max(np.abs(motion[:, 2]))) for motion in run_of(model, found.traces, OBSERVER_RATE).motions)
    scales = replace(model.scales, drive=drive, cog=2 * np.pi / (cogs * gear) if gear else model.scales.cog)
    return replace(found, fit=replace(found.fit, model=replace(model, scales=scales)))


def sharpened(start: Start, travel: float) -> Start:
    """The baseline refitted to what coarse converters tell (see quantisation.py), where some are coarse for the travel
    [output unit]: their thresholds sharpen a fit that is near, and lead one astray that is not. The inertia, which
    divides all of Eq. (6)'s letters but the angle, is what they tell least, so it is tried larger and smaller too.
    """
    traces = counted(start.traces, travel)
    if all(t.converter is None for t in traces):
        return start
    traces = with_starts(start.fit.model, traces)
    found = fit(start.fit.model, traces)
    tau, values = tau_of(found.misfit), found.model.values
    inert = [
        replace(found.model, values={**values, **{name: values[name] / ratio for name in OVER_INERTIA}})
        for ratio in INERTIAS
    ]
    found = min(
        [fit(found.model, traces, tau=tau), *(fit(model, traces, tau=tau, steps=20) for model in inert)],
        key=lambda found: found.cost,
    )
    traces = with_starts(found.model, traces)
    return replace(start, fit=fit(found.model, traces, tau=tau_of(found.misfit)), traces=traces)


def opening(traces: Sequence[Trace], is_angle: bool) -> dict[str, float]:
    """Eq. (6)'s letters from recordings alone, with the springs that these support: near enough for a search to begin,
    not refined.

    What was found with more terms opens the searches with fewer; a search that is far behind is not finished.
    """
    kinds = _Kinds.of(traces, {}, is_angle)
    best: dict[str, Fit] = {}
    for kind, count in OPENED.items():
        places = [*kinds.places(kind), *(kinds.prepared(kind, found.model.values) for found in best.values())]
        models = [Model(values, _free(values, traces), scales=kinds.scales) for values in places]
        models.sort(key=lambda model: cost_of(model, traces, OPENING_RATES[0], OPENING_TAU))
        tries = [descend(model, traces, OPENING_RATES[0], OPENING_TAU, 6, 1.0) for model in models[:count]]
        best[kind] = min(tries, key=lambda found: found.cost)
    level = min(found.cost for found in best.values()) + BEHIND * best["bare"].misfit.size
    finished = {
        kind: fit(found.model, traces, rate=OPENING_RATES[1], steps=10)
        for kind, found in best.items()
        if found.cost <= level
    }
    return dict(_simplest(finished).model.values)


def _refined(model: Model, traces: Sequence[Trace], jobs: int) -> tuple[Fit, Sequence[Trace], list[dict[str, float]]]:
    """Fit, with the initial states fitted before and after; the traces with these, and the values of another valley if
    it was met.

    From afar tangents and finite differences may lead to different valleys. The lower one is the baseline, the other
    may be the less bent.
    """
    traces = with_starts(model, traces)
    first, second = sorted(
        (fit(model, traces, along=Along(by_tangents=by_tangents)) for by_tangents in (True, False)),
        key=lambda found: found.cost,
    )
    traces = with_starts(first.model, without_spikes(first.model, traces))
    found = fit(first.model, traces, tau=tau_of(first.misfit))
    others = [dict(second.model.values)] if second.cost - found.cost > POLICY.valley else []
    return *hopped(found, traces, tau_of(found.misfit), jobs, restart=True), others


def _from_datasheet(traces: Sequence[Trace], known: Mapping[str, float], is_angle: bool) -> Model:
    values = {"a_1": 0.0, "c_1": 0.0, "c_2": 0.0, "theta_0": 0.0, "tau_e": 0.0, "emf_share": 0.0, **known}
    values.setdefault("ampere", _ampere(values["b"], traces))
    scales = scales_of(traces, values, is_angle, values["tau_e"] or None)
    values["c_2"] = max(values["c_2"], 1e-3 * scales.acceleration)
    return Model(values, _free(values, traces), scales=scales, priors=_priors(values))


def _free(values: Mapping[str, float], traces: Sequence[Trace]) -> tuple[str, ...]:
    """What is fitted: springs only where there is one, the back-EMF's share only where current or an open circuit shows
    it.
    """
    spring, preload = values["a_1"] > 0, values["c_1"] > 0
    names = [
        "a_2",
        "b",
        "c_2",
        *(["a_1"] if spring else []),
        *(["c_1"] if preload else []),
        *(["theta_0"] if spring or preload else []),
    ]
    opened = any(t.enable is not None and not t.enable.all() for t in traces)
    if values["tau_e"] > 0:
        names.append("tau_e")
    seen = any(c.kind == "current" for t in traces for c in t.channels)
    if values["tau_e"] > 0 or opened or seen:
        names.append("emf_share")
    if seen:
        names.append("ampere")
    return tuple(names)


def _ampere(b: float, traces: Sequence[Trace]) -> float:
    """A first n K_t / J: b times the resistance that voltage over current makes."""
    pairs = [(t.u, c.values) for t in traces for c in t.channels if c.kind == "current"]
    if not pairs:
        return b
    u, i = (np.nan_to_num(np.concatenate(column)) for column in zip(*pairs))
    return b * max(float(u @ i), 0.05 * float(np.linalg.norm(u) * np.linalg.norm(i))) / float(i @ i)


def _priors(values: Mapping[str, float]) -> dict[str, tuple[float, float]]:
    return (
        {"emf_share": (math.log(values["emf_share"]), SHARE_PRIOR)}
        if values["tau_e"] > 0 and values["emf_share"] > 0
        else {}
    )


def _from_scratch(traces: Sequence[Trace], known: Mapping[str, float], is_angle: bool, jobs: int) -> Start:
    """Several guesses, refitted as observers of falling gain; the simplest structure that the data supports.

    What disturbs the search most (Effect.scaffold: stops, one-sided friction) is tried as a scaffold that is taken away
    at the end: a spring must beat one-sided friction to be kept, and what was found under the scaffold stays as an
    anchor for later fits.
    """
    kinds = _Kinds.of(traces, known, is_angle)
    chosen = _simplest({kind: _searched(traces, kinds, kind) for kind in SPRINGS})
    scales = scales_of(traces, chosen.model.values, is_angle, None)
    found, traces, others = _refined(replace(chosen.model, effects=(), scales=scales), traces, jobs)
    return Start(found, traces, (*((dict(chosen.model.values),) if chosen.model.effects else ()), *others))


def _simplest(found: Mapping[str, Fit]) -> Fit:
    """The fit with the fewest springs that the data supports."""
    kinds = [kind for kind in SPRINGS if kind in found]
    chosen = found[kinds[0]]
    price = POLICY.support * chosen.misfit.size
    for kind in kinds[1:]:
        if chosen.cost - found[kind].cost > price:
            chosen = found[kind]
    return chosen


@dataclass(frozen=True)
class _Kinds:
    """Guesses by the spring terms that they have, and the least that these may be."""

    starts: Sequence[Mapping[str, float]]
    scales: Scales

    @classmethod
    def of(cls, traces: Sequence[Trace], known: Mapping[str, float], is_angle: bool) -> _Kinds:
        """Those of recordings, beside what is known.

        Raises:
            InputError: an input of zeros, or too little motion.
        """
        from ers_mj.estimation.initial_guess import (
            guesses,  # brings scipy.signal, which takes a second to import and is needed here alone
        )

        if not any(t.u.any() for t in traces):
            raise InputError("the input is zero throughout: without a datasheet nothing tells what an input does")
        opened = any(t.enable is not None and not t.enable.all() for t in traces)
        shown = opened or any(c.kind == "current" for t in traces for c in t.channels)
        starts = [
            {"tau_e": 0.0, "emf_share": 0.5 if shown else 0.0, "ampere": _ampere(g["b"], traces), **g, **known}
            for g in guesses(traces)
        ]
        if not starts:
            raise InputError(
                "the output nowhere moves for long enough to guess parameters from it: a longer or livelier recording,"
                " or a datasheet, was expected"
            )
        return cls(starts, scales_of(traces, starts[0], is_angle, None))

    def prepared(self, kind: str, values: Mapping[str, float]) -> dict[str, float]:
        """Values with the spring terms of a kind and no others."""
        least = {"a_1": 1e-3 * self.scales.acceleration / self.scales.position, "c_1": 0.1 * self.scales.acceleration}
        absent = {name: 0.0 for name in least if name not in SPRINGS[kind]}
        if kind == "bare":
            absent["theta_0"] = 0.5 * (self.scales.low + self.scales.high)
        return {**values, **{name: max(values[name], least[name]) for name in SPRINGS[kind]}, **absent}

    def places(self, kind: str) -> list[dict[str, float]]:
        """The most promising guesses of a kind, prepared."""
        pool = [v for v in self.starts if (v["c_1"] > 0) == (kind == "preload")] or self.starts
        return [self.prepared(kind, values) for values in pool[:STARTS]]


def _searched(traces: Sequence[Trace], kinds: _Kinds, kind: str) -> Fit:
    """The best of the guesses with these spring terms, under the scaffold that serves it best, of the two that open
    best.
    """
    at = ((effect.name, effect.scaffold(kinds.scales, bool(SPRINGS[kind]))) for effect in BY_NAME.values())
    scaffolds = [(), *(((name, start),) for name, start in at if start is not None)]
    tries = []
    for values in kinds.places(kind):
        for effects in scaffolds:
            model = Model(values, _free(values, traces), effects=effects, scales=kinds.scales)
            tries.append(descend(model, traces, OPENING_RATES[0], OPENING_TAU, 6, 1.0))
    tries.sort(key=lambda f: f.cost)
    finals = [fit(f.model, traces, rate=OPENING_RATES[1], steps=10) for f in tries[:2]]
    return min(finals, key=lambda f: f.cost)
