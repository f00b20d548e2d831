"""Tests that the command lines of the guides work with the installed program, in order, in an empty folder.

Each line is classified by `RULES`; a line that no rule matches fails. The times are in target/commands.txt.
"""

import os
import re
import subprocess
import sys
import time
from pathlib import Path

import palpate
import pytest

ROOT = Path(__file__).parents[2]
GENERATED = ("reference.md", "hard-cases.md")
PAGES = [
    *sorted(page for page in (ROOT / "docs").glob("*.md") if page.name not in GENERATED),
    *(ROOT / name for name in ("README.md", "experiments/README.md", "python/README.md")),
]
#: Longest time of a shortened command, in seconds, on a machine that does other work.
LIMIT_S = 120

#: Fewer trials and places, and no figures.
SHORT = "--set trials=2 --set grid=9 --no-report"
#: For slow touches and many objects also fewer touches.
SHORTEST = "--set trials=1 --set initial_touches=2 --set touches=4 --set grid=9 --no-report"
#: Start of a command, its class, what is appended to shorten it, and the reason; the first rule that matches holds.
#: Classes: run; parsed: its arguments are accepted; robot: parsed, needs a robot, a camera or ROS; checkout: needs the
#: repository, which the page names; install: changes the machine.
RULES = [
    (r"pip install|cargo install|cp \.deps", "install", "", "changes the machine"),
    (r"make |cargo |cd python/baselines|python train\.py", "checkout", "", "builds or tests the repository"),
    (r"palpate run toy .*policy:Trained", "checkout", "", "the planner lies in python/baselines; test_planners.py"),
    (r"palpate (serve|register experiments/|doctor --arm|export --topic)", "robot", "", "tests/suite/lab*.rs"),
    (r"palpate (run|live|show|identify \S+) (real_|my-experiment|my-ur5e|my-scene)", "robot", "", "tests/suite/lab*.rs"),
    (r"ros2 |chronyc ", "robot", "", "commands of ROS and of the robot's computer"),
    (r"palpate live", "parsed", "", "serves until it is stopped; tests/suite/live.rs"),
    (r"bash experiments/slurm", "parsed", "", "needs Slurm; tests/clusters/test.sh"),
    (r"git clone ", "install", "", "needs the network"),
    (r"palpate benchmark ycb", "parsed", "", "needs meshes that are not shipped; tests/suite/benchmark.rs"),
    (r"palpate benchmark --planner", "parsed", "", "20 min; --quick runs"),
    (r"palpate compare --sensors", "parsed", "", "30 min; tests/suite/sensors.rs"),
    (r"palpate accuracy", "parsed", "", "its reference is slow; tests/suite/accuracy.rs and relevance.rs"),
    (r"palpate run .*--plan ", "run", "--set touches=21", "runs a few trials to estimate the time"),
    (r"palpate run (suite_library|lookalikes)", "run", f"{SHORTEST} --set recognition.particles=16", "slow touches"),
    (r"palpate run \S*(finger|pa10|strokes|around|suite|arm/|soft/)", "run", SHORTEST, "slow touches"),
    (r"palpate run mug\.toml .*stroke", "run", SHORTEST, "slow touches"),
    (r"palpate run bird( |$)", "run", f"{SHORT} --set touches=60", "a later line exports touch 60"),
    (r"palpate run", "run", SHORT, "fewer trials"),
    (r"palpate report .*report\.trial", "run", "--set report.trial=1", "there are two trials"),
    (r"palpate check \S+\.mcap", "run", "", ""),
    (r"palpate check", "run", "--max-trials 4", "the first four trials are compared byte by byte"),
    (r"palpate calibrate --band", "run", "--trials 1 --set touches=8", "fewer touches"),
    (r"palpate |export |mkdir ", "run", "", ""),
]
#: Readings of a force/torque sensor under 10 N, with its z axis down, up, and along x and y of the base.
POSES = """qx,qy,qz,qw,fx,fy,fz,tx,ty,tz
0,0,0,1,0,0,-10,0,0,0
1,0,0,0,0,0,10,0,0,0
0,0.70710678,0,0.70710678,10,0,0,0,0,0
0.70710678,0,0,0.70710678,0,-10,0,0,0,0
"""
#: A name that stands for another, which a command in a sentence may have.
PLACEHOLDER = re.compile(r"…|\b(?:SCENE|FILE|NAME)\b")

COMMAND = re.compile(r"(?:palpate \S+|make|pip|bash) \S.*")


def classified(line):
    """The rule of a command."""
    for rule in RULES:
        if re.match(rule[0], line):
            return rule
    pytest.fail(f"no rule for `{line}`: run it, or say why not, in RULES")


def commands(text):
    """Commands in the code blocks, numbered lists and tables of a page, in order, without comments."""
    parts = re.split(r"^```(\w*)\n(.*?)^```$", text, flags=re.MULTILINE | re.DOTALL)
    lines = []
    for prose, language, block in zip(parts[::3], [*parts[1::3], ""], [*parts[2::3], ""], strict=True):
        items = re.findall(r"^(?:\d+\. .*(?:\n   .*)*|\|.*)", prose, flags=re.MULTILINE)
        codes = [code for item in items for code in re.findall(r"`([^`]+)`", item)]
        lines += [code for code in codes if COMMAND.fullmatch(code) and not PLACEHOLDER.search(code)]
        lines += block.replace("\\\n", " ").splitlines() if language == "bash" else []
    lines = [re.sub(r"\s+#.*", "", line).strip() for line in lines]
    return [command.strip() for line in lines if line for command in line.split(" && ")]


@pytest.fixture(scope="module")
def times():
    """Rows of the table of times, which is written at the end."""
    rows = []
    yield rows
    file = ROOT / "target/commands.txt"
    file.parent.mkdir(exist_ok=True)
    total = sum(row[0] for row in rows)
    table = "".join(f"{seconds:7.1f}  {kind:<8}  {page:<24}  {line}\n" for seconds, kind, page, line in sorted(rows, reverse=True))
    file.write_text(f"{total:7.1f}  s in all\n{table}")


@pytest.fixture
def folder(tmp_path):
    """A folder with the reader's own files, which the guides name: a mesh, planners, contacts, readings."""
    here = tmp_path / "empty"
    here.mkdir()
    vertices_m, triangles = palpate.read_mesh(palpate_home() / "models/suite/mug.glb")[:2]
    palpate.write_mesh(here / "my-part.stl", 1000 * vertices_m, triangles)
    (here / "my-parts").mkdir()
    palpate.write_mesh(here / "my-parts/mug.stl", 1000 * vertices_m, triangles)
    touched = vertices_m[:: len(vertices_m) // 60]
    rows = [f"{i // 3},{x},{y},{z}\n" for i, (x, y, z) in enumerate(touched.tolist())]
    (here / "contacts.csv").write_text("group,x_m,y_m,z_m\n" + "".join(rows))
    (here / "plate.csv").write_text((ROOT / "tests/real/panda_plane.csv").read_text())
    (here / "poses.csv").write_text(POSES)
    pages = (ROOT / "docs/your-planner.md").read_text() + (ROOT / "docs/python.md").read_text()
    classes = re.findall(r"^class (?:Widest|Lucky).*\n(?:    .*\n)+", pages, flags=re.MULTILINE)
    (here / "my_planner.py").write_text("\n".join([*classes, "MyPlanner = Widest\n"]))
    return here


def palpate_home():
    return Path(palpate.__file__).parent / "home"


@pytest.mark.parametrize("page", PAGES, ids=lambda page: str(page.relative_to(ROOT)))
def test_the_command_lines_of_a_page_work(page, folder, times):
    text = page.read_text()
    path = os.pathsep.join([str(Path(sys.executable).parent), os.environ["PATH"]])
    environment = {**os.environ, "PATH": path, "HOME": str(folder.parent), "XDG_CACHE_HOME": str(folder.parent / "cache")}
    targets = re.findall(r"^([a-z-]+):", (ROOT / "Makefile").read_text(), flags=re.MULTILINE)
    for line in commands(text):
        _, kind, more, _ = classified(line)
        shortened = f"{line} {more}"
        if kind == "checkout":
            assert "checkout" in text, f"say that `{line}` needs a checkout"
            assert not line.startswith("make ") or line.split()[1] in targets, line
        if kind in ("parsed", "robot") and line.startswith(("palpate ", "bash ")):
            shortened = f"{line} --help" if line.startswith("palpate ") else line.replace("bash ", "bash -n ", 1)
        elif kind != "run":
            times.append((0.0, kind, page.name, line))
            continue
        start = time.monotonic()
        result = subprocess.run(
            ["bash", "-c", shortened],
            cwd=folder,
            env=environment,
            stdin=subprocess.DEVNULL,
            capture_output=True,
            text=True,
            timeout=LIMIT_S,
            check=False,
        )
        times.append((time.monotonic() - start, kind, page.name, line))
        assert result.returncode == 0, f"{shortened}\n{result.stdout}{result.stderr}"
