"""The example of docs/extending.md, taken at its word: one file, and every part of the package knows it."""

import os
import re
import shutil
import subprocess
import sys
from pathlib import Path

import pytest

ROOT = Path(__file__).resolve().parents[1]

FOUND = """
import numpy as np
from test_diagnosis import recordings
from ers_mj.servo.datasheet import read_datasheet
from ers_mj.diagnosis.pipeline import diagnose
from ers_mj.selection.budget import QUICK
found = recordings([("eddy_brake", np.array([30.0, 2.0]))])
document = diagnose(found, read_datasheet("table1"), search=QUICK).document
print(document["missing"][0]["effect"], document["missing"][0]["parameters"]["w_0"]["value"])
"""


@pytest.fixture(scope="module")
def copy(tmp_path_factory):
    """A copy of the package with that effect in it, and the environment that runs it."""
    folder = tmp_path_factory.mktemp("template")
    for part in ("ers_mj", "mjcf"):
        shutil.copytree(ROOT / part, folder / part, ignore=shutil.ignore_patterns("__pycache__"))
    code = re.search(r"```python\n(.*?)```", (ROOT / "docs" / "extending.md").read_text(), re.S).group(1)
    (folder / "ers_mj" / "effects" / "eddy_brake.py").write_text(code)
    return folder, {
        **os.environ,
        "PYTEST_ADDOPTS": "-n 0 --no-cov",  # one process, whatever runs this one
        "PYTHONPATH": os.pathsep.join([str(folder), str(ROOT / "tests")]),
        "OPENBLAS_NUM_THREADS": "1",
    }


def run(copy, *arguments):
    folder, environment = copy
    return subprocess.run([sys.executable, *arguments], cwd=folder, env=environment, capture_output=True, text=True)


def test_the_tests_that_every_effect_owes_find_it(copy):
    files = [str(ROOT / "tests" / name) for name in ("test_effects.py", "test_twins.py")]
    done = run(copy, "-m", "pytest", "-q", "-k", "eddy_brake", "-p", "no:cacheprovider", *files)
    assert done.returncode == 0 and done.stdout.startswith("....."), done.stdout[-2000:] + done.stderr[-2000:]


def test_it_is_diagnosed(copy):
    done = run(copy, "-c", FOUND)
    name, speed = done.stdout.split()
    assert name == "eddy_brake" and float(speed) == pytest.approx(2.0, rel=0.2), done.stderr[-2000:]
