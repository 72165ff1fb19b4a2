"""How a stream is followed: spans, blocks, and from when on something is believed."""

from __future__ import annotations

from dataclasses import dataclass


@dataclass(frozen=True)
class Horizon:
    """How a stream is followed.

    Attributes:
        opening, unknown_opening: [s] of a stream from which a model is made ready, with a datasheet and without one.
        moving: times its noise that an output must travel for a model to begin.
        hop, patient_hop: [s] between estimates, and while the flag is up.
        shortest, longest: [s] of the window.
        patience: [s] without an explanation, of which ``shortest`` may hold a change of parameters.
        fewest: samples of a window: a slower stream has all three longer.
        kept: [s] of the stream that the noise level is taken from.
        block, block_samples: [s] and samples, whichever is longer, of a block.
        tau: misfit of a block at which its cost turns from squares to a logarithm.
        explained: misfit [sigma^2] of a window up to which the model explains it.
        drift: standard deviation of ln p within one window; of theta_0, over half the travel.
        speed: standard deviation of the window's first speed about what was believed, over the largest speed.
        nudge: step of the differences by the first state, of its scales.
        steps, trials: of a fit, and lengths that each is tried at.
        tolerance: of cost, and share of it: a step's gain at which a fit goes on to the next tau or ends.
        sure, least_change: standard deviations, and share, by which a parameter must move for its change to be told.
        runaway: misfit of a simulation that leaves all bounds.
    """

    opening: float = 2.0
    unknown_opening: float = 5.0
    moving: float = 30.0
    hop: float = 0.1
    patient_hop: float = 0.25
    shortest: float = 0.5
    longest: float = 2.0
    patience: float = 1.0
    fewest: int = 200
    kept: float = 5.0
    block: float = 0.025
    block_samples: int = 10
    tau: float = 4.0
    explained: float = 2.0
    drift: float = 0.3
    speed: float = 0.3
    nudge: float = 1e-3
    steps: int = 12
    trials: int = 4
    tolerance: tuple[float, float] = (0.05, 0.01)
    sure: float = 4.0
    least_change: float = 0.05
    runaway: float = 1e12


HORIZON = Horizon()
