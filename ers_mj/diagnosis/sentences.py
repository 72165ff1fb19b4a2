"""What a diagnosis says in words."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence

from ers_mj.decisions.thresholds import Policy
from ers_mj.diagnosis.case import Case
from ers_mj.diagnosis.localisation import Place
from ers_mj.diagnosis.unexcited import CANNOT, is_unexcited
from ers_mj.effects import BY_NAME


def sentence(case: Case, missing: Sequence[dict], found: Sequence[Place]) -> str:
    """One plain sentence that a mechanic would understand."""
    if is_unexcited(case.start.traces):
        return CANNOT
    if case.verdict == "consistent":
        return "The datasheet's model explains these recordings within their noise: nothing is missing."
    if case.verdict == "parameters_only" and case.recordings_differ:
        return (
            f"Only the numbers were off: with refitted parameters, and {of_its_own(case)} of its own in each recording,"
            " the model explains these recordings within their noise."
        )
    if case.verdict == "parameters_only":
        return (
            "Only the numbers were off: with refitted parameters the model explains these recordings within their"
            " noise."
        )
    if case.verdict == "missing_physics":
        return _of_what_is_missing(case, "; ".join(m["sentence"] for m in missing))
    place = next((p.sentence for p in found if p.axis != "subsystem"), "it is spread over the whole record")
    if alone := _of_training_alone(case):
        return f"{alone}; {place}."
    much = (
        f"; it acts like {' and '.join(BY_NAME[c.name].sentence for c in case.suspects)}"
        if case.suspects
        else f" (the best explains {case.explained:.0%} of the held-out error)"
    )
    return f"Something acts here that no effect of the library accounts for{much}; {place}."


def _of_training_alone(case: Case) -> str:
    """What explains the training recordings whole and is not named, since nothing that is held out shows it."""
    cost = case.start.fit.cost
    best = next((c for found in case.selection.rounds[:1] for c in found[:1] if c.name in BY_NAME), None)
    if best is None or case.suspects or best.gain < case.policy.nearly_all * cost:
        return ""
    name = best.name.replace("_", " ")
    return (
        f"A mismatch is left without a name: {name} explains {best.gain / cost:.0%} of what is beyond the noise in the"
        " training recordings, but nothing that is held out shows it"
    )


def of_its_own(case: Case) -> str:
    """What each recording has to itself where the recordings differ."""
    return " and ".join(name.replace("_", " ") for name in case.own_states)


def of_another_day(fits: Mapping[str, float | None], states: Sequence[Mapping], unit: str, policy: Policy) -> str:
    """What the sentence adds where the rig itself changed before the held-out recordings, so much that the squared
    error is halved once that is known; nothing where it did not.
    """
    raw, again = fits["heldout_rmse_after_rad"], fits["recalibrated_rmse_after_rad"]
    if not states or raw is None or again is None or again**2 >= policy.half * raw**2:
        return ""
    how, before, after = "; ".join(state["sentence"] for state in states), shown(raw, unit), shown(again, unit)
    return f" The rig changed ({how}): once that is known, the held-out error is {after}, not {before}."


def _of_what_is_missing(case: Case, names: str) -> str:
    if not case.told_effects:
        return (
            f"The sensor shows: {names}. Beside it a mismatch is left that no effect of the library accounts for."
            if case.more_is_left
            else f"Only the sensor shows: {names}."
        )
    fits, told, kind = case.fits, "held-out error", "heldout"
    halved = math.sqrt(case.policy.half) * fits["heldout_rmse_before_rad"]
    if fits["heldout_rmse_after_rad"] > halved and case.holdout:
        told, kind = "held-out error, once gain, offset and friction level of that day are known,", "recalibrated"
    before, after = (shown(fits[f"{kind}_rmse_{w}_rad"], case.output_unit) for w in ("before", "after"))
    left = "; a mismatch is left beside it" if case.more_is_left else ""
    return f"The model leaves out this: {names}. With it the {told} falls from {before} to {after}{left}."


def shown(value: float | None, unit: str) -> str:
    """A number for a sentence: radians as degrees."""
    if value is None:
        return "none"
    if unit.startswith("rad") and not unit.startswith("rad/s^2"):
        return f"{math.degrees(value):.3g} deg{unit[3:]}"
    return f"{value:.3g}" if unit == "-" else f"{value:.3g} {unit}"
