"""MAT files v5 whose elements are not where they can be: a sentence, where scipy would end the process."""

import io
import struct

import numpy as np
import pytest
from scipy.io import savemat

from ers_mj.data.recording import read_recording
from ers_mj.errors import InputError

T = 0.01 * np.arange(150)
COLUMNS = {"t_s": T, "u_V": np.sin(T), "theta_rad": np.cos(3 * T)}


def saved(columns, **options) -> bytearray:
    sink = io.BytesIO()
    savemat(sink, columns, **options)
    return bytearray(sink.getvalue())


def damaged(at: int, value: int) -> bytes:
    """The first array's elements begin at byte 136: flags, 152 dimensions, 168 name, 176 numbers."""
    content = saved(COLUMNS)
    content[at : at + 4] = struct.pack("<I", value)
    return bytes(content)


DAMAGED = {
    "numbers of a kind that there is not": damaged(176, 41737),
    "numbers that are an array": damaged(176, 14),
    "numbers that are compressed": damaged(176, 15),
    "an imaginary part that is not there": damaged(144, 6 | 1 << 11),
    "numbers that are sparse": damaged(144, 5),
    "an element beyond the end": damaged(132, 1 << 30),
    "an array that is text": damaged(128, 1),
}


@pytest.mark.parametrize("content", DAMAGED.values(), ids=DAMAGED)
def test_an_element_that_cannot_be_there_is_one_sentence(tmp_path, content):
    (tmp_path / "rec.mat").write_bytes(content)
    with pytest.raises(InputError, match=r"rec\.mat: is damaged"):
        read_recording(tmp_path / "rec.mat")


@pytest.mark.parametrize("options", [{}, {"do_compression": True}, {"format": "4"}], ids=str)
def test_whole_files_are_read(tmp_path, options):
    (tmp_path / "rec.mat").write_bytes(saved(COLUMNS, **options))
    np.testing.assert_array_equal(read_recording(tmp_path / "rec.mat").y, COLUMNS["theta_rad"])


def test_arrays_of_all_classes_are_passed(tmp_path):
    others = {"note": "text", "cells": np.array([1, "a", [1, 2]], object), "empty": np.zeros((0, 3))}
    others |= {"logical": T > 1, "complex": T + 1j, "none": "", "counts": np.arange(3, dtype=np.int8)}
    columns = {"run": {**COLUMNS, "more": others}}
    (tmp_path / "rec.mat").write_bytes(saved(columns))
    record = read_recording(tmp_path / "rec.mat", {name: f"run.{name}" for name in COLUMNS})
    np.testing.assert_array_equal(record.y, COLUMNS["theta_rad"])
