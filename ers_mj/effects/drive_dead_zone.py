"""A drive that ignores small commands."""

import numpy as np

from ers_mj.effects.base import Drive, Parameter


class DriveDeadZone(Drive):
    """The terminals see u - d Sgn(u) outside +-d and nothing inside (dead time of a bridge)."""

    name = "drive_dead_zone"
    sentence = "the drive swallows the first {d} of every command"
    mjcf = "none: the command is processed before it reaches ctrl"
    parameters = (Parameter("d", "input", "half-width of the dead zone"),)

    def starts(self, scales):
        return [np.array([0.02 * scales.input])]

    def command(self, p, u):
        return u - np.clip(u, -p[0], p[0])
