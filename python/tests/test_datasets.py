"""Tests of runs as files of other tools."""

import json
import sys

import numpy as np
import pandas as pd
import palpate
import pyarrow as pa
import pyarrow.parquet as pq
import pytest
from palpate import _datasets
from palpate.errors import PalpateError


@pytest.fixture(scope="module")
def toy():
    return palpate.Experiment.load("toy", touches=9).run(["active", "random"], trials=3)


@pytest.fixture(scope="module")
def strokes():
    scene = palpate.Scene.load("bird", touch={"stroke": {"longest_m": 0.02}})
    return palpate.Experiment(scene=scene, touches=7).run(["random_strokes"], trials=2)


@pytest.fixture(scope="module")
def around():
    settings = {"touches": 10, "initial_touches": 6, "gp.evaluate_every": 2}
    return palpate.Experiment.load("around", **settings).run(["random"], trials=1)


def test_parquet_files_are_the_data_frames(toy, tmp_path):
    toy.to_parquet(tmp_path / "new")
    frames = {"trials": toy.trials(), "touches": toy.touches(), "points": toy.points()}
    assert {file.stem for file in (tmp_path / "new").iterdir()} == set(frames)
    for name, frame in frames.items():
        file = tmp_path / f"new/{name}.parquet"
        pd.testing.assert_frame_equal(pd.read_parquet(file), frame)
        metadata = pq.read_schema(file).metadata
        assert metadata[b"palpate.settings"].decode() == toy.to_toml()
        assert metadata[b"palpate.version"].decode() == palpate.__version__
    assert "touches = 9" in toy.to_toml()


def test_without_pyarrow_the_error_says_what_to_install(toy, tmp_path, monkeypatch):
    monkeypatch.setitem(sys.modules, "pyarrow", None)
    for write in (toy.to_parquet, toy.to_lerobot):
        with pytest.raises(ImportError, match=r"pip install pyarrow"):
            write(tmp_path / "new")
    assert not (tmp_path / "new").exists()


def read(folder):
    """Reads a LeRobotDataset: its description, frames and episodes."""
    info = json.loads((folder / "meta/info.json").read_text())
    paths = sorted((folder / "data").glob("*/*.parquet"))
    frames = pa.concat_tables([pq.read_table(path) for path in paths])
    episodes = pq.read_table(folder / "meta/episodes/chunk-000/file-000.parquet").to_pandas()
    return info, frames, episodes


@pytest.mark.parametrize("frames_per_file", [100_000, 20])
def test_a_dataset_has_the_layout_of_lerobot(toy, tmp_path, monkeypatch, frames_per_file):
    # The layout of LeRobotDataset v3.0 as its reader expects it.
    monkeypatch.setattr(_datasets, "FRAMES_PER_FILE", frames_per_file)
    toy.to_lerobot(tmp_path / "set")
    info, frames, episodes = read(tmp_path / "set")
    assert info["codebase_version"] == "v3.0" and info["fps"] == 1
    assert (info["total_episodes"], info["total_frames"], info["total_tasks"]) == (6, 54, 2)
    assert info["splits"] == {"train": "0:6"}
    assert set(info["features"]) == set(frames.column_names)
    kinds = {"float32": pa.float32(), "int64": pa.int64(), "bool": pa.bool_()}
    for name, feature in info["features"].items():
        kind = kinds[feature["dtype"]]
        (size,) = feature["shape"]
        assert frames.schema.field(name).type == (kind if size == 1 else pa.list_(kind, size))
        assert feature["names"] is None or len(feature["names"]) == size
    for name, dtype in {"timestamp": "float32", "frame_index": "int64", "episode_index": "int64"}.items():
        assert info["features"][name] == {"dtype": dtype, "shape": [1], "names": None}
    assert frames["index"].to_pylist() == list(range(54))
    assert frames["frame_index"].to_pylist() == frames["timestamp"].to_pylist() == 6 * list(range(9))
    tasks = pd.read_parquet(tmp_path / "set/meta/tasks.parquet")
    assert tasks["task_index"].tolist() == [0, 1] and tasks.index.str.contains("active|random").all()
    for _, episode in episodes.iterrows():
        # The rows of an episode are a row group of its file.
        path = info["data_path"].format(chunk_index=episode["data/chunk_index"], file_index=episode["data/file_index"])
        part = pq.read_table(tmp_path / "set" / path).to_pandas().query(f"episode_index == {episode['episode_index']}")
        assert part["index"].tolist() == list(range(episode["dataset_from_index"], episode["dataset_to_index"]))
        assert len(part) == episode["length"] == 9
        assert tasks.index[part["task_index"].iloc[0]] == episode["tasks"][0]
    stats = json.loads((tmp_path / "set/meta/stats.json").read_text())
    rewards = frames["next.reward"].to_numpy()
    assert stats["next.reward"]["mean"] == [pytest.approx(rewards.astype(float).mean())]
    assert stats["next.reward"]["count"] == [54]
    assert all(len(stats[name]["q99"]) == feature["shape"][0] for name, feature in info["features"].items())
    assert episodes["stats/next.reward/max"][1][0] == pytest.approx(rewards[9:18].max())


def test_frames_have_the_touches(toy, tmp_path):
    toy.to_lerobot(tmp_path / "set")
    frames = read(tmp_path / "set")[1].to_pandas()
    touches = toy.touches()
    assert np.allclose(frames["action"], touches["target_x_m"])
    contact = np.stack(frames["next.contact"])
    assert np.allclose(contact[:, 0], touches["contact_x_m"].fillna(0.0))
    assert ((contact[:, 3] == 1.0) == (touches["outcome"] == "contact")).all()
    state = np.stack(frames["observation.state"])
    assert (state[1:9] == contact[:8]).all() and (state[9] == 0.0).all()
    assert frames["next.done"].tolist() == 6 * (8 * [False] + [True])
    # Rewards add up to the decrease of the log error since the first fit.
    for (_, one), (_, rewards) in zip(touches.groupby(touches.index // 9), frames.groupby("episode_index")):
        errors = one["rmse_m"].dropna()
        assert rewards["next.reward"].sum() == pytest.approx(np.log(errors.iloc[0] / errors.iloc[-1]), abs=1e-5)
    text = (tmp_path / "set/meta/palpate.toml").read_text()
    assert text.endswith(toy.to_toml())


def test_whole_objects_and_rare_evaluations(around, tmp_path):
    around.to_lerobot(tmp_path / "set")
    info, frames, _ = read(tmp_path / "set")
    assert info["features"]["action"]["names"][3:] == ["ahead_x", "ahead_y", "ahead_z"]
    errors = around.touches()["chamfer_m"].dropna()
    assert len(errors) < 5
    assert sum(frames["next.reward"].to_pylist()) == pytest.approx(np.log(errors.iloc[0] / errors.iloc[-1]), abs=1e-5)
    around.to_parquet(tmp_path / "tables")
    pd.testing.assert_frame_equal(pd.read_parquet(tmp_path / "tables/touches.parquet"), around.touches())


def test_points_are_those_of_each_touch(strokes):
    touches, points = strokes.touches(), strokes.points()
    key = ["trial", "planner", "touch"]
    count = points.groupby(key).size().reindex(pd.MultiIndex.from_frame(touches[key]), fill_value=0)
    assert count.tolist() == touches["points"].tolist() and count.max() > 10
    first = points[points["point"] == 0].merge(touches, on=key, suffixes=("", "_contact"))
    for axis in "xyz":
        assert (first[f"{axis}_m"] == first[f"contact_{axis}_m"]).all()
        assert (first[f"normal_{axis}"] == first[f"normal_{axis}_contact"]).all()
    # A stroke is followed to its end, or up to a wall.
    last = points.groupby(key).last().join(touches.set_index(key)[["end_x_m", "end_z_m"]]).dropna()
    assert (np.hypot(last["x_m"] - last["end_x_m"], last["z_m"] - last["end_z_m"]) < 0.01).mean() > 0.5


def test_the_tip_rests_on_the_contact(strokes):
    touches = strokes.touches()
    contact = touches[["contact_x_m", "contact_y_m", "contact_z_m"]].to_numpy()
    away_m = np.linalg.norm(touches[["tip_x_m", "tip_y_m", "tip_z_m"]].to_numpy() - contact, axis=1)
    away_m = away_m[(touches["outcome"] == "contact").to_numpy()]
    radius_m = float(strokes.to_toml().split("[scene.finger]")[1].split("radius_m = ")[1].split()[0])
    # A contact beside the hemisphere is farther from its centre.
    assert (away_m > radius_m - 1e-9).all() and (away_m < radius_m + 1e-9).mean() > 0.5
    turn = touches[["tip_qx", "tip_qy", "tip_qz", "tip_qw"]].to_numpy()
    assert np.allclose(np.linalg.norm(turn, axis=1), 1.0)


def test_frames_have_points_and_tips(strokes, tmp_path):
    strokes.to_lerobot(tmp_path / "set")
    info, frames, _ = read(tmp_path / "set")
    touches, points = strokes.touches(), strokes.points()
    most = int(touches["points"].max())
    assert info["features"]["next.points"]["shape"] == [3 * most]
    assert info["features"]["next.tip"]["names"][0] == "tip_x_m"
    table = frames.to_pandas()
    assert table["next.point_count"].tolist() == touches["points"].tolist()
    found = np.stack(table["next.points"]).reshape(-1, most, 3)
    has_point = np.arange(most) < touches["points"].to_numpy()[:, None]
    assert np.allclose(found[has_point], points[["x_m", "y_m", "z_m"]]) and (found[~has_point] == 0).all()
    assert np.allclose(np.stack(table["next.tip"])[:, 1], touches["tip_y_m"], atol=1e-6)
    normals = touches[["normal_x", "normal_y", "normal_z"]].fillna(0)
    assert np.allclose(np.stack(table["next.normal"]), normals, atol=1e-6)


def test_strokes_around_an_object_have_ways():
    scene = palpate.Scene.load("bird_around", touch={"stroke": {"longest_m": 0.02}})
    settings = {"touches": 10, "initial_touches": 6}
    touches = palpate.Experiment(scene=scene, **settings).run(["random_strokes"], trials=1).touches()
    way = touches[["way_x_m", "way_y_m", "way_z_m"]].dropna().to_numpy()
    ahead = touches.loc[touches["way_x_m"].notna(), ["ahead_x", "ahead_y", "ahead_z"]].to_numpy()
    assert np.allclose(np.linalg.norm(way, axis=1), 0.02) and np.allclose((way * ahead).sum(axis=1), 0, atol=1e-9)


def test_a_folder_with_files_is_kept(toy, tmp_path):
    (tmp_path / "mine").touch()
    with pytest.raises(PalpateError, match="not empty"):
        toy.to_lerobot(tmp_path)
    assert [path.name for path in tmp_path.iterdir()] == ["mine"]
