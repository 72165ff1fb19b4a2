"""What recordings set before anything is fitted: typical sizes, and which of the baseline's numbers they can tell."""

from __future__ import annotations

from collections.abc import Mapping, Sequence

import numpy as np

from ers_mj.data.prepared import Trace
from ers_mj.effects.quantities import Scales


def scales_of(traces: Sequence[Trace], values: Mapping[str, float], is_angle: bool, tau_e: float | None) -> Scales:
    """Typical sizes in these recordings."""
    y = np.concatenate([t.y[t.valid] for t in traces])
    low, high = float(y.min()), float(y.max())
    lags = [max(1, round(0.02 / (t.refresh * t.sample_time))) for t in traces]
    speeds = np.concatenate(
        [
            np.abs(t.y[t.known][k:] - t.y[t.known][:-k]) / (k * t.refresh * t.sample_time)
            for t, k in zip(traces, lags, strict=True)
        ]
    )
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


def free_in(values: Mapping[str, float], traces: Sequence[Trace]) -> tuple[str, ...]:
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


def ampere_in(b: float, traces: Sequence[Trace]) -> float:
    """A first n K_t / J: b times the resistance that voltage over current makes."""
    pairs = [(t.u, c.values) for t in traces for c in t.channels if c.kind == "current"]
    if not pairs:
        return b
    u, i = (np.nan_to_num(np.concatenate(column)) for column in zip(*pairs))
    return b * max(float(u @ i), 0.05 * float(np.linalg.norm(u) * np.linalg.norm(i))) / float(i @ i)
