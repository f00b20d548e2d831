"""Planners in their own processes: a crash of a process fails one trial.

The belief stays in the main process. A planner queries it through a pipe and gets the same answers as on a thread.
"""

from __future__ import annotations

import multiprocessing
import signal
import threading
import time
from collections.abc import Callable
from multiprocessing.connection import Connection
from multiprocessing.reduction import ForkingPickler
from typing import Any

from ._planners import Factory, format_exception, make, source, target_of
from .errors import PlannerError

#: Minimum time limit for a process to start and create a planner, seconds.
# heuristic: leaves time for slow imports.
START_S = 60.0


class ProcessPlannerFactory:
    """Planners of one name in a run, each in a process that a finished trial may have used."""

    def __init__(self, factory: Factory, limit_s: float | None) -> None:
        self.factory = factory
        self.source = source(factory)
        self.limit_s = limit_s
        self._lock = threading.Lock()
        self._idle: list[PlannerProcess] = []
        self._all: list[PlannerProcess] = []
        self.is_stopped = False
        try:
            ForkingPickler.dumps(factory)
        except Exception as error:
            planner = getattr(factory, "planner", factory)
            raise PlannerError(
                f"{planner!r} cannot be sent to its own process (isolate=True): {type(error).__name__}: {error}; "
                "pass a class or a function of a module, or a partial of one"
            ) from error

    def __call__(self, zone: Any, seed: int) -> ProcessPlanner:
        return ProcessPlanner(self, zone, seed)

    @property
    def parts(self) -> tuple[Factory, float | None]:
        """Class of the planners, and their time limit."""
        return self.factory, self.limit_s

    def take(self) -> PlannerProcess:
        """Returns an idle process."""
        with self._lock:
            if self._idle:
                return self._idle.pop()
        child = PlannerProcess()
        with self._lock:
            self._all.append(child)
        return child

    def give_back(self, child: PlannerProcess) -> None:
        """Returns the process of a finished trial to the pool."""
        with self._lock:
            self._idle.append(child)

    def stop(self) -> None:
        """Kills all processes."""
        self.is_stopped = True
        with self._lock:
            for child in self._all:
                child.kill()

    def __del__(self) -> None:
        for child in self._all:
            child.kill()


class ProcessPlanner:
    """Planner of one trial."""

    def __init__(self, home: ProcessPlannerFactory, zone: Any, seed: int) -> None:
        self._home = home
        self._begin: tuple[Any, int] | None = (zone, seed)
        self._child: PlannerProcess | None = None

    def plan(self, belief: Any) -> list[float] | str:
        """Returns the next target.

        Raises:
            PlannerError: if there is no target; with the reason.
        """
        if self._begin is not None:
            self._child = self._home.take()
            limit_s = self._home.limit_s
            start_s = None if limit_s is None else max(START_S, limit_s)
            self._ask(("make", self._home.factory, *self._begin), belief, start_s)
            self._begin = None
        reply = self._ask(("plan",), belief, self._home.limit_s)
        target: list[float] | str = reply
        return target

    def close(self) -> None:
        """Ends the trial."""
        if self._child is not None:
            self._home.give_back(self._child)
            self._child = None

    def _ask(self, request: tuple[Any, ...], belief: Any, limit_s: float | None) -> Any:
        child = self._child
        if child is None:
            raise PlannerError("the planner's process has ended")
        try:
            kind, reply = child.ask(request, belief, limit_s)
        except Exception as error:
            self._child = None
            died = child.end() if isinstance(error, (EOFError, OSError)) else None
            child.kill()
            if self._home.is_stopped:
                raise PlannerError("the run was stopped") from None
            if isinstance(error, _Timeout):
                raise PlannerError(f"the planner did not return within {limit_s:g} s") from None
            if died is not None:
                raise PlannerError(died) from None
            raise PlannerError(f"{type(error).__name__}: {error}") from error
        if kind == "failed":
            raise PlannerError(str(reply))
        return reply


class PlannerProcess:
    """A process with a pipe to it."""

    def __init__(self) -> None:
        context = multiprocessing.get_context("spawn")
        self._pipe, theirs = context.Pipe()
        self._process = context.Process(target=_serve, args=(theirs,), daemon=True)
        self._process.start()
        theirs.close()

    def ask(self, request: tuple[Any, ...], belief: Any, limit_s: float | None) -> tuple[str, Any]:
        """Sends a request and returns the reply; meanwhile answers queries of the belief.

        Raises:
            _Timeout: if there is no reply in time.
            EOFError, OSError: if the process has ended.
        """
        due_s = None if limit_s is None else time.monotonic() + limit_s
        self._pipe.send(request)
        while True:
            left_s = None if due_s is None else max(0.0, due_s - time.monotonic())
            if not self._pipe.poll(left_s):
                raise _Timeout
            kind, *rest = self._pipe.recv()
            if kind != "belief":
                return kind, rest[0]
            self._pipe.send(_answer(belief, *rest))

    def kill(self) -> None:
        """Kills the process."""
        self._process.kill()

    def end(self) -> str:
        """Describes how the process ended."""
        self._process.join(1.0)
        code = self._process.exitcode
        if code is not None and code < 0:
            return f"the planner's process was ended by {signal.Signals(-code).name}"
        return f"the planner's process ended with exit code {code}"


class _Timeout(Exception):
    """No reply in time."""


def _answer(belief: Any, name: str, call: tuple[tuple[Any, ...], dict[str, Any]] | None) -> Any:
    try:
        found = getattr(belief, name)
        if call is not None:
            return "value", found(*call[0], **call[1])
        return ("method", None) if callable(found) else ("value", found)
    except Exception as error:
        return "raised", error


class _Belief:
    """Proxy of the belief through a pipe."""

    def __init__(self, pipe: Connection[Any, Any]) -> None:
        self._pipe = pipe

    def __getattr__(self, name: str) -> Any:
        kind, value = self._asked(name, None)
        if kind == "value":
            return value
        return self._method(name)

    def _method(self, name: str) -> Callable[..., Any]:
        def method(*arguments: Any, **named: Any) -> Any:
            return self._asked(name, (arguments, named))[1]

        self.__dict__[name] = method  # queried only once
        return method

    def _asked(self, name: str, call: Any) -> tuple[str, Any]:
        self._pipe.send(("belief", name, call))
        kind, value = self._pipe.recv()
        if kind == "raised":
            raise value
        return kind, value


def _serve(pipe: Connection[Any, Any]) -> None:
    signal.signal(signal.SIGINT, signal.SIG_IGN)  # the parent process handles Ctrl-C
    belief = _Belief(pipe)
    planner: Any = None
    while True:
        try:
            kind, *rest = pipe.recv()
        except EOFError:
            return
        except Exception as error:
            pipe.send(("failed", f"the planner cannot be created in its own process: {error}"))
            continue
        try:
            if kind == "make":
                planner = None
                planner = make(*rest)
                pipe.send(("made", None))
            else:
                target = target_of(planner.plan(belief))
                pipe.send(("target", target))
        except Exception as error:
            pipe.send(("failed", str(error) if isinstance(error, PlannerError) else format_exception(error)))
