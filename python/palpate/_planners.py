"""Python planners: lookup by name, time limit, and isolation from the run.

A planner runs on its own thread, one per trial, which is abandoned if it exceeds the time limit; or, isolated, in its
own process, which can be killed (`_isolated`).
"""

from __future__ import annotations

import ast
import ctypes
import importlib
import importlib.util
import inspect
import os
import sys
import threading
import traceback
import uuid
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np

from . import _palpate
from .errors import PlannerError

#: Default time limit for a target, seconds.
# heuristic: far longer than the built-in planners need.
LIMIT_S = 60.0

#: Factory of a planner: its class, or any callable with a module and a name.
Factory = Callable[..., Any]


def name_of(factory: Factory) -> str:
    """Returns `MODULE:NAME`, the name in tables and rows.

    Raises:
        PlannerError: if it has no name, as a partial or an object.
    """
    module = getattr(factory, "__module__", None)
    name = getattr(factory, "__qualname__", None)
    if not callable(factory) or module is None or name is None:
        meant = f"; pass the class {type(factory).__name__}, not an object of it" if _plans(factory) else ""
        raise PlannerError(
            f"{factory!r} is not a planner: allowed are names, classes with plan(belief), and functions "
            f"that return an object with plan(belief){meant}"
        )
    return f"{module}:{name.replace('.<locals>', '')}"


def by_name(name: str) -> Factory:
    """Returns the class or function `MODULE:NAME`; also searches the working folder, as `python -m` does.

    Raises:
        PlannerError: if there is no such planner.
    """
    module_name, _, path = name.partition(":")
    if "" not in sys.path and os.getcwd() not in sys.path:
        sys.path.insert(0, os.getcwd())
    try:
        found: Any = importlib.import_module(module_name)
        for part in path.split("."):
            found = getattr(found, part)
    except Exception as error:
        raise PlannerError(f"planner {name}: {type(error).__name__}: {error}") from error
    if not callable(found):
        raise PlannerError(f"planner {name}: {found!r} is not a class")
    factory: Factory = found
    return factory


def source_of(factory: Factory) -> str:
    """Returns the source code that decides a planner's plans, so that a run detects an edited planner.

    It consists of the planner's module and of the modules in its folder that it imports, directly or indirectly;
    installed packages do not count. For a planner of a script or notebook (`__main__`) it is the planner's definition
    and those of its bases there. A planner without source code is unique each time.
    """
    module = sys.modules.get(factory.__module__)
    if module is None or module.__name__ == "__main__" or not getattr(module, "__file__", None):
        known = [it for it in getattr(factory, "__mro__", (factory,)) if it.__module__ == factory.__module__]
        try:
            return "".join(inspect.getsource(it) for it in known)
        except (OSError, TypeError):
            return f"unknown {uuid.uuid4()}"
    folder = Path(str(module.__file__)).parent
    sources: dict[str, str] = {}
    waiting = [(module.__name__, Path(str(module.__file__)))]
    while waiting:
        module_name, file = waiting.pop()
        name = file.relative_to(folder).as_posix()
        if name in sources:
            continue
        sources[name] = file.read_bytes().decode(errors="replace")
        for used in _imported(module_name, sources[name]):
            origin = _file_of(used)
            if origin is not None and origin.is_relative_to(folder) and not _is_installed(origin):
                waiting.append((used, origin))
    return "\n".join(f"# {name}\n{sources[name]}" for name in sorted(sources))


def _imported(module: str, text: str) -> list[str]:
    """Returns the full names of the modules that a module's source may import."""
    found = []
    try:
        tree = ast.parse(text)
    except (SyntaxError, ValueError):
        return []
    known = sys.modules.get(module)
    package = getattr(known, "__package__", None) or ""
    for node in ast.walk(tree):
        if isinstance(node, ast.Import):
            found += [alias.name for alias in node.names]
        elif isinstance(node, ast.ImportFrom):
            parents = package.split(".")[: -(node.level - 1) or None] if node.level else []
            base = ".".join([*parents, *([node.module] if node.module else [])])
            found += [base, *(f"{base}.{alias.name}" for alias in node.names)]
    return [name for name in found if name]


def _file_of(module: str) -> Path | None:
    """Returns the path of a module's source; None if there is none."""
    try:
        known = sys.modules.get(module)
        origin = known.__file__ if known is not None else importlib.util.find_spec(module).origin  # type: ignore[union-attr]
    except (ImportError, AttributeError, ValueError):
        return None
    file = Path(origin) if origin else None
    return file if file is not None and file.suffix == ".py" and file.is_file() else None


def _is_installed(file: Path) -> bool:
    return "site-packages" in file.parts or "dist-packages" in file.parts


def _plans(planner: Any) -> bool:
    return callable(getattr(planner, "plan", None))


def make(factory: Factory, zone: Any, seed: int) -> Any:
    """Creates a planner for one trial with the parameters of its constructor: `zone` (not around an object), `rng`
    and `seed`."""
    offered = {"zone": zone, "rng": np.random.default_rng(seed), "seed": seed}
    try:
        parameters = inspect.signature(factory).parameters
    except ValueError:
        parameters = {}  # type: ignore[assignment]
    wanted = parameters.get("zone")
    if zone is None and wanted is not None and wanted.default is inspect.Parameter.empty:
        raise PlannerError(f"{factory!r} has a parameter zone, but a whole object has none: use belief.ball")
    if zone is None:
        del offered["zone"]
    planner = factory(**{name: value for name, value in offered.items() if name in parameters})
    if not _plans(planner):
        raise PlannerError(f"{planner!r} has no method plan(belief)")
    return planner


def target_of(planned: Any) -> list[float]:
    """Returns a planner's result as a list of numbers."""
    return [float(at) for at in np.atleast_1d(np.asarray(planned, dtype=float)).ravel()]


def format_exception(error: BaseException) -> str:
    """Returns an exception with its traceback, without the lines of this package."""
    frames = traceback.extract_tb(error.__traceback__)
    own = [frame for frame in frames if os.path.dirname(frame.filename) != os.path.dirname(__file__)]
    head = "".join(traceback.format_exception_only(error)).strip()
    if not own:
        return head
    return f"{head}\n" + "".join(traceback.format_list(own)).rstrip()


class ThreadPlannerFactory:
    """Planners of one name in a run, started by the extension."""

    def __init__(self, factory: Factory, limit_s: float | None) -> None:
        self.source = source_of(factory)
        self._factory = factory
        self._limit_s = limit_s
        self._live: set[ThreadPlanner] = set()

    def __call__(self, zone: Any, seed: int) -> ThreadPlanner | InlinePlanner:
        if self._limit_s is None:
            return InlinePlanner(self._factory, zone, seed)
        worker = ThreadPlanner(self, self._factory, zone, seed, self._limit_s)
        self._live.add(worker)
        return worker

    @property
    def parts(self) -> tuple[Factory, float | None]:
        """Class of the planners, and their time limit."""
        return self._factory, self._limit_s

    def stop(self) -> None:
        """Stops waiting for all planners."""
        for worker in list(self._live):
            worker.interrupt()

    def forget(self, worker: ThreadPlanner) -> None:
        """Removes a finished worker."""
        self._live.discard(worker)


class InlinePlanner:
    """Planner of one trial that is called on the trial's thread without a time limit."""

    def __init__(self, factory: Factory, zone: Any, seed: int) -> None:
        self._make = (factory, zone, seed)
        self._planner: Any = None

    def plan(self, belief: Any) -> list[float]:
        """Returns the next target, as a worker does."""
        try:
            if self._planner is None:
                self._planner = make(*self._make)
            return target_of(self._planner.plan(belief))
        except PlannerError:
            raise
        except BaseException as error:  # includes sys.exit in a planner
            raise PlannerError(format_exception(error)) from None

    def close(self) -> None:
        """Ends the trial."""


class ThreadPlanner:
    """Planner of one trial on its own thread; the extension communicates with it through a desk."""

    def __init__(self, home: ThreadPlannerFactory, factory: Factory, zone: Any, seed: int, limit_s: float) -> None:
        self._home = home
        self.desk = _palpate.PlannerChannel(limit_s)
        arguments = (factory, zone, seed, self.desk)
        self._thread = threading.Thread(target=_serve, args=arguments, daemon=True)
        self._thread.start()

    def interrupt(self) -> None:
        """Ends the wait for a target."""
        self.desk.fail("the run was stopped")
        self.abandon()

    def close(self) -> None:
        """Ends the trial."""
        self._home.forget(self)

    def abandon(self) -> None:
        """Requests the thread to end; a thread that waits outside Python ends when it returns to Python."""
        ident = ctypes.c_ulong(self._thread.ident or 0)
        ctypes.pythonapi.PyThreadState_SetAsyncExc(ident, ctypes.py_object(SystemExit))


def _serve(factory: Factory, zone: Any, seed: int, desk: _palpate.PlannerChannel) -> None:
    try:
        belief = desk.next()
        planner: Any = make(factory, zone, seed) if belief is not None else None
        while belief is not None:
            desk.answer(target_of(planner.plan(belief)))
            # Released while the next touch is made.
            del belief
            belief = desk.next()
    except BaseException as error:  # includes sys.exit in a planner
        desk.fail(str(error) if isinstance(error, PlannerError) else format_exception(error))
