"""Runs on an executor: trials as jobs of a process pool, a cluster or a scheduler.

A job gets the experiment as text and the numbers of its trials, and returns their rows as lines of `trials.jsonl`.
This process stores each job's rows when it finishes. Rows that no job returned are missing, like those of an
interrupted run.
"""

from __future__ import annotations

import hashlib
import importlib
import inspect
import multiprocessing
import os
import pickle
import threading
import time
from collections.abc import Iterator
from contextlib import suppress
from functools import partial
from itertools import chain, groupby
from typing import Any, Protocol

from . import _palpate
from ._planners import ThreadPlannerFactory
from ._progress import Progress
from .errors import PalpateError, PlannerError

__all__ = ["Executor"]

#: Version of the program; all jobs of a run have the same.
BUILD = f"{_palpate.__version__} ({_palpate.COMMIT})"

#: Number of times that a job is submitted, if its worker is lost.
# heuristic: a job that loses two workers has likely caused both losses.
ATTEMPTS = 2

#: Shortest and longest interval between looks at the jobs, seconds.
# heuristic: short against a trial; long against the cost of a look at some thousand jobs.
POLL_S = (0.002, 0.2)

_Trials = list[tuple[int, str]]


class Executor(Protocol):
    """Anything that runs functions elsewhere: `concurrent.futures.Executor`, Dask's `Client`, submitit's executors."""

    def submit(self, fn: Any, /, *args: Any) -> Any:
        """Returns a future with `done()`, `result()` and `cancel()`."""


def run(
    core: _palpate.Experiment,
    workers: dict[str, Any],
    executor: Executor,
    trials_per_job: int,
    *,
    out: str | None,
    fresh: bool,
    threads: int,
    raises: bool,
    look: Progress,
) -> _palpate.Run:
    """Runs the missing trials of an experiment on an executor; `workers` are the factories of its Python planners.

    Args:
        threads: as for `_palpate.Experiment.run`, but 0 means one.
    """
    if not callable(getattr(executor, "submit", None)):
        raise TypeError(
            f"executor = {executor!r}: allowed is an object with a method submit, such as a ProcessPoolExecutor"
        )
    if trials_per_job < 1:
        raise ValueError(f"trials_per_job = {trials_per_job}: allowed is 1 or more")
    planners = _pickled(workers)
    collector = _palpate.RowCollector(core, list(workers.items()), out, fresh)
    try:
        payload = pickle.dumps((BUILD, collector.text, planners, max(1, threads), raises))
        total = core.trials * len(core.planners)
        jobs = _Jobs(executor, payload, collector, total, raises, look)
        jobs.run(_groups(collector.missing, trials_per_job))
        count, first = jobs.lost()
        if count:
            kept = "a run with out=FOLDER keeps the finished trials" if out is None else f"the others are kept in {out}"
            raise PalpateError(
                f"{count} jobs were lost, {total - collector.done} of {total} trials are missing; the first is {first}\n"
                f"{kept}; repeat the call with a working executor to run the missing ones"
            )
        return collector.run()
    finally:
        collector.close()


def _groups(missing: _Trials, trials_per_job: int) -> list[_Trials]:
    """Returns the trials of each job: some trial numbers with all their planners."""
    numbers = [list(group) for _, group in groupby(missing, key=lambda trial: trial[0])]
    starts = range(0, len(numbers), trials_per_job)
    return [list(chain.from_iterable(numbers[start : start + trials_per_job])) for start in starts]


class _Jobs:
    """Jobs of a run."""

    def __init__(
        self,
        executor: Executor,
        payload: bytes,
        collector: _palpate.RowCollector,
        total: int,
        raises: bool,
        look: Progress,
    ) -> None:
        self._executor = executor
        self._payload = payload
        self._collector = collector
        self._total = total
        self._raises = raises
        self._look = look
        #: Jobs without a result, with the number of their submission.
        self._waiting: list[tuple[Any, _Trials, int]] = []
        #: Trials and error of each lost job that is not submitted again.
        self._lost: list[tuple[_Trials, BaseException]] = []

    def run(self, groups: list[_Trials]) -> None:
        """Submits the jobs and stores their rows.

        Raises:
            PalpateError: if a job failed; the rows of the others are stored.
            KeyboardInterrupt: after Ctrl-C, when the running jobs have ended.
        """
        try:
            for trials in groups:
                self._submit(trials, 1, None)
            for future, trials, attempt in self._ended():
                self._store(future, trials, attempt)
        except BaseException:
            # Jobs that cannot be cancelled are running.
            self._waiting = [job for job in self._waiting if job[0].done() or job[0].cancel() is False]
            for future, _, _ in self._ended():
                with suppress(Exception):
                    self._keep(*future.result()[:2])
            raise

    def lost(self) -> tuple[int, str]:
        """Returns the number of lost jobs, and the first one in words."""
        if not self._lost:
            return 0, ""
        trials, error = self._lost[0]
        trial, planner = trials[0]
        return len(self._lost), f"trial {trial} of {planner}: {type(error).__name__}: {error}"

    def _submit(self, trials: _Trials, attempt: int, loss: BaseException | None) -> None:
        try:
            # Dask gives equal calls one result; the time makes each call different.
            future = self._executor.submit(work, self._payload, trials, (time.time(), attempt))
        except Exception as error:
            self._lost.append((trials, loss or error))
        else:
            self._waiting.append((future, trials, attempt))

    def _ended(self) -> Iterator[tuple[Any, _Trials, int]]:
        """Yields each job when it has ended, and reports the progress."""
        pause_s = POLL_S[0]
        while self._waiting:
            ended = [job for job in self._waiting if job[0].done()]
            for job in ended:
                self._waiting.remove(job)
                yield job
            self._look(self._collector.done, self._total)
            pause_s = POLL_S[0] if ended else min(2 * pause_s, POLL_S[1])
            if self._waiting:
                time.sleep(pause_s)

    def _store(self, future: Any, trials: _Trials, attempt: int) -> None:
        try:
            lines, inputs, error = future.result()
        except Exception as loss:
            if attempt < ATTEMPTS:
                self._submit(trials, attempt + 1, loss)
            else:
                self._lost.append((trials, loss))
            return
        failed = self._keep(lines, inputs)
        if error is not None:
            raise error
        if failed and self._raises:
            trial, planner, reason = failed[0]
            raise PlannerError(f"{planner}, trial {trial}: {reason}")

    def _keep(self, lines: bytes, inputs: dict[str, str] | None) -> list[tuple[int, str, str]]:
        """Stores the rows of a job that had these inputs; returns failed trials of Python planners."""
        wanted = self._collector.inputs
        if inputs is not None and inputs != wanted:
            changed = ", ".join(key for key, value in wanted.items() if inputs.get(key) != value)
            raise PalpateError(f"a worker has another version of {changed}; allowed are equal files on all machines")
        return self._collector.add(lines)


def _pickled(workers: dict[str, Any]) -> bytes:
    """Returns the Python planners for another process.

    Raises:
        PlannerError: if a planner cannot be pickled.
    """
    pickler: Any = pickle
    with suppress(ImportError):
        # Pickles classes of scripts and notebooks by value.
        pickler = importlib.import_module("cloudpickle")
    parts = {}
    for name, worker in workers.items():
        is_isolated = not isinstance(worker, ThreadPlannerFactory)
        factory, limit_s = worker.parts
        try:
            parts[name] = pickler.dumps((factory, worker.source, limit_s, is_isolated))
        except Exception as error:
            raise PlannerError(
                f"planner {name} cannot be sent to a worker: {type(error).__name__}: {error}; define it at the top "
                "level of a module, or install cloudpickle"
            ) from error
    return pickle.dumps(parts)


def work(payload: bytes, trials: _Trials, _: Any) -> tuple[bytes, dict[str, str] | None, BaseException | None]:
    """Runs a job in its worker: returns the rows, the hashes of the inputs, and an exception."""
    try:
        runner, workers, threads, raises = _runner(payload)
        stop = partial(_stop, workers)
        lines, error = runner.run(trials, threads=threads, raises=raises, look=_ignore, stop=stop)
        return lines, runner.inputs, error
    except (PalpateError, KeyboardInterrupt) as error:
        return b"", None, error


_Runner = tuple[_palpate.JobRunner, dict[str, Any], int, bool]

#: Runner of the last run in this process, which the next jobs of the run use again.
_last: dict[bytes, _Runner] = {}
_last_lock = threading.Lock()


def _runner(payload: bytes) -> _Runner:
    key = hashlib.sha256(payload).digest()
    with _last_lock:
        if key not in _last:
            build, text, planners, threads, raises = pickle.loads(payload)
            if build != BUILD:
                raise PalpateError(f"a worker has palpate {BUILD}, the run has {build}; allowed are equal versions")
            workers = _workers(planners)
            runner = _palpate.JobRunner(text, list(workers.items()))
            _last.clear()
            _last[key] = (runner, workers, threads, raises)
        return _last[key]


def _workers(planners: bytes) -> dict[str, Any]:
    workers: dict[str, Any] = {}
    for name, pickled in pickle.loads(planners).items():
        try:
            factory, source, limit_s, is_isolated = pickle.loads(pickled)
        except Exception as error:
            raise PlannerError(
                f"planner {name} cannot be loaded in a worker: {type(error).__name__}: {error}; its module must be "
                "importable there"
            ) from error
        if is_isolated and multiprocessing.current_process().daemon:
            raise PlannerError(
                f"planner {name}: isolate = True: a daemonic worker must not start processes; allowed is False, or "
                "workers that are no daemons"
            )
        if is_isolated:
            from ._isolated import ProcessPlannerFactory

            workers[name] = ProcessPlannerFactory(factory, limit_s)
        else:
            workers[name] = ThreadPlannerFactory(factory, limit_s)
        # A class sent by value has no source code here.
        if not _has_file(factory):
            workers[name].source = source
    return workers


def _has_file(factory: Any) -> bool:
    module = inspect.getmodule(factory)
    file = getattr(module, "__file__", None)
    is_main = getattr(module, "__name__", "") in ("__main__", "__mp_main__")
    return not is_main and file is not None and os.path.exists(file)


def _ignore(*_: Any) -> None:
    """Ignores the progress."""


def _stop(workers: dict[str, Any]) -> None:
    for factory in workers.values():
        factory.stop()
