"""A drawn servo of any family on the bench: its recordings with what is concealed, and what a refitted model without it
leaves of them.

The model is the family's own with what it always has: of a plant that does not hold its place in windows, each begun on
the truth; of a servo that is told a position with its loop.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace

import numpy as np
from numba import njit

from ers_mj.proving.catalogue import put_effects
from ers_mj.proving.concealed.loop import speed_limit
from ers_mj.proving.families.base import Record, Servo
from ers_mj.proving.plant import APP, BUS, CUR, LAG, STATES, TH, THM, WM, W, plant_of
from ers_mj.proving.quick import advance, simulate
from ers_mj.proving.sampling import Run, Setup
from ers_mj.proving.sizing import STIFF, levenberg


@dataclass(frozen=True)
class Steps:
    """Of the integration [own s]."""

    finest: float = 2e-5  # of recordings with what is stiff, or a winding
    fine: float = 4e-5  # of all others
    stiff: float = 4e-5  # while sizing what is stiff
    rough: float = 3e-4  # while sizing, at most
    winding: float = 0.2  # of its time constant, while sizing
    least: float = 5e-5  # while sizing


STEPS = Steps()


@njit(cache=True)
def from_states(plant, u, states, length, dt, substeps):
    """(samples,) angle under u (samples,), begun on `states` (samples, 3) of angle, speed and current every `length`
    samples.
    """
    p, h, samples = plant[0], dt / substeps, u.size
    out, y, work = np.zeros(samples), np.zeros(STATES), np.zeros((4, STATES))
    for k in range(samples):
        if k % length == 0:
            y[:] = 0.0
            y[TH] = y[THM] = y[LAG] = y[APP] = states[k, 0]
            y[W] = y[WM] = states[k, 1]
            y[CUR], y[BUS] = states[k, 2], p.sag_V
        out[k] = y[TH]
        for part in range(substeps):
            advance(p, y, k * dt + part * h, u[k], 1.0, h, work)
    return out


@njit(cache=True)
def slewed(reference, most):
    """(samples,) reference that moves at most so far a sample."""
    out = reference.copy()
    for k in range(1, out.size):
        out[k] = out[k - 1] + min(max(reference[k] - out[k - 1], -most), most)
    return out


def delayed(reference: np.ndarray, samples: float) -> np.ndarray:
    """(N,) reference so many samples late; what lies between two of them is their mean by share."""
    whole = int(np.floor(samples))
    late = lambda n: np.concatenate([np.full(n, reference[0]), reference[: reference.size - n]])
    return (1.0 - samples + whole) * late(whole) + (samples - whole) * late(whole + 1)


def is_stiff(effects: Sequence[dict]) -> bool:
    """Whether one of these needs a finer step."""
    return any(effect["label"] in STIFF for effect in effects)


def recorded(servo: Servo, effects: Sequence[dict], step: float | None = None) -> list[Run]:
    """Every recording with these effects beside what the servo always has; the finest step by default.

    Raises:
        ArithmeticError: the motion is not finite even at a sixteenth of the step.
    """
    if step is None:
        step = STEPS.finest if is_stiff(effects) or servo.params["L"] else STEPS.fine
    for finer in (1.0, 0.25, 0.0625):
        runs = [_run(servo, record, k, effects, finer * step) for k, record in enumerate(servo.records)]
        if all(np.isfinite(run.true).all() for run in runs):
            return runs
    raise ArithmeticError(f"{servo.family}: no finite motion at steps of {finer * step:g} s")


@dataclass
class Bench:
    """A servo with the runs that its effect-free self makes."""

    servo: Servo

    def __post_init__(self) -> None:
        self.sigma = self.servo.sensor["noise_sigma_eff_rad"]
        self.ordinary_inductance = self.servo.params["L"]
        winding = self.servo.params["L"] / self.servo.params["R"]
        self.rough = STEPS.rough
        if winding:
            self.rough = float(np.clip(STEPS.winding * winding, STEPS.least, STEPS.rough))
        self.runs = recorded(self.servo, [], self.rough)
        self.basis = self._basis()

    def step_for(self, effects: Sequence[dict]) -> float:
        """[own s] step that does for sizing these effects."""
        return STEPS.stiff if is_stiff(effects) else self.rough

    def misses(self, servo: Servo, runs: Sequence[Run]) -> list[np.ndarray]:
        """(samples,) of each recording: the angle less what this servo's model makes of it [sigma]."""
        if servo.closed:
            models = [run.clean for run in recorded(servo, [], self.rough)]
        else:
            models = [self._model(servo, record, run) for record, run in zip(servo.records, runs)]
        return [
            (run.clean - model)[record.lead :: servo.stride] / self.sigma
            for record, run, model in zip(servo.records, runs, models)
        ]

    def _model(self, servo: Servo, record: Record, run: Run) -> np.ndarray:
        plant, dt = plant_of(record.params), record.t[1] - record.t[0]
        put_effects(plant, record.inherent, 0)
        length = record.t.size if servo.window_s is None else max(int(round(servo.window_s / dt)), 2)
        states = np.column_stack([run.true, run.omega, run.i_A])
        return from_states(plant, run.u, states, length, dt, max(1, int(np.ceil(dt / self.rough - 1e-9))))

    def refit(self, runs: Sequence[Run], rounds: int) -> list[float]:
        """[sigma] rms a recording that the refitted model leaves."""
        parts = levenberg(lambda x: self.misses(moved(self.servo, x), runs), len(self.servo.free), rounds)
        return [float(np.sqrt(np.mean(part**2))) for part in parts]

    def pooled(self, per_record: Sequence[float]) -> float:
        """One size of the records' sizes, each record weighing as its length."""
        weights = [record.t.size - record.lead for record in self.servo.records]
        return float(np.sqrt(np.average(np.square(per_record), weights=weights)))

    def _basis(self) -> np.ndarray:
        """Orthonormal directions (samples, n) in which small changes of the free parameters move the angle."""
        columns = [
            np.concatenate(self.misses(moved(self.servo, 1e-3 * e), self.runs))
            - np.concatenate(self.misses(moved(self.servo, -1e-3 * e), self.runs))
            for e in np.eye(len(self.servo.free))
        ]
        return np.linalg.qr(np.stack(columns, 1))[0]

    def projected(self, effects: list[dict]) -> float:
        """[sigma] rms of what the effects move, less what small changes of the parameters can imitate."""
        change = np.concatenate(self.misses(self.servo, recorded(self.servo, effects, self.step_for(effects))))
        return float(np.sqrt(np.mean((change - self.basis @ (self.basis.T @ change)) ** 2)))

    def refitted(self, effects: list[dict]) -> float:
        """[sigma] rms that the refitted model leaves."""
        return self.pooled(self.refit(recorded(self.servo, effects, self.step_for(effects)), 4))


def _run(servo: Servo, record: Record, number: int, effects: Sequence[dict], step: float) -> Run:
    present = [*record.inherent, *effects]
    period, ref = record.t[1] - record.t[0], record.ref
    if servo.latency:
        ref = delayed(ref, servo.latency / period)
    for effect in present:
        if effect["label"] == "rate_limit":
            ref = slewed(ref, speed_limit(effect) * period)
    setup = Setup(number, record.noise, servo.sensor["adc_step_rad"], record.controller, ref, servo.decimals)
    return simulate(record.params, present, record.t, None, setup=setup, step=step)


# -- small changes ---------------------------------------------------------------------------------------------------


def moved(servo: Servo, x: np.ndarray) -> Servo:
    """The servo with its free parameters moved by x: logarithms, but rad of theta_0 and tilt, hundredths of a second of
    latency, and a derivative gain by shares of the proportional one.
    """
    steps = dict(zip(servo.free, x))
    latency = max(servo.latency + 0.01 * steps.pop("latency", 0.0), 0.0)
    return replace(servo, latency=latency, records=[_moved(record, steps) for record in servo.records])


def _moved(record: Record, steps: dict[str, float]) -> Record:
    params, gains, inherent = dict(record.params), dict(record.controller), [dict(e) for e in record.inherent]
    for name, v in steps.items():
        change = _CHANGES.get(name)
        if change is not None:
            change(gains, inherent, v)
        elif name == "theta_0":
            params[name] += v
        else:
            params[name] *= np.exp(v)
    return replace(record, params=params, controller=gains, inherent=inherent)


def _scale(name: str) -> Callable:
    def change(gains, inherent, v):
        gains[name] *= np.exp(v)

    return change


def _derivative(gains, inherent, v):
    gains["KD"] += 0.05 * v * gains["KP"]


def _pull(gains, inherent, v):
    for effect in inherent:
        if effect["label"] == "gravity_imbalance":
            effect["strength"] *= np.exp(v)


def _tilt(gains, inherent, v):
    for effect in inherent:
        if effect["label"] == "gravity_imbalance":
            effect["shape"] = effect["shape"] | {"phase": effect["shape"]["phase"] + v}


_CHANGES = {"KP": _scale("KP"), "UMAX": _scale("UMAX"), "KD": _derivative, "pull": _pull, "tilt": _tilt}
