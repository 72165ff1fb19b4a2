#!/bin/sh
# MuJoCo's dry friction below breakaway is neither stiction nor a damper: it lets a tenth of the pull through, and then
# creeps towards its speed with a time constant of 10.6 ms.
#
# Guess: a hinge with frictionloss 1 N m that is pulled by 0.5 N m stands still, or, since the constraint is known to be
# soft, moves as against a damper: at once with the full acceleration pull/J, until the damper's speed is reached.
#
# Seen (mujoco 4.0.0, defaults of solreffriction and solimpfriction, J = 0.05 kg m^2): the first acceleration is 0.100
# of pull/J, the last speed 0.01055 rad/s (pull/(947 J)), 63 % of it after 10.6 ms, whatever the timestep. So the hinge
# begins as if ten times as heavy, and a model with damping alone is wrong in the first 30 ms of every rest.
set -eu
folder=$(mktemp -d)
trap 'rm -rf "$folder"' EXIT
python3 -m venv "$folder/venv"
"$folder/venv/bin/pip" install -q mujoco==4.0.0 numpy
"$folder/venv/bin/python" - <<'PYTHON'
import mujoco
import numpy as np

INERTIA, FRICTION, PULL = 0.05, 1.0, 0.5
XML = """<mujoco><option timestep="{step}" gravity="0 0 0"/><worldbody><body>
<joint name="hinge" type="hinge" axis="0 0 1" frictionloss="{friction}"/>
<inertial pos="0 0 0" mass="1" diaginertia="{inertia} {inertia} {inertia}"/></body></worldbody></mujoco>"""

for step in (1e-5, 1e-4):
    model = mujoco.MjModel.from_xml_string(XML.format(step=step, friction=FRICTION, inertia=INERTIA))
    data = mujoco.MjData(model)
    data.qfrc_applied[0] = PULL
    speed = np.empty(round(0.1 / step))
    for k in range(speed.size):
        mujoco.mj_step(model, data)
        speed[k] = data.qvel[0]
    first = speed[0] / step / (PULL / INERTIA)
    late = (np.argmax(speed >= speed[-1] * (1 - np.exp(-1))) + 1) * step
    print(f"timestep {step:g} s: first acceleration {first:.3f} of pull/J, last speed {speed[-1]:.5f} rad/s,"
          f" pull/(947 J) = {PULL / 947 / INERTIA:.5f} rad/s, 63 % after {1e3 * late:.1f} ms")
    assert abs(first - 0.1) < 0.003 and abs(speed[-1] - PULL / 947 / INERTIA) < 2e-4 and 0.0095 < late < 0.0115
PYTHON
