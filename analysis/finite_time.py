"""Is it finite time? Phase portraits, V_3 along them, and the approach to rest: `python analysis/finite_time.py`.

The loop of `ftrc` around Eq. (5) at 10 kHz, let go at several distances, with q = 97/99 (the paper's), q = 5/7 (far
from 1, so that finite time shows) and q = 1 (the same law made linear), otherwise Eq. (40)'s gains. Two plants: Eq. (5)
as it is, and one without friction, preload and voltage limit, which is the double integrator of the proof. V_3 is Eq.
(24)'s with x1 as the controller has it. Printed: the time to come within 0.1 and 0.005 of the start for good, the share
of samples in which V_3 grows by more than 1e-6 of its first value, and its largest growth. Writes
docs/paper/finite_time.png.
"""

from __future__ import annotations

import math
from dataclasses import replace
from fractions import Fraction
from pathlib import Path

import matplotlib
import numpy as np
from matplotlib.figure import Figure

from ers_mj.control.closed_loop import Sensor, close
from ers_mj.control.controllers import CONTROLLERS, Gains, Servo
from ers_mj.control.gains import lyapunov
from ers_mj.control.references import Reference
from ers_mj.control.trial import sampled
from ers_mj.report.style import STYLE
from ers_mj.servo.datasheet import Datasheet, read_datasheet
from ers_mj.servo.simulation import build_plant

RATE, SECONDS, EVERY = 10_000.0, 0.6, 40  # [Hz], [s], samples from one value of V_3 to the next
POWERS = ((Fraction(97, 99), STYLE.after), (Fraction(5, 7), "#8a6bb8"), (Fraction(1), STYLE.before))
STARTS_DEG = (-10.0, -5.0, 5.0, 10.0)
GROWTH = 1e-6
PICTURE = Path(__file__).resolve().parents[1] / "docs" / "paper" / "finite_time.png"


def let_go(sheet: Datasheet, q: Fraction, start: float, u_max: float) -> np.ndarray:
    """Rows (N, 4) of t [s] and Eq. (7)'s x1 [rad s], x2 [rad], x3 [rad/s] of a loop that is let go at x2 = start
    [rad].
    """
    law = CONTROLLERS["ftrc"](Servo.of(sheet), RATE, u_max, gains=Gains(q=q), filter_s=0.0)
    t = np.arange(round(SECONDS * RATE)) / RATE
    home = law.servo.theta_0 + 0.2
    law.reset(home - start)
    plant = build_plant(sheet)
    run = close(
        law,
        sampled(plant, RATE, (home - start, 0.0)),
        Sensor((), t),
        Reference("rest", t, np.full(t.size, home), 0 * t, 0 * t),
        plant.terminal,
    )
    x2 = home - run.theta
    return np.column_stack([t, np.cumsum(x2) / RATE, x2, -run.omega])


def within(rows: np.ndarray, share: float) -> float:
    """Time [s] from which |x2| stays within this share of its first value."""
    outside = np.flatnonzero(np.abs(rows[:, 2]) > share * abs(rows[0, 2]))
    return float(rows[min(outside[-1] + 1, len(rows) - 1), 0]) if outside[-1] + 1 < len(rows) else math.inf


def main() -> None:
    """Run, tell, draw."""
    sheet = read_datasheet("table1")
    bare = replace(sheet, parameters={**sheet.parameters, "F_c": 0.0, "T_LH": 0.0})
    with matplotlib.rc_context(STYLE.settings):
        figure = Figure(figsize=(9.8, 6.6), layout="constrained")
        for row, (name, plant, u_max) in zip(
            figure.subplots(2, 3),
            (("Eq. (5), 24 V", sheet, 24.0), ("no friction, preload, limit", bare, 1e9)),
            strict=True,
        ):
            portrait, fall, approach = row
            print(
                f"{name}\n  {'q':>6} {'start [deg]':>12} {'to 0.1 [ms]':>12} {'to 0.005 [ms]':>13} {'V_3 grows in':>13}"
                f" {'by at most':>11}"
            )
            for q, colour in POWERS:
                for start in STARTS_DEG:
                    rows = let_go(plant, q, math.radians(start), u_max)
                    V = np.array([lyapunov(Gains(q=q), *x) for x in rows[::EVERY, 1:]])
                    growth = np.diff(V) / V[0]
                    print(
                        f"  {q!s:>6} {start:12g} {1e3 * within(rows, 0.1):12.1f} {1e3 * within(rows, 0.005):13.1f}"
                        f" {np.mean(growth > GROWTH):13.1%} {max(growth.max(), 0):11.2g}"
                    )
                    portrait.plot(np.degrees(rows[:, 2]), np.degrees(rows[:, 3]), color=colour, linewidth=1.1)
                    if start == STARTS_DEG[-1]:
                        fall.semilogy(1e3 * rows[::EVERY, 0], np.maximum(V, 1e-18), color=colour, label=f"q = {q}")
                        approach.semilogy(
                            1e3 * rows[:, 0], np.maximum(np.degrees(np.abs(rows[:, 2])), 1e-8), color=colour
                        )
            portrait.set_title(name, color=STYLE.ink)
            for ax, x, y in (
                (portrait, "x2 [°]", "x3 [°/s]"),
                (fall, "time [ms]", "V_3"),
                (approach, "time [ms]", "|x2| [°]"),
            ):
                ax.set_xlabel(x)
                ax.set_ylabel(y)
            fall.legend()
        PICTURE.parent.mkdir(parents=True, exist_ok=True)
        figure.savefig(PICTURE, dpi=110, metadata={"Software": None})
    print("written docs/paper/finite_time.png")


if __name__ == "__main__":
    main()
