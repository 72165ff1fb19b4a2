"""A firmware that lets its reference move only so fast."""

import numpy as np

from ers_mj.effects.base import Drive, Parameter


class RateLimit(Drive):
    """The reference of a position loop follows the command with the speed R at most; without such a loop it is none."""

    name = "rate_limit"
    sentence = "the servo's own reference moves no faster than {R}"
    mjcf = "none: the reference is limited before it reaches ctrl"
    apart = (
        "large steps become ramps of one slope, whatever the load; voltage_saturation and current_limit make a slope"
        " that the load and the speed change"
    )
    parameters = (Parameter("R", "speed", "largest speed of the reference", absent=np.inf),)
    in_loop, loop_only = ("R",), True
    loop_sentence = "the servo's own reference moves no faster than {value}"

    def starts(self, scales):
        return []
