"""The commands of `ers`: one file each, with `add_parser(commands)` and `run(arguments) -> exit code`.

What is slow to import is imported inside `run`, so that `ers --help` is quick.
"""

from ers_mj.commands import (
    demo,
    diagnose,
    excite,
    frequency,
    gains,
    identify,
    prove,
    simulate,
    trial,
    validate,
    view,
    watch,
)

COMMANDS = (demo, diagnose, identify, simulate, validate, view, prove, trial, gains, frequency, watch, excite)
