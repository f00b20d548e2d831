"""Experiments: loading, settings and runs."""

from __future__ import annotations

import os
import re
import warnings
from collections.abc import Mapping, Sequence
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING, Any

from . import _palpate
from ._executor import Executor
from ._executor import run as run_on
from ._home import HOME, find_file
from ._palpate import Zone
from ._planners import LIMIT_S, Factory, ThreadPlannerFactory, named
from ._progress import Progress
from ._run import Run
from ._settings import ExperimentSettings, assignments
from .errors import PlannerError

if TYPE_CHECKING:
    from typing_extensions import Unpack

__all__ = ["Experiment"]


class Experiment:
    """An experiment: planners and trials on one scene.

        palpate.Experiment(scene="bird", touches=60, gp={"noise": [0.001, 0.1]}).run([Widest, "active"], trials=20)

    The keyword arguments are the settings of `docs/reference.md`; a table is a mapping. A pickled experiment contains
    all settings, but of meshes and other files only the paths.

    Args:
        scene: name of a scene of the package, path of a file, relative to the working folder, table, or `Scene`.
        planners: as for `run`; default: "active" and "random".
        touches: default: 40.
        trials: default: 12.
        initial_touches: default: 5.
        name: default: that of the scene.

    Raises:
        ConfigError: if a setting is missing or invalid; with key, value and allowed values.
    """

    def __init__(self, **settings: Unpack[ExperimentSettings]) -> None:
        touches = settings.get("touches", 40)
        usual = {
            "name": _name(settings.get("scene")),
            "planners": ["active", "random"],
            "trials": 12,
            "touches": touches,
            "initial_touches": min(5, touches) if isinstance(touches, int) else 5,
        }
        self._load(None, {**usual, **settings})

    def _load(self, path: Path | None, settings: dict[str, Any]) -> None:
        #: Factories of the planners that are not named by strings.
        self._own: dict[str, Factory] = {}
        if "planners" in settings and not isinstance(settings["planners"], str):
            names, self._own = named(settings["planners"], {}, is_run=False)
            settings = {**settings, "planners": names}
        file = None if path is None else os.fspath(path)
        self._core = _palpate.Experiment.load(file, assignments(settings), os.fspath(HOME))

    @classmethod
    def load(cls, path: str | os.PathLike[str], **settings: Any) -> Experiment:
        """Loads an experiment file, or an experiment of the package by its name (`"toy"`).

        Args:
            path: path of the file, or name.
            settings: any setting of `docs/reference.md`, in the form of the program's `--set`: `touches=30`,
                `gp__noise=[0.01, 1]` or `**{"gp.noise": [0.01, 1]}`; paths are relative to the working folder.

        Raises:
            ConfigError: if a setting is invalid; with file, line, key, value and allowed values.
        """
        experiment = cls.__new__(cls)
        experiment._load(find_file(path, "experiments"), settings)
        return experiment

    @classmethod
    def _of(cls, core: _palpate.Experiment) -> Experiment:
        experiment = cls.__new__(cls)
        experiment._own, experiment._core = {}, core
        return experiment

    @property
    def name(self) -> str:
        """Name of the experiment."""
        return self._core.name

    @property
    def question(self) -> str:
        """Question that the experiment answers."""
        return self._core.question

    @property
    def planners(self) -> list[str]:
        """Names of the compared planners."""
        return self._core.planners

    @property
    def trials(self) -> int:
        """Trials per planner."""
        return self._core.trials

    @property
    def touches(self) -> int:
        """Touches per trial, initial ones included."""
        return self._core.touches

    @property
    def initial_touches(self) -> int:
        """Initial random touches of a trial, the same for every planner."""
        return self._core.initial_touches

    @property
    def seed(self) -> int:
        """Seed of all random numbers."""
        return self._core.seed

    @property
    def zone(self) -> Zone:
        """Explored zone; AttributeError around an object."""
        return self._core.zone

    def to_toml(self) -> str:
        """Returns all settings, including defaults, as TOML."""
        return self._core.to_toml()

    def run(
        self,
        planners: Sequence[Any] | Mapping[str, Any] | None = None,
        trials: int | None = None,
        *,
        out: str | os.PathLike[str] | None = None,
        fresh: bool = False,
        threads: int = 0,
        progress: bool | None = None,
        limit_s: float | None = LIMIT_S,
        isolate: bool = False,
        on_error: str = "record",
        executor: Executor | None = None,
        trials_per_job: int = 1,
    ) -> Run:
        """Runs the missing trials.

        Your own planner is a class with `plan(belief) -> target`. It runs in the same trials as the built-in planners,
        under the name `MODULE:CLASS`. Its constructor may have the parameters `zone` (not around an object), `rng`
        (a seeded numpy generator) and `seed`. If it raises an exception, returns an invalid target or exceeds the time
        limit, its trial fails with the reason, and the run continues.

        A planner may also be a function or a `functools.partial` that returns such an object, or the object itself,
        of which each trial gets a copy. Names contain the arguments of a partial, as in `MODULE:CLASS(margin=0.1)`.
        A pair `("NAME", planner)` is named `MODULE:NAME`.

        Args:
            planners: names of built-in planners (`palpate.PLANNERS`), planners, pairs, or `"MODULE:CLASS"`; or a
                mapping from names to planners; default: the experiment's planners.
            trials: trials per planner; default: the experiment's number.
            out: folder of the run, whose existing trials are kept; by default the run is kept in memory.
            fresh: delete the existing trials.
            threads: number of threads, 0 for all cores; with an executor the threads of each job, 0 for one. Results
                do not depend on it.
            progress: show the progress; by default in a notebook, and if stderr is a terminal.
            limit_s: time limit for a target of your own planners, seconds; None means no limit, which also avoids the
                overhead of a thread.
            isolate: run each of your own planners in its own process, which can be killed; they must be picklable.
            on_error: "record" stores an error of your own planner as the reason of its failed trial, continues, and
                warns at the end; "raise" stops the run and raises PlannerError with the traceback, from the planner's
                exception unless it ran in another process.
            executor: runs the trials elsewhere: a `concurrent.futures.Executor`, Dask's `Client`, an executor of
                submitit. Its workers need the same version of Palpate and the same files.
            trials_per_job: number of trials in a job of the executor; raise it if a job takes long to start.

        Raises:
            PalpateError: if jobs of the executor were lost; with `out` the other trials are kept.
            PlannerError: if a planner is invalid; with on_error="raise", also at its first failed trial.
            TypeError: if `planners` is not a list.
            ValueError: if `limit_s` or `threads` is negative, or `trials_per_job` is below 1.
            KeyboardInterrupt: after Ctrl-C, when the running trials have finished; with `out` they are kept, and the
                same call continues.
            SimulationError: if the scene cannot be simulated.
            RunFolderError: if the folder contains other files.
        """
        if limit_s is not None and not 0 < limit_s < float("inf"):
            raise ValueError(f"limit_s = {limit_s}: allowed is above 0, or None for no limit")
        if on_error not in ("record", "raise"):
            raise ValueError(f'on_error = {on_error!r}: allowed are "record", "raise"')
        core, workers = self._prepared(planners, trials, threads, limit_s, isolate)

        folder = None if out is None else os.fspath(out)
        raises = on_error == "raise"
        with Progress(self.name, progress) as look:
            if executor is None:
                own, stop = list(workers.items()), partial(_stop, workers)
                try:
                    found = core.run(own, out=folder, fresh=fresh, threads=threads, raises=raises, look=look, stop=stop)
                except PlannerError as error:
                    causes = (it.error for it in workers.values() if isinstance(it, ThreadPlannerFactory))
                    raise error from next((cause for cause in causes if cause is not None), None)
            else:
                found = run_on(
                    core,
                    workers,
                    executor,
                    trials_per_job,
                    out=folder,
                    fresh=fresh,
                    threads=threads,
                    raises=raises,
                    look=look,
                )
        run = Run(found)
        rows: dict[str, Any] = run._core.trials()
        failed = [i for i, failure in enumerate(rows["failure"]) if failure is not None and rows["planner"][i] in workers]
        if failed:
            first = failed[0]
            count = "1 trial" if len(failed) == 1 else f"{len(failed)} trials"
            warnings.warn(
                f"{count} failed; the first, trial {rows['trial'][first]} of {rows['planner'][first]}: "
                f"{rows['failure'][first]}",
                RuntimeWarning,
                stacklevel=2,
            )
        return run

    def _check(
        self,
        baseline: str,
        planners: Sequence[Any] | Mapping[str, Any] | None,
        accept: str | None,
        tolerance: float,
        max_trials: int,
        threads: int,
        progress: bool | None,
    ) -> dict[str, Any]:
        core, workers = self._prepared(planners, max_trials, threads, LIMIT_S, False)

        with Progress(self.name, progress) as look:
            return core.check(
                list(workers.items()),
                baseline=baseline,
                accept=accept,
                tolerance=tolerance,
                threads=threads,
                is_partial=planners is not None,
                look=look,
                stop=partial(_stop, workers),
            )

    def _prepared(
        self,
        planners: Sequence[Any] | Mapping[str, Any] | None,
        trials: int | None,
        threads: int,
        limit_s: float | None,
        isolate: bool,
    ) -> tuple[_palpate.Experiment, dict[str, Any]]:
        """Returns the experiment with these planners and trials, and factories of the Python planners."""
        if threads < 0:
            raise ValueError(f"threads = {threads}: allowed is 0 (all cores) or more")
        names, own = named(self.planners if planners is None else planners, self._own)
        settings: dict[str, Any] = {"planners": names}
        if trials is not None:
            settings["trials"] = trials
        core = self._core.with_settings(assignments(settings))
        if isolate:
            from ._isolated import ProcessPlannerFactory

            return core, {name: ProcessPlannerFactory(it, limit_s) for name, it in own.items()}
        return core, {name: ThreadPlannerFactory(it, limit_s) for name, it in own.items()}

    def __repr__(self) -> str:
        return f"Experiment({self.name}: {self.trials} trials of {', '.join(self.planners)})"


def _stop(workers: dict[str, Any]) -> None:
    """Stops waiting for the planners of all factories."""
    for factory in workers.values():
        factory.stop()


def _name(scene: Any) -> str:
    """Returns the name of an experiment on a scene: that of its file, if it is a folder's name."""
    stem = Path(scene).stem if isinstance(scene, (str, os.PathLike)) else ""
    return stem if re.fullmatch(r"[A-Za-z0-9_][A-Za-z0-9_.-]{0,99}", stem) else "experiment"
