"""Recordings with known truth: a model under an input."""

from __future__ import annotations

import os
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any, TypedDict, Unpack

import numpy as np

from ers_mj.data.columns import input_name, output_name
from ers_mj.data.input_file import read_input
from ers_mj.data.recording import Recording, from_columns, write_recording
from ers_mj.door.known import Known, known
from ers_mj.door.results import frame, framed
from ers_mj.door.saving import make_room, plain, refuse_table
from ers_mj.errors import InputError, refuse_other
from ers_mj.plants.inputs import DURATION, INPUTS, RATE_HZ
from ers_mj.position_loop.saved import simulate_loop
from ers_mj.servo.datasheet import Datasheet
from ers_mj.servo.simulation import parse_effect, simulate_recording
from ers_mj.servo.units import input_unit_of, output_unit_of

if TYPE_CHECKING:
    import pandas as pd

PLANTS, LINKAGES, PLAYS = ("reduced", "mujoco"), ("constant", "rod"), ("gap", "printed")
LONGEST = 1e5  # [s] that an input may last: a day, which takes minutes
Voltage = str | os.PathLike[str] | Recording | tuple[Any, Any]  # an input
Effect = str | tuple[str, Mapping[str, float]]


class PlantOptions(TypedDict, total=False):
    """Which `plant`, reduced or mujoco, half-width `gap` of a play [rad], `linkage` constant or rod, `play` gap or
    printed, whether the `inductance` acts.
    """

    plant: str
    gap: float
    linkage: str
    play: str
    inductance: bool


@dataclass(frozen=True, eq=False)
class Simulation:
    """A simulated recording; `simulate` makes it.

    Attributes:
        t, u, theta: time [s], input [`input_unit`], what the sensor reads [`output_unit`], each (N,); theta[k] is taken
            before u[k] acts.
        input_unit: the model's.
        output_unit: the model's.
    """

    t: np.ndarray
    u: np.ndarray
    theta: np.ndarray
    _summary: Mapping[str, Any]
    input_unit: str = "V"
    output_unit: str = "rad"

    @property
    def recording(self) -> Recording:
        """The same under the checks that a file gets.

        Raises:
            InputError: it is no usable recording: too short, or an output that never moves.
        """
        return from_columns(self._columns(), name=f"{self._summary['input']}, simulated")

    def _columns(self) -> dict[str, np.ndarray]:
        return {"t_s": self.t, input_name(self.input_unit): self.u, output_name(self.output_unit): self.theta}

    def to_dict(self) -> dict[str, Any]:
        """What was simulated, and how far it moved: the JSON of the command, less the file."""
        return dict(plain(self._summary))

    def to_frame(self) -> pd.DataFrame:
        """The columns of `save`, a row a sample.

        Raises:
            MissingPackage: pandas is not installed.
        """
        columns = self._columns()
        return frame([dict(zip(columns, row, strict=True)) for row in zip(*columns.values(), strict=True)])

    def save(self, path: str | os.PathLike[str], force: bool = False) -> Path:
        """Write the recording as CSV: t_s, and input and output under the names of their units (u_V, theta_rad).

        Args:
            path: the file; in a folder that exists it is called recording.csv.
            force: overwrite it.

        Raises:
            InputError: the file is of another format, exists already, or cannot be written.
        """
        file = Path(path) / "recording.csv" if Path(path).is_dir() else Path(path)
        refuse_table(file, force)
        make_room(file)
        write_recording(file, self._columns())
        return file

    def __repr__(self) -> str:
        s = self._summary
        return (
            f"<Simulation {s['input']}: {s['samples']} samples over {s['duration_s']:.4g} s, {self.course},"
            f" {s['plant']} plant>"
        )

    @property
    def course(self) -> str:
        """From where to where it moved, in words."""
        if self.output_unit == "rad":
            return f"{np.degrees(self.theta.min()):.1f} to {np.degrees(self.theta.max()):.1f} deg"
        return f"{self.theta.min():.4g} to {self.theta.max():.4g} {self.output_unit}"

    def _repr_html_(self) -> str:
        from ers_mj.report.notebook import simulation_page

        units = self.input_unit, self.output_unit
        return framed(simulation_page(repr(self)[1:-1], self.t, self.u, self.theta, units), 460)


def simulate(
    model: Known = "table1",
    input: Voltage = "multisine",
    *,
    effects: Iterable[Effect] = (),
    noise: float = 0.0,
    seed: int = 0,
    rate_hz: float | None = None,
    duration: float | None = None,
    **options: Unpack[PlantOptions],
) -> Simulation:
    """Simulate a servo from rest at theta_0: a recording with known truth, as `ers simulate` writes it.

    Args:
        model: datasheet or model: a path, "table1", a mapping, a datasheet or a model, with the effects that it holds.
        input: a name (multisine, chirp, ramp, steps, square) for a servo told a voltage, a CSV file (t_s, u_V; of a
            model told something else, tau_cmd_Nm, i_cmd_A, u_duty_pct, theta_ref_rad or x_ref_m), (t [s], u) of shape
            (N,) each, or a recording whose input is taken.
        effects: further ones, (name, {parameter: value}) in SI, or as the command line has them: "stribeck:dF_s=0.1".
        noise: standard deviation of the sensor's noise [output unit].
        seed: of the noise.
        rate_hz: of a named input [Hz]; 1000 by default.
        duration: of a named input [s]; 10 by default.
        options: plant="reduced", gap=0.0 [rad], linkage="constant", play="gap", inductance=False: the command's
            defaults. A model's own `simulate` runs it as it was identified.

    Raises:
        InputError: what was given cannot be simulated, in one sentence.

    Examples:
        >>> import ers_mj as ers
        >>> ers.simulate("table1", "steps", duration=2.0, rate_hz=500.0, effects=["bias_torque:tau_0=0.1"])
        <Simulation steps: 1000 samples over 1.998 s, -3.0 to 74.7 deg, reduced plant>

    Source: Energies 2020, Eq. (5), or Eq. (1) with the inductance.
    """
    _refuse_options(options, noise)
    sheet = known(model) or Datasheet()
    added = [parse_effect(effect) if isinstance(effect, str) else effect for effect in effects]
    output_unit = output_unit_of(sheet.output_unit)
    input_unit = input_unit_of(sheet.input_unit, None if sheet.input_unit else output_unit if sheet.loop else "V")
    if sheet.loop:
        _refuse_beside_a_loop(added, options)
    told_as = input_name(input_unit)
    _refuse_voltage(input, told_as)
    name, t, u = _signal(input, rate_hz, duration, [told_as, "theta_ref_rad" if sheet.loop else "u_V"])
    if not t[-1] - t[0] <= LONGEST:
        raise InputError(f"the input {name} lasts {t[-1] - t[0]:.4g} s, at most {LONGEST:g} s were expected")
    if sheet.loop:
        y = simulate_loop(sheet, t, u, plant=options.get("plant", "reduced"), noise=noise, seed=seed)
    else:
        asked = {**options, "is_angle": output_unit == "rad"}
        y = simulate_recording(sheet, t, u, effects=added, noise=noise, seed=seed, **asked)["theta_rad"]
    told = {"input": name, "noise_rad": noise, "seed": seed, "effects": [*sheet.effects, *added]}
    units = {"input_unit": input_unit, "output_unit": output_unit}
    return Simulation(t, u, y, _summary(t, y, told | units, options), input_unit, output_unit)


def _summary(t: np.ndarray, y: np.ndarray, asked: dict[str, Any], options: PlantOptions) -> dict[str, Any]:
    """What was simulated, and its course in three numbers, under the name of the output and its unit."""
    name = {"rad": "theta", "m": "x"}.get(asked["output_unit"], "y")
    course = {f"{name}_rms": float(y.std()), f"{name}_min": float(y.min()), f"{name}_max": float(y.max())}
    return asked | {
        "plant": options.get("plant", "reduced"),
        "linkage": options.get("linkage", "constant"),
        "inductance": options.get("inductance", False),
        "gap_rad": options.get("gap", 0.0),
        "play": options.get("play", "gap"),
        "samples": int(t.size),
        "duration_s": float(t[-1] - t[0]),
        "effects": [{"name": name, "parameters": dict(values)} for name, values in asked["effects"]],
        **{f"{what}_{asked['output_unit']}": x for what, x in course.items()},
    }


def _refuse_options(options: PlantOptions, noise: float) -> None:
    refuse_other("plant", options.get("plant", "reduced"), PLANTS)
    refuse_other("linkage", options.get("linkage", "constant"), LINKAGES)
    refuse_other("play", options.get("play", "gap"), PLAYS)
    if not 0 <= noise < np.inf:
        raise InputError(f"the noise is {noise:g} rad, zero or more was expected")


def _refuse_voltage(given: Voltage, column: str) -> None:
    """Raise InputError for an input by name where the model is told no voltage."""
    if column != "u_V" and isinstance(given, str) and given in INPUTS:
        raise InputError(f"--input {given} is a voltage; this model takes a CSV t_s,{column}")


def _refuse_beside_a_loop(added: Sequence[object], options: PlantOptions) -> None:
    """Raise InputError for what no model of a position command takes."""
    for option, is_given in (("--effect", added), ("--gap", options.get("gap"))):
        if is_given:
            raise InputError(f"{option} is for models without a [loop], this one's effects stand in its file")


def _signal(
    given: Voltage, rate_hz: float | None, duration: float | None, columns: Sequence[str]
) -> tuple[str, np.ndarray, np.ndarray]:
    """Name, times [s] and values of an input, of a file the first of these ``columns`` that it has."""
    if isinstance(given, str) and given in INPUTS:
        rate, seconds, most = rate_hz or RATE_HZ, duration or DURATION, 20_000_000
        if not 2 <= rate * seconds <= most:
            raise InputError(
                f"{seconds:g} s at {rate:g} Hz are {rate * seconds:.3g} samples, 2 to {most:.0e} were expected"
            )
        t = np.arange(round(rate * seconds)) / rate
        return given, t, INPUTS[given](t)
    for option, value in (("--rate-hz", rate_hz), ("--duration", duration)):
        if value is not None and not (isinstance(given, str) and not Path(given).exists()):
            raise InputError(f"{option} is for named inputs ({', '.join(INPUTS)}), this one brings its own times")
    if isinstance(given, Recording):
        return given.name, given.t, given.u
    if isinstance(given, str | os.PathLike):
        file = Path(given)
        if not file.exists() and not file.suffix:
            raise InputError(
                f"--input {file}: there is no such file and no input of that name; there are {', '.join(INPUTS)}"
            )
        return str(given), *read_input(file, columns)
    return "arrays", *_arrays(given)


def _arrays(given: tuple[Any, Any]) -> tuple[np.ndarray, np.ndarray]:
    """(t, u) as floats (N,)."""
    try:
        t, u = (np.array(x, float) for x in given)
    except (TypeError, ValueError):
        raise InputError("the input is no pair of arrays (t, u), nor a name, a file or a recording") from None
    if t.ndim != 1 or t.shape != u.shape or t.size < 2:
        raise InputError(f"the input has times of shape {t.shape} and voltages of {u.shape}, (N,) was expected of both")
    if not (np.isfinite(t).all() and np.isfinite(u).all() and (np.diff(t) > 0).all()):
        raise InputError("the input has holes, or times that do not rise")
    return t, u
