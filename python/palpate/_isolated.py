"""Planners in processes of their own: what they do to their process is one failed trial.

The belief stays here. A planner over there asks it through a pipe, so that it sees what one on a thread sees.
"""

from __future__ import annotations

import multiprocessing
import signal
import threading
import time
from collections.abc import Callable
from multiprocessing.connection import Connection
from typing import Any

from ._planners import Factory, make, source_of, target_of, told
from .errors import PlannerError

#: Seconds that a process may take to start and to make a planner, at least; chosen.
START_S = 60.0


class Isolated:
    """The planners of one name in one run, each in a process that an earlier trial may have used."""

    def __init__(self, factory: Factory, limit_s: float | None) -> None:
        self.factory = factory
        self.source = source_of(factory)
        self.limit_s = limit_s
        self._lock = threading.Lock()
        self._idle: list[Child] = []
        self._all: list[Child] = []
        self.is_stopped = False

    def __call__(self, zone: Any, seed: int) -> Session:
        return Session(self, zone, seed)

    def take(self) -> Child:
        """A process that has nothing to do."""
        with self._lock:
            if self._idle:
                return self._idle.pop()
        child = Child()
        with self._lock:
            self._all.append(child)
        return child

    def give_back(self, child: Child) -> None:
        """Of a trial that is over."""
        with self._lock:
            self._idle.append(child)

    def stop(self) -> None:
        """Ends all of them at once."""
        self.is_stopped = True
        with self._lock:
            for child in self._all:
                child.kill()

    def __del__(self) -> None:
        for child in self._all:
            child.kill()


class Session:
    """A planner of one trial."""

    def __init__(self, home: Isolated, zone: Any, seed: int) -> None:
        self._home = home
        self._begin: tuple[Any, int] | None = (zone, seed)
        self._child: Child | None = None

    def plan(self, belief: Any) -> list[float]:
        """The next target.

        Raises:
            PlannerError: with the reason why there is none.
        """
        if self._begin is not None:
            self._child = self._home.take()
            limit_s = self._home.limit_s
            start_s = None if limit_s is None else max(START_S, limit_s)
            self._ask(("make", self._home.factory, *self._begin), belief, start_s)
            self._begin = None
        reply = self._ask(("plan",), belief, self._home.limit_s)
        target: list[float] = reply
        return target

    def close(self) -> None:
        """The trial is over."""
        if self._child is not None:
            self._home.give_back(self._child)
            self._child = None

    def _ask(self, request: tuple[Any, ...], belief: Any, limit_s: float | None) -> Any:
        child = self._child
        if child is None:
            raise PlannerError("its process has ended")
        try:
            kind, reply = child.ask(request, belief, limit_s)
        except Exception as error:
            self._child = None
            died = child.end() if isinstance(error, (EOFError, OSError)) else None
            child.kill()
            if self._home.is_stopped:
                raise PlannerError("the run was stopped") from None
            if isinstance(error, _Late):
                raise PlannerError(f"it did not return within {limit_s:g} s") from None
            if died is not None:
                raise PlannerError(died) from None
            raise PlannerError(f"{type(error).__name__}: {error}") from error
        if kind == "failed":
            raise PlannerError(str(reply))
        return reply


class Child:
    """A process with a pipe to it."""

    def __init__(self) -> None:
        context = multiprocessing.get_context("spawn")
        self._pipe, theirs = context.Pipe()
        self._process = context.Process(target=_serve, args=(theirs,), daemon=True)
        self._process.start()
        theirs.close()

    def ask(self, request: tuple[Any, ...], belief: Any, limit_s: float | None) -> tuple[str, Any]:
        """What it answers; until then it may ask the belief.

        Raises:
            _Late: if it does not answer in time.
            EOFError, OSError: if it has ended.
        """
        due_s = None if limit_s is None else time.monotonic() + limit_s
        self._pipe.send(request)
        while True:
            left_s = None if due_s is None else max(0.0, due_s - time.monotonic())
            if not self._pipe.poll(left_s):
                raise _Late
            kind, *rest = self._pipe.recv()
            if kind != "belief":
                return kind, rest[0]
            self._pipe.send(_answer(belief, *rest))

    def kill(self) -> None:
        """Ends it at once."""
        self._process.kill()

    def end(self) -> str:
        """How it ended, in words."""
        self._process.join(1.0)
        code = self._process.exitcode
        if code is not None and code < 0:
            return f"its process was ended by {signal.Signals(-code).name}"
        return f"its process ended with exit code {code}"


class _Late(Exception):
    """No answer in time."""


def _answer(belief: Any, name: str, call: tuple[tuple[Any, ...], dict[str, Any]] | None) -> Any:
    try:
        found = getattr(belief, name)
        if call is not None:
            return "value", found(*call[0], **call[1])
        return ("method", None) if callable(found) else ("value", found)
    except Exception as error:
        return "raised", error


class _Belief:
    """The belief, seen through a pipe."""

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

        self.__dict__[name] = method  # asked for once
        return method

    def _asked(self, name: str, call: Any) -> tuple[str, Any]:
        self._pipe.send(("belief", name, call))
        kind, value = self._pipe.recv()
        if kind == "raised":
            raise value
        return kind, value


def _serve(pipe: Connection[Any, Any]) -> None:
    signal.signal(signal.SIGINT, signal.SIG_IGN)  # whoever started it decides
    belief = _Belief(pipe)
    planner: Any = None
    while True:
        try:
            kind, *rest = pipe.recv()
        except EOFError:
            return
        except Exception as error:
            pipe.send(("failed", f"it cannot be made in a process of its own: {error}"))
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
            pipe.send(("failed", str(error) if isinstance(error, PlannerError) else told(error)))
