"""Trials on many servos: parameters and effects scattered about a datasheet's, the controllers knowing the datasheet
alone.

fleet (datasheet, count, spread), seed -> servos -> trials of each -> distribution of every measure
"""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from contextlib import suppress
from dataclasses import dataclass, replace
from hashlib import sha256
from pathlib import Path
from typing import Any

import numpy as np

from ers_mj.control.controllers import Servo
from ers_mj.control.metrics import Measures
from ers_mj.control.own_law import is_own
from ers_mj.control.references import Reference
from ers_mj.control.trial import Conditions, references, try_out
from ers_mj.effects import BY_NAME
from ers_mj.errors import ErsError, Unwritable
from ers_mj.servo.datasheet import Datasheet
from ers_mj.servo.simulation import EffectSettings
from ers_mj.workers.base import Crew, Task
from ers_mj.workers.finished import Finished
from ers_mj.workers.here import Here
from ers_mj.workers.versions import code

ALONE = Here(1)
SCATTERED = ("J", "B", "K_t", "K_e", "k_s", "T_LH", "F_c", "R", "L")
LUMPED = ("a_1", "a_2", "b", "c_1", "c_2")
QUANTILES = (0.05, 0.5, 0.95)
TOLD = (
    "settling_time_s",
    "overshoot_pct",
    "steady_state_error_rad",
    "rmse_rad",
    "peak_u_V",
    "rms_u_V",
    "chatter_V",
    "energy_J",
)
Progress = Callable[[str, float], None]
Key = tuple[str, str, str]  # controller, plant, case
Found = tuple[Key, dict[str, Any]]  # the measures of one trial
Wanted = tuple[Sequence[str], Sequence[str], Sequence[Reference]]  # controllers, plants, cases


@dataclass(frozen=True)
class Spread:
    """One controller on one plant over one reference, on all servos: their measures, None among those of loops that
    were given up.
    """

    controller: str
    plant: str
    case: str
    measures: tuple[Measures, ...]

    @property
    def unstable(self) -> int:
        """Loops given up."""
        return sum(not m.stable for m in self.measures)

    def values(self, name: str) -> np.ndarray:
        """A measure (M,) over the servos that have it."""
        return np.array([x for x in (getattr(m, name) for m in self.measures) if x is not None], float)

    def quantiles(self, name: str) -> tuple[float, float, float, float] | None:
        """5 %, median, 95 % and the largest of a measure; None where no servo has it."""
        x = self.values(name)
        return (*np.quantile(x, QUANTILES).tolist(), float(x.max())) if x.size else None

    def as_document(self) -> dict:
        """As an entry of `robustness`."""
        told = {name: self.quantiles(name) for name in TOLD}
        return {
            "controller": self.controller,
            "plant": self.plant,
            "case": self.case,
            "plants": len(self.measures),
            "unstable": self.unstable,
            "never_settled": len(self.measures) - self.values("settling_time_s").size - self.unstable,
            "measures": {
                name: q and dict(zip(("q05", "median", "q95", "largest"), q, strict=True)) for name, q in told.items()
            },
        }


@dataclass(frozen=True)
class Fleet:
    """``count`` servos like the datasheet's, every factor within 1/spread and spread; the controllers know ``design``,
    the datasheet itself where that is None.
    """

    datasheet: Datasheet
    count: int
    spread: float
    design: Datasheet | None = None


def scattered(
    datasheet: Datasheet, effects: EffectSettings, spread: float, random: np.random.Generator
) -> tuple[Datasheet, EffectSettings]:
    """A servo like the datasheet's: every parameter, and the size of every effect, times a factor within 1/spread and
    spread, log-uniform.

    Effects beside the datasheet's are scattered alike. An effect without a size of its own is scattered in its first
    parameter, within its bounds.
    """
    factor = lambda: float(spread ** random.uniform(-1.0, 1.0))
    sheet = replace(
        datasheet,
        parameters={k: x * (factor() if k in SCATTERED else 1.0) for k, x in datasheet.parameters.items()},
        lumped={k: x * (factor() if k in LUMPED else 1.0) for k, x in datasheet.lumped.items()},
        effects=tuple((name, _resized(name, values, factor())) for name, values in datasheet.effects),
    )
    return replace(sheet, name=datasheet.name), tuple(
        (name, _resized(name, values, factor())) for name, values in effects
    )


def _resized(name: str, values: Mapping[str, float], factor: float) -> dict[str, float]:
    known = BY_NAME[name].parameters
    resized = {p.name for p in known[: max(BY_NAME[name].sized, 1)]}
    return {
        p.name: float(np.clip(values[p.name] * (factor if p.name in resized else 1.0), p.lower, p.upper))
        for p in known
        if p.name in values
    }


def scatter(
    fleet: Fleet,
    controllers: Sequence[str],
    plants: Sequence[str],
    cases: Sequence[str],
    conditions: Conditions,
    *,
    crew: Crew = ALONE,
    finished: Finished | None = None,
    progress: Progress = lambda text, fraction: None,
) -> list[Spread]:
    """Try all combinations on every servo of a fleet, by these workers, which do not change the result. Servo k has
    the noise of seed + k.

    Args:
        finished: servos that are there already, and where those that are tried now are kept.

    Raises:
        InputError: as :func:`ers_mj.control.trial.try_out`.
    """
    aims = references(cases, Servo.of(fleet.design or fleet.datasheet), conditions)  # workers have no files of ours
    wanted = tuple(controllers), tuple(plants), tuple(aims)
    asked = "" if finished is None else _asked(fleet, wanted, conditions)
    found: dict[str, list[Found]] = {}
    for k in range(fleet.count):
        if finished is not None and (kept := finished.value(str(k), asked)) is not None:
            found[str(k)] = kept
    tasks = [Task(str(k), _one, (fleet, k, wanted, conditions)) for k in range(fleet.count) if str(k) not in found]
    for done in crew.run(tasks):
        if done.lost:
            raise ErsError(f"servo {int(done.name) + 1} of {fleet.count}: {done.lost}")
        found[done.name] = done.value
        if finished is not None:
            with suppress(Unwritable):  # the answer counts, which is written elsewhere if need be
                finished.keep(done.name, asked, done.value)
        progress(f"servo {len(found)} of {fleet.count}", len(found) / fleet.count)
    each = zip(*(found[str(k)] for k in range(fleet.count)), strict=True)  # the same trials in the same order
    return [_spread(servos) for servos in each]


def _spread(servos: Sequence[Found]) -> Spread:
    """One trial on all servos."""
    controller, plant, case = servos[0][0]
    return Spread(controller, plant, case, tuple(Measures(**measures) for _, measures in servos))


def _asked(fleet: Fleet, wanted: Wanted, conditions: Conditions) -> str:
    """Hash of all that the trials of a fleet depend on."""
    controllers, plants, aims = wanted
    own = [Path(name).read_bytes() for name in controllers if is_own(name)]
    digest = sha256(repr((fleet, controllers, own, plants, conditions, code())).encode())
    for aim in aims:
        digest.update(repr((aim.name, aim.jumps)).encode())
        for x in (aim.t, aim.theta, aim.omega, aim.alpha):
            digest.update(x.tobytes())
    return digest.hexdigest()


def _one(fleet: Fleet, k: int, wanted: Wanted, conditions: Conditions) -> list[Found]:
    """All trials of servo k, as plain values."""
    random = np.random.default_rng([conditions.seed, k])
    sheet, effects = scattered(fleet.datasheet, conditions.effects, fleet.spread, random)
    its_own = replace(conditions, effects=effects, seed=conditions.seed + k)
    trials = try_out(sheet, *wanted, its_own, design=fleet.design or fleet.datasheet)
    return [((t.controller, t.plant, t.case), t.measures.as_document()) for t in trials]
