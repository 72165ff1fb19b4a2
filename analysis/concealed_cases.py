"""Conceal effects in an independent servo and write the recordings, in the format of the shared development cases.

    python analysis/concealed_cases.py --out DIR --seed 1 --cases 28 --effects first --kind single

writes DIR/case-NNN/{datasheet.toml, rec1.csv, ...} and DIR/truth/case-NNN.json. Kinds and effects are taken in turn: case i has
kind number i modulo the kinds given (repeat a word to weigh it: `--kind single,single,none`), and the k-th single case has effect
number k modulo the effects. Every case draws from its own child of the seed, so a case does not depend on the others or on --jobs.
"""

import argparse
import json
import multiprocessing
import sys
from pathlib import Path

import numpy as np
from independent_effects import CATALOGUE, DEG, FIRST, LISTED, OUTSIDE
from independent_plant import CONTROLLER, TABLE_1, simulate

KINDS = ("single", "none", "pair", "outside")
CLOSED = ("chirp", "slow_triangle", "triangle", "square")
COARSE, FINE, ROUGH = 4e-5, 1e-5, 1e-4
"""[s] steps for sizing, for the recordings, and for what holds no stiff joint (error 2e-5, 1e-6, 1e-4 deg)."""
SCATTER = {"J": 0.12, "B": 0.15, "K_t": 0.08, "K_e": 0.08, "k_s": 0.1, "T_LH": 0.08, "F_c": 0.12, "R": 0.1, "L": 0.15}
"""Standard deviation of the logarithm of true over datasheet value, 8-15 %."""
TWO_MASS = {"backlash", "shaft_compliance"}
STIFF = TWO_MASS | {"presliding", "end_stop", "friction_ageing"}
"""What needs the finer of the two steps while sizing."""
ALIKE = ({"bias_torque", "asymmetric_friction"}, {"inductance", "input_delay", "sensor_lag"},
         {"voltage_saturation", "current_limit", "supply_sag"}, {"cogging", "transmission_ripple"}, TWO_MASS | {"variable_ratio"},
         {"sensor_quantisation", "sensor_dropout"})
"""Effects that a pair does not combine: counted as one, or two that the simulator cannot join."""


# ---- the servo, its sensor and its controller -------------------------------------------------------------------------


def draw_params(rng):
    """True parameters (SI) about Table 1; n exact, theta_0 off by a few tenths of a degree."""
    params = {name: float(TABLE_1[name] * np.exp(sd * np.clip(rng.standard_normal(), -2.0, 2.0))) for name, sd in SCATTER.items()}
    params["T_LH"] = max(params["T_LH"], 1.05 * params["F_c"])
    shares = {"motor_inertia_share": float(rng.uniform(0.45, 0.75)), "motor_damping_share": float(rng.uniform(0.3, 0.7))}
    return params | {"theta_0": TABLE_1["theta_0"] + float(rng.normal(0.0, 0.3)) * DEG, "n": TABLE_1["n"]} | shares


def draw_sensor(rng, coloured):
    """Noise and converter [rad], whether the current is measured, sample rate [Hz]."""
    bits = int(rng.choice([0, 0, 12, 13, 14]))
    step = 120.0 * DEG / 2**bits if bits else 0.0
    sigma = float(np.exp(rng.uniform(np.log(0.005), np.log(0.03)))) * DEG
    return {"noise_sigma_rad": sigma, "noise_sigma_eff_rad": float(np.hypot(sigma, step / np.sqrt(12.0))),
            "noise_colour_corner_hz": float(rng.uniform(20.0, 200.0)) if rng.random() < coloured else None,
            "adc_bits": bits, "adc_step_rad": step, "has_current": bool(rng.random() < 0.5),
            "current_sigma_A": float(rng.uniform(0.01, 0.05)),
            "sample_rate_hz": int(rng.choice([500, 1000, 2000], p=[0.15, 0.7, 0.15]))}


def draw_controller(rng, umax):
    """PID gains [V/rad ...] and the feed-forward of spring and preload, on in half of the cases."""
    gains = [rng.uniform(15.0, 30.0), rng.uniform(30.0, 60.0), rng.uniform(0.2, 0.5), rng.uniform(0.003, 0.009), umax,
             rng.integers(2), rng.uniform(0.7, 0.95) * TABLE_1["R"] / (TABLE_1["n"] * TABLE_1["K_t"]), TABLE_1["T_LH"],
             TABLE_1["k_s"], 15.0 * DEG]
    return {name: float(value) for name, value in zip(CONTROLLER, gains)}


def noise_of(rng, samples, sensor):
    """(samples,) white noise [rad], or first-order coloured of the same rms."""
    white = rng.standard_normal(samples)
    corner = sensor["noise_colour_corner_hz"]
    if corner is None:
        return sensor["noise_sigma_rad"] * white
    keep, out = np.exp(-2.0 * np.pi * corner / sensor["sample_rate_hz"]), np.empty(samples)
    out[0] = white[0]
    for k in range(1, samples):
        out[k] = keep * out[k - 1] + np.sqrt(1.0 - keep**2) * white[k]
    return sensor["noise_sigma_rad"] * out


# ---- excitations: a wave of about unit size over t ---------------------------------------------------------------------


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


def open_size(params, t, wave, umax, wanted):
    """[V] amplitude at which the effect-free servo travels `wanted` [rad], by bisection, at most umax."""
    low, high = 2.5, umax
    for _ in range(9):
        mid = 0.5 * (low + high)
        travel = np.ptp(simulate(params, [], t, mid * wave, step=1e-4).true)
        low, high = (mid, high) if travel < wanted else (low, mid)
    return 0.5 * (low + high)


def closed_size(params, t, wave, controller, wanted):
    """[rad] amplitude at which the effect-free loop travels at least half of `wanted` [rad], at most 25 deg: a loop without
    feed-forward breaks away late."""
    size = 0.5 * wanted
    while size < 25.0 * DEG:
        ref = TABLE_1["theta_0"] + size * wave
        if np.ptp(simulate(params, [], t, None, controller=controller, theta_ref=ref, step=ROUGH).true) > 0.5 * wanted:
            break
        size *= 1.4
    return size


def draw_record(rng, kind, params, controller, sensor):
    """One excitation: its voltage [V] where open loop, its reference [rad] where closed, and the noise."""
    rate = sensor["sample_rate_hz"]
    t = np.arange(int(round(rate * np.round(rng.uniform(5.5, 7.5), 1)))) / rate
    wave = WAVES[kind](rng, t)
    closed = kind in CLOSED or (kind == "staircase" and rng.random() < 0.5)
    wanted = np.exp(rng.uniform(np.log(8.0), np.log(40.0))) * DEG
    u = ref = None
    if closed:
        wave = rng.uniform(-0.2, 0.2) + wave
        ref = np.round(TABLE_1["theta_0"] + closed_size(params, t, wave, controller, wanted) * wave, 5)
    else:
        u = np.round(np.clip(open_size(params, t, wave, controller["UMAX"], wanted) * wave, -controller["UMAX"],
                             controller["UMAX"]), 4)
    return {"kind": kind, "closed_loop": closed, "t": t, "u": u, "ref": ref, "bare": {},
            "noise": noise_of(rng, t.size, sensor)}


def draw_kinds(rng):
    """Three to five excitations, one of them an open-loop multisine."""
    others = list(rng.permutation([k for k in WAVES if k != "multisine"]))[: rng.integers(2, 5)]
    return [str(k) for k in rng.permutation(["multisine", *others])]


# ---- running and sizing -----------------------------------------------------------------------------------------------


def run(servo, record, number, effects, step):
    """The recording with the effects: closed loops close around the noisy measured angle."""
    return simulate(servo["params"], effects, record["t"], record["u"], record=number, step=step, noise=record["noise"],
                    adc_step=servo["sensor"]["adc_step_rad"], controller=servo["controller"] if record["closed_loop"] else None,
                    theta_ref=record["ref"], decimals=4)


def bare(servo, record, u, step):
    """(samples,) noise-free angle [rad] of the effect-free servo under u; open loops know it already."""
    if record["closed_loop"]:
        return simulate(servo["params"], [], record["t"], u, step=step).clean
    if step not in record["bare"]:
        record["bare"][step] = simulate(servo["params"], [], record["t"], u, step=step).clean
    return record["bare"][step]


def sizes(servo, effects, step):
    """([rms of the difference with/without on the same u over sigma] a record, the runs with)."""
    out, runs = [], []
    for number, record in enumerate(servo["records"]):
        with_it = run(servo, record, number, effects, step)
        change = with_it.clean - bare(servo, record, with_it.u, step)
        out.append(float(np.sqrt(np.mean(change**2)) / servo["sensor"]["noise_sigma_eff_rad"]))
        runs.append(with_it)
    return out, runs


def step_for(effects):
    """[s] step that does for sizing these effects."""
    return COARSE if any(effect["label"] in STIFF for effect in effects) else ROUGH


def pooled(servo, per_record):
    """One size of the records' sizes, each record weighing as its length."""
    weights = [record["t"].size for record in servo["records"]]
    return float(np.sqrt(np.average(np.square(per_record), weights=weights)))


def tune(servo, effect, shape, target):
    """(strength, size) whose size comes closest to the target: false position on the logarithms, within plausible bounds."""
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
    """Secant through the last two where it stays well inside (low, high), else the middle; near-flat sizes get the middle."""
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
    return {"label": name, "strength_name": effect.strength_name, "strength": best[0], "shape": best[1], "target_sigma": target}


# ---- how much stays visible once the effect-free model is refitted -----------------------------------------------------

FREE = ("J", "B", "K_e", "k_s", "T_LH", "F_c", "theta_0")
"""What angle and voltage can tell of Eq. (1): R, K_t and the ordinary L are held."""


def refit(servo, runs, rounds=5):
    """[rms over sigma] a record that the effect-free Eq. (1) leaves: Levenberg-Marquardt on log parameters, noise-free angles."""
    sigma = servo["sensor"]["noise_sigma_eff_rad"]

    def moved(x):
        values = {name: float(servo["params"][name] * np.exp(v)) for name, v in zip(FREE[:-1], x)}
        return servo["params"] | values | {"theta_0": servo["params"]["theta_0"] + x[-1]}

    def residuals(x):
        return [(simulate(moved(x), [], r["t"], with_it.u, step=ROUGH).clean - with_it.clean) / sigma
                for r, with_it in zip(servo["records"], runs)]

    x, parts, damping = np.zeros(len(FREE)), residuals(np.zeros(len(FREE))), 1e-3
    for _ in range(rounds):
        flat = np.concatenate(parts)
        columns = [(np.concatenate(residuals(x + 1e-4 * e)) - flat) / 1e-4 for e in np.eye(len(FREE))]
        jac = np.stack(columns, 1)
        normal, slope = jac.T @ jac, jac.T @ flat
        for _ in range(4):
            trial = np.clip(x - np.linalg.solve(normal + damping * np.diag(np.diag(normal) + 1e-9), slope), -1.5, 1.5)
            trial_parts = residuals(trial)
            gain = np.sum(flat**2) - np.sum(np.concatenate(trial_parts) ** 2)
            damping *= 0.2 if gain > 0 else 8.0
            if gain > 0:
                x, parts = trial, trial_parts
                break
        if gain < 1e-3 * np.sum(flat**2):
            break
    return [float(np.sqrt(np.mean(part**2))) for part in parts]


# ---- one case ---------------------------------------------------------------------------------------------------------


def draw_servo(rng, options):
    """Servo, sensor, controller, records and what the effect-free records reach."""
    params, sensor = draw_params(rng), draw_sensor(rng, options.coloured)
    controller = draw_controller(rng, float(np.round(rng.uniform(10.0, 24.0), 1)))
    servo = {"params": params, "sensor": sensor, "controller": controller}
    servo["records"] = [draw_record(rng, kind, params, controller, sensor) for kind in draw_kinds(rng)]
    runs = [run(servo, record, k, [], COARSE) for k, record in enumerate(servo["records"])]
    angles = np.concatenate([r.true for r in runs]) - params["theta_0"]
    servo["context"] = {"params": params, "travel": (float(angles.min()), float(angles.max())), "records": len(runs),
                        "peak_V": float(max(np.abs(r.u).max() for r in runs)), "umax_V": controller["UMAX"],
                        "peak_A": float(max(np.abs(r.i_A).max() for r in runs)),
                        "durations": [float(r["t"][-1]) for r in servo["records"]]}
    return servo


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
    servo = draw_servo(rng, options)
    effects = [conceal(rng, servo, label, (options.sigma_min, options.sigma_max)) for label in names_of(rng, kind, name, options)]
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
    records = [{"kind": r["kind"], "closed_loop": r["closed_loop"], "duration_s": round(r["t"].size / sensor["sample_rate_hz"], 3),
                "travel_deg": [float((x.true.min() - theta_0) / DEG), float((x.true.max() - theta_0) / DEG)],
                "heldout_floor_rad": sensor["noise_sigma_eff_rad"]} for r, x in zip(servo["records"], runs)]
    return {"labels": [e["label"] for e in effects], "kind": kind, "true_parameters": servo["params"], "effects": effects,
            "effect_size_sigma": pooled(servo, per_record), "effect_size_per_record": [round(x, 3) for x in per_record],
            "visibility_after_refit_sigma": visible, "visibility_per_record": [x if x is None else round(x, 3) for x in left],
            "baseline_inductance_size_sigma": pooled(servo, inductance), **sensor, "umax_V": servo["controller"]["UMAX"],
            "controller": servo["controller"], "records": records, "seed": seed, "case": case}


def run_without_inductance(servo, record, result):
    """[sigma] rms that the ordinary inductance moves the effect-free servo by, on the same voltage."""
    step = 5e-5
    with_l = simulate(servo["params"], [], record["t"], result.u, step=step).true
    without = simulate(servo["params"] | {"L": 1e-4}, [], record["t"], result.u, step=step).true
    return float(np.sqrt(np.mean((with_l - without) ** 2)) / servo["sensor"]["noise_sigma_eff_rad"])


def write_datasheet(path, rate):
    """Table 1 and the sample rate."""
    lines = ["[parameters]", *(f"{name} = {value}" for name, value in TABLE_1.items()), "", "[recording]",
             f"sample_rate_hz = {rate}", ""]
    path.write_text("\n".join(lines))


def write_record(path, record, result, sensor, rng):
    """Columns t_s, u_V, theta_rad, then i_A and theta_ref_rad where there are any."""
    columns = {"t_s": (record["t"], "%.4f" if sensor["sample_rate_hz"] > 1000 else "%.3f"), "u_V": (result.u, "%.4f"),
               "theta_rad": (result.theta, "%.7f")}
    if sensor["has_current"]:
        columns["i_A"] = (result.i_A + sensor["current_sigma_A"] * rng.standard_normal(result.i_A.size), "%.4f")
    if record["closed_loop"]:
        columns["theta_ref_rad"] = (record["ref"], "%.5f")
    np.savetxt(path, np.stack([values for values, _ in columns.values()], 1), delimiter=",", header=",".join(columns),
               comments="", fmt=[form for _, form in columns.values()])


# ---- command line -----------------------------------------------------------------------------------------------------


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
    parser.add_argument("--kind", type=kind_names, default=("single",), help="of single,none,pair,outside; repeats weigh")
    parser.add_argument("--sigma-min", type=float, default=3.0)
    parser.add_argument("--sigma-max", type=float, default=200.0)
    parser.add_argument("--coloured", type=float, default=0.0, help="share of the cases with coloured noise")
    parser.add_argument("--no-refit", dest="refit", action="store_false", help="leave visibility_after_refit_sigma null (faster)")
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
