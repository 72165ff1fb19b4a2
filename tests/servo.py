"""A small servo in which tests conceal laws, and recordings of it."""

import numpy as np

from ers_mj.data.prepared import Trace, trace_of
from ers_mj.data.recording import from_arrays
from ers_mj.effects import BY_NAME
from ers_mj.estimation.baseline import Start, baseline
from ers_mj.plants.inputs import INPUTS
from ers_mj.plants.reduced import ReducedModel, lumped
from ers_mj.selection.bench import Bench
from ers_mj.servo.datasheet import Datasheet

T = np.arange(0.0, 3.0, 1e-3)
TRUTH = {"a_1": 25.0, "a_2": 50.0, "b": 70.0, "c_1": 135.0, "c_2": 115.0, "theta_0": 0.2625}
NOISE = 1.5e-4
NAMES = "multisine", "steps", "chirp"


def trace(name, laws=(), sensor=lambda y: y, gain=1.0, seed=0, values=TRUTH) -> Trace:
    """Three seconds of the servo under these laws, at 1 kHz, with ``gain`` times this input, seen by this sensor."""
    u = gain * INPUTS[name](T)
    y = ReducedModel(lumped(values), laws).simulate(T, u).measured + NOISE * np.random.default_rng(
        seed
    ).standard_normal(T.size)
    return trace_of(from_arrays(T, u, sensor(y), name=name), None)


def recorded(laws=(), values=TRUTH, names=NAMES) -> list[Trace]:
    """The servo under these laws with each of these inputs."""
    return [trace(name, laws, seed=k, values=values) for k, name in enumerate(names)]


def started(traces, values=TRUTH) -> Start:
    """The baseline, refitted to all of the traces, with what the servo is on its datasheet."""
    return baseline(traces, Datasheet(lumped=values), True, 1)


def bench_of(traces, only=tuple(BY_NAME), tau=1.0, **settings) -> Bench:
    """What a selection works on and by, which looks for ``only`` these effects."""
    return Bench(traces, tau, exclude=[name for name in BY_NAME if name not in only], **settings)
