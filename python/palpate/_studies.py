"""Studies: accuracy of a scene, calibration of the band, identification of an object."""

from __future__ import annotations

import json
import os
from pathlib import Path
from typing import Any

from . import _palpate
from ._home import HOME, find_file
from ._progress import Progress
from ._settings import assignments

__all__ = ["accuracy", "calibrate_band", "identify"]


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
    progress: bool = False,
    **settings: Any,
) -> dict[str, Any]:
    """Measures error and time of a scene's levels and effects, as the command `palpate accuracy` does.

        found = palpate.accuracy("bird_finger", against="scene", tolerance="0.2mm")
        pandas.json_normalize(found["effects"]["variants"])

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
        progress: print progress to stderr.
        settings: settings of the scene, as for `Scene.load`.

    Returns:
        `scene`; `levels` and `effects`, each None or with a `reference` and its `variants`, a dict each; `orders` of
        convergence; `cheapest`, None or with `selected`, `held_out`, `is_confirmed` and the `scene` as TOML.

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
    found = _palpate.accuracy(
        os.fspath(path),
        assignments(settings),
        against=against,
        tolerance=tolerance,
        counts=counts,
        is_full=full,
        look=Progress(path.stem, progress, "variants"),
        stop=_ignore,
    )
    return _decoded(found)


def calibrate_band(
    experiment: str | os.PathLike[str],
    *,
    test: bool = False,
    trials: int = 4,
    progress: bool = False,
    **settings: Any,
) -> dict[str, Any]:
    """Learns the 95 % band from objects of known shape, as the command `palpate calibrate --band` does.

        found = palpate.calibrate_band("suite/choosing", touches=60)
        palpate.Experiment(scene="bird", gp={"band": found["band"]})
        pandas.DataFrame(found["coverage"])

    Args:
        experiment: file of an experiment over zones, best with a sweep of scenes, or the name of one of the package.
        test: test the experiment's own band instead of learning one.
        trials: trials per planner and object.
        progress: print progress to stderr.
        settings: settings of the experiment, as for `Experiment.load`.

    Returns:
        `band`, the table `gp.band` of an experiment, or None if it was tested; `coverage`, a dict for each object and
        number of touches, by a band that was learned without the object.

    Raises:
        ConfigError: if a setting is invalid.
        PalpateError: if the experiment has too few objects, no touches after a fit, or no band to test.
        ValueError: if `trials` is out of range.
    """
    path = find_file(experiment, "experiments")
    _within("trials", trials, 1, 1000)
    look = Progress(path.stem, progress, "touches")
    sets = assignments(settings)
    return _decoded(
        _palpate.calibrate_band(os.fspath(path), sets, trials=trials, is_test=test, look=look, stop=_ignore)
    )


def identify(
    library: str | os.PathLike[str],
    scene: str | os.PathLike[str],
    *,
    planner: str = "object_information",
    sure: float = 0.95,
    touches: int = 30,
    trial: int = 0,
    progress: bool = False,
    **settings: Any,
) -> dict[str, Any]:
    """Identifies an object of a library, and its pose, by touch in simulation, as `palpate identify` does.

        found = palpate.identify("models/lookalikes", "lookalikes")
        pandas.DataFrame(found["history"])

    Args:
        library: folder with the meshes of the objects that may be there, here or of the package.
        scene: file of a scene with a table [pose], or of an experiment, or the name of a scene of the package.
        planner: planner of the touches.
        sure: probability at which the object counts as identified, 0.5 to below 1.
        touches: largest number of touches.
        trial: trial number, which draws object and pose.
        progress: print progress to stderr.
        settings: settings of the scene or experiment, as for `Scene.load`.

    Returns:
        `object` ("none" for none of the library), `confidence`, `is_sure`, `touches`, `pose`, `probabilities`, in a
        simulated scene `error`, and `history`, the probabilities after each touch.

    Raises:
        ConfigError: if a setting is invalid.
        PalpateError: if the library is not a folder, or no touch was made.
        SimulationError: if the scene cannot be simulated.
        ValueError: if an argument is out of range.
    """
    if not 0.5 <= sure < 1:
        raise ValueError(f"sure = {sure}: allowed is 0.5 to below 1")
    path, folder = find_file(scene, "scenes"), Path(library)
    if not folder.is_dir() and (HOME / folder).is_dir():
        folder = HOME / folder
    found = _palpate.identify(
        os.fspath(folder),
        os.fspath(path),
        assignments(settings),
        planner=planner,
        sure=sure,
        touches=_within("touches", touches, 1, 500),
        trial=_within("trial", trial, 0, 2**32 - 2),
        look=Progress(path.stem, progress, "touches"),
        stop=_ignore,
    )
    return _decoded(found)


def _decoded(text: str) -> dict[str, Any]:
    found: dict[str, Any] = json.loads(text)
    return found


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
