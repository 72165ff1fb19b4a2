#!/bin/sh
# A <general> servo whose force grows with speed is compiled into one that damps, and a last digit decides it.
#
# Guess: of a <general> actuator MuJoCo takes gainprm and biasprm as they are written; the reading of a positive third
# bias as a damping ratio belongs to the shortcuts <position> and <intvelocity>, which have an attribute for it.
#
# Seen (mujoco 4.0.0, a joint of 0.01 kg m^2): kp 1 and a bias of +0.05 N m s, as a firmware's late speed gives it,
# become -0.01 (2 zeta sqrt(kp I) with zeta 0.05): the sign is turned, and nothing is said. With the gain one unit in
# its last place off -biasprm[1] the same bias stays +0.05: after 5 s of free swing 0.0081 rad against 2.8e4. So does a
# servo whose numbers were rounded differently on their way into the file.
set -eu
folder=$(mktemp -d)
trap 'rm -rf "$folder"' EXIT
python3 -m venv "$folder/venv"
"$folder/venv/bin/pip" install -q mujoco==4.0.0 numpy
cd "$folder"
"$folder/venv/bin/python" - <<'PYTHON'
import mujoco
import numpy as np

XML = """<mujoco><option timestep="0.001" gravity="0 0 0" integrator="implicitfast"/><worldbody><body>
<inertial pos="0 0 0" mass="1" diaginertia="0.01 0.01 0.01"/><joint name="j" axis="0 0 1"/></body></worldbody>
<actuator><general joint="j" gaintype="fixed" biastype="affine" gainprm="{gain!r}" biasprm="0 -1 0.05"/></actuator>
</mujoco>"""


def swing(gain):
    model = mujoco.MjModel.from_xml_string(XML.format(gain=gain))
    data = mujoco.MjData(model)
    data.qpos[0] = 0.1
    for _ in range(5000):
        mujoco.mj_step(model, data)
    return model.actuator_biasprm[0, 2], np.hypot(data.qpos[0], data.qvel[0] / 10.0)


told, beside = swing(1.0), swing(float(np.nextafter(1.0, 2.0)))
print(f"mujoco {mujoco.__version__}: gain 1        compiled bias of speed {told[0]:+.4f}, after 5 s {told[1]:.3g} rad")
print(f"              gain 1 + 2e-16 compiled bias of speed {beside[0]:+.4f}, after 5 s {beside[1]:.3g} rad")
assert abs(told[0] + 2 * 0.05 * np.sqrt(1.0 * 0.01)) < 1e-12 and told[1] < 0.1
assert beside[0] == 0.05 and beside[1] > 1.0
PYTHON
