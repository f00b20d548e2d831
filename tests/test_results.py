#!/usr/bin/env python3
"""Tests of benches/results.py, which stores results of the benchmark and writes the tables of the docs."""

import contextlib
import io
import json
import os
import pathlib
import subprocess
import sys
import tempfile
import unittest
import unittest.mock
import xml.dom.minidom

ROOT = pathlib.Path(__file__).resolve().parent.parent
sys.path.insert(0, str(ROOT / "benches"))

import commits_figure  # noqa: E402
import results  # noqa: E402


def planner(name, error, measures=None):
    """A planner of a benchmark.json with the budgets 10 and 20."""
    interval = [error - 0.01, error + 0.01]
    after = [{"error": error, "error_interval": interval}, {"error": None, "error_interval": None}]
    gaps = {"gap_closed": 0.423, "gap_closed_full": 0.5, "gap_closed_open": None}
    objects = [{"object": "a", "error_m": [0.1, 0.1]}]
    result = {"name": name, "error": error, "error_interval": interval, "better_on": 3, "worse_on": 0, **gaps}
    result |= {"after": after, "trials": 19, "failures": 1, "objects": objects}
    return result | ({"measures": measures} if measures else {})


class Checkout(unittest.TestCase):
    """Tests in a checkout with one protocol, one page and one commit."""

    def setUp(self):
        folder = tempfile.TemporaryDirectory()
        self.addCleanup(folder.cleanup)
        self.root = pathlib.Path(folder.name)
        for path in ("experiments/suite/one.toml", "experiments/suite/shape.toml"):
            (self.root / path).parent.mkdir(parents=True, exist_ok=True)
            (self.root / path).touch()
        self.page = self.root / "docs/page.md"
        self.page.parent.mkdir()
        self.page.write_text("# Page\n\n<!-- table: one -->\nold\n<!-- end -->\n\nMore.\n")
        self.git("init", "--quiet")
        self.commits = [self.commit(f"2026-11-2{day}T12:00:00+02:00") for day in range(3)]
        self.result = {
            "protocol": "one",
            "protocol_sha256": "5" * 64,
            "commit": self.commits[0],
            "quick": False,
            "reference": "sobol",
            "objects": ["a", "b"],
            "budgets": [10, 20],
            "planners": [planner("active", 0.8766), planner("sobol", 1.0)],
        }

    def git(self, *words, date="2026-11-20T12:00:00+02:00"):
        names = {f"GIT_{role}_{key}": "a@b" for role in ("AUTHOR", "COMMITTER") for key in ("NAME", "EMAIL")}
        dates = {"GIT_AUTHOR_DATE": date, "GIT_COMMITTER_DATE": date}
        command = ["git", "-C", self.root, "-c", "commit.gpgsign=false", *words]
        environment = names | dates | {"PATH": os.environ["PATH"]}
        return subprocess.run(command, env=environment, check=True, capture_output=True, text=True).stdout

    def commit(self, date):
        self.git("commit", "--quiet", "--allow-empty", "--no-verify", "--message", "x", date=date)
        return self.git("rev-parse", "--short=12", "HEAD").strip()

    def run_script(self, *words):
        """Returns exit code and output."""
        said = io.StringIO()
        with contextlib.redirect_stdout(said), contextlib.redirect_stderr(said):
            code = results.main(["--root", str(self.root), *map(str, words)])
        return code, said.getvalue()

    def add(self, **changes):
        file = self.root / "benchmark.json"
        file.write_text(json.dumps(self.result | changes))
        return self.run_script("add", file)

    def fails(self, says, **changes):
        code, said = self.add(**changes)
        self.assertEqual(code, 2, said)
        self.assertIn("benchmark.json: ", said)
        self.assertIn(says, said)

    def rows(self, name="one"):
        return results.read(self.root / f"benches/results/{name}.csv")

    def test_results_become_rows_table_and_figure(self):
        code, said = self.add()
        self.assertEqual(code, 0, said)
        row = self.rows()[0]
        expected = {"commit": self.commits[0], "date": "2026-11-20T10:00:00Z", "planner": "active", "error": "0.8766"}
        expected |= {"error_low": "0.8666", "after_10_high": "0.8866", "after_20": "", "after_20_low": "", "trials": "19"}
        self.assertEqual({key: row[key] for key in expected}, expected)
        self.assertNotIn("gap_closed_low", row)
        table = (
            "# Page\n\n<!-- table: one -->\n\n"
            "|planner|error, relative to sobol|better on|worse on|gap closed, %|full zones|after 10|\n"
            "|---|---|---|---|---|---|---|\n"
            "|`active`|0.877 [0.867, 0.887]|3|0|42|50|0.877|\n"
            "|`sobol`|1.00 [0.990, 1.01]|–|–|42|50|1.00|\n\n"
            f"Commit `{self.commits[0]}`, 2026-11-20, SHA-256 `55555555…`, 2 objects, 20 trials per planner, 2 failed.\n\n"
            "<!-- end -->\n\nMore.\n"
        )
        self.assertEqual(self.page.read_text(), table)
        figure = (self.root / results.FIGURE).read_text()
        xml.dom.minidom.parseString(figure)
        self.assertIn("one: error, relative to sobol", figure)
        self.assertEqual(self.run_script("check"), (0, ""))

    def test_the_page_has_the_newest_commit_in_any_order_of_rows(self):
        for commit, error in zip((self.commits[2], self.commits[1]), (0.5, 0.6)):
            code, said = self.add(commit=commit, planners=[planner("active", error)])
            self.assertEqual(code, 0, said)
        self.assertIn("|`active`|0.500", self.page.read_text())
        self.assertNotIn("0.600", self.page.read_text())
        self.assertEqual([row["commit"] for row in self.rows()], [self.commits[2], self.commits[1]])

    def test_measures_of_whole_objects_are_stored_after_each_budget(self):
        new = [{"value": 1, "interval": [0, 2]}, {"value": 2, "interval": None}]
        measures = {"chamfer_share": [0.0304, 0.0123], "iou": [None, 0.9], "new": new}
        self.page.write_text("<!-- table: shape -->\n<!-- end -->\n")
        code, said = self.add(protocol="shape", planners=[planner("active", 0.9, measures)])
        self.assertEqual(code, 0, said)
        row = self.rows("shape")[0]
        found = [row[f"{name}_after_{budget}"] for name in ("chamfer_share", "iou", "new") for budget in (10, 20)]
        self.assertEqual(found, ["0.0304", "0.0123", "", "0.9", "1", "2"])
        self.assertEqual((row["new_after_10_high"], row["new_after_20_high"]), ("2", ""))
        page = self.page.read_text()
        self.assertIn("|Chamfer, %, after 10|Chamfer, %, after 20|IoU after 20|new after 20|\n", page)
        self.assertIn("|3.04|1.23|0.900|2.00|\n", page)
        self.assertIn("shape: Chamfer, %, after 20", (self.root / results.FIGURE).read_text())

    def test_results_of_other_commands_are_the_newest_of_each_case(self):
        path = self.root / "benches/results/other.csv"
        path.parent.mkdir(parents=True)
        head = "commit,date,protocol_sha256,planner,case,error_m,error_m_low,error_m_high,time_s,time_s_over\n"
        path.write_text(
            f"{head}{self.commits[1]},2026-11-21T10:00:00Z,,active,mug,1,,,,9\n"
            f"{self.commits[0]},2026-11-20T10:00:00Z,,active,mug,2,,,3,\n"
            f"{self.commits[0]},2026-11-20T10:00:00Z,,,cup,3,-1,4,5,\n"
        )
        self.page.write_text("<!-- table: other -->\n<!-- end -->\n")
        error, time = results.show("error_m", 1000, 0, has_interval=True), results.show("time_s", decimals=0)
        selection = results.Selection([("error", error), ("s", time)], first="object")
        with unittest.mock.patch.dict(results.TABLES, {("docs/page.md", "other"): selection}):
            self.assertEqual(self.run_script("write")[0], 0)
        rows = "|object|error|s|\n|---|---|---|\n|mug, `active`|1000|over 9|\n|cup|3000 [−1000, 4000]|5|\n"
        dates = f"Commits `{self.commits[0]}`, 2026-11-20, to `{self.commits[1]}`, 2026-11-21."
        self.assertIn(f"{rows}\n{dates}\n", self.page.read_text())
        self.assertNotIn("other", (self.root / results.FIGURE).read_text())

    def test_a_new_column_is_empty_in_older_rows(self):
        self.add()
        code, said = self.add(commit=self.commits[1], planners=[planner("active", 0.9) | {"time_s": 2.5}])
        self.assertEqual(code, 0, said)
        self.assertEqual([row["time_s"] for row in self.rows()], ["", "", "2.5"])
        self.assertIn("|time s|", self.page.read_text())

    def test_a_difference_is_found(self):
        self.add()
        self.page.write_text(self.page.read_text().replace("0.877", "0.777"))
        code, said = self.run_script("check")
        self.assertEqual(code, 1)
        self.assertIn("docs/page.md differs from benches/results: run `python3 benches/results.py write`", said)
        self.run_script("write")
        (self.root / results.FIGURE).write_text("")
        self.assertEqual(self.run_script("check")[0], 1)
        self.run_script("write")
        self.assertEqual(self.run_script("check"), (0, ""))
        self.page.write_text("no table")
        code, said = self.run_script("check")
        self.assertEqual(code, 1)
        self.assertIn("no page has `<!-- table: one -->`", said)

    def test_a_bad_result_is_an_error(self):
        self.fails("`quick` = true: allowed is false: run without --quick", quick=True)
        self.fails('`protocol` = "two": allowed is the name of a file in experiments', protocol="two")
        self.fails('`commit` = "unknown": allowed is a commit; build by make', commit="unknown")
        self.fails("`commit` = 0123456789ab: not in this repository; fetch it", commit="0123456789ab")
        self.fails("`protocol_sha256` = null", protocol_sha256=None)
        self.fails("`planners` has active more than once", planners=[planner("active", 1.0)] * 2)
        self.fails("`planners[0].error` = true", planners=[planner("active", 1.0) | {"error": True}])
        bad = planner("active", 1.0) | {"error_interval": [1]}
        self.fails("`planners[0].error_interval` = [1]: allowed are two numbers or null", planners=[bad])
        self.fails("`planners[0].after` has 2 entries: allowed is one for each of 1 budgets", budgets=[10])
        self.fails("`planners[0].measures.iou[1]` = \"x\"", planners=[planner("a", 1.0, {"iou": [1, "x"]})])
        self.fails("NaN: allowed are finite numbers", planners=[planner("a", float("nan"))])
        del self.result["planners"][0]["trials"]
        self.fails("missing field `planners[0].trials`")
        self.assertFalse((self.root / "benches/results").exists())
        file = self.root / "benchmark.json"
        file.write_text("{")
        self.assertEqual(self.run_script("add", file)[0], 2)
        self.assertEqual(self.run_script("add", self.root / "none.json")[0], 2)

    def test_nothing_is_written_if_a_table_cannot_be(self):
        selection = results.Selection([("error", results.show("error"))], {"random": "`random`"})
        with unittest.mock.patch.dict(results.TABLES, {("docs/page.md", "one"): selection}):
            code, said = self.add()
        self.assertEqual(code, 2)
        self.assertIn(f"docs/page.md: table one: no random at commit {self.commits[0]}", said)
        self.assertFalse((self.root / "benches/results").exists())

    def test_a_commit_is_stored_once(self):
        self.add()
        before = self.rows()
        self.fails(f"`commit` = {self.commits[0]} is in ")
        self.fails(f"`commit` = {self.commits[0][:7]} is in ", commit=self.commits[0][:7])
        self.assertEqual(self.rows(), before)

    def test_a_bad_file_is_an_error(self):
        self.add()
        path = self.root / "benches/results/one.csv"
        text = path.read_text()
        for old, new, says in [
            ("0.8766", "0.8x", "one.csv:2: `error` = '0.8x': allowed is a number"),
            ("2026-11-20T", "2026-13-20T", "one.csv:2: `date` = "),
            ("sobol,sobol", "active,sobol", "one.csv:3: commit"),
            ("planner,", "planer,", "one.csv:1: missing column `planner`"),
            (",0.8766,", ",", "one.csv:2: the row has not "),
        ]:
            path.write_text(text.replace(old, new, 1))
            code, said = self.run_script("check")
            self.assertEqual(code, 2)
            self.assertIn(says, said)
        path.write_text(text)
        unknown = "<!-- table: two -->\n<!-- end -->"
        for page, says in [("<!-- table: one -->\n", "lacks the line"), (unknown, "allowed are one")]:
            self.page.write_text(page)
            code, said = self.run_script("check")
            self.assertEqual(code, 2)
            self.assertIn(says, said)


class Parts(unittest.TestCase):
    """Tests of numbers and of the figure."""

    def test_numbers_have_three_significant_digits(self):
        numbers = {"0.9996": "1.00", "0.0043": "0.00430", "9.996": "10.0", "123.4": "123", "0": "0.00", "": "–"}
        self.assertEqual({value: results.number(value) for value in numbers}, numbers)
        self.assertEqual(results.number("-0.004", 100, 0), "0")
        self.assertEqual(results.number("-0.014", 100, 0), "−1")

    def test_labels_do_not_overlap(self):
        for heights in ([10, 11, 12, 200], [190, 195, 199], [5] * 12, [50, 60, 90, 91, 92, 93]):
            moved = commits_figure.spread(heights, 5, 195)
            self.assertTrue(all(b - a > commits_figure.LINE - 1e-9 for a, b in zip(moved, moved[1:])), moved)
            self.assertTrue(moved[0] >= 5 and moved[-1] <= 195, moved)

    def test_lines_join_results_of_equal_protocols(self):
        commits = [(f"2026-11-2{day}T12:00:00Z", f"{day}" * 12, "a" if day < 2 else "b") for day in range(4)]
        points = [(day, 1 + 0.1 * day, None, None) for day in range(4)]
        figure = commits_figure.svg({"one": commits_figure.Panel("error", commits, {"active": points})})
        xml.dom.minidom.parseString(figure)
        self.assertEqual(figure.count("<circle"), 4)
        # Two lines between points, one from the newest point to the frame, one to the label.
        self.assertEqual(figure.count(f'stroke="{commits_figure.OWN["active"]}"'), 4)
        self.assertEqual(figure.count("stroke-dasharray"), 1)


class Repository(unittest.TestCase):
    """Tests of the repository's own files."""

    def test_tables_and_figure_equal_the_results(self):
        said = io.StringIO()
        with contextlib.redirect_stderr(said):
            self.assertEqual(results.main(["check"]), 0, said.getvalue())


if __name__ == "__main__":
    unittest.main()
