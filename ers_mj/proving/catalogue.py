"""The catalogue: every effect that the independent simulators can hide in a servo, and how it is set in them.

A catalogue entry draws a shape (its functional form and the numbers beside the strength) and writes strength and shape
into the simulators' record.
"""

from __future__ import annotations

import numpy as np

from ers_mj.proving.concealed import drive, friction, load, loop, outside, sensor, transmission
from ers_mj.proving.concealed.base import spells
from ers_mj.proving.plant import DEG

CATALOGUE = {e.name: e for part in (friction, transmission, drive, load, sensor, outside) for e in part.ENTRIES}
"""Every effect by name; `listed` tells those of the contract from those that no library can name."""

LISTED = tuple(name for name, effect in CATALOGUE.items() if effect.listed)
IN_LOOP = {e.name: e for e in loop.ENTRIES}
"""What acts on the reference of a servo's own loop; `bench` sets it."""

OUTSIDE = tuple(name for name, effect in CATALOGUE.items() if not effect.listed)


def put_effects(plant, effects, record):
    """Write effects (mappings with label, strength, shape) into the simulator's record for recording number `record`
    (from 0).
    """
    for effect in effects:
        if effect["label"] in IN_LOOP:
            continue
        if effect["label"] not in CATALOGUE:
            raise ValueError(f"effect {effect['label']!r} is not known; there are {', '.join(CATALOGUE)}")
        CATALOGUE[effect["label"]].put(plant, effect["strength"], effect["shape"], record)


def samples_of(effects, record, samples, dt):
    """((samples,) reading stuck, spike added [rad], gain of the drive) from the effects that act sample by sample."""
    stuck, spike, gain = np.zeros(samples, bool), np.zeros(samples), np.ones(samples)
    for effect in effects:
        shape, s = effect["shape"], effect["strength"]
        if "seed" not in shape:
            continue
        rng = np.random.default_rng([shape["seed"], record])
        if effect["label"] == "intermittent_gain":
            gain[spells(rng, samples, dt, shape["rate_per_s"], shape["mean_s"])] = 1.0 - s
        elif shape["form"] == "stuck":
            stuck |= spells(rng, samples, dt, shape["rate_per_s"], 0.01 * s)
        else:
            hit = rng.random(samples) < shape["rate_per_s"] * dt
            spike[hit] += s * DEG * (rng.standard_normal(samples) + 1.5 * rng.choice([-1.0, 1.0], samples))[hit]
    return stuck, spike, gain
