"""Tests that no modules of the package import each other in a circle."""

from __future__ import annotations

import ast
from graphlib import TopologicalSorter
from pathlib import Path

import palpate

FOLDER = Path(palpate.__file__).parent


def imports(path: Path, modules: set[str]) -> set[str]:
    """Returns the modules of the package that a file imports, also in functions and for types."""
    found: set[str] = set()
    for node in ast.walk(ast.parse(path.read_text(encoding="utf-8"))):
        if isinstance(node, ast.ImportFrom) and node.level == 1:
            found |= {node.module} if node.module else {name.name for name in node.names}
    return found & modules


def test_no_modules_import_each_other_in_a_circle() -> None:
    paths = {path.name.split(".")[0]: path for path in sorted(FOLDER.glob("*.py*")) if path.suffix != ".pyc"}
    assert len(paths) > 15
    graph = {name: imports(path, set(paths)) for name, path in paths.items()}
    assert "_run" in graph["_experiment"]
    order = list(TopologicalSorter(graph).static_order())
    assert order[-1] != "errors"
