"""What is most likely wrong with a file of each kind: one clear sentence, exit code 2, nothing else.

The files are made by `files_made`; a fault changes the columns, the bytes, or what is said of them.
"""

from collections.abc import Callable
from typing import NamedTuple

import numpy as np
import pytest
from files_made import BY_NAME, COLUMNS, WRITERS, Made

from ers_mj import cli

ROWS = 150
FEW = {name: x[:ROWS] for name, x in COLUMNS.items()}
LONGEST = 300  # characters of a sentence


class Fault(NamedTuple):
    """Words that its sentence must hold, and what is wrong: with the columns, or with the file and what is said."""

    words: str
    columns: Callable[[dict], dict] = lambda columns: columns
    file: Callable[[Made], Made] = lambda made: made


def changed(column: str, rows, value) -> Callable[[dict], dict]:
    def change(columns: dict) -> dict:
        x = columns[column].copy()
        x[rows] = value
        return columns | {column: x}

    return change


def without(column: str) -> Callable[[dict], dict]:
    return lambda columns: {name: x for name, x in columns.items() if name != column}


def words_in_it(columns: dict) -> dict:
    return columns | {"u_V": np.array(["off" if k == 16 else f"{x:.5f}" for k, x in enumerate(columns["u_V"])])}


def said(**mapping: str) -> Callable[[Made], Made]:
    return lambda made: made._replace(mapping={**made.mapping, **mapping})


def in_unit(unit: str) -> Callable[[Made], Made]:
    return lambda made: said(theta_rad=f"{made.mapping.get('theta_rad', 'theta_rad')} [{unit}]")(made)


def bytes_of(change: Callable[[bytes], bytes]) -> Callable[[Made], Made]:
    def rewrite(made: Made) -> Made:
        (path,) = made.path.glob("*.mcap") if made.path.is_dir() else [made.path]
        path.write_bytes(change(path.read_bytes()))
        return made

    return rewrite


EVERYWHERE = {
    "the output never moves": Fault("is constant at 0.25", changed("theta_rad", slice(None), 0.25)),
    "it is short": Fault("has 50 samples, at least 100 are", lambda c: {name: x[:50] for name, x in c.items()}),
    "there is no input": Fault("there is no input", without("u_V")),
    "there is no output": Fault("there is no output", without("theta_rad")),
    "an input is infinite": Fault("is infinite in data row 10", changed("u_V", 9, np.inf)),
    "a quarter is missing": Fault(
        "lacks 25% of its values, at most 20%", changed("theta_rad", slice(0, None, 4), np.nan)
    ),
    "the output is counts": Fault(
        "moves in whole numbers from", lambda c: c | {"theta_rad": np.rint(650 * c["theta_rad"])}
    ),
    "the time is milliseconds": Fault("looks like milliseconds", lambda c: c | {"t_s": np.rint(1000 * c["t_s"])}),
    "the input is text": Fault("cannot be used, it holds no numbers", words_in_it),
    "a column is mistyped": Fault("asks for the column 'angel'", file=said(theta_rad="angel")),
    "a quantity is mistyped": Fault("--map gives 'theta_rd'", file=said(theta_rd="angle")),
    "a unit is of something else": Fault("measures something else", file=in_unit("V")),
    "a unit is unknown": Fault("is given in 'smoots', which is no unit", file=in_unit("smoots")),
    "it is empty": Fault("empty", file=bytes_of(lambda whole: b"")),
    "it is another kind of file": Fault("is no", file=bytes_of(lambda whole: b"Dear all,\nsee below\n" * 20)),
    "it is cut off": Fault("cut off", file=bytes_of(lambda whole: whole[: len(whole) // 3])),
}
BY_NAME_ONLY = {
    "the time runs backwards": Fault("runs backwards in data row 8 (0.06 s, then 0 s)", changed("t_s", 7, 0.0)),
    "the time repeats": Fault("repeats in data row 8", changed("t_s", 7, 0.06)),
    "there is no time": Fault("there is no time", without("t_s")),
}
TEXT = "u_V has the text 'off' in data row 17, a number was expected"
OWN: dict[str, dict[str, str | None]] = {  # other words than everywhere; None where the format cannot have the fault
    "CSV": {
        "the input is text": TEXT,
        "it is another kind of file": "data row 2 has 2 cells, the header has 1",
        "it is cut off": "has 51 samples, at least 100",
    },
    "Parquet": {"the input is text": TEXT},
    "Arrow": {"the input is text": TEXT},
    "ULog": {"the input is text": "did you mean u_V.value[7]?", "it is cut off": "the columns are t_s, u_V.value"},
    "CAN": {
        "an input is infinite": None,
        "a quarter is missing": None,
        "the output is counts": None,
        "the input is text": None,
        "it is another kind of file": "holds no frames, a CAN log was expected",
        "it is cut off": "has 49 samples, at least 100",
    },
    "ArduPilot": {
        "the output never moves": "is constant at 0.2499",
        "the output is counts": None,
        "a quarter is missing": None,
        "the input is text": None,
        "it is cut off": "has 29 samples, at least 100",
    },
}


def faults_of(kind: str) -> dict[str, Fault]:
    """The faults of a format, with its own words."""
    faults = EVERYWHERE | (BY_NAME_ONLY if kind in BY_NAME else {})
    own = OWN.get(kind, {})
    return {
        name: fault._replace(words=own.get(name, fault.words))
        for name, fault in faults.items()
        if own.get(name, "") is not None
    }


@pytest.mark.parametrize(("kind", "name"), [(kind, name) for kind in WRITERS for name in faults_of(kind)])
def test_a_fault_is_told_in_one_sentence(tmp_path, capsys, kind, name):
    fault = faults_of(kind)[name]
    made = fault.file(WRITERS[kind](tmp_path, fault.columns(FEW)))
    assert cli.main(["inspect", *made.arguments, "--json"]) == 2
    told = capsys.readouterr()
    assert told.out == ""
    sentence = told.err.removeprefix("ers: ").rstrip("\n")
    assert made.path.name in sentence and fault.words in sentence
    assert "\n" not in sentence and len(sentence) <= LONGEST
