"""What a worker does: a batch of records in, their rows out.

A record is read once, into a temporary file, so that the bytes that are hashed are those that are diagnosed and the memory does not
depend on their number. What is wrong with a record is said in its row, by the text of the command's error.
"""

import hashlib
import json
import os
import posixpath
import tempfile
import time

from .. import BadInput, __version__, _vsj
from .records import filesystem
from .settings import build
from .store import write_part

DIAGNOSED, REFUSED, FAILED = "diagnosed", "refused", "failed"
"""Status of a row. Another run tries failed ones again: a record that could not be read, a program error."""

_CHUNK = 1 << 20
_COLUMNS = "--columns.toml"
"""Name of the file ``--columns`` in a worker's folder, which no record has."""


def diagnose(batch, plants, settings, folder, out):
    """Diagnose a batch and write its rows as one part of the results.

    Parameters
    ----------
    batch : list of dict
        ``record``, ``spring``, ``time``, ``plant``, and ``finished``: key and status of the results that there are
        already.
    plants : dict
        Name of each plant in the batch, and the text of its file; ``None`` for a name that the library knows.
    settings : Settings
    folder, out : str
        Addresses of the records and of the results.

    Returns
    -------
    list of (key, status, is_new)
        One for each record of the batch, in its order.
    """
    if settings.build != build():
        raise RuntimeError(f"this worker has build {build()} of vsj; expected {settings.build}, as the program that sent the work")
    rows, done = [], []
    for record in batch:
        row = _row(record, plants, settings, folder)
        is_new = row["key"] not in record["finished"]
        if is_new:
            rows.append(row)
        done.append((row["key"], row["status"], is_new))
    if rows:
        write_part(out, rows)
    return done


def failed(record, error):
    """The row of a record that no worker could diagnose."""
    return _frame(record) | {"status": FAILED, "error": error}


def _frame(record):
    return {name: record[name] for name in ("record", "spring", "time", "plant")} | {"key": None, "version": __version__}


def _row(record, plants, settings, folder):
    """The row of a record; of one that is finished only its key and its status."""
    row = _frame(record)
    name = record["record"]
    start = time.process_time()
    try:
        fs, path = filesystem(name if "://" in name or os.path.isabs(name) else posixpath.join(folder, name))
        with tempfile.TemporaryDirectory() as scratch:
            copy = os.path.join(scratch, posixpath.basename(path))
            content, row["bytes"] = _copied(fs, path, copy)
            plant, text = record["plant"], plants[record["plant"]]
            row["key"] = settings.key(content, text or plant)
            if row["key"] in record["finished"]:
                return row | {"status": record["finished"][row["key"]]}
            try:
                row |= _answer(copy, settings, plant if text is None else (plant, text), scratch)
            except BadInput as error:
                row |= {"status": REFUSED, "error": str(error)}
            # The record's own address, not that of the copy; the option, not the copy of its file.
            address, columns = fs.unstrip_protocol(path).removeprefix("file://"), os.path.join(scratch, _COLUMNS)
            shown = lambda it: it.replace(copy, address).replace(columns, "--columns")
            row["error"] = shown(row["error"]) if row.get("error") else None
            row["remarks"] = [shown(it) for it in row.get("remarks", [])]
    except (KeyboardInterrupt, SystemExit):
        raise
    # A panic of the library is no `Exception`.
    except BaseException as error:
        row |= {"status": FAILED, "error": f"{name}: {type(error).__name__}: {error}", "key": None}
    row["seconds"] = time.process_time() - start
    return row


def _copied(fs, path, copy):
    """Copies a file; returns the SHA-256 of its bytes and their number."""
    digest, size = hashlib.sha256(), 0
    with fs.open(path, "rb") as source, open(copy, "wb") as target:
        while chunk := source.read(_CHUNK):
            digest.update(chunk)
            target.write(chunk)
            size += len(chunk)
    return digest.digest(), size


def _answer(path, settings, plant, scratch):
    """The columns of a row that come from identification and diagnosis."""
    options = settings.options
    if settings.columns is not None:
        columns = os.path.join(scratch, _COLUMNS)
        with open(columns, "w", encoding="utf-8") as file:
            file.write(settings.columns)
        options = options | {"columns": columns}
    if not path.lower().endswith(".mcap"):
        # One fleet may hold files of all kinds.
        options = options | {"topic": None}
    measured = [(path, None)]
    answer = _vsj.diagnose(measured, options, plant, settings.effort, None)
    found = json.loads(answer["json"])
    return {
        "status": DIAGNOSED,
        "verdict": found["verdict"],
        "complete": found["complete"],
        "rows": found["rows"],
        "rmse": found["baseline"]["rmse"],
        "extended_rmse": found["extended"]["rmse"],
        "gain": found["extended"]["gain"],
        "findings": [_finding(it) for it in found["findings"]],
        "identified": _identified(measured, options),
        "remarks": answer["remarks"],
    }


def _finding(finding):
    parameters = [_quantity(name, it) for name, it in finding["parameters"].items()]
    return {"cause": finding["cause"], "probability": finding["probability"], "parameters": parameters}


def _quantity(name, it):
    return {"name": name, "value": it["value"], "low": it["low"], "high": it["high"], "unit": it["unit"]}


def _identified(measured, options):
    """Gain, zero, share, delay and the time constant of the largest weight, of the linear spring that the record shows."""
    try:
        nominal = json.loads(_vsj.identify(measured, options)["json"])["nominal"]
    except BadInput:
        # Such as `--input stair`, which only a diagnosis knows.
        return []
    names = ("gain", "zero", "share", "delay_s")
    quantities = [_quantity(name, nominal[name]) for name in names]
    if nominal["tau_s"]:
        quantities.append(_quantity("tau_s", max(nominal["tau_s"], key=lambda it: abs(it["weight"]["value"]))))
    return quantities

