"""Build backend of the Python package: maturin, with MuJoCo's library and the shipped files in place.

`pip install .` and the source distribution build with it; `python3 backend.py` only copies the shipped files,
as the Makefile does before it calls maturin.
"""

import importlib.util
import os
import shutil
import subprocess
import sys
import tempfile
from pathlib import Path

PACKAGE = Path(__file__).parent
ROOT = PACKAGE.parent
HOME = PACKAGE / "palpate/home"


def copy_home(mujoco_licences):
    """Copies experiments, scenes, models and licences into the package."""
    shutil.rmtree(HOME, ignore_errors=True)
    for name in ("experiments", "scenes", "models"):
        shutil.copytree(ROOT / name, HOME / name, ignore=shutil.ignore_patterns("*.rs"))
    licences = HOME / "licences"
    licences.mkdir()
    for file in ROOT.glob("LICENSE-*"):
        shutil.copy(file, licences)
    shutil.copytree(mujoco_licences, licences / "mujoco")
    listed = [sys.executable, ROOT / ".cargo/licences.py", "--package", "palpate-python"]
    text = subprocess.run(listed, cwd=ROOT, check=True, stdout=subprocess.PIPE).stdout
    (licences / "packages.txt").write_bytes(text)


def build_wheel(wheel_directory, config_settings=None, metadata_directory=None):
    """Builds the wheel (PEP 517) with the MuJoCo library of the Python package `mujoco`, a build requirement."""
    import maturin

    mujoco = Path(importlib.util.find_spec("mujoco").origin).parent
    library = next(mujoco.glob("libmujoco.so.*"))
    copy_home(next(mujoco.parent.glob("mujoco-*.dist-info")) / "licenses")
    with tempfile.TemporaryDirectory() as folder:
        # The linker looks for the name without a version.
        for name in (library.name, "libmujoco.so"):
            os.symlink(library, Path(folder, name))
        os.environ["MUJOCO_DYNAMIC_LINK_DIR"] = folder
        os.environ["LD_LIBRARY_PATH"] = os.pathsep.join(
            filter(None, [folder, os.environ.get("LD_LIBRARY_PATH")])
        )
        # The library is copied into a wheel only if its tag names the C library: here this machine's.
        tag = os.confstr("CS_GNU_LIBC_VERSION").replace("glibc ", "manylinux_").replace(".", "_")
        given = os.environ.get("MATURIN_PEP517_ARGS", "")
        os.environ["MATURIN_PEP517_ARGS"] = f"{given} --compatibility {tag}"
        return maturin.build_wheel(wheel_directory, config_settings, metadata_directory)


def build_sdist(sdist_directory, config_settings=None):
    """Builds the source distribution (PEP 517)."""
    import maturin

    return maturin.build_sdist(sdist_directory, config_settings)


if __name__ == "__main__":
    copy_home(ROOT / ".deps/lib/licences")
