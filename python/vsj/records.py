"""Records as users have them, as columns for the library."""

import json
import os
import warnings
from collections.abc import Mapping
from datetime import timedelta

import numpy as np

CONTRACT = ("time_s", "voltage_v", "stiffness")
"""Names of the columns of an array without names."""
CONTAINERS = (".mcap", ".parquet")
"""Endings of files other than CSV."""
_MOST_DAYS = 2**63 // 86_400_000_000
"""Days that fit in NumPy's time in µs."""
_LONGEST_S = 2**63 / 1e9
"""Seconds that fit in NumPy's time in ns."""


class RecordWarning(UserWarning):
    """How a record was read, where it left a choice: the remarks that the command prints."""


def given(data, options):
    """The records of ``data`` as a list of ``(name, columns)``; ``columns`` is ``None`` for the path of a file."""
    several = data if isinstance(data, list) else [data]
    name = "DataFrame" if not isinstance(data, list) else "DataFrame {}"
    return [_record(one, name.format(index + 1), options) for index, one in enumerate(several)]


def warn(remarks):
    """Warns of each remark, at the line that called the library's function."""
    for remark in remarks:
        warnings.warn(remark, RecordWarning, stacklevel=3)


def _record(data, name, options):
    path = os.fspath(data) if isinstance(data, (str, os.PathLike)) else None
    if path is None or path.lower().endswith(CONTAINERS):
        # The decimal mark is also that of a frame's texts.
        for option in ("separator",) if path is None else ("separator", "decimal"):
            if options.get(option) is not None:
                raise bad_input(f"{option}: applies to paths of CSV files only; expected none")
    if path is not None:
        return path, None
    if options.get("topic") is not None:
        raise bad_input("topic: applies to paths of MCAP files only; expected none")
    if type(data).__name__ == "LazyFrame":
        data = data.collect()
    if isinstance(data, Mapping):
        return name.replace("DataFrame", "columns"), [_column(str(key), column) for key, column in data.items()]
    # A table of pyarrow has both names and columns, a frame names in `columns`.
    if hasattr(data, "column_names") and hasattr(data, "schema"):
        units = _units_of_metadata(data.schema.metadata or {})
        return name.replace("DataFrame", "table"), [
            _column(column, np.asarray(cells), units) for column, cells in zip(data.column_names, data.columns)
        ]
    columns = getattr(data, "columns", None)
    if columns is not None:
        units = getattr(data, "attrs", {}).get("units")
        return name, _index(data, units) + [_column(str(column), data[column], units) for column in columns]
    if isinstance(data, np.ndarray) and data.dtype.names:
        return name.replace("DataFrame", "array"), [_column(column, data[column]) for column in data.dtype.names]
    if isinstance(data, tuple):
        columns = data
    else:
        # `asarray` would show what a mask hides.
        array = data if isinstance(data, np.ma.MaskedArray) else np.asarray(data)
        if array.ndim != 2 or array.shape[1] != 3:
            raise bad_input(
                f"data: shape {array.shape}; expected a path, a frame, columns by name, three arrays, or an array of shape (n, 3)"
            )
        columns = tuple(array[:, column] for column in range(3))
    if len(columns) != 3:
        raise bad_input(f"data: {len(columns)} arrays; expected three: time, voltage, reading")
    asked = (options["time"], options["voltage"], options["reading"] or options["column"])
    names = [_name(option, default) for option, default in zip(asked, CONTRACT)]
    return name.replace("DataFrame", "arrays"), list(map(_column, names, columns))


def _index(frame, units):
    """The index of a pandas frame as a column, if it has a name, or times, which without a name are ``time``."""
    index = getattr(frame, "index", None)
    kind = getattr(getattr(index, "dtype", None), "kind", None)
    name = getattr(index, "name", None)
    if name is None and kind in ("M", "m"):
        name = "time"
    return [] if name is None or name in frame.columns else [_column(str(name), index, units)]


def bad_input(text):
    """The exception for invalid input."""
    from ._vsj import BadInput

    return BadInput(text)


def _name(option, default):
    """The name of a column without name: that of the option ``NAME:UNIT``."""
    return default if option is None else option.rpartition(":")[0] or option


def _units_of_metadata(metadata):
    """The units in the metadata of a Parquet file, by the keys that the command reads."""
    units = {}
    for key in (b"units", b"PANDAS_ATTRS"):
        try:
            found = json.loads(metadata.get(key, b"{}"))
        except ValueError:
            continue
        found = found.get("units") if key == b"PANDAS_ATTRS" and isinstance(found, dict) else found
        units.update(found if isinstance(found, dict) else {})
    return units


def _column(name, column, units=None):
    """The name of a column with its unit, and its cells; ``units`` are those of ``frame.attrs["units"]``."""
    from ._vsj import with_unit

    if hasattr(column, "to_numpy"):
        column = column.to_numpy()
    array = unmasked(column)
    unit = units.get(name) if isinstance(units, Mapping) else None
    if array.dtype.kind == "m":
        unit = "s"
    return with_unit(name, unit) if isinstance(unit, str) else name, _cells(array)


def unmasked(values):
    """``values`` as an array in which what a mask hides is missing."""
    if not np.ma.is_masked(values):
        array = np.asarray(values)
        # Python's own durations; its time stamps may have zones, which NumPy has not.
        has_durations = array.dtype.kind == "O" and array.size and all(map(_is_duration, array.flat))
        return array.astype("m8[us]") if has_durations else array
    kind = values.dtype.kind
    if kind in "Mm":
        return values.filled(np.array("NaT", values.dtype))
    # Whole numbers may have more digits than a double.
    return values.astype(np.float64).filled(np.nan) if kind in "bf" else values.astype(object).filled(None)


def _is_duration(cell):
    # NumPy's time in µs, as Python's is, ends at 292 000 years, silently.
    return isinstance(cell, timedelta) and abs(cell.days) < _MOST_DAYS


def _cells(array):
    """A column as an array of doubles, or as a list of texts where doubles would lose something."""
    if array.ndim != 1:
        raise bad_input(f"column: shape {array.shape}; expected one dimension")
    kind = array.dtype.kind
    if kind == "M":
        return np.datetime_as_string(array, unit="ns").tolist()
    if kind == "m":
        if (np.abs(array / np.timedelta64(1, "s")) > _LONGEST_S).any():
            raise bad_input("column: a duration of more than 292 years; expected durations that are whole numbers of ns")
        return array.astype("m8[ns]")
    # Times in ns since 1970 have more digits than a double.
    if kind in "iu" and array.size and max(abs(int(array.min())), abs(int(array.max()))) > 2**53:
        return array.astype(str).tolist()
    if kind in "biuf":
        return np.ascontiguousarray(array, dtype=np.float64)
    return ["" if _is_missing(cell) else _text(cell) for cell in array]


def _is_missing(cell):
    # pandas' NaT and NaN differ from themselves; its NA compares as itself.
    return cell is None or type(cell).__name__ in ("NAType", "NaTType") or (isinstance(cell, float) and cell != cell)


def _text(cell):
    return cell.isoformat() if hasattr(cell, "isoformat") else str(cell)
