"""The lines of MJCF for a joint of one's own: what of a plant a joint's attributes and one actuator can carry, and what
they cannot, a sentence each.

With J the inertia at the joint, on its angle theta (one body, output units):

    armature J less the bodies' own, damping J (a_mech [+ a_emf]), frictionloss J c_2, stiffness J a_1 about theta_0
    motor: torque J b u, the back-EMF in the damping;   dcmotor: the same with the winding's time constant
    range: stops as spring-dampers; a constant torque, and friction that differs by direction, move springref

Numbers are written as Python repeats them, 17 digits where needed. `dampratio` is never written: MuJoCo turns it into a
number of the model that it stands in.
"""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass
from xml.sax.saxutils import quoteattr

import numpy as np

from ers_mj.effects import BY_NAME, Effect
from ers_mj.effects.presliding import Presliding
from ers_mj.effects.quantities import Coefficients
from ers_mj.errors import InputError
from ers_mj.plants.reduced import ReducedModel

ACTUATORS = ("motor", "dcmotor")
FAR = 1e6  # [output unit] an end that is not there


@dataclass(frozen=True)
class JointLines:
    """What to put on a joint of one's own; `str()` of it is the lines.

    Attributes:
        joint: attributes of the joint, numbers in rad (m), N m (N) and s.
        actuator: those of the actuator; its control is the servo's input.
        kind: "motor" or "dcmotor".
        timestep: [s] that a delay and the friction's stiffness were written for.
        left_out: what these lines do not carry, a sentence each.
    """

    joint: Mapping[str, object]
    actuator: Mapping[str, object]
    kind: str
    timestep: float
    left_out: tuple[str, ...]

    @property
    def xml(self) -> str:
        """The lines, with what is left out as comments."""
        told = "\n".join(f"<!-- not carried: {sentence.replace('--', '- -')} -->" for sentence in self.left_out)
        lines = (
            f'<!-- for <compiler angle="radian" autolimits="true"/> and <option timestep="{self.timestep!r}"'
            ' integrator="implicitfast"/> -->',
            f"<joint {_written(self.joint)}/>",
            f"<actuator><{_element(self.kind, self.actuator)}/></actuator>",
        )
        return "\n".join([*lines, *([told] if told else [])])

    def __str__(self) -> str:
        return self.xml


def _element(kind: str, actuator: Mapping[str, object]) -> str:
    """An actuator as MJCF has it; a position's whose damping is negative in general terms, which its own refuse: MuJoCo
    reads such a number as a damping ratio where gain and stiffness are the same to the bit.
    """
    kp, kv = actuator.get("kp", 0.0), actuator.get("kv", 0.0)
    if isinstance(kp, float) and isinstance(kv, float) and kv < 0.0:
        rest = {name: x for name, x in actuator.items() if name not in ("kp", "kv")}
        kind, actuator = (
            "general",
            rest | {"gainprm": kp, "biastype": "affine", "biasprm": (0.0, -math.nextafter(kp, 0.0), -kv)},
        )
    return f"{kind} {_written(actuator)}"


def _written(attributes: Mapping[str, object]) -> str:
    return " ".join(f"{name}={quoteattr(_text(x))}" for name, x in attributes.items())


def _text(x: object) -> str:
    if isinstance(x, list | tuple):
        return " ".join(_text(part) for part in x)
    return x if isinstance(x, str) else repr(float(x)) if isinstance(x, float) else repr(x)


def joint_lines(
    plant: ReducedModel,
    inertia: float,
    *,
    joint: str,
    bodies: float,
    timestep: float,
    actuator: str,
    is_angle: bool,
    soft: tuple[float, float] | None = None,
) -> JointLines:
    """The lines for a plant whose whole inertia at the joint is known.

    Args:
        plant: what the joint is to do.
        inertia: J [kg m^2, or kg] at the joint.
        joint: its name in one's own model.
        bodies: what the bodies of one's own model have of J about the joint; the armature is the rest.
        timestep: h [s] of one's own model.
        actuator: "motor", which every importer knows, or "dcmotor", which has the winding's time constant.
        is_angle: whether the joint is a hinge.
        soft: (creep [1/s], heavy) of friction that creeps below breakaway (see LoopNumbers); None: it holds.

    Raises:
        InputError: an actuator that is not there, a timestep or an inertia that cannot be.
    """
    if actuator not in ACTUATORS:
        raise InputError(f"there is no actuator {actuator[:40]!r}; there are {', '.join(ACTUATORS)}")
    if not timestep > 0:
        raise InputError(f"the timestep is {timestep:g} s, more than zero was expected")
    if not 0 <= bodies <= inertia:
        raise InputError(f"the bodies' inertia is {bodies:g}, zero to the whole of {inertia:g} was expected")
    c, lost = _lowered(plant), _lost_effects(plant, soft is not None)
    wound = actuator == "dcmotor" and c.a_emf > 0
    attributes: dict[str, object] = {
        "name": joint,
        "type": "hinge" if is_angle else "slide",
        "armature": inertia - bodies,
        "damping": inertia * (0.5 * (c.a_mech_plus + c.a_mech_minus) + (0.0 if wound else c.a_emf)),
        "frictionloss": 0.5 * inertia * (c.c_2_plus + c.c_2_minus),
        **_friction(soft, timestep),
    }
    if c.a_1 > 0:
        attributes |= {"stiffness": inertia * c.a_1, "springref": c.theta_0 + pushed(c) / c.a_1}
    if np.isfinite(c.lower) or np.isfinite(c.upper):
        attributes |= {"range": (max(c.lower, -FAR), min(c.upper, FAR)), **_stops(c)}
    driven = _actuator(plant, c, inertia, joint, wound) | _late(c.delay, timestep)
    lost = [*_lost(c, wound, soft is not None), *lost]
    return JointLines(attributes, driven, "dcmotor" if wound else "motor", timestep, tuple(lost))


def pushed(c: Coefficients) -> float:
    """The constant acceleration beside friction of a mean level: a torque, and what friction differs by direction."""
    return c.bias - 0.5 * (c.c_2_plus - c.c_2_minus)


def _friction(soft: tuple[float, float] | None, timestep: float) -> dict[str, object]:
    """MuJoCo's frictionloss below its level: (1 - d) of a pull gets through, against a damper of 2 / timeconst."""
    if soft is None:
        return {"solreffriction": (2.0 * timestep, 1.0), "solimpfriction": (0.9999, 0.9999, 0.001)}
    creep, heavy = soft
    d = min(max(1.0 - 1.0 / heavy, 0.01), 0.9999)
    damper = creep * (1.0 - d) / d
    return {"solreffriction": (max(2.0 / (d * damper), 2.0 * timestep), 1.0), "solimpfriction": (d, d, 0.001)}


def _stops(c: Coefficients) -> dict[str, object]:
    """Spring-dampers against an inertia J: a negative solref under the smallest impedance."""
    return {"solreflimit": (-c.k_stop, -max(c.d_stop, 1e-12)), "solimplimit": (1e-4, 1e-4, 0.001)}


def _lowered(plant: ReducedModel) -> Coefficients:
    return Coefficients(*map(float, plant._lowered[0]))


def _actuator(plant: ReducedModel, c: Coefficients, J: float, joint: str, wound: bool) -> dict[str, object]:
    """Torque J (b u - a_emf w), at once by a motor, behind the winding by a dcmotor of gear 1 and constant K = a_emf/b,
    R = K/(J b).
    """
    out: dict[str, object] = {"name": f"{joint}_servo", "joint": joint}
    if wound:
        K = c.a_emf / abs(c.b)
        R = K / (J * abs(c.b))
        out |= {"gear": np.copysign(1.0, c.b).item(), "motorconst": (K, K), "resistance": R}
        out |= {"inductance": (c.tau_e * R, 0.0)} if c.tau_e > 0 else {}
    else:
        out["gear"] = J * c.b
    limit = clip_of(plant)
    return out if limit is None else out | {"ctrlrange": (-limit, limit)}


def clip_of(plant: ReducedModel) -> float | None:
    """The limit of a drive that does nothing but clip its input, None where there is none."""
    beyond = 1e6  # [input unit] of every drive's limit
    low, high = plant.terminal(np.array([-beyond, beyond]))
    if high >= beyond or low != -high:
        return None
    u = np.linspace(-2.0 * high, 2.0 * high, 401)
    return float(high) if np.allclose(plant.terminal(u), np.clip(u, low, high), rtol=1e-9, atol=1e-12) else None


def _late(delay: float, timestep: float) -> dict[str, object]:
    """An actuator's delay, half a timestep less where it is a whole number of them: MuJoCo's clock rounds, and some
    edges would come a step later.
    """
    if delay <= 0:
        return {}
    steps = delay / timestep
    if abs(steps - round(steps)) < 1e-6 * max(steps, 1.0):
        delay -= 0.5 * timestep
    return {"delay": delay, "nsample": int(np.ceil(delay / timestep)) + 1}


# -- what is not carried ---------------------------------------------------------------------------------------------


def _lost(c: Coefficients, wound: bool, soft: bool) -> list[str]:
    """What the plant's coefficients have beyond the lines, whatever effect put it there."""
    friction = f"{c.c_2_plus:.4g} upwards, {c.c_2_minus:.4g} downwards"
    damping = f"{c.a_mech_plus:.4g} upwards, {c.a_mech_minus:.4g} downwards"
    free = c.a_1 <= 0
    lost = (
        (c.c_1 > 0, f"the spring's preload, {c.c_1:.4g} per inertia to either side of {c.theta_0:.4g}"),
        (
            free and c.c_2_plus != c.c_2_minus,
            f"friction that differs by direction ({friction} per inertia): the mean is written",
        ),
        (c.a_mech_plus != c.a_mech_minus, f"damping that differs by direction ({damping} 1/s): the mean is written"),
        (
            c.tau_e > 0 and not wound,
            f"the winding's time constant of {c.tau_e:.3g} s: a motor's torque is there at once",
        ),
        (c.fall > 0 and c.tau_e > 0, "an inductance that falls with the current"),
        (free and c.bias != 0, f"a constant torque of {c.bias:.4g} per inertia"),
        (c.has_motor_side, "a second body behind a play or a shaft: a joint of one's own is one body"),
        (c.has_bristle, "friction that bends before it slips: frictionloss creeps instead"),
        (
            c.c_2_plus + c.c_2_minus > 0 and not soft,
            "a rest without creep: below breakaway MuJoCo's frictionloss creeps",
        ),
    )
    return [sentence for is_lost, sentence in lost if is_lost]


def _lost_effects(plant: ReducedModel, soft: bool) -> list[str]:
    """Effects that act by laws, on the command or on the reading, where the lines do not have them."""
    lost, clips = [], clip_of(plant) is not None
    for name, values in plant.effects:
        effect = BY_NAME[name]
        kind = type(effect)
        by_law = (effect.torque or effect.friction or effect.inertia) and effect.is_lawful(values)
        by_command = kind.command is not Effect.command and not clips
        if soft and kind is Presliding:
            continue
        if by_law or by_command or kind.measure is not Effect.measure:
            lost.append(f"{name.replace('_', ' ')} (in a whole plant: {effect.mjcf})")
    return lost
