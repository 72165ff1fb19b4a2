"""Who may import whom: a step reads the steps on its left."""

import ast
from pathlib import Path

import pytest

PACKAGE = Path(__file__).resolve().parents[1] / "ers_mj"
ORDER = [
    "errors",
    "minimisers",
    "tables",
    "symptoms",
    "recording",
    "datasheet",
    "effects",
    "plants",
    "proving",
    "simulation",
    "converter",
    "traces",
    "excitation",
    "replay",
    "model_file",
    "rendering",
    "window",
    "model",
    "starts",
    "identification",
    "guess",
    "baseline",
    "identifying",
    "isolability",
    "remainder",
    "knocks",
    "screening",
    "ranking",
    "restarts",
    "race",
    "reviews",
    "selection",
    "intervals",
    "evaluation",
    "spectra",
    "mismatch",
    "evidence",
    "design",
    "advice",
    "localisation",
    "confirmation",
    "mimics",
    "multibody",
    "case",
    "document",
    "diagnosis",
    "known",
    "streaming",
    "tracking",
    "experiment",
    "validation",
    "controllers",
    "references",
    "closed_loop",
    "measures",
    "trial",
    "robustness",
    "gains",
    "claims",
    "frequency",
    "display",
    "validity",
    "frames",
    "figures",
    "page",
    "maps",
    "report",
    "validation_report",
    "proof_figures",
    "proof_report",
    "trial_figures",
    "trial_report",
    "frequency_figures",
    "frequency_report",
    "identify_figures",
    "identify_report",
    "watch_report",
    "commands",
    "cli",
]
SILENT = {
    "minimisers",
    "identifying",
    "proving",
    "advice",
    "design",
    "excitation",
    "isolability",
    "model",
    "converter",
    "starts",
    "identification",
    "guess",
    "baseline",
    "knocks",
    "screening",
    "ranking",
    "restarts",
    "race",
    "reviews",
    "selection",
    "intervals",
    "evaluation",
    "localisation",
    "remainder",
    "confirmation",
    "mimics",
    "multibody",
    "case",
    "document",
    "diagnosis",
    "validation",
    "validity",
    "effects",
    "plants",
    "replay",
    "model_file",
    "rendering",
    "window",
    "frames",
    "controllers",
    "references",
    "closed_loop",
    "measures",
    "trial",
    "robustness",
    "gains",
    "claims",
    "spectra",
    "mismatch",
    "frequency",
    "known",
    "streaming",
    "tracking",
    "experiment",
}


def room(path: Path) -> str:
    return path.relative_to(PACKAGE).parts[0].removesuffix(".py")


def imports(path: Path) -> set[str]:
    """Rooms of ers_mj that a file imports when it is loaded or run."""
    found = set()
    for node in ast.walk(ast.parse(path.read_text())):
        if isinstance(node, ast.ImportFrom) and node.module and node.module.startswith("ers_mj"):
            parts = node.module.split(".")
            found |= {parts[1]} if len(parts) > 1 else {a.name for a in node.names if not a.name.startswith("__")}
    return found


FILES = [p for p in PACKAGE.rglob("*.py") if room(p) not in ("__init__", "__main__")]


@pytest.mark.parametrize("path", FILES, ids=lambda p: str(p.relative_to(PACKAGE)))
def test_a_step_reads_the_steps_on_its_left(path):
    here = ORDER.index(room(path))
    assert all(ORDER.index(other) <= here for other in imports(path))


@pytest.mark.parametrize("path", [p for p in FILES if room(p) in SILENT], ids=lambda p: str(p.relative_to(PACKAGE)))
def test_the_core_neither_prints_nor_plots(path):
    text = path.read_text()
    assert "print(" not in text and "matplotlib" not in text
