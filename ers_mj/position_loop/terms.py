"""What may act in a servo that closes its own loop, beside its bare loop and plant: every candidate with its starts.

A limit or an effect is begun from a start of its own; where one changes what the rest of the model came to without it
(a limit of the reference's speed, integral action), also from a closed form that has it in.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass, replace

import numpy as np

from ers_mj.effects import BY_NAME
from ers_mj.effects.asymmetric_friction import AsymmetricFriction
from ers_mj.effects.backlash import Backlash
from ers_mj.effects.cogging import Cogging
from ers_mj.effects.current_limit import CurrentLimit
from ers_mj.effects.drive_dead_zone import DriveDeadZone
from ers_mj.effects.end_stop import EndStop
from ers_mj.effects.gravity_imbalance import GravityImbalance
from ers_mj.effects.input_delay import InputDelay
from ers_mj.effects.load_dependent_friction import LoadDependentFriction
from ers_mj.effects.position_dependent_friction import PositionDependentFriction
from ers_mj.effects.presliding import Presliding
from ers_mj.effects.quadratic_drag import QuadraticDrag
from ers_mj.effects.rate_limit import RateLimit
from ers_mj.effects.shaft_compliance import ShaftCompliance
from ers_mj.effects.stribeck import Stribeck
from ers_mj.effects.voltage_saturation import VoltageSaturation
from ers_mj.position_loop.model import SIDES, LoopModel
from ers_mj.position_loop.runs import Run, speed_of

INTEGRAL, DERIVATIVE, WITHIN = "integral action", "derivative action", "dead time within the loop"
STARTING = "starting force"  # of the firmware: the least that its motor is driven with
SPRING, CONSTANT = "spring", "constant load"  # the second may as well be an offset of the sensor: it has no name
LAWS = (
    GravityImbalance, LoadDependentFriction, Stribeck, QuadraticDrag, AsymmetricFriction, PositionDependentFriction,
    Cogging,
)  # fmt: skip


EMPTY = (False, True)  # whether an integral is where a recording begins
OWN = {
    INTEGRAL: ("I",),
    DERIVATIVE: ("D", "lag_s"),
    WITHIN: ("dead_time_s",),
    STARTING: ("least",),
    SPRING: ("a_1",),
    CONSTANT: ("hold",),
}  # letters without an effect
BESIDE = {
    Backlash.name: ("grease", "rubbed"),
    ShaftCompliance.name: ("rubbed",),
    LoadDependentFriction.name: ("rubbed", "share"),
}  # letters that only an effect tells


@dataclass(frozen=True)
class DefaultConstraint:
    """What MuJoCo's default solref (0.02 s, 1) and solimp (0.9 to 0.95) make of a joint's friction and limit."""

    creep: float = 947.0  # [1/s] below breakaway: force over inertia and speed, 2 / (0.95 * 0.02 s) * 0.9 / (1 - 0.9)
    heavy: float = 10.0  # 1 / (1 - 0.9): how much slower the body answers there,
    buried: float = 20.0  # 1 / (1 - 0.95): and within a limit,
    frequency: float = 36.0  # [Hz] of which it bounces there,
    damping: float = 4.0  # and its damping ratio


MUJOCO = DefaultConstraint()


@dataclass(frozen=True)
class Sizes:
    """From where candidates are begun."""

    integrals: tuple[float, ...] = (0.5, 3.0)  # [1/s] of K
    creeps: tuple[tuple[float, float], ...] = (
        (MUJOCO.creep, MUJOCO.heavy),
        (MUJOCO.creep, 1.0),
        (150.0, 1.0),
    )  # [1/s], and how heavy
    dead_times: tuple[float, ...] = (0.004, 0.012)  # [s]
    bristles: tuple[float, ...] = (3.0, 1.0, 0.1)  # of the widest that shows without a loop, which goes on driving
    bands: tuple[float, ...] = (0.35, 1.0, 2.5)  # of the stiction width c_2 / K, or of c_2
    lost: float = 0.7  # of the friction that the bridge is taken for
    lags: tuple[float, ...] = (0.003, 0.008)  # [s] of the speed that the firmware damps
    pushes: tuple[float, ...] = (1.2, 2.0)  # of friction
    currents: tuple[float, ...] = (0.9, 0.7)  # of the largest drive
    drives: tuple[float, ...] = (0.99, 0.95, 0.85)  # quantiles of the drive without a limit, to which it is limited
    speeds: tuple[float, ...] = (1.0, 0.8)  # of the largest speed that is seen
    gaps: tuple[float, ...] = (0.4, 1.5)  # of the error that is left
    shares: tuple[tuple[float, float], ...] = ((0.3, 0.8), (0.65, 0.3))  # of inertia and friction, on the motor's side
    light: tuple[float, float] = (0.8, 1.0)  # the motor's shares of a load that is light and bears no friction
    resonances: tuple[float, ...] = (4.0, 8.0, 15.0)  # [Hz] of a shaft
    contacts: tuple[tuple[float, float], ...] = (
        (15.0, 1.5),
        (40.0, 1.0),
        (60.0, 0.5),
        (100.0, 0.2),
        (160.0, 0.5),
    )  # [Hz] of a play and damping ratio: soft at first, since bodies that bounce leave a fit many minima
    rubs: tuple[float, ...] = (0.05, 0.3)  # of the torque that the gear carries
    behind: tuple[float, ...] = (0.1, 0.5)  # of the inertia, on the motor's side of the gear that rubs
    rubbed: float = 0.3  # share of the damping that both bodies bear
    parted: float = 1.3  # noise levels of error from which a second body is tried
    least: float = 0.02  # of a law's start, and
    most: float = 3.0  # of it, to which a secant may scale it
    periods: tuple[int, ...] = (2, 4, 8, 16)  # of cogging within the travel


SIZES = Sizes()


@dataclass(frozen=True)
class Term:
    """A candidate: its name, models from which it is begun, and whether it is an effect with a name."""

    name: str
    starts: tuple[LoopModel, ...]
    is_far: bool = False  # whether the way from its starts is long
    is_bent: bool = False  # whether the rest of the model is another with it
    is_rare: bool = False  # whether it may act in few of many runs, as a limit does
    is_law: bool = False  # whether it adds to the forces in proportion to its size, so that a secant shows it


def top_speed(runs: Sequence[Run]) -> float:
    """98 % quantile of the speed over 50 ms: what a limited reference moves at."""
    return float(np.quantile(np.concatenate([np.abs(speed_of(run, 0.025)) for run in runs]), 0.98))


def is_there(model: LoopModel, name: str) -> bool:
    """Whether a model has a term."""
    if name in model.names:
        return True
    letters = OWN.get(name) or (BY_NAME[name].in_loop if name in BY_NAME else ())
    return any(letter in model.free for letter in letters)


def present(model: LoopModel) -> list[str]:
    """The effects with a name that are in a model."""
    return [name for name in BY_NAME if is_there(model, name)]


def parts(model: LoopModel) -> list[str]:
    """Every term of a model that may be left out."""
    laws = (INTEGRAL, DERIVATIVE, STARTING, SPRING, CONSTANT)
    return [*present(model), *(name for name in laws if is_there(model, name))]


def without(model: LoopModel, name: str) -> LoopModel:
    """The model without one term; a play takes the side of its sensors along, a limit what only it tells apart."""
    if name == EndStop.name:
        return model.without_effect(name).lacking("buried")
    if name in model.names:
        gone = model.without_effect(name)
        kept = {letter for other in gone.names for letter in BESIDE.get(other, ())}
        gone = gone.lacking(*(letter for letter in BESIDE.get(name, ()) if letter not in kept))
        return replace(gone, side=SIDES[0]) if BY_NAME[name].subsystem == "transmission" else gone
    if name in (INTEGRAL, STARTING, SPRING, CONSTANT):
        return model.lacking(*OWN[name])
    if name == DERIVATIVE:
        return model.having(a_2=model["a_2"] + max(model["D"], 0.0)).lacking(*OWN[DERIVATIVE])
    gone = model.lacking(*BY_NAME[name].in_loop)
    if name == VoltageSaturation.name and gone["dead_time_s"] == 0.0:
        gone = gone.having(a_2=max(model["a_2"] + model["D"], 1e-3)).lacking(*OWN[DERIVATIVE])
    return gone


def lesser(model: LoopModel, name: str) -> list[LoopModel]:
    """The model without one term; without a weight also with the constant torque that it is along a small travel."""
    bare = without(model, name)
    return [bare, bare.having(hold=0.0)] if name == GravityImbalance.name and "hold" not in bare.free else [bare]


def terms(model: LoopModel, runs: Sequence[Run], error: float) -> list[Term]:
    """The candidates beside a model that leaves so large an error [output unit], each from its own starts; what needs a
    closed form is in selection.py.
    """
    found = [
        *_of_the_loop(model, runs),
        Term(Presliding.name, tuple(_giving(model)), is_bent=True),
        Term(CONSTANT, (model.having(hold=0.0),)),
        Term(SPRING, (model.having(a_1=0.0, hold=0.0),)),
        *_transmissions(model, error),
        *(Term(law.name, tuple(_begun(model, law.name)), is_law=True) for law in LAWS),
        Term(EndStop.name, tuple(_begun(model, EndStop.name)), is_rare=True),
    ]
    plain = error < SIZES.parted * max(run.sigma for run in runs)
    found = [term for term in found if term.starts and not (term.is_far and plain)]
    return [term for term in found if not is_there(model, term.name)]


def _of_the_loop(model: LoopModel, runs: Sequence[Run]) -> list[Term]:
    """What the firmware itself may do."""
    drive = model.scales.drive or 4.0 * model.scales.acceleration
    found = [
        Term(INTEGRAL, tuple(replace(model.having(I=x * model["K"]), fresh=f) for x in SIZES.integrals for f in EMPTY)),
        Term(RateLimit.name, tuple(model.having(R=x * top_speed(runs)) for x in SIZES.speeds), is_rare=True),
        Term(InputDelay.name, (model.having(tau_s=0.01),)),
        Term(WITHIN, delayed_within(model)),
        Term(DriveDeadZone.name, tuple(_asleep(model))),
        Term(STARTING, tuple(model.having(least=x * model["c_2"]) for x in SIZES.pushes if model["c_2"] > 0.0)),
        Term(CurrentLimit.name, tuple(model.having(most=x * drive) for x in SIZES.currents), is_rare=True),
    ]
    damped = model.having(D=0.3 * model["a_2"], a_2=0.7 * model["a_2"])  # what a limit tells apart
    if "L" in model.free:
        found.append(Term(DERIVATIVE, (damped,)))
    else:
        drives = np.concatenate([np.abs(model.motion(run)[:, 3]) for run in runs])
        limits = np.quantile(drives[np.isfinite(drives)], SIZES.drives)
        starts = tuple(m.having(L=x) for x in limits for m in (model, damped))
        found.append(Term(VoltageSaturation.name, starts, is_rare=True))
    return found


def _giving(model: LoopModel) -> Iterator[LoopModel]:
    """Friction that creeps, as MuJoCo's does, and of one body one that a bristle carries."""
    for creep, heavy in SIZES.creeps:
        yield model.fixed(heavy=heavy).having(creep=creep)
    if not model.has_two_bodies:
        bristles = [start for start in BY_NAME[Presliding.name].starts(model.scales) if np.isfinite(start[0])]
        for wider in SIZES.bristles:  # each with damping that fades, and with one that stays
            for start in bristles[:2]:
                yield model.with_effect(Presliding.name, np.array([wider * start[0], *start[1:]]))


def _asleep(model: LoopModel) -> Iterator[LoopModel]:
    """The firmware that ignores small errors, and the bridge that ignores small drives: as it pushes, what it loses is
    one with friction, which had to stand for both.
    """
    for size in SIZES.bands:
        yield model.having(band=size * model["c_2"] / model["K"])
        yield model.having(idle=size * model["c_2"])
    if "c_2" in model.free:
        yield model.having(idle=SIZES.lost * model["c_2"], c_2=(1.0 - SIZES.lost) * model["c_2"])


def ways_round(model: LoopModel, runs: Sequence[Run]) -> list[Callable[[LoopModel], LoopModel]]:
    """What else the firmware may do with an integral where a recording begins, and with its gain register."""
    found = []
    if "I" in model.free:
        found.append(lambda model: replace(model, fresh=not model.fresh))
    if any(run.gain != runs[0].gain for run in runs) and {"D", "I"} & set(model.free):
        found.append(lambda model: replace(model, whole=not model.whole))
    return found


def lagging(model: LoopModel) -> tuple[LoopModel, ...]:
    """The loop whose damping has the speed late: damping D times lag takes from the inertia, which the bare loop's
    K, D and c_2, told per inertia, had to bring.
    """
    found = []
    for late in SIZES.lags:
        heavier = 1.0 / (1.0 + max(model["D"], 0.0) * late)
        found.append(model.having(lag_s=late, **{x: model[x] * heavier for x in ("K", "D", "c_2") if x in model.free}))
    return tuple(found)


def delayed_within(model: LoopModel) -> tuple[LoopModel, ...]:
    """The delay within the loop and not in its reference: it takes damping away, which the loop's own had to bring."""
    total, found = max(model["a_2"] + model["D"], 1e-2), []
    for late in {max(model["tau_s"], x) for x in SIZES.dead_times}:
        for share, gain in ((0.9, 1.0), (0.9, 0.75), (0.1, 1.0)):
            plain = model.lacking("tau_s")
            found.append(
                plain.having(dead_time_s=late, D=share * total, a_2=(1.0 - share) * total, K=gain * model["K"])
            )
    return tuple(found)


def _begun(model: LoopModel, name: str) -> list[LoopModel]:
    """Starts of an effect with a law of its own."""
    scales = model.scales
    if name == Cogging.name:
        travel = scales.high - scales.low
        starts = [np.array([0.3 * scales.acceleration, travel / n, 0.0, np.inf, np.inf]) for n in SIZES.periods]
    else:
        starts = BY_NAME[name].starts(scales)
    if name == EndStop.name:
        return [stop for low, high, _, _ in starts for stop in stops(model, low, high)]
    if name == LoadDependentFriction.name:
        rest = starts[0][1:]  # the torque that the gear carries is the integrator's own
        return [m.with_effect(name, np.array([mu, *rest])) for mu in SIZES.rubs for m in _rubbing(model, mu)]
    wave = BY_NAME[name].wave
    quarters = [
        _turned(start, wave[1], k) for k in (1, 2, 3) for start in starts if wave and np.isfinite(start[wave[1]])
    ]
    return [model.with_effect(name, start) for start in (*starts, *quarters)]


def _turned(start: np.ndarray, phase: int, quarters: int) -> np.ndarray:
    """A wave's numbers so many quarters of a period further, which a change of its size alone does not reach."""
    turned = start.copy()
    turned[phase] += 0.5 * np.pi * quarters
    return turned


def _rubbing(model: LoopModel, mu: float) -> list[LoopModel]:
    """The model without friction that grows by mu of what the gear carries: what its drive seemed to be, it was less
    that. On which side of the gear it acts may follow from the loads where there are several.
    """
    more = {x: model[x] / (1.0 - mu) for x in ("K", "D", "I", "L", "a_2") if x in model.free}
    model = model.having(rubbed=SIZES.rubbed, **more)
    tied = [model] if model["rotor"] > 0.0 else []
    return [*tied, *(model.having(share=share) for share in SIZES.behind)]


def form_of(model: LoopModel, name: str) -> tuple[bool, ...]:
    """Which of an effect's numbers a model has."""
    return tuple(bool(x) for x in np.isfinite(dict(model.effects)[name]))


def other_forms(model: LoopModel, name: str) -> list[LoopModel]:
    """The model with one of its effects in other forms, a play with other contacts and a light load that rubs nowhere;
    of load friction none, whose torque is the integrator's own.
    """
    if name not in model.names or name == LoadDependentFriction.name:
        return []
    values = dict(model.effects)[name]
    if BY_NAME[name].is_play:
        shares, contacts = ((values[1], values[2]), SIZES.light), SIZES.contacts[1:]
        forms = [np.array([values[0], *share, *contact]) for share in shares for contact in contacts]
    else:
        forms = BY_NAME[name].grown(name, values, model.scales)
    return [model.with_effect(name, form) for form in forms]


def sized(model: LoopModel, name: str, size: float) -> LoopModel:
    """A model with an effect of a law so many times as large, where its law has a size and that sense is its own."""
    effect, values = BY_NAME[name], dict(model.effects)[name].copy()
    for k in range(effect.sized):
        if size > 0.0 or not effect.parameters[k].positive:
            values[k] *= math.copysign(min(max(abs(size), SIZES.least), SIZES.most), size)
    return model.with_effect(name, values)


def stops(model: LoopModel, low: float, high: float) -> list[LoopModel]:
    """A model with stops there: springs, and MuJoCo's constraint."""
    spring = np.array([low, high, 40.0, 0.3])
    sunk = np.array([low, high, MUJOCO.frequency, MUJOCO.damping])
    return [model.with_effect(EndStop.name, spring), model.fixed(buried=MUJOCO.buried).with_effect(EndStop.name, sunk)]


def _transmissions(model: LoopModel, error: float) -> list[Term]:
    """A play or a shaft, with the loop's sensor and the log's on either side; of a loop on the motor's side friction is
    partly the load's.
    """
    if model.has_two_bodies or Presliding.name in model.names:
        return []
    soft = SIZES.contacts[0]
    play = [np.array([x * error, rho, phi, *soft]) for x in SIZES.gaps for rho, phi in SIZES.shares]
    shaft = [np.array([f, 0.1, 0.6, 0.3, np.inf]) for f in SIZES.resonances]
    parted, found = model.having(rubbed=SIZES.rubbed), []
    for name, starts in ((Backlash.name, play), (ShaftCompliance.name, shaft)):
        models = []
        slick = parted.having(grease=0.1) if BY_NAME[name].is_play else parted
        for side in SIDES:
            held = slick if side == SIDES[0] else slick.having(c_2=0.7 * model["c_2"])
            models += [replace(held.with_effect(name, start), side=side) for start in starts]
        found.append(Term(name, tuple(models), is_far=True))
    return found
