"""The finite-time feedback that both forms of the law share, and its gains."""

from __future__ import annotations

from dataclasses import dataclass
from fractions import Fraction

from ers_mj.errors import InputError


def sig(x: float, p: float) -> float:
    """|x|^p sgn(x): what every fractional power of the paper means."""
    return abs(x) ** p if x >= 0 else -(abs(x) ** p)


NAMES = ("q", "k_1", "k_2", "k_3", "l", *(f"gamma_{k}" for k in range(1, 8)))


@dataclass(frozen=True)
class Gains:
    """Eq. (40), with the odd/odd q that the text demands and that the printed m_1..m_3 belong to.

    q in (2/3, 1); k_1 [1/s], k_2 [1/s], k_3 [1/s] as q -> 1; l and gamma_1..gamma_7 stand in the conditions (33)-(35)
    alone.
    """

    q: Fraction = Fraction(97, 99)
    k_1: float = 0.25
    k_2: float = 38.0
    k_3: float = 400.0
    l: float = 0.00019
    gamma: tuple[float, ...] = (0.03, 1.0, 20.0, 1.0, 15.0, 10.0, 54.0)

    def __post_init__(self):
        if not Fraction(2, 3) < self.q <= 1:
            raise InputError(f"q = {self.q} lies outside (2/3, 1], as in 97/99")
        for name in ("k_1", "k_2", "k_3", "l"):
            if not getattr(self, name) > 0:
                raise InputError(f"{name} = {getattr(self, name):g} is not above zero")
        if len(self.gamma) != 7 or min(self.gamma) <= 0:
            raise InputError(
                f"gamma is {', '.join(f'{x:g}' for x in self.gamma)}, seven values above zero were expected"
            )

    def as_document(self) -> dict[str, float | str]:
        """By name."""
        return {
            "q": str(self.q),
            "k_1": self.k_1,
            "k_2": self.k_2,
            "k_3": self.k_3,
            "l": self.l,
            **{f"gamma_{k}": x for k, x in enumerate(self.gamma, start=1)},
        }


def parse_gains(text: str) -> Gains:
    """ "q=97/99,k_2=60,k_3=630" -> Gains, what is not given as in Eq. (40); gamma_1 to gamma_7 one by one.

    Raises:
        InputError: not of this form, or gains that no law can have.
    """
    given: dict = {}
    largest = 1e9
    gamma, named = list(Gains.gamma), set()
    for pair in filter(None, (part.strip() for part in text.split(","))):
        key, mark, value = (part.strip() for part in pair.partition("="))
        if key not in NAMES:
            raise InputError(f"--gains: there is no gain {key[:40]!r}; there are {', '.join(NAMES)}")
        try:
            x = Fraction(value)
        except (ValueError, ZeroDivisionError):
            raise InputError(
                f"--gains: {key} is {value[:40]!r}, a number or a fraction was expected, as in q=97/99"
            ) from None
        if key in named:
            raise InputError(f"--gains gives {key} twice, once was expected")
        named.add(key)
        if abs(x) > largest:
            raise InputError(f"--gains: {key} = {value[:40]} is beyond {largest:g}")
        if key.startswith("gamma_"):
            gamma[int(key[6:]) - 1] = float(x)
        else:
            given[key] = x if key == "q" else float(x)
    return Gains(**given, gamma=tuple(gamma))


class FiniteTime:
    """k_3 sig(xi_3, 3q - 2), with xi_3 = sig(x3, 1/(2q-1)) + k_2^(1/(2q-1)) (sig(x2, 1/q) + k_1^(1/q) x1)."""

    def __init__(self, gains: Gains):
        q = float(gains.q)
        self._outer, self._inner, self._power = 1.0 / (2.0 * q - 1.0), 1.0 / q, 3.0 * q - 2.0
        self._k_1, self._k_2, self._k_3 = gains.k_1 ** (1.0 / q), gains.k_2**self._outer, gains.k_3

    def xi_3(self, x1: float, x2: float, x3: float) -> float:
        """The last variable of the backstepping."""
        return sig(x3, self._outer) + self._k_2 * (sig(x2, self._inner) + self._k_1 * x1)

    def __call__(self, x1: float, x2: float, x3: float) -> float:
        """The feedback [rad/s^2]."""
        return self._k_3 * sig(self.xi_3(x1, x2, x3), self._power)
