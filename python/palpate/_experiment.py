"""What is run, from its file to its trials."""

from __future__ import annotations

import os
from collections.abc import Sequence
from pathlib import Path
from typing import Any

from . import _palpate
from ._home import found
from ._palpate import Zone
from ._planners import LIMIT_S, Factory, Workers, by_name, name_of
from ._progress import Progress
from ._run import Run
from ._settings import assignments

__all__ = ["Experiment"]


class Experiment:
    """Planners and trials on one scene."""

    def __init__(self, path: Path, settings: dict[str, Any]) -> None:
        self._path = path
        self._settings = settings
        self._core = _palpate.Experiment.load(os.fspath(path), assignments(settings))

    @classmethod
    def load(cls, path: str | os.PathLike[str], **settings: Any) -> Experiment:
        """Reads an experiment file, or one that comes with the package by its name (`"toy"`).

        Args:
            path: the file, or the name.
            settings: any setting of `docs/reference.md`, as the program's `--set` takes them: `touches=30`,
                `gp__noise=[0.01, 1]` or `**{"gp.noise": [0.01, 1]}`.

        Raises:
            ConfigError: with file, line, key, value and what is allowed.
        """
        return cls(found(path, "experiments"), settings)

    @property
    def name(self) -> str:
        """Its name."""
        return self._core.name

    @property
    def question(self) -> str:
        """What it asks."""
        return self._core.question

    @property
    def planners(self) -> list[str]:
        """Names of the planners that it compares."""
        return self._core.planners

    @property
    def trials(self) -> int:
        """Trials of each planner."""
        return self._core.trials

    @property
    def touches(self) -> int:
        """Touches of a trial, the initial ones among them."""
        return self._core.touches

    @property
    def initial_touches(self) -> int:
        """Random touches that a trial begins with, the same for every planner."""
        return self._core.initial_touches

    @property
    def seed(self) -> int:
        """Root of all randomness."""
        return self._core.seed

    @property
    def zone(self) -> Zone:
        """What is explored; an AttributeError around an object."""
        return self._core.zone

    def to_toml(self) -> str:
        """Every setting, defaults written out."""
        return self._core.to_toml()

    def run(
        self,
        planners: Sequence[str | Factory] | None = None,
        trials: int | None = None,
        *,
        out: str | os.PathLike[str] | None = None,
        fresh: bool = False,
        threads: int = 0,
        progress: bool = False,
        limit_s: float | None = LIMIT_S,
        isolate: bool = False,
    ) -> Run:
        """Runs the trials that are not there yet.

        A planner of your own is a class with `plan(belief) -> target`; it runs in the same trials as the
        built-in ones, under the name `MODULE:CLASS`. What its constructor names of `zone`, `rng` (a seeded
        numpy generator) and `seed` it is given, around an object no zone. If it raises, returns what is no target in the zone or does
        not return in time, its trial fails with the reason, and the run goes on.

        Args:
            planners: names of built-in planners (`palpate.PLANNERS`), classes, or `"MODULE:CLASS"`; the
                experiment's own if left out.
            trials: of each planner; the experiment's own number if left out.
            out: folder to keep the run in, and to go on with what is there; kept in memory if left out.
            fresh: throw away what is there.
            threads: 0 means all cores; results do not depend on it.
            progress: say on standard error how far it is.
            limit_s: seconds that a planner of your own may take for a target; None means for ever, and saves
                the hand-over to a thread that could be left behind.
            isolate: run each planner of your own in a process of its own, which can be killed.

        Raises:
            PlannerError: of a planner that is none; what else it does wrong fails its trials.
            TypeError: if `planners` is not a list.
            ValueError: if `limit_s` or `threads` is negative.
            KeyboardInterrupt: after Ctrl-C, when the trials in hand are done; with `out` they are kept, and
                the same call goes on.
            SimulationError: if the scene cannot be simulated.
            RunFolderError: if the folder holds something else.
        """
        if isinstance(planners, (str, type)):
            raise TypeError(f"planners = {planners!r}: allowed is a list of them, [{planners!r}]")
        if threads < 0:
            raise ValueError(f"threads = {threads}: allowed is 0, all cores, or more")
        if limit_s is not None and not 0 < limit_s < float("inf"):
            raise ValueError(f"limit_s = {limit_s}: allowed is above 0, or None for ever")
        own: dict[str, Factory] = {}
        names = []
        for planner in self.planners if planners is None else planners:
            name = planner if isinstance(planner, str) else name_of(planner)
            names.append(name)
            if not isinstance(planner, str):
                own[name] = planner
            elif ":" in name:
                own[name] = by_name(name)
        settings = dict(self._settings, planners=names)
        if trials is not None:
            settings["trials"] = trials
        core = _palpate.Experiment.load(os.fspath(self._path), assignments(settings))
        if isolate:
            from ._isolated import Isolated

            workers: dict[str, Any] = {name: Isolated(it, limit_s) for name, it in own.items()}
        else:
            workers = {name: Workers(it, limit_s) for name, it in own.items()}

        def stop() -> None:
            for started in workers.values():
                started.stop()

        look = Progress(self.name, progress)
        folder = None if out is None else os.fspath(out)
        return Run(core.run(list(workers.items()), (folder, fresh, threads), (look, stop)))

    def __repr__(self) -> str:
        return f"Experiment({self.name}: {self.trials} trials of {', '.join(self.planners)})"
