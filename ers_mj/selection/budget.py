"""How far a selection searches: starts, steps, laps and simulated time. None of it decides what is named (see
decisions/thresholds.py); it decides what there is to choose from, and how long that takes.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

from ers_mj.data.prepared import Trace
from ers_mj.plants.effort import Effort


@dataclass(frozen=True)
class Search:
    """The sizes of a search. Shares are of the best gain or promise of a round unless they say otherwise.

    Screening: ``most_sent`` candidates are refitted at most in the first round, ``most_bent`` there from a bent
    baseline, ``later`` beside an effect; those with a share ``promising`` of the best promise, or ``promising_dear``
    where a simulation takes long. What promises ``unlikely`` of that to first order is not simulated, and of what no
    first order tells ``beside_tries`` more starts than are refitted; where a model is quiet a secant must promise
    ``least_promise`` of the gain that matters. Further places of a bent baseline ask those with ``less``, from the
    ``asked_again`` foremost of their starts. A start is scaled to between ``least_size`` and ``most_size`` of itself,
    and its secant taken again where that is ``another`` size; the servo makes room for it by a step of ``aside`` at
    most, in transformed numbers, along slopes that are ``telling``, as a share of the largest.
    """

    most_sent: int = 10
    most_bent: int = 14
    later: int = 8
    promising: float = 0.25
    promising_dear: float = 0.6
    less: float = 0.1
    asked_again: int = 6
    beside_tries: int = 2
    unlikely: float = 0.5
    least_promise: float = 0.6
    least_size: float = 0.002
    most_size: float = 3.0
    another: float = 1.5
    aside: float = 0.5
    telling: float = 1e-3
    # A round's refits: ``quick`` steps on a borrowed Jacobian; ``renewals`` Jacobians of their own each lap, ``laps``
    # at most, ``later_laps`` beside an effect, as long as one wins ``pace`` of the gain that matters and
    # ``pace_share``; from its other starts what has won ``again``, and the ``foremost`` promises; a promise was none
    # below ``failed``.
    quick: int = 8
    renewals: int = 2
    laps: int = 8
    later_laps: int = 3
    pace: float = 0.1
    pace_share: float = 0.03
    again: float = 0.1
    failed: float = 0.05
    foremost: int = 2
    # ``finished`` are fitted to the end at most, those with half the best gain; further forms of what leads are looked
    # at for ``glance`` steps and finished where they are not ``behind`` by more; a law that a leader with a clock hides
    # must show ``seen`` in its first steps.
    finished: int = 3
    glance: int = 5
    behind: float = 0.4
    seen: float = 0.03
    # Where the leader leaves ``unexplained`` of C, refits at ``taut`` times the observer's rate, at which C has few
    # local minima, the best ``held`` of them with a Jacobian of their own, the best ``let_go`` of those at the usual
    # rate.
    unexplained: float = 0.25
    taut: float = 10.0
    held: int = 20
    let_go: int = 10
    # An effect's own starts, up to ``few_starts``, are tried as they are; a wave that leaves ``anew_from`` of C per
    # block is begun again from ``anew`` starts.
    few_starts: int = 4
    anew: int = 8
    anew_from: float = 0.2
    # The sweep: ``sweep_glance`` steps from every start of what has fewer than ``by_screen``, the best ``go_on`` of
    # each effect on to ``sweep`` steps.
    sweep: int = 12
    sweep_glance: int = 4
    go_on: int = 2
    by_screen: int = 12
    # What is named is looked at again: without an effect that is not ``missed`` by so much C; ``most_rivals`` in a
    # leader's place; ``most_reversed`` rivals with ``reversed_share`` begun the other way round, ``fewer_reversed`` if
    # dear; pairs that buy ``paired`` of what is bought one by one, ``most_pairs`` of them, carried on if not ``far``
    # behind; ``most_parted`` rivals of a lone second body; the model's own way back, ``most_mended`` times.
    missed: float = 100.0
    most_rivals: int = 3
    reversed_share: float = 0.1
    most_reversed: int = 5
    fewer_reversed: int = 2
    paired: float = 0.5
    far: float = 0.2
    most_pairs: int = 6
    most_parted: int = 2
    most_mended: int = 2
    # Confounders: one nameless law in the place of all beyond ``many`` names; finished where it is not
    # ``nameless_behind`` of what the named effect buys.
    many: int = 2
    nameless_behind: float = 0.5
    # Where it ends, in seconds that simulating takes a slow core (see Budget): no sweep after ``sweeps``, no race
    # beside a bristle after ``raced``, no round after ``last``, or ``longest``.
    sweeps: float = 60.0
    raced: float = 50.0
    last: float = 140.0
    longest: float = 220.0
    # Whether the held-out recordings are run in MuJoCo as well, what stays unknown is tabled, and the next recording is
    # designed.
    in_mujoco: bool = True
    tabled: bool = True
    advised: bool = True
    # The effects among which it is searched (None: all).
    among: tuple[str, ...] | None = None

    def left_out(self, is_cut_short: bool = False) -> tuple[tuple[str, str], ...]:
        """The parts of a diagnosis that this search leaves out against the usual one, each with a sentence.

        ``is_cut_short``: the budget ended it.
        """
        parts = (
            ("sweep", not self.sweeps, "effects that no first-order promise shows were not looked for"),
            (
                "second look",
                not self.most_pairs,
                "what was named was not weighed against pairs and exchanges of effects",
            ),
            ("rounds", self.last < SEARCH.last, "the search was ended after a tenth of the usual time at most"),
            (
                "budget",
                is_cut_short and self.last >= SEARCH.last,
                "a search ended at its budget of simulation: this is the answer so far",
            ),
            ("MuJoCo", not self.in_mujoco, "the held-out recordings were not run in MuJoCo"),
            ("remainder", not self.tabled, "what stays unknown was not modelled"),
            ("next recording", not self.advised, "the next recording was not designed"),
        )
        return tuple((part, sentence) for part, is_left, sentence in parts if is_left)


SEARCH = Search()
QUICK = replace(  # a first look
    SEARCH,
    laps=3,
    later_laps=2,
    most_rivals=1,
    most_reversed=0,
    fewer_reversed=0,
    most_pairs=0,
    most_parted=0,
    most_mended=1,
    sweeps=0.0,
    raced=5.0,
    last=12.0,
    longest=12.0,
    in_mujoco=False,
    tabled=False,
    advised=False,
)


class Budget:
    """How much may be simulated, in the microseconds that it takes a slow core, about: a measure that goes alike on
    every machine, whatever runs beside. One diagnosis has one, handed in; two in two threads share none.

    After ``sweeps`` nothing is looked for that does not show by itself; a round beside a bristle is left at its first
    refits at ``raced``; none is begun after ``last``, and none after ``longest`` where effects without a bristle leave
    more than forks of stick and slip do. They grow as the recordings last longer than a minute together. The ``search``
    says how long each is.
    """

    def __init__(self, traces: Sequence[Trace], effort: Effort | None = None, search: Search = SEARCH):
        self.effort, self.search = Effort() if effort is None else effort, search
        longer = max(1.0, sum(float(trace.t[-1] - trace.t[0]) for trace in traces) / 60.0)
        begun, second = self.effort.spent, longer * 1_000_000
        self.sweeps, self.raced = begun + second * search.sweeps, begun + second * search.raced
        self.last, self.longest = begun + second * search.last, begun + second * search.longest

    @property
    def spent(self) -> int:
        """[us]"""
        return self.effort.spent
