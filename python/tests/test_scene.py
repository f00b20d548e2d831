"""Tests of interactive scenes and of meshes as arrays."""

import numpy as np
import palpate
import pytest
from palpate.errors import ConfigError, SimulationError

SPHERE_M = np.array([0.0, -0.65, 0.5])
RADIUS_M = 0.05


def sphere(rings=60):
    """Returns the mesh of a sphere."""
    polar = np.linspace(0, np.pi, rings + 1)[1:-1]
    around = np.linspace(0, 2 * np.pi, 2 * rings, endpoint=False)
    grid = np.stack(np.meshgrid(polar, around, indexing="ij"), axis=-1).reshape(-1, 2)
    sine = np.sin(grid[:, 0])
    points = np.stack([sine * np.cos(grid[:, 1]), sine * np.sin(grid[:, 1]), np.cos(grid[:, 0])], axis=1)
    points = np.concatenate([points, [[0, 0, 1], [0, 0, -1]]])
    wide, last = 2 * rings, len(polar) - 1
    at = np.arange(wide)
    after = (at + 1) % wide
    triangles = [np.stack([np.full(wide, len(points) - 2), at, after], axis=1)]
    for ring in range(last):
        a, b, c, d = ring * wide + at, ring * wide + after, (ring + 1) * wide + at, (ring + 1) * wide + after
        triangles += [np.stack([a, c, b], axis=1), np.stack([b, c, d], axis=1)]
    bottom = last * wide
    triangles.append(np.stack([np.full(wide, len(points) - 1), bottom + after, bottom + at], axis=1))
    return SPHERE_M + RADIUS_M * points, np.concatenate(triangles)


@pytest.mark.parametrize("simulator", ["swept", "kinematic"])
def test_a_sphere_is_touched_where_it_is(simulator):
    scene = palpate.Scene.from_mesh(*sphere(), x_m=(-0.02, 0.02), z_m=(0.49, 0.51), simulator=simulator)
    assert isinstance(scene, palpate.Scene)
    touch = scene.touch([0.01, 0.5])
    assert touch.outcome == "contact"
    assert np.linalg.norm(touch.p_wc - SPHERE_M) == pytest.approx(RADIUS_M, abs={"swept": 1e-4}.get(simulator, 3e-3))
    assert np.linalg.norm(touch.normal_w) == pytest.approx(1.0)
    place = np.array([[0.0, 0.5], [0.015, 0.505]])
    away = np.hypot(place[:, 0], place[:, 1] - 0.5)
    heights_m = np.sqrt(RADIUS_M**2 - away**2) + SPHERE_M[1] - scene.zone.datum_y_m
    assert scene.true_height(place) == pytest.approx(heights_m, abs=1e-4)
    assert (touch.time_s is None) == (simulator == "swept")
    assert "Touch" in repr(touch) and "Scene" in repr(scene)


def test_meshes_go_out_and_come_in_again(tmp_path):
    scene = palpate.Scene.load("bird")
    vertices_m, triangles = scene.mesh()
    assert vertices_m.shape[1] == triangles.shape[1] == 3
    low, high = scene.zone.lower, scene.zone.upper
    again = palpate.Scene.from_mesh(vertices_m, triangles, x_m=(low[0], high[0]), z_m=(low[1], high[1]))
    target = (low + high) / 2
    assert again.touch(target).p_wc == pytest.approx(scene.touch(target).p_wc, abs=1e-9)
    palpate.write_mesh(tmp_path / "bird.stl", vertices_m, triangles)
    read_m, _ = palpate.read_mesh(tmp_path / "bird.stl")
    assert read_m.min(axis=0) == pytest.approx(vertices_m.min(axis=0), abs=1e-6)


def test_what_is_wrong_is_said():
    with pytest.raises(ConfigError):
        palpate.Scene.load("bird", finger__radius_m=-1.0)
    scene = palpate.Scene.load("toy")
    assert scene.mesh() is None
    with pytest.raises(ValueError, match="outside the region"):
        scene.touch([99.0])
    vertices_m, triangles = sphere(4)
    with pytest.raises(SimulationError):
        palpate.Scene.from_mesh(vertices_m, triangles, x_m=(5, 6), z_m=(5, 6))
    with pytest.raises(SimulationError):
        palpate.Scene.from_mesh(vertices_m, triangles - 1, x_m=(-0.02, 0.02), z_m=(0.49, 0.51))
    with pytest.raises(ValueError):
        palpate.Scene.from_mesh(vertices_m[:, :2], triangles, x_m=(-0.02, 0.02), z_m=(0.49, 0.51))
