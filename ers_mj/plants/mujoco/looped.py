"""A firmware's loop around a MuJoCo plant: a position actuator where MuJoCo can carry it, else a stepped controller."""

from __future__ import annotations

import math
from dataclasses import dataclass, replace

import mujoco
import numpy as np

from ers_mj.effects.load_dependent_friction import LoadDependentFriction
from ers_mj.plants.firmware import placed
from ers_mj.plants.kernel.laws import laid_out
from ers_mj.plants.loop_numbers import LoopNumbers
from ers_mj.plants.mujoco.plant import MAX_DELAY_SAMPLES, MechanicalPlant
from ers_mj.plants.mujoco.stepping import unlogged
from ers_mj.plants.reduced import lowered

SIDE = [parameter.name for parameter in LoadDependentFriction.parameters].index("side")
CONTROL_STEP = 5e-4  # [s] for which the stepped controller holds its drive


def firmware_alone(q: LoopNumbers) -> tuple[str, ...]:
    """What of a firmware's loop no position actuator of MuJoCo has."""
    found = {
        "integral action": q.I > 0.0,
        "the lag of the speed that the firmware damps": q.lag > 0.0,
        "the limit of the reference's speed": math.isfinite(q.R),
        "the dead band": q.band > 0.0 or q.least > 0.0 or q.idle > 0.0,
        "the limit of the motor's torque": math.isfinite(q.most),
    }
    return tuple(name for name, is_so in found.items() if is_so)


@dataclass(frozen=True)
class LoopedPlant:
    """A MuJoCo plant whose input is an acceleration of its motor (b = 1), and the loop that commands it."""

    plant: MechanicalPlant
    loop: LoopNumbers

    def __post_init__(self):
        """A gear behind the motor's share of the inertia rubs by what it carries (see plants/firmware.py)."""
        if any(name == LoadDependentFriction.name for name, _ in self.plant.effects):
            effects = [(name, _carried(name, values, self.loop.share)) for name, values in self.plant.effects]
            object.__setattr__(self, "plant", replace(self.plant, effects=effects))

    @property
    def model(self) -> mujoco.MjModel:
        """The plant's, without the loop."""
        return self.plant.model

    @property
    def is_angle(self) -> bool:
        """Whether the output turns."""
        return self.plant.is_angle

    def positions(self, theta: float, theta_m: float) -> np.ndarray:
        """As MechanicalPlant.positions."""
        return self.plant.positions(theta, theta_m)

    @property
    def absent(self) -> tuple[str, ...]:
        """What a position actuator cannot carry."""
        on_load = self.plant._lowered.has_motor_side and self.loop.at_motor == 0.0
        creeps, late = math.isfinite(self.loop.creep), self.loop.dead_time > 0.0
        return (
            *firmware_alone(self.loop),
            *(("creeping friction",) if creeps else ()),
            *(("a dead time within the loop (the whole actuator is late)",) if late else ()),
            *(("the loop's sensor on the load",) if on_load else ()),
        )

    def spec(self) -> mujoco.MjSpec:
        """The model with a position actuator in place of the motor: kp, kv, forcerange, delay."""
        spec, q = self.plant.spec(), self.loop
        motor = spec.actuator("motor")
        motor.gaintype, motor.biastype = mujoco.mjtGain.mjGAIN_FIXED, mujoco.mjtBias.mjBIAS_AFFINE
        motor.gear[0] = 1.0
        motor.gainprm = [q.K, *[0.0] * 9]
        held = q.K if q.D >= 0.0 else math.nextafter(q.K, 0.0)  # beside the same K, -D were a damping ratio
        motor.biasprm = [0.0, -held, -q.D, *[0.0] * 7]
        if math.isfinite(q.L):
            motor.forcelimited, motor.forcerange = True, [-q.L, q.L]
        late = q.tau + q.dead_time
        if late > 0.0:
            step = self.plant.timestep
            motor.delay, motor.nsample = late, min(int(np.ceil(late / step)) + 1, MAX_DELAY_SAMPLES)
        spec.compile()
        return spec

    def xml(self) -> str:
        """plant.xml: self-contained text, its first lines naming what it cannot carry."""
        laws = (*self.plant.stepped, *self.absent)
        note = f"ctrl is the commanded position; what MJCF does not carry here: {', '.join(laws) or 'nothing'}"
        return f"<!-- ers-mj plant with its position loop. {note} -->\n{self.spec().to_xml()}"

    @unlogged()
    def motion(self, t: np.ndarray, r: np.ndarray, start: tuple[float, float], before: float) -> np.ndarray:
        """Free run (N, 4) under the reference r (N,), by the stepped controller: load's angle and speed, motor side's
        angle, drive; NaN from where it runs away.
        """
        q, out = self.loop, np.full((t.size, 4), np.nan)
        stepper = self.plant._stepper()
        stepper.reset(self._placed(start))
        firmware = _Firmware(q, t, r, before)
        late, drive = [0.0] * max(1, round(q.dead_time / CONTROL_STEP)), 0.0
        for k in range(t.size):
            theta, w, theta_m, w_m, _ = stepper._observe()
            out[k] = theta, w, theta_m, drive
            if k == t.size - 1 or not abs(theta) < 1e9:
                break
            steps = max(1, math.ceil((t[k + 1] - t[k]) / CONTROL_STEP - 1e-9))
            h = (t[k + 1] - t[k]) / steps
            for s in range(steps):
                theta, w, theta_m, w_m, _ = stepper._observe()
                seen = (theta_m, w_m) if q.at_motor > 0.0 else (theta, w)
                late.append(firmware.drive(t[k] + s * h, *seen, h))
                drive = late.pop(0) if q.dead_time > 0.0 else late[-1]
                late = late if q.dead_time > 0.0 else late[-1:]
                stepper.hold([(min(max(drive, -q.most), q.most), stepper._divide(h)[1])], h)
        return out

    def simulate(self, t: np.ndarray, r: np.ndarray, start: tuple[float, float], before: float) -> np.ndarray:
        """What the log shows (N,) of that run."""
        return self.motion(t, r, start, before)[:, 2 if self.loop.log_at_motor > 0.0 else 0]

    def _placed(self, start: tuple[float, float]) -> dict[str, tuple[float, float]]:
        """{joint: (position, velocity)} of a servo whose log shows ``start`` (angle, speed)."""
        seen, w = start
        plant = laid_out(*lowered(self.plant.coefficients, self.plant.effects))
        theta, theta_m = placed(seen, plant, np.array(self.loop, float))
        return self.plant.parted_start(theta, theta_m, w)


def _carried(name: str, values: np.ndarray, share: float) -> np.ndarray:
    """An effect's numbers (k,), friction by the motor's torque alone told by both sides' of a motor of this share."""
    if name != LoadDependentFriction.name or np.isfinite(values[SIDE]):
        return values
    return np.concatenate([values[:SIDE], [share], values[SIDE + 1 :]])


class _Firmware:
    """The loop's own state: the limited reference, the integral, the speed that its damping has."""

    def __init__(self, q: LoopNumbers, t: np.ndarray, r: np.ndarray, before: float):
        self.q, self.t, self.asked, self.before = q, t, r, before
        self.r, self.xi, self.slow = before, 0.0, 0.0

    def drive(self, at: float, theta: float, w: float, h: float) -> float:
        """Drive acceleration for the next h [s], the output seen at theta with the speed w."""
        q = self.q
        k = int(np.searchsorted(self.t, at - q.tau + 1e-9, side="right")) - 1
        target = self.before if k < 0 else float(self.asked[k])
        self.r += min(max(target - self.r, -q.R * h), q.R * h)
        # the drive is held for h, whose middle lies h / 2 ahead
        e = self.r - theta - 0.5 * h * w
        size = abs(e)
        if q.band > 0.0:
            size = 0.0 if size <= q.band else min(size - q.lost, 30.0 * (size - q.band))
        if q.least > 0.0 and size > 0.0:
            size = max(size, q.least / q.K)
        self.slow = w + (self.slow - w) * math.exp(-h / q.lag) if q.lag > 0.0 else w
        v = q.K * math.copysign(size, e) + self.xi - q.D * self.slow
        v -= min(max(v, -q.idle), q.idle)
        most = max(q.L - q.idle, 0.0)
        if q.I > 0.0 and (abs(v) < most or v * e < 0.0):
            self.xi = min(max(self.xi + h * q.I * e, -q.L), q.L)
        return min(max(v, -most), most)
