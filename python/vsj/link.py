"""A running microcontroller over its serial link."""

import contextlib
import json
import math
import os
import time
import warnings
from dataclasses import dataclass
from typing import Any, Callable, Dict, Iterator, List, Optional, Tuple, Union

import numpy as np

from . import _vsj
from .analysis import named_plant, number, path_of, text
from .records import warn


@dataclass(frozen=True)
class Isolation:
    """What the isolation bank of the MCU says of the spring and its sensor.

    Attributes
    ----------
    verdict
        ``"quiet"``, ``"alarm"``, ``"named"``, ``"ambiguous"``, ``"unknown"``, ``"off"`` if no bank runs, or
        ``"unknown-code"`` for one that this version does not know.
    cause, other
        The cause that explains most, and the other one if two are ambiguous; ``None`` otherwise.
    since_s
        When the fault began, in s since the MCU's start; ``None`` without an alarm.
    size, low, high, unit
        Size of the cause with its 95 % interval; ``None`` without a cause, the unit is empty for a ratio.
    explained
        Part of the residual's energy that the cause explains, 0 to 1; ``None`` without a cause.
    why
        Why no bank runs, ``None`` if one does.
    """

    verdict: str
    cause: Optional[str]
    other: Optional[str]
    since_s: Optional[float]
    size: Optional[float]
    low: Optional[float]
    high: Optional[float]
    unit: Optional[str]
    explained: Optional[float]
    why: Optional[str]

    @classmethod
    def _of(cls, row: Optional[Dict[str, Any]]) -> "Optional[Isolation]":
        if row is None:
            return None
        size = row["size"] or {}
        sizes = {"size": size.get("value"), "low": size.get("low"), "high": size.get("high"), "unit": size.get("unit")}
        return cls(**{name: {**row, **sizes}[name] for name in cls.__dataclass_fields__})


@dataclass(frozen=True)
class Sample:
    """One sample of the control loop; voltages and stiffnesses in V, a stiffness as the equivalent static voltage.

    Attributes
    ----------
    time_s, tick
        Time since the MCU's start in s, and number of the tick.
    state
        ``"disarmed"``, ``"armed"``, ``"ramping"`` (armed, the host was silent) or ``"faulted"``.
    target_v, applied_v, estimate_v
        Target stiffness, voltage across the spring, estimated stiffness.
    measured_v
        Measured stiffness, ``None`` without a new reading.
    dac_code
        Code of the DAC.
    limits
        Names of the limits that acted: ``"upper"``, ``"lower"``, ``"slew"``, ``"target"``.
    monitors, sensor
        What disagrees with the output, and the diagnosis of the sensor.
    isolation
        What the isolation bank has said last; ``None`` before it has, and if the MCU's program does not send it.
    """

    time_s: float
    tick: int
    state: str
    target_v: float
    applied_v: float
    estimate_v: float
    measured_v: Optional[float]
    dac_code: int
    limits: Tuple[str, ...]
    monitors: str
    sensor: str
    isolation: Optional[Isolation] = None

    @classmethod
    def _of(cls, row: Dict[str, Any]) -> "Sample":
        known = {name: row[name] for name in cls.__dataclass_fields__}
        return cls(**{**known, "limits": tuple(row["limits"]), "isolation": Isolation._of(row["isolation"])})


class Link:
    """A connection to a running MCU, as of the command ``vsj link``.

    While it is open, heartbeats are sent from a thread, so that the MCU does not take the host for silent. The output is disabled when
    it is closed or deleted; as a context manager it is closed at the end, also after an exception. Calls wait without the interpreter's lock.

    Parameters
    ----------
    port : str
        A serial device, ``unix:PATH`` or ``tcp:HOST:PORT``.
    baud : int
        Baud rate of a serial device, in bit/s.
    timeout : float
        Longest wait for the port to open and for each answer, in s; a request is repeated every 0.1 s.

    Raises
    ------
    BadInput
        For a port that cannot be opened, and, by the methods, for a stiffness out of reach or a file that cannot be used.
    LinkError
        If the MCU does not answer, refuses a request, or the connection is lost.

    Examples
    --------
    >>> with vsj.Link("/dev/ttyACM0") as link:  # doctest: +SKIP
    ...     link.arm()
    ...     link.set(300)
    ...     record = link.record(seconds=5)
    """

    def __init__(self, port: str, *, baud: int = 115_200, timeout: float = 1.0):
        rate = number("baud", baud)
        if not (rate.is_integer() and 0 < rate < 2**32):
            raise _vsj.BadInput(f"baud: {baud!r}; expected a whole number of bit/s")
        self._port = _vsj.Port(text("port", port), int(rate), number("timeout", timeout))

    def __enter__(self) -> "Link":
        return self

    def __exit__(self, kind: Any, *_: Any) -> None:
        if kind is not None:
            # Another exception would take the place of the one that ends the block.
            self.close()
        elif not_disarmed := self._port.close():
            raise _vsj.LinkError(not_disarmed)

    def close(self) -> None:
        """Disable the output, end the heartbeats and close the port. A ``RuntimeWarning`` says if the MCU has not confirmed it."""
        if not_disarmed := self._port.close():
            warnings.warn(not_disarmed, RuntimeWarning, stacklevel=2)

    def status(self) -> Dict[str, Any]:
        """The status of the MCU, with the fields of ``vsj link PORT status --json``."""
        return json.loads(self._port.status())

    def arm(self) -> str:
        """Enable the output; the target starts at 0 V. Returns the state."""
        return self._port.arm()[0]

    def disarm(self) -> str:
        """Disable the output immediately. Returns the state."""
        return self._port.disarm()[0]

    def set(self, value: float, unit: str = "V") -> float:
        """Set the desired stiffness of an armed MCU.

        Parameters
        ----------
        value : float
            The stiffness.
        unit : {"V", "Pa", "N/m"}
            V of equivalent static voltage, Pa of Young's modulus, N/m at the tip.

        Returns
        -------
        float
            The target in V.
        """
        return self._port.set(number("value", value), text("unit", unit))[1]

    def acknowledge(self, fault: Union[str, int]) -> str:
        """Acknowledge a fault by its name or number. Returns the state."""
        return self._port.acknowledge(str(fault))[0]

    def faults(self) -> List[Dict[str, Any]]:
        """The faults that the MCU has reported since the last call, in their order; each is reported once.

        Returns
        -------
        list of dict
            ``time_s`` and ``tick`` since the MCU's start, ``fault`` and ``fault_code``, ``standing`` (the names of all faults that
            stood then), and ``monitors`` (what disagreed with the output, ``"none"`` if nothing did).
        """
        return json.loads(self._port.faults())

    def dropped_samples(self) -> int:
        """Number of samples of ``watch`` that were dropped because they were not taken: all but the newest 65 536."""
        return self._port.dropped_samples()

    def watch(self, rate_hz: float = 100.0, seconds: Optional[float] = None) -> Iterator[Sample]:
        """Iterate over samples as they arrive, until ``seconds`` have passed or the loop is left.

        Parameters
        ----------
        rate_hz : float
            Samples per second; 115 200 bit/s suffice for about 250.
        seconds : float, optional
            Length; default: without end.
        """
        length_s = math.inf if seconds is None else _length_s(seconds)
        for samples in self._turns(rate_hz, length_s, lambda elapsed_s: None):
            yield from samples

    def record(self, seconds: Optional[float] = None, rate_hz: float = 100.0, schedule: Any = None) -> Any:
        """Record to a pandas DataFrame, which :func:`vsj.diagnose` takes.

        Parameters
        ----------
        seconds : float, optional
            Length in s; default: that of the schedule.
        rate_hz : float
            Rows per second; 115 200 bit/s suffice for about 250.
        schedule : sequence of (time_s, voltage_v), array of shape (n, 2) or frame of a :class:`Plan`, optional
            Targets that an armed MCU is commanded, each held until the next; times in s, increasing. The time of the last row is the
            end, unless ``seconds`` is longer. A recording in which the MCU is disarmed or has a fault ends with ``LinkError``.

        Returns
        -------
        pandas.DataFrame
            Columns ``time_s`` from 0, ``voltage_v`` across the spring, and ``stiffness`` in V, NaN where the sensor gave no
            reading; without a sensor the last column is ``estimate``, which is no measurement. ``attrs["units"]`` has the units.
        """
        import pandas

        waiting = _steps(schedule)
        if seconds is None and not waiting:
            raise _vsj.BadInput("record: neither seconds nor a schedule; expected one of them")
        end_s = waiting[0][0] if waiting else 0.0
        length_s = max(_length_s(end_s if seconds is None else seconds), end_s)
        status = self.status()
        has_sensor = status["sample"]["measured_v"] is not None
        lowest_v, highest_v = status["lowest_v"], status["highest_v"]
        for _, voltage_v in waiting:
            if not lowest_v <= voltage_v <= highest_v:
                raise _vsj.BadInput(f"schedule: {voltage_v:g} V; expected {lowest_v:g} to {highest_v:g} V, what is in reach")
        is_commanded = False

        def command(elapsed_s: float) -> None:
            nonlocal is_commanded
            due = None
            while waiting and elapsed_s >= waiting[-1][0]:
                due = waiting.pop()[1]
            if due is not None:
                self.set(due)
                is_commanded = True

        rows: List[Sample] = []
        for samples in self._turns(rate_hz, length_s, command):
            rows += samples
            if is_commanded and samples and samples[-1].state not in ("armed", "ramping"):
                raise _vsj.LinkError(f"no longer armed: the MCU is {samples[-1].state} at {samples[-1].time_s:g} s")
            if rows and samples and samples[-1].tick < rows[0].tick:
                raise _vsj.LinkError("the MCU restarted during the recording")
        reading = "stiffness" if has_sensor or any(row.measured_v is not None for row in rows) else "estimate"
        start_s = rows[0].time_s if rows else 0.0
        frame = pandas.DataFrame(
            {
                # Nine decimals hide floating-point errors of decimal times.
                "time_s": [round(row.time_s - start_s, 9) for row in rows],
                "voltage_v": [row.applied_v for row in rows],
                reading: [row.measured_v if reading == "stiffness" else row.estimate_v for row in rows],
            },
            dtype="float64",
        )
        frame.attrs["units"] = {"time_s": "s", "voltage_v": "V", reading: "V"}
        return frame

    def model(self, plant: Any = None) -> Dict[str, Any]:
        """Which model of the spring the MCU runs and has stored; with a plant, send it to be checked and stored, and restart.

        Parameters
        ----------
        plant : path or answer of :func:`vsj.identify` or :func:`vsj.diagnose`, optional
            The model to send; ``"paper"`` for the built-in one. What of it the MCU does not run is a ``RecordWarning``.
        """
        models, left_out = self._port.models(None if plant is None else named_plant(plant))
        warn([f"not run by the MCU: {', '.join(left_out)}"] if left_out else [])
        return json.loads(models)

    def settings(self, file: Optional[Union[str, "os.PathLike[str]"]] = None) -> Dict[str, Any]:
        """The settings that the MCU runs; with a settings file, send it to be checked and stored, and restart.

        Returns
        -------
        dict
            ``active`` and ``stored`` as identities, and ``toml``, the running settings as the text of a settings file.
        """
        blocks, text = self._port.settings(None if file is None else path_of("file", file, "the path of a settings file"))
        return {**json.loads(blocks), "toml": text}

    def _turns(self, rate_hz: float, length_s: float, command: Callable[[float], None]) -> Iterator[List[Sample]]:
        """Samples in short turns, each after ``command``, which gets the time since the first turn in s."""
        rate = number("rate_hz", rate_hz)
        if rate == 0:
            # To the port that is the end of the telemetry.
            raise _vsj.BadInput("rate_hz 0: expected 0.02 to 10000")
        self._port.stream(rate)
        begin = time.monotonic()
        try:
            while (elapsed_s := time.monotonic() - begin) < length_s:
                command(elapsed_s)
                yield [Sample._of(row) for row in json.loads(self._port.samples())]
        except BaseException:
            # An iterator that is left may outlive its link, and what went wrong is reported already.
            with contextlib.suppress(_vsj.LinkError):
                self._port.stream(0.0)
            raise
        self._port.stream(0.0)


def _length_s(seconds: Any) -> float:
    length_s = number("seconds", seconds)
    if not (math.isfinite(length_s) and length_s > 0):
        raise _vsj.BadInput(f"seconds {length_s:g}: expected a positive number of seconds")
    return length_s


def _steps(schedule: Any) -> List[Tuple[float, float]]:
    """The rows of a schedule, the last first, with times since its first row."""
    if schedule is None:
        return []
    try:
        rows = np.asarray(schedule, dtype=np.float64)
    except (TypeError, ValueError):
        raise _vsj.BadInput("schedule: not all are numbers; expected rows of time in s and voltage in V") from None
    if rows.ndim != 2 or rows.shape[1] != 2 or len(rows) == 0:
        raise _vsj.BadInput(f"schedule: shape {rows.shape}; expected (n, 2), one row or more, with time in s and voltage in V")
    times, voltages = rows.T
    if not np.isfinite(rows).all():
        raise _vsj.BadInput("schedule: a number that is not finite; expected times in s and voltages in V")
    if not (np.diff(times) > 0).all():
        raise _vsj.BadInput("schedule: times that do not increase; expected increasing times in s")
    return list(zip((times - times[0]).tolist(), voltages.tolist()))[::-1]
