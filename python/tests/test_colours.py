"""Tests that figures from Python have the report's colours."""

import re
from pathlib import Path

import pytest

from palpate import colours

REPORT = (Path(__file__).parents[2] / "src" / "report" / "style.rs").read_text()


@pytest.mark.parametrize("name", ["INK", "FAINT_INK", "GRID", "PAPER", "TRUTH", "INITIAL", "PLANNED"])
def test_a_colour_is_the_report_s(name):
    assert f'pub const {name}: &str = "{getattr(colours, name)}";' in REPORT


@pytest.mark.parametrize("name", ["DEVIATION", "HEIGHT", "ERROR"])
def test_a_map_is_the_report_s(name):
    rows = re.search(rf"pub const {name}: .*? =\s+\[(.*?)\];", REPORT, re.DOTALL)[1]
    report = re.sub("0x", "#", rows).replace(",", " ").split()
    assert list(getattr(colours, name)) == report


def test_planners_have_the_report_s():
    own = dict(re.findall(r'\("(\w+)", "(#\w+)"\)', REPORT))
    assert set(own) == {"active", "random", "sobol"}
    assert {name: colours.planner(name) for name in own} == own
    spare = re.findall(r"#\w+", re.search(r"const SPARE.*?=\s*\[(.*?)\]", REPORT, re.DOTALL)[1])
    names = [f"m:Own{i}" for i in range(len(spare) + 1)]
    assert [colours.planner(name, ["active", *names]) for name in names] == [*spare, spare[0]]
