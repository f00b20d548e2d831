"""Progress of a run on stderr."""

from __future__ import annotations

import sys
import time


class Progress:
    """Callback with the number of finished pieces; it rewrites one line."""

    def __init__(self, name: str, is_shown: bool, pieces: str = "trials") -> None:
        self._name = name
        self._pieces = pieces
        self._is_shown = is_shown
        self._last: tuple[int, int] | None = None
        self._begun_s = time.monotonic()

    def __call__(self, done: int, total: int) -> None:
        if not self._is_shown or self._last == (done, total):
            return
        self._last = (done, total)
        gone_s = time.monotonic() - self._begun_s
        end = "\n" if done == total else ""
        text = f"\r{self._name}: {done} of {total} {self._pieces}, {gone_s:.1f} s"
        print(text, end=end, file=sys.stderr, flush=True)
