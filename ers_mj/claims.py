"""What the paper claims of its law, beside what these trials measured.

    trials -> one sentence; and, where a claim's case was run, the claim, what was measured, and whether it holds
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass

from ers_mj.trial import Trial

LAW, FAIR, RIVALS = "ftrc", "pid-ff", ("pid", "hinf")
SOON, LITTLE, BETTER = 0.1, 3.0, 0.7  # [s], [%], share: the paper's bars of settling, overshoot and accuracy


@dataclass(frozen=True)
class Claim:
    """A claim, the case and plant it was tried on, what was measured, and whether it holds; None where it is no yes or no."""

    claim: str
    where: str
    measured: str
    holds: bool | None


def headline(trials: Sequence[Trial]) -> str:
    """The trials in one sentence: who is closest, case by case."""
    parts = []
    for case, plant in dict.fromkeys((t.case, t.plant) for t in trials):
        found = [t for t in trials if (t.case, t.plant) == (case, plant)]
        ran = [t for t in found if t.measures.stable]
        if not ran:
            parts.append(f"on the {case} ({plant}) every loop was given up")
            continue
        best = min(ran, key=lambda t: t.measures.rmse_rad)
        parts.append(f"on the {case} ({plant}) {best.controller}, {degrees(best.measures.rmse_rad)}")
    return f"Least RMS error {'; '.join(parts)}." if parts else "Nothing was run."


def degrees(x: float) -> str:
    """An angle [rad] in degrees, three digits."""
    return f"{float(f'{math.degrees(x):.3g}'):g}°"


def claims(trials: Sequence[Trial]) -> list[Claim]:
    """The claims that these trials can speak to."""
    found = []
    for case, plant in dict.fromkeys((t.case, t.plant) for t in trials):
        ran = {t.controller: t.measures for t in trials if (t.case, t.plant) == (case, plant)}
        where = f"{case}, {plant}"
        if LAW not in ran or not ran[LAW].stable:
            continue
        law = ran[LAW]
        if case == "step":
            settles = "it never settles" if law.settling_time_s is None else f"{1e3 * law.settling_time_s:.1f} ms"
            found.append(Claim("settles within 100 ms", where, settles, law.settling_time_s is not None and law.settling_time_s < SOON))
            found.append(Claim("overshoots by less than 3 %", where, f"{law.overshoot_pct:.2f} %", law.overshoot_pct < LITTLE))
        for name in RIVALS:
            if name in ran and ran[name].stable:
                share = 1.0 - law.rmse_rad / ran[name].rmse_rad
                found.append(Claim(f"error at least 70 % below that of {name}", where,
                                   f"{degrees(law.rmse_rad)} against {degrees(ran[name].rmse_rad)}: {100 * abs(share):.0f} % {'less' if share >= 0 else 'more'}",
                                   share >= BETTER))
                if case == "square" and law.energy_J is not None and ran[name].energy_J is not None:
                    found.append(Claim(f"takes less energy than {name}", where, f"{law.energy_J:.1f} J against {ran[name].energy_J:.1f} J",
                                       law.energy_J < ran[name].energy_J))
        if FAIR in ran and ran[FAIR].stable:
            ahead = law.rmse_rad < ran[FAIR].rmse_rad
            found.append(Claim("(not in the paper) the gain comes from the law, not from its feed-forward", where,
                               f"PID with the same feed-forward: {degrees(ran[FAIR].rmse_rad)} against {degrees(law.rmse_rad)}", ahead))
    return found
