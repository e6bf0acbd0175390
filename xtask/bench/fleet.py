"""Times `python -m vsj.fleet` with two workers and with one, and prints the ratio, with the machine's load before each run.

Needs an interpreter with `./python[fleet]`, such as target/python-venv/bin/python after `cargo xtask python`. The time is that of the
whole command, the start of the workers included.
"""

import datetime
import json
import os
import pathlib
import subprocess
import sys
import tempfile
import time

import numpy as np
import vsj
from vsj import _vsj

RANDOM_SEED = 1
SPRINGS, RECORDS, ROWS = 4, 30, 2401
ROUNDS = 2


def write(folder):
    """Records of springs with random gains and time constants, 0.2 % noise."""
    random = np.random.default_rng(RANDOM_SEED)
    time_s = 0.05 * np.arange(ROWS)
    for spring in range(SPRINGS):
        (folder / f"spring-{spring}").mkdir(parents=True)
        for index in range(RECORDS):
            voltage_v = np.repeat(100.0 * random.integers(0, 6, ROWS // 100 + 1), 100)[:ROWS]
            slower = f"schema = 1\n[relaxation]\nshare = 0.0909\ntau_s = {5.5 * random.uniform(0.8, 1.25)}\n"
            stiffness = _vsj.predict(("spring", slower), time_s, voltage_v, "hold") * random.uniform(0.95, 1.05)
            table = np.column_stack([time_s, voltage_v, stiffness + random.normal(size=ROWS)])
            date = datetime.date(2026, 1, 1) + datetime.timedelta(days=index)
            np.savetxt(folder / f"spring-{spring}/{date}.csv", table, "%.9g", ",", header="time_s,voltage_v,stiffness", comments="")


def seconds(folder, out, workers):
    """Time of the command, in s."""
    command = [sys.executable, "-m", "vsj.fleet", folder, "--out", out, "--workers", str(workers), "--batch", "4", "--json"]
    start = time.monotonic()
    answer = json.loads(subprocess.run(command, check=True, stdout=subprocess.PIPE).stdout)
    taken = time.monotonic() - start
    if answer["finished_now"] != SPRINGS * RECORDS:
        sys.exit(f"fleet.py: {answer['finished_now']} of {SPRINGS * RECORDS} records are new; expected all")
    return taken


def main():
    with tempfile.TemporaryDirectory() as scratch:
        scratch = pathlib.Path(scratch)
        write(scratch / "springs")
        best = {1: np.inf, 2: np.inf}
        for turn in range(ROUNDS):
            for workers in best:
                load = os.getloadavg()[0]
                taken = seconds(scratch / "springs", scratch / f"out-{turn}-{workers}", workers)
                best[workers] = min(best[workers], taken)
                print(f"{workers} workers: {taken:.1f} s, load before {load:.1f}", flush=True)
        print(f"vsj {vsj.__version__}, {SPRINGS * RECORDS} records of {ROWS} rows: {best[1] / best[2]:.2f} times as fast with 2 workers")


if __name__ == "__main__":
    main()
