"""A structure with values: what is fitted of it, how that is bounded, and what it predicts of a recording."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace
from functools import cached_property

import numpy as np

from ers_mj.data.prepared import Trace
from ers_mj.effects import BY_NAME
from ers_mj.effects.quantities import Scales
from ers_mj.plants.effort import Effort
from ers_mj.plants.reduced import ReducedModel, lumped
from ers_mj.servo.free import DRIFTS as DRIFTS
from ers_mj.servo.free import LOADS as LOADS
from ers_mj.servo.free import MOST_TAU as MOST_TAU
from ers_mj.servo.free import STATES, Free, of_base, of_effects, of_recordings, of_states

OBSERVER_RATE = 5.0  # [1/s]
OBSERVER_STEP = 0.005  # [s] between corrections of the observer
BASE = ("a_1", "a_2", "b", "c_1", "c_2", "theta_0", "tau_e", "emf_share", "ampere")
SIGNED = ("b", "ampere")  # fitted by size, their sign kept
PER_INERTIA = ("a_1", "a_2", "b", "c_1", "c_2")  # what falls as the inertia grows
TORQUES = ("torque", "damping", "stiffness", "drag", "cubic")  # kinds of an effect's numbers that do


def observer_gain(rate: float, sample_time: float, refresh: int = 1) -> tuple[float, int]:
    """(gain, every) of the observer that follows a measurement at this rate [1/s]: one sample in ``every`` is followed
    by the share ``gain``, of those that a sensor which is refreshed more slowly saw.
    """
    every = refresh * max(1, round(OBSERVER_STEP / (refresh * sample_time)))
    return 1.0 - math.exp(-rate * every * sample_time), every


Columns = Mapping[tuple[str, str, int], np.ndarray]  # of a Jacobian, by the key of what is fitted


@dataclass(frozen=True, eq=False)
class Course:
    """One run of a plant: the motion (N, 4) at times t (N,), its ``ampere`` [output unit/s^2 per A], and the ``scale``
    at which first-order changes are told.
    """

    plant: ReducedModel
    t: np.ndarray
    motion: np.ndarray
    scale: float
    ampere: float

    def change(self, kind: str, shown: np.ndarray, its: ReducedModel, ampere: float, move: np.ndarray) -> np.ndarray:
        """First-order change (N,), times the scale, of what a further channel shows of one body, from ``shown`` (N,)
        here towards another plant and its ``ampere``, to which the motion changes by ``move``.
        """
        if kind != "current":
            return move[:, 1 if kind == "speed" else 0]
        path, scale, here, there = self.motion, self.scale, self.ampere, ampere
        if self.plant.draws_drive and its.draws_drive:
            return (
                move[:, 2] / there + path[:, 2] * (scale / there - scale / here) if here != there else move[:, 2] / here
            )
        beside = np.column_stack([path[:, :3] + move[:, :3] / scale, path[:, 3] + move[:, 0] / scale])
        return (its.current(self.t, beside) / there - shown) * scale


@dataclass(frozen=True)
class Model:
    """A structure with values: the baseline, the effects on top, and what differs from recording to recording.

    ``values`` holds all of BASE; ``free`` names those that are fitted. ``effects`` are (name, parameters (k,));
    infinite parameters are absent, not fitted. ``states`` maps a record state to its value in each recording, ``local``
    an effect to its parameters that are ``per_record`` (recordings, k), in rows of NaN where the effect is absent from
    a recording. ``frozen`` names effects that are not fitted, and with ", local" those whose ``local`` is not.
    ``effort`` counts what is simulated with this model and those made of it.
    """

    values: Mapping[str, float]
    free: tuple[str, ...]
    effects: tuple[tuple[str, np.ndarray], ...] = ()
    states: Mapping[str, np.ndarray] | None = None
    scales: Scales = None  # type: ignore[assignment]  # a model that is only simulated has none
    priors: Mapping[str, tuple[float, float]] | None = None
    frozen: tuple[str, ...] = ()
    local: Mapping[str, np.ndarray] | None = None
    effort: Effort | None = field(default=None, repr=False, compare=False)

    @property
    def names(self) -> tuple[str, ...]:
        """The effects' names in the order of their addition."""
        return tuple(name for name, _ in self.effects)

    def layout(self) -> list[Free]:
        """Every fitted number."""
        held = {name for effect, _ in self.effects for name in BY_NAME[effect].absorbs}
        local = self.local or {}
        return [
            *of_base([n for n in (*self.free, *self._parted) if n not in held], self.priors or {}, self.scales),
            *of_effects(self.effects, self.frozen, local, self.scales),
            *of_recordings(local, self.frozen, self.scales),
            *of_states(self.states or {}, self.scales),
        ]

    @property
    def _parted(self) -> tuple[str, ...]:
        """The back-EMF's share of the damping where it is known to be about its prior, and an effect tells it."""
        asked = any(BY_NAME[name].parts_damping for name, _ in self.effects if name not in self.frozen)
        unknown = "emf_share" in (self.priors or {}) and "emf_share" not in self.free
        return ("emf_share",) if asked and unknown else ()

    def vector(self, layout: Sequence[Free]) -> np.ndarray:
        """The fitted numbers, transformed (logarithm of positive ones, others over their scale)."""
        z = np.empty(len(layout))
        for i, f in enumerate(layout):
            v = self._get(f)
            z[i] = math.log(max(abs(v), 1e-300)) if f.positive else v / f.scale
        return z

    def _get(self, f: Free) -> float:
        if f.owner == "base":
            return self.values[f.name]
        if f.owner in STATES:
            return (self.states or {})[f.owner][f.index]
        if f.local:
            return (self.local or {})[f.owner][f.index // 16, f.index % 16]
        return self.effects[f.index // 16][1][f.index % 16]

    def at_bound(self, f: Free) -> bool:
        """Whether a fitted number rests at one of its bounds."""
        return any(
            math.isclose(abs(self._get(f)) if f.positive else self._get(f), bound, rel_tol=1e-3)
            for bound in (f.lower, f.upper)
        )

    def at(self, layout: Sequence[Free], z: np.ndarray) -> Model:
        """The model with the fitted numbers of z, held within their bounds."""
        values, effects = dict(self.values), [(n, v.copy()) for n, v in self.effects]
        states, local = ({k: v.copy() for k, v in (some or {}).items()} for some in (self.states, self.local))
        for f, q in zip(layout, z):
            v = math.exp(min(q, 60.0)) if f.positive else q * f.scale
            v = min(max(v, f.lower), f.upper)
            if f.owner == "base":
                values[f.name] = math.copysign(v, self.values[f.name]) if f.name in SIGNED else v
            elif f.owner in STATES:
                states[f.owner][f.index] = v
            elif f.local:
                local[f.owner][f.index // 16, f.index % 16] = v
            else:
                effects[f.index // 16][1][f.index % 16] = v
        return replace(self, values=values, effects=tuple(effects), states=states or None, local=local or None)

    def with_effect(self, name: str, start: np.ndarray) -> Model:
        """The model with one more effect at ``start``, its per-record parameters alike in every recording that it acts
        in.
        """
        effect, start = BY_NAME[name], np.array(start, float)
        local = dict(self.local or {})
        if effect.local:
            rows = np.tile(start[effect.local_columns], (self.scales.recordings, 1))
            if "record" in (names := [p.name for p in effect.parameters]):
                rows[np.arange(len(rows)) != start[names.index("record")]] = np.nan
            local[name] = rows
        return replace(self, effects=(*self.effects, (name, start)), local=local or None)

    def with_form(self, name: str, start: np.ndarray) -> Model:
        """The model with one of its effects at ``start``, another form of it; what a wave's phase is in each recording
        stays.
        """
        model = self.without_effect(name).with_effect(name, start)
        if BY_NAME[name].wave is None or not BY_NAME[name].local:
            return model
        return replace(model, local={**(model.local or {}), name: (self.local or {})[name].copy()})

    def without_effect(self, name: str) -> Model:
        """The model with one effect less."""
        local = {k: v for k, v in (self.local or {}).items() if k != name}
        return replace(self, effects=tuple(e for e in self.effects if e[0] != name), local=local or None)

    def with_state(self, state: str, records: int) -> Model:
        """The model with a record state free in every recording but the first."""
        neutral = np.zeros(records) if state == "offset" else np.ones(records)
        return replace(self, states={**(self.states or {}), state: neutral})

    def with_effort(self, most: float) -> Model:
        """The model whose simulations are a part of this one's, which may take ``most`` [us]."""
        return replace(self, effort=Effort(self.effort, most))

    @property
    def dead_time(self) -> float:
        """By how much the command reaches the motor late [s]."""
        return sum((BY_NAME[name].dead_time(values) for name, values in self.effects), 0.0)

    def plant(self, record: int = 0, supply: np.ndarray | None = None) -> ReducedModel:
        """The reduced model of one recording (its record state applied), with the supply (N,) that was measured
        there.
        """
        if supply is None and not self.states and not self.local:
            return self._anywhere
        c = lumped(self._under_load(record))
        if self.states:
            gain, level = self._state("gain", record), self._state("friction_level", record)
            c = c._replace(b=c.b * gain, c_2_plus=c.c_2_plus * level, c_2_minus=c.c_2_minus * level)
        return ReducedModel(c, self.effects_of(record), supply, self.effort)

    def _state(self, name: str, record: int) -> float:
        """A factor of one recording, 1 where there is none."""
        return float(self.states[name][record]) if self.states and name in self.states else 1.0

    def _under_load(self, record: int) -> Mapping[str, float]:
        """The baseline's values under the load of one recording: what does not grow with the inertia moves it less."""
        load = self._state("load", record)
        return self.values if load == 1.0 else {k: v / load if k in PER_INERTIA else v for k, v in self.values.items()}

    def _loaded(self, record: int, name: str, values: np.ndarray) -> np.ndarray:
        """An effect's values under the load of one recording: gravity grows with it and by its own ``weight``, every
        other torque moves the inertia less.
        """
        effect = BY_NAME[name]
        if effect.holds_place:
            return values * self._state("weight", record)
        scaled = [p.kind in TORQUES for p in effect.parameters]
        return np.where(scaled, values / self._state("load", record), values)

    @cached_property
    def _anywhere(self) -> ReducedModel:
        """The plant without what differs between recordings; made once, since a fit asks for it in each of them."""
        return ReducedModel(lumped(self.values), self.effects, effort=self.effort)

    def effects_of(self, record: int | None = None) -> tuple[tuple[str, np.ndarray], ...]:
        """The effects that act in one recording (None: in any), with their values there (in the first where they
        act).
        """
        loaded = any(name in (self.states or {}) for name in LOADS)
        if not self.local and (record is None or not loaded):
            return self.effects
        out = []
        for name, values in self.effects:
            if loaded and record is not None:
                values = self._loaded(record, name, values)
            if name in (self.local or {}):
                values, columns = values.copy(), BY_NAME[name].local_columns
                rows = (self.local or {})[name]
                values[columns] = rows[np.argmin(np.isnan(rows).any(axis=1)) if record is None else record]
                if np.isnan(values[columns]).any():
                    continue
            out.append((name, values))
        return tuple(out)

    def of_records(self, records: Sequence[int]) -> Model:
        """The model for some of its recordings only, without what differs between them (``states``) but their loads."""
        local = {name: rows[list(records)] for name, rows in (self.local or {}).items()}
        loads = {name: rows[list(records)] for name, rows in (self.states or {}).items() if name in LOADS}
        scales = replace(self.scales, recordings=len(records))
        return replace(self, states=loads or None, local=local or None, scales=scales)

    def offset(self, record: int) -> float:
        """Output offset of one recording."""
        return float(self.states["offset"][record]) if self.states and "offset" in self.states else 0.0

    def predict(self, trace: Trace, record: int = 0, rate: float = 0.0, start=None) -> np.ndarray:
        """Simulated output (N,) of a recording: free run, or observer form where ``rate`` [1/s] > 0."""
        plant, run = self.staged(trace, record, rate, start)
        return plant.theta(trace.t, trace.u, **run) + self.offset(record)

    def observed(self, trace: Trace, record: int, rate: float) -> tuple[list[np.ndarray], np.ndarray, int]:
        """What ``predict`` gives, and behind it what each further channel of the recording would show, (N,) each; the
        motion (N, 4); what its events took beyond the usual [us].
        """
        plant, run = self.staged(trace, record, rate, None)
        theta, motion, beyond = plant.priced(trace.t, trace.u, **run)
        return [theta + self.offset(record), *self.shown(trace, plant, motion)], motion, beyond

    def shown(self, trace: Trace, plant: ReducedModel, motion: np.ndarray) -> list[np.ndarray]:
        """What each further channel of a recording would show (N,) along a motion (N, 4)."""
        reading = {
            "speed": lambda: motion[:, 1],
            "motor": lambda: motion[:, 3],
            "current": lambda: plant.current(trace.t, motion) / self.values["ampere"],
        }
        return [reading[channel.kind]() for channel in trace.channels]

    @property
    def has_tangents(self) -> bool:
        """Whether ``changes`` can tell the first-order changes of this model's outputs."""
        return self._anywhere.has_tangents

    def changes(
        self, traces: Sequence[Trace], rate: float, others: Sequence[Model], scale: float, motions: Sequence[np.ndarray]
    ) -> np.ndarray:
        """First-order changes (rows of all traces, others) of the predicted outputs, in sigmas, 0 where a sample is
        missing.

        They point from this model towards each other one, times ``scale`` (see ReducedModel.tangents), along the
        ``motions`` (N, 4) that ``observed`` made of it.
        """
        changes, ends = (
            np.empty((len(others), sum(trace.rows for trace in traces))),
            np.cumsum([0, *(trace.rows for trace in traces)]),
        )
        for k, trace in enumerate(traces):
            plant, run = self.staged(trace, k, rate, None)
            path, clock = motions[k], {key: v for key, v in run.items() if key != "start"}
            plants = [other.plant(k, trace.supply) for other in others]
            moved = plant.tangents(trace.t, trace.u, path, plants, scale, **clock)
            here = self.shown(trace, plant, path)
            course = Course(plant, trace.t, path, scale, self.values["ampere"])
            slope = trace.converter and trace.converter.slope(
                trace.y - plant.read(trace.t, path[:, 0]) - self.offset(k)
            )
            for other, its, move, row in zip(others, plants, moved, changes[:, ends[k] : ends[k + 1]]):
                read, *beside = row.reshape(-1, trace.t.size)
                np.divide(move[:, 3] + (other.offset(k) - self.offset(k)) * scale, trace.sigma, out=read)
                if slope is not None:
                    read *= slope
                for channel, shown, out in zip(trace.channels, here, beside):
                    change = course.change(channel.kind, shown, its, other.values["ampere"], move)
                    np.divide(change, channel.sigma, out=out)
                row[trace.unseen] = 0.0
        return changes.T

    def staged(self, trace: Trace, record: int, rate: float, start) -> tuple[ReducedModel, dict]:
        """The plant of a recording, and how it is run along it; ``start`` is the (reading, speed[, twist, its speed])
        it begins with, the trace's own if None. A servo that begins at rest is twisted as its load has left it.
        """
        (gain, every), shift, plant = (
            observer_gain(rate, trace.sample_time, trace.refresh),
            self.offset(record),
            self.plant(record, trace.supply),
        )
        theta, omega, *twisted = trace.start if start is None else start
        theta = plant.behind(theta - shift)
        drive = 0.0 if omega == 0 else plant.coefficients.b * trace.u[0] - plant.coefficients.a_emf * omega
        if omega == 0 and not twisted:
            twisted = [plant.resting_twist(trace.t[0], theta), 0.0]
        return plant, {
            "start": (theta, omega, drive, *twisted),
            "enable": trace.enable,
            "load": trace.load,
            "y": trace.followed - shift if gain > 0 else None,
            "gain": gain,
            "every": every,
        }
