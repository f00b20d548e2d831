"""Python planners: names, source code, time limit, and isolation from the run.

A planner runs on its own thread, one per trial, which is abandoned if it exceeds the time limit; or, isolated, in its
own process, which can be killed (`_isolated`).
"""

from __future__ import annotations

import copy
import ctypes
import importlib
import inspect
import json
import os
import re
import sys
import threading
import traceback
from collections.abc import Callable, Mapping, Sequence
from functools import partial
from typing import Any

import numpy as np

from . import _palpate
from ._source import source_of
from .errors import PlannerError

#: Default time limit for a target, seconds.
# heuristic: far longer than the built-in planners need.
LIMIT_S = 60.0

#: Factory of a planner: its class, or a function that returns it.
Factory = Callable[..., Any]

#: Form of a planner's name, as the program allows it.
NAME = re.compile(r"[\w.<>-]+:[\w.<>-]+(\([^\x00-\x1f\x7f-\x9f]*\))?")

#: Largest length of an argument, and of a planner's `repr`, in a name.
# heuristic: names are column heads.
_ARGUMENT_MAX = 30
_REPR_MAX = 80


class InstanceFactory:
    """Factory of copies of a planner, one for each trial."""

    def __init__(self, planner: Any) -> None:
        self.planner = _copied(planner)

    def __call__(self) -> Any:
        return copy.deepcopy(self.planner)


def _copied(planner: Any) -> Any:
    """Returns a copy of an instance or a partial, as each trial gets one.

    Raises:
        PlannerError: if it cannot be copied.
    """
    try:
        return copy.deepcopy(planner)
    except Exception as error:
        raise PlannerError(
            f"{planner!r} cannot be copied for each trial: {type(error).__name__}: {error}; pass a class, or a "
            "function that returns the planner"
        ) from error


def source(factory: Factory) -> str:
    """Returns the source of a factory's planner; see `source_of`."""
    return source_of(factory.planner if isinstance(factory, InstanceFactory) else factory)


def named(
    planners: Sequence[Any] | Mapping[str, Any], known: Mapping[str, Factory], is_run: bool = True
) -> tuple[list[str], dict[str, Factory]]:
    """Returns the names of planners, and the factories of those that are not built in.

    Args:
        planners: names, classes, functions, partials, instances, and pairs of a name and one of these.
        known: factories of names that need no import.
        is_run: whether planners that are only named are imported.

    Raises:
        TypeError: if it is not a list or a mapping.
        PlannerError: if one is not a planner, or two have the same name.
    """
    if isinstance(planners, (str, type)) or not isinstance(planners, (Sequence, Mapping)):
        raise TypeError(f"planners = {planners!r}: allowed is a list, [{planners!r}]")
    names: list[str] = []
    own: dict[str, Factory] = {}
    for planner in planners.items() if isinstance(planners, Mapping) else planners:
        name, factory = _named(planner, known, is_run)
        if factory is not None and name in own:
            raise PlannerError(f'two planners have the name {name}: give each a name, ("NAME", planner)')
        if factory is not None:
            own[name] = factory
        names.append(name)
    return names, own


def _named(planner: Any, known: Mapping[str, Factory], is_run: bool) -> tuple[str, Factory | None]:
    given = None
    if isinstance(planner, tuple):
        if len(planner) != 2 or not isinstance(planner[0], str):
            raise PlannerError(f'{planner!r} is not a planner: allowed is a pair ("NAME", planner)')
        given, planner = planner
    if isinstance(planner, str) and given is None and not is_run:
        return planner, None
    if isinstance(planner, str) and ":" not in planner:
        if given is not None and given != planner:
            raise PlannerError(f"planner {given!r}: the built-in planner {planner} keeps its name")
        return planner, None
    name = planner if isinstance(planner, str) else name_of(planner)
    if isinstance(planner, str):
        planner = known[planner] if planner in known else by_name(planner)
    if given is not None:
        name = given if ":" in given else f"{name.partition(':')[0]}:{given}"
    if not NAME.fullmatch(name):
        raise PlannerError(f"planner name {given or name!r}: allowed are letters, digits and _ . < > -")
    _check_class(name, planner)
    if isinstance(planner, partial):
        planner = _copied(planner)
    return name, InstanceFactory(planner) if _is_instance(planner) else planner


def _check_class(name: str, factory: Any) -> None:
    """Raises PlannerError if a class, or that of a partial, has no method plan."""
    kind = factory.func if isinstance(factory, partial) else factory
    if isinstance(kind, type) and not _plans(kind):
        raise PlannerError(f"planner {name}: the class {kind.__qualname__} has no method plan(belief)")


def name_of(planner: Any) -> str:
    """Returns `MODULE:NAME`, the name in tables and rows; with the arguments of a partial, and those that a planner's
    own `repr` shows.

    Raises:
        PlannerError: if it is not a planner.
    """
    if isinstance(planner, partial):
        shown = [_shown(value) for value in planner.args]
        shown += [f"{name}={_shown(value)}" for name, value in planner.keywords.items()]
        return f"{name_of(planner.func)}({', '.join(shown)})"
    kind = type(planner) if _is_instance(planner) else planner
    module = getattr(kind, "__module__", None)
    name = getattr(kind, "__qualname__", None)
    if not callable(kind) or module is None or name is None:
        raise PlannerError(
            f"{planner!r} is not a planner: allowed are names, objects with plan(belief), their classes, functions "
            'that return them, and pairs ("NAME", planner)'
        )
    if _is_instance(planner):
        text = repr(planner)
        is_name = len(text) <= _REPR_MAX and " at 0x" not in text and NAME.fullmatch(f"{module}:{text}")
        if is_name and text.startswith(f"{name}("):
            name = text
    return f"{module}:{name.replace('.<locals>', '')}"


def _shown(value: Any) -> str:
    """Returns an argument for a name: its value if it is short, else its type."""
    if isinstance(value, np.generic):
        value = value.item()
    if isinstance(value, (bool, int, float, complex, str, bytes, tuple, list, type(None))):
        text = repr(value)
        if len(text) <= _ARGUMENT_MAX and " at 0x" not in text:
            return text
    return str(getattr(value, "__qualname__", type(value).__name__)).replace(".<locals>", "")


def by_name(name: str) -> Factory:
    """Returns the class or function `MODULE:NAME`; also searches the working folder, as `python -m` does.

    Raises:
        PlannerError: if there is no such planner.
    """
    module_name, _, path = name.partition(":")
    if "(" in path:
        raise PlannerError(f"planner {name} cannot be imported by its name: pass the object to Experiment.run")
    if "" not in sys.path and os.getcwd() not in sys.path:
        sys.path.insert(0, os.getcwd())
    try:
        found: Any = importlib.import_module(module_name)
        for part in path.split("."):
            found = getattr(found, part)
    except Exception as error:
        raise PlannerError(f"planner {name}: {type(error).__name__}: {error}") from error
    if not callable(found) and not _plans(found):
        raise PlannerError(f"planner {name}: {found!r} is not a class")
    _check_class(name, found)
    factory: Factory = InstanceFactory(found) if _is_instance(found) else found
    return factory


def _plans(planner: Any) -> bool:
    return callable(getattr(planner, "plan", None))


def _is_instance(planner: Any) -> bool:
    return _plans(planner) and not isinstance(planner, type)


def make(factory: Factory, zone: Any, seed: int) -> Any:
    """Creates a planner for one trial with the parameters of its constructor: `zone` (not around an object), `rng`
    and `seed`. Arguments of a partial are copied, so that trials share no state."""
    if isinstance(factory, partial):
        factory = copy.deepcopy(factory)
    offered = {"zone": zone, "rng": np.random.default_rng(seed), "seed": seed}
    for bound in factory.keywords if isinstance(factory, partial) else ():
        offered.pop(bound, None)
    try:
        parameters = inspect.signature(factory).parameters
    except ValueError:
        parameters = {}  # type: ignore[assignment]
    if _is_plan(factory, parameters, offered):
        return PlanFunction(factory)
    wanted = parameters.get("zone") if "zone" in offered else None
    if zone is None and wanted is not None and wanted.default is inspect.Parameter.empty:
        raise PlannerError(f"{factory!r} has a parameter zone, but a whole object has none: use belief.ball")
    if zone is None:
        offered.pop("zone", None)
    planner = factory(**{name: value for name, value in offered.items() if name in parameters})
    if not _plans(planner):
        raise PlannerError(f"{planner!r} has no method plan(belief)")
    return planner


def _is_plan(factory: Factory, parameters: Mapping[str, inspect.Parameter], offered: Mapping[str, Any]) -> bool:
    """Whether a function is itself a plan: all that it needs is one argument, the belief."""
    needed = [name for name, it in parameters.items() if it.default is inspect.Parameter.empty and it.kind in _NAMED]
    return not isinstance(factory, (type, InstanceFactory)) and len(needed) == 1 and needed[0] not in offered


#: Kinds of parameters that take one argument.
_NAMED = (inspect.Parameter.POSITIONAL_ONLY, inspect.Parameter.POSITIONAL_OR_KEYWORD)


class PlanFunction:
    """Planner that is a function of the belief."""

    def __init__(self, function: Factory) -> None:
        self.function = function

    def plan(self, belief: Any) -> Any:
        """Returns what the function returns."""
        return self.function(belief)


def target_of(planned: Any) -> list[float] | str:
    """Returns a planner's result as a list of coordinates, or a named target as JSON.

    A named target is a dict as in rows: `{"stroke": {"place": [x, z], "to": [u, v]}}`, `{"tilted": {"place": [x, z],
    "pitch_deg": 30}}`.

    Raises:
        PlannerError: if it is something else.
    """
    if planned is None:
        raise PlannerError("the planner returned None: allowed is a target (is a `return` missing in plan?)")
    try:
        if isinstance(planned, Mapping):
            return json.dumps(planned, default=lambda array: np.asarray(array).tolist())
        coordinates = np.asarray(planned, dtype=float)
    except (TypeError, ValueError) as error:
        raise PlannerError(f"the planner returned {planned!r}, which is not a target: {error}") from None
    if coordinates.ndim > 1 and coordinates.size != coordinates.shape[-1]:
        raise PlannerError(
            f"the planner returned an array of shape {coordinates.shape}: allowed is one target, such as places[i]"
        )
    return [float(at) for at in coordinates.ravel()]


def format_exception(error: BaseException) -> str:
    """Returns the message about an exception of a planner, with its traceback in the planner's code."""
    frames = traceback.extract_tb(error.__traceback__)
    own = [frame for frame in frames if os.path.dirname(frame.filename) != os.path.dirname(__file__)]
    head = "planner raised " + "".join(traceback.format_exception_only(error)).strip()
    if not own:
        return head
    return f"{head}\n" + "".join(traceback.format_list(own)).rstrip()


class ThreadPlannerFactory:
    """Planners of one name in a run, started by the extension."""

    def __init__(self, factory: Factory, limit_s: float | None) -> None:
        self.source = source(factory)
        self._factory = factory
        self._limit_s = limit_s
        self._live: set[ThreadPlanner] = set()
        #: First exception of a planner.
        self.error: BaseException | None = None

    def note(self, error: BaseException) -> None:
        """Keeps the first exception of a planner."""
        self.error = self.error or error

    def __call__(self, zone: Any, seed: int) -> ThreadPlanner | InlinePlanner:
        if self._limit_s is None:
            return InlinePlanner(self, self._factory, zone, seed)
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

    def __init__(self, home: ThreadPlannerFactory, factory: Factory, zone: Any, seed: int) -> None:
        self._home = home
        self._make = (factory, zone, seed)
        self._planner: Any = None

    def plan(self, belief: Any) -> list[float] | str:
        """Returns the next target, as a worker does."""
        try:
            if self._planner is None:
                self._planner = make(*self._make)
            return target_of(self._planner.plan(belief))
        except PlannerError:
            raise
        except BaseException as error:  # includes sys.exit in a planner
            self._home.note(error)
            raise PlannerError(format_exception(error)) from None

    def close(self) -> None:
        """Ends the trial."""


class ThreadPlanner:
    """Planner of one trial on its own thread; the extension communicates with it through a desk."""

    def __init__(self, home: ThreadPlannerFactory, factory: Factory, zone: Any, seed: int, limit_s: float) -> None:
        self._home = home
        self.desk = _palpate.PlannerChannel(limit_s)
        arguments = (home, factory, zone, seed, self.desk)
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


def _serve(home: ThreadPlannerFactory, factory: Factory, zone: Any, seed: int, desk: _palpate.PlannerChannel) -> None:
    try:
        belief = desk.next()
        planner: Any = make(factory, zone, seed) if belief is not None else None
        while belief is not None:
            desk.answer(target_of(planner.plan(belief)))
            # Released while the next touch is made.
            del belief
            belief = desk.next()
    except BaseException as error:  # includes sys.exit in a planner
        home.note(error)
        desk.fail(str(error) if isinstance(error, PlannerError) else format_exception(error))
