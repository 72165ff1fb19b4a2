"""A sensor whose reading is not in proportion to the angle."""

import numpy as np

from ers_mj.effects.base import Parameter, Sensor

ORDERS = (0.5, 1, 2, 3, 4, 6, 8)  # periods within the travel from which a fit is begun


class SensorNonlinearity(Sensor):
    """y = theta + bend theta^2 + twist theta^3, a loaded potentiometer; or + A sin(2 pi theta / period + phase), an
    eccentric scale.

    Terms that are absent are infinite. A gain and an offset of the sensor are no error that position can tell from the
    plant's.
    """

    name = "sensor_nonlinearity"
    sentence = "the sensor errs along the travel (bend {bend}, twist {twist}, wave {A} every {period})"
    mjcf = "none: the reading is bent after the simulation"
    apart = (
        "errs at rest as in motion and in proportion to nothing but the place; a variable_ratio changes the dynamics"
    )
    parameters = (
        Parameter("bend", "per_position", "error per angle squared", positive=False, absent=np.inf),
        Parameter("twist", "per_position_squared", "error per angle cubed", positive=False, absent=np.inf),
        Parameter("A", "position", "amplitude of the wave", positive=False, absent=np.inf),
        Parameter("period", "position", "period of the wave", absent=np.inf),
        Parameter("phase", "phase", "phase of the wave at angle zero", positive=False, absent=np.inf),
    )
    needs, together = (("bend", "twist", "A"),), (("A", "period", "phase"),)
    tries = 2
    wave = ((2,), 4)
    instant = True

    def starts(self, scales):
        travel = scales.high - scales.low
        size = 0.01 * travel
        polynomial = [np.array([size / scales.position**2, size / scales.position**3, np.inf, np.inf, np.inf])]
        periods = [*(travel / order for order in ORDERS), *scales.finer_waves("reading", ORDERS[-1])]
        return polynomial + [np.array([np.inf, np.inf, size, period, 0.0]) for period in periods]

    def measure(self, p, t, y):
        bend, twist, amplitude, period, phase = p
        wave = amplitude * np.sin(2 * np.pi / period * y + phase) if np.isfinite(period) else 0.0
        return (
            y + wave + (bend * y**2 if np.isfinite(bend) else 0.0) + (twist * y * y * y if np.isfinite(twist) else 0.0)
        )

    def is_within(self, p, y, step):
        error = self.measure(p, None, y) - y
        beside = np.stack([np.ones(y.size), y], axis=1)  # an offset and a gain are no error that position can tell
        error = error - beside @ np.linalg.lstsq(beside, error, rcond=None)[0]
        return float(np.max(np.abs(error))) < step

    def behind(self, p, y):
        theta = y
        with np.errstate(over="ignore", invalid="ignore"):  # of a sensor that no output explains
            for _ in range(6):
                step = (y - self.measure(p, None, theta)) / np.maximum(self._slope(p, theta), 0.2)
                theta = theta + step
                if np.fmax.reduce(np.abs(step), initial=0.0) < 1e-7:  # its error is of the order of its square
                    break
        return theta

    def _slope(self, p, theta):
        """Slope of the reading by the output."""
        bend, twist, amplitude, period, phase = p
        rate = 2 * np.pi / period
        wave = amplitude * rate * np.cos(rate * theta + phase) if np.isfinite(period) else 0.0
        return (
            1.0
            + wave
            + (2.0 * bend * theta if np.isfinite(bend) else 0.0)
            + (3.0 * twist * theta**2 if np.isfinite(twist) else 0.0)
        )

    def describe(self, values):
        terms = {
            "bend": "{bend} times the angle squared",
            "twist": "{twist} times its cube",
            "period": "an amplitude of {A} every {period}",
        }
        return "the sensor errs along the travel, by " + " and ".join(
            text.format(**values) for name, text in terms.items() if values[name] != "none"
        )
