"""What may be concealed in the loop that a servo closes itself."""

from __future__ import annotations

from ers_mj.proving.concealed.base import Effect, put_in_samples


def draw_rate_limit(rng, context):
    """The plant's own top speed [rad/s]."""
    return {"top_rad_s": context["top_rad_s"]}


def speed_limit(effect):
    """[rad/s] of the reference, of a rate_limit: strength is the share of the plant's top speed that is cut."""
    return (1.0 - effect["strength"]) * effect["shape"]["top_rad_s"]


ENTRIES = (
    Effect(
        "rate_limit", "share of the top speed that the reference is denied", 0.05, 0.92, draw_rate_limit, put_in_samples
    ),
)
