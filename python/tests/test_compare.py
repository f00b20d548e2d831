"""Tests of comparisons, plots and notebook output of runs."""

import html
import re
import subprocess
import sys

import matplotlib

matplotlib.use("Agg")

import numpy as np
import palpate
import pytest
from matplotlib import pyplot
from matplotlib.colors import to_hex
from palpate import colours


@pytest.fixture(scope="module")
def run(tmp_path_factory):
    experiment = palpate.Experiment(scene="toy", touches=15, initial_touches=3, seed=2016)
    return experiment.run(["sobol", "random", "active"], trials=8, out=tmp_path_factory.mktemp("run") / "toy")


def test_a_comparison_is_what_the_program_prints_and_writes(run, tmp_path, program):
    comparison = run.compare()
    values = ["touches=15", "initial_touches=3", "trials=8", "grid=31", 'planners=["sobol", "random", "active"]']
    sets = [word for value in [*values, "report.planners=[]", "report.touch_counts=[]"] for word in ("--set", value)]
    printed = program("run", "toy", *sets, "--out", tmp_path / "run")
    there = palpate.Run.open(tmp_path / "run").compare()
    assert there.conclusion in printed and (there.conclusion, there.best) == (comparison.conclusion, comparison.best)
    page = html.unescape(re.sub(r"<[^>]*>", "", (tmp_path / "run/report.html").read_text()))
    assert all(verdict in page for verdict in there.verdicts) and len(there.verdicts) > 1
    assert there.conclusion in repr(there)
    import pandas as pd

    for name, table in (("comparison.csv", there.table()), ("equal_error.csv", there.equal_error())):
        written = pd.read_csv(tmp_path / "run" / name)
        table = table[list(written)].replace(np.inf, np.nan)
        pd.testing.assert_frame_equal(table, written, check_dtype=False, check_exact=True)


def test_a_comparison_is_that_of_the_paired_errors(run):
    comparison, table = run.compare(), run.compare().table()
    last = run.touches().query("touch == 15").pivot(index="trial", columns="planner", values=comparison.measure)
    row = table.query("planner == 'sobol' and baseline == 'random' and measure == @comparison.measure").iloc[0]
    difference = last["sobol"] - last["random"]
    assert row["difference"] == pytest.approx(difference.mean(), rel=1e-12)
    assert row["difference_low"] < row["difference"] < row["difference_high"]
    assert row["won"] == pytest.approx((difference < 0).mean()) and row["trials"] == 8
    errors = table.query("measure == @comparison.measure and baseline == 'random'")
    smallest = errors.loc[errors["difference"].idxmin()]
    expected = {"better": smallest["planner"], "worse": "random", None: None}
    verdict = smallest["verdict"] if isinstance(smallest["verdict"], str) else None
    assert comparison.best == expected[verdict]
    excluded = (table["difference_low"] > 0) | (table["difference_high"] < 0)
    assert (table["verdict"].notna() == excluded).all()


def test_few_trials_and_single_planners_are_not_compared():
    few = palpate.Experiment(scene="toy", touches=6).run(["active", "random"], trials=3).compare()
    assert few.best is None and "too few" in few.conclusion and few.table()["verdict"].isna().all()
    assert repr(few).count("too few") == 1
    one = palpate.Experiment(scene="toy", touches=6).run(["random"], trials=6).compare()
    assert one.best is None and one.conclusion is None and len(one.table()) == 0


def lines(ax):
    """Returns the lines and bands of axes by label."""
    bands = [collection.get_paths()[0].vertices for collection in ax.collections]
    return {line.get_label(): (line, band) for line, band in zip(ax.get_lines(), bands, strict=True)}


def test_a_plot_shows_the_summary_in_the_colours_of_the_report(run):
    ax = run.plot()
    summary = run.summary()
    assert list(lines(ax)) == run.planners and ax.get_yscale() == "log"
    assert "(mm)" in ax.get_ylabel() and ax.get_ylabel().startswith("median RMSE")
    for planner, (line, band) in lines(ax).items():
        rows = summary[summary["planner"] == planner]
        assert to_hex(line.get_color()) == colours.planner(planner, run.planners)
        assert np.array_equal(line.get_xdata(), rows["touches"])
        assert np.allclose(line.get_ydata(), 1e3 * rows["rmse_median_m"], rtol=1e-12)
        ends = 1e3 * rows[["rmse_median_low_m", "rmse_median_high_m"]].to_numpy()
        assert set(np.round(ends.ravel(), 9)) <= set(np.round(band[:, 1], 9))
    _, mine = pyplot.subplots()
    assert run.plot("centred_r", ax=mine) is mine and mine.get_yscale() == "linear"
    assert mine.get_ylabel().startswith("mean ")
    with pytest.raises(ValueError, match="allowed are .*rmse_m"):
        run.plot("rmse")
    pyplot.close("all")


def test_a_plot_of_a_whole_object_shows_its_error():
    run = palpate.Experiment(scene="bird_around", touches=7).run(["random"], trials=2)
    ax = run.plot()
    (line, _), = lines(ax).values()
    rows = run.summary()
    rows = rows[rows["chamfer_median_m"].notna()]
    assert np.allclose(line.get_ydata(), 1e3 * rows["chamfer_median_m"]) and "Chamfer" in ax.get_ylabel()
    pyplot.close("all")


def test_without_matplotlib_the_error_names_it():
    code = (
        "import sys; sys.modules['matplotlib'] = None\n"
        "import palpate\n"
        "palpate.Experiment(scene='toy', touches=6).run(['random'], trials=1).plot()"
    )
    result = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=False)
    assert "ImportError: Run.plot needs the package matplotlib" in result.stderr


class Spread:
    def plan(self, belief):
        return belief.zone.lower


def test_a_notebook_shows_a_table_and_the_conclusion(run):
    text = run._repr_html_()
    assert "<table" in text and "sobol" in text and html.escape(run.compare().conclusion) in text
    assert text.count("<tr>") == 1 + 3
    odd = palpate.Experiment(scene="toy", touches=6).run([("x:y(<script>&)", Spread)], trials=1)
    text = odd._repr_html_()
    assert "<script>" not in text and "&lt;script&gt;&amp;" in text
