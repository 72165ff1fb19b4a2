"""One case of a family that the package's own integrator of the proof records (the rudder's are MuJoCo's, see
`case`): a servo is drawn, something is concealed in it, it is recorded; what is handed out, and the truth.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from ers_mj.proving.bench import Bench, recorded
from ers_mj.proving.concealed.loop import speed_limit
from ers_mj.proving.families.base import RUDDER_INERTIA, RUDDER_SUPPLY, Family, Servo, lumped, top_speed
from ers_mj.proving.faults import draw_faults, with_faults
from ers_mj.proving.forms import draw_either
from ers_mj.proving.plans import Plan
from ers_mj.proving.sampling import Run
from ers_mj.proving.sheets import draw_sheet, sheet_text
from ers_mj.proving.strength import VISIBILITY, clutter, conceal

LATE = ("inductance", "input_delay", "sensor_lag")  # what a winding's own time constant is told as
REFERENCES = 0.3  # share of the cases whose recorder's reference is logged, too


@dataclass(frozen=True)
class Made:
    """A case as it was recorded: what is concealed on purpose, what is too faint to count, the recordings, what the
    refitted model leaves of each [sigma], what may be named beside, the faults and the kind of datasheet.
    """

    servo: Servo
    concealed: list[dict]
    faint: list[dict]
    runs: list[Run]
    left: list[float]
    pooled: float
    inherent: list[str]
    faults: list[dict]
    sheet: str


def make(family: Family, plan: Plan, seed: list[int]) -> tuple[dict[str, str], dict]:
    """({file name: text} that is handed out, the truth) of one case; `seed` alone draws it."""
    rng = np.random.default_rng(seed)
    made = _made(family, plan, rng)
    return files_of(rng, made.servo, made.runs, made.faults, made.sheet), _truth(plan, seed, made)


def _made(family: Family, plan: Plan, rng: np.random.Generator) -> Made:
    servo = family.draw(rng, plan.labels)
    bench = Bench(servo)
    context = context_of(bench)
    concealed = [conceal(rng, bench, name, context, draw_either, VISIBILITY.wider) for name in plan.labels]
    faint = clutter(rng, bench, list(plan.labels), context, family.effects)
    runs = recorded(servo, [*concealed, *faint])
    left = bench.refit(runs, 8)
    inherent = [*servo.inherent_names, *_winding(bench, plan.labels)]
    unit, shift = servo.units.angle, servo.shift
    low, high = (float(f([f(run.true) for run in runs])) * unit + shift for f in (np.min, np.max))
    speed = max(float(np.sqrt(np.mean(run.omega**2))) for run in runs)
    jitter = 0.3 * bench.sigma / max(speed, 1e-9) * servo.units.time
    faults = draw_faults(rng, servo.columns, jitter, (low, high), servo.turns)
    sheet = "none" if servo.closed else draw_sheet(rng)
    return Made(servo, concealed, faint, runs, left, bench.pooled(left), inherent, faults, sheet)


def context_of(bench: Bench) -> dict:
    """What the shapes of effects are drawn by, own units."""
    servo, runs = bench.servo, bench.runs
    angles = np.concatenate([run.true for run in runs]) - servo.params["theta_0"]
    return {
        "params": servo.params,
        "travel": (float(angles.min()), float(angles.max())),
        "records": len(runs),
        "peak_V": float(max(np.abs(run.u).max() for run in runs)),
        "umax_V": RUDDER_SUPPLY,
        "peak_A": float(max(np.abs(run.i_A).max() for run in runs)),
        "durations": [float(record.t[-1]) for record in servo.records],
        "stiffness": servo.params["J"] / RUDDER_INERTIA,
        "turns": 2.5,
        "top_rad_s": top_speed(servo.params) if servo.closed else None,
    }


def _winding(bench: Bench, labels: tuple[str, ...]) -> tuple[str, ...]:
    """The names of an ordinary winding whose time constant shows as much as the faintest that is concealed."""
    if bench.servo.closed or not bench.ordinary_inductance or set(LATE) & set(labels):
        return ()
    twice = {"label": "inductance", "strength": 2.0 * bench.ordinary_inductance, "shape": {}}
    return LATE if bench.projected([twice]) > VISIBILITY.least else ()


# -- files -----------------------------------------------------------------------------------------------------------


def files_of(
    rng: np.random.Generator, servo: Servo, runs: Sequence[Run], faults: list[dict], sheet: str
) -> dict[str, str]:
    """{file name: text} of these recordings with their faults, and of the datasheet of that kind."""
    refers = not servo.closed and rng.random() < REFERENCES and "wrap" not in [f["kind"] for f in faults]
    files = {}
    for k, run in enumerate(runs):
        table = with_faults(_table(rng, servo, k, run, refers), faults, k, servo.columns)
        files[f"rec{k + 1}.csv"] = _csv(table, servo)
    text = sheet_text(rng, sheet, *_known(servo), rate_hz=servo.sensor["sample_rate_hz"])
    return files if text is None else {"datasheet.toml": text, **files}


def _known(servo: Servo) -> tuple[str, dict[str, float]]:
    """(table, numbers) of a whole datasheet: Table 1's letters where a voltage drives, else Eq. (6)'s."""
    if servo.columns["input"] == "u_V":
        return "parameters", {name: x for name, x in servo.real.items() if name != "L"}
    return "lumped", real_lumped(servo)


def real_lumped(servo: Servo) -> dict[str, float]:
    """Eq. (6)'s coefficients, output unit/s^2 and per unit of the logged input."""
    out = lumped(servo.real, torque=servo.columns["input"] == "tau_cmd_Nm")
    return out | {"b": out["b"] / servo.input_scale}


def _table(rng: np.random.Generator, servo: Servo, k: int, run: Run, refers: bool) -> dict[str, np.ndarray]:
    """Columns of recording k, real units."""
    record, units, sensor = servo.records[k], servo.units, servo.sensor
    logged = slice(record.lead, None, servo.stride)
    t = (record.t[logged] - record.t[record.lead]) * units.time
    output = run.theta[logged] * units.angle + servo.shift
    if servo.closed:
        told = record.told * units.angle + servo.shift
        constants = {name: np.full(t.size, x) for name, x in record.constants.items()}
        return {"t_s": t, servo.columns["input"]: told, servo.columns["output"]: output} | constants
    table = {"t_s": t, servo.columns["input"]: run.u * units.volt * servo.input_scale, servo.columns["output"]: output}
    if sensor["has_current"]:
        table["i_A"] = (run.i_A + sensor["current_sigma_A"] * rng.standard_normal(t.size)) * units.amp
    if refers:
        name = "x_ref_m" if servo.columns["output"] == "x_m" else "theta_ref_rad"
        table[name] = record.ref * units.angle + servo.shift
    return table


def _csv(table: dict[str, np.ndarray], servo: Servo) -> str:
    """Text of the table: the output to a tenth of its noise, blank cells for NaN."""
    fine = max(int(np.ceil(-np.log10(servo.sensor["noise_sigma_eff_rad"] * servo.units.angle))) + 1, 1)
    forms = {"t_s": "%.6f", servo.columns["output"]: f"%.{fine}f"}
    columns = [[_cell(forms.get(name, "%.6g"), x) for x in values.tolist()] for name, values in table.items()]
    return "\n".join([",".join(table), *map(",".join, zip(*columns)), ""])


def _cell(form: str, x: float) -> str:
    return "" if x != x else form % x


# -- the truth -------------------------------------------------------------------------------------------------------


def _truth(plan: Plan, seed: list[int], made: Made) -> dict:
    servo, unit = made.servo, made.servo.units
    angles = ("noise_sigma_rad", "noise_sigma_eff_rad", "adc_step_rad")
    sensor = {name: x * unit.angle if name in angles else x for name, x in servo.sensor.items()}
    records = [
        {
            "kind": record.kind,
            "closed_loop": True,
            "duration_s": float(record.t[-1] - record.t[record.lead]) * unit.time,
            "travel": [float(f(run.true)) * unit.angle + servo.shift for f in (np.min, np.max)],
            **record.constants,
        }
        for record, run in zip(servo.records, made.runs)
    ]
    return {
        "case": f"case-{plan.index + 1:03d}",
        "family": servo.family,
        "kind": plan.kind,
        "labels": list(plan.labels),
        "inherent": made.inherent,
        "effects": made.concealed,
        "clutter": made.faint,
        "faults": made.faults,
        "sheet": made.sheet,
        "linkage": "constant",
        "visibility_after_refit_sigma": made.pooled,
        "visibility_per_record": made.left,
        "true_parameters": servo.real,
        "lumped": loop_of(servo) if servo.closed else real_lumped(servo),
        "units": vars(unit),
        "always": servo.records[0].inherent,
        "controller": servo.records[0].controller,
        "shift": servo.shift,
        **sensor,
        "records": records,
        "seed": seed,
    }


def loop_of(servo: Servo) -> dict[str, float]:
    """K [1/s^2], D [1/s], L and c_2 [rad/s^2], a_2 [1/s], tau_s [s] and R [rad/s] of a servo that is told a position,
    at the gain and load of its first recording.
    """
    record, a = servo.records[0], servo.units.angle
    coefficients, gains = lumped(record.params), record.controller
    b = coefficients["b"]
    out = {
        "K": gains["KP"] * b,
        "D": gains["KD"] * b,
        "I": gains["KI"] * b,
        "L": gains["UMAX"] * b * a,
        "a_2": coefficients["a_2"],
        "c_2": coefficients["c_2"] * a,
        "tau_s": servo.latency,
    }
    limits = [speed_limit(effect) * a for effect in record.inherent if effect["label"] == "rate_limit"]
    out = {name: float(x) for name, x in out.items()}
    return out | {"a_2+D": out["a_2"] + out["D"], "c_2/K": out["c_2"] / out["K"]} | ({"R": limits[0]} if limits else {})
