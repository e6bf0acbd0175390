"""The notebook runs, and prints what stands in it; `GOLDEN=write` writes its outputs anew."""

import os

import nbformat
from nbclient import NotebookClient

from conftest import ROOT

NOTEBOOK = ROOT / "docs/notebooks/record-to-controller.ipynb"


def printed(notebook):
    """The texts that the cells print, without pictures."""
    return [
        output.get("text") or output["data"]["text/plain"]
        for cell in notebook.cells
        for output in cell.get("outputs", [])
        if "image/png" not in output.get("data", {})
    ]


def pictures(notebook):
    return [output for cell in notebook.cells for output in cell.get("outputs", []) if "image/png" in output.get("data", {})]


def test_the_notebook_prints_what_stands_in_it():
    stored = nbformat.read(NOTEBOOK, as_version=4)
    fresh = nbformat.from_dict(stored)
    NotebookClient(fresh, timeout=120, resources={"metadata": {"path": str(ROOT)}}).execute()
    if os.environ.get("GOLDEN") == "write":
        for cell in fresh.cells:
            cell.metadata.pop("execution", None)
        nbformat.write(fresh, NOTEBOOK)
        return
    assert len(pictures(fresh)) == len(pictures(stored)) == 3
    assert printed(fresh) == printed(stored), "GOLDEN=write pytest python/tests/test_notebook.py"
