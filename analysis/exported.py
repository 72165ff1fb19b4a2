"""Whether exports do what the model does: run in MuJoCo, python-control, an FMU and from tables.

    python analysis/exported.py [--only NAME]               nineteen models written by hand
    python analysis/exported.py --diagnosed [FOLDER]        twelve, diagnosed from ../shared, kept in FOLDER
    python analysis/exported.py --answers FOLDER...         what `ers diagnose` has written already

A row a model, a column a target: RMS difference over the RMS of the response, in per cent; of a target that cannot
carry a part (LOSSES.md names it) against the model with that part switched off. All under one excitation of 4 s.
"""

import argparse
import csv
import io
import tempfile
from collections.abc import Iterator
from pathlib import Path

import mujoco
import numpy as np

import ers_mj as ers
from ers_mj.export.lookup import Curves
from ers_mj.export.mujoco_joint import OwnJoint
from ers_mj.export.randomisation import document_of
from ers_mj.export.servo import Servo, servo_of
from ers_mj.export.targets import TARGETS
from ers_mj.export.trying import apart, excitation, response

RUN = ("control", "fmu", "mujoco", "lookup", "randomisation")
STEP = 1e-4  # [s] of the block diagram that lookup.csv is run in
ARM = {"a_1": 0.0, "a_2": 25.0, "b": 60.0, "c_1": 0.0, "c_2": 12.0, "theta_0": 0.0}
HOBBY = {"kind": "PD", "K": 900.0, "D": 8.0, "L": 60.0, "tau_s": 0.012}


def rudder(**effects: dict) -> dict:
    """Table 1 with effects."""
    return {"parameters": dict(ers.load_model("table1").datasheet.parameters), "effect": listed(effects)}


def arm(a_1: float = 0.0, emf_share: float = 0.0, **effects: dict) -> dict:
    """A motor of known gain with effects, its inertia unknown."""
    return {"lumped": ARM | {"a_1": a_1}, "baseline": {"emf_share": emf_share}, "effect": listed(effects)}


def hobby(loop: dict, **effects: dict) -> dict:
    """A servo that is told a position."""
    lumped = {"a_1": 0.0, "a_2": 12.0, "c_2": 10.0}
    return {"lumped": lumped, "baseline": {}, "loop": HOBBY | loop, "effect": listed(effects)}


def listed(effects: dict) -> list:
    """Effects as a model.toml has them."""
    return [{"name": name, "parameters": values} for name, values in effects.items()]


MODELS = {
    "plain": rudder(),
    "stribeck": rudder(stribeck={"dF_s": 0.12, "v_s": 0.3}),
    "play": rudder(backlash={"gap": 0.0087, "rho": 0.5, "phi": 0.2}),
    "limit and delay": rudder(voltage_saturation={"u_max": 7.0}, input_delay={"T_d": 0.0063}),
    "load friction": rudder(load_dependent_friction={"mu": 0.15}),
    "shaft": rudder(shaft_compliance={"f_shaft": 25.0}),
    "gravity": arm(gravity_imbalance={"g_s": 20.0, "g_c": 5.0}),
    "winding, cogging": arm(100.0, 0.6, inductance={"tau_L": 0.004}, cogging={"A": 6.0, "period": 0.3}),
    "bristle": arm(100.0, presliding={"x_s": 0.004, "zeta": 0.2}),
    "stops, dead zone": arm(
        100.0,
        end_stop={"lower": -0.3, "upper": 0.35},
        drive_dead_zone={"d": 0.4},
        sensor_lag={"T": 0.004},
        asymmetric_friction={"dF": 3.0},
    ),
    "loop": hobby({}),
    "loop, late damping": hobby({"kind": "PD", "D": 25.0, "lag_s": 0.006}),
    "loop, bristle": hobby({"D": 12.0}, presliding={"x_s": 0.03, "zeta": 0.4}),
    "loop, idle bridge": hobby({"D": 12.0, "idle": 3.0}),
    "loop, play": hobby({"R": 2.0, "idle": 2.0}, backlash={"gap": 0.01}),
    "loop, hard shaft": hobby(
        {}, shaft_compliance={"f_shaft": 6.0, "rho": 0.4, "twist_2": 0.01}, gravity_imbalance={"g_s": 20.0, "g_c": 15.0}
    ),
    "loop, gravity": hobby(
        {"kind": "PID", "I": 2000.0, "band": 0.005, "creep": 200.0, "heavy": 10.0}, gravity_imbalance={"g_s": 30.0}
    ),
    "loop, stops": hobby({}, end_stop={"lower": 0.02, "upper": 1.15, "f_stop": 38.0, "zeta": 0.7}),
    "loop, slide": hobby({"K": 80.0, "creep": 950.0, "heavy": 10.0}) | {"recording": {"output_unit": "m"}},
    "loop, stribeck": hobby({"dead_time_s": 0.006, "D": 15.0}, stribeck={"dF_s": 4.0, "v_s": 0.2}),
}


SHARED = Path(__file__).resolve().parents[2] / "shared"
DIAGNOSED = (
    *("concealed/case-002", "concealed/case-060", "foreign/f2-4", "foreign/f3-1", "foreign/f4-2", "foreign/g060"),
    *("menagerie/m01", "menagerie/m10", "menagerie/m11", "menagerie/m17", "menagerie/m19", "menagerie/m20"),
)


def of(known: ers.Model | dict) -> tuple[ers.Model, Servo]:
    """A model, and the same on its way out."""
    model = ers.Model(known)
    return model, servo_of(model.datasheet, model.output_unit, model.input_unit, model.signals, model.inductance)


def diagnosed(folder: Path) -> Iterator[Path]:
    """The answers to the cases of DIAGNOSED in a folder, asked where they are not there; a case that is absent is
    told.
    """
    for case in DIAGNOSED:
        place, files = folder / case.replace("/", "-"), sorted((SHARED / case).glob("rec*.csv"))
        sheet = SHARED / case / "datasheet.toml"
        if not (place / "model.toml").exists() and files:
            ers.diagnose(files, sheet if sheet.exists() else None).save(place)
        if (place / "model.toml").exists():
            yield place
        else:
            print(f"{case}: skipped, ../shared does not have it")


def asked(arguments: argparse.Namespace) -> Iterator[tuple[str, ers.Model | dict]]:
    """(name, model) of every row."""
    if arguments.only:
        yield arguments.only, MODELS[arguments.only]
    elif arguments.answers or arguments.diagnosed:
        for place in arguments.answers or diagnosed(arguments.diagnosed):
            model = ers.load_model(place / "model.toml")
            yield f"{place.name}: {', '.join(model.effects) or 'no effect'}", model
    else:
        yield from MODELS.items()


def off_by(target: str, model: ers.Model, servo: Servo) -> float:
    """RMS difference of a target's response over the RMS of what it should be."""
    t, u = excitation(servo)
    if target == "control":
        return apart(response(servo, servo.portable, t, u), model.simulate((t, u)).theta)
    if target == "fmu":
        return apart(in_fmu(servo, t, u), model.simulate((t, u)).theta)
    if target == "lookup":
        curves = Curves(servo)
        return apart(
            in_tables(TARGETS[target].write(servo).content.decode(), t, u), response(servo, curves.carried, t, u)
        )
    joint = OwnJoint(servo)
    expected = response(servo, joint.carried, t, u)
    if target == "randomisation":
        return apart(in_joint(document_of(servo)["ensemble"][0], joint.timestep, servo.rest, t, u), expected)
    return apart(joint.follow(t, u), expected)


def in_fmu(servo: Servo, t: np.ndarray, u: np.ndarray) -> np.ndarray:
    """Readings (N,) of model.fmu in fmpy."""
    import fmpy

    into, out = servo.signals
    given = np.array(list(zip(t, u, strict=True)), dtype=[("time", float), (into, float)])
    with tempfile.TemporaryDirectory() as folder:
        file = Path(folder) / "model.fmu"
        file.write_bytes(TARGETS["fmu"].write(servo).content)
        found = fmpy.simulate_fmu(str(file), input=given, output=[out], stop_time=t[-1], output_interval=t[1] - t[0])
    return np.asarray(found[out])[: t.size]


def in_joint(member: dict, timestep: float, rest: float, t: np.ndarray, u: np.ndarray) -> np.ndarray:
    """Positions (N,) of a member of randomisation.json in MuJoCo."""
    kind = member["actuator"]["kind"]
    joint, actuator = written(member["joint"]), written({k: x for k, x in member["actuator"].items() if k != "kind"})
    model = mujoco.MjModel.from_xml_string(
        f'<mujoco><compiler angle="radian" autolimits="true"/><option timestep="{timestep}" integrator="implicitfast"'
        f' gravity="0 0 0"/><worldbody><body><inertial pos="0 0 0" mass="1e-9" diaginertia="1e-9 1e-9 1e-9"/>'
        f'<joint name="own" axis="0 1 0" {joint}/></body></worldbody>'
        f'<actuator><{kind} joint="own" {actuator}/></actuator></mujoco>'
    )
    data, out = mujoco.MjData(model), np.empty(t.size)
    data.qpos[0] = rest
    for k in range(t.size):
        out[k], data.ctrl[0] = data.qpos[0], u[k]
        mujoco.mj_step(model, data, round((t[1] - t[0]) / timestep))
    return out


def written(attributes: dict) -> str:
    """Attributes of XML."""
    texts = {name: " ".join(map(repr, x)) if isinstance(x, list | tuple) else repr(x) for name, x in attributes.items()}
    return " ".join(f'{name}="{text}"' for name, text in texts.items())


def in_tables(text: str, t: np.ndarray, u: np.ndarray) -> np.ndarray:
    """Readings (N,) of a block diagram of lookup.csv's tables, semi-implicit Euler, friction that holds."""
    tables: dict[str, list] = {}
    for row in csv.DictReader(io.StringIO(text)):
        tables.setdefault(row["table"], []).append((float(row["x"]), float(row["y"])))
    curve = {name: np.array(points).T for name, points in tables.items() if len(points) > 1}
    c = {name: points[0][1] for name, points in tables.items() if len(points) == 1}
    J, late = c["inertia"], round(c["delay"] / STEP)
    levels = [float(np.interp(s * 1e-9, *beside(curve["friction"], s))) for s in (1.0, -1.0)]
    theta, w, j, seen, out = c["start"], 0.0, 0.0, c["start"], np.empty(t.size)
    finer = np.repeat(u, round((t[1] - t[0]) / STEP))
    first = c["start"] if "proportional" in c else 0.0
    arrives = np.concatenate([np.full(late, first), finer])
    for k in range(finer.size):
        if k % (finer.size // t.size) == 0:
            out[k * t.size // finer.size] = np.interp(seen, *curve["sensor"]) if "sensor" in curve else seen
        if "proportional" in c:
            asked = c["proportional"] * (arrives[k] - theta) - c["derivative"] * w
            force = min(max(asked, -c.get("limit", np.inf)), c.get("limit", np.inf)) - c["back_emf"] * w
        else:
            goes = float(np.interp(arrives[k], *curve["drive"])) - c["back_emf"] * w
            j = goes + (j - goes) * np.exp(-STEP / c["time_constant"]) if c["time_constant"] > 0 else goes
            force = j
        push = force + float(np.interp(theta, *curve["load"])) - float(np.interp(w, *curve["damping"]))
        level = float(np.interp(w, *curve["friction"])) if abs(w) > 3e-3 else levels[0] if w > 0 else levels[1]
        after = w + STEP * (push - (level if w != 0 else 0.0)) / J
        if w == 0 or after * w < 0:
            after = 0.0 if levels[1] <= push <= levels[0] else w + STEP * (push - levels[0 if push > 0 else 1]) / J
        theta, w = theta + STEP * after, after
        T = c["sensor_time_constant"]
        seen = theta + (seen - theta) * np.exp(-STEP / T) if T > 0 else theta
    return out


def beside(curve: np.ndarray, side: float) -> np.ndarray:
    """The half of a curve on one side of zero, without zero."""
    return curve[:, curve[0] * side > 0]


def main() -> None:
    """Print the table, and what the targets leave out of each model."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--only", choices=MODELS, help="one model")
    parser.add_argument("--answers", nargs="+", type=Path, metavar="FOLDER", help="written by ers diagnose")
    parser.add_argument(
        "--diagnosed", nargs="?", type=Path, metavar="FOLDER", const=Path(tempfile.gettempdir()) / "ers-mj-diagnosed"
    )
    print(f"{'RMS difference [%]':44}" + "".join(f"{name:>15}" for name in RUN))
    worst = dict.fromkeys(RUN, 0.0)
    for name, known in asked(parser.parse_args()):
        model, servo = of(known)
        row = {target: 100.0 * off_by(target, model, servo) for target in RUN}
        worst = {target: max(worst[target], x) for target, x in row.items()}
        print(f"{name:44}" + "".join(f"{x:15.3f}" for x in row.values()), flush=True)
        for target in ("mujoco", "lookup"):
            left = OwnJoint(servo).lines.left_out if target == "mujoco" else Curves(servo).losses[:-2]
            print(f"    {target} without: {'; '.join(left) or 'nothing'}")
    print(f"{'worst':44}" + "".join(f"{x:15.3f}" for x in worst.values()))


if __name__ == "__main__":
    main()
