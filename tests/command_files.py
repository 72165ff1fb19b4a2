"""Good and bad files to call commands with, and a diagnosis that answers at once."""

import sys
from pathlib import Path
from types import SimpleNamespace

import numpy as np

from ers_mj import diagnosis as diagnosis_room
from ers_mj.diagnosis.evidence import Evidence
from ers_mj.servo.datasheet import Datasheet

N = 200
T = np.arange(N) * 1e-2


def csv(columns: dict) -> str:
    rows = zip(*[map(str, column) for column in columns.values()], strict=True)
    return "\n".join([",".join(columns), *map(",".join, rows)]) + "\n"


def columns(phase: float = 0.0) -> dict:
    return {"t_s": T, "u_V": 4 * np.sin(3 * T), "theta_rad": 0.26 + 0.1 * np.sin(3 * T + phase)}


def with_cell(column: str, row: int, text: str) -> dict:
    cells = [str(x) for x in columns()[column]]
    cells[row] = text
    return columns() | {column: cells}


GOOD = csv(columns())
SHEET = "[parameters]\nJ = 0.0031\nR = 1.55\nK_t = 0.0175\n"
FILES = {
    "good.csv": GOOD,
    "second.csv": csv(columns(0.3)),
    "copy.csv": GOOD,
    "good.toml": SHEET,
    "folder/x.txt": "kept",
    "empty.csv": "",
    "blank.csv": "\n\n",
    "header.csv": "t_s,u_V,theta_rad\n",
    "short.csv": "\n".join(GOOD.split("\n")[:50]),
    "text.csv": csv(with_cell("theta_rad", 7, "hello")),
    "text_time.csv": csv(with_cell("t_s", 7, "noon")),
    "infinite.csv": csv(with_cell("u_V", 7, "inf")),
    "repeats.csv": csv(with_cell("t_s", 7, "0.06")),
    "backwards.csv": csv(with_cell("t_s", 7, "0.01")),
    "ragged.csv": GOOD + "1,2\n",
    "binary.csv": "\0\1\2,\n\0",
    "constant.csv": csv(columns() | {"theta_rad": np.ones(N)}),
    "hole_time.csv": csv(with_cell("t_s", 9, "")),
    "mostly_nan.csv": csv(columns() | {"theta_rad": ["nan" if k % 2 else k for k in range(N)]}),
    "no_output.csv": csv({k: v for k, v in columns().items() if k != "theta_rad"}),
    "no_input.csv": csv({k: v for k, v in columns().items() if k != "u_V"}),
    "no_time.csv": csv({k: v for k, v in columns().items() if k != "t_s"}),
    "turns.csv": GOOD.replace("theta_rad", "theta_turns"),
    "amps.csv": GOOD.replace("u_V", "u_A"),
    "metres.csv": GOOD.replace("theta_rad", "x_m"),
    "duty.csv": GOOD.replace("u_V", "u_duty_pct"),
    "twice.csv": GOOD.replace("theta_rad", "u_V"),
    "two_outputs.csv": csv(columns() | {"theta_deg": np.degrees(columns()["theta_rad"])}),
    "notes.odt": GOOD,
    "fake.parquet": GOOD,
    "bad.toml": "[parameters",
    "unknown.toml": "[parameters]\nJJ = 1\n",
    "negative.toml": "[parameters]\nJ = -1\n",
    "nan.toml": "[parameters]\nJ = nan\n",
    "word.toml": '[parameters]\nJ = "big"\n',
    "section.toml": "[servo]\nJ = 1\n",
    "both.toml": SHEET + "[lumped]\nb = 1\n",
    "nothing.toml": "",
    "lumped.toml": "[lumped]\nb = 80\na_2 = 50\nc_2 = 100\n",
    "no_b.toml": "[parameters]\nk_s = 1\n",
    "strange.toml": SHEET + '[[effect]]\nname = "magic"\n',
    "volts.csv": csv({"t_s": T, "u_V": 8 * np.sin(3 * T)}),
    "volts_text.csv": csv({"t_s": T, "u_V": ["x"] * N}),
    "volts_hole.csv": csv({"t_s": T, "u_V": [""] + [1] * (N - 1)}),
    "volts_back.csv": csv({"t_s": T[::-1], "u_V": T}),
    "volts_one.csv": "t_s,u_V\n0,1\n",
    "exists.csv": "kept",
}


def lay_out(folder: Path) -> Path:
    """The folder, now full of good and bad files."""
    for name, text in FILES.items():
        path = folder / name
        path.parent.mkdir(exist_ok=True)
        path.write_text(text)
    return folder


def contents(folder) -> dict:
    return {str(path.relative_to(folder)): path.read_bytes() if path.is_file() else None for path in folder.rglob("*")}


def stub(monkeypatch, **changes) -> list:
    """Put a diagnosis in the place of the real one; its calls."""
    calls = []

    def diagnose(recordings, datasheet, holdout, *, seed, jobs, progress, search):
        calls.append(SimpleNamespace(recordings=recordings, datasheet=datasheet, holdout=holdout, seed=seed, jobs=jobs))
        progress("fitting", 0.5)
        if "raises" in changes:
            raise changes["raises"]
        document = {
            "version": 1,
            "verdict": "parameters_only",
            "sentence": "Only the parameters were off.",
            "missing": [],
            "where": [],
            "parameters": {"b": {"value": 91.0, "unit": "rad/s^2/V", "ci95": [90.0, 92.0], "datasheet": 81.0}},
            "fit": {"heldout_rmse_before_rad": np.float64(0.1), "heldout_rmse_after_rad": float("nan")},
            "seed": seed,
            "left_out": [{"part": part, "sentence": sentence} for part, sentence in search.left_out()],
            "data": {
                "output_unit": "rad",
                "input_unit": "V",
                "files": [r.name for r in recordings],
                "sha256": [],
                "problems": [],
            },
        }
        return SimpleNamespace(
            document=document,
            evidence=Evidence((), (), None, 1e-3, "rad", "V"),
            plant=SimpleNamespace(xml=lambda: "<mujoco/>"),
            model=changes.get("model", Datasheet(lumped={"b": 1.0})),
        )

    stub = SimpleNamespace(diagnose=diagnose)
    monkeypatch.setitem(sys.modules, "ers_mj.diagnosis.pipeline", stub)
    monkeypatch.setattr(diagnosis_room, "pipeline", stub, raising=False)  # where it has been imported already
    return calls
