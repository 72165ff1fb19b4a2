"""The finite-time law's gains: the conditions (33)-(35) under which its proof holds, the bound (37), and a search.

gains -> m_1, m_2, m_3 (all above zero: feasible) -> bound on the settling time
wished settling time -> k_2, k_3 that keep it in simulation -> l, gamma_1..gamma_7 that meet the conditions
"""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass, replace

import numpy as np
from scipy.integrate import quad
from scipy.optimize import minimize

from ers_mj.control.controllers import Gains
from ers_mj.control.controllers.finite_time import sig
from ers_mj.errors import InputError

REMARK = "of no use in practice: the loop settles in milliseconds, the proof's inequalities give away the rest"
Settle = Callable[[Gains], float | None]


@dataclass(frozen=True)
class Reach:
    """Where and how long gains are searched.

    Attributes:
        slowest, fastest: k_2 between which the search looks [1/s].
        ratio: k_3 / k_2, that of Eq. (40).
        coarse, fine: values of k_2 that are tried, and halvings of the last interval.
        starts: of the search for l and gamma.
        margin: share of k_1, k_2 and l k_3 that m_1, m_2 and m_3 are to keep.
    """

    slowest: float = 1.0
    fastest: float = 2000.0
    ratio: float = 400.0 / 38.0
    coarse: int = 23
    fine: int = 8
    starts: int = 12
    margin: float = 0.02


REACH = Reach()


# -- the conditions ------------------------------------------------------------------------------------------------


def products(gains: Gains) -> tuple[float, float, float]:
    """M_1, M_2, M_3 of Eq. (29)."""
    q, k_1, k_2 = float(gains.q), gains.k_1, gains.k_2
    two = 2.0 ** (2.0 - 2.0 * q)
    power = k_1 ** (1.0 / q - 1.0)
    return (
        two * (2.0 * q - 1.0) * (1.0 + power) / q,
        two * ((1.0 - q) / q + k_2 + (2.0 * q - 1.0) * power * k_2 / q),
        two * (1.0 - q) * power * (1.0 + k_2) / q,
    )


def m_1(gains: Gains) -> float:
    """Eq. (33), the gamma_2 term with the factor q that (23) and (30) have and the print lacks."""
    q, k_1, (g1, g2, _, _, g5, _, g7) = float(gains.q), gains.k_1, gains.gamma
    inner = g5 * 2.0 ** (2.0 - 2.0 * q) * q * k_1 ** (1.0 + 1.0 / q) + g7 * products(gains)[2]
    return (
        k_1
        - 2.0 ** (1.0 - q) / (1.0 + q) * (g1 + g2 * q * (2.0 - q) * k_1 ** (1.0 + 1.0 / q))
        - _coupling(gains) / (1.0 + q) * inner
    )


def m_2(gains: Gains) -> float:
    """Eq. (34), as printed."""
    q, k_1, k_2, (g1, g2, g3, g4, _, g6, _) = float(gains.q), gains.k_1, gains.k_2, gains.gamma
    two = 2.0 ** (1.0 - q)
    return (
        k_2
        - two * (2.0 - q) * k_1 ** (1.0 / q)
        - g1 ** (-1.0 / q) * two * q / (1.0 + q)
        - (2.0 - q) / (1.0 + q) * (g2**-q * two * k_1 ** (1.0 + 1.0 / q) + g3 * two**2)
        - _coupling(gains) / (1.0 + q) * (g4 * two**2 * q * k_1 ** (1.0 / q) + g6 * products(gains)[1])
    )


def m_3(gains: Gains) -> float:
    """Eq. (35), as printed."""
    q, k_1, (_, _, g3, g4, g5, g6, g7) = float(gains.q), gains.k_1, gains.gamma
    two, (M_1, M_2, M_3) = 2.0 ** (2.0 - 2.0 * q), products(gains)
    return (
        gains.l * gains.k_3
        - g3 ** (-(2.0 - q) / (2.0 * q - 1.0)) * two * (2.0 * q - 1.0) / (1.0 + q)
        - (g4**-q + g5**-q * k_1) * two * k_1 ** (1.0 / q) * _coupling(gains) / (1.0 + q)
        - _coupling(gains) / q * (M_1 + (g6**-q * M_2 + g7**-q * M_3) / (1.0 + q))
    )


def _coupling(gains: Gains) -> float:
    """l (3 - 2q) k_2^(1/(2q-1)), by which the last step of the backstepping weighs on the first two."""
    q = float(gains.q)
    return gains.l * (3.0 - 2.0 * q) * gains.k_2 ** (1.0 / (2.0 * q - 1.0))


def conditions(gains: Gains) -> tuple[float, float, float]:
    """m_1, m_2, m_3: the proof holds where all are above zero."""
    return m_1(gains), m_2(gains), m_3(gains)


# -- the bound ------------------------------------------------------------------------------------------------------


def lyapunov(gains: Gains, x1: float, x2: float, x3: float) -> float:
    """V_3 of Eq. (24)."""
    q = float(gains.q)
    x2d = -gains.k_1 * sig(x1, q)
    x3d = -gains.k_2 * sig(sig(x2, 1.0 / q) - sig(x2d, 1.0 / q), 2.0 * q - 1.0)
    inner = quad(lambda s: sig(sig(s, 1.0 / q) - sig(x2d, 1.0 / q), 2.0 - q), x2d, x2)[0]
    outer = quad(
        lambda s: sig(sig(s, 1.0 / (2.0 * q - 1.0)) - sig(x3d, 1.0 / (2.0 * q - 1.0)), 3.0 - 2.0 * q), x3d, x3
    )[0]
    return 0.5 * x1**2 + inner + gains.l * outer


def settling_bound(gains: Gains, height: float) -> float | None:
    """The time [s] after which Lemma 3 and Eq. (37) promise rest after a step of ``height`` [rad]; None where the
    conditions fail or q = 1.
    """
    weakest, q = min(conditions(gains)), float(gains.q)
    if weakest <= 0 or q >= 1:
        return None
    alpha, c = 0.5 * (1.0 + q), 2.0 ** (-0.5 * (1.0 + q)) * weakest
    return lyapunov(gains, 0.0, height, 0.0) ** (1.0 - alpha) / (c * (1.0 - alpha))


# -- the search -----------------------------------------------------------------------------------------------------


@dataclass(frozen=True)
class Found:
    """Gains, their conditions, and the settling time [s] that the simulated loop shows with them."""

    gains: Gains
    m: tuple[float, float, float]
    settling: float


def search(settling: float, settle: Settle, gains: Gains = Gains(), seed: int = 0) -> Found:
    """The smallest k_2, with k_3 in Eq. (40)'s ratio to it, that settles within ``settling`` [s] and meets the
    conditions.

    Args:
        settling: wished [s].
        settle: gains -> settling time of the simulated loop [s], None where it does not settle.
        gains: q and k_1 are kept.
        seed: of the starts of l and gamma.

    Raises:
        InputError: no gains within reach settle so soon, or those that do meet no conditions.
    """

    def timed(k_2: float) -> tuple[float, Gains]:
        trial = _rounded(replace(gains, k_2=k_2, k_3=REACH.ratio * k_2))
        time = settle(trial)
        return (math.inf if time is None else time), trial

    low, tried = None, []
    for k_2 in np.geomspace(REACH.slowest, REACH.fastest, REACH.coarse).tolist():
        tried.append(timed(k_2))
        if tried[-1][0] <= settling:
            break
        low = k_2
    else:
        quickest = min(time for time, _ in tried)
        what = f"the quickest take {1e3 * quickest:.3g} ms" if math.isfinite(quickest) else "none settles at all"
        raise InputError(f"no gains up to k_2 = {REACH.fastest:g} settle within {1e3 * settling:.3g} ms, {what}")
    best, high = tried[-1], k_2
    for _ in range(REACH.fine if low is not None else 0):
        middle = math.sqrt(low * high)
        found = timed(middle)
        if found[0] <= settling:
            high, best = middle, found
        else:
            low = middle
    time, chosen = best
    feasible = freed(chosen, seed)
    m = conditions(feasible)
    if min(m) <= 0:
        raise InputError(
            f"k_2 = {chosen.k_2:.4g} and k_3 = {chosen.k_3:.4g} settle in {1e3 * time:.3g} ms, but no l and gamma were"
            f" found that meet (33)-(35): the best leave m = {', '.join(f'{x:.3g}' for x in m)}"
        )
    return Found(feasible, m, time)


def _rounded(gains: Gains) -> Gains:
    """k_2 and k_3 to three digits."""
    return replace(gains, k_2=float(f"{gains.k_2:.3g}"), k_3=float(f"{gains.k_3:.3g}"))


def freed(gains: Gains, seed: int = 0) -> Gains:
    """The same q and k with those l and gamma that leave the smallest of m_1/k_1, m_2/k_2 and m_3/(l k_3) largest."""

    def with_(z: np.ndarray) -> Gains:
        l, *gamma = np.exp(np.clip(z, -40.0, 20.0)).tolist()
        return replace(gains, l=l, gamma=tuple(gamma))

    def worst(z: np.ndarray) -> float:
        g = with_(z)
        m = conditions(g)
        return -min(m[0] / g.k_1, m[1] / g.k_2, m[2] / (g.l * g.k_3))

    random = np.random.default_rng(seed)
    start = np.log([gains.l * (38.0 / gains.k_2), *gains.gamma])
    best, least = gains, worst(np.log([gains.l, *gains.gamma]))
    for k in range(REACH.starts):
        z0 = start + (random.normal(0.0, 1.0, start.size) if k else 0.0)
        found = minimize(
            worst,
            z0,
            method="Nelder-Mead",
            options={"maxiter": 4000, "maxfev": 4000, "xatol": 1e-4, "fatol": 1e-7, "adaptive": True},
        )
        if found.fun < least:
            best, least = with_(found.x), float(found.fun)
        if least < -REACH.margin:
            break
    return best
