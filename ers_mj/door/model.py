"""A servo's model as other tools take it: to simulate, to step, to compare with a recording, and to export."""

from __future__ import annotations

import os
from collections.abc import Iterable, Sequence
from dataclasses import replace
from functools import cached_property
from pathlib import Path
from typing import TYPE_CHECKING, Any, Final

import numpy as np

from ers_mj.data.columns import input_name, output_name
from ers_mj.data.recording import Recording, read_recording
from ers_mj.door.known import Known, known
from ers_mj.door.results import frame, framed
from ers_mj.door.saving import make_room, plain
from ers_mj.door.simulating import Simulation, Voltage, simulate
from ers_mj.errors import InputError
from ers_mj.position_loop.saved import looped_plant
from ers_mj.servo.datasheet import Datasheet
from ers_mj.servo.model_file import write_model
from ers_mj.servo.simulation import build_plant, inertia_of
from ers_mj.servo.units import Unit, input_unit_of, output_unit_of

if TYPE_CHECKING:
    import control
    import mujoco
    import pandas as pd

    from ers_mj.control.stepping import Stepper
    from ers_mj.door.exporting import Exported
    from ers_mj.export.servo import Servo
    from ers_mj.plants.mujoco.joint import JointLines
    from ers_mj.plants.mujoco.plant import MechanicalPlant
    from ers_mj.plants.reduced import ReducedModel


class Model:
    """A servo with the effects that its datasheet or a diagnosis names: `load_model` reads one, a diagnosis has one.

    Args:
        datasheet: a path (a datasheet or model.toml), "table1", a mapping laid out as the TOML, a datasheet, a model.
        output_unit: rad, m or V, which Eq. (6)'s letters are in. None: as the file tells, rad where it does not.
        input_unit: V, % of duty, N m or A. None: as the file tells, V where it does not.
        inductance: whether the winding's time constant acts; by default one that a diagnosis found, no datasheet's.

    Raises:
        InputError: the datasheet cannot be meant, there is no such unit, or the file tells another one.

    Examples:
        >>> import ers_mj as ers
        >>> model = ers.load_model("table1")
        >>> model.to_control().input_labels, model.to_control().output_labels
        (['u_V'], ['theta_rad'])
        >>> model.to_mujoco().compile().nu
        4
    """

    def __init__(
        self, datasheet: Known, *, output_unit: Unit = None, input_unit: Unit = None, inductance: bool | None = None
    ):
        sheet = known(datasheet)
        if sheet is None:
            raise InputError("no datasheet was given, a path, a mapping, a datasheet or a model was expected")
        self.output_unit: Final = output_unit_of(sheet.output_unit, output_unit, sheet.name)
        self.input_unit: Final = input_unit_of(sheet.input_unit, input_unit, sheet.name)
        self._datasheet = replace(sheet, output_unit=self.output_unit, input_unit=self.input_unit)
        self.inductance: Final = sheet.baseline.get("tau_e", 0.0) > 0 if inductance is None else inductance
        self._loop: Stepper | None = None

    @property
    def datasheet(self) -> Datasheet:
        """What is known of the servo, and the effects on top."""
        return self._datasheet

    @property
    def effects(self) -> tuple[str, ...]:
        """Names of the effects."""
        return tuple(name for name, _ in self._datasheet.effects)

    @cached_property
    def plant(self) -> ReducedModel:
        """The reduced plant, Eq. (5) or (1), with the effects, torques per inertia.

        Raises:
            InputError: the datasheet does not tell b, or an effect is none of the library's.
        """
        return build_plant(self._datasheet, inductance=self.inductance)  # type: ignore[return-value]

    def _multibody(self) -> MechanicalPlant:
        is_angle = self.output_unit == "rad"
        return build_plant(  # type: ignore[return-value]
            self._datasheet, plant="mujoco", inductance=self.inductance, is_angle=is_angle
        )

    # -- what it does --------------------------------------------------------------------------------------------------

    def simulate(self, input: Voltage = "multisine", **options: Any) -> Simulation:
        """The model as it was identified, from rest at theta_0, under an input (see `simulate`, which takes the same
        options).

        Raises:
            InputError: the input cannot be used.
        """
        return simulate(self, input, **{"inductance": self.inductance, **options})

    def residual(self, recording: Recording | str | os.PathLike[str]) -> np.ndarray:
        """What the model leaves of a recording.

        Args:
            recording: one, or a path to one, in the model's units.

        Returns:
            Measured less simulated (N,) [output unit], NaN where nothing was measured: a free run under its input, from
            the output and speed that fit its first 50 ms (or 10 samples) best.

        Raises:
            InputError: it is in other units, or the motion leaves all bounds.
        """
        from ers_mj.data.prepared import trace_of
        from ers_mj.estimation.initial_state import fitted_start
        from ers_mj.estimation.known_model import model_of
        from ers_mj.servo.simulation import finite

        read = recording if isinstance(recording, Recording) else read_recording(recording)
        if read.output_unit != self.output_unit:
            raise InputError(f"{read.name}: its output is in {read.output_unit}, the model's is in {self.output_unit}")
        trace = trace_of(read, self._datasheet.parameters.get("J"))
        own = model_of(self._datasheet, [trace], self.output_unit == "rad", inductance=self.inductance)
        left: np.ndarray = read.y - finite(trace.t, own.predict(trace, start=fitted_start(own, trace)))
        return left

    def reset(self, rate_hz: float = 1000.0, theta: float | None = None, omega: float = 0.0) -> float:
        """Begin a loop of one's own.

        Args:
            rate_hz: of its samples [Hz].
            theta: where the servo starts [output unit], theta_0 by default.
            omega: its speed there [output unit/s].

        Returns:
            The first reading [output unit].

        Raises:
            InputError: a rate that cannot be, or a dead time beyond what a loop keeps.
        """
        from ers_mj.control.stepping import Stepper

        self._loop = Stepper(self.plant, rate_hz, theta, omega)
        return self._loop.reading

    def step(self, u: float) -> float:
        """Hold the input u for one sample of the loop that `reset` began (1 kHz from rest without).

        Returns:
            The reading at its end [output unit], which is what a controller has for its next u.

        Examples:
            >>> import ers_mj as ers
            >>> model = ers.load_model("table1")
            >>> theta = model.reset(rate_hz=1000.0)
            >>> for _ in range(100):
            ...     theta = model.step(40.0 * (0.3 - theta))
            >>> abs(theta - 0.3) < 0.05
            True
        """
        if self._loop is None:
            self.reset()
            assert self._loop is not None
        return self._loop.step(u)

    # -- what it becomes -----------------------------------------------------------------------------------------------

    @property
    def signals(self) -> tuple[str, str]:
        """Names of input and output, with their units."""
        return input_name(self.input_unit), output_name(self.output_unit)

    def to_control(
        self, theta: float | None = None, omega: float = 1.0, *, rate_hz: float | None = None, pade: int = 4
    ) -> control.StateSpace:
        """The slipping plant as a python-control StateSpace, from input to reading.

        Coulomb friction and preload are constant while it slips and drop out; a play is closed; laws of effects enter
        with their slopes (`losses("control")` says what does not).

        Args:
            theta: the point [output unit], theta_0 by default.
            omega: its speed there [output unit/s].
            rate_hz: of a loop: the plant from sample to sample, dead times exact. None: continuous.
            pade: order of the approximations that stand for dead times in continuous time.

        Of a model with a [loop] the servo with its loop, from reference to reading, about its rest, as `export` writes
        it.

        Raises:
            InputError: of such a model, another point than its rest.

        Source: Eq. (6) of Energies 2020, linear about the point.
        """
        from ers_mj.control.frequency.linear import continuous, linearised, named
        from ers_mj.export.python_control import closed

        if self._datasheet.loop:
            return closed(self._leaving, theta, omega, rate_hz)
        theta = self.plant.coefficients.theta_0 if theta is None else theta
        if rate_hz is None:
            system = continuous(self.plant, theta, omega, pade)
        else:
            system = linearised(self.plant, rate_hz, theta, omega).held
        return named(system, self.plant, self.signals, self.output_unit)

    def to_nonlinear(self, rate_hz: float = 1000.0) -> control.NonlinearIOSystem:
        """The whole plant, all effects, as a discrete python-control system that steps the event-exact reduced plant;
        of a model with a [loop] the servo with its loop in the portable steps that `export` writes.

        Its state 0, python-control's default, is rest at theta_0. Only lost samples of a sensor are not in it.

        Args:
            rate_hz: of its samples [Hz].

        Examples:
            >>> import control, numpy as np, ers_mj as ers
            >>> servo = ers.load_model("table1").to_nonlinear(rate_hz=500.0)
            >>> t = np.arange(50) / 500.0
            >>> control.input_output_response(servo, t, np.full(50, 6.0)).outputs.shape
            (50,)
        """
        from ers_mj.control.stepping import system
        from ers_mj.export.python_control import built

        if self._datasheet.loop:
            return built(self._leaving)["plant"](rate_hz)
        return system(self.plant, rate_hz, self.signals)

    def to_mujoco(self) -> mujoco.MjSpec:
        """The plant as a MuJoCo MjSpec: the rudder system where the datasheet gives J, n and K_t, else one joint of
        inertia 1. Control: actuator `motor`, in input units; the output is the tendon `rudder_angle`; keyframe `home`
        is rest at theta_0 (`losses("mujoco")` says what MJCF cannot carry).

        Raises:
            InputError: the datasheet cannot make a plant.
        """
        if self._datasheet.loop:
            return looped_plant(self._datasheet, self.output_unit == "rad").spec()
        return self._multibody().spec()

    def joint_lines(
        self,
        joint: str = "servo",
        *,
        inertia: float | None = None,
        bodies: float = 0.0,
        timestep: float = 0.002,
        actuator: str = "motor",
    ) -> JointLines:
        """The lines for a joint of one's own MJCF: armature, damping, frictionloss, springref, actuator.

        Args:
            joint: its name there.
            inertia: J at the joint [kg m^2, or kg of a slide]; the datasheet's by default.
            bodies: what the bodies there have of J about the joint; the armature is the rest.
            timestep: of that model [s]: the friction's stiffness and a delay are written for it.
            actuator: "motor", which every importer knows, or "dcmotor", with the winding's time constant.

        Returns:
            `xml` (its text), the attributes, and `left_out`: what they cannot carry.

        Raises:
            InputError: the inertia is not known, or what was given cannot be.

        Examples:
            >>> import ers_mj as ers
            >>> lines = ers.load_model("table1").joint_lines("elbow")
            >>> lines.joint["armature"], lines.actuator["gear"]
            (0.0031, 0.25132258064516133)
        """
        from ers_mj.plants.mujoco.joint import joint_lines

        J = self._datasheet.parameters.get("J") if inertia is None else inertia
        if J is None:
            raise InputError("the datasheet gives no J, so torques are not known: give inertia=, in kg m^2")
        is_angle = self.output_unit == "rad"
        return joint_lines(
            self.plant, float(J), joint=joint, bodies=bodies, timestep=timestep, actuator=actuator, is_angle=is_angle
        )

    def export(self, folder: str | os.PathLike[str], to: Sequence[str] = ("mujoco",), force: bool = False) -> Exported:
        """Write the model for other tools, and LOSSES.md (`ers export` lists the targets).

        Raises:
            InputError: no such target, or the folder holds files and no `force` is given.
        """
        from ers_mj.door.exporting import export

        return export(self._leaving, folder, to, force)

    @property
    def _leaving(self) -> Servo:
        from ers_mj.export.servo import servo_of

        return servo_of(self._datasheet, self.output_unit, self.input_unit, self.signals, self.inductance)

    def losses(self, target: str) -> tuple[str, ...]:
        """What a conversion cannot carry, a sentence each.

        Args:
            target: "control", "nonlinear", "mujoco" or "joint".
        """
        from ers_mj.door.losses import losses

        return losses(
            self.plant, self._multibody, lambda: self.joint_lines(inertia=inertia_of(self._datasheet)), target
        )

    # -- as any result -------------------------------------------------------------------------------------------------

    def to_dict(self) -> dict[str, Any]:
        """The model as its TOML is laid out, with the units of output and input."""
        sheet = self._datasheet
        told = {
            "parameters": sheet.parameters,
            "lumped": sheet.to_lumped(),
            "baseline": sheet.baseline,
            "effect": [{"name": name, "parameters": values} for name, values in sheet.effects],
            "loop": {"kind": sheet.loop_kind, "sensor": sheet.loop_sensor, **sheet.loop} if sheet.loop else {},
            "output_unit": self.output_unit,
            "input_unit": self.input_unit,
        }
        return dict(plain(told))

    def to_frame(self) -> pd.DataFrame:
        """owner (servo or an effect), parameter and value, a row each.

        Raises:
            MissingPackage: pandas is not installed.
        """
        return frame([{"owner": owner, "parameter": name, "value": x} for owner, name, x in self._numbers()])

    def _numbers(self) -> Iterable[tuple[str, str, float]]:
        sheet = self._datasheet
        for name, x in (sheet.to_lumped() | dict(sheet.baseline)).items():
            yield "servo", name, x
        for effect, values in sheet.effects:
            for name, x in values.items():
                yield effect, name, x

    def save(self, path: str | os.PathLike[str], force: bool = False) -> Path:
        """Write the model as TOML, which `load_model` reads back exactly; called model.toml in a folder that exists.

        Raises:
            InputError: the file exists already and no `force` is given, or it cannot be written.
        """
        file = Path(path) / "model.toml" if Path(path).is_dir() else Path(path)
        if file.exists() and not force:
            raise InputError(f"{file}: exists already, give --force to overwrite it")
        make_room(file)
        write_model(file, self._datasheet)
        return file

    def __eq__(self, other: object) -> bool:
        if not isinstance(other, Model):
            return NotImplemented
        return self._told() == other._told()

    def __hash__(self) -> int:
        return hash((self.output_unit, self.input_unit, self.inductance, self.effects))

    def _told(self) -> tuple[Any, ...]:
        return self._datasheet, self.output_unit, self.input_unit, self.inductance

    def __repr__(self) -> str:
        where = f" {self._datasheet.name}" if self._datasheet.name else ""
        return f"<Model{where}: {', '.join(self.effects) or 'no effect'}, {self.input_unit} to {self.output_unit}>"

    def _repr_html_(self) -> str:
        from ers_mj.report.notebook import model_page

        return framed(model_page(repr(self)[1:-1], self._numbers()), 420)


def load_model(path: Known, output_unit: Unit = None, input_unit: Unit = None) -> Model:
    """A model from a file: a datasheet, or the model.toml that a diagnosis writes.

    Args:
        path: the file; "table1" is the paper's servo.
        output_unit: as `Model` takes it.
        input_unit: as `Model` takes it.

    Raises:
        InputError: the file cannot be meant, in one sentence.

    Examples:
        >>> import ers_mj as ers
        >>> ers.load_model("table1")
        <Model table1: no effect, V to rad>
    """
    return Model(path, output_unit=output_unit, input_unit=input_unit)
