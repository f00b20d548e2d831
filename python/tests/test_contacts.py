"""Tests of contacts from arrays and files: fits, beliefs, and objects of a library."""

import math
from pathlib import Path

import numpy as np
import pytest

import palpate
from palpate import errors


def ellipsoid(count: int) -> np.ndarray:
    """Returns points spread over an ellipsoid, metres."""
    i = np.arange(count)
    z = 1 - (2 * i + 1) / count
    angle = math.pi * (1 + math.sqrt(5)) * i
    r = np.sqrt(1 - z * z)
    return np.stack([0.06 * r * np.cos(angle), 0.04 * r * np.sin(angle), 0.03 * z], axis=1)


def test_a_surface_is_fitted_to_points() -> None:
    points = ellipsoid(60)
    found = palpate.fit(points, groups=np.arange(60) // 3)
    assert found.rms_m is not None and found.rms_m < 2e-3
    assert found.coverage is not None and found.coverage > 0.9
    table = found.table()
    assert len(table) == 60 and {"group", "distance_m", "in_band"} <= set(table.columns)
    vertices, triangles, sds = found.belief.mesh()
    assert len(vertices) == len(sds) and len(triangles) > 100
    assert "60 contacts fitted" in str(found)


def test_a_file_gives_the_same(tmp_path: Path) -> None:
    points = ellipsoid(60)
    rows = [f"{i // 3},{x},{y},{z}" for i, (x, y, z) in enumerate(points.tolist())]
    path = tmp_path / "contacts.csv"
    path.write_text("\n".join(["group,x_m,y_m,z_m", *rows]))
    of_file, of_points = palpate.fit(path), palpate.fit(points, groups=np.arange(60) // 3)
    assert of_file.rms_m == of_points.rms_m


def test_a_parquet_file_gives_the_same(tmp_path: Path) -> None:
    pandas = pytest.importorskip("pandas")
    pytest.importorskip("pyarrow")
    points = ellipsoid(60)
    table = pandas.DataFrame(points, columns=["x_m", "y_m", "z_m"])
    table["group"] = np.arange(60) // 3
    of_points = palpate.fit(points, groups=np.arange(60) // 3)
    for compression in ("snappy", "zstd", None):
        path = tmp_path / f"contacts-{compression}.parquet"
        table.to_parquet(path, compression=compression)
        assert palpate.fit(path).rms_m == of_points.rms_m


def test_a_belief_takes_contacts() -> None:
    points = ellipsoid(60)
    belief = palpate.fit(points[:40]).belief
    after = belief.add(points[40:], groups=["late"] * 20)
    mean, sd = after.field(points[40:])
    before, _ = belief.field(points[40:])
    assert np.abs(mean).max() < np.abs(before).max() and np.isfinite(sd).all()


def test_objects_are_identified_by_points() -> None:
    found = palpate.identify("models/lookalikes", contacts=ellipsoid(30))
    assert found.touches == 30 and abs(sum(found.probabilities.values()) - 1) < 1e-9
    assert found.object in found.probabilities


def test_a_stated_deviation_counts_in_the_prediction_of_its_contact() -> None:
    random = np.random.default_rng(4)
    points = ellipsoid(80) + random.normal(0.0, 4e-4, (80, 3))
    stated = palpate.fit(points, sd_m=4e-4)
    assert stated.sd_factor < 1.5, "not a factor for what contacts state themselves"
    rough = np.where(np.arange(80) % 2, 4e-3, 2e-4)
    table = palpate.fit(ellipsoid(80) + random.normal(0.0, 1.0, (80, 3)) * rough[:, None], sd_m=rough).table()
    is_rough = rough[table.group.astype(int) - 1] > 1e-3
    assert table.sd_m[is_rough].median() > 3 * table.sd_m[~is_rough].median()
    assert table.distance_m[is_rough].median() > 3 * table.distance_m[~is_rough].median()


def test_heights_have_places_of_their_zone() -> None:
    x, y = (axis.ravel() for axis in np.meshgrid(np.linspace(0, 0.1, 9), np.linspace(-0.05, 0.05, 9)))
    points = np.stack([x, y, 0.3 + 0.2 * x + 0.1 * y], axis=1)
    belief = palpate.fit(points, heights="z").belief
    places, heights_m = belief.zone.from_world(points)
    np.testing.assert_allclose(belief.mean(places), heights_m, atol=2e-4)
    np.testing.assert_allclose(belief.zone.to_world(places, heights_m), points, atol=1e-12)
    again = palpate.Belief.from_json(belief.to_json())
    assert np.array_equal(again.mean(places), belief.mean(places))


def test_normals_that_point_inward_are_noticed() -> None:
    points = ellipsoid(40)
    normals = points / np.linalg.norm(points, axis=1)[:, None]
    assert "point inward" not in str(palpate.fit(points, normals=normals))
    assert "100 % of the normals point inward" in str(palpate.fit(points, normals=-normals))


def test_wrong_contacts_are_refused(tmp_path: Path) -> None:
    points = ellipsoid(10)
    with pytest.raises(ValueError, match="shape"):
        palpate.fit(points[:, :2])
    with pytest.raises(ValueError, match="groups has 3 rows; allowed are 10"):
        palpate.fit(points, groups=["a", "b", "c"])
    with pytest.raises(ValueError, match="heights = \"up\""):
        palpate.fit(points, heights="up")
    with pytest.raises(ValueError, match="up to 20 m from the origin"):
        palpate.fit(1000 * points)
    with pytest.raises(ValueError, match="0 rows"):
        palpate.fit(np.zeros((0, 3)))
    with pytest.raises(ValueError, match="finite"):
        palpate.fit(np.full((5, 3), np.nan))
    with pytest.raises(ValueError, match="allowed is one"):
        palpate.identify("models/lookalikes", "lookalikes", contacts=points)
    path = tmp_path / "wrong.csv"
    path.write_text("x,y,z\n0,b,0\n")
    with pytest.raises(errors.PalpateError, match="wrong.csv:2: column y"):
        palpate.fit(path)
