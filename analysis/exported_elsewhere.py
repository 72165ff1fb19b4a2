"""Whether mjlab_actuator.py and newton_actuator.py do what the model does, each in an environment of its own.

    python analysis/exported_elsewhere.py [--envs FOLDER] [--only newton]

mjlab and newton want another MuJoCo than ours, and PyTorch: some GB are installed into FOLDER, once. The table has RMS
differences over the RMS of the response, in per cent, against the model without what LOSSES.md names; on the CPU.
"""

import argparse
import importlib.util
import subprocess
import sys
import tempfile
import venv
from collections import deque
from pathlib import Path

import numpy as np

WANTED = {"newton": ["newton[sim]==1.8.0"], "mjlab": ["mjlab==1.6.0"]}
MODELS = ("plain", "stribeck", "limit and delay", "winding, cogging", "stops, dead zone", "loop", "loop, gravity")
TIMESTEP = 5e-4  # [s]
SECONDS = {"newton": 1.5, "mjlab": 4.0}  # of the excitation: newton launches kernels at every step


# -- inside an environment of its own -------------------------------------------------------------------------------


def loaded(folder: Path, name: str):
    """The exported module of this name."""
    spec = importlib.util.spec_from_file_location(name, folder / f"{name}.py")
    module = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(module)
    return module


def in_newton(folder: Path, given) -> np.ndarray:
    """Positions (N,) of newton's joint under the exported actuator."""
    import newton
    import warp as wp

    servo, u, h = loaded(folder, "newton_actuator"), given["u"], TIMESTEP
    builder = newton.ModelBuilder()
    body = builder.add_link(mass=1e-3, inertia=wp.mat33(np.eye(3) * 1e-9))
    joint = builder.add_joint_revolute(parent=-1, child=body, axis=(0.0, 0.0, 1.0))
    builder.add_articulation([joint])
    servo.add_to(builder, dof=0, timestep=h)
    builder.joint_q[0] = float(given["rest"])
    model = builder.finalize(device="cpu")
    solver = newton.solvers.SolverMuJoCo(model, use_mujoco_cpu=True, integrator="implicitfast")
    state, after, control = model.state(), model.state(), model.control()
    actuators = [
        (a, a.state() if a.is_stateful() else None, a.state() if a.is_stateful() else None) for a in model.actuators
    ]
    out, steps = np.empty(u.size), round((given["t"][1] - given["t"][0]) / h)
    for k in range(u.size):
        out[k] = state.joint_q.numpy()[0]
        if servo.TORQUE_PER_INPUT is None:
            control.joint_target_q.fill_(float(u[k]))
        else:
            control.joint_act.fill_(float(u[k] * servo.TORQUE_PER_INPUT))
        for _ in range(steps):
            control.joint_f.zero_()
            for i, (actuator, now, then) in enumerate(actuators):
                actuator.step(state, control, now, then, dt=h)
                actuators[i] = (actuator, then, now)
            solver.step(state, after, control, None, h)
            state, after = after, state
    return out


def in_mjlab(folder: Path, given) -> np.ndarray:
    """Positions (N,) of a joint that mjlab wrote, in its MuJoCo; commands late as its buffer has them."""
    import mujoco

    servo, u, h = loaded(folder, "mjlab_actuator"), given["u"], TIMESTEP
    spec = mujoco.MjSpec()
    spec.compiler.degree, spec.compiler.autolimits = False, True
    spec.option.timestep, spec.option.gravity = h, [0.0, 0.0, 0.0]
    spec.option.integrator = mujoco.mjtIntegrator.mjINT_IMPLICITFAST
    body = spec.worldbody.add_body(mass=1e-9, inertia=[1e-9] * 3, explicitinertial=True)
    body.add_joint(name="servo", axis=[0.0, 1.0, 0.0])
    servo.edit_spec(spec, "servo", timestep=h)
    configured = servo.actuator("servo", timestep=h)
    configured.build(None, [0], ["servo"]).edit_spec(spec, ["servo"])
    model = spec.compile()
    data, out = mujoco.MjData(model), np.empty(u.size)
    data.qpos[0] = float(given["rest"])
    past = deque([0.0] * (configured.delay_max_lag + 1), maxlen=configured.delay_max_lag + 1)
    steps = round((given["t"][1] - given["t"][0]) / h)
    for k in range(u.size):
        out[k] = data.qpos[0]
        for _ in range(steps):
            past.append(float(u[k]))
            data.ctrl[0] = past[0]
            mujoco.mj_step(model, data)
    return out


# -- here -------------------------------------------------------------------------------------------------------------


def python_of(tool: str, folder: Path) -> Path:
    """An environment with a tool, made where it is not there, or not whole."""
    place = folder / tool
    found = place / ("Scripts" if sys.platform == "win32" else "bin") / "python"
    if not found.exists() or subprocess.run([found, "-m", "pip", "-q", "show", tool], capture_output=True).returncode:
        print(f"installing {', '.join(WANTED[tool])} ...", flush=True)
        venv.create(place, with_pip=True)
        subprocess.run([found, "-m", "pip", "install", "-q", *WANTED[tool]], check=True)
    return found


def off_by(tool: str, python: Path, name: str) -> float:
    """RMS difference of a tool's response over the RMS of what it should be."""
    from exported import MODELS as KNOWN
    from exported import of

    from ers_mj.export.mujoco_joint import OwnJoint
    from ers_mj.export.trying import RATE_HZ, apart, excitation, response

    model, servo = of(KNOWN[name])
    t, u = (x[: round(SECONDS[tool] * RATE_HZ)] for x in excitation(servo))
    with tempfile.TemporaryDirectory() as place:
        folder = Path(place)
        model.export(folder, [tool])
        np.savez(folder / "given.npz", t=t, u=u, rest=servo.rest)
        subprocess.run([python, __file__, "--inside", tool, folder], check=True, stdout=subprocess.DEVNULL)
        return apart(
            np.load(folder / "found.npy"), response(servo, OwnJoint(servo, wound=tool != "newton").carried, t, u)
        )


def main() -> None:
    """Print the table."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--envs", type=Path, default=Path(tempfile.gettempdir()) / "ers-mj-envs")
    parser.add_argument("--only", choices=WANTED)
    parser.add_argument("--inside", nargs=2, help=argparse.SUPPRESS)
    arguments = parser.parse_args()
    if arguments.inside:
        folder = Path(arguments.inside[1])
        run = {"newton": in_newton, "mjlab": in_mjlab}[arguments.inside[0]]
        np.save(folder / "found.npy", run(folder, np.load(folder / "given.npz")))
        return
    for tool in [arguments.only] if arguments.only else WANTED:
        python = python_of(tool, arguments.envs)
        for name in MODELS:
            print(f"{tool:8} {name:20} {100.0 * off_by(tool, python, name):.3f} %", flush=True)


if __name__ == "__main__":
    main()
