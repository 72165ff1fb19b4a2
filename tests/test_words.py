"""Words that nobody outside this project knows stay out of what people read; the field has its own."""

import ast
import json
import re
from pathlib import Path

import pytest

from ers_mj.cli import main
from ers_mj.commands import COMMANDS

ROOT = Path(__file__).resolve().parents[1]
PLAIN = {
    r"dents?": "local minimum",
    r"knock(s|ed|ing)?": "impulse disturbance",
    r"outsiders?": "law outside the library",
    r"mimic(s|ked|king)?": "confounder, or: what stands for another effect",
    r"too many": "false positive, or the limit that was passed",
    r"false alarms?": "false positive",
    r"false flags?": "false positive",
}  # what was said, and what the field says
OLD = re.compile(rf"\b({'|'.join(PLAIN)})\b", re.IGNORECASE)
PAGES = [ROOT / "README.md", ROOT / "CONTRIBUTING.md", *sorted((ROOT / "docs").rglob("*.md"))]
FILES = sorted((ROOT / "ers_mj").rglob("*.py"))


def found(text: str) -> list[str]:
    """Old words, each with what surrounds it."""
    return [" ".join(text[max(m.start() - 40, 0) : m.end() + 40].split()) for m in OLD.finditer(text)]


def named(path: Path) -> str:
    return str(path.relative_to(ROOT))


@pytest.mark.parametrize("page", PAGES, ids=named)
def test_a_page_speaks_plainly(page):
    assert found(page.read_text()) == []


@pytest.mark.parametrize("notebook", sorted((ROOT / "docs").rglob("*.ipynb")), ids=named)
def test_a_notebook_speaks_plainly(notebook):
    assert found("\n".join("".join(cell["source"]) for cell in json.loads(notebook.read_text())["cells"])) == []


@pytest.mark.parametrize("path", FILES, ids=named)
def test_docstrings_and_texts_speak_plainly(path):
    """Every text of a file: docstrings, help, sentences and reports."""
    texts = [
        node.value
        for node in ast.walk(ast.parse(path.read_text()))
        if isinstance(node, ast.Constant) and isinstance(node.value, str)
    ]
    assert [hit for text in texts for hit in found(text)] == []


@pytest.mark.parametrize("command", COMMANDS, ids=lambda module: module.__name__.rpartition(".")[2])
def test_help_speaks_plainly(command, capsys):
    with pytest.raises(SystemExit):
        main([command.__name__.rpartition(".")[2], "--help"])
    assert found(capsys.readouterr().out) == []


def test_an_old_word_would_be_found():
    assert found("one Dent too many") == ["one Dent too many", "one Dent too many"] and found("an identity") == []
