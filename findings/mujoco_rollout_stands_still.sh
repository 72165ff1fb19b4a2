#!/bin/sh
# A rollout of MuJoCo that runs away stands still from then on, near where the model rests at zero, and raises nothing.
#
# Guess: rollout() returns what as many calls of mj_step do: where the acceleration is too large, mj_step resets the
# state, says so in a log file, and goes on from there; or the rest of the array is NaN.
#
# Seen (mujoco 4.0.0, a mass on a spring that pushes): both are the same to the bit up to the sample at which the
# simulation is called unstable; mj_step resets, and grows anew; every later state of the rollout is the one a step
# after the reset, finite, its time 0.01 s to the end. A cost over such states takes it for a mass at rest: who fits
# along rollouts has to read data.warning, or compare the times.
set -eu
folder=$(mktemp -d)
trap 'rm -rf "$folder"' EXIT
python3 -m venv "$folder/venv"
"$folder/venv/bin/pip" install -q mujoco==4.0.0 numpy
cd "$folder"
"$folder/venv/bin/python" - > seen 2>&1 <<'PYTHON' || { cat seen; exit 1; }
import mujoco
import numpy as np
from mujoco.rollout import rollout

XML = """<mujoco><option timestep="0.01"/><worldbody><body><joint type="slide" stiffness="-400"/>
<geom type="sphere" size="0.1" mass="1"/></body></worldbody></mujoco>"""
N = 400
FULL = mujoco.mjtState.mjSTATE_FULLPHYSICS
model = mujoco.MjModel.from_xml_string(XML)

data = mujoco.MjData(model)
data.qpos[0] = 1e-3
begun = np.empty(mujoco.mj_stateSize(model, FULL))
mujoco.mj_getState(model, data, begun, FULL)
stepped = np.empty(N)
for k in range(N):
    mujoco.mj_step(model, data)
    stepped[k] = data.qpos[0]

other = mujoco.MjData(model)
states, _ = rollout(model, other, begun, nstep=N)
times, rolled = states[0, :, 0], states[0, :, 1]
lost = int(np.argmin(times[1:] > times[:-1])) + 1
same, after = np.array_equal(stepped[:lost], rolled[:lost]), np.unique(rolled[lost:])
print(f"the same up to step {lost - 1}: {same}, largest {abs(rolled).max():.3g} m")
print(f"rollout from there on: {after} m at {np.unique(times[lost:])} s; any NaN: {np.isnan(states).any()}")
print(f"mj_step from there on: up to {abs(stepped[lost:]).max():.3g} m")
warned = other.warning[mujoco.mjtWarning.mjWARN_BADQACC].number
print(f"warnings of bad accelerations that the rollout leaves in its data: {warned}")
assert same and abs(rolled[:lost]).max() > 1e6 and abs(stepped[lost:]).max() > 1e3
assert after.size == 1 and abs(after[0]) < 1e-2 and times[-1] == 0.01 and not np.isnan(states).any() and warned == 1
PYTHON
grep -v "WARNING\|^$" seen
