"""Conceal effects in an independent servo and write the recordings, in the format of the shared development cases.

    python analysis/concealed_cases.py --out DIR --seed 1 --cases 28 --effects first --kind single

writes DIR/case-NNN/{datasheet.toml, rec1.csv, ...} and DIR/truth/case-NNN.json. Kinds and effects are taken in turn:
case i has kind number i modulo the kinds given (repeat a word to weigh it: `--kind single,single,none`), and the k-th
single case has effect number k modulo the effects. Every case draws from its own child of the seed, so a case does not
depend on the others or on --jobs.
"""

import argparse
import json
import multiprocessing
import sys
from pathlib import Path

import numpy as np

sys.path.insert(0, str(Path(__file__).resolve().parents[1]))
from ers_mj.proving.catalogue import CATALOGUE, LISTED, OUTSIDE
from ers_mj.proving.plant import DEG, TABLE_1
from ers_mj.proving.quick import FINE, simulate
from ers_mj.proving.servo import draw_servo
from ers_mj.proving.sizing import ALIKE, pooled, refit, sizes, step_for

FIRST = (
    "asymmetric_friction",
    "bias_torque",
    "stribeck",
    "load_dependent_friction",
    "quadratic_drag",
    "backlash",
    "voltage_saturation",
    "drive_dead_zone",
    "input_delay",
    "inductance",
    "gravity_imbalance",
    "hinge_moment_cubic",
    "end_stop",
    "sensor_quantisation",
)
KINDS = ("single", "none", "pair", "outside")


def tune(servo, effect, shape, target):
    """(strength, size) whose size comes closest to the target: false position on the logarithms, within plausible
    bounds.
    """
    low, high = np.log(effect.low), np.log(effect.high)
    if effect.name == "inductance":
        low = np.log(max(effect.low, 2.5 * servo["params"]["L"]))
    best, guess, seen = None, 0.5 * (low + high), []
    for _ in range(9):
        trial = [{"label": effect.name, "strength": float(np.exp(guess)), "shape": shape}]
        size = max(pooled(servo, sizes(servo, trial, step_for(trial))[0]), 1e-9)
        miss = np.log(size / target)
        if best is None or abs(miss) < abs(best[2]):
            best = (float(np.exp(guess)), size, miss)
        if abs(miss) < 0.1 or high - low < 1e-3:
            break
        low, high = (low, guess) if miss > 0 else (guess, high)
        seen.append((guess, miss))
        guess = next_guess(seen, low, high)
    return best[:2]


def next_guess(seen, low, high):
    """Secant through the last two where it stays well inside (low, high), else the middle; near-flat sizes get the
    middle.
    """
    (a, fa), (b, fb) = seen[-2:] if len(seen) > 1 else ((0.0, 0.0), (0.0, 0.0))
    if abs(fb - fa) > 0.05 and a != b:
        guess = b - fb * (b - a) / (fb - fa)
        if low + 0.02 * (high - low) < guess < high - 0.02 * (high - low):
            return guess
    if len(seen) == 1 and low < seen[0][0] - np.clip(seen[0][1], -2.0, 2.0) < high:
        return seen[0][0] - np.clip(seen[0][1], -2.0, 2.0)
    return 0.5 * (low + high)


def conceal(rng, servo, name, span):
    """An effect of the catalogue with drawn shape and tuned strength; a second shape where the size is out of reach."""
    effect, best = CATALOGUE[name], None
    target = float(np.exp(rng.uniform(np.log(span[0]), np.log(span[1]))))
    for _ in range(2):
        shape = effect.draw(rng, servo["context"])
        strength, size = tune(servo, effect, shape, target)
        if best is None or abs(np.log(size / target)) < abs(np.log(best[2] / target)):
            best = (strength, shape, size)
        if abs(np.log(size / target)) < 0.4:
            break
    return {
        "label": name,
        "strength_name": effect.strength_name,
        "strength": best[0],
        "shape": best[1],
        "target_sigma": target,
    }


# ---- one case
# ---------------------------------------------------------------------------------------------------------


def plan(options):
    """[(kind, effect or None)] of every case, in turn."""
    kinds, out, turn = options.kind, [], {"single": 0, "outside": 0}
    for i in range(options.cases):
        kind = kinds[i % len(kinds)]
        names = {"single": options.effects, "outside": OUTSIDE}.get(kind)
        out.append((kind, names[turn[kind] % len(names)] if names else None))
        if names:
            turn[kind] += 1
    return out


def draw_pair(rng, names):
    """Two effects that can be told apart and joined."""
    for _ in range(200):
        a, b = rng.choice(len(names), 2, replace=False)
        pair = {names[a], names[b]}
        if not any(pair <= alike for alike in ALIKE):
            return [names[a], names[b]]
    raise ValueError(f"no two of {', '.join(names)} can be combined")


def names_of(rng, kind, name, options):
    """Labels to conceal in a case of this kind."""
    if kind == "none":
        return []
    return draw_pair(rng, options.effects) if kind == "pair" else [name]


def make_case(job):
    """Draw, simulate and write case number `index`; its line for the listing."""
    index, child, (kind, name), options = job
    rng, case = np.random.default_rng(child), f"case-{index + 1:03d}"
    servo = draw_servo(rng, options.coloured)
    effects = [
        conceal(rng, servo, label, (options.sigma_min, options.sigma_max))
        for label in names_of(rng, kind, name, options)
    ]
    per_record, runs = sizes(servo, effects, FINE)
    for effect in effects:
        alone = per_record if len(effects) == 1 else sizes(servo, [effect], step_for([effect]))[0]
        effect |= {"effect_size_sigma": pooled(servo, alone), "effect_size_per_record": [round(x, 3) for x in alone]}
    left = refit(servo, runs) if effects and options.refit else [0.0 if not effects else None] * len(runs)
    folder = Path(options.out) / case
    folder.mkdir(parents=True, exist_ok=True)
    write_datasheet(folder / "datasheet.toml", servo["sensor"]["sample_rate_hz"])
    current = np.random.default_rng(child.spawn(1)[0])
    for number, (record, result) in enumerate(zip(servo["records"], runs)):
        write_record(folder / f"rec{number + 1}.csv", record, result, servo["sensor"], current)
    truth = truth_of(case, kind, servo, effects, runs, per_record, left, [options.seed, index])
    (Path(options.out) / "truth" / f"{case}.json").write_text(json.dumps(truth, indent=1))
    return f"{case} {kind:8s} {'+'.join(truth['labels']) or '-':40s} size {truth['effect_size_sigma']:8.1f} sigma"


def truth_of(case, kind, servo, effects, runs, per_record, left, seed):
    """The truth file's content."""
    visible = None if None in left else pooled(servo, left)
    theta_0, sensor = servo["params"]["theta_0"], servo["sensor"]
    inductance = [run_without_inductance(servo, r, x) for r, x in zip(servo["records"], runs)]
    records = [
        {
            "kind": r["kind"],
            "closed_loop": r["closed_loop"],
            "duration_s": round(r["t"].size / sensor["sample_rate_hz"], 3),
            "travel_deg": [float((x.true.min() - theta_0) / DEG), float((x.true.max() - theta_0) / DEG)],
            "heldout_floor_rad": sensor["noise_sigma_eff_rad"],
        }
        for r, x in zip(servo["records"], runs)
    ]
    return {
        "labels": [e["label"] for e in effects],
        "kind": kind,
        "true_parameters": servo["params"],
        "effects": effects,
        "effect_size_sigma": pooled(servo, per_record),
        "effect_size_per_record": [round(x, 3) for x in per_record],
        "visibility_after_refit_sigma": visible,
        "visibility_per_record": [x if x is None else round(x, 3) for x in left],
        "baseline_inductance_size_sigma": pooled(servo, inductance),
        **sensor,
        "umax_V": servo["controller"]["UMAX"],
        "controller": servo["controller"],
        "records": records,
        "seed": seed,
        "case": case,
    }


def run_without_inductance(servo, record, result):
    """[sigma] rms that the ordinary inductance moves the effect-free servo by, on the same voltage."""
    step = 5e-5
    with_l = simulate(servo["params"], [], record["t"], result.u, step=step).true
    without = simulate(servo["params"] | {"L": 1e-4}, [], record["t"], result.u, step=step).true
    return float(np.sqrt(np.mean((with_l - without) ** 2)) / servo["sensor"]["noise_sigma_eff_rad"])


def write_datasheet(path, rate):
    """Table 1 and the sample rate."""
    lines = [
        "[parameters]",
        *(f"{name} = {value}" for name, value in TABLE_1.items()),
        "",
        "[recording]",
        f"sample_rate_hz = {rate}",
        "",
    ]
    path.write_text("\n".join(lines))


def write_record(path, record, result, sensor, rng):
    """Columns t_s, u_V, theta_rad, then i_A and theta_ref_rad where there are any."""
    columns = {
        "t_s": (record["t"], "%.4f" if sensor["sample_rate_hz"] > 1000 else "%.3f"),
        "u_V": (result.u, "%.4f"),
        "theta_rad": (result.theta, "%.7f"),
    }
    if sensor["has_current"]:
        columns["i_A"] = (result.i_A + sensor["current_sigma_A"] * rng.standard_normal(result.i_A.size), "%.4f")
    if record["closed_loop"]:
        columns["theta_ref_rad"] = (record["ref"], "%.5f")
    np.savetxt(
        path,
        np.stack([values for values, _ in columns.values()], 1),
        delimiter=",",
        header=",".join(columns),
        comments="",
        fmt=[form for _, form in columns.values()],
    )


# ---- command line
# -----------------------------------------------------------------------------------------------------


def effect_names(text):
    """Names from `all`, `first` or a list with commas."""
    names = {"all": LISTED, "first": FIRST}.get(text, tuple(text.split(",")))
    unknown = [name for name in names if name not in CATALOGUE]
    if unknown:
        raise argparse.ArgumentTypeError(f"no effect {', '.join(unknown)}; there are {', '.join(CATALOGUE)}")
    return names


def kind_names(text):
    """Kinds from a list with commas."""
    kinds = tuple(text.split(","))
    if set(kinds) - set(KINDS):
        raise argparse.ArgumentTypeError(f"kinds are {', '.join(KINDS)}, given {text}")
    return kinds


def read_options(arguments):
    """The command line."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--out", required=True, help="folder to write")
    parser.add_argument("--seed", type=int, default=0)
    parser.add_argument("--cases", type=int, default=28)
    parser.add_argument("--effects", type=effect_names, default=LISTED, help="name,name,... or all or first")
    parser.add_argument(
        "--kind", type=kind_names, default=("single",), help="of single,none,pair,outside; repeats weigh"
    )
    parser.add_argument("--sigma-min", type=float, default=3.0)
    parser.add_argument("--sigma-max", type=float, default=200.0)
    parser.add_argument("--coloured", type=float, default=0.0, help="share of the cases with coloured noise")
    parser.add_argument(
        "--no-refit", dest="refit", action="store_false", help="leave visibility_after_refit_sigma null (faster)"
    )
    parser.add_argument("--jobs", type=int, default=multiprocessing.cpu_count())
    return parser.parse_args(arguments)


def main(arguments=None):
    """Write the cases and list them."""
    options = read_options(arguments)
    (Path(options.out) / "truth").mkdir(parents=True, exist_ok=True)
    simulate(TABLE_1, [], np.arange(10) / 1000.0, np.zeros(10))
    children = np.random.SeedSequence(options.seed).spawn(options.cases)
    jobs = list(zip(range(options.cases), children, plan(options), [options] * options.cases))
    with multiprocessing.Pool(options.jobs) as pool:
        for line in pool.imap(make_case, jobs):
            print(line, flush=True)


if __name__ == "__main__":
    sys.exit(main())
