"""Progress of long work, for people: on a terminal, or below the cell of a notebook."""

from __future__ import annotations

import sys
import time
from typing import Any

#: Time after which work that did not ask for it shows its progress, seconds.
# heuristic: shorter work needs none.
DELAY_S = 0.5


class Progress:
    """Callback with the number of finished pieces, which rewrites one line until it is closed.

    Args:
        name: name of the work.
        is_shown: whether it is shown; None: in a notebook, and if stderr is a terminal.
        pieces: what is counted.
    """

    def __init__(self, name: str, is_shown: bool | None, pieces: str = "trials") -> None:
        self._name = name
        self._pieces = pieces
        self._line: _TerminalLine | _NotebookLine | None = None
        if is_shown is not False and _is_notebook():
            self._line = _NotebookLine()
        elif is_shown or (is_shown is None and _is_terminal()):
            self._line = _TerminalLine()
        self._delay_s = 0.0 if is_shown else DELAY_S
        self._last: tuple[int, int] | None = None
        self._begun_s = time.monotonic()

    def __call__(self, done: int, total: int) -> None:
        gone_s = time.monotonic() - self._begun_s
        if self._line is None or self._last == (done, total) or gone_s < self._delay_s:
            return
        self._last = (done, total)
        self._line.write(f"{self._name}: {done} of {total} {self._pieces}, {gone_s:.1f} s")

    def __enter__(self) -> Progress:
        return self

    def __exit__(self, *_: object) -> None:
        if self._line is not None and self._last is not None:
            self._line.close()


class _TerminalLine:
    """Line on stderr, which stays."""

    def write(self, text: str) -> None:
        print(f"\r{text}", end="", file=sys.stderr, flush=True)

    def close(self) -> None:
        print(file=sys.stderr, flush=True)


class _NotebookLine:
    """Output of the running cell, which is emptied at the end: a stored notebook has no times."""

    def __init__(self) -> None:
        self._handle: Any = None

    def write(self, text: str) -> None:
        self._show({"text/plain": text})

    def close(self) -> None:
        self._show({"text/plain": "", "text/html": ""})

    def _show(self, data: dict[str, str]) -> None:
        if self._handle is not None:
            self._handle.update(data, raw=True)
            return
        from IPython import display

        show: Any = display.display
        self._handle = show(data, raw=True, display_id=True)


def _is_terminal() -> bool:
    # Without a console, stderr is None.
    return sys.stderr is not None and sys.stderr.isatty()


def _is_notebook() -> bool:
    """Whether IPython has a kernel, which its terminal has not."""
    module = sys.modules.get("IPython")
    return module is not None and hasattr(module.get_ipython(), "kernel")
