"""Where the describing function of a play holds: `python analysis/limit_cycle_of_play.py` writes docs/limit_cycle.png.

Table 1 with F_c = T_LH = 0, play +-0.5 deg (effect `backlash`), feedback of the rudder's angle by a PID of 2 V/deg,
1.2 V/(deg s), 0.05 V s/deg at 2 kHz with a speed filter of
0.5 ms and 24 V; 0.64 of the inertia and of the bearing's damping at the motor. The contact is a spring-damper that
pushes and never pulls; its frequency (against the whole inertia) and damping ratio are varied. Printed: predicted and
simulated frequency and amplitude of the rudder, their ratio, the share of the time in contact, and how far from a sine
the twist is (share of its power above the first harmonic). Then the same with Table 1's friction and preload.
"""

from __future__ import annotations

import math
from dataclasses import replace
from pathlib import Path

import matplotlib
import numpy as np
from matplotlib.figure import Figure

from ers_mj.control.controllers import CONTROLLERS, Aim, PidGains, Servo
from ers_mj.control.frequency.cycle import Cycle, lasting, predicted
from ers_mj.effects.quantities import Coefficients
from ers_mj.plants.sampled_reduced import SampledReduced
from ers_mj.report.style import STYLE
from ers_mj.servo.datasheet import Datasheet, read_datasheet
from ers_mj.servo.simulation import build_plant

RATE, SECONDS, GAP = 2000.0, 3.0, math.radians(0.5)
CONTACTS_HZ, DAMPINGS = (40.0, 120.0, 400.0), (0.1, 0.2, 0.4, 0.7, 1.0)
SHOWN = ((40.0, 0.2), (400.0, 1.0))
PICTURE = Path(__file__).resolve().parents[1] / "docs" / "limit_cycle.png"


def watched(
    sheet: Datasheet, known: Servo, f_contact: float, zeta: float
) -> tuple[list[Cycle], Cycle | None, np.ndarray, np.ndarray]:
    """Predicted cycles that last, the simulated one, and the end of its motion: rudder and twist (N,) [rad] about
    theta_0.
    """
    plant = build_plant(
        sheet, effects=[("backlash", {"gap": GAP, "rho": 0.64, "phi": 0.0, "f_contact": f_contact, "zeta": zeta})]
    )
    law = CONTROLLERS["pid"](known, RATE, pid=PidGains(P=2.0, D=0.05))
    c, n = Coefficients(*plant._lowered[0]), round(SECONDS * RATE)
    loop, angle, twist = SampledReduced(plant, RATE, (c.theta_0 + 0.03, 0.0)), np.empty(n), np.empty(n)
    law.reset(loop.theta)
    aim = Aim(c.theta_0)
    for k in range(n):
        angle[k], twist[k] = loop.theta - c.theta_0, loop._x[3] - loop.theta
        loop.hold(law.voltage(aim, loop.theta, k / RATE))
    return (
        [x for x in predicted(law, c, c.theta_0) if x.lasting],
        lasting(angle, 1.0 / RATE),
        angle[-n // 4 :],
        twist[-n // 4 :],
    )


def beyond_first(twist: np.ndarray, f_hz: float) -> float:
    """Share of the twist's power that is not at its first harmonic."""
    t = np.arange(twist.size) / RATE
    columns = np.column_stack([np.cos(2 * np.pi * f_hz * t), np.sin(2 * np.pi * f_hz * t), np.ones(t.size)])
    rest = twist - columns @ np.linalg.lstsq(columns, twist, rcond=None)[0]
    return float(rest.var() / twist.var())


def main() -> None:
    """Vary, tell, draw."""
    sheet = read_datasheet("table1")
    free = replace(sheet, parameters={**sheet.parameters, "F_c": 0.0, "T_LH": 0.0})
    known, kept, motions = Servo.of(free), {}, {}
    print(
        f"{'contact':>14} {'predicted':>20} {'simulated':>20} {'f ratio':>8} {'E ratio':>8} {'in contact':>11}"
        f" {'not sine':>9}   with friction"
    )
    for f_contact in CONTACTS_HZ:
        for zeta in DAMPINGS:
            told, seen, angle, twist = watched(free, known, f_contact, zeta)
            stuck = watched(sheet, known, f_contact, zeta)
            if not told or seen is None:
                print(f"{f_contact:8g} Hz {zeta:4g}: predicted {told}, simulated {seen}")
                continue
            best = told[0]
            ratio = best.f_hz / seen.f_hz, best.amplitude / seen.amplitude
            kept[f_contact, zeta], motions[f_contact, zeta] = ratio, (angle, twist, seen)
            sizes = [f"{x.f_hz:6.1f} Hz {math.degrees(x.amplitude):6.3f} deg" for x in (best, seen)]
            print(
                f"{f_contact:8g} Hz {zeta:4g} {sizes[0]:>20} {sizes[1]:>20} {ratio[0]:8.2f} {ratio[1]:8.2f}"
                f" {np.mean(np.abs(twist) > GAP):10.0%} {beyond_first(twist, seen.f_hz):9.1%}   predicted"
                f" {'none' if not stuck[0] else f'{stuck[0][0].f_hz:.0f} Hz'}, seen"
                f" {'none' if stuck[1] is None else f'{stuck[1].f_hz:.0f} Hz'}"
            )
    _draw(kept, motions)


def _draw(kept: dict, motions: dict) -> None:
    with matplotlib.rc_context(STYLE.settings):
        figure = Figure(figsize=(9.8, 3.4), layout="constrained")
        ratios, *waves = figure.subplots(1, 3, width_ratios=(1.1, 1, 1))
        for f_contact, shade in zip(CONTACTS_HZ, (STYLE.after, STYLE.before, "#8a6bb8"), strict=True):
            points = [(zeta, *kept[f_contact, zeta]) for zeta in DAMPINGS if (f_contact, zeta) in kept]
            for column, dash in ((1, "-"), (2, (0, (3, 2)))):
                ratios.plot(
                    [p[0] for p in points],
                    [p[column] for p in points],
                    color=shade,
                    linestyle=dash,
                    marker="o",
                    markersize=4,
                    label=f"{f_contact:g} Hz, {'frequency' if column == 1 else 'amplitude'}",
                )
        ratios.axhspan(0.8, 1.2, color="#dfe4ea", zorder=0, linewidth=0)
        ratios.set_xlabel("damping ratio of the contact")
        ratios.set_ylabel("predicted over simulated")
        ratios.set_ylim(0.7, 3.6)
        ratios.legend(fontsize=7, ncols=2, loc="upper left", columnspacing=0.8, handlelength=1.6)
        for ax, key in zip(waves, SHOWN, strict=True):
            angle, twist, seen = motions[key]
            n = min(round(2.5 * RATE / seen.f_hz), angle.size)
            t = 1e3 * np.arange(n) / RATE
            ax.axhspan(-0.5, 0.5, color="#f3efe2", zorder=0, linewidth=0)
            ax.plot(t, np.degrees(angle[:n]), color=STYLE.measured, linewidth=2.2, label="rudder")
            ax.plot(t, np.degrees(twist[:n]), color=STYLE.before, label="twist")
            ax.set_title(f"contact {key[0]:g} Hz, {key[1]:g}", color=STYLE.ink)
            ax.set_xlabel("time [ms]")
            ax.set_ylabel("angle [°]")
            ax.legend(fontsize=8)
        PICTURE.parent.mkdir(exist_ok=True)
        figure.savefig(PICTURE, dpi=110, metadata={"Software": None})
    print("written docs/limit_cycle.png")


if __name__ == "__main__":
    main()
