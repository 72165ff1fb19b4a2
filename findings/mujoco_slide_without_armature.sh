#!/bin/sh
# MuJoCo sets the softness of a slide's dry friction without the joint's armature, but only where the body's centre of
# mass lies at its origin.
#
# Guess: a slide of 1 kg of armature and a negligible body holds against a pull below its frictionloss, but for a slow
# creep, as a hinge with the same numbers does; whether the centre of mass lies at the origin or a hair beside it is
# one, since nothing turns.
#
# Seen (mujoco 4.0.0): dof_invweight0, by which constraints are scaled, is 1e6, one over the body's mass alone, where the
# hinge has 1.0, one over body and armature; a centre of mass 10 um off the origin gives the slide its 1.0 too. Pulled
# with half of its frictionloss the slide moves as if it had none (0.1 m/s after 0.2 s), with the shifted centre it creeps
# as slowly as the hinge (0.00053). Bodies of that kind (body_simple is 2) have a way of their own, without armature.
set -eu
folder=$(mktemp -d)
trap 'rm -rf "$folder"' EXIT
python3 -m venv "$folder/venv"
"$folder/venv/bin/pip" install -q mujoco==4.0.0
"$folder/venv/bin/python" - <<'PYTHON'
import mujoco

XML = """<mujoco><option gravity="0 0 0" timestep="1e-4"/><worldbody><body>
<inertial pos="{x} 0 0" mass="1e-6" diaginertia="1e-6 1e-6 1e-6"/>
<joint type="{kind}" axis="1 0 0" armature="1" frictionloss="1"/></body></worldbody></mujoco>"""

seen = {}
for kind, x in (("slide", 0.0), ("slide", 1e-5), ("hinge", 0.0)):
    model = mujoco.MjModel.from_xml_string(XML.format(kind=kind, x=x))
    data = mujoco.MjData(model)
    data.qfrc_applied[0] = 0.5
    for _ in range(2000):
        mujoco.mj_step(model, data)
    seen[kind, x] = model.dof_invweight0[0], data.qvel[0]
    print(f"{kind}, centre of mass at {x:g} m: dof_invweight0 {seen[kind, x][0]:.4g}, body_simple"
          f" {model.body_simple[1]}, speed after 0.2 s {seen[kind, x][1]:.3g}")
(soft, fast), (stiff, slow), (turned, creep) = seen["slide", 0.0], seen["slide", 1e-5], seen["hinge", 0.0]
assert soft > 9e5 and abs(stiff - 1.0) < 1e-3 and abs(turned - 1.0) < 1e-3
assert abs(slow / creep - 1.0) < 0.01 and fast > 50.0 * slow
PYTHON
