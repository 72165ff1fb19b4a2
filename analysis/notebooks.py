"""Runs the notebooks of docs/ and keeps what they print and draw: `python analysis/notebooks.py`.

`--check` runs them without writing. A cell that fails ends it with exit code 1. Needs the extra `docs`.
"""

import os
import sys
from pathlib import Path

import nbformat
from nbconvert.preprocessors import CellExecutionError, ExecutePreprocessor

FOLDER = Path(__file__).resolve().parents[1] / "docs" / "notebooks"


def main(check: bool) -> int:
    """Run each; the exit code."""
    root = str(FOLDER.parents[1])
    os.environ["PYTHONPATH"] = os.pathsep.join([root, os.environ.get("PYTHONPATH", "")])
    for path in sorted(FOLDER.glob("*.ipynb")):
        notebook = nbformat.read(path, as_version=4)
        try:
            ExecutePreprocessor(timeout=600, kernel_name="python3").preprocess(notebook, {"metadata": {"path": root}})
        except CellExecutionError as error:
            print(f"{path.name}: {error}", file=sys.stderr)
            return 1
        if not check:
            nbformat.write(plain(notebook), path)
        print(f"{path.name}: runs{'' if check else ', written'}")
    return 0


def plain(notebook: nbformat.NotebookNode) -> nbformat.NotebookNode:
    """Without what differs between two runs or machines."""
    notebook.metadata = {"kernelspec": {"name": "python3", "display_name": "Python 3", "language": "python"}}
    for number, cell in enumerate(notebook.cells):
        cell.id, cell.metadata = f"cell-{number}", {}
        for output in cell.get("outputs", ()):
            output.pop("metadata", None)
            output.update({"metadata": {}} if output.output_type in ("display_data", "execute_result") else {})
    return notebook


if __name__ == "__main__":
    sys.exit(main("--check" in sys.argv[1:]))
