"""The command, the sample record, and what tests share."""

import csv
import os
import subprocess
from pathlib import Path

import matplotlib
import numpy as np
import pytest

matplotlib.use("Agg")

ROOT = Path(__file__).resolve().parents[2]
SAMPLE = ROOT / "data/sample_hysteresis.csv"


class Command:
    """The command `vsj` that was built from the same sources; `VSJ` names its file."""

    def __init__(self):
        self.path = os.environ.get("VSJ", str(ROOT / "target/release/vsj"))

    def __call__(self, *arguments):
        run = [self.path, *map(str, arguments)]
        return subprocess.run(run, capture_output=True, text=True, cwd=ROOT, check=True).stdout

    def error(self, *arguments):
        """The line on stderr of a command that ends with 2, without the program's name."""
        run = subprocess.run([self.path, *map(str, arguments)], capture_output=True, text=True, cwd=ROOT)
        assert run.returncode == 2, run
        return run.stderr.strip().splitlines()[-1].removeprefix("vsj: ")


@pytest.fixture(scope="session")
def command():
    return Command()


@pytest.fixture(scope="session")
def sample():
    """Arrays of the sample record by column."""
    with open(SAMPLE) as file:
        rows = list(csv.DictReader(line for line in file if not line.startswith("#")))
    return {name: np.array([float(row[name]) for row in rows]) for name in rows[0]}


@pytest.fixture(scope="session")
def diagnosis():
    import vsj

    return vsj.diagnose(SAMPLE, effort="quick")
