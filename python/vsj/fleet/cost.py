"""Time, price and bottleneck of a larger fleet, computed from a smaller one.

What is measured: CPU time and size of each record, from the table of results; size of a row, from its file; the time that a task costs
the scheduler and this program, by running empty tasks. What is computed, for R records in batches of B on C cores:

    CPU time           R s                       s: mean CPU time of a record
    limit of the cores R s / C
    tasks              T = R / B + C ln B        the last C B records are in smaller batches; fewer than R
    limit of the scheduler  T o                  o: time of an empty task, one after the other
    limit of the store 3 T / 3500 s              a part is one PUT, COPY and DELETE,
                       (R + 2 T) / 5500 s        and two GETs at the end; a record is one GET
    the end            2 T 0.1 s / 32            the parts are read twice, 32 at a time
    time               the largest limit, s for the last record, and the end
    cores that help    B s / o                   with more the scheduler is the bottleneck

3500 and 5500 are the requests of each kind in a second that Amazon S3 guarantees for one prefix, 0.1 s is the lower end of the latency that
it names for small objects (its user guide, "Best practices design patterns: optimizing Amazon S3 performance"); a local disk is faster.
"""

import dataclasses
import math
import posixpath
import time

from distributed import Client, LocalCluster, as_completed

from .. import BadInput
from . import store
from .records import filesystem, readable

CORES, PRICE = 100, 0.04
"""Cores, and the price of one for an hour, unless others are given."""
PUTS_PER_S, GETS_PER_S = 3500, 5500
"""Requests in a second that an object store guarantees for one prefix."""
GET_S = 0.1
"""Latency of a request, in s."""
_CLIENT_BYTES = 900
"""Memory of this program for each record: name, spring, time, key, place of its row (measured with 300 000)."""
_TASKS = 2000


@dataclasses.dataclass(frozen=True)
class Measured:
    """What a smaller fleet has shown."""

    records: int
    seconds: float
    """Mean CPU time of a record, in s."""
    record_bytes: float
    row_bytes: float
    task_s: float
    """Time of an empty task."""


@dataclasses.dataclass(frozen=True)
class Estimate:
    """A larger fleet. Times in s."""

    records: int
    cores: int
    price: float
    batch: int
    cpu_s: float
    limits: dict
    """Time that each limit alone would take."""
    bottleneck: str
    end_s: float
    """Time to gather the parts."""
    time_s: float
    cost: float
    useful_cores: int
    read_bytes: float
    written_bytes: float
    memory_bytes: float


def measured(out):
    """What the results in ``out`` and this machine show."""
    fs, path = filesystem(out)
    table = posixpath.join(path, store.TABLE)
    with readable(table, "results"):
        try:
            table_bytes = fs.size(table)
        except FileNotFoundError:
            raise BadInput(f"{out}: no {store.TABLE}; expected the results of a smaller fleet") from None
    count, seconds, size = 0, 0.0, 0
    for row in store.rows(out):
        if row["seconds"] is not None and row["bytes"] is not None:
            count, seconds, size = count + 1, seconds + row["seconds"], size + row["bytes"]
    if not count:
        raise BadInput(f"{out}: no record with a time; expected one or more")
    return Measured(count, seconds / count, size / count, table_bytes / count, task_s())


def task_s():
    """The time of an empty task, in s: 2000 of them, at most 100 in progress, one process on this machine."""
    with LocalCluster(n_workers=1, threads_per_worker=1, dashboard_address=":0", silence_logs="CRITICAL") as cluster, Client(cluster) as client:
        client.submit(_nothing, -1, pure=False).result()
        start = time.perf_counter()
        completed = as_completed([client.submit(_nothing, it, pure=False) for it in range(100)])
        for number, _ in enumerate(completed):
            if number < _TASKS - 100:
                completed.add(client.submit(_nothing, number, pure=False))
        return (time.perf_counter() - start) / _TASKS


def _nothing(number):
    return number


def estimate(it, count, cores, price, batch):
    """The cost of ``count`` records on ``cores`` cores."""
    tasks = min(count, count / batch + cores * math.log(batch))
    cpu_s = count * it.seconds
    limits = {
        "cores": cpu_s / cores,
        "scheduler": tasks * it.task_s,
        "object store": max(3 * tasks / PUTS_PER_S, (count + 2 * tasks) / GETS_PER_S),
    }
    bottleneck = max(limits, key=limits.get)
    end_s = 2 * tasks * GET_S / store.READERS
    time_s = limits[bottleneck] + it.seconds + end_s
    return Estimate(
        records=count,
        cores=cores,
        price=price,
        batch=batch,
        cpu_s=cpu_s,
        limits=limits,
        bottleneck=bottleneck,
        end_s=end_s,
        time_s=time_s,
        cost=time_s / 3600 * cores * price,
        useful_cores=max(1, int(batch * it.seconds / it.task_s)),
        read_bytes=count * it.record_bytes,
        written_bytes=2 * count * it.row_bytes,
        memory_bytes=count * _CLIENT_BYTES,
    )


def as_json(measured, estimate):
    """Both as one JSON object."""
    return {"schema": 1, "measured": dataclasses.asdict(measured), "estimate": dataclasses.asdict(estimate)}


def text(it, of):
    """Both as a table."""
    lines = [
        ("measured on", f"{it.records} records"),
        ("CPU time of a record", f"{it.seconds:.3f} s"),
        ("record, row of the result", f"{it.record_bytes / 1e3:.1f} kB, {it.row_bytes / 1e3:.2f} kB"),
        ("empty task", f"{1e3 * it.task_s:.2f} ms"),
        ("", ""),
        (f"{of.records} records in batches of {of.batch}", f"on {of.cores} cores"),
        ("CPU time", _hours(of.cpu_s)),
        *((f"limit of the {name}", _hours(seconds)) for name, seconds in of.limits.items()),
        ("bottleneck", of.bottleneck),
        ("gathering the parts", _hours(of.end_s)),
        ("time", _hours(of.time_s)),
        (f"price at {of.price:g} for a core and hour", f"{of.cost:.2f}"),
        ("cores that the scheduler keeps busy", f"{of.useful_cores}"),
        ("read, written", f"{of.read_bytes / 1e9:.2f} GB, {of.written_bytes / 1e9:.2f} GB"),
        ("memory of this program", f"{of.memory_bytes / 1e9:.2f} GB"),
    ]
    return "".join(f"{name:<40}{value}".rstrip() + "\n" for name, value in lines)


def _hours(seconds):
    return f"{seconds / 3600:.2f} h" if seconds >= 360 else f"{seconds:.1f} s"
