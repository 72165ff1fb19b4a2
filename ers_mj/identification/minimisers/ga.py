"""GA1, what the paper compares its algorithm with: the same with fixed probabilities."""

from __future__ import annotations

from ers_mj.identification.minimisers.iga import IGA


class GA(IGA):
    """IGA with P_c and P_m that stay as they begin; the rest as there, sigma included. The paper gives no numbers:
    these served it best.
    """

    name = "ga"
    sentence = "the paper's GA1: its genetic algorithm with fixed probabilities"

    def __init__(self, size: int = 40, crossover: float = 0.9, mutation: float = 0.15):
        super().__init__(size, (crossover, crossover), (mutation, mutation))

    def probabilities(self, share: float) -> tuple[float, float]:
        """(P_c, P_m), the same from first to last."""
        return self.crossover[0], self.mutation[0]
