"""Rows of results in Parquet files, and which records are finished.

A batch is one file in ``parts/``, written under another name and then renamed: it is there whole or not at all, also after the end of a
worker, a scheduler or a machine. The files are the only state. A batch that is computed twice, because its worker was taken for
dead, writes the same rows again; every reader takes one row for each record and key.
"""

import errno
import hashlib
import io
import itertools
import os
import posixpath
import uuid
from concurrent.futures import ThreadPoolExecutor
from contextlib import contextmanager, suppress

import pyarrow as pa
from pyarrow import parquet

from .. import BadInput
from .records import filesystem, readable, reason

QUANTITY = pa.struct(
    [("name", pa.string()), ("value", pa.float64()), ("low", pa.float64()), ("high", pa.float64()), ("unit", pa.string())]
)
FINDING = pa.struct([("cause", pa.string()), ("probability", pa.float64()), ("parameters", pa.list_(QUANTITY))])
SCHEMA = pa.schema(
    [
        ("spring", pa.string()),
        ("record", pa.string()),
        ("time", pa.timestamp("us", tz="UTC")),
        ("plant", pa.string()),
        ("status", pa.string()),
        ("verdict", pa.string()),
        ("error", pa.string()),
        ("findings", pa.list_(FINDING)),
        ("identified", pa.list_(QUANTITY)),
        ("rows", pa.int64()),
        ("complete", pa.bool_()),
        ("rmse", pa.float64()),
        ("extended_rmse", pa.float64()),
        ("gain", pa.float64()),
        ("remarks", pa.list_(pa.string())),
        ("bytes", pa.int64()),
        ("seconds", pa.float64()),
        ("key", pa.string()),
        ("version", pa.string()),
    ]
)
"""Columns of the results, one row for each record; see docs/fleet.md."""

_NAMES = pa.schema([SCHEMA.field(name) for name in ("record", "key", "status")])
"""What says that a record is finished."""

TABLE = "diagnoses.parquet"
_PARTS = "parts"
_ROWS_AT_ONCE = 1000
READERS = 32
"""Parts that are read at a time: on an object store most of the time is waiting."""


class WriteError(RuntimeError):
    """A file of the results that cannot be written. What is there already is whole, and the next run goes on with it."""


def addresses(out):
    """Beginnings of the addresses of the Parquet files in the folder of results ``out``."""
    return f"{out}/{TABLE}", f"{out}/{_PARTS}/"


def expect_writable(out):
    """Raise BadInput unless files can be written to the folder of results ``out``: before anything is computed for it."""
    fs, path = filesystem(out)
    probe = posixpath.join(path, f".{uuid.uuid4().hex}.partial")
    try:
        fs.makedirs(path, exist_ok=True)
        with fs.open(probe, "wb") as file:
            file.write(b"vsj")
        fs.rm(probe)
    except Exception as error:
        raise BadInput(f"--out {out}: cannot be written ({reason(error)}); expected a folder or URL for the results") from error


def write_part(out, rows):
    """Write rows as one part; the same rows have the same name."""
    name = hashlib.sha256("\n".join(f"{row['record']} {row['key']}" for row in rows).encode()).hexdigest()[:32]
    count = f"{len(rows)} record{'s' if len(rows) > 1 else ''}"
    write = lambda file: parquet.write_table(pa.Table.from_pylist(rows, SCHEMA), file)
    _write(out, f"{_PARTS}/{name}.parquet", write, f" with {count} from {rows[0]['record']}")


def write_text(out, name, text):
    """Write a file of the results."""
    _write(out, name, lambda file: file.write(text.encode()))


def finished(out):
    """The rows in the parts: ``record``, ``key`` and ``status`` of each, the ``part`` that has it, and its ``row`` there.

    Parts that are damaged or have other content, such as those of other programs, raise BadInput with the name of the file.
    """
    fs, path = filesystem(out)
    # Workers have written there since this program has listed it.
    fs.invalidate_cache()
    folder = posixpath.join(path, _PARTS)
    with readable(folder, "results"):
        parts = sorted(it for it in fs.find(folder) if it.endswith(".parquet")) if fs.isdir(folder) else []

    def names(part):
        with readable(part, "results"), fs.open(part, "rb") as file:
            table = parquet.read_table(file, columns=_NAMES.names).cast(_NAMES)
        columns = [pa.array([part] * len(table)).dictionary_encode(), pa.array(range(len(table)), pa.int32())]
        return table.append_column("part", columns[0]).append_column("row", columns[1])

    with ThreadPoolExecutor(READERS) as pool:
        tables = list(pool.map(names, parts))
    if not tables:
        return pa.table({name: [] for name in (*_NAMES.names, "part", "row")})
    return pa.concat_tables(tables).unify_dictionaries()


def write_table(out, records, key_of):
    """Write the table of all results: for each record of the table ``records``, in its order, the row with its key.

    ``key_of`` gives the key of the record with an index. Spring, time and plant are those of ``records``, which may have changed since.
    Memory: names, keys and places of all rows, and a thousand rows.
    """
    there = finished(out)
    names = zip(there["record"].to_pylist(), there["key"].to_pylist())
    place = dict(zip(names, zip(there["part"].to_pylist(), there["row"].to_pylist())))
    fs, _ = filesystem(out)

    def read(part):
        with readable(part, "results"), fs.open(part, "rb") as source:
            return parquet.read_table(source, schema=SCHEMA)

    def write(file):
        with ThreadPoolExecutor(READERS) as pool, parquet.ParquetWriter(file, SCHEMA) as writer:
            for start in range(0, len(records), _ROWS_AT_ONCE):
                some = records.slice(start, _ROWS_AT_ONCE)
                wanted = [place[name, key_of(index)] for index, name in enumerate(some["record"].to_pylist(), start)]
                parts = list(dict.fromkeys(part for part, _ in wanted))
                tables = list(pool.map(read, parts))
                offsets = dict(zip(parts, itertools.accumulate(map(len, tables), initial=0)))
                table = pa.concat_tables(tables).take([offsets[part] + row for part, row in wanted])
                for column in ("spring", "time", "plant"):
                    table = table.set_column(SCHEMA.get_field_index(column), SCHEMA.field(column), some[column])
                writer.write_table(table)

    _write(out, TABLE, write)


def rows(out):
    """The rows of the table of results as dictionaries, in its order, a thousand in memory at a time."""
    fs, path = filesystem(out)
    table = posixpath.join(path, TABLE)
    with readable(table, "results"), fs.open(table, "rb") as file:
        for batch in parquet.ParquetFile(file).iter_batches(_ROWS_AT_ONCE):
            yield from batch.to_pylist()


def read(out):
    """The results as a pandas DataFrame with one row for each parameter of each finding.

    Columns: ``spring``, ``record``, ``time``, ``status``, ``verdict``, ``error``, ``cause``, ``probability``, ``parameter``, ``value``,
    ``low``, ``high``, ``unit``. A record without a finding has one row, in which ``cause`` and what follows it are missing.
    """
    import pandas

    names = ["spring", "record", "time", "status", "verdict", "error"]
    flat = []
    for row in rows(out):
        start = [row[name] for name in names]
        for finding in row["findings"] or [{"cause": None, "probability": None, "parameters": None}]:
            for it in finding["parameters"] or [dict.fromkeys(("name", "value", "low", "high", "unit"))]:
                flat.append([*start, finding["cause"], finding["probability"], *it.values()])
    return pandas.DataFrame(flat, columns=[*names, "cause", "probability", "parameter", "value", "low", "high", "unit"])


def _write(out, name, write, content=""):
    """Write a file of the results by ``write``, which gets it open; ``content`` is what messages add to its name.

    Whatever a file system's package or pyarrow raises becomes a WriteError, which takes nothing of it but its words: another process may
    not be able to read the exception itself.
    """
    try:
        with _replacing(out, name) as file:
            write(file)
        return
    except (BadInput, MemoryError):
        raise
    except Exception as error:
        why = getattr(error, "strerror", None) or reason(error)
    raise WriteError(f"{name}{content} cannot be written: {why}")


@contextmanager
def _replacing(out, name):
    """A file that has its name only when it is complete. On an object store the renaming is a copy, which is atomic there."""
    fs, path = filesystem(out)
    final = posixpath.join(path, name)
    partial = posixpath.join(posixpath.dirname(final), f".{posixpath.basename(final)}.{uuid.uuid4().hex}.partial")
    fs.makedirs(posixpath.dirname(final), exist_ok=True)
    try:
        with fs.open(partial, "wb") as file:
            yield file
            file.flush()
            # Only a local file has a number; there the content has to be on the disk before the name is, where the mount can tell.
            with suppress(io.UnsupportedOperation, AttributeError):
                _synchronise(file.fileno())
        fs.mv(partial, final)
    except BaseException:
        # What went wrong first is reported.
        with suppress(Exception):
            if fs.exists(partial):
                fs.rm(partial)
        raise


def _synchronise(number):
    """Wait until the open file with a number is on its disk; some mounts, of networks and in user space, have no such call."""
    try:
        os.fsync(number)
    except OSError as error:
        if error.errno not in (errno.EINVAL, errno.ENOTSUP):
            raise
