"""What recordings of one call must have in common."""

from __future__ import annotations

from collections import Counter
from typing import TYPE_CHECKING

from ers_mj.errors import InputError

if TYPE_CHECKING:
    from ers_mj.data.recording import Recording
    from ers_mj.servo.datasheet import Datasheet


def refuse_twice(recordings: list[Recording], holdout: list[Recording]) -> None:
    """Raise InputError where one recording, by its content, is given twice or both trained and held out."""
    first: dict[tuple[str, str], str] = {}
    trained = {_identity(recording) for recording in recordings}
    for recording, held_out in [*((r, False) for r in recordings), *((r, True) for r in holdout)]:
        key = _identity(recording)
        if held_out and key in trained:
            raise InputError(
                f"{recording.name}: is held out and also among the training recordings "
                f"(as {first[key]}), a recording cannot judge what it taught"
            )
        if key in first:
            raise InputError(f"{recording.name}: is the same recording as {first[key]}, give it once")
        first[key] = recording.name


def _identity(recording: Recording) -> tuple[str, str]:
    """Content and run."""
    return recording.sha256, recording.name.partition("#run=")[2]


def refuse_mixed_inputs(recordings: list[Recording]) -> None:
    """Raise InputError where inputs are not all of one kind, or outputs or inputs of one unit."""
    kinds = Counter(recording.input_kind for recording in recordings)
    if len(kinds) > 1:
        common = kinds.most_common(1)[0][0]
        odd = next(r for r in recordings if r.input_kind != common)
        other = next(r for r in recordings if r.input_kind == common)
        raise InputError(
            f"{odd.name}: its input is a {odd.input_kind} and that of {other.name} a {common}, recordings of one kind"
            " of input were expected (choose with --input)"
        )
    for noun, attribute in (("output", "output_unit"), ("input", "input_unit")):
        units = Counter(getattr(recording, attribute) for recording in recordings)
        if len(units) > 1:
            common = units.most_common(1)[0][0]
            odd = next(r for r in recordings if getattr(r, attribute) != common)
            other = next(r for r in recordings if getattr(r, attribute) == common)
            raise InputError(
                f"{odd.name}: its {noun} is in {getattr(odd, attribute)} and that of {other.name} in {common}, "
                "recordings of one unit were expected"
            )


def refuse_other_units(sheet: Datasheet | None, recordings: list[Recording]) -> None:
    """Raise InputError where a datasheet tells its units, and recordings are in others."""
    if sheet is None:
        return
    first = recordings[0]
    told = (sheet.output_unit, first.output_unit, "output"), (sheet.input_unit, first.input_unit, "input")
    for known, recorded, noun in told:
        if known and _percent(known) != _percent(recorded):
            raise InputError(
                f"{first.name}: its {noun} is in {_percent(recorded)} and that of {sheet.name or 'the datasheet'} in"
                f" {_percent(known)}, one unit was expected"
            )


def _percent(unit: str) -> str:
    return "%" if unit == "pct" else unit
