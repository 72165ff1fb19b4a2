"""What a terminal shows while the work goes on, what --quiet takes away, what a shell completes."""

import io
import json
import shutil
import subprocess
import sys

import pytest

from ers_mj import cli
from ers_mj.commands import COMMANDS, output

NAMES = [module.__name__.rpartition(".")[2] for module in COMMANDS]


class Terminal(io.StringIO):
    def isatty(self):
        return True


def test_the_bar_tells_what_has_passed_and_what_is_left(monkeypatch):
    now = iter((100.0, 100.5, 175.0, 4075.0))
    monkeypatch.setattr(output.time, "monotonic", lambda: next(now))
    monkeypatch.setattr(sys, "stderr", Terminal())
    monkeypatch.setenv("COLUMNS", "200")
    with output.Progress() as progress:
        for share in (0.01, 0.25, 0.5):
            progress("fitting", share)
        told = sys.stderr.getvalue().split("\r")
    assert "0:00  fitting" in told[1] and "left" not in told[1]
    assert "1:15, 3:45 left  fitting" in told[2] and "1:06:15, 1:06:15 left" in told[3]


def test_quiet_says_nothing_but_errors_and_json(tmp_path, monkeypatch, capsys):
    monkeypatch.chdir(tmp_path)
    assert cli.main(["cache", "--quiet"]) == 0 and capsys.readouterr() == ("", "")
    assert cli.main(["gains", "--json", "--quiet"]) == 0
    assert json.loads(capsys.readouterr().out)
    assert cli.main(["compare", "nowhere", "nowhere", "--quiet"]) == 2
    assert "nowhere: there is no such file" in capsys.readouterr().err
    assert cli.main(["cache"]) == 0 and capsys.readouterr().out


def test_a_bar_is_not_drawn_when_it_is_to_be_quiet(monkeypatch):
    monkeypatch.setattr(sys, "stderr", Terminal())
    with output.quietly(True, False), output.Progress() as progress:
        progress("fitting", 0.3)
        output.tell("a line")
    assert sys.stderr.getvalue() == ""


@pytest.mark.parametrize("command", ["simulate", "view", "trial", "export", "gains", "excite", "diagnose", "identify"])
def test_a_model_has_one_name_in_every_command(command):
    more = {"simulate": ["--input", "steps", "--out", "x"], "diagnose": ["r.csv"], "identify": ["r.csv"]}
    more["excite"] = ["--out", "x"]
    more["export"] = ["--to", "mujoco", "--out", "x"]
    parsed = cli.parse([command, *more.get(command, []), "--model", "m.toml"])
    assert "m.toml" in (getattr(parsed, "model", None), getattr(parsed, "datasheet", None))


# -- completion -------------------------------------------------------------------------------------------------------


def completed(script, *words):
    """What bash offers for the last word."""
    asked = " ".join(f"'{word}'" for word in words)
    tail = f"\nCOMP_WORDS=({asked}); COMP_CWORD={len(words) - 1}; _ers; echo ${{COMPREPLY[@]}}"
    return subprocess.run(["bash", "-c", script + tail], capture_output=True, text=True, check=True).stdout.split()


@pytest.mark.skipif(shutil.which("bash") is None, reason="bash is not installed")
def test_bash_completes_commands_options_and_values(capsys):
    assert cli.main(["completion", "bash"]) == 0
    script = capsys.readouterr().out
    assert set(NAMES) <= set(completed(script, "ers", ""))
    assert completed(script, "ers", "diagnose", "r.csv", "--da") == ["--datasheet"]
    assert completed(script, "ers", "view", "--linkage", "") == ["constant", "rod"]
    assert completed(script, "ers", "diagnose", "") == []  # files, by the shell


def test_every_shell_gets_every_command(capsys):
    for shell in ("zsh", "fish"):
        assert cli.main(["completion", shell]) == 0
        script = capsys.readouterr().out
        assert all(name in script for name in NAMES) and "datasheet" in script
    assert cli.main(["completion", "tcsh"]) == 2
