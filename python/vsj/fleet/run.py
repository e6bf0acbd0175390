"""The loop that has records diagnosed: a bounded number of batches in progress, none done twice, none lost.

A batch whose worker dies is given to another by Dask, three times. Then its records are set aside. They are tried when all others are
finished, one at a time, since Dask counts a death against everything that waits at the worker; one that ends its worker again has a row
that says so. If the scheduler is lost, the run ends; the next one goes on with what is not finished.
"""

import signal
import threading
import time
from concurrent.futures import CancelledError
from contextlib import contextmanager

import numpy as np
from distributed import KilledWorker, TimeoutError, as_completed
from distributed.comm import CommClosedError

from . import store, work

_AHEAD = 3
"""Batches in progress for each thread of a worker: one that is computed, and two that wait there."""
_POLL_S = 0.01
"""Time between two looks at what has ended, in s."""
_ASK_S = 1.0
"""Time between two questions for the workers, while nothing ends, in s."""


def next_size(left, batch_size, threads):
    """Number of records in the next batch: ``batch_size``, and towards the end the part of what is ``left`` that each thread has.

    So at the end the threads wait for one record at most, not for a batch (guided self-scheduling, Polychronopoulos and Kuck 1987).
    """
    return min(batch_size, -(-left // threads))


class SchedulerLost(ConnectionError):
    """The scheduler has gone, or every worker, and with it the work in progress."""


class Outcome:
    """Key and status of the result of each record, in the order of the records."""

    def __init__(self, count):
        self.keys = np.full(count, b"", "S32")
        self.failed = np.zeros(count, bool)
        self.refused = 0
        self.before = 0
        """Records that were finished before this run."""
        self.new = 0
        """Records that were diagnosed, refused or failed in this run."""

    def add(self, start, done):
        """Take in what a worker answers for the batch that begins at record ``start``."""
        for index, (key, status, is_new) in enumerate(done, start):
            self.keys[index] = (key or "").encode()
            self.failed[index] = status == work.FAILED
            self.refused += status == work.REFUSED
            self.new += is_new
            self.before += not is_new

    def key(self, index):
        """The key of a record's row, ``None`` for a failed one."""
        return self.keys[index].decode() or None


@contextmanager
def interrupts():
    """A list with an entry for each Ctrl-C: Python drops a KeyboardInterrupt that is raised in a destructor, such as that of a future."""
    noted = []

    def note(*_):
        noted.append(True)
        raise KeyboardInterrupt

    if threading.current_thread() is not threading.main_thread():
        # Only there a signal arrives.
        yield noted
        return
    before = signal.signal(signal.SIGINT, note)
    try:
        yield noted
    finally:
        signal.signal(signal.SIGINT, before)


class _Workers:
    """The workers, which may all leave for good."""

    def __init__(self, client, wait_s):
        self._client, self._wait_s = client, wait_s
        self._asked = self._seen = time.monotonic()

    def ended(self, completed):
        """The futures of ``completed`` as they end."""
        while not completed.is_empty():
            if completed.has_ready():
                self._seen = time.monotonic()
                yield next(completed)
            else:
                time.sleep(_POLL_S)
                self._expect()

    def result(self, future):
        """The result of a future that has ended: that of a worker which has left since is computed again."""
        while True:
            try:
                return future.result(timeout=_ASK_S)
            except TimeoutError:
                # Not that of the work.
                if future.status == "error":
                    raise
                self._expect()

    def _expect(self):
        """Raises SchedulerLost after the longest time without a worker."""
        now = time.monotonic()
        if now - self._asked < _ASK_S:
            return
        self._asked = now
        if self._client.nthreads():
            self._seen = now
        elif now - self._seen >= self._wait_s:
            raise SchedulerLost(f"no worker for {self._wait_s:g} s; expected one or more")


def run(client, records, settings, plants, folder, out, batch_size, on_progress, wait_s):
    """Diagnose what is not finished.

    Parameters
    ----------
    client : distributed.Client
    records : pyarrow.Table
        From :func:`records.listed`.
    settings : Settings
    plants : dict
        Text of each plant by its name in ``records``, ``None`` for a name that the library knows.
    folder, out : str
        Addresses of records and results.
    batch_size : int
        Most records in one task and one part.
    on_progress : callable
        Called with the :class:`Outcome` after each batch.
    wait_s : float
        Longest time without a worker, in s.

    Returns
    -------
    Outcome

    Raises
    ------
    SchedulerLost
        What is finished stays so.
    """
    finished = _finished(out)
    outcome = Outcome(len(records))

    def batch(start, size):
        rows = records.slice(start, size).to_pylist()
        for row in rows:
            row["finished"] = finished.get(row["record"], {})
        return start, rows

    def submit(start, rows, alone=False):
        wanted = {row["plant"]: plants[row["plant"]] for row in rows}
        future = client.submit(work.diagnose, rows, wanted, settings, folder, out, pure=False)
        in_progress[future] = (start, rows, alone)
        return future

    in_progress, set_aside, following = {}, [], 0
    workers = _Workers(client, wait_s)
    completed = as_completed()

    def fill():
        nonlocal following
        threads = max(1, sum(client.nthreads().values()))
        while len(in_progress) < _AHEAD * threads and following < len(records):
            size = next_size(len(records) - following, batch_size, threads)
            completed.add(submit(*batch(following, size)))
            following += size
        if not in_progress and set_aside:
            completed.add(submit(*set_aside.pop(0), alone=True))

    try:
        fill()
        for future in workers.ended(completed):
            start, rows, alone = in_progress.pop(future)
            try:
                done = workers.result(future)
            except KilledWorker:
                if not alone:
                    set_aside += [(index, [row]) for index, row in enumerate(rows, start)]
                    fill()
                    continue
                row = work.failed(rows[0], f"{rows[0]['record']}: every worker that diagnosed it died")
                store.write_part(out, [row])
                done = [(None, work.FAILED, True)]
            outcome.add(start, done)
            on_progress(outcome)
            fill()
    except Exception as error:
        # Its end shows in the future that is waited for, or in the next request.
        if client.status != "running" or isinstance(error, (CancelledError, CommClosedError)):
            raise SchedulerLost("the scheduler is lost") from error
        raise
    return outcome


def _finished(out):
    """Keys and status of each record's results that another run need not repeat."""
    there, finished = store.finished(out), {}
    for record, key, status in zip(*(there[name].to_pylist() for name in ("record", "key", "status"))):
        if status != work.FAILED:
            finished.setdefault(record, {})[key] = status
    return finished
