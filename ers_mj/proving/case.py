"""One rudder of the proof: it is drawn, something is concealed in it, MuJoCo records it; what is handed out, and the
truth.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np

from ers_mj.proving.catalogue import LISTED, OUTSIDE
from ers_mj.proving.plans import KINDS, Plan, several
from ers_mj.proving.plant import DEG, TABLE_1
from ers_mj.proving.recorder import record
from ers_mj.proving.sampling import Run, Setup
from ers_mj.proving.servo import draw_servo
from ers_mj.proving.sizing import TWO_MASS, Ruler, pooled, refit
from ers_mj.proving.strength import clutter, conceal


@dataclass(frozen=True)
class Making:
    """What every case has."""

    rates: tuple[int, ...] = (200, 250, 500, 1000, 2000)  # [Hz]
    weights: tuple[float, ...] = (0.15, 0.1, 0.2, 0.4, 0.15)  # how often each is drawn
    fine_step: float = 1.5e-5  # [s], MuJoCo's, drawn between this and the next; the package's own is 5e-5
    rough_step: float = 2.5e-5  # [s]
    rod: float = 0.5  # share of the variable ratios that are the rod linkage of mjcf/


MAKING = Making()


def plans(count: int, seed: int) -> list[Plan]:
    """Kinds in their shares, singles and laws outside the library through their lists, all in random order."""
    rng = np.random.default_rng([seed, 0])
    kinds = [str(kind) for kind in rng.permutation([kind for kind, k in shares(count).items() for _ in range(k)])]
    lists = {"single": _cycle(rng, LISTED, count), "outside": _cycle(rng, OUTSIDE, count)}
    out = []
    for index, kind in enumerate(kinds):
        labels = (lists[kind].pop(0),) if kind in lists else several(rng, LISTED) if kind == "several" else ()
        out.append(Plan(index, kind, labels, "rudder", index))
    return out


def shares(count: int) -> dict[str, int]:
    """How many cases of each kind, largest remainders first."""
    exact = {kind: share * count for kind, share in KINDS.items()}
    out = {kind: int(x) for kind, x in exact.items()}
    for kind in sorted(KINDS, key=lambda kind: out[kind] - exact[kind])[: count - sum(out.values())]:
        out[kind] += 1
    return out


def _cycle(rng: np.random.Generator, names: tuple[str, ...], count: int) -> list[str]:
    return [str(name) for _ in range(count // len(names) + 1) for name in rng.permutation(names)]


@dataclass(frozen=True)
class Made:
    """A case as it was recorded: the drawn servo, its linkage, MuJoCo's step [s], what is concealed in it on purpose
    and what is too faint to count, its recordings, and what the refitted effect-free model leaves of each [sigma].
    """

    servo: dict
    linkage: str
    step: float
    concealed: list[dict]
    faint: list[dict]
    runs: list[Run]
    left: list[float]


def make(plan: Plan, seed: int) -> tuple[dict[str, str], dict]:
    """({file name: text} that is handed out, the truth) of one case; it does not depend on the others."""
    rng = np.random.default_rng([seed, 1, plan.number])
    made = _made(plan, rng)
    sensor = made.servo["sensor"]
    files = {"datasheet.toml": _datasheet(sensor["sample_rate_hz"])}
    files |= {
        f"rec{k + 1}.csv": _csv(r, x, sensor, rng) for k, (r, x) in enumerate(zip(made.servo["records"], made.runs))
    }
    return files, _truth(plan, seed, made)


def _made(plan: Plan, rng: np.random.Generator) -> Made:
    """The servo drawn, the effects sized in it, the recordings made."""
    servo = draw_servo(rng, 0.0, MAKING.rates, MAKING.weights)
    linkage = "rod" if "variable_ratio" in plan.labels and rng.random() < MAKING.rod else "constant"
    ruler, context = Ruler(servo), servo["context"]
    concealed = [
        conceal(rng, ruler, name, context) for name in plan.labels if (name, linkage) != ("variable_ratio", "rod")
    ]
    faint = clutter(rng, ruler, [*plan.labels, *(TWO_MASS if linkage == "rod" else ())], context)
    step = float(np.exp(rng.uniform(np.log(MAKING.fine_step), np.log(MAKING.rough_step))))
    runs = [
        record(
            servo["params"],
            [*concealed, *faint],
            r["t"],
            r["u"],
            setup=Setup.of(servo, k),
            step=step,
            linkage=linkage,
        )
        for k, r in enumerate(servo["records"])
    ]
    left = refit(servo, runs, 8)
    if linkage == "rod":
        concealed.append(
            {
                "label": "variable_ratio",
                "strength_name": "rod linkage of mjcf/",
                "strength": None,
                "shape": {"form": "rod"},
            }
        )
    return Made(servo, linkage, step, concealed, faint, runs, left)


def _truth(plan: Plan, seed: int, made: Made) -> dict:
    servo = made.servo
    rest = servo["params"]["theta_0"]
    records = [
        {
            "kind": r["kind"],
            "closed_loop": r["closed_loop"],
            "duration_s": float(r["t"][-1]),
            "travel_deg": [float((x.true.min() - rest) / DEG), float((x.true.max() - rest) / DEG)],
        }
        for r, x in zip(servo["records"], made.runs)
    ]
    return {
        "case": f"case-{plan.index + 1:03d}",
        "family": plan.family,
        "kind": plan.kind,
        "labels": list(plan.labels),
        "effects": made.concealed,
        "clutter": made.faint,
        "linkage": made.linkage,
        "visibility_after_refit_sigma": pooled(servo, made.left),
        "visibility_per_record": made.left,
        "true_parameters": servo["params"],
        "lumped": lumped(servo["params"]),
        "mujoco_step_s": made.step,
        **servo["sensor"],
        "controller": servo["controller"],
        "records": records,
        "seed": [seed, plan.index],
    }


def lumped(p: Mapping[str, float]) -> dict[str, float]:
    """Eq. (6)'s coefficients."""
    n, J = p["n"], p["J"]
    return {
        "a_1": p["k_s"] / J,
        "a_2": p["B"] / J + n**2 * p["K_t"] * p["K_e"] / (p["R"] * J),
        "b": n * p["K_t"] / (p["R"] * J),
        "c_1": p["T_LH"] / J,
        "c_2": p["F_c"] / J,
        "theta_0": p["theta_0"],
    }


# -- files ---------------------------------------------------------------------------------------------------


def _datasheet(rate: int) -> str:
    """Table 1 and the sample rate."""
    return "\n".join(
        [
            "[parameters]",
            *(f"{name} = {value}" for name, value in TABLE_1.items()),
            "",
            "[recording]",
            f"sample_rate_hz = {rate}",
            "",
        ]
    )


def _csv(record: dict, run: Run, sensor: dict, rng: np.random.Generator) -> str:
    """Columns t_s, u_V, theta_rad, then i_A and theta_ref_rad where there are any."""
    columns = {"t_s": (record["t"], "%.6f"), "u_V": (run.u, "%.4f"), "theta_rad": (run.theta, "%.7f")}
    if sensor["has_current"]:
        columns["i_A"] = (run.i_A + sensor["current_sigma_A"] * rng.standard_normal(run.i_A.size), "%.4f")
    if record["closed_loop"]:
        columns["theta_ref_rad"] = (record["ref"], "%.5f")
    form = ",".join(form for _, form in columns.values())
    rows = zip(*(values.tolist() for values, _ in columns.values()))
    return "\n".join([",".join(columns), *(form % row for row in rows), ""])
