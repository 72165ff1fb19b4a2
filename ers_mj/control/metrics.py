"""What a run of a loop was worth: settling, overshoot, error, voltage, energy, chatter. All of the rudder's true
angle.
"""

from __future__ import annotations

from dataclasses import asdict, dataclass

import numpy as np

from ers_mj.control.closed_loop import Run


@dataclass(frozen=True)
class Measures:
    """The measures of one run; None where there is none to give.

    Attributes:
        settling_time_s: until the error stays within 2 %: the longest after any jump up to the next one, in a reference
            without jumps from its begin.
        overshoot_pct: beyond the target of a jump, of its height; in a reference without jumps beyond its range, of its
            amplitude.
        steady_state_error_rad: mean absolute error over the last 20 % of the time.
        rmse_rad: root mean square error over all of it.
        max_error_rad: the largest, over all of it.
        peak_u_V, rms_u_V: of the voltage.
        saturated_share: of the samples at the voltage's limit.
        chatter_V: mean absolute change of the voltage from sample to sample.
        energy_J: electrical energy, the integral of u i.
        stable: whether the loop was not given up.
    """

    settling_time_s: float | None
    overshoot_pct: float | None
    steady_state_error_rad: float | None
    rmse_rad: float | None
    max_error_rad: float | None
    peak_u_V: float | None
    rms_u_V: float | None
    saturated_share: float | None
    chatter_V: float | None
    energy_J: float | None
    stable: bool = True

    def as_document(self) -> dict:
        """As an entry of `trials`."""
        return asdict(self)


def measured(run: Run, u_max: float, ampere: float | None) -> Measures:
    """The measures of a run under a limit of ``u_max`` [V], or of its drive [rad/s^2] where no voltage is told;
    ``ampere`` is the drive acceleration of 1 A [rad/s^2], None where nothing tells it.
    """
    if run.lost:
        return Measures(*(None,) * 10, stable=False)
    r, u, told = run.reference, run.u, run.has_volts
    error = run.theta - r.theta
    tail = slice(int((1.0 - 0.2) * r.t.size), None)
    return Measures(
        settling_time_s=settling_time(run),
        overshoot_pct=overshoot(run),
        steady_state_error_rad=float(np.abs(error[tail]).mean()),
        rmse_rad=float(np.sqrt(np.mean(error**2))),
        max_error_rad=float(np.abs(error).max()),
        peak_u_V=float(np.abs(u).max()) if told else None,
        rms_u_V=float(np.sqrt(np.mean(u**2))) if told else None,
        saturated_share=float(np.mean(np.abs(u if told else run.drive) >= u_max * (1 - 1e-9))),
        chatter_V=float(np.abs(np.diff(u)).mean()) if told else None,
        energy_J=energy(run, ampere),
    )


def _spans(run: Run) -> list[tuple[int, int, float]]:
    """(first sample, last + 1, height [rad], signed) after each jump; one span of the amplitude where there is none."""
    r = run.reference
    if not r.jumps:
        return [(0, r.t.size, float(np.abs(r.theta - r.theta[0]).max()))]
    ends = [*r.jumps[1:], r.t.size]
    before = [run.theta[0] if k == 0 else r.theta[k - 1] for k in r.jumps]
    return [(k, end, float(r.theta[k] - x)) for k, end, x in zip(r.jumps, ends, before, strict=True) if r.theta[k] != x]


def settling_time(run: Run) -> float | None:
    """[s]; None where the error is still too large at the end of a span, or the reference never moves."""
    r, longest, settled = run.reference, None, 0.02  # share of the span's height
    for begin, end, height in _spans(run):
        outside = np.flatnonzero(np.abs(run.theta[begin:end] - r.theta[begin:end]) > settled * abs(height))
        if height == 0 or (outside.size and outside[-1] == end - begin - 1):
            return None
        longest = max(longest or 0.0, float((outside[-1] + 1 if outside.size else 0) / r.rate_hz))
    return longest


def overshoot(run: Run) -> float | None:
    """[%]; None where the reference never moves."""
    r, most = run.reference, None
    for begin, end, height in _spans(run):
        if height == 0:
            return None
        theta, target = run.theta[begin:end], r.theta[begin:end]
        if r.jumps:
            beyond = float((np.sign(height) * (theta - target)).max())
        else:
            beyond = max(float(theta.max() - target.max()), float(target.min() - theta.min()))
        most = max(most or 0.0, 100.0 * beyond / abs(height))
    return most


def energy(run: Run, ampere: float | None) -> float | None:
    """Integral of u i [J], the current taken as straight over a sample; None where no inertia and torque constant give
    the current.
    """
    if not ampere:
        return None
    i = 0.5 * (run.drive + run.drive_after) / ampere
    return float(np.sum((run.u * i)[:-1] * np.diff(run.reference.t)))
