"""What the report draws of a case: every recording, measured and simulated, and the ladder of what was compared."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import replace

from ers_mj.diagnosis.case import Case
from ers_mj.diagnosis.evidence import RecordView, Rung
from ers_mj.diagnosis.localisation import Samples, shaded
from ers_mj.effects import BY_NAME
from ers_mj.selection.cross_validation import pooled


def views(case: Case, samples: Samples) -> list[RecordView]:
    """Every recording, the held-out ones first, with where it is explained least."""
    out, run = [], case.confirmed.measure.run
    for model, base, fold in zip(case.confirmed.models, case.confirmed.base_models, case.confirmed.parts):
        t = fold.held_out
        out.append(RecordView(t.name, True, t.t, t.u, t.y, run(base, t), run(model, t), ()))
    held_names = {v.name for v in out}
    for k, t in enumerate(case.start.traces):
        spans = shaded(t, k, samples) if case.verdict in ("missing_physics", "unexplained") else ()
        if t.name in held_names and case.confirmed.parts[0].training is not None and len(case.start.traces) > 1:
            i = [v.name for v in out].index(t.name)
            out[i] = replace(out[i], shaded=spans)
        else:
            out.append(
                RecordView(
                    t.name,
                    False,
                    t.t,
                    t.u,
                    t.y,
                    run(case.start.fit.model, t, k),
                    run(case.model, t, k),
                    spans,
                )
            )
    return out


def ladder(case: Case) -> Iterator[Rung]:
    """The baseline, and what each round compared."""
    c = case.confirmed
    yield Rung((), 0.0, 0.0, pooled(c.before).rmse, not case.model.names, "refitted baseline", case.start.fit.size)
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
            )
