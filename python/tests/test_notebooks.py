"""Tests that notebooks run and contain their outputs."""

import nbformat
import notebooks
import pytest

FILES = sorted(notebooks.FOLDER.glob("*.ipynb"))


def pictures(notebook):
    shown = [output for cell in notebook.cells for output in cell.get("outputs", [])]
    return sum("image/png" in output.get("data", {}) for output in shown)


def errors(notebook):
    shown = [output for cell in notebook.cells for output in cell.get("outputs", [])]
    return [output.text for output in shown if output.get("name") == "stderr"]


def test_they_are_all_there():
    assert [file.stem for file in FILES] == [
        "first_exploration",
        "what_accuracy_costs",
        "your_own_planner",
    ]


@pytest.mark.parametrize("file", FILES, ids=lambda file: file.stem)
def test_a_notebook_runs_and_warns_of_nothing(file, monkeypatch, tmp_path):
    monkeypatch.chdir(tmp_path)
    again = notebooks.executed(file)
    assert errors(again) == []
    assert pictures(again) == pictures(nbformat.read(file, as_version=4)) > 0


@pytest.mark.parametrize("file", FILES, ids=lambda file: file.stem)
def test_a_notebook_is_kept_small_and_whole(file):
    notebook = nbformat.read(file, as_version=4)
    nbformat.validate(notebook)
    counts = [cell.execution_count for cell in notebook.cells if cell.cell_type == "code"]
    assert counts == list(range(1, len(counts) + 1)), "run it with run.py before it is kept"
    assert file.stat().st_size < 300_000
