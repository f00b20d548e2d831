"""Fixture that runs the package's program as a command."""

import os
import subprocess
import sys
from pathlib import Path

import pytest

sys.path.insert(0, str(Path(__file__).parent))


@pytest.fixture
def program():
    command = Path(sys.executable).with_name("palpate")

    def run(*arguments, cwd=None):
        words = [str(command), "--quiet", *map(str, arguments)]
        result = subprocess.run(words, cwd=cwd or os.path.dirname(__file__), capture_output=True, text=True)
        assert result.returncode == 0, result.stderr
        return result.stdout

    return run
