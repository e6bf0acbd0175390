"""The records of a fleet: which there are, and spring, time and plant of each.

In comes the address of a folder or of a manifest, a local path or a URL that fsspec knows. Out comes a table with one row for each
record, in the order spring, time, record.
"""

import datetime
import posixpath
import re
from contextlib import contextmanager

import fsspec
import pyarrow as pa
from pyarrow import compute, csv, parquet

from .. import BadInput
from ..records import CONTAINERS

SCHEMA = pa.schema(
    [
        ("record", pa.string()),
        ("spring", pa.string()),
        ("time", pa.timestamp("us", tz="UTC")),
        ("plant", pa.string()),
    ]
)
"""Columns of a table of records; ``record`` is relative to the folder. ``time`` and ``plant`` may be null."""

ENDINGS = (".csv", *CONTAINERS)
"""Endings of the files that are records, in lower or upper case."""
_EXPECTED = " or ".join("*" + it for it in ENDINGS)

_DATE = re.compile(
    r"(\d{4})-?(\d\d)-?(\d\d)(?:[T_ ](\d\d)[-:]?(\d\d)(?:[-:]?(\d\d)(?:\.(\d{1,6}))?)?)?(Z|[+-]\d\d:?\d\d)?(?!\d)"
)


def filesystem(url):
    """The file system of a URL, and its path there."""
    try:
        return fsspec.core.url_to_fs(str(url))
    except (ImportError, ValueError) as error:
        raise BadInput(f"{url}: {error}") from error


def absolute(url):
    """A URL that means the same in every folder and on every machine that has the file."""
    fs, path = filesystem(url)
    return fs.unstrip_protocol(path)


@contextmanager
def readable(name, expected):
    """A block that reads a file; if its content is damaged or another than ``expected``, raises BadInput with its name.

    So it does for every exception of a file system, whose package has its own: of S3 some are no ``OSError``.
    """
    try:
        yield
    except (BadInput, MemoryError):
        raise
    except Exception as error:
        raise BadInput(f"{name}: cannot be read as {expected}: {reason(error)}") from error


def reason(error):
    """What an exception says, in one line."""
    return (str(error).splitlines() or [type(error).__name__])[0]


def listed(url, results=(), remark=lambda text: None):
    """The records in a folder or a manifest, and the address of the folder that their names are relative to.

    Files of the folder whose addresses begin with one of ``results`` are no records. ``remark`` is called with what the user should
    know about the others. Raises BadInput if there is none, or the manifest's columns are not as expected.
    """
    fs, path = filesystem(url)
    with readable(url, "a folder of records, or a manifest"):
        if fs.isfile(path):
            folder, table = posixpath.dirname(path), _manifest(fs, path, url)
        elif fs.isdir(path):
            folder, table = path, _folder(fs, path, results, remark)
        else:
            raise BadInput(f"{url}: not found; expected a folder of records, or a manifest")
    if table.num_rows == 0:
        raise BadInput(f"{url}: no record; expected files {_EXPECTED}, one or more")
    table = table.sort_by([("spring", "ascending"), ("time", "ascending"), ("record", "ascending")])
    twice = compute.value_counts(table["record"])
    twice = twice.filter(compute.greater(twice.field("counts"), 1))
    if len(twice):
        raise BadInput(f"{url}: record {twice[0]['values'].as_py()} is listed twice; expected each once")
    return fs.unstrip_protocol(folder), table


def time_of(text):
    """The moment that a text begins with: an ISO 8601 date, or date and time; a name of a file may have ``-`` for ``:``.

    Returns ``None`` if it begins with none. Without a zone it is UTC.
    """
    found = _DATE.match(text)
    if not found:
        return None
    year, month, day, hour, minute, second, fraction, zone = found.groups()
    try:
        moment = datetime.datetime(
            int(year), int(month), int(day), int(hour or 0), int(minute or 0), int(second or 0), int((fraction or "0").ljust(6, "0"))
        )
        offset = datetime.timedelta()
        if zone and zone != "Z":
            hours, minutes = int(zone[1:3]), int(zone[-2:])
            offset = datetime.timedelta(hours=hours, minutes=minutes) * (-1 if zone[0] == "-" else 1)
        return (moment - offset).replace(tzinfo=datetime.timezone.utc)
    except (ValueError, OverflowError):
        return None


def _folder(fs, path, results, remark):
    """Records at ``SPRING/DATE.csv``; a spring's name may have several parts, and a record in no folder is its own spring.

    Hidden files, and the locks of office programs, are not looked at.
    """
    parts = lambda name: posixpath.relpath(name, path).split("/")
    seen = {
        name: info
        for name, info in sorted(fs.find(path, detail=True).items())
        if not fs.unstrip_protocol(name).startswith(tuple(results)) and not any(it.startswith((".", "~$")) for it in parts(name))
    }
    # A pipe would be waited for; a link may lead to a file.
    is_file = lambda name: seen[name]["type"] == "file" or fs.isfile(name)
    names = [name for name in seen if name.lower().endswith(ENDINGS) and is_file(name)]
    if names and len(names) < len(seen):
        remark(f"{len(seen) - len(names)} of {len(seen)} files are no records: expected {_EXPECTED}")
    relative = [posixpath.relpath(name, path) for name in names]
    stems = [posixpath.splitext(posixpath.basename(name))[0] for name in relative]
    springs = [posixpath.dirname(name) or stem for name, stem in zip(relative, stems)]
    columns = [relative, springs, [time_of(stem) for stem in stems], [None] * len(relative)]
    return pa.table([pa.array(values, it.type) for values, it in zip(columns, SCHEMA)], schema=SCHEMA)


def _manifest(fs, path, url):
    """The records that a CSV or Parquet file lists: ``record``, and optionally ``spring``, ``time`` and ``plant``."""
    with readable(url, "a manifest"), fs.open(path, "rb") as file:
        if path.lower().endswith(".parquet"):
            table = parquet.read_table(file)
        else:
            texts = csv.ConvertOptions(
                column_types={it.name: pa.string() for it in SCHEMA}, strings_can_be_null=True, null_values=[""]
            )
            table = csv.read_csv(file, convert_options=texts)
    names = table.column_names
    if "record" not in names or any(names.count(it.name) > 1 for it in SCHEMA):
        raise BadInput(f"{url}: columns {', '.join(names)}; expected record, and optionally spring, time, plant, each once")
    given = {it.name: table[it.name] for it in SCHEMA if it.name in table.column_names}
    records = [str(it) if it is not None else None for it in given["record"].to_pylist()]
    for row, record in enumerate(records):
        if not record:
            raise BadInput(f"{url}, row {row + 1}, column record: empty; expected a path")
    times = [_manifest_time(it, f"{url}, row {row + 1}, column time") for row, it in enumerate(_column(given, "time", records))]
    springs = [
        str(spring) if spring is not None else posixpath.dirname(record) or posixpath.splitext(record)[0]
        for spring, record in zip(_column(given, "spring", records), records)
    ]
    plants = [None if it is None else str(it) for it in _column(given, "plant", records)]
    columns = [records, springs, times, plants]
    return pa.table([pa.array(values, it.type) for values, it in zip(columns, SCHEMA)], schema=SCHEMA)


def _column(given, name, records):
    return given[name].to_pylist() if name in given else [None] * len(records)


def _manifest_time(value, where):
    if value is None:
        return None
    if isinstance(value, datetime.datetime):
        return value if value.tzinfo else value.replace(tzinfo=datetime.timezone.utc)
    moment = time_of(str(value))
    if moment is None:
        raise BadInput(f"{where}: {value}; expected a date or a moment, such as 2026-03-01 or 2026-03-01T12:30:00Z")
    return moment
