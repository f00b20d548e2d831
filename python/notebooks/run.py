"""Runs notebooks and keeps what they show: `python run.py` all beside it, or those that are named."""

from __future__ import annotations

import sys
from pathlib import Path

import nbformat
from jupyter_client.manager import AsyncKernelManager
from nbclient import NotebookClient

HERE = Path(__file__).parent


def executed(file: Path) -> nbformat.NotebookNode:
    """The notebook with what its cells show; what raises, raises."""
    notebook = nbformat.read(file, as_version=4)
    # Sockets of this machine, not ports.
    kernel = AsyncKernelManager(kernel_name="python3", transport="ipc")
    # Not with the time of each cell, which would differ with every run.
    NotebookClient(notebook, km=kernel, timeout=300, record_timing=False).execute()
    notebook.metadata.language_info = {"name": "python"}
    return notebook


def main(files: list[str]) -> None:
    for file in map(Path, files) if files else sorted(HERE.glob("*.ipynb")):
        nbformat.write(executed(file), file)


if __name__ == "__main__":
    main(sys.argv[1:])
