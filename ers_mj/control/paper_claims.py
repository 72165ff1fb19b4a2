"""What the paper claims of its law, beside what these trials measured.

trials -> one sentence; and, where a claim's case was run, the claim, what was measured, and whether it holds
"""

from __future__ import annotations

import math
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, replace

from ers_mj.control.firmware import NAME as FIRMWARE
from ers_mj.control.metrics import Measures
from ers_mj.control.trial import Conditions, Trial
from ers_mj.servo.datasheet import TABLE_1, Datasheet

LAW, FAIR, RIVALS = "ftrc", "pid-ff", ("pid", "hinf")


@dataclass(frozen=True)
class Bars:
    """The paper's: settling [s] and overshoot [%] below these, error and steady-state error less by these shares."""

    settling: float = 0.1
    overshoot: float = 3.0
    better: float = 0.7
    steadier: float = 0.5


BARS = Bars()


@dataclass(frozen=True)
class Claim:
    """A claim, the case it was tried on, what was measured (plant by plant), and whether it holds on all; None where it
    is no yes or no.
    """

    claim: str
    case: str
    measured: str
    holds: bool | None


def is_papers(datasheet: Datasheet, design: Datasheet, conditions: Conditions) -> bool:
    """Whether these are the paper's settings, which its claims are for: Table 1's servo, known as it is, and the gains,
    references, rate and voltage of its trials; a play, a linkage and an inductance are among its plants.
    """
    as_built = replace(conditions, gap=0.0, linkage="constant", inductance=False)
    known = dict(datasheet.parameters) == dict(design.parameters) == TABLE_1
    return known and not datasheet.effects and as_built == Conditions()


def headline(trials: Sequence[Trial]) -> str:
    """The trials in one sentence: who is closest where, or how far a servo's own loop is from what it is told."""
    if all(t.controller == FIRMWARE for t in trials):
        return f"RMS error of the servo's own loop: {_and([_off(t) for t in trials])}."
    return _closest(trials)


def _closest(trials: Sequence[Trial]) -> str:
    won: dict[tuple[str, str], list[str]] = {}
    for case, plant in dict.fromkeys((t.case, t.plant) for t in trials):
        ran = [t for t in trials if (t.case, t.plant) == (case, plant) and t.measures.stable]
        best = min(ran, key=lambda t: t.measures.rmse_rad).controller if ran else "no law"
        won.setdefault((best, case), []).append(plant)
    parts = []
    for law in dict.fromkeys(best for best, _ in won):
        places = {case: plants for (best, case), plants in won.items() if best == law}
        if len({tuple(plants) for plants in places.values()}) == 1:
            on = f"the {_and(list(places))} ({_and(next(iter(places.values())))})"
        else:
            on = _and([f"the {case} ({_and(plants)})" for case, plants in places.items()])
        parts.append(f"{law} on {on}")
    return f"Least RMS error: {'; '.join(parts)}."


def _off(trial: Trial) -> str:
    stands = degrees(trial.measures.rmse_rad) if trial.measures.stable else "unstable"
    return f"{trial.case} ({trial.plant}) {stands}"


def _and(words: Sequence[str]) -> str:
    return words[0] if len(words) == 1 else f"{', '.join(words[:-1])} and {words[-1]}"


def degrees(x: float) -> str:
    """An angle [rad] in degrees, three digits."""
    return f"{float(f'{math.degrees(x):.3g}'):g}°"


def claims(trials: Sequence[Trial]) -> list[Claim]:
    """The claims that these trials can speak to, each on all plants at once."""
    found: dict[tuple[str, str], list[tuple[str, str, bool | None]]] = {}
    for case, plant in dict.fromkeys((t.case, t.plant) for t in trials):
        ran = {t.controller: t.measures for t in trials if (t.case, t.plant) == (case, plant) and t.measures.stable}
        for claim, text, holds in _of(case, ran) if LAW in ran else ():
            found.setdefault((claim, case), []).append((plant, text, holds))
    return [
        Claim(
            claim,
            case,
            "; ".join(f"{plant}: {text}" for plant, text, _ in told),
            None if told[0][2] is None else all(h for _, _, h in told),
        )
        for (claim, case), told in found.items()
    ]


def _of(case: str, ran: Mapping[str, Measures]) -> Iterator[tuple[str, str, bool | None]]:
    """(claim, what was measured, whether it holds) of one case on one plant, measures by controller."""
    law = ran[LAW]
    if case in ("step", "square"):
        settles = "it never settles" if law.settling_time_s is None else f"{1e3 * law.settling_time_s:.1f} ms"
        yield "settles within 100 ms", settles, law.settling_time_s is not None and law.settling_time_s < BARS.settling
        yield "overshoots by less than 3 %", f"{law.overshoot_pct:.2f} %", law.overshoot_pct < BARS.overshoot
    for name in RIVALS:
        if name in ran:
            yield (
                f"error at least 70 % below that of {name}",
                _against(law, ran[name]),
                law.rmse_rad <= (1.0 - BARS.better) * ran[name].rmse_rad,
            )
            if case in ("square", "ramp"):
                less = law.steady_state_error_rad <= (1.0 - BARS.steadier) * ran[name].steady_state_error_rad
                yield (
                    f"steady-state error at least 50 % below that of {name}",
                    _against(law, ran[name], "steady_state_error_rad"),
                    less,
                )
            if case == "square" and law.energy_J is not None:
                yield (
                    f"takes less energy than {name}",
                    f"{law.energy_J:.1f} J against {ran[name].energy_J:.1f} J",
                    law.energy_J < ran[name].energy_J,
                )
    if FAIR in ran:
        yield "not claimed: error beside PID with the same feed-forward", _against(law, ran[FAIR]), None


def _against(law: Measures, other: Measures, key: str = "rmse_rad") -> str:
    mine, theirs = getattr(law, key), getattr(other, key)
    share = 1.0 - mine / theirs
    return f"{degrees(mine)} against {degrees(theirs)}, {100 * abs(share):.0f} % {'less' if share >= 0 else 'more'}"
