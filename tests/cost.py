#!/usr/bin/env python3
"""Compares the instruction counts of fixed work with a stored table.

    tests/cost.py [TABLE] [--write] [--program PALPATE]

Builds the development build, counts the instructions of one trial of each planner of each experiment in TABLE
(experiments/baselines/cost.toml) with valgrind, subtracts the set-up, and compares with the table within its
tolerance. --write stores the new counts in the table. --program counts an existing program.

Counts of another compiler, target, optimisation or vector width are not comparable. In that case, and without
valgrind, it prints the reason and skips the comparison, which fails only if PALPATE_REQUIRE is 1.

Exit codes: 0 within the tolerance, smaller or skipped, 1 larger, missing, or skipped though required, 2 error.
"""

import argparse
import concurrent.futures
import json
import os
import pathlib
import platform
import subprocess
import sys
import tempfile
import tomllib

ROOT = pathlib.Path(__file__).resolve().parent.parent
# Separately compiled parts have other instruction counts.
BUILD = ["cargo", "build", "--quiet", "--locked", "--features", "ros2"]
WHOLE = {"CARGO_INCREMENTAL": "0", "CARGO_PROFILE_DEV_CODEGEN_UNITS": "2"}
HEAD = """\
# Instructions of one trial of each planner, set-up subtracted. `make test PART=cost` compares the program
# with this table; `tests/cost.py --write` updates it.
"""


class Bad(Exception):
    """Error of an invalid table or program."""


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("table", nargs="?", type=pathlib.Path, default=ROOT / "experiments/baselines/cost.toml")
    parser.add_argument("--write", action="store_true", help="store the counts in the table")
    parser.add_argument("--program", type=pathlib.Path, help="an existing program")
    arguments = parser.parse_args()
    try:
        return run(arguments)
    except (Bad, OSError, tomllib.TOMLDecodeError) as error:
        print(f"error: {error}", file=sys.stderr)
        return 2


def run(arguments):
    table = read(arguments.table)
    by = counted_by()
    if by is None:
        return skipped("no valgrind (Debian: apt-get install valgrind)")
    if not arguments.write and by != table["by"]:
        return skipped(f"the table is for {table['by']}, this is {by}; `tests/cost.py --write` counts anew")
    program = arguments.program
    if program is None:
        succeed(BUILD, env=os.environ | WHOLE, cwd=ROOT)
        program = pathlib.Path(os.environ.get("CARGO_TARGET_DIR", ROOT / "target")) / "debug/palpate"
    counts = [counted(program.resolve(), work) for work in table["work"]]
    if arguments.write:
        for work, now in zip(table["work"], counts):
            work["instructions"] = now
        table["by"] = by
        arguments.table.write_text(text(table))
        print(f"wrote counts of {len(counts)} experiments to {arguments.table}")
        return 0
    return compare(table, counts)


def skipped(reason):
    """Prints why the comparison is skipped; returns the exit code."""
    print(f"cost: skipped, {reason}")
    return 1 if os.environ.get("PALPATE_REQUIRE") == "1" else 0


def read(path):
    """Reads the table with all its keys."""
    try:
        table = tomllib.loads(path.read_text())
    except (OSError, tomllib.TOMLDecodeError, UnicodeDecodeError) as error:
        raise Bad(f"{path}: {error}") from error
    check_keys(path, table, needed={"tolerance": (int, float), "work": list}, optional={"by": str})
    tolerance = table["tolerance"]
    if not 1e-3 <= tolerance <= 1:
        raise Bad(f"{path}: `tolerance` = {tolerance}: allowed is a share of 0.001 to 1")
    table.setdefault("by", "")
    for work in table["work"]:
        check_keys(path, work, needed={"experiment": str}, optional={"set": list, "instructions": dict})
        work.setdefault("set", [])
        work.setdefault("instructions", {})
    return table


def check_keys(path, table, needed, optional):
    """Checks the keys and their types."""
    if not isinstance(table, dict):
        raise Bad(f"{path}: {table!r} is not a table")
    for key in needed:
        if key not in table:
            raise Bad(f"{path}: missing field `{key}`")
    for key, value in table.items():
        kind = (needed | optional).get(key)
        if kind is None:
            raise Bad(f"{path}: unknown field `{key}`, expected one of {', '.join(needed | optional)}")
        if not isinstance(value, kind):
            raise Bad(f"{path}: `{key}` = {value!r} is of the wrong type")


def text(table):
    """Returns the table as text."""
    lines = [HEAD + f"tolerance = {table['tolerance']}", f"by = {json.dumps(table['by'])}"]
    for work in table["work"]:
        lines += ["", "[[work]]", f"experiment = {json.dumps(work['experiment'])}"]
        if work["set"]:
            quoted = [f"'{item}'" if '"' in item else json.dumps(item) for item in work["set"]]
            lines.append(f"set = [{', '.join(quoted)}]")
        lines += ["", "[work.instructions]"]
        lines += [f"{planner} = {count}" for planner, count in sorted(work["instructions"].items())]
    return "\n".join(lines) + "\n"


def counted_by():
    """Returns compiler, target, optimisation, vector width and valgrind version; None without valgrind."""
    try:
        valgrind = succeed(["valgrind", "--version"]).strip()
    except (Bad, OSError):
        return None
    lines = succeed(["rustc", "-vV"], cwd=ROOT).splitlines()
    target = next(line.split()[1] for line in lines if line.startswith("host:"))
    manifest = tomllib.loads((ROOT / "Cargo.toml").read_text())
    level = os.environ.get("CARGO_PROFILE_DEV_OPT_LEVEL") or manifest["profile"]["dev"]["opt-level"]
    return f"{lines[0]}, {target}, level {level}, {vectors()}, {valgrind}"


def vectors():
    """Returns the vector width of loops; valgrind supports at most 256 bits."""
    if platform.machine() == "x86_64":
        for line in pathlib.Path("/proc/cpuinfo").read_text().splitlines():
            if line.startswith("flags") and {"avx2", "fma"} <= set(line.split()):
                return "256-bit vectors"
    return "narrow vectors"


def counted(program, work):
    """Returns the instructions of one trial of each planner, without the set-up."""
    with tempfile.TemporaryDirectory() as folder:
        planners = planners_of(work)

        def trial(planner, run):
            fixed = [program, "--quiet", "run", work["experiment"], "--shard", "1/1", "--threads", "1"]
            sets = [*work["set"], "trials=1", f'planners=["{planner}"]']
            return [*fixed, "--out", f"{folder}/{run}", *(word for it in sets for word in ("--set", it))]

        def instructions(planner, run):
            out = pathlib.Path(folder, f"{run}.cachegrind")
            cachegrind = ["valgrind", "--quiet", "--tool=cachegrind", "--cache-sim=no", f"--cachegrind-out-file={out}"]
            succeed(cachegrind + trial(planner, run), cwd=ROOT)
            return total(out.read_text())

        # A run without new trials costs the set-up.
        succeed(trial(planners[0], "set-up"), cwd=ROOT)
        runs = [(planners[0], "set-up"), *((planner, planner) for planner in planners)]
        with concurrent.futures.ThreadPoolExecutor(os.cpu_count()) as pool:
            without, *each = pool.map(lambda run: instructions(*run), runs)
        return {planner: max(0, count - without) for planner, count in zip(planners, each)}


def planners_of(work):
    """Returns the planners of an experiment with its settings."""
    for item in reversed(work["set"]):
        if item.startswith("planners="):
            return tomllib.loads(item)["planners"]
    path = ROOT / work["experiment"]
    if path.suffix != ".toml":
        path = ROOT / "experiments" / f"{work['experiment']}.toml"
    return tomllib.loads(path.read_text())["planners"]


def total(text):
    """Returns the total of a file written by cachegrind."""
    for line in text.splitlines():
        if line.startswith("summary:"):
            return int(line.split()[1])
    raise Bad("cachegrind wrote no total")


def compare(table, counts):
    """Prints a line per planner; returns the exit code."""
    lines = [("trial", "before", "now", "change", "verdict")]
    verdicts = set()
    for work, now in zip(table["work"], counts):
        before = work["instructions"]
        for planner in sorted(before) + sorted(set(now) - set(before)):
            verdict, change = judge(before.get(planner), now.get(planner), table["tolerance"])
            verdicts.add(verdict)
            millions = [f"{1e-6 * it:.1f}" if it else "–" for it in (before.get(planner), now.get(planner))]
            lines.append((f"{pathlib.Path(work['experiment']).stem}, {planner}", *millions, change, verdict))
    widths = [max(map(len, column)) for column in zip(*lines)]
    print("instructions per trial, millions")
    for first, *others in lines:
        print(first.ljust(widths[0]), *(it.rjust(width) for it, width in zip(others, widths[1:])), sep="  ")
    worst = next(verdict for verdict in ("MISSING", "WORSE", "new", "ok", "better") if verdict in verdicts)
    print(f"{worst} (tolerance {100 * table['tolerance']:g} %)")
    return 1 if worst in ("MISSING", "WORSE") else 0


def judge(before, now, tolerance):
    """Returns the verdict on two counts and the formatted change."""
    if not before or not now:
        return ("new" if now else "MISSING"), "–"
    change = now / before - 1
    verdict = "WORSE" if change > tolerance else "better" if change < -tolerance else "ok"
    return verdict, f"{100 * change:+.2f} %"


def succeed(command, **options):
    """Runs a command and returns its output."""
    ended = subprocess.run(command, stdin=subprocess.DEVNULL, capture_output=True, text=True, **options)
    if ended.returncode:
        raise Bad(f"{command[0]}: {ended.stderr.strip()} (exit code {ended.returncode})")
    return ended.stdout


if __name__ == "__main__":
    sys.exit(main())
