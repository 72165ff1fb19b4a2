"""Do recordings differ by the load that they carry? That comes before what the model lacks."""

from __future__ import annotations

import math
from collections.abc import Iterable, Sequence
from dataclasses import replace

import numpy as np

from ers_mj.decisions import explained
from ers_mj.effects import BY_NAME
from ers_mj.estimation.fit import fit
from ers_mj.estimation.objective import Fit
from ers_mj.selection.bench import Bench
from ers_mj.servo.model import LOADS, Model

STEPS = 12  # of a recording's own fit
RIVALS: tuple[tuple[str, ...], ...] = (("gain",), ("friction_level",), ("gain", "friction_level"))


def under_loads(bench: Bench, base: Fit) -> Fit | None:
    """The model with a load of its own in each recording, where recordings that are fitted one by one are explained far
    better, and a load says that better than a drive or a friction that changes; None where not.
    """
    if len(bench.traces) < 2 or explained.is_near_noise(base.misfit, bench.policy) or _shows_current(bench):
        return None
    alone = _one_by_one(bench, base)
    if not _pays(bench, base, np.concatenate([found.misfit for found in alone])):
        return None
    fits = bench.each(lambda model: bench.fit(model, 20), _loaded(base.model, [found.model for found in alone]))
    found = min(fits, key=bench.priced)
    rivals = bench.each(
        lambda model: bench.fit(model, STEPS), (_differing(base.model, names, alone) for names in RIVALS)
    )
    if not _pays(bench, base, found.misfit) or min(map(bench.priced, rivals)) <= bench.priced(found):
        return None
    return found


def _shows_current(bench: Bench) -> bool:
    return any(channel.kind == "current" for trace in bench.traces for channel in trace.channels)


def _pays(bench: Bench, base: Fit, misfit: np.ndarray) -> bool:
    """Whether misfits (B,) leave less than half of the squared error of a base nearly everywhere: what is missing makes
    recordings differ as well, but not so much.
    """
    gain = bench.cost(base) - explained.cost(misfit, bench.tau)
    return gain >= max(bench.policy.least_gain, -math.log(1.0 - bench.policy.half) * misfit.size)


def still_loaded(bench: Bench, current: Fit) -> Fit:
    """The model without its loads, where what was named since makes them needless."""
    states = {name: values for name, values in (current.model.states or {}).items() if name not in LOADS}
    if len(states) == len(current.model.states or {}):
        return current
    less = bench.fit(replace(current.model, states=states or None), STEPS)
    return less if bench.priced(less) < bench.priced(current) + bench.policy.least_gain else current


def _one_by_one(bench: Bench, base: Fit) -> list[Fit]:
    """The model fitted to each recording alone."""
    records = range(len(bench.traces))
    return bench.each(lambda k: fit(base.model.of_records([k]), [bench.traces[k]], tau=bench.tau, steps=STEPS), records)


def _differing(model: Model, names: Sequence[str], alone: Sequence[Fit]) -> Model:
    for name in names:
        model = model.with_state(name, len(alone))
    return model


def _loaded(model: Model, alone: Sequence[Model]) -> Iterable[Model]:
    """The model under loads, begun from what the recordings say alone: gravity as they say, or in proportion."""
    gains = np.array([abs(one.values["b"]) for one in alone])
    loaded = model.with_state("load", len(alone))
    loaded = replace(loaded, states={**(loaded.states or {}), "load": gains[0] / gains})
    yield loaded
    if any(BY_NAME[name].holds_place for name in model.names):
        pulls = np.array([_pull(one) for one in alone])
        weighted = loaded.with_state("weight", len(alone))
        yield replace(weighted, states={**(weighted.states or {}), "weight": pulls / pulls[0]})


def _pull(model: Model) -> float:
    """The size of what holds the output in a spring's place."""
    return float(np.linalg.norm(np.concatenate([p for name, p in model.effects if BY_NAME[name].holds_place])))
