"""Diagnoses of a fleet: thousands of records of hundreds of springs, on any number of machines.

In comes a folder or an object store with records, or a manifest that lists them. Out come one table with a row for each record,
``diagnoses.parquet``, and one page, ``fleet.html``: which causes, in which springs, since when. The command is
``python -m vsj.fleet``; Dask distributes the work.

| module | what it is |
| --- | --- |
| ``records`` | which records there are: path, spring, time and plant of each |
| ``settings`` | what a diagnosis depends on besides its record, and the key of a result |
| ``work`` | what a worker does: records in, rows out |
| ``store`` | rows in Parquet files, each written whole or not at all; which records are finished |
| ``cluster`` | the engine: this machine, SLURM, or a scheduler by its address |
| ``run`` | the loop that keeps a bounded number of batches in progress |
| ``chart`` | the control chart of a parameter |
| ``report`` | what a summary says, as data classes |
| ``summary`` | causes and drifts of each spring, from the table |
| ``page``, ``figure`` | the summary as one HTML page with its charts |
| ``cost`` | time, price and bottleneck of a larger fleet, computed from a smaller one |
| ``command`` | the command line |
"""

__all__ = ["read"]


def __getattr__(name):
    # Not imported above: `python -m vsj.fleet` imports this first, and says itself which package is missing.
    if name == "read":
        from .store import read

        return read
    raise AttributeError(f"module {__name__!r} has no attribute {name!r}")
