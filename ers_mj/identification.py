"""Fit a model's parameters to recordings by simulating them.

The model runs as an observer of low gain, theta_hat' = w_hat + rate (y - theta_hat), so that one late stick event does not become
a lasting offset, while forces stay in open loop. Time is cut into blocks; each block's misfit m_b = SSE_b / (n_b sigma^2) enters
as C = sum_b ln(1 + m_b / tau): a few blocks where stick and slip fork cannot decide everything. C is minimised by
Levenberg-Marquardt with weights 1 / (tau + m_b) over finite differences of the event-exact simulation, which is smooth.
"""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass, replace

import numpy as np

from ers_mj.effects import BY_NAME
from ers_mj.effects.base import Parameter, Scales
from ers_mj.plants.reduced import ReducedModel, lumped
from ers_mj.symptoms import excursions
from ers_mj.traces import Blocks, Trace, parabola_start, start_samples

OBSERVER_RATE = 5.0  # [1/s]
OBSERVER_STEP = 0.005  # [s] between corrections of the observer
DIFFERENCE = 1e-4  # step of the finite differences in transformed parameters
BASE = ("a_1", "a_2", "b", "c_1", "c_2", "theta_0", "tau_e", "emf_share", "ampere")
SIGNED = ("b", "ampere")  # fitted by size, their sign kept
STATE_PRIOR = 0.2  # standard deviation of ln(gain), ln(friction level); a tenth of it, over half the travel, for an offset
POLISHED = 100.0  # median misfit (ten sigma) from which parameters are polished by free-run least squares
SQUARES = 1e4  # tau over the mean misfit at which C is a sum of squares
FLOOR = 1e-4  # gain in C of one step below which a fit stands on its valley's floor
HOP = 30.0  # C by which a hop would raise the cost, were its curvature the same all the way
MOST_HOPS = 3
FAR_HOP = 0.3  # length of the longest hop, in the transformed parameters
SOFT = 3  # directions along which a fit hops, of least curvature
HOP_GAIN = 0.3  # of C that a hop must win to be followed by further ones
ROUGH, QUIET = 3.0, 0.02  # median misfit up to which, and C per block from which, a fit hops
HOPELESS = 0.02  # excess of C per block over a nested model at which a search is given up
NEAR = 0.1  # half travels by which theta_0 or a stop may lie beyond the travel
SMALLEST = 0.5  # a width below this share of the noise cannot be seen, and makes the simulation chatter
FEWEST_CYCLES = 3  # of a frequency within the longest recording: a slower swing bends to any drift
SPIKE = 3.5, 0.9  # times nine tenths of the changes of a model's error: 8 sigma where that is noise
SPIKE_SAMPLES, SPIKE_TIME = 5, 0.005  # length of a spike at most, and [s]
CLOCKED = {"phase": 1.0, "time": 0.1}  # scales [rad, s] of signed parameters whose own size says nothing
STATES = ("gain", "offset", "friction_level")


@dataclass(frozen=True)
class Free:
    """One fitted number: where it lives, how it is transformed and bounded."""

    owner: str
    name: str
    index: int
    positive: bool
    scale: float
    lower: float
    upper: float
    prior: tuple[float, float] | None = None
    local: bool = False

    @property
    def key(self) -> tuple[str, str, int]:
        """What tells this number from every other one, whatever else is fitted."""
        return self.owner, self.name, self.index // 16 if self.local else self.index if self.owner in STATES else 0

    def ends(self, z: float, half: float) -> tuple[float, float]:
        """The interval z -+ half of the transformed number, in the number's own unit."""
        if self.positive:
            return math.exp(min(z - half, 700)), math.exp(min(z + half, 700))
        return (z - half) * self.scale, (z + half) * self.scale


Columns = Mapping[tuple[str, str, int], np.ndarray]  # of a Jacobian, by the key of what is fitted


@dataclass(frozen=True)
class Model:
    """A structure with values: the baseline, the effects on top, and what differs from recording to recording.

    ``values`` holds all of BASE; ``free`` names those that are fitted. ``effects`` are (name, parameters (k,));
    infinite parameters are absent, not fitted. ``states`` maps a record state to its value in each recording, ``local`` an effect to
    its parameters that are ``per_record`` (recordings, k), in rows of NaN where the effect is absent from a recording.
    ``frozen`` names effects that are not fitted, and with ", local" those whose ``local`` is not.
    """

    values: Mapping[str, float]
    free: tuple[str, ...]
    effects: tuple[tuple[str, np.ndarray], ...] = ()
    states: Mapping[str, np.ndarray] | None = None
    scales: Scales | None = None
    priors: Mapping[str, tuple[float, float]] | None = None
    frozen: tuple[str, ...] = ()
    local: Mapping[str, np.ndarray] | None = None

    @property
    def names(self) -> tuple[str, ...]:
        """The effects' names in the order of their addition."""
        return tuple(name for name, _ in self.effects)

    def layout(self) -> list[Free]:
        """Every fitted number."""
        out = []
        held = {name for effect, _ in self.effects for name in BY_NAME[effect].absorbs}
        for name in (n for n in self.free if n not in held):
            positive = name != "theta_0"
            lower, upper = (1e-9, np.inf)
            if name == "theta_0":
                positive, (lower, upper) = False, self._near_travel()
            if name == "emf_share":
                lower, upper = 0.02, 0.999
            if name == "tau_e":
                lower, upper = self._tau_bounds()
            prior = (self.priors or {}).get(name)
            out.append(Free("base", name, 0, positive, self.scales.position, lower, upper, prior))
        for row, (effect_name, values) in enumerate(self.effects):
            if effect_name in self.frozen:
                continue
            for k, parameter in enumerate(BY_NAME[effect_name].parameters):
                if np.isfinite(values[k]) and parameter.fitted and not (parameter.per_record and effect_name in (self.local or {})):
                    out.append(self._of_effect(effect_name, parameter, row * 16 + k, values[k]))
        for effect_name, rows in (self.local or {}).items():
            if f"{effect_name}, local" in self.frozen:
                continue
            for k, parameter in enumerate(p for p in BY_NAME[effect_name].parameters if p.per_record):
                out += [self._of_effect(effect_name, parameter, r * 16 + k, v, True) for r, v in enumerate(rows[:, k]) if np.isfinite(v)]
        for state, per_record in (self.states or {}).items():
            for k in range(1, len(per_record)):
                multiplies = state != "offset"
                prior = (0.0, STATE_PRIOR) if multiplies else (0.0, 0.1 * STATE_PRIOR)
                out.append(Free(state, state, k, multiplies, self.scales.position, 0.2 if multiplies else -np.inf,
                                5.0 if multiplies else np.inf, prior))
        return out

    def _of_effect(self, name: str, parameter: Parameter, index: int, value: float, local: bool = False) -> Free:
        scale = 1.0 if parameter.positive else CLOCKED.get(parameter.kind, max(abs(value), 1e-12))
        most = 1.0 / self.scales.sample_time if parameter.kind == "frequency" else np.inf
        least = {"position": SMALLEST * self.scales.noise, "frequency": FEWEST_CYCLES / self.scales.duration}.get(parameter.kind, 1e-12)
        lower = max(parameter.lower, least) if parameter.positive else parameter.lower
        ends = self._near_travel() if parameter.on_travel else (lower, min(parameter.upper, most))
        return Free(name, parameter.name, index, parameter.positive, scale, *ends, local=local)

    def _near_travel(self) -> tuple[float, float]:
        near = NEAR * self.scales.position
        return self.scales.low - near, self.scales.high + near

    def _tau_bounds(self) -> tuple[float, float]:
        known = self.scales.tau_e_datasheet
        return (0.1 * known, 2.0 * known) if known else (1e-6, 1.0)

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
            return self.states[f.owner][f.index]
        if f.local:
            return self.local[f.owner][f.index // 16, f.index % 16]
        return self.effects[f.index // 16][1][f.index % 16]

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
        """The model with one more effect at ``start``, its per-record parameters alike in every recording that it acts in."""
        effect, start = BY_NAME[name], np.array(start, float)
        local = dict(self.local or {})
        if effect.local:
            rows = np.tile(start[effect.local_columns], (self.scales.recordings, 1))
            if "record" in (names := [p.name for p in effect.parameters]):
                rows[np.arange(len(rows)) != start[names.index("record")]] = np.nan
            local[name] = rows
        return replace(self, effects=(*self.effects, (name, start)), local=local or None)

    def without_effect(self, name: str) -> Model:
        """The model with one effect less."""
        local = {k: v for k, v in (self.local or {}).items() if k != name}
        return replace(self, effects=tuple(e for e in self.effects if e[0] != name), local=local or None)

    def with_state(self, state: str, records: int) -> Model:
        """The model with a record state free in every recording but the first."""
        neutral = np.zeros(records) if state == "offset" else np.ones(records)
        return replace(self, states={**(self.states or {}), state: neutral})

    def plant(self, record: int = 0) -> ReducedModel:
        """The reduced model of one recording (its record state applied)."""
        c = lumped(self.values)
        if self.states:
            gain = self.states["gain"][record] if "gain" in self.states else 1.0
            level = self.states["friction_level"][record] if "friction_level" in self.states else 1.0
            c = c._replace(b=c.b * gain, c_2_plus=c.c_2_plus * level, c_2_minus=c.c_2_minus * level)
        return ReducedModel(c, self.effects_of(record))

    def effects_of(self, record: int | None = None) -> tuple[tuple[str, np.ndarray], ...]:
        """The effects that act in one recording (None: in any), with their values there (in the first where they act)."""
        if not self.local:
            return self.effects
        out = []
        for name, values in self.effects:
            if name in self.local:
                values, columns = values.copy(), BY_NAME[name].local_columns
                rows = self.local[name]
                values[columns] = rows[np.argmin(np.isnan(rows).any(axis=1)) if record is None else record]
                if np.isnan(values[columns]).any():
                    continue
            out.append((name, values))
        return tuple(out)

    def of_records(self, records: Sequence[int]) -> Model:
        """The model for some of its recordings only, without what differs between them (``states``)."""
        local = {name: rows[list(records)] for name, rows in (self.local or {}).items()}
        return replace(self, states=None, local=local or None, scales=replace(self.scales, recordings=len(records)))

    def offset(self, record: int) -> float:
        """Output offset of one recording."""
        return float(self.states["offset"][record]) if self.states and "offset" in self.states else 0.0

    def predict(self, trace: Trace, record: int = 0, rate: float = 0.0, start=None) -> np.ndarray:
        """Simulated output (N,) of a recording: free run, or observer form where ``rate`` [1/s] > 0."""
        plant, run = self._run(trace, record, rate, start)
        return plant.theta(trace.t, trace.u, **run) + self.offset(record)

    def observed(self, trace: Trace, record: int, rate: float) -> list[np.ndarray]:
        """What ``predict`` gives, and behind it what each further channel of the recording would show, (N,) each."""
        plant, run = self._run(trace, record, rate, None)
        theta, motion = plant.outputs(trace.t, trace.u, **run)
        out = [theta + self.offset(record)]
        for channel in trace.channels:
            out.append({"speed": lambda: motion[:, 1], "motor": lambda: motion[:, 3],
                        "current": lambda: plant.current(trace.t, motion) / self.values["ampere"]}[channel.kind]())
        return out

    def first_orders(self, traces: Sequence[Trace], rate: float, name: str, starts: Sequence[np.ndarray]) -> np.ndarray:
        """First-order change of the predicted outputs (len(starts), all residuals; none of the channels) by the law of one more effect, at each of its starts."""
        columns = []
        for k, trace in enumerate(traces):
            plant, run = self._run(trace, k, rate, None)
            path, clock = plant.path(trace.t, trace.u, **run), {key: run[key] for key in ("gain", "every")}
            rest = np.zeros(trace.rows - trace.t.size)
            columns.append([np.concatenate([plant.first_order(trace.t, path, name, start, **clock), rest]) for start in starts])
        return np.concatenate(columns, axis=1)

    def _run(self, trace: Trace, record: int, rate: float, start) -> tuple[ReducedModel, dict]:
        """The plant of a recording, and how it is run along it."""
        every = max(1, round(OBSERVER_STEP / trace.sample_time))
        gain, shift, plant = 1.0 - math.exp(-rate * every * trace.sample_time), self.offset(record), self.plant(record)
        theta, omega = trace.start if start is None else start
        drive = 0.0 if omega == 0 else plant.coefficients.b * trace.u[0] - plant.coefficients.a_emf * omega
        return plant, {"start": (theta - shift, omega, drive), "enable": trace.enable, "load": trace.load,
                       "y": trace.y - shift if gain > 0 else None, "gain": gain, "every": every}


@dataclass(frozen=True)
class Fit:
    """A fitted model: its cost C, block misfits m (B,), and the curvature in transformed parameters (k, k)."""

    model: Model
    cost: float
    misfit: np.ndarray
    hessian: np.ndarray
    simulations: int

    @property
    def size(self) -> int:
        """Number of fitted numbers."""
        return self.hessian.shape[0]


def residuals(model: Model, traces: Sequence[Trace], rate: float) -> np.ndarray:
    """y - y_hat over all traces and their channels, in sigmas of each, 0 where a sample is missing; NaN where the simulation ran away."""
    parts = []
    for k, trace in enumerate(traces):
        theta, *others = model.observed(trace, k, rate)
        parts.append(np.where(trace.valid, (trace.y - theta) / trace.sigma, 0.0))
        for channel, seen in zip(trace.channels, others):
            parts.append(np.where(np.isfinite(channel.values), (channel.values - seen) / channel.sigma, 0.0))
    return np.concatenate(parts)


def score(misfit: np.ndarray, tau: float) -> np.ndarray:
    """Each block's share of the cost C."""
    return np.log((tau + misfit) / (1.0 + tau))


def tau_of(misfit: np.ndarray) -> float:
    """The misfit at which C turns from squares to logarithms: a tenth of the median, never below the noise."""
    return max(1.0, 0.1 * float(np.median(misfit)))


def fit(model: Model, traces: Sequence[Trace], *, rate: float = OBSERVER_RATE, tau: float = 1.0, steps: int = 25,
        ceiling: np.ndarray | None = None, known: Columns | None = None, renewals: float = math.inf) -> Fit:
    """Minimise C over the model's free numbers, from the model's own values.

    ``ceiling`` holds the misfits (B,) of a model that is nested in this one: a search that stands above it after a stage is
    given up, since its start was a bad one. ``known`` are columns of a Jacobian taken near by, with which the search begins; after
    ``renewals`` Jacobians of its own it ends where the last one, updated, leads no further.

    Far from the data the logarithm of C has a local minimum in every block, so the search starts at a ``tau`` near the geometric
    mean of the misfits, where C is nearly a sum of squares, and lowers it to the one that was asked for. (Their plain mean asks
    more of a search that begins near the data: one bad block would send it back to the sum of squares.)
    """
    now, jacobian = math.inf, None
    if known is not None:
        layout = model.layout()
        jacobian = jacobian_of(model, layout, model.vector(layout), residuals(model, traces, rate), traces, rate, known)
    while True:
        misfit = Blocks.of(traces).misfit(residuals(model, traces, rate))
        sound = np.all(np.isfinite(misfit))  # a runaway has one descent to find a motion
        level = float(np.exp(np.mean(np.log(misfit + tau)))) if sound else 0.0
        now = max(tau, min(level, 0.1 * now))
        last = now <= 1.5 * tau
        found, jacobian, renewals = _descend(model, traces, rate, tau if last else now, steps, 0.01 if last else 0.3, jacobian, renewals)
        if last or (ceiling is not None and score(found.misfit, now).sum() > score(ceiling, now).sum() + HOPELESS * ceiling.size):
            return found
        model = found.model


def converged(found: Fit, rival: Fit, traces: Sequence[Trace], tau: float) -> Fit:
    """The fit carried on to its valley's floor, from its own values and from the baseline values of a rival.

    Where stick and slip fork, the cost has dents of about one block's cost, in which a single descent may rest.
    """
    starts = found.model, replace(found.model, values=rival.model.values)
    ends = [descend(model, traces, OBSERVER_RATE, tau, 40, FLOOR) for model in starts]
    return min(ends, key=lambda f: f.cost)


def hopped(found: Fit, traces: Sequence[Trace], tau: float, jobs: int, *, restart: bool = False) -> tuple[Fit, Sequence[Trace]]:
    """The fit after hops along its softest directions, as long as they pay, and the traces it belongs to.

    One start leads into one dent of many (see ``converged``). A hop goes as far as the fit's own curvature prices at HOP, and
    descends from there; ``restart`` fits the initial states again, which a wrong model has bent. Only near the noise are dents what
    keeps a fit from its floor: beyond ROUGH the model itself is wrong, below QUIET nothing is left to win.
    """
    def land(start):
        begun = with_starts(start, traces) if restart else traces
        return descend(start, begun, OBSERVER_RATE, tau, 12, 0.03), begun

    for _ in range(MOST_HOPS):
        if not near_noise(found) or float(np.mean(score(found.misfit, tau))) < QUIET:
            break
        layout = found.model.layout()
        z, (curvature, directions) = found.model.vector(layout), np.linalg.eigh(found.hessian)
        hops = [min(math.sqrt(2 * HOP / max(c, 1e-9)), FAR_HOP) * d for c, d in zip(curvature[:SOFT], directions.T)]
        with ThreadPoolExecutor(jobs) as pool:
            ends = list(pool.map(land, [found.model.at(layout, z + way * hop) for hop in hops for way in (-1, 1)]))
        best, begun = min(ends, key=lambda end: end[0].cost)
        if not best.cost < found.cost - HOP_GAIN:
            break
        found, traces = best, begun
    return found, traces


def near_noise(found: Fit) -> bool:
    """Whether half the blocks are explained to about their noise (ROUGH), so that details may be told."""
    return float(np.median(found.misfit)) <= ROUGH


def polished(found: Fit, traces: Sequence[Trace]) -> Fit:
    """The fit carried on in free run by plain least squares, where model error and not noise decides (see POLISHED).

    The free run has more than one valley, so it is reached directly and by way of slower observers; the lower one counts.
    """
    if float(np.median(found.misfit)) < POLISHED:
        return found
    ends = []
    for rates in ((0.0,), (1.0, 0.0), (2.0, 0.5, 0.0)):
        model = found.model
        for rate in rates:
            level = float(np.mean(Blocks.of(traces).misfit(residuals(model, traces, rate))))
            if np.isfinite(level):
                best = descend(model, traces, rate, SQUARES * level, 40, 1e-7 * found.misfit.size / SQUARES)
                model = best.model
        ends.append((float(np.sum(residuals(model, traces, 0.0) ** 2)), model))
    ends = [e for e in ends if np.isfinite(e[0])]
    return replace(found, model=min(ends, key=lambda e: e[0])[1]) if ends else found


def descend(model: Model, traces: Sequence[Trace], rate: float, tau: float, steps: int, tolerance: float) -> Fit:
    """Levenberg-Marquardt on C at one ``tau``, until a step along a fresh Jacobian gains less than ``tolerance``."""
    return _descend(model, traces, rate, tau, steps, tolerance, None, math.inf)[0]


def _descend(model: Model, traces: Sequence[Trace], rate: float, tau: float, steps: int, tolerance: float, jacobian: np.ndarray | None,
             renewals: float) -> tuple[Fit, np.ndarray | None, float]:
    """See ``descend``: the fit, the Jacobian that it ended with, and how many it may still take.

    Between fresh Jacobians Broyden's update serves as long as the decrease keeps a third of what it promised.
    """
    layout, blocks = model.layout(), Blocks.of(traces)
    z = model.vector(layout)
    damping, calls, fresh = 1e-3, 1, False

    def evaluate(z):
        e = residuals(model.at(layout, z), traces, rate)
        if not np.all(np.isfinite(e)):
            return e, None, np.inf
        m = blocks.misfit(e)
        return e, m, float(score(m, tau).sum()) + _prior_cost(layout, z)

    e, m, cost = evaluate(z)
    if m is None:
        e, m = np.full(blocks.index.size, 1e6), np.full(blocks.counts.size, 1e12)
    hessian = np.eye(z.size)
    for _ in range(steps):
        if jacobian is None:
            if renewals <= 0:
                break
            jacobian, fresh = jacobian_of(model, layout, z, e, traces, rate), True
            calls, renewals = calls + z.size, renewals - 1
        weight = (2.0 / ((tau + m) * blocks.counts))[blocks.index]
        weighted = jacobian * weight[:, None]
        hessian, slope = weighted.T @ jacobian, weighted.T @ e
        _add_prior(layout, z, hessian, slope)
        step = None
        for _ in range(6 if fresh else 2):
            scale = np.diag(hessian) + 1e-9 * np.trace(hessian) / z.size + 1e-12
            step = np.clip(-np.linalg.solve(hessian + damping * np.diag(scale), slope), -1.0, 1.0)
            goal = model.at(layout, z + step).vector(layout)
            trial = evaluate(goal)
            calls += 1
            if trial[2] < cost:
                break
            damping = max(damping * 8, 1e-6)
            step = None
        if step is None:
            if fresh:
                break
            jacobian = None
            continue
        moved, gain, was_fresh = goal - z, cost - trial[2], fresh
        promised = -(slope @ moved + 0.5 * moved @ hessian @ moved)
        if gain > 0.3 * promised and moved @ moved > 0:
            jacobian, fresh = jacobian + np.outer(trial[0] - e - jacobian @ moved, moved / (moved @ moved)), False
        else:
            jacobian = None
        z, (e, m, cost) = goal, trial
        damping = max(damping / 8, 1e-9)
        if gain < tolerance:
            if was_fresh or renewals <= 0:
                break
            jacobian = None
    return Fit(model.at(layout, z), cost, m, hessian, calls), jacobian, renewals


def jacobian_of(model, layout, z, e, traces, rate, known: Columns | None = None):
    """Finite differences of the residuals e (N,) by the fitted numbers, but for the ``known`` ones: (N, k)."""
    jacobian = np.empty((e.size, z.size))
    for k in range(z.size):
        if known and layout[k].key in known:
            jacobian[:, k] = known[layout[k].key]
            continue
        shifted = z.copy()
        shifted[k] += DIFFERENCE
        jacobian[:, k] = (residuals(model.at(layout, shifted), traces, rate) - e) / DIFFERENCE
    jacobian[~np.isfinite(jacobian)] = 0.0
    return jacobian


def without_spikes(model: Model, traces: Sequence[Trace]) -> list[Trace]:
    """The traces without the spikes that stand out of the model's error: within SPIKE_TIME a rudder's own error is smooth, however wrong
    the model is."""
    out = []
    for k, trace in enumerate(traces):
        e = np.where(trace.valid, (trace.y - model.predict(trace, k, OBSERVER_RATE)) / trace.sigma, np.nan)
        longest = min(SPIKE_SAMPLES, int(SPIKE_TIME / trace.sample_time + 1e-6))
        out.append(trace.without(excursions(e, 1.0, *SPIKE, longest)) if longest and np.isfinite(e[trace.valid]).all() else trace)
    return out


def with_starts(model: Model, traces: Sequence[Trace]) -> list[Trace]:
    """The traces with their initial states fitted by the model on the first 50 ms or 10 samples of each."""
    return [replace(trace, start=fitted_start(model, trace, k)) for k, trace in enumerate(traces)]


def fitted_start(model: Model, trace: Trace, record: int = 0) -> tuple[float, float]:
    """(output, speed) at the first sample by least squares of a free run on the first 50 ms or 10 samples.

    The search begins at rest and at a parabola's speed; rest is kept unless a speed buys more than 9 sigma^2.
    """
    n = start_samples(trace.t)
    head = trace.part(0, n)

    def misses(x):
        e = np.where(head.valid, head.y - model.predict(head, record, start=x), 0.0) / trace.sigma
        return e if np.all(np.isfinite(e)) else np.full(n, 1e9)

    def settle(x, moving):
        step = np.array([0.1 * trace.sigma, trace.sigma / (trace.t[n - 1] - trace.t[0])])[:1 + moving]
        e = misses(x)
        for _ in range(6):
            j = np.column_stack([(misses(x + np.eye(2)[k] * step[k]) - e) / step[k] for k in range(1 + moving)])
            move = np.zeros(2)
            move[:1 + moving] = -np.linalg.lstsq(j, e, rcond=1e-9)[0]
            trial = misses(x + move)
            if not trial @ trial < e @ e:
                break
            x, e = x + move, trial
        return float(e @ e), x

    first = float(np.mean(head.y[head.valid][:3])) if head.valid.any() else trace.start[0]
    at_rest = settle(np.array([first, 0.0]), 0)
    moving = min((settle(np.array(s, float), 1) for s in (trace.start, parabola_start(head.t, head.y))), key=lambda f: f[0])
    cost, x = at_rest if at_rest[0] <= moving[0] + 9.0 else moving
    return float(x[0]), float(x[1])


def _prior_cost(layout, z):
    return sum(0.5 * ((q - f.prior[0]) / f.prior[1]) ** 2 for f, q in zip(layout, z) if f.prior)


def _add_prior(layout, z, hessian, slope):
    for k, f in enumerate(layout):
        if f.prior:
            hessian[k, k] += 1.0 / f.prior[1] ** 2
            slope[k] += (z[k] - f.prior[0]) / f.prior[1] ** 2
