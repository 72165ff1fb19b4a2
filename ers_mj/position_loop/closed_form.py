"""Starts of a whole model from a regression (see weak_form.py) that has a limit or an integral in: what bends the rest
of the model so much that a fit begun from the model without it goes astray.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from itertools import product

import numpy as np

from ers_mj.effects.end_stop import EndStop
from ers_mj.effects.gravity_imbalance import GravityImbalance
from ers_mj.effects.rate_limit import RateLimit
from ers_mj.effects.voltage_saturation import VoltageSaturation
from ers_mj.position_loop.model import LoopModel
from ers_mj.position_loop.runs import Run, scales_of
from ers_mj.position_loop.terms import INTEGRAL, SIZES, Term, stops, top_speed
from ers_mj.position_loop.weak_form import SCAN, Rough, rough_starts

GRAVITY = GravityImbalance.name


@dataclass(frozen=True)
class Begun:
    """Where regressions look."""

    speeds: tuple[float, ...] = (0.9, 1.0, 1.15)  # of the largest seen, to which the reference is limited
    inset: float = 0.06  # of the travel, beyond which a stop may act
    level: float = 1.6  # [rad] of travel within which a weight's cosine is a constant torque


BEGUN = Begun()
RESET = {"D": 0.0, "lag_s": SIZES.lags[0]}  # what no regression has


class ClosedForms:
    """Regressions over some runs; what was asked once is not worked out again."""

    def __init__(self, runs: Sequence[Run], is_angle: bool):
        self.runs, self.is_angle = runs, is_angle
        self._known: dict[tuple, list[Rough]] = {}

    @property
    def loads(self) -> tuple[str, ...]:
        """What a servo may bear: a spring, or a weight, with a constant torque where something parts the two."""
        if not self.is_angle:
            return "hold", "a_1"
        travel = max(float(np.nanmax(run.y)) for run in self.runs) - min(float(np.nanmin(run.y)) for run in self.runs)
        return ("sin", "cos") if travel < BEGUN.level else ("hold", "sin", "cos")

    def rough(self, *asked, **within) -> list[Rough]:
        """As weak_form.rough_starts of the runs."""
        key = (*asked, *within.values())
        if key not in self._known:
            self._known[key] = rough_starts(self.runs, *asked, **within)
        return self._known[key]

    def begun(self, rough: Rough, **more: float) -> LoopModel:
        """A model as a regression has it; a derivative term is free where a limit tells it apart."""
        values = {k: v for k, v in {**rough.values, **more}.items() if k not in ("sin", "cos")}
        drive = values.get("L", values["K"] * 0.5 * float(np.nanmax(np.abs(self.runs[0].r - self.runs[0].y))))
        model = LoopModel(values, tuple(values), scales=scales_of(self.runs, self.is_angle, values["c_2"], drive))
        if "sin" in rough.values:
            model = model.with_effect(GRAVITY, np.array([rough.values["sin"], rough.values["cos"]]))
        return model.having(D=0.0) if "L" in values else model

    def again(self, model: LoopModel) -> list[LoopModel]:
        """A model of one body with what regressions make of its loop and its load, all else as it stands."""
        if model.has_two_bodies:
            return []
        loads = self.loads if GRAVITY in model.names else ("hold", "a_1") if "a_1" in model.free else ("hold",)
        found = []
        for width in SCAN.widths:
            for rough in self.rough(loads, width, model["R"], "I" in model.free):
                start = model.having(**{x: v for x, v in rough.values.items() if x in model.free})
                start = start.having(**{x: v for x, v in RESET.items() if x in model.free})
                if GRAVITY in model.names:
                    start = start.with_effect(GRAVITY, np.array([rough.values["sin"], rough.values["cos"]]))
                found.append(start)
        return found

    def beside(self, term: Term, model: LoopModel) -> Term:
        """The term with starts from a regression that has it in, and with what else the model has."""
        if term.name == EndStop.name:
            return replace(term, starts=(*term.starts, *self._stopped(model)))
        if term.is_far:
            return replace(term, starts=(*term.starts, *self._parted(term, model)))
        if term.name not in (RateLimit.name, INTEGRAL, VoltageSaturation.name):
            return term
        begun = [self._with_the_rest(start, model) for start in self._bent(term.name, model)]
        return replace(term, starts=(*term.starts, *begun), is_bent=True)

    def _bent(self, name: str, model: LoopModel) -> list[LoopModel]:
        """The loop and its load alone, with a limit of the reference's speed, an integral, or a limit of the drive;
        also under a load that the model without it has lost.
        """
        borne = (self.loads,) if GRAVITY in model.names else (("hold",), self.loads)
        speeds = [model["R"]]
        if name == RateLimit.name:
            speeds = [x * top_speed(self.runs) for x in BEGUN.speeds]
        found = []
        for speed in speeds:
            more = {"R": speed} if np.isfinite(speed) else {}
            for loads, width in product(borne, SCAN.widths):
                for rough in self.rough(loads, width, speed, name == INTEGRAL):
                    if name != VoltageSaturation.name or "L" in rough.values:
                        found.append(self.begun(rough, **more))
        return found

    def _parted(self, term: Term, model: LoopModel) -> list[LoopModel]:
        """Two bodies from what a regression of one has: a fit of one bends its numbers to stand for the second, and has
        what is late in the loop where the second one is.
        """
        loads, found = self.loads if GRAVITY in model.names else ("hold",), []
        for rough in (rough for width in SCAN.widths for rough in self.rough(loads, width, model["R"], False)):
            if ("L" in rough.values) == ("L" in model.free):
                one = self.begun(rough)
                for start in term.starts:
                    more = {x: start[x] for x in start.free if x not in (*one.free, "dead_time_s", "lag_s")}
                    more["c_2"] = one["c_2"] * start["c_2"] / max(model["c_2"], 1e-9)
                    two = one.having(**more).lacking(*(x for x in ("hold", "rotor") if x not in start.free))
                    found.append(replace(start, values=two.values, free=two.free, scales=two.scales))
        return found

    @staticmethod
    def _with_the_rest(begun: LoopModel, model: LoopModel) -> LoopModel:
        for name, values in model.effects:
            if name != GRAVITY:
                begun = begun.with_effect(name, values)
        return replace(begun, side=model.side, whole=model.whole)

    def _stopped(self, model: LoopModel) -> list[LoopModel]:
        """Stops at the ends of the travel, beside what a regression makes of the rest of it."""
        loads = self.loads if self.is_angle else ("hold",)
        low, high = model.scales.low, model.scales.high
        inset = BEGUN.inset * (high - low)
        found = []
        for lower, upper in ((-np.inf, high), (low, np.inf), (low, high)):
            within = (lower + inset, upper - inset)
            for rough in self.rough(loads, SCAN.widths[0], within=within):
                found += stops(self.begun(rough), lower + 0.3 * inset, upper - 0.3 * inset)
        return found
