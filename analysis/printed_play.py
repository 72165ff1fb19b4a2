"""Eq. (4) as the paper prints it against a gap joint: `python analysis/printed_play.py [--gap DEG] [--picture FILE]`.

Table 1, voltages by name, three models: Eq. (5) without play, the gap joint (two bodies, the reduced model's), Eq. (4)
around Eq. (5). Eq. (4) has a torque where an angle belongs, so its width is taken twice: as what the return spring
pulls over the play, k_s gap, and as whatever brings it nearest to the gap joint, input by input. Printed: how far each
is from the others, and what each does at rest.
"""

from __future__ import annotations

import argparse
from pathlib import Path

import numpy as np

from ers_mj.plants.bare_gap import stiff_play
from ers_mj.plants.inputs import INPUTS
from ers_mj.plants.printed_play import PrintedPlay, printed_threshold
from ers_mj.plants.reduced import Motion, ReducedModel, lumped
from ers_mj.servo.datasheet import TABLE_1, read_datasheet

T = np.arange(6000) / 1000.0
J = TABLE_1["J"]
WIDTHS = np.geomspace(0.0002, 0.4, 34)  # [N m] of Eq. (4), tried for the nearest; breakaway takes 0.8 N m
SHOWN = "square"
COLOURS = {"gap joint": "#a3afbc", "Eq. (4), k_s gap": "#d9762b", "Eq. (4), nearest": "#0b7a75"}


def rms_deg(x: np.ndarray) -> float:
    """Root mean square of x [rad], in degrees."""
    return float(np.degrees(np.sqrt(np.mean(np.square(x)))))


def nearest(c, u: np.ndarray, target: np.ndarray) -> tuple[float, Motion]:
    """The width n delta [N m] of Eq. (4) whose motion under u is nearest to `target` (N,) [rad], and that motion."""
    runs = {width: PrintedPlay(c, width / J).simulate(T, u) for width in WIDTHS}
    return min(runs.items(), key=lambda item: rms_deg(item[1].theta - target))


def main() -> None:
    """Compare, tell, draw."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--gap", type=float, default=0.5, help="half the play [deg]")
    parser.add_argument("--picture", type=Path, help="file to draw into")
    arguments = parser.parse_args()
    gap = np.radians(arguments.gap)
    c = lumped(read_datasheet("table1").to_lumped() | {"tau_e": 0.0})
    spring = printed_threshold(c, gap)
    print(
        f"play +-{arguments.gap:g} deg; k_s gap = {1e3 * spring * J:.3g} mN m; deviations in deg RMS, n delta in mN m\n"
    )
    print(f"{'':10} {'without play':>14} {'Eq. (4), k_s gap':>17} {'Eq. (4), nearest':>17} {'its':>8}")
    print(f"{'':10} {'less gap joint':>14} {'less gap joint':>17} {'less gap joint':>17} {'n delta':>8}")
    for name, law in INPUTS.items():
        u = law(T)
        plain, joint = ReducedModel(c).simulate(T, u), ReducedModel(stiff_play(c, gap)).simulate(T, u)
        literal, (width, best) = PrintedPlay(c, spring).simulate(T, u), nearest(c, u, joint.theta)
        errors = (rms_deg(motion.theta - joint.theta) for motion in (plain, literal, best))
        print("{:10} {:14.4f} {:17.4f} {:17.4f} {:8.1f}".format(name, *errors, 1e3 * width))
        if name == SHOWN:
            shown = u, plain, {"gap joint": joint, "Eq. (4), k_s gap": literal, "Eq. (4), nearest": best}
    tell_rest(*shown)
    if arguments.picture:
        draw(arguments.picture, *shown)


def tell_rest(u: np.ndarray, plain: Motion, motions: dict[str, Motion]) -> None:
    """What each model does between motor and rudder."""
    print(f"\non the {SHOWN}, how far the motor turns against the rudder:")
    for name, motion in motions.items():
        print(f"  {name:18} {np.degrees(np.ptp(motion.theta_m - motion.theta)):.3f} deg")
    rest = np.flatnonzero((u[:-1] == 0) & (u[1:] != 0))[0]  # the last moment of the first rest
    print("torque that Eq. (4) leaves on the rudder at rest, no voltage, no current, at the end of the first rest:")
    for name, motion in list(motions.items())[1:]:
        print(f"  {name:18} {1e3 * J * motion.drive[rest]:.3f} mN m")


def draw(picture: Path, u: np.ndarray, plain: Motion, motions: dict[str, Motion]) -> None:
    """Deviation from the model without play, the motor against the rudder, and the voltage, over the first periods."""
    from matplotlib.figure import Figure

    figure = Figure(figsize=(8, 6.4), layout="constrained", dpi=110)
    axes = figure.subplots(3, 1, sharex=True)
    for name, motion in motions.items():
        style = {"color": COLOURS[name], "linewidth": 3.0 if name == "gap joint" else 1.4, "label": name}
        axes[0].plot(T, np.degrees(motion.theta - plain.theta), **style)
        axes[1].plot(T, np.degrees(motion.theta_m - motion.theta), **style)
    axes[2].plot(T, u, color="#3b4654", linewidth=1.2)
    for ax, label in zip(axes, ("rudder less\nno play [deg]", "motor/n less\nrudder [deg]", "u [V]"), strict=True):
        ax.set_ylabel(label)
        ax.grid(color="#e6e9ee")
        ax.spines[["top", "right"]].set_visible(False)
    axes[0].set_xlim(0, 4)
    axes[2].set_xlabel("time [s]")
    figure.legend(*axes[0].get_legend_handles_labels(), loc="outside upper left", frameon=False, ncols=3)
    picture.parent.mkdir(parents=True, exist_ok=True)
    figure.savefig(picture)


if __name__ == "__main__":
    main()
