"""The commands of `ers`: one file each, with `add_parser(commands)` and `run(arguments) -> exit code`.

What several share: options (and checks on them), recordings (what they must have in common), loop (of trial and
frequency), output (files, JSON, lines). What is slow to import is imported inside `run`, so that `ers --help` is quick.
"""

from ers_mj.commands import (
    batch,
    cache,
    compare,
    completion,
    demo,
    diagnose,
    excite,
    export,
    frequency,
    gains,
    identify,
    inspect,
    prove,
    simulate,
    trial,
    validate,
    view,
    watch,
)

COMMANDS = (
    demo,
    diagnose,
    identify,
    simulate,
    validate,
    view,
    inspect,
    compare,
    batch,
    prove,
    trial,
    gains,
    frequency,
    watch,
    excite,
    export,
    cache,
    completion,
)
