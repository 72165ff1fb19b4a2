"""A datasheet: what is known of a servo beforehand, and what a diagnosis hands back (`model.toml`).

    Eq. (1)   J theta'' + B theta' + k_s (theta - theta_0) + T_LH sgn(theta - theta_0) + F_c sgn(theta') = n K_t i
              L i' + R i = u - n K_e theta'
    Eq. (6)   theta'' = -a_1 (theta - theta_0) - a_2 theta' - c_1 sgn(theta - theta_0) - c_2 sgn(theta') + b u

The second is the first without L, divided by J.
"""

import math
import os
import tomllib
from collections.abc import Callable, Iterable, Mapping
from dataclasses import dataclass, field
from difflib import get_close_matches
from pathlib import Path
from types import MappingProxyType
from typing import Any

from ers_mj.errors import InputError
from ers_mj.servo.units import told_units

# Table 1 of the paper (Energies 2020): the values of its joint simulation model, as printed but for the units
# of L and theta_0. K_t and K_e differ (ratio 1.69) although they are one constant in SI: both are kept. The
# sides of the gear are those that Eq. (5) needs.
TABLE_1: Mapping[str, float] = MappingProxyType(
    {
        "J": 0.0031,  # kg m^2, rudder side
        "B": 0.0098,  # N m s/rad, rudder side
        "K_t": 0.0175,  # N m/A, motor side
        "K_e": 0.0295,  # V s/rad, motor side
        "k_s": 0.0877,  # N m/rad, spring of the load
        "T_LH": 0.46,  # N m, preload of the spring
        "F_c": 0.34,  # N m, Coulomb friction, rudder side
        "R": 1.55,  # ohm
        "L": 0.0016,  # H, printed 1.6 mH
        "theta_0": math.radians(15),  # rad, printed 15 deg
        "n": 22.26,  # motor turns a rudder turn
    }
)
SHEET_UNITS: Mapping[str, str] = MappingProxyType(
    {
        "J": "kg m^2",
        "B": "N m s/rad",
        "K_t": "N m/A",
        "K_e": "V s/rad",
        "k_s": "N m/rad",
        "T_LH": "N m",
        "F_c": "N m",
        "R": "ohm",
        "L": "H",
        "n": "-",
    }
)
LUMPED = ("a_1", "a_2", "b", "c_1", "c_2", "theta_0")
SIGNED = ("theta_0", "b")  # may be negative: where the spring rests, and the sense of the input
NEVER_ZERO = ("J", "R", "n", "K_t", "b", "sample_rate_hz")
SECTIONS = ("parameters", "lumped", "recording", "baseline", "loop", "effect", "remainder", "diagnosis")
VERDICTS = ("consistent", "parameters_only", "missing_physics", "unexplained")
KINDS, SENSORS = ("P", "PD", "PI", "PID"), ("load", "link", "motor")  # of a firmware's loop, and where its sensor sits
LOOP = (
    "K", "D", "lag_s", "I", "L", "tau_s", "dead_time_s", "R", "band", "idle", "least", "most", "creep", "heavy",
    "buried", "share", "grease", "rubbed", "rotor", "hold",
)  # fmt: skip


@dataclass(frozen=True)
class Datasheet:
    """What is known of one servo. Mappings are read-only; two datasheets are equal by content.

    Attributes:
        parameters: Table 1's letters, SI, any subset.
        lumped: Eq. (6)'s, in output unit/s^2 per input unit.
        sample_rate_hz: of the recordings it comes with [Hz], or None.
        output_unit, input_unit: of these recordings, see servo.units; empty where not told.
        effects: the physics that a diagnosis added, each a name and its parameters; what stays unknown ([[remainder]])
            last.
        baseline: what a diagnosis refitted, by free names.
        loop: the firmware's loop under a position command, by LOOP's letters; empty where there is none.
        loop_kind, loop_sensor: one of KINDS, and one of SENSORS: loop and log on the load, the loop on the motor and
            the log on the load (link), both on the motor.
        verdict: one of VERDICTS, or empty where no diagnosis made it.
        intervals: the 95 % interval of what was identified, by letter or "effect.parameter", in the units of its value.
        name: where it comes from.
    """

    parameters: Mapping[str, float] = field(default_factory=dict)
    lumped: Mapping[str, float] = field(default_factory=dict)
    sample_rate_hz: float | None = None
    output_unit: str = ""
    input_unit: str = ""
    effects: tuple[tuple[str, Mapping[str, float]], ...] = ()
    baseline: Mapping[str, float] = field(default_factory=dict)
    loop: Mapping[str, float] = field(default_factory=dict)
    loop_kind: str = "P"
    loop_sensor: str = "load"
    verdict: str = ""
    intervals: Mapping[str, tuple[float, float]] = field(default_factory=dict)
    name: str = field(default="", compare=False)

    def __post_init__(self) -> None:
        for attribute in ("parameters", "lumped", "baseline", "loop", "intervals"):
            object.__setattr__(self, attribute, MappingProxyType(dict(getattr(self, attribute))))
        effects = tuple((name, MappingProxyType(dict(values))) for name, values in self.effects)
        object.__setattr__(self, "effects", effects)

    def __reduce__(self) -> tuple[Any, ...]:
        """Travel to another process as plain dictionaries."""
        effects = tuple((name, dict(values)) for name, values in self.effects)
        comes_with = self.sample_rate_hz, self.output_unit, self.input_unit
        plain = dict(self.parameters), dict(self.lumped), *comes_with, effects, dict(self.baseline)
        told = self.verdict, dict(self.intervals)
        return type(self), (*plain, dict(self.loop), self.loop_kind, self.loop_sensor, *told, self.name)

    def to_lumped(self) -> dict[str, float]:
        """Those of Eq. (6)'s parameters, of tau_e, emf_share and ampere that follow from what is given.

            a_1 = k_s/J,  a_2 = (B R + n^2 K_t K_e)/(J R),  b = n K_t/(J R),  c_1 = T_LH/J,  c_2 = F_c/J,
            tau_e = L/R [s],  emf_share = n^2 K_t K_e/(J R)/a_2,  ampere = n K_t/J [rad/s^2 per A],

        n is 1 where it is not given; what is given lumped stands as it is.
        """
        return {name: x for name, x in _following(self.parameters).items() if math.isfinite(x)} | dict(self.lumped)

    def scatter(self, identified: Mapping[str, float]) -> float:
        """Standard deviation of the logarithm of a letter, were all of them off alike and the numbers that were
        ``identified`` true: the mean square over those that follow from the letters, each by how many it has.
        """
        sizes = ("a_1", "a_2", "b", "c_1", "c_2", "tau_e", "ampere")
        off = [
            math.log(identified[name] / x) ** 2 / len(FOLLOWS[name][0].split())
            for name, x in _following(self.parameters).items()
            if name in sizes and identified.get(name, 0.0) * x > 0.0
        ]
        return math.sqrt(sum(off) / len(off)) if off else 0.0

    @property
    def emf_damping(self) -> float | None:
        """What the back-EMF damps [1/s], where the letters are given from which it follows."""
        known = {"n": 1.0, **self.parameters}
        damping = _finite(_emf_damping, known) if known.keys() >= {"K_t", "K_e", "J", "R"} else math.nan
        return None if math.isnan(damping) else damping


def _emf_damping(p: Mapping[str, float]) -> float:
    """What the back-EMF damps, n^2 K_t K_e/(J R) [1/s]."""
    return p["n"] ** 2 * p["K_t"] * p["K_e"] / (p["J"] * p["R"])


def _damping(p: Mapping[str, float]) -> float:
    return p["B"] / p["J"] + _emf_damping(p)


FOLLOWS = {
    "a_1": ("k_s J", lambda p: p["k_s"] / p["J"]),
    "a_2": ("B J K_t K_e R", _damping),
    "b": ("K_t J R", lambda p: p["n"] * p["K_t"] / (p["J"] * p["R"])),
    "c_1": ("T_LH J", lambda p: p["T_LH"] / p["J"]),
    "c_2": ("F_c J", lambda p: p["F_c"] / p["J"]),
    "theta_0": ("theta_0", lambda p: p["theta_0"]),
    "tau_e": ("L R", lambda p: p["L"] / p["R"]),
    "ampere": ("K_t J", lambda p: p["n"] * p["K_t"] / p["J"]),
    "emf_share": ("B J K_t K_e R", lambda p: _emf_damping(p) / _damping(p) if _damping(p) else math.nan),
}


def _following(parameters: Mapping[str, float]) -> dict[str, float]:
    """What FOLLOWS from these letters, NaN where that is no finite number."""
    known = {"n": 1.0, **parameters}
    return {name: _finite(rule, known) for name, (needs, rule) in FOLLOWS.items() if known.keys() >= set(needs.split())}


def _finite(rule: Callable[[Mapping[str, float]], float], known: Mapping[str, float]) -> float:
    try:
        x = rule(known)
    except ArithmeticError:  # beyond the numbers that there are, or by what is zero to all of them
        return math.nan
    return x if math.isfinite(x) else math.nan


# -- reading -----------------------------------------------------------------------------------------------


def read_datasheet(path: str | os.PathLike[str]) -> Datasheet:
    """Read a datasheet or a `model.toml`; "table1" is the paper's.

    Raises:
        InputError: whatever in the file cannot be meant, in one sentence that names it.
    """
    if os.fspath(path) == "table1":
        return Datasheet(parameters=TABLE_1, name="table1")
    path = Path(path)
    return datasheet_of(_document(path), path)


def datasheet_of(document: Mapping[str, Any], path: str | os.PathLike[str] = "datasheet") -> Datasheet:
    """The datasheet in a document laid out as its TOML is, which comes from `path`.

    Raises:
        InputError: as `read_datasheet` does.
    """
    path = Path(path)
    _refuse_unknown(document, SECTIONS, "section", str(path))
    sheet = Datasheet(
        parameters=_section(document, "parameters", TABLE_1, path),
        lumped=_section(document, "lumped", LUMPED, path),
        **_recording(document.get("recording", {}), path),
        effects=tuple(_effect(entry, path) for entry in _entries(document, path)),
        baseline=_numbers(document.get("baseline", {}), f"{path}: [baseline]"),
        **_loop(document.get("loop", {}), f"{path}: [loop]"),
        **_diagnosis(document.get("diagnosis", {}), f"{path}: [diagnosis]"),
        name=path.name,
    )
    _refuse_none_or_both(sheet, "baseline" in document, path)
    for name, x in _following(sheet.parameters).items():
        if math.isnan(x) and name != "emf_share":  # which there is none of without damping
            letters = ", ".join(FOLLOWS[name][0].split())
            raise InputError(f"{path}: [parameters] {letters} come to no finite {name}, sizes of a servo were expected")
    return sheet


def read_plant(path: str | os.PathLike[str]) -> Datasheet:
    """As read_datasheet, of a servo that is told a voltage.

    Raises:
        InputError: the model closes a position loop of its own.
    """
    sheet = read_datasheet(path)
    if sheet.loop:
        raise InputError(
            f"{path}: closes a position loop of its own ([loop]), which diagnose, identify, simulate, trial, frequency,"
            " view and export take"
        )
    return sheet


def _document(path: Path) -> dict[str, Any]:
    try:
        return tomllib.loads(path.read_bytes().decode("utf-8-sig"))
    except FileNotFoundError:
        raise InputError(f"{path}: there is no such file (the paper's datasheet is called table1)") from None
    except OSError as error:
        raise InputError(f"{path}: cannot be read ({error.strerror})") from None
    except (ValueError, RecursionError) as error:
        raise InputError(f"{path}: is not valid TOML ({str(error)[:120]})") from None


def _section(document: Mapping[str, Any], section: str, known: Iterable[str], path: Path) -> dict[str, float]:
    """One section's numbers: its keys known, no value negative or zero where that makes no sense."""
    where = f"{path}: [{section}]"
    numbers = _numbers(document.get(section, {}), where, known)
    for key, x in numbers.items():
        refuse_impossible(key, x, where)
    return numbers


def _recording(table: object, path: Path) -> dict[str, Any]:
    """The rate and the units of the recordings that a file comes with."""
    where, known = f"{path}: [recording]", ("sample_rate_hz", "output_unit", "input_unit")
    if not isinstance(table, Mapping):
        raise InputError(f"{where} is {_kind(table)}, a table was expected")
    _refuse_unknown(table, known, "key", where)
    units = told_units(table, where)
    rest = {key: x for key, x in table.items() if key not in units}
    return units | _section({"recording": rest}, "recording", known, path)


def refuse_impossible(key: str, x: float, where: str) -> None:
    """Raise InputError where no servo has this value of a key."""
    if x < 0 and key not in SIGNED:
        raise InputError(f"{where} has the negative {key} = {x:g}, zero or more was expected")
    if x == 0 and key in NEVER_ZERO:
        raise InputError(f"{where} has {key} = 0, which no servo has")


def _loop(table: object, where: str) -> dict[str, Any]:
    """A firmware's loop: its numbers, kind and sensor."""
    if not isinstance(table, dict) or not table:
        _numbers(table, where)
        return {}
    words = {}
    for key, known in (("kind", KINDS), ("sensor", SENSORS)):
        words[key] = table.get(key, known[0])
        if words[key] not in known:
            raise InputError(f"{where} has {key} = {words[key]!r}, one of {', '.join(known)} was expected")
    loop = _numbers({k: v for k, v in table.items() if k not in words}, where, LOOP)
    for key, x in loop.items():
        if x < 0 and key not in ("D", "hold"):
            raise InputError(f"{where} has the negative {key} = {x:g}, zero or more was expected")
    if not loop.get("K", 0.0) > 0.0:
        raise InputError(f"{where} has no K above zero, which every position loop has")
    return {"loop": loop, "loop_kind": words["kind"], "loop_sensor": words["sensor"]}


def _diagnosis(table: object, where: str) -> dict[str, Any]:
    """What a diagnosis said of the model: its verdict and its intervals."""
    if not isinstance(table, Mapping):
        raise InputError(f"{where} is {_kind(table)}, a table was expected")
    _refuse_unknown(table, ("verdict", "ci95"), "key", where)
    verdict, intervals = table.get("verdict", ""), table.get("ci95", {})
    if verdict not in ("", *VERDICTS):
        raise InputError(f"{where} has verdict = {verdict!r}, one of {', '.join(VERDICTS)} was expected")
    if not isinstance(intervals, Mapping):
        raise InputError(f"{where} has ci95 = {_kind(intervals)}, a table was expected")
    found = {}
    for key, ends in intervals.items():
        if not isinstance(ends, list | tuple) or len(ends) != 2:
            raise InputError(f"{where} ci95 {key} is no pair of numbers, as in [1.0, 2.0]")
        low, high = (_number(x, f"{where} ci95 {key}") for x in ends)
        if low > high:
            raise InputError(f"{where} ci95 {key} ends at {high:g}, below its beginning at {low:g}")
        found[key] = (low, high)
    return {"verdict": verdict, "intervals": found}


def _entries(document: Mapping[str, Any], path: Path) -> list[object]:
    """The effects, and behind them the tables of what is unknown."""
    found: list[object] = []
    for section in ("effect", "remainder"):
        entries = document.get(section, [])
        if not isinstance(entries, list):
            raise InputError(f"{path}: {section} is {_kind(entries)}, a list of [[{section}]] was expected")
        found += entries
    return found


def _effect(entry: object, path: Path) -> tuple[str, dict[str, float]]:
    where = f"{path}: [[effect]]"
    if not isinstance(entry, dict):
        raise InputError(f"{where} holds {_kind(entry)}, a table with name and parameters was expected")
    _refuse_unknown(entry, ("name", "parameters"), "key", where)
    name = entry.get("name")
    if not isinstance(name, str) or not name:
        raise InputError(f"{where} has no name in text")
    return name, _numbers(entry.get("parameters", {}), f"{where} {name}")


def _numbers(table: object, where: str, known: Iterable[str] | None = None) -> dict[str, float]:
    """The finite numbers of a table, under known keys where any are given."""
    if not isinstance(table, Mapping):
        raise InputError(f"{where} is {_kind(table)}, a table was expected")
    if known is not None:
        _refuse_unknown(table, known, "key", where)
    return {key: _number(x, f"{where} {key}") for key, x in table.items()}


def _number(x: object, where: str) -> float:
    if isinstance(x, bool) or not isinstance(x, int | float):
        raise InputError(f"{where} is {_kind(x)}, a number was expected")
    try:
        number = float(x)
    except OverflowError:
        number = math.inf
    if not math.isfinite(number):
        raise InputError(f"{where} is {number}, a finite number was expected")
    return number


def _refuse_unknown(table: Mapping[str, Any], known: Iterable[str], noun: str, where: str) -> None:
    known = list(known)
    for key in table:
        if key not in known:
            near = get_close_matches(key, known, n=1, cutoff=0.4)
            hint = f"did you mean {near[0]}? " if near else ""
            raise InputError(f"{where}: there is no {noun} {key[:40]!r}; {hint}known are {', '.join(known)}")


def _refuse_none_or_both(sheet: Datasheet, is_model: bool, path: Path) -> None:
    if not sheet.parameters and not sheet.lumped:
        raise InputError(f"{path}: gives nothing of the servo, [parameters] or [lumped] was expected")
    if sheet.parameters and sheet.lumped and not is_model:
        raise InputError(f"{path}: has both [parameters] and [lumped], only a model with a [baseline] may; drop one")


def _kind(x: object) -> str:
    kinds = {bool: "true or false", str: "text", dict: "a table", list: "a list", int: "a number", float: "a number"}
    return kinds.get(type(x), "a date or a time")
