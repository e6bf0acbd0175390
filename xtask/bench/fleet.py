"""Times `python -m vsj.fleet` with two workers and with one, and prints the ratio, with what else the machine did during each run.

Needs an interpreter with `./python[fleet]`, such as target/python-venv/bin/python after `cargo xtask python`. The time is that of the
whole command, the start of the workers included.
"""

import datetime
import json
import os
import pathlib
import resource
import subprocess
import sys
import tempfile
import time

import numpy as np
import psutil
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


def busy():
    """CPU time of this machine and of the programs that this one has run, in s."""
    machine, own = psutil.cpu_times(), resource.getrusage(resource.RUSAGE_CHILDREN)
    return sum(machine[:3]), own.ru_utime + own.ru_stime


def seconds(folder, out, workers):
    """Time of the command in s, and the part of the machine's CPU time that other programs took meanwhile."""
    command = [sys.executable, "-m", "vsj.fleet", folder, "--out", out, "--workers", str(workers), "--batch", "4", "--json"]
    start, before = time.monotonic(), busy()
    answer = json.loads(subprocess.run(command, check=True, stdout=subprocess.PIPE).stdout)
    taken = time.monotonic() - start
    all_s, own_s = (after - earlier for after, earlier in zip(busy(), before))
    if answer["finished_now"] != SPRINGS * RECORDS:
        sys.exit(f"fleet.py: {answer['finished_now']} of {SPRINGS * RECORDS} records are new; expected all")
    return taken, max(0.0, all_s - own_s) / (taken * os.cpu_count())


def main():
    with tempfile.TemporaryDirectory() as scratch:
        scratch = pathlib.Path(scratch)
        write(scratch / "springs")
        best = {1: np.inf, 2: np.inf}
        for turn in range(ROUNDS):
            for workers in best:
                taken, others = seconds(scratch / "springs", scratch / f"out-{turn}-{workers}", workers)
                best[workers] = min(best[workers], taken)
                print(f"{workers} workers: {taken:.1f} s, other programs took {100 * others:.0f} % of the CPU time", flush=True)
        print(f"vsj {vsj.__version__}, {SPRINGS * RECORDS} records of {ROWS} rows: {best[1] / best[2]:.2f} times as fast with 2 workers")


if __name__ == "__main__":
    main()
