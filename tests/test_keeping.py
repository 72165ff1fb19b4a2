"""Results survive: where they go is checked before the work, written whole, and kept elsewhere where that fails."""

import errno
import json
import os
import stat
import tempfile
from pathlib import Path

import numpy as np
import pytest

from ers_mj import cli
from ers_mj.door.results import Result
from ers_mj.processes.passing import part_name
from ers_mj.report import inspect_report

T = np.arange(300) * 0.01
ROWS = "\n".join(f"{t:.2f},{4 * np.sin(3 * t):.4f},{0.1 * np.sin(3 * t - 0.4):.6f}" for t in T)


@pytest.fixture
def here(tmp_path, monkeypatch):
    """A folder with a recording, and a temporary folder beside it that is the system's."""
    (tmp_path / "work").mkdir(), (tmp_path / "tmp").mkdir()
    (tmp_path / "work/rec.csv").write_text(f"t_s,u_V,theta_rad\n{ROWS}\n")
    monkeypatch.chdir(tmp_path / "work")
    monkeypatch.setattr(tempfile, "tempdir", str(tmp_path / "tmp"))
    monkeypatch.setattr(inspect_report, "inspect_page", lambda document, _: f"<p>{document['input_kind']}</p>")
    return tmp_path / "work"


def inspected(*options: str) -> int:
    return cli.main(["inspect", "rec.csv", *options])


def names(folder: Path) -> set[str]:
    return {path.name for path in folder.iterdir()}


BOTH = {"inspect.json", "report.html"}


def test_results_go_through_a_link_to_another_file_system(here, capsys):
    shm = Path("/dev/shm")
    other = Path(tempfile.mkdtemp(dir=shm if os.access(shm, os.W_OK) else here.parent))
    try:
        (here / "link").symlink_to(other / "results")
        assert inspected("--out", "link") == 0 and names(other / "results") == BOTH
        assert inspected("--out", "link", "--force") == 0
        assert "in the place of what was there" in capsys.readouterr().out
        assert inspected("--out", str(other / "deep/er")) == 0 and names(other) == {"results", "deep"}
    finally:
        os.system(f"rm -r {other}")


@pytest.mark.skipif(not hasattr(os, "getuid") or os.getuid() == 0, reason="nothing is read-only to root")
def test_a_folder_in_a_read_only_parent(here):
    (here / "locked/open").mkdir(parents=True)
    (here / "locked").chmod(0o500)
    try:
        assert inspected("--out", "locked/open") == 0 and names(here / "locked/open") == BOTH
        assert inspected("--out", "locked/new") == 2
    finally:
        (here / "locked").chmod(0o700)


@pytest.mark.parametrize(
    ("out", "words"),
    [
        ("x" * 300, "name too long"),
        ("deep/" + "x" * 300, "name too long"),
        ("rec.csv", "is a file"),
        ("rec.csv/in", "is a file"),
        ("loop", "cannot be written"),
        ("a\0b", "null"),
    ],
)
def test_a_place_that_is_none_is_refused_before_the_work(out, words, here, monkeypatch, capsys):
    (here / "loop").symlink_to("loop")
    before = names(here)
    monkeypatch.setattr("ers_mj.commands.inspect.reader", lambda _: pytest.fail("it has begun"))
    assert inspected("--out", out) == 2
    told = capsys.readouterr().err
    assert words in told.lower() and told.count("\n") == 1 and names(here) == before


def test_a_full_disk_is_told_before_the_work(here, monkeypatch, capsys):
    def full(*_):
        raise OSError(errno.ENOSPC, os.strerror(errno.ENOSPC))

    monkeypatch.setattr(os, "posix_fallocate", full)
    assert inspected("--out", "res") == 2
    told = capsys.readouterr().err
    assert "No space left" in told and tempfile.gettempdir() in told and names(here) == {"rec.csv"}


def fill_disk_of(folder: Path, monkeypatch) -> None:
    """Let every file in a folder fail to be written, as a disk that has become full."""
    write = Path.write_text

    def write_text(path, *content, **how):
        if folder in path.parents:
            raise OSError(errno.ENOSPC, os.strerror(errno.ENOSPC))
        return write(path, *content, **how)

    monkeypatch.setattr(Path, "write_text", write_text)


@pytest.mark.parametrize("as_json", [False, True])
def test_results_are_kept_elsewhere_where_the_disk_fills_meanwhile(as_json, here, monkeypatch, capsys):
    fill_disk_of(here, monkeypatch)
    assert inspected("--out", "res", *(["--json"] if as_json else [])) == 2
    told = capsys.readouterr()
    (rescued,) = Path(tempfile.gettempdir()).glob("ers-out-*")
    assert names(rescued) == BOTH and str(rescued) in told.err and "No space left" in told.err
    assert names(here) == {"rec.csv"}
    assert json.loads(told.out)["input_kind"] == "voltage" if as_json else str(rescued / "report.html") in told.out


def test_the_answer_is_printed_where_nothing_can_be_written(here, monkeypatch, capsys):
    fill_disk_of(here.parent, monkeypatch)
    monkeypatch.setenv("HOME", str(here))
    assert inspected("--json", "--out", "res") == 2
    told = capsys.readouterr()
    assert json.loads(told.out)["input_kind"] == "voltage" and "no file was written" in told.err
    assert names(here) == {"rec.csv"} and not names(here.parent / "tmp")


def test_a_folder_in_the_place_of_a_file_leaves_the_others_as_they_were(here, capsys):
    (here / "res/report.html").mkdir(parents=True)
    assert inspected("--out", "res", "--force") == 2
    assert names(here / "res") == {"report.html"} and "is a folder" in capsys.readouterr().err


def test_in_the_default_folder_only_what_ers_wrote_is_replaced(here, capsys):
    assert inspected() == 0 and "in the place" not in capsys.readouterr().out
    (here / "ers-out/notes.txt").write_text("mine")
    assert inspected() == 0 and "written, in the place of what was there" in capsys.readouterr().out
    (here / "ers-out/report.html").write_text("mine")
    assert inspected() == 2
    told = capsys.readouterr().err
    assert "ers-out/report.html" in told and "was not written by ers" in told
    assert (here / "ers-out/report.html").read_text() == "mine"
    assert inspected("--force") == 0 and (here / "ers-out/notes.txt").read_text() == "mine"
    assert inspected() == 0


def test_parts_of_a_run_that_was_killed_are_swept(here):
    dead = part_name().replace(str(os.getpid()), str(2**22 + 1))
    for name in (dead, part_name(), ".mine.part"):
        (here / "res" / name).mkdir(parents=True)
    assert inspected("--out", "res", "--force") == 0
    assert dead not in names(here / "res") and len(names(here / "res")) == 4


SIMULATE = ["simulate", "--input", "steps", "--duration", "0.2", "--out"]


def test_a_table_is_kept_elsewhere_too(here, monkeypatch, capsys):
    write = Path.write_bytes

    def write_bytes(path, content):
        if here in path.parents:
            raise OSError(errno.ENOSPC, os.strerror(errno.ENOSPC))
        return write(path, content)

    monkeypatch.setattr(Path, "write_bytes", write_bytes)
    assert cli.main([*SIMULATE, "new.csv", "--json"]) == 2
    told = capsys.readouterr()
    assert Path(json.loads(told.out)["out"]).read_text().startswith("t_s,") and names(here) == {"rec.csv"}


def test_a_table_takes_the_place_of_ordinary_files_only(here, capsys):
    os.mkfifo(here / "pipe")
    (here / "link.csv").symlink_to("linked.csv")
    assert cli.main([*SIMULATE, "pipe", "--force"]) == 2 and "no ordinary file" in capsys.readouterr().err
    assert stat.S_ISFIFO((here / "pipe").stat().st_mode)
    assert cli.main([*SIMULATE, "link.csv", "--force"]) == 0
    assert (here / "link.csv").is_symlink() and (here / "linked.csv").read_text().startswith("t_s,")
    assert cli.main([*SIMULATE, "n" * 251 + ".csv"]) == 0  # as long as a name may be


def test_a_name_that_is_no_text_reaches_the_results(here):
    odd = os.fsdecode(b"\xff<b>.csv")
    os.rename(here / "rec.csv", odd)
    assert cli.main(["inspect", odd, "--out", "res"]) == 0
    assert '"?<b>.csv"' in (here / "res/inspect.json").read_text("utf-8")


def test_a_result_is_saved_by_the_same_rules(here):
    class Small(Result):
        def _writers(self):
            return {"a.txt": lambda path: path.write_text("a")}

    assert Small({}).save(here / "new") == [here / "new/a.txt"] and names(here / "new") == {"a.txt"}


def test_what_a_command_writes_is_what_it_checks(here, monkeypatch):
    from ers_mj.commands import diagnose
    from ers_mj.report.diagnosis_report import NEXT_INPUT

    assert NEXT_INPUT in diagnose.RESULTS
