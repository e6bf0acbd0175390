"""The engine that distributes the work: Dask on this machine, on SLURM, or at the address of a scheduler."""

import logging
from contextlib import contextmanager

import dask
from distributed import Client, LocalCluster
from distributed.comm import parse_address

from .. import BadInput

LOCAL, SLURM = "local", "slurm"
# A terminal sends Ctrl-C to all processes; this program ends the workers.
_WITHOUT_CTRL_C = "import signal\nsignal.signal(signal.SIGINT, signal.SIG_IGN)\n"


@contextmanager
def connected(scheduler, workers, wait_s):
    """A client of the engine, with at least one worker.

    Parameters
    ----------
    scheduler : str
        ``"local"`` for processes on this machine, ``"slurm"`` for jobs, or the address of a scheduler, ``tcp://HOST:PORT``.
    workers : int or None
        Number of processes or jobs; an address has the workers that it has.
    wait_s : float
        Longest time until the first worker is there, in s.

    Raises BadInput for an address that is none, ConnectionError if no scheduler or no worker answers in time.
    """
    # What goes wrong is said once, by this package.
    for name in ("distributed", "distributed.client"):
        logging.getLogger(name).setLevel(logging.CRITICAL + 1)
    # A lost scheduler is reported, not waited for: the next run goes on.
    with dask.config.set({"distributed.comm.timeouts.connect": f"{min(wait_s, 30)}s"}):
        with _cluster(scheduler, workers) as cluster:
            try:
                client = Client(cluster or scheduler, timeout=wait_s)
            except (OSError, ValueError) as error:
                raise ConnectionError(f"--scheduler {scheduler}: no scheduler answers within {wait_s:g} s") from error
            try:
                client.wait_for_workers(1, timeout=wait_s)
            except TimeoutError as error:
                client.close(timeout=2)
                raise ConnectionError(f"--scheduler {scheduler}: no worker within {wait_s:g} s; expected one or more") from error
            try:
                yield client
            finally:
                client.close(timeout=2)


@contextmanager
def _cluster(scheduler, workers):
    if scheduler == LOCAL:
        # One thread in each process: a diagnosis uses one processor.
        with LocalCluster(
            n_workers=workers,
            threads_per_worker=1,
            dashboard_address=":0",
            silence_logs="CRITICAL",
            preload=[_WITHOUT_CTRL_C],
        ) as cluster:
            yield cluster
    elif scheduler == SLURM:
        try:
            from dask_jobqueue import SLURMCluster
        except ImportError as error:
            raise BadInput(f"--scheduler slurm: {error}; expected: pip install dask-jobqueue") from error
        # Cores, memory, queue and account come from its file, ~/.config/dask/jobqueue.yaml.
        with SLURMCluster() as cluster:
            cluster.scale(jobs=workers or 1)
            yield cluster
    else:
        if not parse_address(scheduler)[0] or "://" not in scheduler:
            raise BadInput(f"--scheduler {scheduler}: expected local, slurm, or an address such as tcp://HOST:8786")
        yield None
