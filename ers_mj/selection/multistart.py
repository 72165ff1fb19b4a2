"""Where else may a refit of a round begin? Further starts than the screening's, of what is refitted already or waves
and widens like it.
"""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import replace

import numpy as np

from ers_mj.effects import BY_NAME
from ers_mj.estimation.objective import Fit
from ers_mj.selection.bench import Bench
from ers_mj.selection.budget import SEARCH, Search
from ers_mj.selection.comparison import is_clocked, kin_of, priced
from ers_mj.selection.screening import Begin, screen
from ers_mj.servo.model import Model


def anew(bench: Bench, finished: Mapping[str, Fit]) -> list[tuple[str, Begin]]:
    """More starts of the finished waves along the travel that leave much, from where they have brought the baseline:
    which of many periods is the true one shows badly beside parameters that stand for all of it.
    """
    out = []
    for name, found in finished.items():
        if _waves_along(name) and found.cost > bench.search.anew_from * found.misfit.size:
            alone = replace(bench, exclude=[other for other in BY_NAME if other != name])
            screened = screen(alone, [found.model.without_effect(name)], True, False, tries=bench.search.anew)
            out += [(name, begin) for begins in screened.begins.get(name, []) for begin in begins]
    return out


def more_starts(
    base: Model,
    names: Sequence[str],
    promising: Sequence[str],
    starts: Mapping[tuple[str, int], Sequence[Begin]],
    search: Search = SEARCH,
) -> list[tuple[str, Begin]]:
    """More starts of what is simulated fast and lasts: those of the screening of what is ``promising``, and of all that
    have few their own as large as they are, since a secant across forks of stick and slip may ask for a local minimum,
    or promise nothing of what acts.
    """
    out = []
    for effect in (BY_NAME[name] for name in names if not (BY_NAME[name].dear or BY_NAME[name].once)):
        own = effect.starts(base.scales)
        begins = [
            *(starts.get((effect.name, 0), ()) if effect.name in promising else ()),
            *(Begin(base.with_effect(effect.name, p), {}) for p in own if len(own) <= search.few_starts),
        ]
        out += [(effect.name, begin) for begin in begins if begin.model.has_tangents]
    return out


def other_forms(finished: Mapping[str, Fit], starts: Mapping[str, Sequence[Begin]]) -> list[tuple[str, Begin]]:
    """The best start of each other form (which of its numbers are absent) of the finished effects: after a few steps
    forms are no more alike than effects.
    """
    out = []
    for name in (n for n in finished if n in BY_NAME):
        known = [form_of(finished[name].model, name)]
        for begin in starts.get(name, ()):
            if (form := form_of(begin.model, name)) not in known:
                known.append(form)
                out.append((name, begin))
    return out


def form_of(model: Model, name: str) -> tuple[bool, ...]:
    """Which numbers of an effect are there."""
    return tuple(np.isfinite(dict(model.effects)[name]).tolist())


def wider(finished: Mapping[str, Fit], exclude: Sequence[str]) -> list[tuple[str, Begin]]:
    """Effects that have a finished one as their limit, with the models that begin there: what is wider is no worse, if
    its fit finds it.

    What is dear gives way to its own wider form only beyond a tie: that takes several times as long to simulate, and
    one local minimum may decide.
    """
    out = []
    for name, found in finished.items():
        if name in BY_NAME:
            model, without, p = found.model, found.model.without_effect(name), dict(found.model.effects)[name]
            out += [
                (
                    effect.name,
                    Begin(
                        (
                            model.with_form(name, start)
                            if effect.name == name
                            else without.with_effect(effect.name, start)
                        ),
                        {},
                    ),
                )
                for effect in BY_NAME.values()
                if effect.name not in exclude
                for start in effect.grown(name, p, model.scales)
            ]
    return out


def other_waves(finished: Mapping[str, Fit], exclude: Sequence[str]) -> list[tuple[str, Begin]]:
    """The other laws that wave along the travel, with models that begin at the period of one that leads: what acts has
    a sharp one, which starts of a law's own miss.

    Those that are one with it (effects.EQUIVALENT) are left out: they are told apart by how long their periods are.
    """
    leader = min(finished, key=lambda name: priced(finished[name]))
    model = finished[leader].model
    if not _waves_along(leader) or model.plant().coupled:
        return []
    out, without = [], model.without_effect(leader)
    period = dict(model.effects)[leader][_column_of_period(leader)]
    kin = kin_of(leader)
    for effect in (e for e in BY_NAME.values() if _waves_along(e.name) and e.name not in (*exclude, *kin)):
        column = _column_of_period(effect.name)
        waves = [p for p in effect.starts(model.scales) if np.isfinite(p[column])]
        forms = {
            tuple(np.isfinite(p)): p for p in waves if period <= waves[0][column]
        }  # of which the first is the longest
        for p in forms.values():
            for phase in (0.0, 0.5 * math.pi):
                begun = p.copy()
                begun[column], begun[effect.wave[1]] = period, phase
                out.append((effect.name, Begin(without.with_effect(effect.name, begun), {})))
    return out


def _waves_along(name: str) -> bool:
    return name in BY_NAME and BY_NAME[name].wave is not None and not is_clocked(name)


def _column_of_period(name: str) -> int:
    return next(k for k, p in enumerate(BY_NAME[name].parameters) if p.name == "period")
