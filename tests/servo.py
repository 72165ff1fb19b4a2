"""A small servo in which tests conceal laws, recordings of it, and the bench on which a selection works on them."""

from collections.abc import Callable
from dataclasses import dataclass, field, replace

import numpy as np

from ers_mj.data.prepared import Trace, trace_of
from ers_mj.data.recording import from_arrays
from ers_mj.effects import BY_NAME
from ers_mj.estimation.baseline import Start, baseline
from ers_mj.estimation.fit import fit
from ers_mj.estimation.objective import Fit
from ers_mj.plants.inputs import INPUTS
from ers_mj.plants.reduced import ReducedModel, lumped
from ers_mj.selection.bench import Bench
from ers_mj.selection.comparison import Candidate, judged
from ers_mj.servo.datasheet import Datasheet
from ers_mj.servo.model import Model

T = np.arange(0.0, 3.0, 1e-3)
SPARSE = T[::2]  # where the point of a test needs no more
TRUTH = {"a_1": 25.0, "a_2": 50.0, "b": 70.0, "c_1": 135.0, "c_2": 115.0, "theta_0": 0.2625}
NOISE = 1.5e-4
NAMES = "multisine", "steps", "chirp"


def trace(name, laws=(), sensor=lambda y: y, gain=1.0, seed=0, values=TRUTH, t=T) -> Trace:
    """Three seconds of the servo under these laws, at 1 kHz, with ``gain`` times this input, seen by this sensor."""
    u = gain * INPUTS[name](t)
    y = ReducedModel(lumped(values), laws).simulate(t, u).measured + NOISE * np.random.default_rng(
        seed
    ).standard_normal(t.size)
    return trace_of(from_arrays(t, u, sensor(y), name=name), None)


def recorded(laws=(), values=TRUTH, names=NAMES, t=T) -> list[Trace]:
    """The servo under these laws with each of these inputs."""
    return [trace(name, laws, seed=k, values=values, t=t) for k, name in enumerate(names)]


def started(traces, values=TRUTH) -> Start:
    """The baseline, refitted to all of the traces, with what the servo is on its datasheet."""
    return baseline(traces, Datasheet(lumped=values), True, 1)


def all_but(*names) -> list[str]:
    """The effects that are not looked for where these are."""
    return [name for name in BY_NAME if name not in names]


def bench_of(start: Start, **settings) -> Bench:
    """A bench for the recordings of a baseline."""
    return Bench(start.traces, settings.pop("tau", 1.0), **settings)


def alone(start: Start, name: str, p, steps: int = 25) -> Candidate:
    """An effect that begins at p, fitted beside the baseline."""
    found = fit(start.fit.model.with_effect(name, np.array(p)), start.traces, steps=steps)
    return judged(name, found, start.fit, 1.0)


def having(found: Fit, name: str, p=None) -> Fit:
    """A fit as if it had an effect as well, of its own first start unless it is told."""
    p = BY_NAME[name].starts(found.model.scales)[0] if p is None else np.array(p)
    return replace(found, model=found.model.with_effect(name, p))


@dataclass(frozen=True)
class Watched(Bench):
    """A bench that notes what it is asked to fit, (model, steps), and has an ``answer`` ready instead."""

    answer: Callable[[Model], Fit] | None = None
    asked: list = field(default_factory=list)

    def fit(self, model, steps, **settings):
        self.asked.append((model, steps))
        return self.answer(model)
