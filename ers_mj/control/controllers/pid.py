"""The paper's PID."""

from __future__ import annotations

from dataclasses import asdict, dataclass

from ers_mj.control.controllers.base import Controller, State
from ers_mj.errors import InputError


@dataclass(frozen=True)
class PidGains:
    """Eq. (38)'s gains: P [V/deg], I [V/(deg s)], D [V s/deg] for Table 1's servo; in V/rad the rudder would never
    break away.
    """

    P: float = 5.0
    I: float = 1.2
    D: float = 0.1

    def as_document(self) -> dict[str, float]:
        """By name."""
        return asdict(self)


def parse_pid(text: str) -> PidGains:
    """ "P=2,D=0.05" -> PidGains, what is not given as in Eq. (38).

    Raises:
        InputError: not of this form.
    """
    given: dict[str, float] = {}
    for pair in filter(None, (part.strip() for part in text.split(","))):
        key, _, value = (part.strip() for part in pair.partition("="))
        if key not in PidGains.__dataclass_fields__:
            raise InputError(
                f"--pid: there is no gain {key[:40]!r}; there are {', '.join(PidGains.__dataclass_fields__)}"
            )
        if key in given:
            raise InputError(f"--pid gives {key} twice, once was expected")
        try:
            given[key] = float(value)
        except ValueError:
            raise InputError(f"--pid: {key} is {value[:40]!r}, a number was expected, as in P=5") from None
        if not 0.0 <= given[key] < 1e6:
            raise InputError(f"--pid: {key} = {value[:40]} is not between 0 and 1e6")
    return PidGains(**given)


class Pid(Controller):
    """Eq. (38) with the signs that stabilise: u = 5 x2 + 1.2 x1 + 0.1 x3 + tau_fa + tau_spa, errors in degrees.

    As printed, with minus signs and x2 = theta_r - theta, it feeds back positively. tau_fa and tau_spa are friction,
    spring and preload in volts.
    """

    name = "pid"
    sentence = "PID of (38), with friction and spring compensated"
    takes = "pid"

    def __init__(self, servo, rate_hz, u_max=24.0, *, pid: PidGains = PidGains(), **options):
        super().__init__(servo, rate_hz, u_max, **options)
        self._pid = pid

    def feedback(self, s: State) -> float:
        """The PID alone [V]."""
        return self.servo.printed_gain * (self._pid.P * s.x2 + self._pid.I * s.x1 + self._pid.D * s.x3)

    def law(self, s: State) -> float:
        return self.feedback(s) + (self.servo.spring(s.theta) + self.servo.friction(s.omega, s.x2)) / self.servo.b
