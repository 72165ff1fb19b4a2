"""What a recording holds beside input and output, as a fit sees it: further sensors and the supply."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np

from ers_mj.data.recording import Recording
from ers_mj.data.sensor_faults import converter_step, noise_sigma


@dataclass(frozen=True)
class Beside:
    """When a further column of a recording counts."""

    known: float = 0.8  # share of its samples that must be there
    least_sag: float = 0.005  # of the supply, from which it varies


BESIDE = Beside()


@dataclass(frozen=True)
class Channel:
    """What another sensor saw, (N,) on the output's side of the gear: "current" [A], "speed" or "motor" angle; NaN
    where missing.
    """

    kind: str
    values: np.ndarray
    sigma: float


def supply_of(recording: Recording) -> np.ndarray | None:
    """The measured supply [V] (N,), a missing sample between its neighbours; None where hardly any is known or it does
    not vary.
    """
    if recording.vin is None or (known := np.isfinite(recording.vin)).mean() < BESIDE.known:
        return None
    supply = np.interp(recording.t, recording.t[known], recording.vin[known])
    low, level, high = np.quantile(supply, (0.02, 0.5, 0.98))
    return supply if low > 0.0 and high - low > BESIDE.least_sag * level else None


def channels_of(recording: Recording, valid: np.ndarray) -> tuple[Channel, ...]:
    """The current, the speed and the motor's angle where a recording holds them and they vary.

    The motor's angle is brought to the output's side of the gear by a straight line through both, so that ratio and
    zero are not judged.
    """
    found = []
    for kind, values in (("current", recording.current), ("speed", recording.omega), ("motor", recording.theta_m)):
        if values is None or recording.output_unit != "rad" and kind != "current":
            continue
        known = np.isfinite(values)
        if known.mean() < BESIDE.known or np.ptp(values[known]) == 0:
            continue
        if kind == "speed" and not _integrates(recording, values):
            continue
        if kind == "motor":
            both = known & valid
            slope, zero = np.polyfit(recording.y[both], values[both], 1)
            values = (values - zero) / slope
        found.append(
            Channel(kind, np.ascontiguousarray(values), noise_sigma(values[known], converter_step(values[known])))
        )
    return tuple(found)


def _integrates(recording: Recording, omega: np.ndarray) -> bool:
    """Whether a speed is that of the output at the same time: its integral over 0.1 s is the way made, within three
    times the noise.

    What a drive reports as speed is often an older, filtered difference of the angle, which tells nothing new and that
    late.
    """
    t, n = recording.t, max(1, round(0.1 / recording.sample_time))
    way = np.concatenate([[0.0], np.cumsum(0.5 * (omega[1:] + omega[:-1]) * np.diff(t))])
    miss = (way[n:] - way[:-n] - recording.y[n:] + recording.y[:-n])[::n]
    miss, known = miss[np.isfinite(miss)], np.isfinite(omega)
    noise = math.hypot(
        noise_sigma(recording.y[recording.valid], recording.quantum) * math.sqrt(2.0),
        noise_sigma(omega[known], converter_step(omega[known])) * math.sqrt(n) * recording.sample_time,
    )
    return bool(miss.size) and float(np.sqrt(np.mean(miss**2))) < 3.0 * noise
