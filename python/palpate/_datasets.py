"""Runs as files of other tools: Parquet tables, and datasets of LeRobot."""

from __future__ import annotations

import json
import os
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np
import numpy.typing as npt

from ._palpate import __version__
from .errors import PalpateError

if TYPE_CHECKING:
    import pandas as pd

#: Version of the format that `to_lerobot` writes.
LEROBOT_VERSION = "v3.0"

#: Largest number of frames in a file of a LeRobotDataset.
# heuristic: a tenth of the format's default of 100 MB, and fast to read.
FRAMES_PER_FILE = 100_000

#: Files in a folder of a LeRobotDataset, its default.
FILES_PER_CHUNK = 1000

#: Features of a frame that a touch measures, and the beginning of their columns; absent without any.
MEASURED = {"next.normal": "normal_", "next.contact_sd": "contact_sd_", "next.tip": "tip_"}

#: Quantiles in the statistics of a LeRobotDataset.
QUANTILES = {"q01": 0.01, "q10": 0.1, "q50": 0.5, "q90": 0.9, "q99": 0.99}

_Columns = dict[str, npt.NDArray[Any]]


def _pyarrow() -> tuple[Any, Any]:
    try:
        import pyarrow
        import pyarrow.parquet
    except ImportError as error:
        raise ImportError(
            "Parquet files need pyarrow, which is not installed: pip install pyarrow, or palpate[data]"
        ) from error
    return pyarrow, pyarrow.parquet


def to_parquet(folder: str | os.PathLike[str], settings: str, frames: dict[str, pd.DataFrame]) -> None:
    """Writes the data frames of a run as Parquet, each to a file of its name."""
    arrow, parquet = _pyarrow()
    Path(folder).mkdir(parents=True, exist_ok=True)
    metadata = {"palpate.version": __version__, "palpate.settings": settings}
    for name, frame in frames.items():
        table = arrow.Table.from_pandas(frame, preserve_index=False)
        table = table.replace_schema_metadata({**(table.schema.metadata or {}), **metadata})
        parquet.write_table(table, Path(folder) / f"{name}.parquet")


def to_lerobot(
    folder: str | os.PathLike[str],
    experiment: str,
    planners: list[str],
    settings: str,
    trials: pd.DataFrame,
    touches: pd.DataFrame,
    points: pd.DataFrame,
) -> None:
    """Writes a run of `experiment` as a LeRobotDataset."""
    arrow, parquet = _pyarrow()
    root = Path(folder)
    if root.exists() and (not root.is_dir() or any(root.iterdir())):
        raise PalpateError(f"{root}: the folder is not empty; allowed is a new folder")
    trials = trials[trials["touches"] > 0].reset_index(drop=True)
    if trials.empty:
        raise PalpateError("no trial of the run has a touch; a dataset needs one")
    features, data = _frames(touches, points)
    tasks = [f"Explore {experiment} by touch: planner {planner}" for planner in planners]
    lengths = trials["touches"].to_numpy()
    ends = np.cumsum(lengths)
    starts = ends - lengths
    data["task_index"] = np.repeat([planners.index(planner) for planner in trials["planner"]], lengths)
    data["episode_index"] = np.repeat(np.arange(len(trials)), lengths)
    data["index"] = np.arange(len(data["episode_index"]))
    data["frame_index"] = data["index"] - np.repeat(starts, lengths)
    data["timestamp"] = data["frame_index"].astype(np.float32)
    for name in ("timestamp", "frame_index", "episode_index", "index", "task_index"):
        features[name] = {"dtype": str(data[name].dtype), "shape": [1], "names": None}

    # A file has whole episodes.
    files = starts // FRAMES_PER_FILE
    table = arrow.table({name: _array(arrow, values, features[name]["dtype"]) for name, values in data.items()})
    for file in np.unique(files):
        path = root / _file("data", int(file))
        path.parent.mkdir(parents=True, exist_ok=True)
        with parquet.ParquetWriter(path, table.schema) as writer:
            for episode in np.flatnonzero(files == file):
                # A row group per episode, so that readers can skip the others.
                writer.write_table(table.slice(starts[episode], lengths[episode]))

    episodes = {
        "episode_index": np.arange(len(trials)),
        "tasks": [[tasks[planners.index(planner)]] for planner in trials["planner"]],
        "length": lengths,
        "data/chunk_index": files // FILES_PER_CHUNK,
        "data/file_index": files % FILES_PER_CHUNK,
        "dataset_from_index": starts,
        "dataset_to_index": ends,
        "meta/episodes/chunk_index": np.zeros(len(trials), dtype=np.int64),
        "meta/episodes/file_index": np.zeros(len(trials), dtype=np.int64),
    }
    each = [
        _statistics({name: values[start:end] for name, values in data.items()}) for start, end in zip(starts, ends)
    ]
    for name in features:
        for statistic in each[0][name]:
            episodes[f"stats/{name}/{statistic}"] = [one[name][statistic] for one in each]
    path = root / _file("meta/episodes", 0)
    path.parent.mkdir(parents=True)
    parquet.write_table(arrow.table(episodes), path)

    import pandas as pd

    pd.DataFrame({"task_index": np.arange(len(tasks))}, index=pd.Index(tasks, name="task")).to_parquet(
        root / "meta/tasks.parquet"
    )
    (root / "meta/stats.json").write_text(json.dumps(_statistics(data), indent=4))
    info = {
        "codebase_version": LEROBOT_VERSION,
        "robot_type": "palpate",
        "total_episodes": len(trials),
        "total_frames": int(ends[-1]),
        "total_tasks": len(tasks),
        "chunks_size": FILES_PER_CHUNK,
        "data_files_size_in_mb": 100,
        "video_files_size_in_mb": 200,
        "fps": 1,
        "splits": {"train": f"0:{len(trials)}"},
        "data_path": "data/chunk-{chunk_index:03d}/file-{file_index:03d}.parquet",
        "video_path": None,
        "features": features,
    }
    (root / "meta/info.json").write_text(json.dumps(info, indent=4))
    (root / "meta/palpate.toml").write_text(f"# Palpate {__version__}\n{settings}")


def _file(folder: str, number: int) -> str:
    return f"{folder}/chunk-{number // FILES_PER_CHUNK:03d}/file-{number % FILES_PER_CHUNK:03d}.parquet"


def _array(arrow: Any, values: npt.NDArray[Any], dtype: str) -> Any:
    """Returns a column: numbers, also for vectors of one; longer vectors have a fixed size."""
    kind = {"bool": arrow.bool_(), "float32": arrow.float32(), "int64": arrow.int64()}[dtype]
    flat = arrow.array(values.ravel(), type=kind)
    return flat if len(flat) == len(values) else arrow.FixedSizeListArray.from_arrays(flat, values.shape[1])


def _frames(touches: pd.DataFrame, points: pd.DataFrame) -> tuple[dict[str, Any], _Columns]:
    """Returns the features of the frames, and their columns in the order of `touches`."""
    contact_names = ["contact_x_m", "contact_y_m", "contact_z_m"]
    target_names = [name for name in touches.columns if name.startswith(("target_", "ahead_"))]
    touched = (touches["outcome"] == "contact").to_numpy()
    contacts = np.nan_to_num(touches[contact_names].to_numpy())
    result = np.column_stack([contacts, touched]).astype(np.float32)
    is_first = (touches["touch"] == 1).to_numpy()
    is_last = np.append(is_first[1:], True)
    state = np.vstack([np.zeros((1, 4), np.float32), result[:-1]])
    state[is_first] = 0.0
    error = "chamfer_m" if "chamfer_m" in touches.columns else "rmse_m"
    if error in touches.columns:
        # Around an object only some touches are evaluated.
        known = touches.groupby(["trial", "planner"])[error].ffill().to_numpy()
        log_error = np.log(np.maximum(known, np.finfo(np.float64).tiny))
        gain = np.append(0.0, log_error[:-1] - log_error[1:])
        reward = np.where(is_first | np.isnan(gain), 0.0, gain)
    else:
        reward = np.zeros(len(touches))
    # A stroke ends elsewhere, a tap where it begins.
    action = touches[target_names]
    for end in [name for name in touches.columns if name in ("end_x_m", "end_z_m")]:
        action = action.assign(**{end: touches[end].fillna(touches[end.replace("end", "target")])})
    for way in [name for name in touches.columns if name.startswith("way_")]:
        action = action.assign(**{way: touches[way].fillna(0.0)})
    data: _Columns = {
        "observation.state": state,
        "action": action.to_numpy(dtype=np.float32),
        "next.contact": result,
        "next.reward": reward.astype(np.float32),
        "next.done": is_last,
    }
    contact = [*contact_names, "is_contact"]
    names = {"observation.state": contact, "action": list(action.columns), "next.contact": contact}
    for feature, start in MEASURED.items():
        found = [name for name in touches.columns if name.startswith(start)]
        if found:
            data[feature] = np.nan_to_num(touches[found].to_numpy(dtype=np.float32))
            names[feature] = found
    if (points["point"] > 0).any():
        data["next.points"], names["next.points"] = _points(touches, points)
        data["next.point_count"] = touches["points"].to_numpy()
    features = {
        name: {"dtype": str(values.dtype), "shape": list(values.shape[1:]) or [1], "names": names.get(name)}
        for name, values in data.items()
    }
    return features, data


def _points(touches: pd.DataFrame, points: pd.DataFrame) -> tuple[npt.NDArray[np.float32], list[str]]:
    """Returns the points of each touch, zeros after its last one, and the names of the numbers."""
    number = points["point"].to_numpy()
    # Points are in the order of the touches.
    row = np.repeat(np.arange(len(touches)), touches["points"])
    found = np.zeros((len(touches), int(number.max()) + 1, 3), np.float32)
    found[row, number] = points[["x_m", "y_m", "z_m"]].to_numpy()
    names = [f"point_{i}_{axis}_m" for i in range(found.shape[1]) for axis in "xyz"]
    return found.reshape(len(touches), -1), names


def _statistics(data: _Columns) -> dict[str, dict[str, list[float]]]:
    """Returns minimum, maximum, mean, standard deviation, quantiles and count of each feature."""
    found = {}
    for name, values in data.items():
        each = values.reshape(len(values), -1).astype(np.float64)
        quantiles = np.quantile(each, list(QUANTILES.values()), axis=0)
        found[name] = {
            "min": each.min(axis=0).tolist(),
            "max": each.max(axis=0).tolist(),
            "mean": each.mean(axis=0).tolist(),
            "std": each.std(axis=0).tolist(),
            "count": [len(each)],
            **{key: values.tolist() for key, values in zip(QUANTILES, quantiles)},
        }
    return found
