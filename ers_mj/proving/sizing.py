"""How large a concealed effect shows, in units of the noise: as it stands, and once the effect-free model has been
refitted.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from ers_mj.proving.quick import COARSE, ROUGH, run, simulate

TWO_MASS = {"backlash", "shaft_compliance"}
STIFF = TWO_MASS | {"presliding", "end_stop", "friction_ageing"}
"""What needs the finer of the two steps while sizing."""
ALIKE = (
    {"bias_torque", "asymmetric_friction"},
    {"inductance", "input_delay", "sensor_lag"},
    {"voltage_saturation", "current_limit", "supply_sag"},
    {"cogging", "transmission_ripple"},
    TWO_MASS | {"variable_ratio"},
    {"sensor_quantisation", "sensor_dropout"},
)
"""Effects that a pair does not combine: counted as one, or two that the simulator cannot join."""


def bare(servo, record, u, step):
    """(samples,) noise-free angle [rad] of the effect-free servo under u; open loops know it already."""
    if record["closed_loop"]:
        return simulate(servo["params"], [], record["t"], u, step=step).clean
    if step not in record["bare"]:
        record["bare"][step] = simulate(servo["params"], [], record["t"], u, step=step).clean
    return record["bare"][step]


def sizes(servo, effects, step):
    """([rms of the difference with/without on the same u over sigma] a record, the runs with)."""
    out, runs = [], []
    for number, record in enumerate(servo["records"]):
        with_it = run(servo, record, number, effects, step)
        change = with_it.clean - bare(servo, record, with_it.u, step)
        out.append(float(np.sqrt(np.mean(change**2)) / servo["sensor"]["noise_sigma_eff_rad"]))
        runs.append(with_it)
    return out, runs


def step_for(effects):
    """[s] step that does for sizing these effects."""
    return COARSE if any(effect["label"] in STIFF for effect in effects) else ROUGH


def pooled(servo, per_record):
    """One size of the records' sizes, each record weighing as its length."""
    weights = [record["t"].size for record in servo["records"]]
    return float(np.sqrt(np.average(np.square(per_record), weights=weights)))


# ---- how much stays visible once the effect-free model is refitted
# -----------------------------------------------------

FREE = ("J", "B", "K_e", "k_s", "T_LH", "F_c", "theta_0")
"""What angle and voltage can tell of Eq. (1): R, K_t and the ordinary L are held."""


def moved(params, x):
    """Parameters FREE moved by x: relative, theta_0 in radians."""
    values = {name: float(params[name] * np.exp(v)) for name, v in zip(FREE[:-1], x)}
    return params | values | {"theta_0": params["theta_0"] + x[-1]}


def refit(servo, runs, rounds=5):
    """[rms over sigma] a record that the effect-free Eq. (1) leaves: Levenberg-Marquardt on log parameters, noise-free
    angles.
    """
    sigma = servo["sensor"]["noise_sigma_eff_rad"]

    def residuals(x):
        return [
            (simulate(moved(servo["params"], x), [], r["t"], with_it.u, step=ROUGH).clean - with_it.clean) / sigma
            for r, with_it in zip(servo["records"], runs)
        ]

    return [float(np.sqrt(np.mean(part**2))) for part in levenberg(residuals, len(FREE), rounds)]


@dataclass(frozen=True)
class Refit:
    """How far a refit goes, and over what its slopes are taken: where friction holds and lets go, over wide steps at
    first, since a narrow one sees the fork of one stop and not the way down.
    """

    steps: tuple[float, ...] = (1e-2, 1e-3)  # of a parameter's logarithm
    farthest: float = 1.5
    dampings: int = 4
    enough: float = 1e-3  # share of the sum of squares that a round must gain


REFIT = Refit()


def levenberg(residuals, free, rounds):
    """Residuals (a list of arrays) at the least sum of their squares, begun at zero, by Levenberg-Marquardt over x
    (free,), so many rounds with slopes of each step, and no further with one that gains no more.
    """
    x, parts = np.zeros(free), residuals(np.zeros(free))
    for step in REFIT.steps:
        damping = 1e-3
        for _ in range(rounds):
            flat = np.concatenate(parts)
            columns = [(np.concatenate(residuals(x + step * e)) - flat) / step for e in np.eye(free)]
            x, better, damping = _descended(residuals, x, parts, np.stack(columns, 1), damping)
            gained = np.sum(flat**2) - np.sum(np.concatenate(better) ** 2)
            parts = better
            if gained < REFIT.enough * np.sum(flat**2):
                break
    return parts


def _descended(residuals, x, parts, jac, damping):
    """(x, residuals, damping) after the first of some dampings that gains, or as they were."""
    flat = np.concatenate(parts)
    normal, slope = jac.T @ jac, jac.T @ flat
    for _ in range(REFIT.dampings):
        to = x - np.linalg.solve(normal + damping * np.diag(np.diag(normal) + 1e-9), slope)
        trial = np.clip(to, -REFIT.farthest, REFIT.farthest)
        trial_parts = residuals(trial)
        if np.sum(np.concatenate(trial_parts) ** 2) < np.sum(flat**2):
            return trial, trial_parts, 0.2 * damping
        damping *= 8.0
    return x, parts, damping


class Ruler:
    """Measures effects on one servo by the quick simulator: at once by projection, or by the refit itself."""

    def __init__(self, servo: dict):
        self.servo, self.sigma = servo, servo["sensor"]["noise_sigma_eff_rad"]
        self.ordinary_inductance = servo["params"]["L"]
        self.runs = [run(servo, record, k, [], ROUGH) for k, record in enumerate(servo["records"])]
        columns = []
        for e in np.eye(len(FREE)):
            pairs = [
                [simulate(moved(servo["params"], way * 1e-4 * e), [], r["t"], x.u, step=ROUGH).true for way in (1, -1)]
                for r, x in zip(servo["records"], self.runs)
            ]
            columns.append(np.concatenate([up - down for up, down in pairs]))
        self.basis = np.linalg.qr(np.stack(columns, 1) + 0.0)[0]

    def projected(self, effects: list[dict]) -> float:
        """[sigma] rms of what the effects move, less what small changes of the parameters can imitate."""
        step, moved_by = step_for(effects), []
        for number, record in enumerate(self.servo["records"]):
            with_it = run(self.servo, record, number, effects, step)
            moved_by.append(with_it.clean - bare(self.servo, record, with_it.u, step))
        change = np.concatenate(moved_by)
        return float(np.sqrt(np.mean((change - self.basis @ (self.basis.T @ change)) ** 2)) / self.sigma)

    def refitted(self, effects: list[dict]) -> float:
        """[sigma] rms that the refitted effect-free model leaves."""
        step = step_for(effects)
        return pooled(
            self.servo,
            refit(self.servo, [run(self.servo, r, k, effects, step) for k, r in enumerate(self.servo["records"])], 4),
        )
