"""The targets, and a folder of them: every file with what it cannot carry."""

from __future__ import annotations

from collections.abc import Mapping, Sequence

from ers_mj.errors import refuse_other
from ers_mj.export.base import Target, Written
from ers_mj.export.fmu import Fmu
from ers_mj.export.lookup import Lookup
from ers_mj.export.mjlab_actuator import Mjlab
from ers_mj.export.mujoco_joint import MujocoJoint
from ers_mj.export.newton_actuator import Newton
from ers_mj.export.python_control import PythonControl
from ers_mj.export.randomisation import Randomisation
from ers_mj.export.servo import Servo

TARGETS: Mapping[str, Target] = {
    target.name: target
    for target in (MujocoJoint(), PythonControl(), Fmu(), Mjlab(), Newton(), Randomisation(), Lookup())
}
LOSSES = "LOSSES.md"
UNEXPLAINED = (
    "**The diagnosis that made this model ended as *unexplained*: there is a mismatch that nothing named accounts for."
    " What is exported is the best of what is known, and is wrong by that mismatch.**"
)


def exported(servo: Servo, names: Sequence[str]) -> tuple[dict[str, bytes], dict[str, tuple[str, ...]]]:
    """(files by name, LOSSES.md among them; what each target does not carry, by its name).

    Raises:
        InputError: there is no such target, or it cannot take such a servo.
    """
    for name in names:
        refuse_other("export target", name, TARGETS)
    written = {name: TARGETS[name].write(servo) for name in names}
    files = {TARGETS[name].file: made.content for name, made in written.items()}
    files[LOSSES] = _page(servo, written).encode()
    return files, {name: made.losses for name, made in written.items()}


def _page(servo: Servo, written: Mapping[str, Written]) -> str:
    """LOSSES.md."""
    has = ", ".join(name.replace("_", " ") for name, _ in servo.effects) or "no effect"
    kind = "told a position, its firmware's loop within" if servo.loop else f"told {servo.signals[0]}"
    lines = [
        f"# What the exports of {servo.name} do not carry",
        "",
        f"The model: {has}; {kind}; it shows {servo.signals[1]}.",
    ]
    if servo.sheet.verdict == "unexplained":
        lines += ["", UNEXPLAINED]
    for name, made in written.items():
        lines += ["", f"## {name}: `{TARGETS[name].file}`, for {TARGETS[name].tool}", ""]
        lines += [f"- {sentence}." for sentence in made.losses] or ["- nothing is left out."]
    return "\n".join([*lines, ""])
