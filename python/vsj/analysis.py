"""Identification, diagnosis and plan."""

import os
from typing import Any, Optional, Union

from . import _vsj
from .answers import Diagnosis, Identified, Plan
from .records import given, warn

Path = Union[str, "os.PathLike[str]"]
# A name, a path, or an answer with the text of a plant file.
Plant = Any


def identify(
    data: Any,
    *,
    order: Optional[int] = None,
    time: Optional[str] = None,
    voltage: Optional[str] = None,
    reading: Optional[str] = None,
    column: Optional[str] = None,
    columns: Optional[Path] = None,
    separator: Optional[str] = None,
    decimal: Optional[str] = None,
    topic: Optional[str] = None,
    sort: bool = False,
    input: Optional[str] = None,
) -> Identified:
    """Find the linear spring that records show, as ``vsj identify`` does.

    Parameters
    ----------
    data : path, pandas or polars DataFrame, mapping, array, tuple, or a list of these
        The record: the path of a CSV, MCAP or Parquet file, a frame or a mapping with named columns, a structured array, three arrays
        of shape ``(n,)`` in the order time, voltage, reading, or an array of shape ``(n, 3)``. A list holds several records of one
        spring. NaN or null is a missing reading, in texts also what stands for one in a file, such as ``#N/A``.
    order : int, optional
        Order of the model, its number of poles: 1 to 4, as far as the readings allow. The voltage drives all poles of an order that is
        given. Default: the smallest order that no larger one beats by more than its noise.
    time, voltage, reading : str, optional
        Column and unit, ``"NAME"`` or ``"NAME:UNIT"``, as of the command's options ``--time``, ``--voltage``, ``--reading``.
        Default: found by usual names and units.
    column : str, optional
        Column of a reading that is the stiffness as the equivalent static voltage, in V.
    columns : path, optional
        File with these options as a table ``[columns]``.
    separator, decimal : str, optional
        Separator and decimal mark of a CSV file.
    topic : str, optional
        Topic of the messages in an MCAP file; default: the only one that has the columns.
    sort : bool
        Order the rows by time; rows at the same time become one.
    input : {"hold", "linear"}, optional
        The voltage between the rows; default ``"hold"``.

    Returns
    -------
    Identified

    Raises
    ------
    BadInput
        With record, line, column and what was expected; for an order that is not 1 to 4, or that needs more readings.
    """
    options = _options(time, voltage, reading, column, columns, separator, decimal, topic, sort, input)
    answer = _vsj.identify(given(data, options), options, order)
    warn(answer["remarks"])
    return Identified._of(answer["json"], plant=answer["plant"], courses=answer["courses"])


def diagnose(
    data: Any,
    *,
    plant: Plant = "paper",
    effort: str = "normal",
    within: Optional[float] = None,
    time: Optional[str] = None,
    voltage: Optional[str] = None,
    reading: Optional[str] = None,
    column: Optional[str] = None,
    columns: Optional[Path] = None,
    separator: Optional[str] = None,
    decimal: Optional[str] = None,
    topic: Optional[str] = None,
    sort: bool = False,
    input: Optional[str] = None,
) -> Diagnosis:
    """Find out how a simulation differs from records, name the cause, and measure the held-out improvement.

    Parameters
    ----------
    data, time, voltage, reading, column, columns, separator, decimal, topic, sort
        As for :func:`identify`.
    plant : str, path, Identified, Diagnosis or Spring
        The simulation to compare with: ``"paper"``, ``"identify"`` for what :func:`identify` finds in the records, a plant
        file, or an answer of this package, whose spring is taken.
    effort : {"quick", "normal", "thorough"}
        How long causes are searched for; the answer is the same on every machine.
    within : float, optional
        Longest time until the best answer so far is given, in s.
    input : {"hold", "linear", "stair"}, optional
        The voltage between the rows; default ``"hold"``.

    Returns
    -------
    Diagnosis

    Raises
    ------
    BadInput
        With record, line, column and what was expected.
    KeyboardInterrupt
        At Ctrl-C, which ends the search.
    """
    options = _options(time, voltage, reading, column, columns, separator, decimal, topic, sort, input)
    within = optional("within", within)
    answer = _vsj.diagnose(given(data, options), options, named_plant(plant), text("effort", effort), within)
    warn(answer["remarks"])
    return Diagnosis._of(answer["json"], plant=answer["plant"], unit=answer["unit"], courses=answer["courses"])


def plan(
    diagnosis: Union[Diagnosis, Path],
    *,
    minutes: Optional[float] = None,
    limit_v: Optional[float] = None,
    slew_v_per_s: Optional[float] = None,
) -> Plan:
    """Compute the next experiment: the schedule that decides between the causes that a diagnosis leaves undecided.

    Parameters
    ----------
    diagnosis : Diagnosis or path
        The diagnosis, or a file with its JSON.
    minutes : float, optional
        Duration, in minutes; default: 4 for the report's spring, as many time constants for another.
    limit_v : float, optional
        Largest magnitude of the voltage, in V; default: that of the record.
    slew_v_per_s : float, optional
        Largest rate of change of the voltage, in V/s; default: steps.

    Returns
    -------
    Plan

    Raises
    ------
    BadInput
        For values out of range, and a file that is no diagnosis.
    """
    if isinstance(diagnosis, Diagnosis):
        name, text = "diagnosis", diagnosis.to_json()
    else:
        name = path_of("diagnosis", diagnosis, "a Diagnosis, or the path of its JSON")
        try:
            with open(name, encoding="utf-8") as file:
                text = file.read()
        except (OSError, UnicodeDecodeError) as error:
            what = getattr(error, "strerror", None) or "not UTF-8"
            raise _vsj.BadInput(f"{name}: cannot be read: {what}; expected the JSON of `vsj diagnose`") from error
    bounds = optional("minutes", minutes), optional("limit_v", limit_v), optional("slew_v_per_s", slew_v_per_s)
    json, schedule = _vsj.plan(text, name, *bounds)
    return Plan._of(json, course=schedule)


def named_plant(plant):
    """A spring for the library: a name, or the name and text of a plant file."""
    text = getattr(plant, "plant", None)
    if isinstance(text, str):
        return type(plant).__name__, text
    return path_of("plant", plant, "paper, a plant file, or an answer with a spring")


def path_of(name, value, expected):
    """A path as a text; ``name`` and ``expected`` are for the message."""
    if isinstance(value, (str, os.PathLike)):
        return os.fspath(value)
    raise _vsj.BadInput(f"{name}: {type(value).__name__}; expected {expected}")


def text(name, value):
    """``value`` if it is a text; ``name`` is what the message calls it."""
    if isinstance(value, str):
        return value
    raise _vsj.BadInput(f"{name}: {value!r}; expected a text")


def number(name, value):
    """``value`` as a double; ``name`` is what the message calls it."""
    try:
        return float(value)
    except (TypeError, ValueError, OverflowError):
        raise _vsj.BadInput(f"{name}: {value!r}; expected a number") from None


def optional(name, value):
    """``value`` as a double, or None."""
    return None if value is None else number(name, value)


def _options(time, voltage, reading, column, columns, separator, decimal, topic, sort, input):
    texts = dict(
        time=time, voltage=voltage, reading=reading, column=column, separator=separator, decimal=decimal, topic=topic, input=input
    )
    for name, value in texts.items():
        if value is not None:
            text(name, value)
    columns = None if columns is None else path_of("columns", columns, "the path of a file")
    return dict(texts, columns=columns, sort=bool(sort))
