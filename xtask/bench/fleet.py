"""Times `python -m vsj.fleet` with one worker and with two, for `cargo xtask bench`.

Takes the number of records. Prints one JSON object: their number and rows, the shortest time in s with each number of workers, and the
ratio. The time is that of the whole command, the start of the workers included. On stderr: the time of each run, and what other programs
did meanwhile.
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
from vsj import _vsj

RANDOM_SEED = 1
SPRINGS, ROWS = 4, 2401
WORKERS = (1, 2)
ROUNDS = 2


def write(folder, count):
    """Records of springs with random gains and time constants, 0.2 % noise."""
    random = np.random.default_rng(RANDOM_SEED)
    time_s = 0.05 * np.arange(ROWS)
    for number in range(count):
        voltage_v = np.repeat(100.0 * random.integers(0, 6, ROWS // 100 + 1), 100)[:ROWS]
        slower = f"schema = 1\n[relaxation]\nshare = 0.0909\ntau_s = {5.5 * random.uniform(0.8, 1.25)}\n"
        stiffness = _vsj.predict(("spring", slower), time_s, voltage_v, "hold") * random.uniform(0.95, 1.05)
        table = np.column_stack([time_s, voltage_v, stiffness + random.normal(size=ROWS)])
        date = datetime.date(2026, 1, 1) + datetime.timedelta(days=number // SPRINGS)
        path = folder / f"spring-{number % SPRINGS}/{date}.csv"
        path.parent.mkdir(parents=True, exist_ok=True)
        np.savetxt(path, table, "%.9g", ",", header="time_s,voltage_v,stiffness", comments="")


def busy():
    """CPU time of this machine and of the programs that this one has run, in s."""
    machine, own = psutil.cpu_times(), resource.getrusage(resource.RUSAGE_CHILDREN)
    return sum(machine[:3]), own.ru_utime + own.ru_stime


def seconds(folder, out, workers, count):
    """Time of the command in s, and the part of the machine's CPU time that other programs took meanwhile."""
    command = [sys.executable, "-m", "vsj.fleet", folder, "--out", out, "--workers", str(workers), "--json"]
    start, before = time.monotonic(), busy()
    answer = json.loads(subprocess.run(command, check=True, stdout=subprocess.PIPE).stdout)
    taken = time.monotonic() - start
    all_s, own_s = (after - earlier for after, earlier in zip(busy(), before))
    if answer["finished_now"] != count:
        sys.exit(f"fleet.py: {answer['finished_now']} of {count} records are new; expected all")
    return taken, max(0.0, all_s - own_s) / (taken * os.cpu_count())


def main():
    count = int(sys.argv[1])
    best = dict.fromkeys(WORKERS, np.inf)
    with tempfile.TemporaryDirectory() as scratch:
        scratch = pathlib.Path(scratch)
        write(scratch / "springs", count)
        for turn in range(ROUNDS):
            for workers in WORKERS:
                taken, others = seconds(scratch / "springs", scratch / f"out-{turn}-{workers}", workers, count)
                best[workers] = min(best[workers], taken)
                print(f"{workers} workers: {taken:.1f} s, other programs took {100 * others:.0f} % of the CPU time", file=sys.stderr)
    one_s, two_s = best.values()
    print(json.dumps({"records": count, "rows": ROWS, "one_worker_s": one_s, "two_workers_s": two_s, "speed_up": one_s / two_s}))


if __name__ == "__main__":
    main()
