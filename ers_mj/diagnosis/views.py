"""What the report draws of a case: every recording, measured and simulated, and the ladder of what was compared."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import replace

from ers_mj.data.prepared import Trace
from ers_mj.diagnosis.case import Case
from ers_mj.diagnosis.evidence import RecordView, Rung
from ers_mj.diagnosis.localisation import Samples, shaded
from ers_mj.effects import BY_NAME
from ers_mj.selection.cross_validation import pooled
from ers_mj.servo.model import Model


def views(case: Case, samples: Samples) -> list[RecordView]:
    """Every recording, the held-out ones first, with where it is explained least."""
    parts = zip(case.confirmed.base_models, case.confirmed.models, case.confirmed.parts)
    out = [_view(case, base, model, fold.held_out, 0, True) for base, model, fold in parts]
    held = {view.name: k for k, view in enumerate(out)}
    is_left_out = case.confirmed.parts[0].training is not None and len(case.start.traces) > 1
    for k, trace in enumerate(case.start.traces):
        spans = shaded(trace, k, samples) if case.verdict in ("missing_physics", "unexplained") else ()
        if is_left_out and trace.name in held:
            place = held[trace.name]
            out[place] = replace(out[place], shaded=spans)
        else:
            out.append(replace(_view(case, case.start.fit.model, case.model, trace, k, False), shaded=spans))
    return out


def _view(case: Case, base: Model, model: Model, trace: Trace, record: int, is_held_out: bool) -> RecordView:
    """One recording beside the runs of both models, and of the second without each of the effects that are named, where
    the sensor may have seen it.
    """
    run = lambda model, trace, record: case.confirmed.measure.run(model, trace, record)[trace.known]
    named = {name for name, _ in model.effects_of(record)}.intersection(case.told_effects)
    without = {name: run(model.without_effect(name), trace, record) for name in case.told_effects if name in named}
    runs = run(base, trace, record), run(model, trace, record)
    t, u, y = (x[trace.known] for x in (trace.t, trace.u, trace.y))
    return RecordView(trace.name, is_held_out, t, u, y, *runs, without=without)


def ladder(case: Case) -> Iterator[Rung]:
    """The baseline, and what each round compared."""
    c = case.confirmed
    bare, alone = case.start.fit.size, not case.model.names
    yield Rung((), 0.0, 0.0, pooled(c.before).rmse, alone, "refitted baseline", bare, 0.0)
    for ranked in case.selection.rounds:
        for candidate in ranked:
            names = candidate.fit.model.names
            chosen = names == case.model.names
            yield Rung(
                names or (candidate.name,),
                candidate.gain,
                candidate.z,
                pooled(c.after).rmse if chosen else None,
                chosen,
                "" if candidate.name in BY_NAME else "differs between recordings",
                candidate.fit.size,
                case.start.fit.cost - candidate.fit.cost,
            )
