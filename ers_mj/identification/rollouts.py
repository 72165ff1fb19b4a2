"""What the MuJoCo plant says of recordings: residuals of many candidate parameters at once, on many cores."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from ers_mj.data.prepared import Trace
from ers_mj.identification.misfit import Simulator
from ers_mj.identification.unknowns import Unknowns
from ers_mj.plants.mujoco.bodies import bodily
from ers_mj.plants.mujoco.plant import TIMESTEP, MechanicalPlant, simulate_many
from ers_mj.plants.reduced import Motion, lumped
from ers_mj.servo.model import observer_gain


def plant_of(
    unknowns: Unknowns, letters: np.ndarray, is_angle: bool = True, timestep: float = TIMESTEP
) -> MechanicalPlant:
    """The MuJoCo plant that letters (k,) make: the rudder system where they are Eq. (1)'s, else one joint."""
    c = lumped(unknowns.values(letters))
    return MechanicalPlant(
        c,
        unknowns.acting(letters),
        parameters=None if unknowns.is_lumped else bodily(unknowns.everything(letters), is_angle, c.b),
        is_angle=is_angle,
        timestep=timestep,
    )


def rollouts(jobs: int, is_angle: bool = True, timestep: float = TIMESTEP) -> Simulator:
    """(unknowns, candidates (M) of letters (k,), traces, rate) -> M residuals (N,) in sigmas, as
    identification.residuals has them.
    """

    def simulate(unknowns, candidates, traces, rate):
        plants = [plant_of(unknowns, letters, is_angle, timestep) for letters in candidates]
        parts: list[list[np.ndarray]] = [[] for _ in candidates]
        for trace in traces:
            for letters, part, motion in zip(candidates, parts, _motions(plants, trace, rate, jobs)):
                part.append(_compared(unknowns, letters, trace, motion))
        return [np.concatenate(part) for part in parts]

    return simulate


def _motions(plants: Sequence[MechanicalPlant], trace: Trace, rate: float, jobs: int) -> list[Motion]:
    if len(plants) > 1 and trace.is_uniform and trace.enable is None and trace.load is None and rate == 0.0:
        return simulate_many(plants, trace.t, trace.u, jobs, start=trace.start)
    gain, every = observer_gain(rate, trace.sample_time, trace.refresh)
    return [
        plant.simulate(
            trace.t,
            trace.u,
            trace.start,
            enable=trace.enable,
            load=trace.load,
            y=trace.y if trace.refresh == 1 else trace.followed,
            gain=gain,
            every=every,
        )
        for plant in plants
    ]


def _compared(unknowns: Unknowns, letters: np.ndarray, trace: Trace, motion: Motion) -> np.ndarray:
    """Residuals (rows,) of one recording in sigmas, 0 where a sample is missing."""
    model = unknowns.model(letters)
    path = np.column_stack([motion.theta, motion.omega, motion.drive, motion.theta_m])
    parts = [np.where(trace.valid, (trace.y - motion.measured) / trace.sigma, 0.0)]
    for channel, seen in zip(trace.channels, model.shown(trace, model.plant(), path)):
        parts.append(np.where(np.isfinite(channel.values), (channel.values - seen) / channel.sigma, 0.0))
    return np.concatenate(parts)
