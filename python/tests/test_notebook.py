"""The notebook runs, and prints what stands in it; `GOLDEN=write` writes its outputs anew."""

import os

import nbformat
from nbclient import NotebookClient

from conftest import ROOT

NOTEBOOK = ROOT / "docs/notebooks/record-to-controller.ipynb"


def outputs(notebook):
    """What the cells put out but for stderr, where a slow machine has warnings of its own."""
    every = [output for cell in notebook.cells for output in cell.get("outputs", [])]
    return [output for output in every if output.get("name") != "stderr"]


def printed(notebook):
    """The texts that the cells print, without pictures."""
    return [output.get("text") or output["data"]["text/plain"] for output in outputs(notebook) if not is_picture(output)]


def pictures(notebook):
    return [output for output in outputs(notebook) if is_picture(output)]


def is_picture(output):
    return "image/png" in output.get("data", {})


def test_the_notebook_prints_what_stands_in_it():
    """Run in its own folder, as Jupyter does."""
    stored = nbformat.read(NOTEBOOK, as_version=4)
    fresh = nbformat.from_dict(stored)
    NotebookClient(fresh, timeout=120, resources={"metadata": {"path": str(NOTEBOOK.parent)}}).execute()
    if os.environ.get("GOLDEN") == "write":
        for cell in fresh.cells:
            cell.metadata.pop("execution", None)
        nbformat.write(fresh, NOTEBOOK)
        return
    assert len(pictures(fresh)) == len(pictures(stored)) == 3
    assert printed(fresh) == printed(stored), "GOLDEN=write pytest python/tests/test_notebook.py"
