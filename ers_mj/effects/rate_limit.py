"""A firmware that lets its reference move only so fast."""

import numpy as np

from ers_mj.effects.base import Drive, Parameter


class RateLimit(Drive):
    """The reference of a position loop follows the command with the speed R at most; without such a loop it is none."""

    name = "rate_limit"
    sentence = "the servo's own reference moves no faster than {R}"
    mjcf = "none: the reference is limited before it reaches ctrl"
    parameters = (Parameter("R", "speed", "largest speed of the reference", absent=np.inf),)
    apart = "the answer to a step is a ramp of one slope, whatever its size; a limit of the drive bends it at the start"
    in_loop, only_in_loop = ("R",), True
    loop_sentence = "the servo's own reference moves no faster than {value}"

    def starts(self, scales):
        return []
