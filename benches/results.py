#!/usr/bin/env python3
"""Stores results of `palpate benchmark` as CSV, and writes the tables and the figure of the docs from them.

    benches/results.py add BENCHMARK_JSON …   appends the results to benches/results/PROTOCOL.csv, then writes
    benches/results.py write                  writes the tables of the pages and docs/benchmark-commits.svg
    benches/results.py check                  compares tables and figure with the CSV files

A CSV file has a row for each commit and planner, in SI units: `F` is a figure, `F_low` and `F_high` are the ends of its
95 % interval, `M_after_N` is the measure M after N touches. A page shows the newest commit of PROTOCOL.csv between
`<!-- table: PROTOCOL -->` and `<!-- end -->`; `TABLES` selects columns and rows.

Files without SHA-256 hold results of other commands, which the page names. A table shows the newest row of each case
and planner; the figure omits them. Their rows until 2026-11-30 have the commit that stored them in the docs.

Exit codes: 0 done, 1 a table or the figure differs, 2 error.
"""

import argparse
import csv
import datetime
import io
import json
import math
import pathlib
import re
import subprocess
import sys

import commits_figure

ROOT = pathlib.Path(__file__).resolve().parent.parent
FOLDER = "benches/results"
FIGURE = "docs/benchmark-commits.svg"
PAGES = ("*.md", "docs/*.md", "experiments/*.md")

# Columns of every CSV file, and those that are no numbers.
FIRST = ("commit", "date", "protocol_sha256", "planner")
TEXT = {*FIRST, "case", "reference"}
DATE = "%Y-%m-%dT%H:%M:%SZ"

# Titles, factors and decimals of columns; None: three significant digits. Others have their own name.
COLUMNS = {
    "error": ("error, relative to {reference}", 1, None),
    "better_on": ("better on", 1, 0),
    "worse_on": ("worse on", 1, 0),
    "gap_closed": ("gap closed, %", 100, 0),
    "gap_closed_full": ("full zones", 100, 0),
    "gap_closed_open": ("open zones", 100, 0),
    "after": ("after {budget}", 1, None),
    "chamfer_share_after": ("Chamfer, %, after {budget}", 100, 2),
    "reachable_chamfer_share_after": ("reachable, %, after {budget}", 100, 2),
    "f_1_mm_after": ("F at 1 mm after {budget}", 1, 3),
    "f_2_mm_after": ("F at 2 mm after {budget}", 1, 3),
    "reached_2_mm_after": ("reached within 2 mm, %, after {budget}", 100, 1),
    "iou_after": ("IoU after {budget}", 1, 3),
}
# Columns of `COLUMNS` that a table omits: the caption has them.
IN_CAPTION = {"objects", "trials", "failures"}

MEASURE = re.compile(r"(.+)_after_(\d+)")
BUDGET = re.compile(r"(.*)_(\d+)")
BLOCK = re.compile(r"^<!-- table: (\S+) -->\n(.*?)^<!-- end -->$", re.MULTILINE | re.DOTALL)


class Bad(Exception):
    """Error of an invalid file."""


class Selection:
    """Columns and rows of a table that has not all of them."""

    def __init__(self, columns, labels=None, first="planner"):
        """`columns` are (title, function of a row); `labels` are planners with their texts in the first column, whose title
        is `first`."""
        self.columns, self.labels, self.first = columns, labels, first


def show(name, factor=1, decimals=None, has_interval=False):
    """Returns the function that shows a column of a row."""
    return lambda row: estimate(row, name, factor, decimals) if has_interval else text_of(row, name, factor, decimals)


# Selections by page and table.
TABLES = {
    ("README.md", "benchmark-3"): Selection(
        [
            ("error", show("error", has_interval=True)),
            ("better on", show("better_on", decimals=0)),
            ("worse on", show("worse_on", decimals=0)),
            ("gap closed, full zones, %", show("gap_closed_full", 100, 0)),
            ("open zones, %", show("gap_closed_open", 100, 0)),
        ],
        {
            "expected_contact": "`expected_contact`",
            "silhouette": "`silhouette`",
            "active": "`active` (Yi et al. 2016)",
            "sobol": "`sobol` (no model)",
            "random": "`random`",
        },
    ),
    ("docs/whole-objects.md", "around-reporting"): Selection(
        [
            ("n", show("n", decimals=0)),
            *((f"after {count} touches", show(f"chamfer_share_after_{count}", 100, 2)) for count in (10, 20, 40, 60)),
            ("IoU", show("iou_after_60", decimals=2)),
            ("within 2 σ, `sd_inflation` 1.6", show("within_2_sigma_after_60", decimals=3)),
        ],
    ),
    ("docs/recognition.md", "recognition"): Selection(
        [
            ("n trials", show("n", decimals=0)),
            *((f"right after {budget}", show(f"right_after_{budget}", decimals=2)) for budget in (3, 5, 10)),
            ("95 % sure after (median)", show("touches_until_sure", decimals=0)),
            ("ADD-S after 10, mm (median)", show("add_s_m_after_10", 1000, 2)),
        ],
        first="objects, planner",
    ),
    ("docs/benchmark.md", "ycb"): Selection(
        [
            ("n trials", show("n", decimals=0)),
            ("Chamfer, %, after 60", show("chamfer_share_after_60", 100, 2)),
            ("reachable within 2 mm, %", show("within_2_mm_after_60", 100, 1)),
            ("gap closed, %", show("gap_closed", 100, 0)),
            ("right after 10", show("right_after_10", decimals=2)),
            ("ADD-S, mm", show("add_s_m", 1000, 2)),
            ("within stated distance", show("pose_coverage", decimals=2)),
        ],
        first="protocol, planner",
    ),
    ("docs/paper.md", "paper-finger"): Selection(
        [
            *((planner, show(f"{planner}_rmse_m", 1000, 2)) for planner in ("active", "sobol", "random")),
            ("active − random", show("difference_m", 1000, 2, has_interval=True)),
        ],
        first="object, touches, finger",
    ),
    ("docs/paper.md", "paper-equal-error"): Selection(
        [(name, show(f"{name}_touches", decimals=0, has_interval=True)) for name in ("toy", "container", "bird")],
    ),
}


def main(words=None):
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--root", type=pathlib.Path, default=ROOT, help="the checkout; default: that of this script")
    commands = parser.add_subparsers(dest="command", required=True)
    add = commands.add_parser("add", help="append results, then write")
    add.add_argument("files", nargs="+", type=pathlib.Path, metavar="BENCHMARK_JSON")
    commands.add_parser("write", help="write tables and figure")
    commands.add_parser("check", help="compare tables and figure with the CSV files")
    arguments = parser.parse_args(words)
    try:
        results = {path.stem: read(path) for path in sorted((arguments.root / FOLDER).glob("*.csv"))}
        texts = {}
        for file in getattr(arguments, "files", []):
            texts |= append(arguments.root, file, results)
        # Written only if all of them can be.
        return update(arguments.root, results, texts, is_check=arguments.command == "check")
    except (Bad, OSError, UnicodeDecodeError) as error:
        print(f"error: {error}", file=sys.stderr)
        return 2


# Results of a benchmark.


def append(root, file, results):
    """Appends the rows of a benchmark.json to those of its protocol; returns the CSV file with its text."""
    result = read_result(root, file)
    protocol, commit = result["protocol"], result["commit"]
    path = root / FOLDER / f"{protocol}.csv"
    stored = results.get(protocol, [])
    for row in stored:
        if row["commit"].startswith(commit) or commit.startswith(row["commit"]):
            raise Bad(f"{file}: `commit` = {commit} is in {path} already; delete its rows to replace them")
    results[protocol] = stored + rows_of(file, result, commit_date(root, file, commit))
    return {path: csv_text(results[protocol])}


def read_result(root, file):
    """Reads a benchmark.json and checks the fields that this script needs."""

    def refuse(constant):
        raise Bad(f"{file}: {constant}: allowed are finite numbers and null")

    try:
        result = json.loads(file.read_text(), parse_constant=refuse)
    except json.JSONDecodeError as error:
        raise Bad(f"{file}: {error}") from error
    protocols = sorted(path.stem for path in (root / "experiments").rglob("*.toml"))
    names = lambda value: isinstance(value, list) and value and all(isinstance(it, str) for it in value)
    whole = lambda value: isinstance(value, int) and not isinstance(value, bool) and value >= 0
    need(file, result, "protocol", lambda it: it in protocols, "the name of a file in experiments")
    need(file, result, "protocol_sha256", lambda it: matches("[0-9a-f]{64}", it), "64 hexadecimal digits")
    need(file, result, "commit", lambda it: matches("[0-9a-f]{7,40}", it), "a commit; build by make")
    need(file, result, "quick", lambda it: it is False, "false: run without --quick")
    need(file, result, "reference", lambda it: matches(r"\S+", it), "a planner")
    need(file, result, "objects", names, "a list of names")
    need(file, result, "budgets", lambda it: isinstance(it, list) and all(map(whole, it)), "a list of touch counts")
    need(file, result, "planners", lambda it: isinstance(it, list) and it, "a list of planners")
    for index, planner in enumerate(result["planners"]):
        at = f"planners[{index}]."
        need(file, planner, "name", lambda it: matches(r"\S.*", it), "a name", at)
        for count in ("trials", "failures"):
            need(file, planner, count, whole, "a count", at)
        need(file, planner, "error", lambda it: it is None or is_number(it), "a number or null", at)
    planners = [planner["name"] for planner in result["planners"]]
    for name in planners:
        if planners.count(name) > 1:
            raise Bad(f"{file}: `planners` has {name} more than once")
    return result


def need(file, table, key, is_allowed, allowed, at=""):
    """Checks a field of a table."""
    if not isinstance(table, dict) or key not in table:
        raise Bad(f"{file}: missing field `{at}{key}`")
    if not is_allowed(table[key]):
        raise Bad(f"{file}: `{at}{key}` = {json.dumps(table[key])[:80]}: allowed is {allowed}")


def matches(pattern, value):
    return isinstance(value, str) and re.fullmatch(pattern, value) is not None


def is_number(value):
    return isinstance(value, (int, float)) and not isinstance(value, bool) and math.isfinite(value)


def commit_date(root, file, commit):
    """Returns the date of a commit in UTC."""
    show = ["git", "-C", root, "show", "--no-patch", "--format=%ct", f"{commit}^{{commit}}"]
    ended = subprocess.run(show, stdin=subprocess.DEVNULL, capture_output=True, text=True)
    if ended.returncode:
        raise Bad(f"{file}: `commit` = {commit}: not in this repository; fetch it")
    return datetime.datetime.fromtimestamp(int(ended.stdout), datetime.timezone.utc).strftime(DATE)


def rows_of(file, result, date):
    """Returns a row of the CSV file for each planner of a benchmark."""
    rows = []
    for index, planner in enumerate(result["planners"]):
        row = {
            "commit": result["commit"],
            "date": date,
            "protocol_sha256": result["protocol_sha256"],
            "planner": planner["name"],
            "reference": result["reference"],
            "objects": str(len(result["objects"])),
        }
        for key, value in planner.items():
            if key not in ("name", "objects", "measures"):
                row |= flat(file, f"planners[{index}].{key}", key, value, result["budgets"])
        for key, value in (planner.get("measures") or {}).items():
            name = f"{key}_after" if isinstance(value, list) else key
            row |= flat(file, f"planners[{index}].measures.{key}", name, value, result["budgets"])
        rows.append(row)
    return rows


def flat(file, at, name, value, budgets):
    """Returns the columns of a value: a number, an interval, a number with its interval, or a list of these for each
    budget."""
    if name.endswith("_interval"):
        name = name.removesuffix("_interval")
        if value is not None and not (isinstance(value, list) and len(value) == 2 and all(map(is_number, value))):
            raise Bad(f"{file}: `{at}` = {json.dumps(value)[:80]}: allowed are two numbers or null")
        low, high = value or (None, None)
        return {f"{name}_low": written(low), f"{name}_high": written(high)}
    if value is None or is_number(value):
        return {name: written(value)}
    if isinstance(value, list):
        if len(value) != len(budgets):
            raise Bad(f"{file}: `{at}` has {len(value)} entries: allowed is one for each of {len(budgets)} budgets")
        columns = {}
        for index, (budget, it) in enumerate(zip(budgets, value)):
            columns |= flat(file, f"{at}[{index}]", f"{name}_{budget}", it, budgets)
        return columns
    if isinstance(value, dict):
        columns = {}
        for key, it in value.items():
            # The number itself and its interval have the name of the whole.
            own = re.sub(r"^_?(error|value|mean|)(?=_interval$|$)", "", f"_{key}")
            columns |= flat(file, f"{at}.{key}", name + own, it, budgets)
        return columns
    raise Bad(f"{file}: `{at}` = {json.dumps(value)[:80]}: allowed are numbers, null and lists of these")


def written(value):
    """Returns a number with six significant digits as in the CSV file."""
    return "" if value is None else f"{value:.6g}"


# CSV files.


def read(path):
    """Reads the rows of a CSV file and checks them."""
    reader = csv.DictReader(io.StringIO(path.read_text()), strict=True)
    missing = [name for name in FIRST if name not in (reader.fieldnames or [])]
    if missing:
        raise Bad(f"{path}:1: missing column `{missing[0]}`")
    rows, seen = [], set()
    try:
        for row in reader:
            at = f"{path}:{reader.line_num}"
            if None in row or None in row.values():
                raise Bad(f"{at}: the row has not {len(reader.fieldnames)} columns")
            check_row(at, row)
            key = (row["commit"], row["planner"], row.get("case"))
            if key in seen:
                raise Bad(f"{at}: commit {row['commit']} has {row['planner']} more than once")
            seen.add(key)
            rows.append(row)
    except csv.Error as error:
        raise Bad(f"{path}:{reader.line_num}: {error}") from error
    if not rows:
        raise Bad(f"{path}: no rows")
    return rows


def check_row(at, row):
    """Checks the values of a row."""
    for name, value in row.items():
        try:
            if name == "date":
                datetime.datetime.strptime(value, DATE)
            elif name == "commit" and not matches("[0-9a-f]{7,40}", value):
                raise ValueError
            elif name not in TEXT and value and not math.isfinite(float(value)):
                raise ValueError
        except ValueError:
            allowed = {"date": "a date such as 2026-11-30T09:34:57Z", "commit": "a commit"}.get(name, "a number")
            raise Bad(f"{at}: `{name}` = {value!r}: allowed is {allowed}") from None


def csv_text(rows):
    """Returns rows as CSV, with the columns of all of them."""
    names = list(dict.fromkeys(name for row in rows for name in row))
    text = io.StringIO()
    writer = csv.DictWriter(text, names, restval="", lineterminator="\n")
    writer.writeheader()
    writer.writerows(rows)
    return text.getvalue()


def is_protocol(rows):
    """Returns whether the rows are those of a protocol of `palpate benchmark`."""
    return any(row["protocol_sha256"] for row in rows)


def newest(rows):
    """Returns the rows of the newest commit, or without a protocol the newest row of each case and planner."""
    if is_protocol(rows):
        last = max(rows, key=lambda row: row["date"])
        return [row for row in rows if row["commit"] == last["commit"]]
    found = {}
    for row in rows:
        key = row.get("case"), row["planner"]
        found[key] = max(found.get(key, row), row, key=lambda row: row["date"])
    return list(found.values())


# Tables.


def number(value, factor=1, decimals=None):
    """Returns a number as text, by default with three significant digits."""
    if value in ("", None):
        return "–"
    value = factor * float(value)
    if decimals is None:
        decimals = max(0, 2 - math.floor(math.log10(abs(value)))) if value else 2
        # Rounding can add a digit: 0.9996 is 1.00.
        decimals -= 1 if decimals and abs(round(value, decimals)) >= 10 ** (3 - decimals) else 0
    text = f"{value:.{decimals}f}"
    return text.replace("-", "" if float(text) == 0 else "−")


def described(name):
    """Returns title, factor and decimals of a column."""
    match = None if name in COLUMNS else BUDGET.fullmatch(name)
    stem, budget = match.groups() if match else (name, "")
    title, factor, decimals = COLUMNS.get(stem, (name.replace("_", " "), 1, None))
    return title.replace("{budget}", budget), factor, decimals


def text_of(row, name, factor, decimals):
    """Returns a number of a row as text; `–` for counts of the reference, which is compared with itself."""
    if name in ("better_on", "worse_on") and row["planner"] == row.get("reference"):
        return "–"
    # A trial of this length does not suffice.
    if row.get(f"{name}_over"):
        return f"over {number(row[f'{name}_over'], factor, decimals)}"
    return number(row.get(name), factor, decimals)


def estimate(row, name, factor, decimals):
    """Returns a number of a row with its interval as text."""
    low, high = (number(row.get(f"{name}_{end}"), factor, decimals) for end in ("low", "high"))
    return text_of(row, name, factor, decimals) + ("" if "–" in (low, high) else f" [{low}, {high}]")


def label(row):
    """Returns case and planner of a row."""
    return ", ".join(filter(None, (row.get("case"), f"`{row['planner']}`" if row["planner"] else "")))


def table(page, name, rows):
    """Returns the newest results in Markdown."""
    rows = newest(rows)
    selection = TABLES.get((page, name)) or Selection(list(all_columns(rows)))
    if selection.labels:
        known = {row["planner"]: row for row in rows}
        missing = [planner for planner in selection.labels if planner not in known]
        if missing:
            raise Bad(f"{page}: table {name}: no {missing[0]} at commit {rows[0]['commit']}")
        rows = [known[planner] for planner in selection.labels]
    labels = [*selection.labels.values()] if selection.labels else map(label, rows)
    lines = [[selection.first, *(title for title, _ in selection.columns)], ["---"] * (1 + len(selection.columns))]
    lines += [[first, *(text(row) for _, text in selection.columns)] for first, row in zip(labels, rows)]
    return "".join(f"|{'|'.join(line)}|\n" for line in lines) + f"\n{caption(rows)}\n"


def all_columns(rows):
    """Returns title and text of all columns: of the first measure after each budget, of others after the last."""
    names = [name for name in rows[0] if any(row[name] for row in rows)]
    measures = [match for match in map(MEASURE.fullmatch, names) if match]
    budgets = [int(match[2]) for match in measures]
    for name in names:
        match = MEASURE.fullmatch(name)
        # Errors after each budget are those of the first measure.
        is_shown = not (measures and name.startswith("after_"))
        is_shown &= match is None or match[1] == measures[0][1] or int(match[2]) == max(budgets)
        if name in TEXT | IN_CAPTION or name.endswith(("_low", "_high")) or not is_shown:
            continue
        title, factor, decimals = described(name)
        has_interval = f"{name}_low" in names and not name.startswith("after_")
        yield title.replace("{reference}", rows[0].get("reference", "")), show(name, factor, decimals, has_interval)


def caption(rows):
    """Returns a line with the provenance of a table."""
    row, last = (chosen(rows, key=lambda row: row["date"]) for chosen in (min, max))
    dated = [f"`{it['commit'][:12]}`, {it['date'][:10]}" for it in (row, last)]
    parts = [f"Commit {dated[0]}" if row["commit"] == last["commit"] else f"Commits {dated[0]}, to {dated[1]}"]
    parts += [f"SHA-256 `{row['protocol_sha256'][:8]}…`"] if row["protocol_sha256"] else []
    parts += [f"{row['objects']} objects"] if row.get("objects") else []
    trials = sorted({int(row["trials"]) + int(row.get("failures") or 0) for row in rows if row.get("trials")})
    parts += [f"{' to '.join(map(str, [trials[0], trials[-1]][: len(trials)]))} trials per planner"] if trials else []
    failures = sum(int(row.get("failures") or 0) for row in rows)
    parts += [f"{failures or 'none'} failed"] if trials else []
    return ", ".join(parts) + "."


# Pages and figure.


def update(root, results, texts, is_check):
    """Writes `texts` by file, tables and figure, or compares them; returns the exit code."""
    shown = set()
    for path in (path for pattern in PAGES for path in sorted(root.glob(pattern))):
        page = path.relative_to(root).as_posix()
        text = path.read_text()
        if len(re.findall("^<!-- table: ", text, re.MULTILINE)) != len(BLOCK.findall(text)):
            raise Bad(f"{page}: a table lacks the line `<!-- end -->`, or has other words in its first line")

        def replaced(match, page=page):
            if match[1] not in results:
                raise Bad(f"{page}: table {match[1]}: allowed are {', '.join(results)}")
            shown.add(match[1])
            return f"<!-- table: {match[1]} -->\n\n{table(page, match[1], results[match[1]])}\n<!-- end -->"

        texts[path] = BLOCK.sub(replaced, text)
    results = dict(sorted(results.items()))
    panels = {name: panel(rows) for name, rows in results.items() if is_protocol(rows)}
    texts[root / FIGURE] = commits_figure.svg(panels)
    code = 0
    for path, text in texts.items():
        before = path.read_text() if path.exists() else None
        if text == before:
            continue
        if is_check:
            print(f"{path} differs from benches/results: run `python3 benches/results.py write`", file=sys.stderr)
            code = 1
        else:
            path.parent.mkdir(parents=True, exist_ok=True)
            path.write_text(text)
            print(f"wrote {path}")
    for name in results.keys() - shown:
        print(f"no page has `<!-- table: {name} -->`: add it and `<!-- end -->`", file=sys.stderr)
        code = 1
    return code


def panel(rows):
    """Returns the panel of a protocol in the figure: its first measure after the last budget, or its error."""
    measures = [match for match in map(MEASURE.fullmatch, rows[0]) if match]
    last = max((int(match[2]) for match in measures if match[1] == measures[0][1]), default=0)
    name = f"{measures[0][1]}_after_{last}" if measures else "error"
    title, factor, _ = described(name)
    dates = {row["commit"]: (row["date"], row["commit"], row["protocol_sha256"]) for row in rows}
    commits = sorted(dates.values())
    place = {commit: index for index, (_, commit, _) in enumerate(commits)}
    series = {}
    for row in rows:
        values = [factor * float(row[it]) if row.get(it) else None for it in (name, f"{name}_low", f"{name}_high")]
        if values[0] is not None:
            series.setdefault(label(row).replace("`", ""), []).append((place[row["commit"]], *values))
    title = title.replace("{reference}", rows[-1].get("reference", ""))
    return commits_figure.Panel(title, commits, {name: sorted(points) for name, points in series.items()})


if __name__ == "__main__":
    sys.exit(main())
