"""Does data that no fit has seen confirm what was found? Every term that must be worth something against the best refit
without it, begun from the answer's own numbers with the same budget.
"""

from __future__ import annotations

import math
from collections.abc import Iterable, Sequence
from dataclasses import dataclass, replace

import numpy as np

from ers_mj.decisions.confirmation import HeldOut, Won, is_confirmed, paired_p, pays
from ers_mj.decisions.explained import cost, score
from ers_mj.decisions.thresholds import Policy
from ers_mj.position_loop.compared import Left, Selection
from ers_mj.position_loop.fit import Data, Fit, fitted, gain
from ers_mj.position_loop.model import LoopModel, only_letters
from ers_mj.position_loop.runs import Run
from ers_mj.position_loop.selection import Selector
from ers_mj.position_loop.terms import INTEGRAL, SPRING, STARTING, parts, without


@dataclass(frozen=True)
class Split:
    """What of the recordings is held out, and how far a refit to the rest goes."""

    first: float = 0.7  # share of the only recording that is fitted, the rest being held out
    last: float = 0.3  # share of a held-out run, its beginning, that is recalibrated on
    coarser: int = 3  # blocks of a run that are judged as one
    parts: int = 3  # of every one of a few recordings, left out in turn
    most_folds: int = 6  # of more recordings several are left out at once
    steps: int = 12  # of a refit to the rest
    others: int = 3  # terms that are tried in the place of what was refused


SPLIT = Split()


@dataclass(frozen=True)
class Fold:
    """Runs that are fitted (None: all, the rest being held out of everything) and those held out."""

    training: tuple[Run, ...] | None
    held: tuple[Run, ...]

    def fits(self, run: Run) -> bool:
        """Whether other parts of a run that is held out are fitted."""
        return any(run.name == other.name for other in self.training or ())


@dataclass(frozen=True)
class Score:
    """Errors of free runs on held-out samples: rmse and mae [output unit], mean squared error of each block (B,) in
    noise variances, and the root mean squared one of each run (R,) [output unit].
    """

    rmse: float
    mae: float
    misfit: np.ndarray
    each: np.ndarray


@dataclass(frozen=True)
class Confirmed:
    """What held-out runs say: scores before (without any named effect) and after, and without each term that is judged;
    the models of each fold, before and after, and a sentence of where the held-out data comes from.
    """

    folds: tuple[Fold, ...]
    before: Score
    after: Score
    without: dict[str, Score]
    p_values: dict[str, float]
    before_models: tuple[LoopModel, ...]
    models: tuple[LoopModel, ...]
    base: Fit
    sentence: str


def folds_of(runs: Sequence[Run], held: Sequence[Run]) -> tuple[list[Fold], str]:
    """Recordings of their own; else each third of every recording left out in turn, since only one of them may reach
    the limits of the servo (of many every so manieth recording); else the end of the only one.
    """
    if held:
        return [Fold(None, tuple(held))], "recordings that were opened after the selection had ended"
    if len(runs) > SPLIT.most_folds:
        groups = [tuple(runs[k :: SPLIT.most_folds]) for k in range(SPLIT.most_folds)]
        folds = [Fold(tuple(r for r in runs if r not in out), out) for out in groups]
        return folds, f"every {SPLIT.most_folds}th recording left out in turn; the structure was chosen on all"
    if len(runs) > 1:
        spans = [(k / SPLIT.parts, (k + 1) / SPLIT.parts) for k in range(SPLIT.parts)]
        folds = [Fold(_some(r.outside(*span) for r in runs), _some(r.only(*span) for r in runs)) for span in spans]
        folds = [fold for fold in folds if fold.training and fold.held]
        return folds, "each third of every recording left out in turn; the structure was chosen on all"
    only = runs[0]
    return [Fold((only.only(0.0, SPLIT.first),), (only.only(SPLIT.first, 1.0),))], "the last 30 % of the only recording"


def _some(runs: Iterable[Run]) -> tuple[Run, ...]:
    """The runs of which anything is scored."""
    return tuple(run for run in runs if run.scored.any())


def scored(models: Sequence[LoopModel], folds: Sequence[Fold]) -> Score:
    """The held-out score of a model of each fold."""
    errors, misfit, each = [], [], []
    for model, fold in zip(models, folds, strict=True):
        for run in fold.held:
            e = (run.y - model.predicted(run))[run.scored]
            block = run.block[run.scored] // SPLIT.coarser
            counts = np.bincount(block - block[0])
            sums = np.bincount(block - block[0], (e / run.sigma) ** 2)
            errors.append(e)
            each.append(math.sqrt(float(np.mean(e**2))))
            misfit.append(sums[counts > 0] / counts[counts > 0])
    e = np.concatenate(errors)
    return Score(math.sqrt(float(np.mean(e**2))), float(np.mean(np.abs(e))), np.concatenate(misfit), np.array(each))


def bare_fit(selector: Selector, selection: Selection) -> Fit:
    """The best refit without any named effect, from the answer and from what leaving out the strongest left."""
    bare = selection.chosen.model
    for left in selection.named:
        bare = without(bare, left.name)
    starts = [bare]
    for left in selection.left:
        model = left.fit.model
        for other in selection.named:
            model = without(model, other.name)
        starts.append(replace(model, free=bare.free) if set(model.free) == set(bare.free) else bare)
    tried = [fitted(model, selector.data, SPLIT.steps) for model in starts]
    return fitted(min(tried, key=lambda fit: fit.cost).model, selector.data)


def judged(selection: Selection) -> list[Left]:
    """The terms that held-out data must confirm: the names, and those laws without one that a name could stand for."""
    names = {x.name for x in selection.named} | {INTEGRAL, STARTING, SPRING}
    return [x for x in selection.left if x.name in names]


def confirmed(
    selector: Selector, selection: Selection, held: Sequence[Run], policy: Policy
) -> tuple[Selection, Confirmed]:
    """The selection without what held-out data does not confirm, and what it says of the rest.

    Where something was refused, what takes its place is looked for among everything else.
    """
    folds, sentence = folds_of(selector.runs, held)
    refused: set[frozenset[str]] = set()
    tried = 0
    while True:
        found = _judged(selector, selection, folds, sentence, policy)
        doubtful = _doubtful(found, selection, selector.runs, policy)
        if doubtful:
            refused.add(frozenset(parts(selection.chosen.model)))
            weakest = min(doubtful, key=lambda x: x.gain)
            lesser = fitted(weakest.fit.model, selector.data)
            selection = selector.pruned(replace(selection, chosen=lesser, left=()))
            continue
        more = selector.another(selection, refused) if refused and tried < SPLIT.others else None
        if more is None:
            return selection, found
        selection, tried = more, tried + 1


def _doubtful(found: Confirmed, selection: Selection, runs: Sequence[Run], policy: Policy) -> list[Left]:
    """What held-out data does not confirm."""
    return [x for x in judged(selection) if not _holds(found, x.name, runs, policy)]


def _judged(
    selector: Selector, selection: Selection, folds: Sequence[Fold], sentence: str, policy: Policy
) -> Confirmed:
    base = bare_fit(selector, selection) if selection.named else selection.chosen
    (*others, lone) = selection.named or (None,)
    alone = next((x for x in judged(selection) if lone is not None and not others and x.name == lone.name), None)
    if alone is not None:  # without the only name is without any
        base = min(base, alone.fit, key=lambda fit: fit.cost)
    models = _refitted(selection.chosen.model, folds)
    bare = _refitted(base.model, folds) if selection.named else models
    after = scored(models, folds)
    lesser = {x.name: scored(bare if x is alone else _refitted(x.fit.model, folds), folds) for x in judged(selection)}
    p = {name: _p_value(after, less, policy) for name, less in lesser.items()}
    return Confirmed(tuple(folds), scored(bare, folds), after, lesser, p, tuple(bare), tuple(models), base, sentence)


def _refitted(model: LoopModel, folds: Sequence[Fold]) -> list[LoopModel]:
    return [model if f.training is None else fitted(model, Data.of(f.training), SPLIT.steps).model for f in folds]


def _p_value(after: Score, less: Score, policy: Policy) -> float:
    return paired_p(Won.of(score(less.misfit, 1.0) - score(after.misfit, 1.0)), policy=policy)


def _holds(found: Confirmed, name: str, runs: Sequence[Run], policy: Policy) -> bool:
    after, less = found.after, found.without[name]
    noise = math.sqrt(float(np.mean([run.sigma**2 for run in runs])))
    ratio = after.rmse / max(less.rmse, 1e-300)
    costs = cost(after.misfit, 1.0), cost(less.misfit, 1.0)
    log_ratio = float(np.mean(np.log(np.maximum(after.each, 1e-300) / np.maximum(less.each, 1e-300))))
    held = HeldOut(found.p_values[name], (after.rmse, less.rmse), noise, costs, ratio, log_ratio)
    return is_confirmed(held, lambda: None, policy) and pays(held, lambda: None, policy)


# -- what a day changes ---------------------------------------------------------------------------------------------


def recalibrated(models: Sequence[LoopModel], folds: Sequence[Fold], policy: Policy) -> float:
    """Pooled error [output unit] of the rest of each held-out run, once gain, offset and friction level are fitted to
    its first 30 %, where that buys as much as a term must; of all that is held out of a run that was fitted to, whose
    day is the same.
    """
    squares, count = 0.0, 0
    for model, fold in zip(models, folds, strict=True):
        for run in fold.held:
            if fold.fits(run):
                e = (run.y - model.predicted(run))[run.scored]
                squares, count = squares + float(e @ e), count + e.size
                continue
            seen = run.t[run.scored]
            share = (seen[0] + SPLIT.last * (seen[-1] - seen[0])) / run.t[-1]
            state = only_letters(model.having(hold=model["hold"]), ("K", "hold", "c_2"))
            head, rest = Data.of([run.only(0.0, share)]), run.only(share, 1.0)
            again = fitted(state, head, 8)
            as_it_is = fitted(only_letters(model, ()), head, 0)
            day = again.model if gain(as_it_is, again) > policy.loop_gain else model
            e = (rest.y - day.predicted(rest))[rest.scored]
            squares, count = squares + float(e @ e), count + e.size
    return math.sqrt(squares / max(count, 1))
