"""The scheme that exported models run by: one text, in Python here, in C by translation.py.

    half a step of the positions -> what arrives of the command -> firmware or winding -> forces -> speeds at the end of
    the step, dry friction and the preload's corner set-valued -> the other half -> sensor

Leapfrog, dampers by the trapezium, a reversal in its instant: of second order in the step h. `c` holds the servo's
numbers, `x` its state, accelerations per total inertia (see effects/quantities.Coefficients and
plants/firmware.LoopNumbers for the letters). What laws of effects do is called here and written by portable.py.
Only scalars, attributes, `if`, `while` and `math`: that is what translation.py reads. The parts import nothing of each
other: they are one text in the end.
"""

from __future__ import annotations

import inspect
from types import ModuleType

from ers_mj.export.stepping import basics, bodies, firmware, friction, steps, winding

PARTS = {
    "numbers": basics,
    "dry friction": friction,
    "drive": winding,
    "the loop of the firmware": firmware,
    "bodies": bodies,
    "a step": steps,
}


def text() -> str:
    """The functions of all parts, as Python."""
    return "\n\n\n".join(f"# -- {title} {'-' * (113 - len(title))}\n\n\n{_functions(p)}" for title, p in PARTS.items())


def _functions(part: ModuleType) -> str:
    source = inspect.getsource(part)
    return source[source.index("\ndef ") :].strip()
