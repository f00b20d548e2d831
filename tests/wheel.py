#!/usr/bin/env python3
"""Tests the package as a new user installs it: from a folder of wheels to the report of an STL file.

    python3.12 tests/wheel.py FOLDER

Creates a virtual environment of the Python that runs it, and works in an empty folder. FOLDER has the wheel or source
distribution of Palpate; its dependencies come from there or from the package index. Prints the time of each command.

Exit codes: 0 all commands succeed, otherwise the first that fails.
"""

import os
import pathlib
import struct
import subprocess
import sys
import tempfile
import time
import venv

#: A box of 60 mm x 40 mm x 30 mm, its corners by the bits of their number.
CORNERS = [(60 * (i & 1), 40 * (i >> 1 & 1), 30 * (i >> 2 & 1)) for i in range(8)]
TRIANGLES = [
    *[(0, 2, 1), (1, 2, 3), (4, 5, 6), (5, 7, 6)],
    *[(0, 1, 4), (1, 5, 4), (2, 6, 3), (3, 6, 7)],
    *[(0, 4, 2), (2, 4, 6), (1, 3, 5), (3, 7, 5)],
]

#: Names that the package exports work without the program.
IN_PYTHON = """
import palpate
run = palpate.Experiment.load("toy", touches=8).run(["active", "random"], trials=2)
assert len(run.trials()) == 4 and len(run.summary()) == 2 * 6, run.summary()
print(palpate.__version__)
"""


def main():
    wheels = pathlib.Path(sys.argv[1]).resolve()
    with tempfile.TemporaryDirectory() as folder:
        begun = time.monotonic()
        place = pathlib.Path(folder)
        venv.create(place / "env", with_pip=True)
        python = place / "env/bin/python"
        work = place / "work"
        work.mkdir()
        (work / "part.stl").write_bytes(stl())
        # A bare environment: no variable of a checkout is left.
        env = {"PATH": f"{python.parent}:/usr/bin:/bin", "HOME": str(place), "LANG": "C.UTF-8"}
        env |= {name: value for name, value in os.environ.items() if name.startswith(("PIP_", "SSL_", "REQUESTS_"))}

        def succeed(*words):
            now = time.monotonic()
            result = subprocess.run(words, cwd=work, env=env, stdout=subprocess.PIPE, stderr=subprocess.STDOUT, text=True)
            shown = " ".join(map(str, words))
            if result.returncode != 0:
                sys.exit(f"{shown}\n{result.stdout}exit code {result.returncode}")
            print(f"{time.monotonic() - now:6.1f} s  {shown.splitlines()[0]}", flush=True)

        succeed(python, "-m", "pip", "install", "--quiet", "--find-links", wheels, "palpate")
        succeed("palpate", "new", "part.stl", "--unit", "mm")
        succeed("palpate", "run", "part.toml", "--set", "trials=2", "--set", "touches=12")
        page = work / "runs/part/report.html"
        assert "<svg" in page.read_text(), page
        print(f"{time.monotonic() - begun:6.1f} s  from an empty environment to {page.name} of part.stl")

        for words in (["doctor"], ["list"], ["show", "bird"], ["run", "bird", "--set", "trials=1", "--set", "touches=22"]):
            succeed("palpate", *words)
        # Simulated with MuJoCo.
        succeed("palpate", "run", "container_finger", "--set", "trials=1", "--set", "touches=6", "--set", 'planners=["random"]')
        succeed(python, "-c", IN_PYTHON)


def stl():
    """Returns the box as binary STL, in millimetres."""
    records = [struct.pack("<12fH", 0, 0, 0, *(x for i in corners for x in CORNERS[i]), 0) for corners in TRIANGLES]
    return b"part".ljust(80) + struct.pack("<I", len(records)) + b"".join(records)


if __name__ == "__main__":
    main()
