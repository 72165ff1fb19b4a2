"""The reduced model one sample at a time, its state carried: what a control loop needs, as event-exact as a free
run.
"""

from __future__ import annotations

import numpy as np

from ers_mj.effects import BY_NAME
from ers_mj.plants.compiling.compiled import kernel
from ers_mj.plants.kernel import fixed_steps
from ers_mj.plants.kernel.cuts import corner_speed, cut, longest_step
from ers_mj.plants.kernel.event_integrator import advance
from ers_mj.plants.kernel.laws import MEMORY, laid_out, remember
from ers_mj.plants.kernel.modes import start_mode, start_state
from ers_mj.plants.kernel.state import MODES, PLANT, VECTOR, F, Mode, N, State, is_bounded, plant_in, types
from ers_mj.plants.reduced import ReducedModel


@kernel(types.void(VECTOR, VECTOR, MODES))
def begin(plant, x, m):
    """Fill x (5,) after its first three entries, theta w j, and the mode m (5,) that fits them: both bodies together, a
    bristle bent.
    """
    c = plant_in(plant)
    z = start_state(c, x[0], x[1], x[2], 0.0, 0.0, c.c_2_plus)
    mode = start_mode(c, z)
    for i in range(5):
        x[i], m[i] = z[i], mode[i]


@kernel(types.void(F, F, F, F, VECTOR, N, VECTOR, MODES))
def hold(t, h0, before, now, plant, refine, x, m):
    """Move x (5,) and m (5,) over one sample of length h0 from t; a delay leaves ``before`` at the terminals at first,
    ``now`` afterwards.

    The slow road of event_integrator.simulate, which goes by the same segments. A motion that runs away becomes NaN.
    """
    c = plant_in(plant)
    cuts = cut(c, h0, refine)
    h_max, corner = longest_step(c, cuts, refine), corner_speed(c, cuts, refine)
    z, mode = State(x[0], x[1], x[2], x[3], x[4]), Mode(m[0], m[1], m[2], m[3], m[4])
    start = 0.0
    remember(c, z.theta, z.w, z.j, z.theta_m, z.w_m, h0)
    for i in range(cuts.ends.size):
        drive = c.b * (now if cuts.fresh[i] == 1 else before)
        z, mode, _ = advance(c, t + start, z, mode, drive, c.tau_e, c.a_emf, cuts.ends[i] - start, h_max, corner)
        start = cuts.ends[i]
        if not is_bounded(z):
            z = State(np.nan, np.nan, np.nan, np.nan, np.nan)
            break
    for i in range(5):
        x[i], m[i] = z[i], mode[i]


class SampledReduced:
    """A reduced model under a voltage that is given sample by sample.

    Args:
        model: what runs.
        rate_hz: of the samples.
        start: (theta, omega) at t = 0; the current is what the speed alone leaves (0 at rest).
    """

    def __init__(self, model: ReducedModel, rate_hz: float, start: tuple[float, float]):
        self._model, self._h = model, 1.0 / rate_hz
        self._plant = laid_out(*model._lowered)
        c = self._plant.view(PLANT)[0]
        self._b, self._a_emf, self._tau_e, self._parted = c.b, c.a_emf, c.tau_e, model.has_motor_side
        self._refine = 2 if any(BY_NAME[name].follows_current for name, _ in model.effects) else 1
        self._x, self._mode = np.array([*start, 0.0, 0.0, 0.0]), np.zeros(5, np.int64)
        self._fixed = model.bends and model.has_motor_side
        self._skip = int(c.delay * rate_hz + 1e-9)
        self._sent = [0.0] * (self._skip + 2)  # what the terminals saw last, oldest first
        self._samples = 0
        if self._fixed:
            self._x = np.array([*start, 0.0, 0.0, 0.0, 0.0])
            fixed_steps.begin(self._plant, self._x)
        else:
            begin(self._plant, self._x, self._mode)

    @property
    def state(self) -> np.ndarray:
        """All that tells what comes (n,): motion, mode, laws' memories, what was sent, samples gone by."""
        return np.concatenate([self._x, self._mode, self._memories, self._sent, [self._samples]])

    @state.setter
    def state(self, packed: np.ndarray) -> None:
        ends = np.cumsum([self._x.size, self._mode.size, self._memories.size, len(self._sent)])
        self._x, mode, memories, sent, samples = np.split(np.array(packed, float), ends)
        self._mode = np.rint(mode).astype(np.int64)
        plant = self._plant.view(PLANT)[0]
        plant.laws["constants"][plant.memory_of[: plant.memories].astype(int), MEMORY] = memories
        self._sent, self._samples = sent.tolist(), round(float(samples[0]))

    @property
    def _memories(self) -> np.ndarray:
        plant = self._plant.view(PLANT)[0]
        return plant.laws["constants"][plant.memory_of[: plant.memories].astype(int), MEMORY].copy()

    @property
    def theta(self) -> float:
        """The rudder's angle [rad]."""
        return float(self._x[0])

    @property
    def omega(self) -> float:
        """The rudder's speed [rad/s]."""
        return float(self._x[1])

    def drive(self, v: float) -> float:
        """Drive acceleration n K_t i / J [rad/s^2] with v [V] at the terminals."""
        if self._tau_e > 0:
            return float(self._x[2])
        return float(self._b * v - self._a_emf * self._x[4 if self._parted else 1])

    def hold(self, v: float) -> None:
        """Hold v [V] at the terminals until the next sample."""
        self._sent = [*self._sent[1:], v]
        now = self._samples * self._h
        before, held = self._sent[:2]
        if self._fixed:
            fixed_steps.hold(now, self._h, before, held, self._plant, self._refine, self._x)
        else:
            hold(now, self._h, before, held, self._plant, self._refine, self._x, self._mode)
        self._samples += 1
