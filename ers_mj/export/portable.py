"""A model as plain numbers and text, which needs nothing of this package to run: what the scheme steps.

coefficients, the firmware's loop, the constants of laws -> numbers of `c`; the laws' own text -> functions; static
drives and sensors -> tables of points
"""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np

from ers_mj.effects import BY_NAME, EFFECTS
from ers_mj.effects.base import LEAST_IRON, Effect
from ers_mj.effects.presliding import Presliding
from ers_mj.effects.quantities import Coefficients
from ers_mj.export import stepping
from ers_mj.export.translation import renamed
from ers_mj.plants.kernel.laws import MEMORY
from ers_mj.plants.loop_numbers import LoopNumbers
from ers_mj.plants.reduced import lowered

LONGEST = 2e-4  # [s] of a step
SPRING_STEP = 0.35  # frequency [rad/s] of the stiffest spring times the step
STATE = (
    "t", "theta", "w", "j", "theta_m", "w_m", "z", "xi", "slow", "r", "drive", "carried", "sensed", "before", "count",
)  # fmt: skip
WITHIN = (  # a step, not from one to the next
    "asked", "e", "ahead", "whole", "fresh", "late", "force", "brake", "push", "damp", "wall", "d_wall", "touch",
    "d_touch",
)  # fmt: skip
ARGUMENTS = {
    "torque": "theta, w, j, t",
    "friction": "level, theta, w, j, direction",
    "memory": "theta, w, j, h",
    "inertia": "theta",
}


@dataclass(frozen=True)
class Table:
    """Points of a curve, straight between them and beyond."""

    at: np.ndarray
    to: np.ndarray

    @property
    def is_identity(self) -> bool:
        """Whether it changes nothing."""
        return bool(np.array_equal(self.at, self.to))


@dataclass(frozen=True)
class Portable:
    """What any target that runs code needs.

    Attributes:
        numbers: of the servo, by the names that the scheme gives them.
        constants: those of each law, by the law's name.
        remembering: names of the laws whose constants change on the way.
        drive, sensor: static maps of the command and of the reading.
        laws: text of the functions that the scheme calls.
        left_out: what is not in it, a sentence each.
        step: the longest h [s].
    """

    numbers: Mapping[str, float]
    constants: Mapping[str, np.ndarray]
    remembering: tuple[str, ...]
    drive: Table
    sensor: Table
    laws: str
    left_out: tuple[str, ...]
    step: float

    @property
    def text(self) -> str:
        """Scheme and laws, as Python."""
        return stepping.text() + "\n\n\n" + self.laws

    @property
    def tables(self) -> dict[str, np.ndarray]:
        """Coordinates of the static maps that change anything, by the names that the laws give them."""
        maps = {"drive": self.drive, "sensor": self.sensor}
        found = {noun: table for noun, table in maps.items() if not table.is_identity}
        return {f"{noun}_{axis}": getattr(table, axis) for noun, table in found.items() for axis in ("at", "to")}

    def kept(self, h: float) -> dict[str, int]:
        """Lengths of the histories that a step h needs."""
        late = {"past": self.numbers["delay"], "drives": self.numbers["dead_time"], "seen": self.numbers["late_sensor"]}
        return {name: math.ceil(seconds / h) + 3 for name, seconds in late.items()}


def portable(
    c: Coefficients, effects: Sequence[tuple[str, np.ndarray]], loop: LoopNumbers | None, is_angle: bool
) -> Portable:
    """A plant, with the loop that its firmware closes or without."""
    raw, on, p = lowered(c, effects)
    c = Coefficients(*map(float, raw))
    constants = {EFFECTS[row].name: x for row, x in zip(on.rows, p, strict=True)}
    creep = _creep(c, constants)
    acting = [BY_NAME[name] for name in constants]
    numbers = {
        **_plant_numbers(c),
        **creep,
        **_loop_numbers(loop, c),
        "delay": loop.tau if loop else c.delay,
        **_sensor_numbers(effects),
    }
    drive = _table(lambda u: _terminal(effects, u), _reach(effects))
    sensor = _table(lambda y: _read(effects, y), 2.0 * math.pi if is_angle else _travel(c))
    return Portable(
        numbers,
        {f"law_{name}": x for name, x in constants.items()},
        tuple(f"law_{effect.name}" for effect in acting if effect.memory),
        drive,
        sensor,
        _laws(acting, on.parted, drive, sensor),
        _left_out(effects, sensor, is_angle),
        _step(c),
    )


def bare(
    p: Portable,
    numbers: Mapping[str, float],
    drive: Table | None = None,
    kept: Sequence[Effect] = (),
    sensor: Table | None = None,
) -> Portable:
    """The same with other numbers and the laws of these effects alone; drive and sensor as given, or straight. A sensor
    that is not given is at once.
    """
    homes, at_once = {f"law_{effect.name}" for effect in kept}, {"T_sensor": 0.0, "late_sensor": 0.0}
    drive, read = drive or _straight(), sensor or _straight()
    return replace(
        p,
        numbers={**p.numbers, **numbers, **({} if sensor else at_once)},
        constants={name: x for name, x in p.constants.items() if name in homes},
        remembering=(),
        drive=drive,
        sensor=read,
        laws=_laws(kept, False, drive, read),
        left_out=(),
    )


def clipping(limit: float) -> Table:
    """A drive that does nothing but clip its input."""
    at = np.array([-2.0, -1.0, 1.0, 2.0]) * limit
    return Table(at, np.clip(at, -limit, limit))


def _straight() -> Table:
    return Table(np.array([-1.0, 1.0]), np.array([-1.0, 1.0]))


# -- numbers ----------------------------------------------------------------------------------------------------------


def _plant_numbers(c: Coefficients) -> dict[str, float]:
    own = {k: v for k, v in c._asdict().items() if k not in ("two_body", "g_s", "g_c", "creep", "delay")}
    parted = c.has_motor_side
    if not parted:
        own |= {"rho": 0.0, "beta": 0.0, "phi": 0.0, "gap": 0.0}
    return own | {
        "parted": float(parted),
        "on_bristle": 1.0 - c.phi if parted else 1.0,
        "most_fallen": 1.0 / LEAST_IRON - 1.0,
    }


def _creep(c: Coefficients, constants: dict[str, np.ndarray]) -> dict[str, float]:
    """Friction that creeps, as the firmware's plants have it: the law that says so is taken out of ``constants``."""
    found = constants.pop(Presliding.name, None)
    if found is None or c.creep <= 0.0:
        return {"creep": math.inf, "heavy": 1.0}
    heavy = max(0.5 * (c.c_2_plus + c.c_2_minus) / found[1], 1.0)
    return {"creep": found[0] * heavy, "heavy": heavy}


def _loop_numbers(loop: LoopNumbers | None, c: Coefficients) -> dict[str, float]:
    q = loop or LoopNumbers(K=0.0)
    given = {k: v for k, v in q._asdict().items() if k not in ("tau", "creep", "heavy", "fresh")}
    slow = {"creep": q.creep, "heavy": q.heavy} if loop else {}
    return given | slow | {"looped": float(loop is not None)}


def _sensor_numbers(effects: Sequence[tuple[str, np.ndarray]]) -> dict[str, float]:
    slow = [BY_NAME[name].remembers(p) for name, p in effects]
    return {"T_sensor": sum(T for T, _ in slow), "late_sensor": sum(T_d for _, T_d in slow)}


def _step(c: Coefficients) -> float:
    """[s] of a step at most; a millisecond is a whole number of them."""
    rest = 1.0 - c.rho if c.has_motor_side else 1.0
    light = max(min(c.rho, rest), 1e-3) if c.has_motor_side else 1.0
    bristle = c.k_bristle * ((1.0 - c.phi) / rest if c.has_motor_side else 1.0)
    stop = c.k_stop if math.isfinite(c.lower) or math.isfinite(c.upper) else 0.0
    stiffest = max(stop / rest, c.k_twist / light if c.has_motor_side else 0.0, bristle)
    longest = min(LONGEST, SPRING_STEP / math.sqrt(stiffest)) if stiffest > 0 else LONGEST
    return 1e-3 / math.ceil(1e-3 / longest - 1e-9)


# -- tables -----------------------------------------------------------------------------------------------------------


def _touching(effects: Sequence[tuple[str, np.ndarray]]) -> list[tuple[Effect, np.ndarray]]:
    """Effects that change what is read, at once and by a law."""
    return [(BY_NAME[name], p) for name, p in effects if BY_NAME[name].instant]


def _terminal(effects: Sequence[tuple[str, np.ndarray]], u: np.ndarray) -> np.ndarray:
    for name, p in effects:
        u = BY_NAME[name].command(p, u)
    return u


def _read(effects: Sequence[tuple[str, np.ndarray]], y: np.ndarray) -> np.ndarray:
    for effect, p in _touching(effects):
        y = effect.measure(p, np.zeros(y.size), y)
    return y


def _reach(effects: Sequence[tuple[str, np.ndarray]]) -> float:
    """The size of commands beyond which a static drive goes on straight."""
    sizes = [
        abs(x)
        for name, p in effects
        for parameter, x in zip(BY_NAME[name].parameters, p, strict=True)
        if parameter.kind == "input" and math.isfinite(x)
    ]
    return 20.0 * max(sizes, default=1.0)


def _travel(c: Coefficients) -> float:
    ends = [abs(x) for x in (c.lower, c.upper, c.theta_0) if math.isfinite(x)]
    return 4.0 * max([*ends, 1.0])


def _table(curve: Callable[[np.ndarray], np.ndarray], reach: float) -> Table:
    """Points of a curve over +-reach, halved until what lies straight between two is within 1e-6 of it."""
    points = 0.997 * np.linspace(-reach, reach, 1001)
    if np.array_equal(curve(points), points):
        return _straight()
    at = np.linspace(-reach, reach, 257)
    for _ in range(22):
        middle = 0.5 * (at[1:] + at[:-1])
        straight = 0.5 * (curve(at[1:]) + curve(at[:-1]))
        off = np.abs(curve(middle) - straight) > 1e-6 * reach
        if not off.any() or at.size > 4000:
            break
        at = np.sort(np.concatenate([at, middle[off]]))
    return _thinned(at, curve(at), 1e-9 * reach)


def _thinned(at: np.ndarray, to: np.ndarray, near: float) -> Table:
    """Without the points that lie straight between their neighbours."""
    kept = [0]
    for k in range(1, at.size - 1):
        i = kept[-1]
        straight = to[i] + (to[k + 1] - to[i]) * (at[i + 1 : k + 1] - at[i]) / (at[k + 1] - at[i])
        if np.max(np.abs(straight - to[i + 1 : k + 1])) > near:
            kept.append(k)
    kept.append(at.size - 1)
    return Table(at[kept], to[kept])


# -- laws -------------------------------------------------------------------------------------------------------------


def _laws(acting: Sequence[Effect], parted: bool, drive: Table, sensor: Table) -> str:
    """The functions that the scheme calls, and the laws that they call."""
    owned, heavy = _owned(acting), [effect for effect in acting if effect.inertia]
    at_load = [e for e in acting if e.torque and not (parted and e.at_motor)]
    at_motor = [e for e in acting if e.torque and parted and e.at_motor]
    rubbing = [e for e in acting if e.friction]
    glue = [
        _sum("total_torque", "theta, w, j, t", "torque", at_load, "a += {}", "0.0"),
        _sum("motor_torque", "theta, w, j, t", "torque", at_motor, "a += {}", "0.0"),
        _sum("friction_level", "level, theta, w, j, direction", "friction", rubbing, "level = {}", None),
        _sum("inertia_at", "theta", "inertia", heavy, "a *= {}", "1.0"),
        _sum("half_slope_at", "theta", "half_slope", heavy, "a += {}", "0.0"),
        _remembering([e for e in acting if e.memory], parted),
        _mapped("drive_law", "u", drive, "drive"),
        _mapped("sensor_law", "y", sensor, "sensor"),
    ]
    return "\n\n\n".join([*owned, *glue]) + "\n"


def _owned(acting: Sequence[Effect]) -> list[str]:
    """The laws' own texts, of an inertia two functions."""
    texts = [
        renamed(getattr(effect, kind).py_func, f"{kind}_{effect.name}")
        for effect in acting
        for kind in ("torque", "friction", "memory")
        if getattr(effect, kind)
    ]
    for effect in acting:
        for part, kind in enumerate(("inertia", "half_slope") if effect.inertia else ()):
            texts.append(renamed(effect.inertia.py_func, f"{kind}_{effect.name}", part))  # type: ignore[union-attr]
    return texts


def _home(effect: Effect) -> str:
    """Where a law's constants are: the state, if they change."""
    return f"{'x' if effect.memory else 'c'}.law_{effect.name}"


def _sum(name: str, arguments: str, kind: str, acting: Sequence[Effect], add: str, start: str | None) -> str:
    given = ARGUMENTS["inertia" if kind == "half_slope" else kind]
    calls = [add.format(f"{kind}_{e.name}({_home(e)}, {given})") for e in acting]
    lines = [*([f"a = {start}"] if start else []), *calls, "return a" if start else "return level"]
    return f"def {name}(c, x, {arguments}):\n    " + "\n    ".join(lines)


def _remembering(acting: Sequence[Effect], parted: bool) -> str:
    lines = [
        f"x.law_{e.name}[{MEMORY}] = memory_{e.name}(x.law_{e.name}, "
        + ("x.theta_m, x.w_m, x.j, h)" if parted and e.at_motor else "x.theta, x.w, x.j, h)")
        for e in acting
    ]
    return "def remember(c, x, h):\n    " + "\n    ".join(lines or ["return"])


def _mapped(name: str, argument: str, table: Table, noun: str) -> str:
    if table.is_identity:
        return f"def {name}(c, {argument}):\n    return {argument}"
    return f"def {name}(c, {argument}):\n    return looked_up(c.{noun}_at, c.{noun}_to, {table.at.size}, {argument})"


def _left_out(effects: Sequence[tuple[str, np.ndarray]], sensor: Table, is_angle: bool) -> tuple[str, ...]:
    lost = []
    for name, _ in effects:
        effect, spoken = BY_NAME[name], name.replace("_", " ")
        if effect.holds:
            lost.append(f"{spoken}: readings that are lost at random")
        elif effect.after_noise:
            lost.append(f"{spoken}: the reading is not rounded to the converter's counts")
        elif effect.once:
            lost.append(f"{spoken}: acts at its own time after the start, as in the recording where it was seen")
    if not sensor.is_identity:
        reach = "a turn to either side" if is_angle else f"+-{sensor.at[-1]:.4g}"
        lost.append(f"the sensor's law: a table over {reach}, straight beyond")
    return tuple(lost)
