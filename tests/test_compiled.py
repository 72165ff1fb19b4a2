"""What is compiled is compiled once, by another process, which says so."""

import os
import subprocess
import sys
from pathlib import Path

ROOT = Path(__file__).resolve().parent.parent


def imported(home, **more):
    """What importing the plants prints on stderr, with kept code in ``home`` and nothing compiled in earnest."""
    environment = {**os.environ, "XDG_CACHE_HOME": str(home), "NUMBA_DISABLE_JIT": "1", "PYTHONPATH": str(ROOT), **more}
    done = subprocess.run(
        [sys.executable, "-c", "import ers_mj.plants.events"],
        env=environment,
        cwd=home,
        capture_output=True,
        text=True,
    )
    assert done.returncode == 0, done.stderr
    return done.stderr


def test_the_first_import_compiles_and_says_so_and_the_second_does_not(tmp_path):
    assert "compiling" in imported(tmp_path)
    assert len(list(tmp_path.glob("ers_mj/*/done-*"))) == 1
    assert imported(tmp_path) == ""


def test_a_process_that_compiles_starts_no_other(tmp_path):
    assert imported(tmp_path, ERS_MJ_COMPILING="1") == ""
    assert not list(tmp_path.glob("ers_mj/*/done-*"))
