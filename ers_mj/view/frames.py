"""Frames for the report: moments of a recording on the plant in three dimensions, measured and simulated, before and
after.
"""

from __future__ import annotations

import math
from dataclasses import dataclass, replace

import numpy as np

from ers_mj.diagnosis.evidence import Evidence, RecordView
from ers_mj.errors import InputError
from ers_mj.plants.mujoco.looped import LoopedPlant
from ers_mj.plants.mujoco.plant import MechanicalPlant
from ers_mj.plants.mujoco.staging import rig_of

ENLARGED = (1, 2, 5, 10, 20, 50)


@dataclass(frozen=True)
class Choice:
    """Which moments are shown, and how.

    Attributes:
        moments: how many.
        apart: least distance of two, as a share of the recording.
        worthwhile: a mismatch is shown from so many times the noise.
        visible: what the largest difference is enlarged to, at least [rad].
        visible_share: the same of an output that slides, as a share of its reach.
        size: width and height of a picture [pixels].
    """

    moments: int = 3
    apart: float = 0.1
    worthwhile: float = 4.0
    visible: float = math.radians(6)
    visible_share: float = 0.1
    size: tuple[int, int] = (480, 360)


CHOICE = Choice()


@dataclass(frozen=True)
class Frame:
    """One moment: time [s], outputs [output unit], and the pictures as JPEG."""

    t: float
    measured: float
    before: float
    after: float
    picture_before: bytes
    picture_after: bytes


@dataclass(frozen=True)
class Frames:
    """The moments of a recording; differences from what was measured are drawn `enlarged` times. Empty where `why_not`
    says why. ``rig`` is what moves: rudder, arm, slide or joint (see staging.rig_of).
    """

    name: str
    moments: tuple[Frame, ...]
    enlarged: int = 1
    why_not: str = ""
    rig: str = "rudder"
    output_unit: str = "rad"


def frames_of(plant: MechanicalPlant | LoopedPlant, evidence: Evidence) -> Frames | None:
    """Where the model before does worst, on a held-out recording if there is one.

    None where no picture would help: the output is neither angle nor way, or before and after do not differ beyond
    noise.
    """
    if not evidence.records or evidence.output_unit not in ("rad", "m"):
        return None
    if plant.is_angle != (evidence.output_unit == "rad"):
        return None
    view = evidence.told[0]
    chosen = worst_moments(view)
    error = np.abs(view.before - view.measured)[chosen]
    gained = np.nan_to_num(np.abs(view.before - view.after)[chosen])
    if not chosen.size or max(gained) <= CHOICE.worthwhile * np.nan_to_num(evidence.noise):
        return None
    visible = CHOICE.visible if plant.is_angle else CHOICE.visible_share * float(np.nanmax(np.abs(view.measured)))
    enlarged = next((times for times in ENLARGED if times * error.max() >= visible), ENLARGED[-1])
    told = Frames(view.name, (), enlarged, rig=rig_of(plant.spec()), output_unit=evidence.output_unit)
    try:
        return replace(told, moments=_drawn(plant, view, chosen, enlarged))
    except InputError as error:
        return replace(told, why_not=str(error))


def worst_moments(view: RecordView) -> np.ndarray:
    """Samples (M,), in their order, of the largest differences before, apart from each other."""
    left = np.abs(view.measured - view.before) + 0.0 * view.after
    chosen: list[int] = []
    while len(chosen) < CHOICE.moments and np.isfinite(left).any():
        k = int(np.nanargmax(left))
        chosen.append(k)
        left[np.abs(view.t - view.t[k]) < CHOICE.apart * (view.t[-1] - view.t[0])] = np.nan
    return np.array(sorted(chosen), int)


def _drawn(
    plant: MechanicalPlant | LoopedPlant, view: RecordView, chosen: np.ndarray, enlarged: int
) -> tuple[Frame, ...]:
    from ers_mj.view.rendering import Painter, jpeg_bytes
    from ers_mj.view.replay import posed

    t, measured, before, after = (x[chosen] for x in (view.t, view.measured, view.before, view.after))
    shown = np.concatenate([measured + enlarged * (x - measured) for x in (before, after)])
    unit = "rad" if plant.is_angle else "m"
    film = posed(plant, np.concatenate([t, t]), shown, output_unit=unit)
    with Painter(film.model, *CHOICE.size, plain=True) as painter:
        pictures = [
            jpeg_bytes(painter.draw(qpos, y))
            for qpos, y in zip(film.qpos, np.concatenate([measured, measured]), strict=True)
        ]
    rows = zip(t, measured, before, after, pictures[: t.size], pictures[t.size :], strict=True)
    return tuple(Frame(float(at), float(y), float(b), float(a), *both) for at, y, b, a, *both in rows)
