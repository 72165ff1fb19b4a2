"""The house: which room may read which, and what only some rooms may do."""

import ast
import tomllib
from functools import cache
from graphlib import TopologicalSorter
from pathlib import Path

import pytest

ROOT = Path(__file__).resolve().parents[1]
PACKAGE = ROOT / "ers_mj"
MAY_READ = {
    "errors": (),
    "processes": (),
    "comparing": ("errors",),
    "workers": ("data", "errors"),
    "decisions": (),
    "solvers": (),
    "data": ("decisions", "errors", "processes"),
    "effects": ("decisions", "errors"),
    "plants": ("effects", "errors", "processes"),
    "servo": ("data", "effects", "errors", "plants"),
    "estimation": ("data", "decisions", "effects", "errors", "servo", "solvers"),
    "identification": ("data", "errors", "estimation", "plants", "servo", "solvers"),
    "selection": ("data", "decisions", "effects", "estimation", "plants", "servo", "solvers"),
    "experiment_design": ("data", "effects", "errors", "estimation", "plants", "servo", "solvers"),
    "position_loop": ("data", "decisions", "effects", "errors", "plants", "servo", "solvers"),
    "diagnosis": (
        "data", "decisions", "effects", "estimation", "experiment_design", "plants", "position_loop", "selection",
        "servo",
    ),
    "online": ("data", "estimation", "servo", "solvers"),
    "control": ("data", "effects", "errors", "plants", "position_loop", "servo", "workers"),
    "validation": ("plants", "servo"),
    "view": ("data", "diagnosis", "errors", "plants", "position_loop", "servo"),
    "proving": ("data", "errors", "plants", "processes", "workers"),
    "report": ("control", "data", "diagnosis", "identification", "online", "plants", "proving", "validation", "view"),
    "export": ("control", "effects", "errors", "plants", "position_loop", "servo"),
    "door": (
        "control", "data", "diagnosis", "effects", "errors", "estimation", "export", "identification", "processes",
        "plants", "position_loop", "report", "selection", "servo", "validation", "view",
    ),
    "fleet": ("data", "door", "errors", "servo", "workers"),
    "commands": (
        "comparing", "control", "data", "door", "errors", "experiment_design", "fleet", "online", "plants", "processes",
        "proving", "report", "servo", "validation", "view", "workers",
    ),
    "cli": ("commands", "errors", "processes"),
}  # fmt: skip
WRITERS = {
    "commands",
    "door",
    "fleet",
    "report",
    "view",
    "proving",
    "processes",
    "cli",
}  # beside these only the tables of data/ open a file to write
FAMILIES = {
    "data/consistency": ("sheet", "motion"),
    "data/formats": ("base", "arrays", "clocks", "mat_elements"),
    "effects": ("base", "quantities"),
    "control/controllers": ("base", "finite_time", "pid"),
    "identification/minimisers": ("base", "iga"),
    "proving/concealed": ("base",),
    "proving/families": ("base",),
}  # whose members read their base and the named helpers of it, and no other member
FILES = [p for p in PACKAGE.rglob("*.py") if p.parent != PACKAGE or p.stem not in ("__init__", "__main__")]


def room(path: Path) -> str:
    return path.relative_to(PACKAGE).parts[0].removesuffix(".py")


@cache
def imports(path: Path) -> set[str]:
    """Modules of ers_mj, dotted and without `ers_mj.`, that a file imports when it is loaded or run."""
    found = set()
    for node in ast.walk(ast.parse(path.read_text())):
        if isinstance(node, ast.ImportFrom) and node.module and node.module.split(".")[0] == "ers_mj":
            parts = node.module.split(".")[1:]
            for alias in node.names:
                whole = [*parts, alias.name]
                is_file = PACKAGE.joinpath(*whole).with_suffix(".py").is_file() or PACKAGE.joinpath(*whole).is_dir()
                found.add(".".join(whole if is_file else parts))
    return found - {""}


def named(path: Path) -> str:
    return str(path.relative_to(PACKAGE))


def test_the_table_covers_every_room_and_has_no_circle():
    assert {room(p) for p in FILES} == set(MAY_READ)
    TopologicalSorter(MAY_READ).prepare()


@pytest.mark.parametrize("path", FILES, ids=named)
def test_a_room_reads_the_rooms_that_it_may(path):
    assert {other.split(".")[0] for other in imports(path)} <= {room(path), *MAY_READ[room(path)]}


def test_no_room_may_read_what_it_does_not():
    for name, allowed in MAY_READ.items():
        read = {other.split(".")[0] for p in FILES if room(p) == name for other in imports(p)}
        assert set(allowed) <= read, f"{name} no longer reads {set(allowed) - read}"


def test_files_read_each_other_without_a_circle():
    files = {named(p).removesuffix(".py").replace("/", ".").removesuffix(".__init__"): imports(p) for p in FILES}
    TopologicalSorter({name: others - {name} for name, others in files.items()}).prepare()


@pytest.mark.parametrize("family", FAMILIES)
def test_members_of_a_family_read_their_base_only(family):
    members = [p for p in (PACKAGE / family).glob("*.py") if p.stem != "__init__"]
    inside = family.replace("/", ".") + "."
    for path in members:
        others = {other.removeprefix(inside).split(".")[0] for other in imports(path) if other.startswith(inside)}
        assert others <= set(FAMILIES[family]), f"{named(path)} reads {others}"


@pytest.mark.parametrize("path", [p for p in FILES if room(p) not in WRITERS], ids=named)
def test_the_core_neither_prints_nor_plots(path):
    tree = ast.parse(path.read_text())
    assert not any(isinstance(node, ast.Name) and node.id == "print" for node in ast.walk(tree))
    assert "matplotlib" not in path.read_text()


def test_every_package_is_installed():
    declared = tomllib.loads((ROOT / "pyproject.toml").read_text())["tool"]["setuptools"]["packages"]
    there = {"ers_mj." + str(p.parent.relative_to(PACKAGE)).replace("/", ".") for p in FILES if p.stem == "__init__"}
    assert set(declared) == {"ers_mj", "ers_mj.mjcf", *there}
