"""Excitations: waves of about unit size over t, each drawn anew."""

from __future__ import annotations

import numpy as np


def multisine(rng, t):
    """Sum of sines from 0.15 Hz up to 4-8 Hz, amplitude falling with frequency."""
    f = np.arange(1, int(rng.uniform(4.0, 8.0) * 6.0)) / 6.0
    wave = (np.cos(2.0 * np.pi * np.outer(t, f) + rng.uniform(0, 2 * np.pi, f.size)) * f**-0.35).sum(1)
    return wave / np.abs(wave).max()


def chirp(rng, t):
    """From 0.2-0.4 Hz up to 2-5 Hz, the amplitude falling as the frequency rises."""
    low, high = rng.uniform(0.2, 0.4), rng.uniform(2.0, 5.0)
    f = low * (high / low) ** (t / t[-1])
    return np.sin(2.0 * np.pi * np.cumsum(f) * (t[1] - t[0])) * (low / f) ** 0.3


def staircase(rng, t):
    """Levels of growing and falling size and changing sign, some at zero, each held 0.2-0.7 s."""
    edges = np.cumsum(rng.uniform(0.2, 0.7, 60))
    levels = rng.uniform(0.55, 1.0, 61) * np.where(np.arange(61) % 2, 1.0, -1.0)
    levels[::5] *= rng.choice([0.0, 0.4], 13)
    return levels[np.searchsorted(edges, t)]


def slow_triangle(rng, t):
    """Up and down once or twice."""
    return triangle(rng, t, rng.uniform(0.15, 0.35))


def triangle(rng, t, f=None):
    """Triangles of growing amplitude at 0.4-1.2 Hz."""
    phase = t * (rng.uniform(0.4, 1.2) if f is None else f)
    size = 1.0 if f is not None else 0.4 + 0.6 * np.minimum(1.0, np.floor(phase) / max(1.0, np.floor(phase[-1])))
    return size * 2.0 / np.pi * np.arcsin(np.sin(2.0 * np.pi * phase))


def square(rng, t):
    """Squares of graded amplitude at 0.4-1.2 Hz."""
    phase = t * rng.uniform(0.4, 1.2)
    grade = rng.permutation(np.linspace(0.3, 1.0, int(phase[-1]) + 2))[np.floor(phase).astype(int)]
    return grade * np.where(phase % 1.0 < 0.5, 1.0, -1.0)


WAVES = {f.__name__: f for f in (multisine, chirp, staircase, slow_triangle, triangle, square)}
