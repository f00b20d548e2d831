"""The command `palpate`."""

from __future__ import annotations

import os
import sys

from . import _palpate
from ._home import HOME
from ._planners import LIMIT_S, ThreadPlannerFactory, by_name


def main() -> int:
    """Runs the program on the process's arguments; returns its exit code."""
    os.environ.setdefault("PALPATE_HOME", str(HOME))
    return _palpate.main(["palpate", *sys.argv[1:]], lambda name: ThreadPlannerFactory(by_name(name), LIMIT_S))


if __name__ == "__main__":
    sys.exit(main())
