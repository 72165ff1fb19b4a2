"""A drive that gives no more than its supply."""

import numpy as np

from ers_mj.effects.base import Drive, Parameter

SOFT = 10.0  # sharpness from which a soft knee is begun


class VoltageSaturation(Drive):
    """The terminals see the command u clipped at +-u_max, or u / (1 + |u / u_max|^sharpness)^(1 / sharpness): a drive
    that gives in before.
    """

    name = "voltage_saturation"
    sentence = "the drive gives no more than {u_max}, whatever is commanded"
    mjcf = "the ctrlrange of the motor; a soft knee is put into the command before it reaches ctrl"
    apart = "one level of the command above which nothing changes, at any speed; current_limit depends on speed"
    parameters = (
        Parameter("u_max", "input", "largest input that reaches the motor", absent=np.inf),
        Parameter(
            "sharpness",
            "ratio",
            "exponent of a soft knee; a plain clip where there is none",
            lower=4.0,  # half of u_max is given to 1.5 % still: what bends more is a supply that sags, no knee
            upper=100.0,
            absent=np.inf,
        ),
    )
    needs = (("u_max",),)
    in_loop = ("L",)
    loop_sentence = "the servo's own loop is limited: its motor pushes with {value} at most"
    tries = 3

    def starts(self, scales):
        return [*(np.array([part * scales.input, np.inf]) for part in (0.95, 0.8)), np.array([scales.input, SOFT])]

    def grown(self, name, p, scales):
        """From a plain clip: with a soft knee."""
        return [np.array([p[0], SOFT])] if name == self.name and np.isfinite(p[0]) and not np.isfinite(p[1]) else []

    def command(self, p, u):
        u_max, sharpness = p
        if not (np.isfinite(u_max) and np.isfinite(sharpness)):
            return np.clip(u, -u_max, u_max)
        return u / (1.0 + np.abs(u / u_max) ** sharpness) ** (1.0 / sharpness)

    def edit_spec(self, p, c, twin):
        if np.isfinite(p[0]):
            twin.spec.actuator("motor").ctrlrange = [-p[0], p[0]]
        return True
