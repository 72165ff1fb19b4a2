"""What an answer leaves: in words, and where the held-out recordings lie beyond what it was fitted to."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from ers_mj.data.recording import Recording
from ers_mj.diagnosis.sentences import shown

BEYOND = 0.1  # of the training recordings' range, by which a held-out one must leave it to be told


def remainder(explained: float, is_left: bool, levels: float, beyond: Sequence[str], own: str = "") -> dict:
    """The entry of diagnosis.json: the share that is explained, whether more is missing, the held-out error in noise
    ``levels``, and the sentences of ``beyond_training``. Where all that is left comes of what a held-out recording has
    of its ``own``, that is said.
    """
    words = "a mismatch is left that nothing named accounts for" if is_left else "nothing beyond the noise is left"
    if own:
        words = f"what is left is that a recording which is held out has {own} of its own, which nothing else tells"
    sentence = (
        f"{explained:.0%} of the squared held-out error above the noise is explained; {words}: held out the error is"
        f" {levels:.3g} times the noise floor."
    )
    return {
        "explained_share": explained,
        "significant": is_left,
        "heldout_in_noise_floors": levels,
        "beyond_training": list(beyond),
        "sentence": " ".join([sentence, *beyond]),
    }


def beyond_training(recordings: Sequence[Recording], holdout: Sequence[Recording]) -> list[str]:
    """A sentence for each held-out recording whose output or input leaves the range of the training recordings: what
    a model says there was never compared with a measurement.
    """
    told = []
    for what, unit, values in (
        ("output", recordings[0].output_unit, lambda r: r.y[r.valid]),
        ("input", recordings[0].input_unit, lambda r: r.u),
    ):
        low, high = _range([values(r) for r in recordings])
        margin = BEYOND * (high - low)
        for r in holdout:
            least, most = _range([values(r)])
            if least < low - margin or most > high + margin:
                told.append(
                    f"{r.name} takes the {what} from {shown(least, unit)} to {shown(most, unit)}, the training"
                    f" recordings from {shown(low, unit)} to {shown(high, unit)}: beyond, the model only extrapolates."
                )
    return told


def _range(values: Sequence[np.ndarray]) -> tuple[float, float]:
    return min(float(np.min(v)) for v in values), max(float(np.max(v)) for v in values)
