"""CMA-ES, by the library `cma`, started again with twice the population where it has come to rest."""

from __future__ import annotations

import warnings

import numpy as np

from ers_mj.identification.minimisers.base import Meter, Minimiser


class CMA(Minimiser):
    """Evolution strategy with covariance adaptation (Hansen); restarts as in IPOP."""

    name = "cma"
    sentence = "CMA-ES (library cma), restarted with twice the population"

    def _search(self, meter: Meter, random: np.random.Generator, start: np.ndarray | None) -> None:
        with warnings.catch_warnings():
            warnings.simplefilter("ignore")
            import cma

            size = 4 + int(3 * np.log(meter.size))
            centre = random.random(meter.size) if start is None else start
            while True:
                options = {
                    "bounds": [0, 1],
                    "popsize": size,
                    "seed": int(random.integers(1, 2**31 - 1)),
                    "verbose": -9,
                    "tolfun": 0,
                    "tolfunhist": 0,
                    "maxfevals": np.inf,
                }
                search = cma.CMAEvolutionStrategy(centre, 0.25, options)  # of the box, the first spread
                while not search.stop():
                    points = np.array(search.ask())
                    search.tell(points, np.minimum(meter(np.clip(points, 0.0, 1.0)), 1e300))
                size, centre = 2 * size, random.random(meter.size)
