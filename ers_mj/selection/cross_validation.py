"""The three fit numbers: runs on the training data, on held-out data, and on held-out data after recalibration."""

from __future__ import annotations

import math
from collections.abc import Sequence
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass, replace

import numpy as np

from ers_mj.data.beginnings import start_samples
from ers_mj.data.prepared import Blocks, Trace
from ers_mj.decisions.explained import cost
from ers_mj.effects import BY_NAME
from ers_mj.estimation.fit import Along, fit
from ers_mj.estimation.intervals import half_widths
from ers_mj.estimation.jacobian import columns_of
from ers_mj.estimation.objective import residuals, residuals_in, tau_of
from ers_mj.selection.measure import FREE_RUN, Measure
from ers_mj.servo.model import OBSERVER_RATE, Columns, Model

TURNS = (0.0, 0.5 * math.pi, math.pi, 1.5 * math.pi)  # [rad] from which a phase is fitted in a new recording


@dataclass(frozen=True)
class Refit:
    """What a fold is refitted on, and how far."""

    recalibrated: float = 0.3  # first share of a held-out recording that its record state is fitted on
    steps: int = 12  # at most of a fold's refit,
    end: float = 1e-3  # and gain in C of one at which it ends
    last_part: float = 0.7  # where the only recording is cut into training and held out


REFIT = Refit()


@dataclass(frozen=True)
class Score:
    """Squared error summed over samples, their number, and block misfits (B,) of the observer form, of all channels.

    ``absolute`` is the size of the error summed; ``sure_squares`` are those of the error that no coarse converter has
    made (None: there is none).
    """

    squares: float
    samples: int
    misfit: np.ndarray
    sure_squares: float | None = None
    absolute: float = 0.0

    @property
    def rmse(self) -> float:
        """Root mean square of the error [output unit]."""
        return math.sqrt(self.squares / self.samples) if self.samples else math.nan

    @property
    def mae(self) -> float:
        """Mean size of the error [output unit]."""
        return self.absolute / self.samples if self.samples else math.nan

    @property
    def sure(self) -> float:
        """The same of the error that no coarse converter has made."""
        return (
            self.rmse
            if self.sure_squares is None or not self.samples
            else max(math.sqrt(self.sure_squares / self.samples), 1e-300)
        )


def pooled(scores: Sequence[Score]) -> Score:
    """One score of several recordings."""
    sure = sum(s.squares if s.sure_squares is None else s.sure_squares for s in scores)
    misfit = np.concatenate([s.misfit for s in scores])
    squares, samples, absolute = (sum(getattr(s, of) for s in scores) for of in ("squares", "samples", "absolute"))
    return Score(squares, samples, misfit, sure, absolute)


def scored(model: Model, trace: Trace, record: int = 0, begin: int = 0, measure: Measure = FREE_RUN) -> Score:
    """Score of a recording from sample ``begin`` on."""
    e = np.where(trace.valid, trace.y - measure.run(model, trace, record), 0.0)[begin:]
    e = np.nan_to_num(e, nan=10 * float(np.nanstd(trace.y)))
    local = residuals_in(model, trace, record, OBSERVER_RATE)
    sure = None if trace.converter is None else float(np.sum(trace.converter.beyond(e) ** 2))
    return Score(
        float(e @ e),
        int(trace.valid[begin:].sum()),
        trace.blocks.misfit(np.nan_to_num(local, nan=1e6)),
        sure,
        float(np.sum(np.abs(e))),
    )


def settled(model: Model, trace: Trace, tau: float) -> Model:
    """The model for one recording that it was not fitted to.

    What only that recording can tell of an effect is fitted in it, from the first values of ``local``: the phase of a
    gust on its first 30 %, as a record state is, and the time of an impulse on all of it. An effect whose values there
    are NaN stays away.
    """
    if all(BY_NAME[name].wave for name in model.local or {}):
        trace = trace.part(0, int(REFIT.recalibrated * trace.t.size))
    one = replace(model.of_records([0]), free=(), frozen=model.names)
    layout = one.layout()
    if not layout:
        return replace(one, free=model.free, frozen=model.frozen)
    z = one.vector(layout)
    turns = np.array([f.name == "phase" for f in layout], float)
    starts = [one.at(layout, z + turn * turns) for turn in (TURNS if turns.any() else TURNS[:1])]
    best = min((fit(start, [trace], tau=tau, steps=8) for start in starts), key=lambda f: f.cost)
    return replace(best.model, free=model.free, frozen=model.frozen)


def _strange(model: Model) -> Model:
    """The model as a recording of another day gets it: what happened once does not happen again."""
    once = [name for name in model.local or {} if BY_NAME[name].once]
    for name in once:
        model = model.without_effect(name)
    return model


@dataclass(frozen=True)
class Fold:
    """A held-out recording, and the training ones where the model must be refitted without it (None: it never saw it).

    ``record`` is the held-out one's place among all training recordings where it is one of them, or where, ``halved``,
    its other part is.
    """

    held_out: Trace
    training: tuple[Trace, ...] | None
    record: int = 0
    halved: bool = False

    @property
    def known(self) -> list[int]:
        """The places of the training ones among all recordings."""
        return [k for k in range(len(self.training or ()) + (not self.halved)) if self.halved or k != self.record]


def folds(traces: Sequence[Trace], holdout: Sequence[Trace]) -> tuple[list[Fold], str]:
    """What is held out, and the sentence that says so."""
    if holdout:
        return [Fold(h, None) for h in holdout], "held-out recordings were opened after selection had ended"
    if len(traces) > 1:
        return (
            [Fold(out, tuple(t for t in traces if t is not out), k) for k, out in enumerate(traces)],
            (
                "each recording was held out in turn while the parameters were refitted to the others; the structure"
                " was chosen on all"
            ),
        )
    cut = int(REFIT.last_part * traces[0].t.size)
    return (
        [Fold(traces[0].part(cut, traces[0].t.size), (traces[0].part(0, cut),), halved=True)],
        (
            "the last 30 % of the only recording was held out while the parameters were refitted; the structure was"
            " chosen on all of it"
        ),
    )


def halves(traces: Sequence[Trace], record: int) -> list[Fold]:
    """Either half of one recording held out, the other half and the other recordings left to fit to."""
    cut = traces[record].t.size // 2
    both = traces[record].part(0, cut), traces[record].part(cut, traces[record].t.size)
    return [
        Fold(out, (*traces[:record], left, *traces[record + 1 :]), record, halved=True)
        for out, left in (both, both[::-1])
    ]


def refits(model: Model, parts: Sequence[Fold], tau: float, jobs: int) -> list[Model]:
    """The model of each fold, refitted to its training recordings where it has some.

    A refit goes along one Jacobian by finite differences and its updates, so that with and without an effect the same
    kind of slope leads there; where whole recordings are held out along that of all of them, since no fold's optimum is
    far, unless it leads nowhere. It ends late: along a valley that the training recordings hardly see, what is held out
    would otherwise be judged by where the refit began.
    """
    whole = [fold.held_out for fold in parts if fold.training is not None and not fold.halved]
    slopes = columns_of(model, whole, OBSERVER_RATE, by_tangents=False) if whole else {}

    def along(begun: Model, fold: Fold, known: Columns) -> Model:
        slopes = Along(known=known, renewals=0)
        return fit(begun, fold.training or (), tau=tau, steps=REFIT.steps, along=slopes, tolerance=REFIT.end).model

    def one(fold: Fold) -> Model:
        if fold.training is None:
            return settled(_strange(model), fold.held_out, tau)
        begun = model.of_records(fold.known)
        found = along(begun, fold, _beside(slopes, begun, fold, whole)) if slopes else begun
        if np.array_equal(found.vector(begun.layout()), begun.vector(begun.layout())):
            found = along(begun, fold, columns_of(begun, fold.training, OBSERVER_RATE, by_tangents=False))
        mine = model.of_records([fold.record])
        return settled(replace(found, local=mine.local, states=mine.states), fold.held_out, tau)

    with ThreadPoolExecutor(jobs) as pool:
        return list(pool.map(one, parts))


def _beside(slopes: Columns, begun: Model, fold: Fold, traces: Sequence[Trace]) -> Columns:
    """The columns for a fold's own recordings."""
    rows = np.repeat(np.arange(len(traces)) != fold.record, [trace.rows for trace in traces])
    keys = {f.key: (f.owner, f.name, fold.known[f.key[-1]]) if f.local else f.key for f in begun.layout()}
    return {key: slopes[whole][rows] for key, whole in keys.items()}


@dataclass(frozen=True)
class Recalibrated:
    """A recording whose gain, friction level and (where the plant feels position) offset were fitted on its first 30 %:
    the ``model`` with these as the second recording's of ``heads``, and the score of the rest.
    """

    model: Model
    heads: Sequence[Trace]
    tau: float
    score: Score

    @property
    def states(self) -> dict[str, tuple[float, float, float]]:
        """What was fitted: (value, lower, upper end of 95 %) each."""
        layout = self.model.layout()
        widths = half_widths(self.model, self.heads, (), self.tau)
        ends = {f.name: f.ends(q, w) for f, q, w in zip(layout, self.model.vector(layout), widths)}
        return {name: (float(v[1]), *ends[name]) for name, v in (self.model.states or {}).items()}


def recalibrated(model: Model, trace: Trace, measure: Measure = FREE_RUN) -> Recalibrated:
    """Gain, friction level and (where the plant feels position) offset fitted on the first 30 % of a recording; the
    score is taken on the rest. They stay neutral unless they buy their price there, and leave less by the measure that
    the rest is scored by.
    """
    cut = int(REFIT.recalibrated * trace.t.size)
    head = trace.part(0, cut, trace.start)
    known = {name: rows[[0, 0]] for name, rows in (model.local or {}).items()}
    held = (*model.names, *(f"{name}, local" for name in known))
    pair = (
        replace(model, states=None, local=known or None, free=(), frozen=held)
        .with_state("load" if "load" in (model.states or {}) else "gain", 2)
        .with_state("friction_level", 2)
    )
    if model.values["a_1"] > 0 or model.values["c_1"] > 0:
        pair = pair.with_state("offset", 2)
    brief = head.part(0, start_samples(head.t))
    blank = replace(brief, valid=np.zeros(brief.t.size, bool), counts=np.zeros_like(brief.counts), channels=())
    misfit = Blocks.of([blank, head]).misfit(residuals(pair, [blank, head], OBSERVER_RATE))
    tau = tau_of(misfit[blank.counts.size :])
    found = fit(pair, [blank, head], tau=tau, steps=10)
    pays = cost(misfit, tau) - cost(found.misfit, tau) >= 0.5 * found.size
    before, after = (scored(one, head, 1, 0, measure).squares for one in (pair, found.model))
    if not (pays and after < before):
        found = replace(found, model=pair)
    return Recalibrated(found.model, (blank, head), tau, scored(found.model, trace, 1, cut, measure))
