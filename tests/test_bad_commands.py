"""The command line, given anything: an answer or one sentence, no traceback, and no file that was not asked for."""

import os

import bad_commands
import pytest
from hypothesis import given, settings
from test_bad_inputs import MILD

from ers_mj import cli


@pytest.fixture
def here(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    for name in ("DISPLAY", "WAYLAND_DISPLAY"):
        monkeypatch.delenv(name, raising=False)
    bad_commands.lay_out(tmp_path)
    return tmp_path


@pytest.mark.filterwarnings("default")
def test_an_odd_command_line_ends_in_an_answer_or_a_sentence(here, capsys):
    @settings(MILD, max_examples=40)
    @given(bad_commands.lines(bad_commands.UNUSABLE))
    def ends(argv):
        before = {str(path) for path in here.rglob("*")}
        try:
            code = cli.main(argv)
        except SystemExit as left:  # --help, --version
            code = left.code or 0
        told = capsys.readouterr()
        assert code in (0, 1, 2)
        if code == 2:
            assert told.err.startswith("ers: ") and told.err.count("\n") == 1
            assert told.err[:-1].isprintable()
        left = {str(path) for path in here.rglob("*")} - before
        assert not [name for name in left if code or name.endswith(".part")]
        for name in left:
            os.system(f"rm -rf '{name}'")

    ends()


LONG = "x" * 400


@pytest.mark.parametrize(
    "argv",
    [
        ["inspect", f"{LONG}.csv#run=1", "--json"],
        ["simulate", LONG, "--input", "steps", "--out", "s.csv"],
        ["simulate", "--input", LONG, "--out", "s.csv"],
        ["trial", "--case", f"{LONG}.csv", "--json"],
        ["compare", LONG, LONG],
        ["watch", LONG],
        ["batch", LONG],
        ["batch", "servos.csv"],
        ["prove", "--real", LONG, "--cases", "1", "--json"],
        ["inspect", "rec.csv", "--map-file", LONG, "--json"],
        ["inspect", "/dev/zero", "--json"],
    ],
    ids=lambda argv: " ".join(argv)[:20],
)
def test_a_place_that_cannot_be_is_a_short_sentence(argv, tmp_path, monkeypatch, capsys):
    """Names that no file system takes, and what never ends."""
    monkeypatch.chdir(tmp_path)
    bad_commands.lay_out(tmp_path)
    (tmp_path / "servos.csv").write_text(f'name,recordings\na,"{"[a-z]" * 2000}"\n')
    assert cli.main(argv) == 2
    told = capsys.readouterr().err
    assert told.startswith("ers: ") and told.count("\n") == 1 and len(told) <= 300 + len("ers: \n")
