"""Errors before and after, by the names that diagnosis.json gives them."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Protocol

Ends = tuple[float | None, float | None]  # before, after


class Held(Protocol):
    """What a free run or windows leave of what was held out."""

    @property
    def rmse(self) -> float: ...
    @property
    def mae(self) -> float: ...


def errors_told(train: Ends, held: tuple[Held, Held], again: Ends, multibody: Ends) -> dict[str, float | None]:
    """On what was fitted, on what was held out, there recalibrated, and there by the MuJoCo plant [output unit]."""
    before, after = held
    ends = {
        "train_rmse": train,
        "heldout_rmse": (before.rmse, after.rmse),
        "heldout_mae": (before.mae, after.mae),
        "recalibrated_rmse": again,
        "mujoco_heldout_rmse": multibody,
    }
    return {f"{name}_{when}_rad": x for name, pair in ends.items() for when, x in zip(("before", "after"), pair)}


def as_named(fits: dict, names: Sequence[str], told: Sequence[str]) -> dict:
    """The errors of a case whose model has these ``names`` beside what is ``told`` of them: where nothing is, after is
    before.
    """
    if told or not names:
        return fits
    return {key: fits[key.replace("_after", "_before")] for key in fits}
