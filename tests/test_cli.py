"""The program itself: its help, its cache, its progress and its JSON."""

import json
import subprocess
import sys

import numpy as np
import pytest

from ers_mj import cli
from ers_mj.commands import output
from ers_mj.door.saving import as_json


@pytest.mark.parametrize("command", ["", "cache", "demo", "diagnose", "simulate", "validate", "view"])
def test_help_has_an_example(command, capsys):
    with pytest.raises(SystemExit) as ended:
        cli.main([*command.split(), "--help"])
    assert ended.value.code == 0 and "example" in capsys.readouterr().out


def test_help_loads_nothing_heavy():
    code = (
        "import sys; from ers_mj import cli\ntry: cli.main(['--help'])\nexcept SystemExit: pass\n"
        "print([m for m in ('numpy', 'numba', 'pyarrow', 'matplotlib', 'scipy') if m in sys.modules], file=sys.stderr)"
    )
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True)
    assert done.stderr.strip() == "[]"


def test_the_cache_is_shown_and_cleared_of_what_is_ours(tmp_path, monkeypatch, capsys):
    monkeypatch.setenv("XDG_CACHE_HOME", str(tmp_path))
    assert cli.main(["cache", "--clear", "--json"]) == 0
    assert json.loads(capsys.readouterr().out)["files"] == 0 and list(tmp_path.iterdir()) == []
    code = tmp_path / "ers_mj" / "code"
    code.mkdir(parents=True, mode=0o700)
    (tmp_path / "ers_mj").chmod(0o700)
    stem = "ers_mj.plants.kernel.calm.rest-0123456789abcdef0123.py311"
    for name in (f"{stem}.nbi", f"{stem}.1.nbc", "notes.nbi", "thesis.txt"):
        (code / name).write_text("x" * 10)
    assert cli.main(["cache"]) == 0
    told = capsys.readouterr().out
    assert str(code) in told and "2 files" in told and "plants" in told and "2 files that are not ours" in told
    assert cli.main(["cache", "--clear"]) == 0
    assert {file.name for file in code.iterdir()} - {"lock"} == {"notes.nbi", "thesis.txt"}


def test_progress_is_silent_in_a_pipe(capsys):
    with output.Progress() as progress:
        progress("fitting", 0.3)
    assert capsys.readouterr() == ("", "")


def test_json_has_no_nan():
    assert json.loads(as_json({"a": np.array([1.0, np.nan]), "b": (np.int64(2), float("inf"))})) == {
        "a": [1.0, None],
        "b": [2, None],
    }
