"""Tests that the examples in the guides run unchanged."""

import re
import subprocess
import sys
from pathlib import Path

import pytest

ROOT = Path(__file__).parents[2]


def test_the_examples_of_objects_run(tmp_path):
    blocks = re.findall(r"```python\n(.*?)```", (ROOT / "docs/python.md").read_text(), re.DOTALL)
    ball = "palpate.write_mesh('part.stl', *(lambda m: (1000 * m[0], m[1]))(palpate.Scene.load('bird').mesh()))\n"
    words = ("import palpate", 'object={"mesh"', "comparison =", "class Step")
    code = ball.join(next(block for block in blocks if word in block) for word in words)
    command = [sys.executable, "-c", code + "\nprint(comparison.best, len(comparison.table()) > 0)"]
    result = subprocess.run(command, cwd=tmp_path, capture_output=True, text=True, check=False)
    assert result.returncode == 0, result.stderr
    assert result.stdout.splitlines()[-1].split() == ["active", "True"]


@pytest.mark.parametrize("page", ["docs/your-planner.md", "docs/python.md", "python/README.md"])
def test_the_first_example_prints_a_table(page, tmp_path):
    blocks = re.findall(r"```python\n(.*?)```", (ROOT / page).read_text(), re.DOTALL)
    code = next(block for block in blocks if block.startswith("import palpate"))
    program = tmp_path / "first.py"
    program.write_text(code)
    command = [sys.executable, program]
    result = subprocess.run(command, cwd=tmp_path, capture_output=True, text=True, check=False)
    assert result.returncode == 0, result.stderr
    assert "__main__:Widest" in result.stdout and "active" in result.stdout


#: Pages with examples in Python, and the module that a page calls them.
PAGES = {
    "docs/many-runs.md": "many_runs",
    "docs/python.md": "guide",
    "docs/questions.md": "questions",
    "docs/real-touches.md": "real_touches",
    "docs/your-planner.md": "my_planner",
    "python/README.md": "readme",
}

#: Imports that a page may leave out.
IMPORTS = "import concurrent.futures\nimport palpate\nimport submitit\n"


def test_all_pages_with_examples_are_listed():
    pages = [*ROOT.glob("*.md"), *(ROOT / "docs").glob("*.md"), ROOT / "python/README.md"]
    assert {str(page.relative_to(ROOT)) for page in pages if "```python\n" in page.read_text()} == set(PAGES)


def test_the_types_of_all_examples_are_right(tmp_path):
    """A planner needs no annotations; what it does not annotate is checked too."""
    for page, module in PAGES.items():
        texts = {module: [IMPORTS]}
        for block in re.findall(r"```python\n(.*?)```", (ROOT / page).read_text(), re.DOTALL):
            # A block that begins with the name of a file is one of its own.
            name = re.match(r"# (\w+)\.py\n", block)
            texts.setdefault(name[1] if name else module, []).append(block)
        for name, blocks in texts.items():
            (tmp_path / f"{name}.py").write_text("\n".join(blocks))
    relaxed = ("--allow-untyped-defs", "--allow-incomplete-defs", "--allow-untyped-calls", "--ignore-missing-imports")
    command = [sys.executable, "-m", "mypy", "--strict", *relaxed, "--cache-dir", ROOT / "target/mypy", "."]
    result = subprocess.run(command, cwd=tmp_path, capture_output=True, text=True, check=False)
    assert result.returncode == 0, result.stdout + result.stderr
