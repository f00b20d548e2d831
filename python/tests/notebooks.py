"""Runs notebooks and stores their outputs: `python notebooks.py` for all that are shipped, or for the named ones."""

from __future__ import annotations

import sys
from pathlib import Path

import nbformat
from jupyter_client.manager import AsyncKernelManager
from nbclient import NotebookClient

FOLDER = Path(__file__).parents[2] / "experiments/notebooks"


def executed(file: Path) -> nbformat.NotebookNode:
    """Returns the notebook with the outputs of its cells; exceptions of cells are raised."""
    notebook = nbformat.read(file, as_version=4)
    # Uses Unix sockets instead of ports.
    kernel = AsyncKernelManager(kernel_name="python3", transport="ipc")
    # Does not record cell times, which differ between runs.
    NotebookClient(notebook, km=kernel, timeout=300, record_timing=False).execute()
    notebook.metadata.language_info = {"name": "python"}
    return notebook


def main(files: list[str]) -> None:
    for file in map(Path, files) if files else sorted(FOLDER.glob("*.ipynb")):
        nbformat.write(executed(file), file)


if __name__ == "__main__":
    main(sys.argv[1:])
