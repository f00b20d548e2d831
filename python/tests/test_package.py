"""Tests of the names of the package."""

import subprocess
import sys
import types

import palpate


def test_dir_lists_the_public_names_and_nothing_else():
    names = dir(palpate)
    assert names == sorted(names) == sorted(palpate.__all__) and len(set(names)) == len(names)
    modules = [name for name in names if isinstance(getattr(palpate, name), types.ModuleType)]
    assert modules == ["colours", "errors"]
    own = {name for name in names if not name.startswith("_")}
    assert own == set(names) - {"__version__"}
    # What the package itself defines is listed.
    defined = {
        name
        for name, value in vars(palpate).items()
        if not name.startswith("_") and getattr(value, "__module__", "").startswith("palpate")
    }
    assert defined <= own


def test_lazy_names_are_listed_before_they_are_imported():
    code = (
        "import sys, palpate\n"
        "print('GaussianProcess' in dir(palpate), 'sklearn' in sys.modules)\n"
        "from palpate import *\n"
        "print(GaussianProcess.__name__, benchmark.__name__)"
    )
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True)
    assert done.stdout.split() == ["True", "False", "GaussianProcess", "benchmark"]


def test_results_cannot_be_changed():
    import dataclasses

    results = [value for name in dir(palpate) if dataclasses.is_dataclass(value := getattr(palpate, name))]
    assert {it.__name__ for it in results} >= {"AccuracyResult", "BenchmarkResult", "Check", "SuiteComparison"}
    assert all(it.__dataclass_params__.frozen for it in results)
