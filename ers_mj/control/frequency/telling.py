"""A study in words and as a document."""

from __future__ import annotations

import math

import numpy as np

from ers_mj.control.frequency.cycle import Cycle
from ers_mj.control.frequency.study import SCOPE, Compared, Cycles, Study


def headline(found: Study) -> str:
    """The study in one sentence: the loop with the least room, and what the cycles and the recordings say."""
    weakest = min(found.loops, key=lambda loop: loop.disk_margin if loop.stable else -1.0)
    where = f"{weakest.controller} on the {weakest.plant} plant"
    if weakest.stable:
        gain = "any gain" if weakest.disk_gain_margin_db is None else f"{weakest.disk_gain_margin_db:.1f} dB"
        phase = "any phase" if weakest.disk_phase_margin_deg is None else f"{weakest.disk_phase_margin_deg:.0f}°"
        parts = [f"Least room: {where}, which bears {gain} and {phase} at once"]
    else:
        parts = [f"Unstable: {where}"]
    cycling = [c.controller for c in found.cycles if any(c.seen.values())]
    parts.append(f"limit cycles: {', '.join(cycling)}" if cycling else "no limit cycle is seen")
    return "; ".join(parts) + "."


def notes(found: Study) -> list[str]:
    """What a reader should know of the plants, or of a firmware's loop."""
    if not found.plants:
        return [
            "Limits of the drive and of the reference's speed and dead bands are left out of margins and responses: a"
            " recording that meets them is off by them."
        ]
    out = []
    for view in found.plants:
        if (first := found.plants[0].linear.name) != view.linear.name:
            out.append(
                f"The {view.linear.name} plant's linear response is within {view.off[0]:.2g} dB and {view.off[1]:.2g}°"
                f" of the {first} plant's up to {SCOPE.compared_hz:g} Hz."
            )
        if view.linear.left_out:
            out.append(f"The linear {view.linear.name} plant leaves out: {', '.join(view.linear.left_out)}.")
    return out


def cycle_sentence(cycles: Cycles) -> str:
    """Predicted beside seen."""
    lasting = [c for c in cycles.predicted if c.lasting]
    said = f"predicted {' or '.join(_size(c) for c in lasting)}" if lasting else "none predicted"
    seen = "; ".join(f"{plant}: {_against(c, lasting) if c else 'none seen'}" for plant, c in cycles.seen.items())
    return f"{cycles.controller}: {said}; {seen}"


def _size(c: Cycle) -> str:
    return f"{c.f_hz:.1f} Hz ±{math.degrees(c.amplitude):.3g}°"


def _against(seen: Cycle, predicted: list[Cycle]) -> str:
    if not predicted:
        return f"seen {_size(seen)}"
    nearest = min(predicted, key=lambda c: abs(math.log(c.f_hz / seen.f_hz)))
    return (
        f"seen {_size(seen)}, predicted {100 * (nearest.f_hz / seen.f_hz - 1):+.0f} % in frequency, "
        f"{100 * (nearest.amplitude / seen.amplitude - 1):+.0f} % in amplitude"
    )


def as_document(found: Study) -> dict:
    """The keys of `ers frequency --json` beside the contract's four."""
    return {
        "loops": [loop.as_document() for loop in found.loops],
        "plants": [
            {
                "plant": v.linear.name,
                "theta_rad": v.linear.theta,
                "omega_rad_s": v.linear.omega,
                "left_out": v.linear.left_out,
                "max_off_db": v.off[0],
                "max_off_deg": v.off[1],
            }
            for v in found.plants
        ],
        "cycles": [
            {
                "controller": c.controller,
                "predicted": [x.as_document() for x in c.predicted],
                "simulated": {plant: x and x.as_document() for plant, x in c.seen.items()},
            }
            for c in found.cycles
        ],
        "cycle_sentences": [cycle_sentence(c) for c in found.cycles],
        "recordings": [_recording(c) for c in found.recordings],
        "notes": notes(found),
    }


def _recording(compared: Compared) -> dict:
    r = compared.response
    return {
        "name": r.name,
        "kind": r.kind,
        "periods": r.periods,
        "f_hz": r.f_hz,
        "gain_db": 20.0 * np.log10(np.abs(r.g)),
        "phase_deg": np.degrees(np.angle(r.g)),
        "coherence": r.coherence,
        "relative_error": r.error,
        "output_rad": r.output,
        "noise_rad": r.noise,
        "distortion_rad": r.distortion,
        "models": {
            name: {"gain_db": 20.0 * np.log10(np.abs(m)), "phase_deg": np.degrees(np.angle(m))}
            for name, m in compared.models.items()
        },
        "gaps": {
            name: (
                gap
                and {
                    "lines": gap.lines,
                    "rms_db": gap.rms_db,
                    "max_db": gap.max_db,
                    "rms_deg": gap.rms_deg,
                    "max_deg": gap.max_deg,
                    "band_hz": gap.band_hz,
                    "linear": gap.linear,
                }
            )
            for name, gap in compared.gaps.items()
        },
        "sentences": [
            f"{name}: {gap.sentence}" if gap else f"{name}: {r.name} is nowhere coherent enough to be compared"
            for name, gap in compared.gaps.items()
        ],
    }
