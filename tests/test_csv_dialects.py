"""Text in columns as people have it: titles, comments, units, separators of all kinds, packed, with dates."""

import datetime
import gzip

import numpy as np
import pytest

from ers_mj.data.recording import read_recording
from ers_mj.errors import InputError

N = 200
T = (0.01 * np.arange(N)).round(4)
U = np.sin(3 * T).round(6)
THETA = (0.4 * np.sin(2 * T) + 1e-4 * np.random.default_rng(0).normal(size=N)).round(6)
NAMES = ("t_s", "u_V", "theta_rad")


def text(sep=",", header=NAMES, top="", below="", end="", cell=repr, start=""):
    rows = [start + sep.join(cell(x) for x in row) + end for row in zip(T.tolist(), U.tolist(), THETA.tolist())]
    return top + start + sep.join(header) + "\n" + below + "\n".join(rows) + "\n"


DIALECTS = {
    "comments on top": (text(top="# logger 1.2\n# date 2024, morning\n"), "the first 2 lines"),
    "a title": (text(top="Bench 3\n\nrun of today\n"), "comments or titles"),
    "a title with commas": (text(top="# Bench, 3, x\n"), "the first 1 line,"),
    "titles of two cells": (text(top="Bench,3\nDate,12.03.2024 14:02\n\n"), "the first 3 lines"),
    "titles that a spreadsheet filled up": (text(top="Bench,3,\nDate,12.03.2024,\n"), "the first 2 lines"),
    "titles above a row of units": (text(top="Bench,3,\n,,\n", below="s,V,rad\n"), "gives units"),
    "a header behind a sign": (text().replace("t_s", "# t_s", 1), None),
    "comments between": (text().replace("\n0.5,", "\n# a mark\n0.5,"), "begin with #"),
    "a row of units": (text(below="s,V,rad\n"), "gives units: s,V,rad"),
    "units in brackets": (text(below="[s],[V],[rad]\n"), "gives units"),
    "rows that end in a comma": (text(end=","), "no column"),
    "header and rows that end so": (text(end=",").replace("theta_rad\n", "theta_rad,\n", 1), None),
    "only the header ends so": (text().replace("theta_rad\n", "theta_rad,\n", 1), None),
    "semicolons and decimal commas": (text(";", cell=lambda x: repr(x).replace(".", ",")), None),
    "tabs": (text("\t"), None),
    "bars": (text("|"), None),
    "a table of bars": (text(" | ", start="| ", end=" |").replace("theta_rad\n", "theta_rad |\n", 1), None),
    "spaces": (text("  ", start=" "), "between spaces"),
    "spaces below comments": (text(" ", top="# file\n"), "between spaces"),
    "Windows": (text(top="# logger\n", below="s,V,rad\n").replace("\n", "\r\n"), "units"),
    "old Macs": (text().replace("\n", "\r"), None),
}


@pytest.mark.parametrize(("content", "told"), DIALECTS.values(), ids=DIALECTS)
def test_a_dialect_is_read_and_what_was_skipped_is_said(tmp_path, content, told):
    (tmp_path / "rec.csv").write_bytes(content.encode())
    record = read_recording(tmp_path / "rec.csv")
    np.testing.assert_array_equal(record.t, T)
    np.testing.assert_array_equal(record.u, U)
    np.testing.assert_array_equal(record.y, THETA)
    assert told is None or any(told in problem for problem in record.problems)


@pytest.mark.parametrize("suffix", [".tsv", ".txt", ".dat"])
def test_other_endings_of_text(tmp_path, suffix):
    (tmp_path / f"rec{suffix}").write_text(text("\t"))
    np.testing.assert_array_equal(read_recording(tmp_path / f"rec{suffix}").y, THETA)


def test_packed_text(tmp_path):
    (tmp_path / "rec.csv.gz").write_bytes(gzip.compress(text().encode()))
    np.testing.assert_array_equal(read_recording(tmp_path / "rec.csv.gz").y, THETA)
    (tmp_path / "rec.csv.gz").write_bytes(gzip.compress(text().encode())[:200])
    with pytest.raises(InputError, match="no whole gzip file"):
        read_recording(tmp_path / "rec.csv.gz")


def test_a_units_row_that_denies_its_header_is_refused(tmp_path):
    (tmp_path / "rec.csv").write_text(text(below="ms,V,rad\n"))
    with pytest.raises(InputError, match=r"t_s is in ms by its file .* --map .t_s=t_s \[ms\]"):
        read_recording(tmp_path / "rec.csv")
    record = read_recording(tmp_path / "rec.csv", {"t_s": "t_s [ms]"})
    np.testing.assert_allclose(record.t, T * 1e-3)


def test_the_units_row_serves_mapped_columns(tmp_path):
    (tmp_path / "rec.csv").write_text(text(header=("clock", "volts", "angle"), below="s,V,deg\n"))
    record = read_recording(tmp_path / "rec.csv", {"t_s": "clock", "u_V": "volts", "theta_rad": "angle"})
    np.testing.assert_allclose(record.y, np.radians(THETA))


@pytest.mark.parametrize("form", ["%Y-%m-%dT%H:%M:%S.%fZ", "%Y-%m-%d %H:%M:%S.%f", "%H:%M:%S.%f"])
def test_dates_count_from_the_first(tmp_path, form):
    first = datetime.datetime(2024, 5, 1, 12, 0, 0, 250000)
    stamps = [(first + datetime.timedelta(seconds=float(t))).strftime(form) for t in T]
    rows = [f"{stamp},{u!r},{y!r}" for stamp, u, y in zip(stamps, U.tolist(), THETA.tolist())]
    (tmp_path / "rec.csv").write_text("\n".join(["stamp,u_V,theta_rad", *rows]) + "\n")
    record = read_recording(tmp_path / "rec.csv", {"t_s": "stamp"})
    np.testing.assert_allclose(record.t, T, atol=1e-9)
