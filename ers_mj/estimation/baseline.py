"""The baseline: Eq. (1) where the datasheet gives L, else Eq. (5), its identifiable parameters refitted to the
recordings.
"""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np

from ers_mj.data.prepared import Trace, counted
from ers_mj.decisions import explained
from ers_mj.decisions.thresholds import POLICY
from ers_mj.errors import InputError
from ers_mj.estimation.fit import Along, fit, hopped
from ers_mj.estimation.initial_state import with_starts, without_spikes
from ers_mj.estimation.objective import Fit, run_of, tau_of
from ers_mj.estimation.scales import ampere_in, free_in, scales_of
from ers_mj.estimation.search import HOLDING, SPRINGS, Kinds, simplest
from ers_mj.servo.datasheet import Datasheet
from ers_mj.servo.model import OBSERVER_RATE, SIGNED, Model


@dataclass(frozen=True)
class BackEMF:
    """The back-EMF's share in the damping, and how surely it is known: standard deviations of its logarithm."""

    share_prior: float = 0.03  # about the datasheet's: B of a servo scatters by half of itself
    share: float = 0.5  # at first where nothing tells it
    least_share: float = 0.05  # how near to none or all it begins
    told_prior: float = 0.3  # where the letters of a datasheet tell it, each within some 15 %,
    untold_prior: float = 0.7  # and where not


BACK_EMF = BackEMF()

OVER_INERTIA, INERTIAS = (
    ("a_1", "a_2", "b", "c_1", "c_2", "ampere"),
    (0.6, 0.7, 0.8, 1.2, 1.4, 1.8),
)  # what the inertia divides, and how it is tried beside what was found


@dataclass(frozen=True)
class Held:
    """A baseline in which an effect holds the output where others have a spring, and the traces with the initial states
    that it gives them.
    """

    fit: Fit
    traces: Sequence[Trace]


@dataclass(frozen=True)
class Start:
    """The refitted baseline, the traces with their fitted initial states, other values that fits may start from, and
    the best baseline with an effect in the spring's place, where one was looked for; ``is_spring_known`` where a
    datasheet names the spring.

    A refitted baseline has swallowed what it could of a missing effect; the datasheet's values, or those found under a
    scaffold, have not.
    """

    fit: Fit
    traces: Sequence[Trace]
    anchors: tuple[Mapping[str, float], ...] = ()
    held: Held | None = None
    is_spring_known: bool = False


def baseline(traces: Sequence[Trace], datasheet: Datasheet | None, is_angle: bool, jobs: int = 1) -> Start:
    """The refitted baseline of these recordings.

    Raises:
        InputError: no motion of the model resembles the recordings.
    """
    known = datasheet.to_lumped() if datasheet is not None else {}
    if {"a_2", "b"} <= known.keys():
        found = _from_datasheet(traces, known, is_angle, jobs)
    else:
        found = _from_scratch(traces, known, is_angle, jobs)
    if not np.isfinite(found.fit.cost):
        raise InputError(
            "no motion that the reduced model can make resembles these recordings: check units and signs of input and"
            " output"
        )
    found = found if found.is_spring_known else unsprung(found, jobs)
    held = found.held and replace(found.held, fit=_sized(found.held.fit, found.held.traces, datasheet))
    return replace(found, fit=_sized(found.fit, found.traces, datasheet), held=held)


def unsprung(start: Start, jobs: int) -> Start:
    """The start without a spring that has the whole travel on one side, where a constant torque does as well: that one
    is missing physics, to be named.
    """
    model, tau = start.fit.model, tau_of(start.fit.misfit)
    scales, values = model.scales, {**model.values, "a_1": 0.0, "c_1": 0.0}
    away = model.values["theta_0"] - 0.5 * (scales.low + scales.high)
    if values == model.values or abs(away) <= 0.5 * (scales.high - scales.low):
        return start
    torque = model.values["a_1"] * away + math.copysign(model.values["c_1"], away)
    plain = replace(model, values=values, free=free_in(values, start.traces))
    for name in {effect.curves for effect in HOLDING.values()}:
        pushed = fit(plain.with_effect(name, np.array([torque])), start.traces, tau=tau)
        priced, before = (explained.cost(f.misfit, tau) + POLICY.parameter_price * f.size for f in (pushed, start.fit))
        if priced <= before:
            found, traces, others = _refined(plain, start.traces, jobs)
            return replace(start, fit=found, traces=traces, anchors=(dict(pushed.model.values), *others))
    return start


def _sized(found: Fit, traces: Sequence[Trace], datasheet: Datasheet | None) -> Fit:
    """The fit with the scales that only a fitted model and a gear tell, and a back-EMF."""
    model = _with_back_emf(found.model, traces, datasheet.emf_damping if datasheet is not None else None)
    gear = datasheet.parameters.get("n") if datasheet is not None else None
    # a turn of a motor: the least common multiple of its poles and slots, of which the smallest have two and three
    cogs = 3
    drive = max(float(np.max(np.abs(motion[:, 2]))) for motion in run_of(model, traces, OBSERVER_RATE).motions)
    springs = model.values["a_1"] * model.scales.position + model.values["c_1"]
    is_held = bool(model.effects) or springs > model.scales.acceleration
    scales = replace(
        model.scales, is_held=is_held, drive=drive, cog=2 * np.pi / (cogs * gear) if gear else model.scales.cog
    )
    return replace(found, model=replace(model, scales=scales))


def _with_back_emf(model: Model, traces: Sequence[Trace], damping: float | None) -> Model:
    """The model with a first share of the back-EMF in the damping, and how well it is known, where neither a datasheet
    nor the recordings tell it; ``damping`` [1/s] is the back-EMF's where a datasheet tells that. What is told a torque
    or a current has none.
    """
    if model.values["emf_share"] > 0 or traces[0].input_kind in ("torque", "current"):
        return model
    least = BACK_EMF.least_share
    share = min(max(damping / model.values["a_2"], least), 1.0 - least) if damping else BACK_EMF.share
    prior = math.log(share), BACK_EMF.told_prior if damping else BACK_EMF.untold_prior
    values = {**model.values, "emf_share": share}
    return replace(model, values=values, priors={**(model.priors or {}), "emf_share": prior})


def sharpened(start: Start, travel: float) -> Start:
    """The baseline refitted to what coarse converters tell (see quantisation.py), where some are coarse for the travel
    [output unit].
    """
    held = start.held and Held(*_sharpened(start.held.fit, start.held.traces, travel))
    found, traces = _sharpened(start.fit, start.traces, travel)
    return replace(start, fit=found, traces=traces, held=held)


def _sharpened(found: Fit, traces: Sequence[Trace], travel: float) -> tuple[Fit, Sequence[Trace]]:
    """A fit refitted to the thresholds of coarse converters: they sharpen a fit that is near, and lead one astray that
    is not. The inertia, which divides all of Eq. (6)'s letters but the angle, is what they tell least, so it is tried
    larger and smaller too.
    """
    told = counted(traces, travel)
    if all(t.converter is None for t in told):
        return found, traces
    traces = with_starts(found.model, told)
    found = fit(found.model, traces)
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
    return fit(found.model, traces, tau=tau_of(found.misfit)), traces


def _refined(model: Model, traces: Sequence[Trace], jobs: int) -> tuple[Fit, Sequence[Trace], list[dict[str, float]]]:
    """Fit, with the initial states fitted before and after; the traces with these, and the values of another valley if
    it was met.

    From afar tangents and finite differences may lead to different valleys. The lower one is the baseline, the other
    may be the less bent; where the first explains all, no other is looked for.
    """
    traces = with_starts(model, traces)
    first = fit(model, traces)
    second = first if _explains(first) else fit(model, traces, along=Along(by_tangents=False))
    first, second = sorted((first, second), key=lambda found: found.cost)
    traces = with_starts(first.model, without_spikes(first.model, traces))
    found = fit(first.model, traces, tau=tau_of(first.misfit))
    others = [dict(second.model.values)] if second.cost - found.cost > POLICY.valley else []
    return *hopped(found, traces, tau_of(found.misfit), jobs, restart=True), others


def _from_datasheet(traces: Sequence[Trace], known: Mapping[str, float], is_angle: bool, jobs: int) -> Start:
    """The datasheet's values refitted; where it names no spring, others may have what holds the output."""
    sheet = _of_datasheet(traces, known, is_angle)
    refitted, started, others = _refined(sheet, traces, jobs)
    if explained.is_model_error(refitted.misfit) and _acts_the_other_way(traces, sheet.values["b"]):
        turned = replace(sheet, values={**sheet.values, **{name: -sheet.values[name] for name in SIGNED}})
        other, there, more = _refined(turned, traces, jobs)
        if explained.cost(other.misfit, 1.0) < explained.cost(refitted.misfit, 1.0):
            sheet, refitted, started, others = turned, other, there, more
    anchors = ({**sheet.values, "theta_0": refitted.model.values["theta_0"]}, *others)
    found = Start(refitted, started, anchors)
    if sheet.values["a_1"] > 0 or sheet.values["c_1"] > 0:
        return replace(found, is_spring_known=True)
    if _explains(refitted):
        return found
    kinds = Kinds.of(traces, {**known, **{n: sheet.values[n] for n in SIGNED if n in known}}, is_angle)
    if "a_1" not in known:
        found = _supported(found, _refined_springs(kinds, traces, jobs), anchors)
    return replace(found, held=_held(kinds, traces, jobs))


def _acts_the_other_way(traces: Sequence[Trace], b: float) -> bool:
    """Whether a regression says that the input acts the other way than a datasheet says."""
    from ers_mj.estimation.initial_guess import guesses  # brings scipy.signal, as in search

    best = next(iter(guesses(traces)), None)
    return best is not None and best.values["b"] * b < 0


def _explains(found: Fit) -> bool:
    return explained.is_near_noise(found.misfit) and explained.is_quiet(found.misfit, tau_of(found.misfit))


def _supported(bare: Start, sprung: Start, anchors: tuple) -> Start:
    """The start with springs where the data supports them."""
    tau = tau_of(sprung.fit.misfit)
    gain = explained.cost(bare.fit.misfit, tau) - explained.cost(sprung.fit.misfit, tau)
    if gain <= POLICY.support * bare.fit.misfit.size:
        return bare
    return replace(sprung, anchors=(*sprung.anchors, *anchors))


def _of_datasheet(traces: Sequence[Trace], known: Mapping[str, float], is_angle: bool) -> Model:
    values = {"a_1": 0.0, "c_1": 0.0, "c_2": 0.0, "theta_0": 0.0, "tau_e": 0.0, "emf_share": 0.0, **known}
    values.setdefault("ampere", ampere_in(values["b"], traces))
    scales = scales_of(traces, values, is_angle, values["tau_e"] or None)
    values["c_2"] = max(values["c_2"], 1e-3 * scales.acceleration)
    return Model(values, free_in(values, traces), scales=scales, priors=_priors(values))


def _priors(values: Mapping[str, float]) -> dict[str, tuple[float, float]]:
    return (
        {"emf_share": (math.log(values["emf_share"]), BACK_EMF.share_prior)}
        if values["tau_e"] > 0 and values["emf_share"] > 0
        else {}
    )


def _from_scratch(traces: Sequence[Trace], known: Mapping[str, float], is_angle: bool, jobs: int) -> Start:
    """Several guesses, refitted as observers of falling gain; the simplest structure that the data supports, and the
    best one with an effect in the spring's place.
    """
    kinds = Kinds.of(traces, known, is_angle)
    found = _refined_springs(kinds, traces, jobs)
    return found if _explains(found.fit) else replace(found, held=_held(kinds, traces, jobs))


def _refined_springs(kinds: Kinds, traces: Sequence[Trace], jobs: int) -> Start:
    """What the data supports of springs, refitted.

    What disturbs the search most (Effect.scaffold: stops, one-sided friction) is tried as a scaffold that is taken away
    at the end: a spring must beat one-sided friction to be kept, and what was found under the scaffold stays as an
    anchor for later fits.
    """
    searched = {kind: kinds.searched(kind) for kind in SPRINGS}
    chosen = simplest({kind: found for kind, found in searched.items() if found is not None})
    scales = scales_of(traces, chosen.model.values, kinds.scales.is_angle, None)
    found, started, others = _refined(replace(chosen.model, effects=(), scales=scales), traces, jobs)
    return Start(found, started, (*((dict(chosen.model.values),) if chosen.model.effects else ()), *others))


def _held(kinds: Kinds, traces: Sequence[Trace], jobs: int) -> Held | None:
    """The best baseline with an effect in the spring's place, begun from guesses of its own."""
    found = [(kinds.searched(name), name) for name in HOLDING]
    tries = [(one.cost, one.model, name) for one, name in found if one is not None]
    if not tries:
        return None
    _, model, name = min(tries, key=lambda one: one[0])
    scales = scales_of(traces, model.values, kinds.scales.is_angle, None)
    alone = replace(model, effects=tuple(e for e in model.effects if e[0] == name), scales=scales)
    refitted, started, _ = _refined(alone, traces, jobs)
    return Held(refitted, started)
