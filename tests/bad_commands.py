"""Command lines that go wrong, drawn by hypothesis: real options with odd values, odd datasheets, odd files."""

import argparse
from functools import cache

import bad_inputs
from hypothesis import strategies as st

from ers_mj.cli import build_parser

WORDS = (
    *(
        "",
        " ",
        "-1",
        "0",
        "1",
        "1e308",
        "nan",
        "inf",
        "1e-320",
        "99999999999999999999",
        "a=b",
        "t_s=",
        "=x",
        "J=0",
        "b=nan",
    ),
    *(
        "theta_rad=__import__('os')",
        "u_V=u_V**999",
        "u_V=" + "(" * 400,
        "t_s=t_s[9]",
        "é",
        "\ud83d",
        "a" * 300,
        "../x",
        "/dev",
    ),
    *("%s", "{0}", "\\", "'", "--json", "pid", "steps", "reduced", "table1", "stribeck:dF_s=1", "stribeck:dF_s=1e300"),
)
USABLE = ("rec.csv", "model.toml")
UNUSABLE = ("short.csv", "still.csv", "binary.csv", "odd.toml", "plant.xml", "no.csv", "folder", "x#run=1")
LETTERS = ("J", "B", "K_t", "K_e", "k_s", "T_LH", "F_c", "R", "L", "theta_0", "n")
SIZES = (1.0, 1e-3, 1e3, 1e-12, 1e12, 1e-300, 1e300, 0.0, -1.0)


@cache
def _options() -> dict[str, list[tuple[str, int]]]:
    """Command -> its options with the number of values that they take, 0 or 1."""
    (commands,) = (a for a in build_parser()._actions if isinstance(a, argparse._SubParsersAction))
    return {
        name: [(a.option_strings[-1], 0 if a.nargs == 0 else 1) for a in parser._actions if a.option_strings]
        for name, parser in commands.choices.items()
    }


@st.composite
def lines(draw, files: tuple[str, ...] = (*USABLE, *UNUSABLE)) -> list[str]:
    """The arguments of one call, on some of these files."""
    command = draw(st.sampled_from(sorted(_options())))
    argv = [command, draw(st.sampled_from(files))]
    for option, values in draw(st.lists(st.sampled_from(_options()[command]), max_size=4)):
        argv += [option] + [draw(st.one_of(st.sampled_from(WORDS), st.sampled_from(files)))] * values
    argv += [draw(st.sampled_from(WORDS))] * draw(st.integers(0, 1))
    return [*argv, "--once"] if command == "watch" else argv  # which else waits for more


@st.composite
def datasheets(draw) -> str:
    """A datasheet as text: every letter some size that a number can have."""
    rows = [f"{letter} = {draw(st.sampled_from(SIZES)) * draw(st.floats(0.1, 10.0))!r}" for letter in LETTERS]
    kept = [row for row in rows if draw(st.integers(0, 9))]
    return "[parameters]\n" + "\n".join(kept) + "\n"


def lay_out(folder) -> None:
    """The files that lines name."""
    (folder / "folder").mkdir()
    (folder / "folder/kept.txt").write_text("kept")
    rows = bad_inputs.files()[".csv"][0]
    (folder / "rec.csv").write_bytes(rows)
    (folder / "short.csv").write_bytes(b"\n".join(rows.split(b"\n")[:50]))
    (folder / "still.csv").write_text("t_s,u_V,theta_rad\n" + "".join(f"{0.01 * k},1,1\n" for k in range(200)))
    (folder / "binary.csv").write_bytes(b"\xff\x00\x01")
    (folder / "model.toml").write_text("[lumped]\nb = 80\na_2 = 50\nc_2 = 100\n")
    (folder / "odd.toml").write_text("[lumped]\nb = 1e300\na_2 = 1e-300\n\n[[effect]]\nname = '<b>'\n")
    (folder / "plant.xml").write_text('<mujoco><include file="/etc/passwd"/></mujoco>')
