"""Every threshold that decides: accept or reject, tie, flag, verdict.

``Policy`` is handed in, so that a replay (analysis/golden.py) can ask what another value would have decided. How far a
search goes (steps, starts, laps) decides nothing by itself and stands in ``selection.budget``.
C is the block cost of estimation/objective.py: an effect's gain is what it takes off C after everything is refitted.
"""

from __future__ import annotations

import math
from dataclasses import dataclass, field, fields
from typing import TypeVar


@dataclass(frozen=True)
class Reason:
    """Why a threshold is what it is: its unit, what it protects, and how it was set."""

    unit: str
    protects: str
    set_by: str


N = TypeVar("N", int, float)
# `python analysis/golden.py replay --ranges NAME` prints between which values of one the golden decides the same
UNRECORDED = (
    "on tuning seeds, no figure was kept; no decision that is replayed hangs on it from a hundredth to a hundredfold"
)


def _threshold(value: N, unit: str, protects: str, set_by: str = UNRECORDED) -> N:
    return field(default=value, metadata={"reason": Reason(unit, protects, set_by)})


@dataclass(frozen=True)
class Policy:
    """Every threshold that decides; ``reasons`` says why each is what it is."""

    # -- what is explained (explained.py) --------------------------------------------------------------------------
    rough: float = _threshold(
        3.0, "noise variances, median over blocks", "details told of a model that is itself wrong",
        "half the blocks within 1.7 sigma; no figure was kept",
    )  # fmt: skip
    model_error: float = _threshold(
        100.0,
        "noise variances, median over blocks",
        "parameters of a model whose error, not noise, decides",
        "ten sigma",
    )
    quiet: float = _threshold(
        0.04,
        "C per block",
        "a round that would only chase noise",
        UNRECORDED,
    )
    bent: float = _threshold(
        0.5,
        "C per block",
        "screening from a baseline that stands for what is missing",
        UNRECORDED,
    )
    forked: float = _threshold(
        6.0,
        "C",
        "forks of stick and slip taken for physics",
        "two blocks off by 5.8 sigma, as the worst of 61 servos without missing physics is in one",
    )
    beyond_rounding: float = _threshold(
        1.3,
        "noise levels, rounding being noise",
        "a model that a coarse converter's rounding hides",
        UNRECORDED,
    )
    consistent: float = _threshold(
        0.05,
        "C per block",
        "a datasheet called right that is not",
        "an error of 0.3 sigma RMS",
    )

    # -- prices: explanations with more numbers must buy more -------------------------------------------------------
    parameter_price: float = _threshold(
        0.25,
        "C a number",
        "wider effects that only fit more",
        "half of what Akaike asks",
    )
    wider_price: float = _threshold(
        0.75,
        "C",
        "an effect told where its limit does as well",
        "with the price of the number that opens it as much as Akaike asks",
    )
    nameless_price: float = _threshold(
        2.0,
        "C",
        "a nameless law in the place of a named one",
        "what has no name is less common than what has one",
    )

    # -- acceptance: which candidate of a round is named (acceptance.py) --------------------------------------------
    least_gain: float = _threshold(
        3.0,
        "C",
        "a name on a servo without missing physics",
        "one such servo in forty offers as much (null_gain)",
    )
    later_gain: float = _threshold(
        4.0,
        "C",
        "a second name beside a true one",
        "the law beside it is hardly ever exactly the one that acts",
    )
    faint_gain: float = _threshold(
        1.5,
        "C",
        "faint laws that stand alone beside an effect",
        "see alone",
    )
    steady: float = _threshold(
        3.0,
        "C, and z-score",
        "a second law that buys little nearly everywhere",
        "of 294 servos of tuning seeds one offers that, and rightly",
    )
    least_share: float = _threshold(
        0.1,
        "share of C left",
        "a name for a small part of a large mismatch",
        "of 59 sets of several and three later seeds three took less, none of them true",
    )
    third_share: float = _threshold(
        1 / 6,
        "share of C left",
        "a third name that is not there",
        "the same sets",
    )
    good_part: float = _threshold(
        0.35,
        "share of C left",
        "a third effect where the model stays wrong",
        "on tuning seeds; the golden decides the same from 0.18 to 35",
    )
    least_z: float = _threshold(
        1.7,
        "paired z-score over blocks",
        "a gain that a few blocks make",
        "three blocks won clearly, the rest untouched",
    )
    later_z: float = _threshold(
        2.0, "paired z-score over blocks", "a second name by a few blocks",
        "on tuning seeds; the golden decides the same from 2 to 2.2",
    )  # fmt: skip
    lost: float = _threshold(
        0.2,
        "share of the gain",
        "rare effects, whose z-score cannot be large",
        "what the blocks that lose may lose together",
    )
    ample: float = _threshold(2.0, "gains that matter", "lasting laws that lose somewhat more", "see lost_of_ample")
    lost_of_ample: float = _threshold(
        0.3,
        "share of the gain",
        "a chance that lasts",
        "of 275 servos without missing physics one offers a lasting law as much, and its z-score asks for that as well",
    )
    once: float = _threshold(6.0, "C", "an impulse found where a law is missed", "twice what a law must buy")
    peak: float = _threshold(
        30.0,
        "factor of tau + misfit in one block",
        "a fork of stick and slip taken for an impulse",
        "more than a fork makes (null_peak)",
    )
    usual: float = _threshold(
        0.95, "share of blocks", "a block that stands out of many bad ones", "one in twenty may be bad"
    )
    near_least: float = _threshold(
        0.5,
        "share of the gain that matters",
        "impulses where little else is left",
        "half a law's, its peak given",
    )
    most_effects: int = _threshold(3, "effects", "long lists of names", UNRECORDED)
    fewer_effects: int = _threshold(2, "effects", "a third name where the model stays wrong", "see good_part")
    outweighed: float = _threshold(
        0.2,
        "share of a later law's gain",
        "what has its own clock, found in a bent model",
        UNRECORDED,
    )
    modest: float = _threshold(
        30.0, "C", "a local minimum's way out taken for an effect's gain", "gains that a refit may make"
    )
    local_minimum: float = _threshold(1.0, "C", "the same", "what the model itself must win on its way back")

    # -- ordering: which of the candidates leads (ordering.py) -------------------------------------------------------
    tie: float = _threshold(1.0, "C", "a name by less than one block", "about one block's cost")
    near_tie: float = _threshold(
        0.02, "share of the best gain", "the same where all is large", "slopes are good to some per cent"
    )
    rival: float = _threshold(0.3, "share of the leader's gain", "a rival that may take its place later", UNRECORDED)
    nearly: float = _threshold(
        0.5,
        "share of the gain",
        "an effect told as another's form",
        "what this other must win itself",
    )
    curved: float = _threshold(
        1.06,
        "factor of probability",
        "a constant torque told as one along the travel",
        "of 54 torques of 4178 to 4192 none reaches it, of 33 gravities eight",
    )
    clocked: float = _threshold(
        0.5,
        "share of the gain",
        "a gust or an impulse in a law's place",
        "what a law must explain to come before it",
    )
    alone: float = _threshold(
        1.5, "factor of gain", "chance, which offers much the same to several laws",
        "on tuning seeds; the golden decides the same from 1.5 to 1.57",
    )  # fmt: skip
    same: float = _threshold(
        0.5, "share of the gain", "two names for one explanation", "summed difference of block scores"
    )
    half_step: float = _threshold(
        0.5,
        "converter steps",
        "what moves a reading by less than rounding",
        "half a step is rounding",
    )
    step_gain: float = _threshold(
        30.0,
        "C",
        "what many thresholds together tell",
        "much smaller than a step, and told by hundreds of them",
    )
    at_bound: int = _threshold(
        1,
        "numbers",
        "a sweep's effect whose numbers end at their bounds",
        "a shaft of 1000 Hz without a resonance",
    )

    # -- the baseline -------------------------------------------------------------------------------------------------
    support: float = _threshold(
        0.05, "C per block", "a spring that the data does not show", "what it must buy to be kept"
    )
    valley: float = _threshold(
        10.0, "C", "a second valley forgotten", "what parts two fits that ended in different valleys"
    )
    ordinary_inductance: float = _threshold(
        0.95,
        "share of the bound",
        "an inductance that the datasheet has",
        "the contract: about twice the datasheet's",
    )

    # -- confirmation on held-out data (confirmation.py) --------------------------------------------------------------
    largest_p: float = _threshold(0.05, "p-value", "effects that do not generalise", "the usual level")
    sure_p: float = _threshold(1e-3, "p-value", "effects beyond doubt whose free run forks", "the usual level")
    worse: float = _threshold(
        1.3,
        "factor of free-run error",
        "an effect that blocks confirm, or recalibration, and free runs lose",
        "forks of stick and slip",
    )
    half: float = _threshold(
        0.5, "share of squared error above the noise", "a verdict that accounts for less", "the contract"
    )
    pays: float = _threshold(
        0.1,
        "share of squared held-out error above the noise",
        "a name that could be left out: without it, refitted, the error must rise by as much",
        "what a name is asked to be worth",
    )
    unsure: float = _threshold(
        100.0, "end over end of an interval", "a size that nothing tells", "two decades are no size"
    )
    far_off: float = _threshold(
        3.0, "noise levels of held-out error", "a mismatch that the observer does not see", "the contract"
    )
    many_periods: int = _threshold(
        10,
        "starts",
        "a wave that fits any remainder",
        "from so many periods one fits what is left by chance",
    )
    edge: float = _threshold(0.1, "s", "impulses that few samples bear", "at either end of a recording")
    least_loss: float = _threshold(
        0.02, "score a block", "sure p-values from no losses", "what a block's noise makes of equals"
    )
    null_gain: float = _threshold(
        0.8,
        "C",
        "the best of many laws taken for one",
        "decay of the tail of the largest gains of servos without missing physics (analysis/null_gains.py)",
    )
    left_elsewhere: float = _threshold(
        0.5,
        "share of ln(1 + misfit) that an impulse takes its worst block from",
        "an impulse for one of many moments in which a law is missed",
        "of its gain, on seeds 8101 and 8401, five true ones left 0.14 at most and two false ones 0.75 and more",
    )
    null_gain_once: float = _threshold(1.5, "C", "the same of what acts once", "the same servos")
    null_alone: float = _threshold(
        0.2,
        "share of servos",
        "laws that stand alone by chance",
        "2 of 12 nulls of seed 4141, one by its own clutter",
    )

    # -- what is left, and the verdict (verdict.py) -------------------------------------------------------------------
    mismatch: float = _threshold(
        0.085,
        "ln(1 + power) in the noise's",
        "a flag on noise",
        "0.3 noise levels: of 100 servos without missing physics three leave more than 0.06",
    )
    other_form: float = _threshold(
        0.3,
        "share of what the baseline leaves",
        "a flag on the right law's other form",
        "on tuning seeds; the golden decides the same from 0.3 to 0.36",
    )
    part: float = _threshold(
        0.115,
        "ln(1 + power) in the noise's",
        "a part told as the whole",
        "0.35 noise levels, beside nearly_all",
    )
    elsewhere: float = _threshold(
        0.05,
        "ln(1 + power) in the noise's",
        "a flag on one recording's forks",
        "0.23 noise levels in all recordings but the worst: none of 65 nulls (4133 to 4135) leaves it",
    )
    visible: float = _threshold(
        1.5, "noise levels of free-run error", "shares of what is not there",
        "on tuning seeds; the golden decides the same from 0.015 to 15",
    )  # fmt: skip
    astray: float = _threshold(
        30.0,
        "noise levels of free-run error",
        "a plant that no free run meets",
        "forks lose one recording or another",
    )
    fork_lost: float = _threshold(
        6.0, "noise levels of free-run error", "shares that one fork decides",
        "on tuning seeds; the golden decides the same from 3 to 18",
    )  # fmt: skip
    nearly_all: float = _threshold(
        0.98, "share of squared error", "a part told as the whole", "another form of the right law"
    )
    tied: float = _threshold(0.02, "probability", "alternatives that are none", "what is told as not excluded")
    state_factor: float = _threshold(0.02, "factor", "a record state not worth a line", "two per cent")
    state_offset: float = _threshold(0.01, "half travels", "the same", "one per cent")
    coarse_step: float = _threshold(
        1 / 300, "share of the travel", "a coarse converter passed over", "an effect whatever the step's size"
    )
    fine_step: float = _threshold(
        1 / 1000, "share of the travel", "an ordinary converter named", "ordinary whatever the step's size"
    )
    ordinary_step: float = _threshold(
        math.radians(0.03), "rad", "an ordinary converter named", "12 bits over 120 degrees have 0.0293 degrees"
    )
    ordinary_bits: int = _threshold(
        12, "bits a turn", "an ordinary encoder named", "hobby servos and small joints have 12, whatever they travel"
    )

    # -- a position loop (position_loop/) ---------------------------------------------------------------------------
    loop_gain: float = _threshold(
        20.0, "half blocks times ln of squared errors' ratio, less Schwarz's price", "a name on a clean servo",
        "the best rival on 15 clean servos gained 17; at 5 seven of 15 are false",
    )  # fmt: skip
    loop_place: float = _threshold(
        10.0, "half blocks times ln of squared errors' ratio", "a latency within the loop where the command's would do",
        "half of a name's: neither place has more numbers; set in view of pdloop_delay, which gains 17",
    )  # fmt: skip
    loop_integral: float = _threshold(
        0.05, "1/s, I over K", "integral action that is not there", "of 16 PD loops all refitted below 0.005"
    )
    loop_damping: float = _threshold(
        0.2, "D over a_2", "a derivative term that is not there", "of 16 PI loops all refitted below"
    )
    fewest_dropouts: int = _threshold(3, "dropouts", "a sensor blamed for one spike", "two may be chance")


def reasons() -> dict[str, Reason]:
    """Why each threshold is what it is, by name."""
    return {f.name: f.metadata["reason"] for f in fields(Policy)}


POLICY = Policy()
