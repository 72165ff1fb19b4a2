"""Finds the strength at which a concealed effect leaves a drawn number of sigmas; whatever is found is kept."""

from __future__ import annotations

from collections.abc import Callable, Iterable
from dataclasses import dataclass
from typing import Protocol

import numpy as np

from ers_mj.proving.catalogue import CATALOGUE, IN_LOOP
from ers_mj.proving.concealed.base import Effect
from ers_mj.proving.forms import draw_shape


@dataclass(frozen=True)
class Visibility:
    """How large a concealed effect is to show [sigma]."""

    least: float = 0.5  # after a refit, drawn log-uniform up to the next
    most: float = 50.0
    faintest: float = 0.02  # clutter, drawn up to the next
    faint: float = 0.2
    barely: float = 0.3  # clutter that shows more is left out
    near: float = 0.15  # of the logarithm of the target, at which a search ends
    tries: int = 7  # of a search
    wider: float = 0.03  # of the least strength, where the plant is not the rudder


VISIBILITY = Visibility()

STRUCTURAL = (
    "backlash",
    "shaft_compliance",
    "variable_ratio",
    "sensor_dropout",
    "inductance",
    "end_stop",
    "presliding",
)
"""What is no clutter: it changes the mechanism, shows below the noise, or is, where it is faint, too stiff for the step
(bristles).
"""


class Ruler(Protocol):
    """What measures effects on one servo [sigma]: at once, or by the refit itself."""

    ordinary_inductance: float  # [H]

    def projected(self, effects: list[dict]) -> float: ...

    def refitted(self, effects: list[dict]) -> float: ...


Shape = Callable[[np.random.Generator, Effect, dict], dict]


def conceal(
    rng: np.random.Generator, ruler: Ruler, name: str, context: dict, shape_of: Shape = draw_shape, wider: float = 1.0
) -> dict:
    """An effect of drawn shape, its strength tuned to a drawn visibility after refit; the least strength of the
    catalogue times `wider` bounds it.
    """
    effect = (CATALOGUE | IN_LOOP)[name]
    target = float(np.exp(rng.uniform(np.log(VISIBILITY.least), np.log(VISIBILITY.most))))
    shape = shape_of(rng, effect, context)
    low, high = np.log(_lowest(effect, ruler, wider)), np.log(effect.high)
    as_list = lambda s: [{"label": name, "strength": float(np.exp(s)), "shape": shape}]
    guess, _ = nearest(lambda s: ruler.projected(as_list(s)), target, 0.5 * (low + high), low, high, VISIBILITY.tries)
    found, left = nearest(lambda s: ruler.refitted(as_list(s)), target, guess, low, high, 3)
    return as_list(found)[0] | {
        "strength_name": effect.strength_name,
        "target_sigma": target,
        "quick_visibility_sigma": left,
    }


def _lowest(effect: Effect, ruler: Ruler, wider: float) -> float:
    """The least strength that counts; an inductance must stand out from the ordinary one, and bristles must not be too
    stiff for the step.
    """
    low = effect.low * (1.0 if effect.name == "presliding" else wider)
    return max(low, 2.5 * ruler.ordinary_inductance) if effect.name == "inductance" else low


def nearest(
    size: Callable[[float], float], target: float, guess: float, low: float, high: float, tries: int
) -> tuple[float, float]:
    """(logarithm of the strength, its size) nearest to the target: secants on logarithms within brackets."""
    seen: list[tuple[float, float]] = []
    for _ in range(tries):
        miss = float(np.log(max(size(guess), 1e-9) / target))
        seen.append((guess, miss))
        if abs(miss) < VISIBILITY.near or high - low < 1e-3:
            break
        low, high = (low, guess) if miss > 0 else (guess, high)
        guess = _next(seen, low, high)
    best = min(seen, key=lambda pair: abs(pair[1]))
    return best[0], float(target * np.exp(best[1]))


def _next(seen: list[tuple[float, float]], low: float, high: float) -> float:
    """By the secant through the last two, or a slope of one; the middle where that leaves the bracket."""
    x, miss = seen[-1]
    slope = 1.0
    if len(seen) > 1 and abs(x - seen[-2][0]) > 1e-9:
        slope = float(np.clip((miss - seen[-2][1]) / (x - seen[-2][0]), 0.3, 4.0))
    step = x - float(np.clip(miss / slope, -2.0, 2.0))
    return step if low < step < high else 0.5 * (low + high)


def clutter(
    rng: np.random.Generator, ruler: Ruler, taken: list[str], context: dict, among: Iterable[str] = CATALOGUE
) -> list[dict]:
    """Up to three further effects that stay well below the noise."""
    names = [name for name in among if name in CATALOGUE and name not in (*STRUCTURAL, *taken)]
    out = []
    for name in rng.choice(names, int(rng.integers(4)), replace=False):
        effect = CATALOGUE[str(name)]
        target = float(np.exp(rng.uniform(np.log(VISIBILITY.faintest), np.log(VISIBILITY.faint))))
        shape = draw_shape(rng, effect, context)
        as_list = lambda s: [{"label": effect.name, "strength": float(np.exp(s)), "shape": shape}]  # noqa: B023
        low = np.log(effect.low)
        found, size = nearest(lambda s: ruler.projected(as_list(s)), target, low, low - 6.0, low + 2.0, 4)  # noqa: B023
        if size < VISIBILITY.barely:
            out.append(as_list(found)[0] | {"strength_name": effect.strength_name, "quick_visibility_sigma": size})
    return out
