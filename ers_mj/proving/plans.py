"""What every case is to be: its kind and the labels concealed in it."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from ers_mj.proving.sizing import ALIKE

KINDS = {"null": 0.25, "single": 0.5, "several": 0.15, "outside": 0.1}
BLOCK = 20  # cases of a family in which every kind comes in its share


@dataclass(frozen=True)
class Plan:
    """What a case is to be: its number from 0 in the proof, its kind, the labels concealed in it, its family, and its
    number from 0 in that.
    """

    index: int
    kind: str
    labels: tuple[str, ...]
    family: str
    number: int


def several(rng: np.random.Generator, names: tuple[str, ...]) -> tuple[str, ...]:
    """Two or three of these effects that can be told apart and joined in one servo."""
    many = 2 if rng.random() < 0.7 else 3
    while True:
        drawn = {str(name) for name in rng.choice(names, many, replace=False)}
        if not any(len(drawn & alike) > 1 for alike in ALIKE):
            return tuple(sorted(drawn))


def planned(seed: list[int], number: int, names: tuple[str, ...], outside: tuple[str, ...]) -> tuple[str, tuple]:
    """(kind, labels) of a family's case of this number: in every block of 20 each kind in its share, singles and laws
    outside the library through their lists, each round in an order of its own. Nothing depends on how many are asked.
    """
    block, place = divmod(number, BLOCK)
    kinds = [kind for kind, share in KINDS.items() for _ in range(round(share * BLOCK))]
    order = np.random.default_rng([*seed, 0, block]).permutation(kinds).tolist()
    kind = order[place]
    before = block * order.count(kind) + order[:place].count(kind)
    if kind == "several":
        return kind, several(np.random.default_rng([*seed, 1, number]), names)
    listed = {"single": names, "outside": outside}.get(kind)
    if listed is None:
        return kind, ()
    turn, k = divmod(before, len(listed))
    return kind, (str(np.random.default_rng([*seed, 2 + (kind == "outside"), turn]).permutation(listed)[k]),)
