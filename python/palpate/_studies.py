"""Studies: accuracy of a scene, calibration of the band, identification of an object, benchmark, comparison of runs."""

from __future__ import annotations

import json
import os
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

import numpy as np

from . import _palpate
from ._executor import Executor
from ._experiment import Experiment
from ._home import HOME, find_file
from ._planners import LIMIT_S
from ._progress import Progress
from ._results import AccuracyResult, BandResult, BenchmarkResult, FitResult, IdentifyResult, SuiteComparison
from ._run import Run
from ._settings import assignments

__all__ = ["accuracy", "benchmark", "calibrate_band", "compare", "fit", "identify"]


def accuracy(
    scene: str | os.PathLike[str],
    *,
    against: str | None = None,
    tolerance: str | None = None,
    touches: int | None = None,
    trials: int | None = None,
    held_out: int | None = None,
    pairs: int = 200,
    trial_touches: int = 30,
    seed: int = 0,
    full: bool = False,
    progress: bool | None = None,
    **settings: Any,
) -> AccuracyResult:
    """Measures error and time of a scene's levels and effects, as the command `palpate accuracy` does.

        found = palpate.accuracy("bird_finger", against="scene", tolerance="0.2mm")
        found.table().query("study == 'effects'")

    Args:
        scene: a scene's file, or the name of a scene of the package.
        against: reference of the errors: "scene" (effects), "reference" (finest level) or "truth" (levels); default:
            levels and effects.
        tolerance: "0.2mm", "0.1N", "20counts" or "verdict", for the cheapest scene within it.
        touches: touches per variant; default: 24 per level, 120 per effect.
        trials: trials per planner and effect; default: 10, with a tolerance 0, with "verdict" 40.
        held_out: held-out targets or trials that test the cheapest scene; default: 200 targets for effects.
        pairs: paired touches for the timing of each effect.
        trial_touches: touches per trial.
        seed: seed of the targets.
        full: start from the scene with every effect that its simulator supports.
        progress: as for `Experiment.run`.
        settings: settings of the scene, as for `Scene.load`.

    Raises:
        ConfigError: if a setting is invalid.
        PalpateError: if the scene does not allow the study.
        ValueError: if an argument is out of range.
    """
    counts = (
        _within("touches", touches, 2, 1000),
        _within("trials", trials, 0, 65535),
        _within("held_out", held_out, 1, 10000),
        _within("pairs", pairs, 1, 10000),
        _within("trial_touches", trial_touches, 1, 500),
        _within("seed", seed, 0, 65535),
    )
    path = find_file(scene, "scenes")
    with Progress(path.stem, progress, "variants") as look:
        found = _palpate.accuracy(
            os.fspath(path),
            assignments(settings),
            against=against,
            tolerance=tolerance,
            counts=counts,
            is_full=full,
            look=look,
            stop=_ignore,
        )
    return AccuracyResult._of(json.loads(found))


def calibrate_band(
    experiment: str | os.PathLike[str],
    *,
    test: bool = False,
    trials: int = 4,
    progress: bool | None = None,
    **settings: Any,
) -> BandResult:
    """Learns the 95 % band from objects of known shape, as the command `palpate calibrate --band` does.

        found = palpate.calibrate_band("suite/choosing", touches=60)
        palpate.Experiment(scene="bird", gp={"band": found.band})
        found.table()

    Args:
        experiment: file of an experiment over zones, best with a sweep of scenes, or the name of one of the package.
        test: test the experiment's own band instead of learning one.
        trials: trials per planner and object.
        progress: as for `Experiment.run`.
        settings: settings of the experiment, as for `Experiment.load`.

    Raises:
        ConfigError: if a setting is invalid.
        PalpateError: if the experiment has too few objects, no touches after a fit, or no band to test.
        ValueError: if `trials` is out of range.
    """
    path = find_file(experiment, "experiments")
    _within("trials", trials, 1, 1000)
    sets = assignments(settings)
    with Progress(path.stem, progress, "touches") as look:
        found = _palpate.calibrate_band(os.fspath(path), sets, trials=trials, is_test=test, look=look, stop=_ignore)
    return BandResult._of(json.loads(found))


def fit(
    contacts: str | os.PathLike[str] | Any,
    *,
    normals: Any = None,
    sd_m: Any = None,
    groups: Sequence[Any] | None = None,
    heights: str | None = None,
    progress: bool | None = None,
) -> FitResult:
    """Fits a surface to contacts, as the command `palpate fit` does; no scene and no robot are needed.

        found = palpate.fit("contacts.csv")
        found = palpate.fit(points, groups=grasps)
        found.rms_m, found.belief.mesh()

    Args:
        contacts: file (.csv, .parquet), or points (n, 3), metres.
        normals: with points, their normals (n, 3) from the surface towards the finger.
        sd_m: with points, the standard deviation of each or of all, metres. They weigh the contacts against each other:
            their common scale is learned.
        groups: with points, the grasp, posture of the arm or session of each: its contacts have an error in common.
        heights: fit heights along this axis ("x", "y", "z", "-x", "-y" or "-z") instead of a closed surface. The belief's
            places are those of its zone: `belief.zone.from_world(points)` returns the places and heights of points.
        progress: as for `Experiment.run`.

    Raises:
        PalpateError: if the file is wrong, with its line and column, or the contacts are too few.
        ValueError: if an argument is wrong.
    """
    with Progress("fit", progress, "groups") as look:
        source = _contacts(contacts, normals, sd_m, groups)
        belief, found = _palpate.fit(source, heights=heights, look=look, stop=_ignore)
    return FitResult._of(belief, json.loads(found))


def _contacts(contacts: Any, normals: Any = None, sd_m: Any = None, groups: Any = None) -> Any:
    """Returns a file's path, or points with normals, standard deviations and groups, as the library takes them."""
    if isinstance(contacts, (str, os.PathLike)):
        if any(part is not None for part in (normals, sd_m, groups)):
            raise ValueError("normals, sd_m and groups: allowed with points only; a file has columns of them")
        return os.fspath(contacts)
    numbers = [None if part is None else np.asarray(part, float) for part in (contacts, normals, sd_m)]
    for name, part, shape in zip(("contacts", "normals"), numbers[:2], ("(n, 3)",) * 2, strict=True):
        if part is not None and (part.ndim != 2 or part.shape[1] != 3):
            raise ValueError(f"{name} has shape {part.shape}; allowed is {shape}")
    if numbers[0] is not None and numbers[2] is not None and numbers[2].ndim == 0:
        numbers[2] = np.broadcast_to(numbers[2], len(numbers[0]))
    names = None if groups is None else [str(group) for group in groups]
    points, normals, sd_m = (None if part is None else part.tolist() for part in numbers)
    return points, normals, sd_m, names


def identify(
    library: str | os.PathLike[str],
    scene: str | os.PathLike[str] | None = None,
    *,
    contacts: str | os.PathLike[str] | Any = None,
    unit: str = "m",
    offset_max_m: float = 0.008,
    planner: str = "object_information",
    sure: float = 0.95,
    touches: int = 30,
    trial: int = 0,
    progress: bool | None = None,
    **settings: Any,
) -> IdentifyResult:
    """Identifies an object of a library, and its pose, by touch in simulation or by contacts, as `palpate identify` does.

        found = palpate.identify("models/lookalikes", "lookalikes")
        found = palpate.identify("my-parts", contacts="contacts.csv", unit="mm")
        found.object, found.table()

    Args:
        library: folder with the meshes of the objects that may be there, here or of the package.
        scene: file of a scene with a table [pose], or of an experiment, or the name of a scene of the package.
        contacts: in place of a scene, contacts: a file (.csv, .parquet), or points (n, 3), metres.
        unit: with contacts, the unit of the meshes: "m", "cm", "mm", "um" or "in".
        offset_max_m: with contacts, the largest distance by which all of them may lie outside of the surface, e.g. the
            radius of a fingertip whose middle they are; 0 if they are on the skin.
        planner: planner of the touches.
        sure: probability at which the object counts as identified, 0.5 to below 1.
        touches: largest number of touches.
        trial: trial number, which draws object and pose.
        progress: as for `Experiment.run`.
        settings: settings of the scene or experiment, as for `Scene.load`.

    Raises:
        ConfigError: if a setting is invalid.
        PalpateError: if the library is not a folder, or no touch was made.
        SimulationError: if the scene cannot be simulated.
        ValueError: if an argument is out of range.
    """
    if not 0.5 <= sure < 1:
        raise ValueError(f"sure = {sure}: allowed is 0.5 to below 1")
    folder = Path(library)
    if not folder.is_dir() and (HOME / folder).is_dir():
        folder = HOME / folder
    if contacts is not None:
        if scene is not None:
            raise ValueError("scene, contacts: allowed is one of them")
        if not 0 <= offset_max_m <= 0.1:
            raise ValueError(f"offset_max_m = {offset_max_m}: allowed is 0 to 0.1")
        source = _contacts(contacts)
        found = _palpate.identify_contacts(
            os.fspath(folder), source, unit=unit, offset_max_m=offset_max_m, sure=sure
        )
        return IdentifyResult._of(json.loads(found))
    if scene is None:
        raise ValueError("scene, contacts: one of them is needed")
    path = find_file(scene, "scenes")
    touches, trial = _within("touches", touches, 1, 500), _within("trial", trial, 0, 2**32 - 2)
    with Progress(path.stem, progress, "touches") as look:
        found = _palpate.identify(
            os.fspath(folder),
            os.fspath(path),
            assignments(settings),
            planner=planner,
            sure=sure,
            touches=touches,
            trial=trial,
            look=look,
            stop=_ignore,
        )
    return IdentifyResult._of(json.loads(found))


def benchmark(
    planners: Sequence[Any] | Mapping[str, Any] = (),
    *,
    protocol: str | os.PathLike[str] = _palpate.PROTOCOL,
    objects: str | os.PathLike[str] | None = None,
    quick: bool = False,
    out: str | os.PathLike[str] | None = None,
    fresh: bool = False,
    threads: int = 0,
    progress: bool | None = None,
    limit_s: float | None = LIMIT_S,
    isolate: bool = False,
    executor: Executor | None = None,
    trials_per_job: int = 1,
) -> BenchmarkResult:
    """Compares planners by a fixed protocol of objects, touches, trials and seeds, as `palpate benchmark` does.

        found = palpate.benchmark(["my_planner:MyPlanner"], quick=True)
        found.table()

    Args:
        planners: planners beside those of the protocol, as for `Experiment.run`.
        protocol: file, or name of one in experiments/suite.
        objects: folder of the meshes that a protocol with `[objects]` lists.
        quick: run a part only, as `palpate benchmark --quick`, to try out a planner; the result is not comparable.
        out: folder of the runs, one per object, whose existing trials are kept; by default they are kept in memory.
        fresh, threads, progress, limit_s, isolate, executor, trials_per_job: as for `Experiment.run`.

    Raises:
        PlannerError, TypeError, ValueError, RunFolderError: as for `Experiment.run`.
        KeyboardInterrupt: after Ctrl-C, when the running trials have finished; with `out` they are kept, and the same
            call continues.
    """
    path = os.fspath(find_file(protocol, "experiments/suite"))
    runs = []
    for core in _palpate.benchmark_experiments(path, objects, quick):
        experiment = Experiment._of(core)
        run = experiment.run(
            _beside(experiment.planners, planners),
            out=None if out is None else Path(out, experiment.name),
            fresh=fresh,
            threads=threads,
            progress=progress,
            limit_s=limit_s,
            isolate=isolate,
            executor=executor,
            trials_per_job=trials_per_job,
        )
        runs.append(run._core)
    return BenchmarkResult._of(json.loads(_palpate.benchmark(path, quick, runs)))


def _beside(own: list[str], planners: Sequence[Any] | Mapping[str, Any]) -> list[Any]:
    """Returns the planners of an experiment, and those of `planners` that it does not name.

    Raises:
        TypeError: if `planners` is not a list or a mapping.
    """
    if isinstance(planners, (str, type)) or not isinstance(planners, (Sequence, Mapping)):
        raise TypeError(f"planners = {planners!r}: allowed is a list, [{planners!r}]")
    more = planners.items() if isinstance(planners, Mapping) else planners
    return [*own, *(planner for planner in more if not (isinstance(planner, str) and planner in own))]


def compare(
    runs: Sequence[Run | str | os.PathLike[str]] | Mapping[str, Run | str | os.PathLike[str]],
    *,
    against: str = "random",
) -> SuiteComparison:
    """Compares the planners of several runs, as the command `palpate compare` does.

        palpate.compare(["runs/toy", "runs/bird"]).table()
        palpate.compare({"before": old_run, "after": new_run}).conclusion

    Runs of experiments with different names are runs on different objects. Runs of one experiment are compared with
    each other; their names tell them apart.

    Args:
        runs: runs, or folders of runs; or a mapping from names to them.
        against: reference planner; errors are divided by its errors.

    Raises:
        PalpateError: if the reference planner has no trials of an object, or runs of one experiment do not pair.
        RunFolderError: if a folder is not a run's, or damaged.
        TypeError: if `runs` is not a list or a mapping.
        ValueError: if there is no run, or runs of one experiment have the same name.
    """
    if isinstance(runs, (str, os.PathLike, Run)) or not isinstance(runs, (Sequence, Mapping)):
        raise TypeError(f"runs = {runs!r}: allowed is a list, [{runs!r}]")
    if not runs:
        raise ValueError("runs = []: allowed is at least one run")
    each = runs.items() if isinstance(runs, Mapping) else ((_run_name(run), run) for run in runs)
    opened = [(name, run if isinstance(run, Run) else Run.open(run)) for name, run in each]
    seen: set[tuple[str, str]] = set()
    for name, run in opened:
        if (name, run.name) in seen:
            raise ValueError(f'two runs of {run.name} have the name {name}: allowed is a mapping, {{"NAME": run, ...}}')
        seen.add((name, run.name))
    found = _palpate.compare([(name, run._core) for name, run in opened], against)
    return SuiteComparison._of(json.loads(found))


def _run_name(run: Run | str | os.PathLike[str]) -> str:
    return run.name if isinstance(run, Run) else os.fspath(run)


def _ignore() -> None:
    """Has nothing to stop: these studies run no Python planner."""


def _within(name: str, value: Any, least: int, most: int) -> Any:
    """Returns a number in its range, or None.

    Raises:
        ValueError: if it is out of range.
    """
    if value is not None and not least <= value <= most:
        raise ValueError(f"{name} = {value}: allowed are {least} to {most}")
    return value
