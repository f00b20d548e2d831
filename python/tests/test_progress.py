"""Tests of the progress that people see."""

import io
import sys

import nbformat
import palpate
import pytest
from jupyter_client.manager import AsyncKernelManager
from nbclient import NotebookClient
from palpate import _progress
from palpate._progress import Progress


class Terminal(io.StringIO):
    def isatty(self):
        return True


@pytest.fixture
def clock(monkeypatch):
    """Time that the test sets, seconds."""
    time = [0.0]
    monkeypatch.setattr(_progress.time, "monotonic", lambda: time[0])
    return time


def shown(monkeypatch, clock, stderr, is_shown):
    """Text that two steps of long work write to stderr."""
    monkeypatch.setattr(sys, "stderr", stderr)
    with Progress("toy", is_shown) as look:
        for done in (1, 1, 2):
            clock[0] += 1.0
            look(done, 3)
    return stderr.getvalue() if stderr else ""


def test_a_terminal_shows_it_and_a_pipe_does_not(monkeypatch, clock):
    text = "\rtoy: 1 of 3 trials, 1.0 s\rtoy: 2 of 3 trials, 3.0 s\n"
    assert shown(monkeypatch, clock, Terminal(), None) == text
    assert shown(monkeypatch, clock, Terminal(), False) == ""
    assert shown(monkeypatch, clock, io.StringIO(), None) == ""
    assert shown(monkeypatch, clock, None, None) == ""
    assert shown(monkeypatch, clock, io.StringIO(), True).count("\r") == 2


def test_short_work_shows_it_only_if_asked(monkeypatch, clock):
    for is_shown, text in ((None, ""), (True, "\rtoy: 3 of 3 trials, 0.0 s\n")):
        monkeypatch.setattr(sys, "stderr", terminal := Terminal())
        with Progress("toy", is_shown) as look:
            look(3, 3)
        assert terminal.getvalue() == text


def test_an_error_ends_the_line(monkeypatch, clock):
    monkeypatch.setattr(sys, "stderr", terminal := Terminal())
    with pytest.raises(KeyboardInterrupt), Progress("toy", True) as look:
        look(1, 3)
        raise KeyboardInterrupt
    assert terminal.getvalue().endswith("s\n")


def test_tests_and_pipes_are_silent(capsys):
    experiment = palpate.Experiment.load("toy", touches=30)
    experiment.run(["active"], trials=30)
    assert capsys.readouterr().err == ""


def test_a_notebook_shows_it_and_stores_none():
    code = "from palpate._progress import Progress\nimport time\nwith Progress('toy', None) as look:\n"
    long = nbformat.v4.new_code_cell(f"{code}    time.sleep(0.6)\n    look(1, 3)")
    kept = nbformat.v4.new_code_cell(f"{code}    time.sleep(0.6)\n    look(1, 3)\n    raise RuntimeError")
    off = nbformat.v4.new_code_cell(code.replace("None", "False") + "    time.sleep(0.6)\n    look(1, 3)")
    notebook = nbformat.v4.new_notebook(cells=[long, kept, off])
    updates = []

    class Client(NotebookClient):
        def process_message(self, message, cell, index):
            if message["msg_type"] in ("display_data", "update_display_data"):
                updates.append(message["content"]["data"]["text/plain"])
            return super().process_message(message, cell, index)

    kernel = AsyncKernelManager(kernel_name="python3", transport="ipc")
    Client(notebook, km=kernel, timeout=60, allow_errors=True).execute()
    assert [text.partition(",")[0] for text in updates] == ["toy: 1 of 3 trials", ""] * 2
    assert notebook.cells[0].outputs[0].data["text/plain"] == "" and not notebook.cells[2].outputs
    names = [output.get("name") for cell in notebook.cells for output in cell.outputs]
    assert "stderr" not in names
