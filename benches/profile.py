#!/usr/bin/env python3
"""Where the processor time of eight works goes, and how near its pieces are to the machine: writes docs/speed.md.

    benches/profile.py PROGRAM [--pieces FILE]

PROGRAM has symbols; FILE has the table that `cargo bench --bench limits` printed. Needs perf (Debian: linux-perf).
Run by `make bench BENCH=speed`.
"""

import argparse
import collections
import json
import os
import pathlib
import platform
import re
import resource
import shutil
import subprocess
import sys
import tempfile

ROOT = pathlib.Path(__file__).resolve().parent.parent
# Samples in a second; not a divisor of the clock's, so that samples do not follow a period.
RATE = 997
# Runs of a work; the fastest one is listed, since other programs only slow a run down.
RUNS = 3
# Shares below this are not listed.
LEAST = 0.03

# Works: title, experiment, settings.
WORKS = [
    ("toy", "toy", ["trials=40"]),
    ("bird", "bird", ["trials=4"]),
    ("bird, belief `objects`", "bird", ["trials=2", 'gp="experiments/beliefs/objects.toml"', "touches=80"]),
    ("around an object", "around", ["trials=1", "touches=150"]),
    ("bird, soft finger", "bird_finger", ["trials=1"]),
    ("bird, PA-10", "bird_pa10", ["trials=1", "touches=40"]),
    ("a look, then touches", "container_camera", ["trials=4"]),
    ("strokes", "container_strokes", ["trials=4"]),
]

# Parts of the program by library or function; the first that fits counts.
PARTS = [
    ("MuJoCo", r"^libmujoco|mujoco_rs"),
    ("factorisation, inverse", r"palpate_gp::(dense|cholesky|tiles)"),
    ("covariance", r"palpate_gp::(covariance|kernel|observations)|^libm\."),
    ("prediction", r"palpate_gp::(posterior|batch|reduction|inducing|means)"),
    ("gradient of the likelihood", r"palpate_gp::likelihood"),
    ("searches (DIRECT, BFGS)", r"palpate_gp"),
    ("mesh of the belief", r"palpate_geometry::(implicit|surface|decimate)|fast_surface_nets"),
    ("rays and nearest points", r"palpate_geometry|obvhs"),
    ("skin and electrodes", r"palpate::sim::finger"),
    ("arm and control", r"palpate::sim|palpate_explore::(robot|control|backend|probe)"),
    ("camera", r"palpate_explore::(view|registration)"),
    ("planner", r"palpate_explore::planner"),
    ("belief", r"palpate_explore"),
    ("measures and files", r"palpate::|serde|^libc\.|\balloc\b|\b_?mi_|\[kernel"),
]


class Bad(Exception):
    """Error of a tool or a program."""


def main() -> int:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("program", type=pathlib.Path)
    parser.add_argument("--pieces", type=pathlib.Path)
    arguments = parser.parse_args()
    try:
        rows = [profile(arguments.program.resolve(), *work) for work in WORKS]
        pieces = read_pieces(arguments.pieces.read_text()) if arguments.pieces else ""
    except (Bad, OSError) as error:
        print(f"error: {error}", file=sys.stderr)
        return 2
    (ROOT / "docs/speed.md").write_text(page(rows, pieces))
    return 0


def call(command: list[str], **options) -> str:
    done = subprocess.run(command, capture_output=True, text=True, cwd=ROOT, **options)
    if done.returncode:
        raise Bad(f"{' '.join(command[:3])} …: {done.stderr.strip().splitlines()[-1:]}")
    return done.stdout


def profile(program: pathlib.Path, title: str, experiment: str, sets: list[str]) -> str:
    """Returns the row of a work."""
    with tempfile.TemporaryDirectory() as folder:
        data, out = f"{folder}/perf", f"{folder}/run"
        record = ["perf", "record", "--quiet", "-e", "cpu-clock", "-F", str(RATE), "-o", data, "--"]
        run = [str(program), "--quiet", "run", experiment, "--threads", "1", "--no-report", "--out", out]
        settings = [part for one in ['planners=["active"]', *sets] for part in ("--set", one)]
        spent_s = float("inf")
        for _ in range(RUNS):
            shutil.rmtree(out, ignore_errors=True)
            before = resource.getrusage(resource.RUSAGE_CHILDREN).ru_utime
            call(record + run + settings, env=os.environ | {"RAYON_NUM_THREADS": "1"})
            spent_s = min(spent_s, resource.getrusage(resource.RUSAGE_CHILDREN).ru_utime - before)
        shares = parts(program, data)
        rows = [json.loads(line) for line in pathlib.Path(out, "trials.jsonl").read_text().splitlines()]
    touches = [touch for row in rows for touch in row["touches"]]
    factorisations = sum(touch.get("fit", {}).get("factorisations", 0) for touch in touches) / len(touches)
    # The time of a row is that since the start of its trial.
    moved_s = sum(row["touches"][-1]["outcome"].get("time_s") or 0 for row in rows) / len(touches)
    listed = [f"{part} {100 * share:.0f}" for part, share in shares.most_common() if share >= LEAST]
    print(title, f"{spent_s:.1f} s", listed, sep=": ")
    moved = f"{moved_s:.1f}" if moved_s else "–"
    cells = [title, len(touches), f"{1e3 * spent_s / len(touches):.2f}", f"{factorisations:.1f}", moved, ", ".join(listed)]
    return "|" + "|".join(map(str, cells)) + "|"


def parts(program: pathlib.Path, data: str) -> collections.Counter[str]:
    """Returns the share of each part in the samples; inlined functions count as functions."""
    mapped = call(["perf", "script", "-i", data, "--show-mmap-events", "-F", "ip,dso"])
    place = re.search(rf"\[0x(\w+)\(\w+\) @ (\w+) .*r-xp {re.escape(str(program))}", mapped)
    segments = call(["readelf", "--program-headers", "--wide", str(program)])
    segment = re.search(r"LOAD +0x(\w+) 0x(\w+) .* R E ", segments)
    if not place or not segment:
        raise Bad(f"{program} was not sampled")
    start, offset = (int(number, 16) for number in place.groups())
    at, address = (int(number, 16) for number in segment.groups())
    counts: collections.Counter[str] = collections.Counter()
    own: collections.Counter[int] = collections.Counter()
    for ip, library in re.findall(r"^ *([0-9a-f]+) \((.*)\)$", mapped, re.MULTILINE):
        if library == str(program):
            own[int(ip, 16) - start + offset + address - at] += 1
        else:
            counts[part_of(pathlib.Path(library).name, [])] += 1
    places = "\n".join(map(hex, own))
    frames = call(["addr2line", "-afiC", "-e", str(program)], input=places)
    for one in re.split(r"^0x", frames, flags=re.MULTILINE)[1:]:
        found, *lines = one.splitlines()
        counts[part_of("", lines[::2])] += own[int(found, 16)]
    total = counts.total()
    return collections.Counter({part: count / total for part, count in counts.items()})


# Primitives and code of other crates count as the function that uses them.
OF_OTHERS = re.compile(r"^<?(core|alloc|std|pulp|nalgebra|rayon|simba|hashbrown|[fiu]\d+|usize|\[|palpate_gp::math::(vector|simd))\b|^<\[")


def part_of(library: str, frames: list[str]) -> str:
    """Returns the part of a library, or of the innermost own one of inlined functions."""
    names = [library] if library else [name for name in frames if not OF_OTHERS.match(name)]
    for name in names:
        for part, pattern in PARTS:
            if re.search(pattern, name):
                return part
    return "other"


def read_pieces(text: str) -> str:
    """Returns the table of `cargo bench --bench limits` as rows of a page: time and shares of the machine."""
    rows = []
    for line in text.splitlines():
        found = re.match(r"(.{52}) +([\d.]+) +(\S+) +(\S+) +(\S+) +(\S+)$", line)
        if found:
            name, *numbers = (part.strip() for part in found.groups())
            time, gflops, of_peak, gbytes, of_triad = ("–" if it == "-" else it for it in numbers)
            rows.append(f"|{name}|{time}|{gflops}|{of_peak}|{gbytes}|{of_triad}|")
    return "\n".join(rows)


def page(rows: list[str], pieces: str) -> str:
    table = "\n".join(rows)
    processor = platform.processor() or platform.machine()
    for line in pathlib.Path("/proc/cpuinfo").read_text().splitlines():
        if line.startswith("model name"):
            processor = line.split(": ", 1)[1]
            break
    return f"""# Speed

After this page you know where the time of a touch goes, and how far each piece is from what the machine can do.
`make bench BENCH=speed` writes it. One thread of {processor}; planner `active`.

## Works

Processor time of a touch in the fastest of {RUNS} runs, factorisations of the covariance in it, seconds that the finger
moves, and the share of each part in percent. Samples of the processor's clock, {RATE} in a second, by the innermost
function of Palpate.

|work|touches|ms|factorisations|moves, s|parts, %|
|---|---|---|---|---|---|
{table}

## Pieces

Operations and bytes of a piece in a second, as shares of multiply-adds in registers and of a triad over long arrays,
the most that this machine does (`cargo bench --bench limits`).

|piece|µs|GFLOP/s|% of peak|GB/s|% of triad|
|---|---|---|---|---|---|
{pieces}
"""


if __name__ == "__main__":
    sys.exit(main())
