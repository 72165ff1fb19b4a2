"""Differential evolution, by scipy."""

from __future__ import annotations

import numpy as np
from scipy.optimize import differential_evolution

from ers_mj.identification.minimisers.base import Meter, Minimiser


class DE(Minimiser):
    """Storn and Price's, best/1/bin, as scipy has it with its own settings; runs until the budget is spent."""

    name = "de"
    sentence = "differential evolution (scipy)"

    def _search(self, meter: Meter, random: np.random.Generator, start: np.ndarray | None) -> None:
        differential_evolution(
            lambda x: np.minimum(meter(x.T), 1e150),  # whose square, which scipy takes, is a number too
            [(0.0, 1.0)] * meter.size,
            popsize=5,  # times the number of parameters
            tol=0.0,
            atol=0.0,
            polish=False,
            maxiter=meter.budget,
            rng=random,
            x0=start,
            vectorized=True,
            updating="deferred",
            init="latinhypercube",
        )
