"""A drive that ignores small commands."""

import numpy as np

from ers_mj.effects.base import Drive, Parameter


class DriveDeadZone(Drive):
    """The terminals see nothing within +-d and u - lost Sgn(u) outside: the dead time of a bridge (lost = d, where it
    is not given) or a threshold below which the drive sleeps (lost = 0).

    One that is wider one way than the other lies about ``shift``: it ends at shift + d and shift - d.

    With ``lost`` the way back is a line of slope 30 and not a jump, so that the misfit stays continuous in d.
    """

    name = "drive_dead_zone"
    sentence = "the drive ignores commands up to {d}"
    mjcf = "none: the command is processed before it reaches ctrl"
    apart = (
        "takes its share by the sign of the command, where friction takes it by that of the speed: they part when the"
        " rudder runs on against the command"
    )
    parameters = (
        Parameter("d", "input", "half-width of the dead zone"),
        Parameter(
            "lost",
            "input",
            "what is still missing outside it (all of d where none is given)",
            positive=False,
            lower=0.0,
            absent=np.inf,
        ),
        Parameter(
            "shift", "input", "middle of one that is wider one way (infinite: zero)", positive=False, absent=np.inf
        ),
    )
    tries = 3
    in_loop = ("band", "idle")
    loop_sentence = "the servo's own loop ignores what is smaller than {value}"

    def starts(self, scales):
        widths = np.array([0.01, 0.02, 0.04, 0.08, 0.16, 0.32]) * scales.input
        return [
            *(np.array([d * scales.input, np.inf, np.inf]) for d in (0.02, 0.002)),
            *(np.array([d, 0.05 * d, np.inf]) for d in widths),
        ]

    def grown(self, name, p, scales):
        """One that is wider one way, either way, from one that is as wide both ways."""
        if name != self.name or np.isfinite(p[2]):
            return []
        return [np.array([p[0], p[1], shift * p[0]]) for shift in (0.1, -0.1)]

    def command(self, p, u):
        u = u - p[2] if np.isfinite(p[2:3]).any() else u
        size, lost = np.abs(u), min(p[1:2].min(initial=np.inf), p[0])
        if lost == p[0]:
            return u - np.clip(u, -p[0], p[0])
        return np.sign(u) * np.clip(30.0 * (size - p[0]), 0.0, np.maximum(size - lost, 0.0))
