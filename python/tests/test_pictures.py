"""Tests of what a notebook shows of objects."""

import io

import matplotlib

matplotlib.use("Agg")

import numpy as np
import own
import palpate
import pytest
from matplotlib import pyplot
from palpate import colours


def pixels(shown):
    """Pixels of a picture as red, green and blue, 0 to 255."""
    png, metadata = shown
    image = np.round(255 * pyplot.imread(io.BytesIO(png)))[..., :3]
    assert image.shape[1] == 2 * metadata["width"] <= 2 * 900, "it fits in a cell, and is sharp"
    assert len(png) < 300_000, "a notebook with some pictures stays small"
    return image.astype(int)


def count(image, colour, tolerance=2):
    """Number of pixels of a colour."""
    rgb = [int(colour[i : i + 2], 16) for i in (1, 3, 5)]
    return int((np.abs(image - rgb).max(axis=-1) <= tolerance).sum())


@pytest.mark.parametrize("name", ["toy", "container", "bird_around"])
def test_a_belief_is_drawn_with_its_contacts(name):
    exploration = palpate.Exploration(palpate.Scene.load(name))
    assert exploration.belief._repr_png_() is None and exploration._repr_png_() is None, "nothing is known yet"
    reds = []
    region = getattr(exploration.belief, "zone", None)
    for i in range(12):
        if region is None:
            angle = 2.4 * i
            side = [np.cos(angle), np.sin(angle), 0.9 - 0.15 * i]
            exploration.touch(exploration.belief.ball.aim(side))
        else:
            share = np.mod((i + 0.5) * np.array([0.618034, 0.414214])[: region.dimension], 1.0)
            exploration.touch(region.lower + share * (region.upper - region.lower))
        if i in (2, 11):
            image = pixels(exploration.belief._repr_png_())
            assert np.array_equal(image, pixels(exploration._repr_png_()))
            reds.append(count(image, colours.PLANNED))
    assert reds[1] > 1.5 * reds[0] > 0


def test_the_map_has_the_colours_of_the_heights():
    exploration = palpate.Exploration(palpate.Scene.load("container"))
    for place in exploration.belief.zone.grid(4):
        exploration.touch(place)
    image = pixels(exploration.belief._repr_png_())
    # Both ends of both colour maps are in the bars, half a step from the end.
    for scale in (colours.HEIGHT, colours.DEVIATION):
        assert count(image, scale[0], 6) > 0 and count(image, scale[-1], 6) > 0


@pytest.mark.parametrize("name", ["toy", "container", "bird", "bird_around"])
def test_a_scene_is_drawn(name):
    image = pixels(palpate.Scene.load(name)._repr_png_())
    assert tuple(image[0, 0]) == (255, 255, 255), "on light paper, also in a dark notebook"
    assert (image != 255).any(axis=-1).mean() > 0.01
    if name == "toy":
        assert count(image, colours.TRUTH) > 100


def test_a_zone_is_drawn_in_its_shape():
    wide = palpate.Scene.load("container").zone
    image = pixels(wide._repr_png_())
    filled = np.argwhere((np.abs(image - [199, 234, 224]).max(axis=-1) <= 4))
    height, width = np.ptp(filled, axis=0) + 1
    sides = wide.upper - wide.lower
    assert width / height == pytest.approx(sides[0] / sides[1], rel=0.05)
    assert pixels(palpate.Scene.load("toy").zone._repr_png_()).shape[0] < 200


def test_results_are_shown_as_pages(tmp_path):
    experiment = palpate.Experiment.load("toy", touches=12, initial_touches=3, grid=101)
    comparison = experiment.run(["sobol", "random"], trials=6).compare()
    text = comparison._repr_html_()
    # A drawing clips its parts in drawings of their own.
    assert text.count("<table") == 1 and text.count("<svg style") == 1 and "median" in text
    assert colours.planner("sobol") in text and colours.planner("random") in text
    palpate.check(experiment, tmp_path / "base.jsonl", [own.Middle, "sobol"], accept="first", max_trials=6)
    check = palpate.check(experiment, tmp_path / "base.jsonl", [own.Middle, "sobol"], max_trials=6)
    text = check._repr_html_()
    assert text.count("<svg style") == 1 and "own:Middle" in text and "toy: identical" in text
