"""What is said in the end: the share that is explained, whether more is missing, the verdict."""

from __future__ import annotations

import math
from collections.abc import Collection, Mapping, Sequence
from dataclasses import dataclass
from typing import Protocol

import numpy as np

from ers_mj.decisions.thresholds import POLICY, Policy

Left = Mapping[str, float]  # ln(1 + power) beyond the noise, by sensor (selection/whiteness.py)


@dataclass(frozen=True)
class Shown:
    """A held-out recording, or half of one: its free-run error without and with the named effects, that of its noise
    [output unit], and the mean block misfit, the noise at the least, without and with them.
    """

    before: float
    after: float
    noise: float
    misfit_before: float
    misfit_after: float


class Findings(Protocol):
    """What the verdict reads.

    ``names`` are the effects of the model, ``sensors`` those that show in the data itself, ``suspects`` the laws
    without a name that act here; ``recordings_differ`` says that what is held out has a gain, an offset or a friction
    level of its own, which nothing else tells; ``explained`` is the share of the squared held-out error that goes with
    the names, ``left_before`` and ``left`` what memory tells without and with them, ``left_elsewhere`` the same in the
    recordings but the worst, ``free_held`` the held-out error after and ``least_astray`` the smallest of a recording
    before, in noise levels; ``datasheet_explains`` whether the datasheet as it stands does.
    """

    @property
    def names(self) -> Sequence[str]: ...
    @property
    def sensors(self) -> Collection[str]: ...
    @property
    def suspects(self) -> Sequence[object]: ...
    @property
    def recordings_differ(self) -> bool: ...
    @property
    def explained(self) -> float: ...
    @property
    def left_before(self) -> Left: ...
    @property
    def left(self) -> Left: ...
    @property
    def left_elsewhere(self) -> float: ...
    @property
    def free_held(self) -> float: ...
    @property
    def least_astray(self) -> float: ...
    @property
    def datasheet_explains(self) -> bool: ...


def share(before: float, after: float, noise: float) -> float:
    """Share of a squared error ``before`` that is gone ``after``, above the squared ``noise``."""
    return min(max(1.0 - (after - noise) / (before - noise), 0.0), 1.0) if before > noise else 0.0


def is_more_than_noise(left: Left, without: Left | None, policy: Policy = POLICY) -> bool:
    """Whether what a model leaves is more than noise, or, of one with effects that leaves so much ``without`` them,
    more than another form of the same law would: what stands for an unknown effect takes a part only.

    What stands for it in the output seldom does in the current, which no form of the right law leaves amiss.
    """
    least = {"output": max(policy.mismatch, policy.other_form * without["output"])} if without else {}
    return any(power > least.get(kind, policy.mismatch) for kind, power in left.items())


def explained_each(shown: Sequence[Shown], left_before: Left, left: Left, policy: Policy = POLICY) -> float:
    """The mean share that goes, over the recordings whose error without the effects is above the noise.

    One whose free run is lost with and without them tells nothing, as long as there are others: ``astray``, or, where
    the effects leave nothing beyond the noise, ``fork_lost``, since stick and slip must have forked then. Where there
    are no others the observer's held-out misfit tells their share. Where no error is above the noise, of which the
    estimate may be too large, and memory tells of a mismatch, memory tells the share.
    """
    forked = not is_more_than_noise(left, None, policy)
    above = [s for s in shown if s.before > policy.visible * s.noise]
    if not above and is_more_than_noise(left_before, None, policy):
        kind = max(left_before, key=lambda k: left_before[k])
        return share(math.expm1(left_before[kind]), math.expm1(left[kind]), 0.0)
    most = policy.fork_lost if forked else policy.astray
    told = [s for s in above if min(s.before, s.after) < most * s.noise]
    if told or not forked:
        shares = [share(s.before**2, s.after**2, s.noise**2) for s in told or above]
    else:
        shares = [share(s.misfit_before, s.misfit_after, 1.0) for s in above]
    return float(np.mean(shares)) if shares else 0.0


def told_effects(f: Findings, policy: Policy = POLICY) -> Sequence[str]:
    """The effects that are named: those of the model, if they account for half of what the baseline leaves in free
    run.
    """
    return f.names if f.explained >= policy.half else ()


def is_more_missing(f: Findings, policy: Policy = POLICY) -> bool:
    """Whether the model leaves more than noise, by memory or by an error that is far beyond it."""
    if f.free_held > policy.far_off or is_more_than_noise(f.left, f.left_before if f.names else None, policy):
        return True
    return not f.names and f.left_elsewhere > policy.elsewhere


def is_a_part(f: Findings, policy: Policy = POLICY) -> bool:
    """Whether memory and held-out error agree that the named effects are a part only, as what stands for an unknown
    effect is.
    """
    is_left = f.explained < policy.nearly_all and f.left["output"] > policy.part
    return bool(told_effects(f, policy)) and is_left and f.free_held < policy.fork_lost


def verdict(f: Findings, policy: Policy = POLICY) -> str:
    """One of diagnosis.json's verdicts.

    Where no held-out recording is met by a free run something is missing, though the observer, which is set right on
    the way, sees nothing amiss.
    """
    if told_effects(f, policy) or f.sensors:
        return "missing_physics"
    if f.names or f.suspects or _is_amiss(f, policy):
        return "unexplained"
    return "consistent" if f.datasheet_explains else "parameters_only"


def _is_amiss(f: Findings, policy: Policy) -> bool:
    """Whether something is missing where nothing is named: by memory alone where the recordings differ, since the error
    of one that is held out is that of its state then.
    """
    if f.recordings_differ:
        return is_more_than_noise(f.left, None, policy) or f.left_elsewhere > policy.elsewhere
    return is_more_missing(f, policy) or f.least_astray > policy.astray


def is_more_left(f: Findings, policy: Policy = POLICY) -> bool:
    """Whether a mismatch stays that nothing named accounts for."""
    if verdict(f, policy) == "unexplained" or f.suspects or tuple(told_effects(f, policy)) != tuple(f.names):
        return True
    return is_more_missing(f, policy) or is_a_part(f, policy)
