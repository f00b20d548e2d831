#!/usr/bin/env python3
"""Holds the instructions of fixed work against a committed table.

    tests/cost.py [TABLE] [--write] [--program PALPATE]

Builds the development build whole, counts one trial of each planner of each experiment in TABLE
(experiments/baselines/cost.toml) with valgrind, subtracts the set-up, and compares with the table within its
tolerance. --write counts again and writes the table. --program counts a program that is already built.

Counts of another compiler, target, optimisation or vector width are not comparable: then, and where there is no
valgrind, it prints that it is skipped and why, and passes.

Exit codes: 0 within the tolerance, cheaper or skipped, 1 more or missing, 2 could not.
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
# Parts that are compiled apart take other numbers of instructions.
BUILD = ["cargo", "build", "--quiet", "--locked", "--features", "ros2"]
WHOLE = {"CARGO_INCREMENTAL": "0"}
SKIPPED = "cost: skipped, there is no valgrind (Debian: apt-get install valgrind)"
HEAD = """\
# What one trial of each planner costs, in instructions, its set-up taken off. `make check-cost` holds
# the program against it; `tests/cost.py --write` counts again.
"""


class Bad(Exception):
    """A table or a program that is of no use."""


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("table", nargs="?", type=pathlib.Path, default=ROOT / "experiments/baselines/cost.toml")
    parser.add_argument("--write", action="store_true", help="write the counts into the table")
    parser.add_argument("--program", type=pathlib.Path, help="a program that is already built")
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
        print(SKIPPED)
        return 0
    if not arguments.write and by != table["by"]:
        print(f"cost: skipped, counted of {table['by']}, here it is {by}")
        return 0
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
        print(f"counts of {len(counts)} experiments in {arguments.table}")
        return 0
    return compare(table, counts)


def read(path):
    """The table, with every key it may have."""
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
    """Insists on the keys and their types."""
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
    """The table as its file."""
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
    """Compiler, target, optimisation, vectors and valgrind; None where there is no valgrind."""
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
    """How wide the vectors are that loops run on; valgrind knows none above 256 bits."""
    if platform.machine() == "x86_64":
        for line in pathlib.Path("/proc/cpuinfo").read_text().splitlines():
            if line.startswith("flags") and {"avx2", "fma"} <= set(line.split()):
                return "256-bit vectors"
    return "narrow vectors"


def counted(program, work):
    """Instructions of one trial of each planner, without those of the set-up."""
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

        # A run that is already there takes what every run takes beside its trials.
        succeed(trial(planners[0], "set-up"), cwd=ROOT)
        runs = [(planners[0], "set-up"), *((planner, planner) for planner in planners)]
        with concurrent.futures.ThreadPoolExecutor(os.cpu_count()) as pool:
            without, *each = pool.map(lambda run: instructions(*run), runs)
        return {planner: max(0, count - without) for planner, count in zip(planners, each)}


def planners_of(work):
    """The planners of an experiment with its settings."""
    for item in reversed(work["set"]):
        if item.startswith("planners="):
            return tomllib.loads(item)["planners"]
    path = ROOT / work["experiment"]
    if path.suffix != ".toml":
        path = ROOT / "experiments" / f"{work['experiment']}.toml"
    return tomllib.loads(path.read_text())["planners"]


def total(text):
    """The sum of a file that cachegrind wrote."""
    for line in text.splitlines():
        if line.startswith("summary:"):
            return int(line.split()[1])
    raise Bad("cachegrind wrote no sum")


def compare(table, counts):
    """Prints a line for each planner; returns the exit code."""
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
    print("instructions of a trial, in millions")
    for first, *others in lines:
        print(first.ljust(widths[0]), *(it.rjust(width) for it, width in zip(others, widths[1:])), sep="  ")
    worst = next(verdict for verdict in ("MISSING", "WORSE", "new", "ok", "better") if verdict in verdicts)
    print(f"{worst} ({100 * table['tolerance']:g} % are borne)")
    return 1 if worst in ("MISSING", "WORSE") else 0


def judge(before, now, tolerance):
    """The verdict on two counts, and their change in words."""
    if not before or not now:
        return ("new" if now else "MISSING"), "–"
    change = now / before - 1
    verdict = "WORSE" if change > tolerance else "better" if change < -tolerance else "ok"
    return verdict, f"{100 * change:+.2f} %"


def succeed(command, **options):
    """Runs a command to its end and returns its output."""
    ended = subprocess.run(command, stdin=subprocess.DEVNULL, capture_output=True, text=True, **options)
    if ended.returncode:
        raise Bad(f"{command[0]}: {ended.stderr.strip()} (exit code {ended.returncode})")
    return ended.stdout


if __name__ == "__main__":
    sys.exit(main())
