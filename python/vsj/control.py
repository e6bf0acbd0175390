"""The controller's tick on arrays, and the spring alone."""

import warnings
from dataclasses import asdict, dataclass
from datetime import datetime, timezone
from enum import IntFlag
from typing import List, Mapping, Optional, Tuple

import numpy as np
from numpy.typing import ArrayLike

from . import _vsj
from .analysis import Plant, named_plant, number, optional, text
from .records import RecordWarning, unmasked, warn


class Limit(IntFlag):
    """A limit that acted in a tick: upper or lower end of the range, slew, or a target outside of the range."""

    UPPER = 1
    LOWER = 2
    SLEW = 4
    TARGET = 8


@dataclass(frozen=True)
class Feedback:
    """A stiffness sensor that corrects the estimate.

    ``noise_v`` is the standard deviation of one reading in V, ``model_uncertainty`` that with which the model's error wanders in V
    per root second, ``fastest_s`` the shortest time constant of the correction in s, ``interval_s`` the time between two readings
    in s, ``oldest_s`` the age in s above which a reading is stale, ``lowest_v`` and ``highest_v`` the sensor's range in V, and
    ``fade_s`` the time constant in s with which the correction decays while the sensor is not trusted.
    """

    noise_v: float = 1.0
    model_uncertainty: float = 1.0
    fastest_s: float = 0.1
    interval_s: float = 1e-3
    oldest_s: float = 0.01
    lowest_v: float = -50.0
    highest_v: float = 1000.0
    fade_s: float = 2.0


@dataclass(frozen=True)
class Run:
    """Ticks of a controller, as arrays of shape ``(n,)``.

    ``time_s`` since the first tick in s, ``target_v`` in V, the DAC's ``code`` (uint16), the ``applied_v`` of that code in V, the
    estimated ``stiffness_v`` just after it in V of equivalent static voltage, and ``limits`` that acted (uint8, bits of
    :class:`Limit`).
    """

    time_s: np.ndarray
    target_v: np.ndarray
    code: np.ndarray
    applied_v: np.ndarray
    stiffness_v: np.ndarray
    limits: np.ndarray

    def to_frame(self):
        """A pandas DataFrame with one row per tick."""
        import pandas

        return pandas.DataFrame({name: getattr(self, name) for name in self.__dataclass_fields__})

    def plot(self, axes=None):
        """Draw target, stiffness and voltage over time; returns the matplotlib Figure."""
        from .plots import run

        return run(self, axes)


class Controller:
    """The controller of the microcontroller, bit for bit: fixed-point pre-compensator, amplifier limits and estimator.

    Parameters
    ----------
    plant : str, path, Identified, Diagnosis or Spring
        The spring that the estimator runs: ``"paper"``, a plant file, or an answer of this package.
    controller : {"paper", "fast", "robust", "none"}
        The report's proportional-integral pre-compensator, the time-optimal one, the one for a spring that is known to within
        errors, or none.
    limit_v, min_v : float
        Highest and lowest voltage of the amplifier, in V.
    slew_v_per_s : float, optional
        Slew limit of the amplifier, in V/s; default: none.
    dac_bits : int
        Width of the DAC, in bits.
    kp, ki : float, optional
        Proportional gain, and integral gain in 1/s, of the controller ``"paper"``; default: 4 and 1.35, less for a spring that is too
        quick for them.
    approach_s : float, optional
        Time constant of the approach to the target of the controller ``"fast"``, in s.
    known : mapping, optional
        How well the controller ``"robust"`` knows the spring: errors of ``"tau"``, ``"share"`` and ``"gain"``, both ways, in percent,
        0 to 25; what is not in it is exact. Default: ``{"tau": 5, "share": 5}``.
    overshoot_percent : float, optional
        Overshoot that the controller ``"robust"`` may cause, in percent of a step, 0 to 20; default: 2.
    fall_back_percent : float, optional
        Part of a step by which the controller ``"robust"`` may let all springs fall back for a while without a sensor, so that the slow
        ones then stay above 97 % earlier, in percent, 0 to 50; default: 0. No effect unless the share is known better than the time
        constant.
    rate_hz : float
        Ticks per second, 100 to 10 000.
    feedback : Feedback, optional
        A stiffness sensor, whose readings :meth:`run` takes.

    Raises
    ------
    BadInput
        For the first setting out of its range, and for one that the controller does not have.
    """

    def __init__(
        self,
        plant: Plant = "paper",
        controller: str = "paper",
        *,
        limit_v: float = 700.0,
        min_v: float = 0.0,
        slew_v_per_s: Optional[float] = None,
        dac_bits: int = 12,
        kp: Optional[float] = None,
        ki: Optional[float] = None,
        approach_s: Optional[float] = None,
        known: Optional[Mapping[str, float]] = None,
        overshoot_percent: Optional[float] = None,
        fall_back_percent: Optional[float] = None,
        rate_hz: float = 1000.0,
        feedback: Optional[Feedback] = None,
    ) -> None:
        if feedback is not None and not isinstance(feedback, Feedback):
            raise _vsj.BadInput(f"feedback: {type(feedback).__name__}; expected vsj.Feedback")
        self.rate_hz = number("rate_hz", rate_hz)
        options = dict(
            controller=text("controller", controller),
            limit_v=number("limit_v", limit_v),
            min_v=number("min_v", min_v),
            slew_v_per_s=optional("slew_v_per_s", slew_v_per_s),
            dac_bits=_bits(dac_bits),
            kp=optional("kp", kp),
            ki=optional("ki", ki),
            approach_s=optional("approach_s", approach_s),
            margin=margin(controller, known, overshoot_percent, fall_back_percent),
            rate_hz=self.rate_hz,
            feedback=None if feedback is None else {name: number(name, value) for name, value in asdict(feedback).items()},
        )
        self._inner = _vsj.Controller(named_plant(plant), options)
        warn_of(self._inner.not_simulated)
        warn(self._inner.remarks)

    def __copy__(self):
        """A controller in the same state, which then has one of its own."""
        other = object.__new__(type(self))
        other.__dict__.update(self.__dict__, _inner=self._inner.copied())
        return other

    def __deepcopy__(self, memo):
        return self.__copy__()

    def __reduce__(self):
        raise TypeError("the state of a Controller cannot be pickled; expected its arguments, from which each process makes its own")

    @property
    def range_v(self) -> Tuple[float, float]:
        """Lowest and highest voltage that is put out, in V."""
        return self._inner.range_v

    def reset(self) -> None:
        """Forget everything: the spring is at rest at 0 V."""
        self._inner.reset()

    def run(self, targets: ArrayLike, readings: Optional[ArrayLike] = None) -> Run:
        """Run one tick per target, from where the last run ended.

        Parameters
        ----------
        targets : array_like of shape (n,)
            Desired stiffness, as the equivalent static voltage, in V.
        readings : array_like of shape (n,), optional
            Readings of the stiffness sensor just after the tick before, in V; NaN where there is none.

        Returns
        -------
        Run
            Arrays of shape (n,).
        """
        targets = vector(targets, "targets")
        readings = None if readings is None else vector(readings, "readings")
        code, applied, stiffness, limits = self._inner.run(targets, readings)
        time = np.arange(len(targets)) / self.rate_hz
        return Run(time, targets, code, applied, stiffness, limits)


def simulate(
    plant: Plant, time: ArrayLike, voltage: ArrayLike, *, rate_hz: float = 1000.0
) -> np.ndarray:
    """Compute the stiffness of a spring without a controller, as the microcontroller's model does.

    Parameters
    ----------
    plant : str, path, Identified, Diagnosis or Spring
        The spring: ``"paper"``, a plant file, or an answer of this package.
    time : array_like of shape (n,)
        Increasing times: numbers in s, time stamps or durations; they are rounded to the nearest tick, of which there are at most
        10 000 000.
    voltage : array_like of shape (n,)
        Applied voltage from each time on, held until the next, in V.
    rate_hz : float
        Ticks per second, 100 to 10 000.

    Returns
    -------
    numpy.ndarray of shape (n,)
        Stiffness just after the voltage was applied, as the equivalent static voltage, in V.

    Raises
    ------
    BadInput
        For a spring that the tick rejects, and times that are not finite or do not increase.
    """
    time, voltage = _seconds(time), vector(voltage, "voltage")
    stiffness, left_out = _vsj.simulate(named_plant(plant), time, voltage, number("rate_hz", rate_hz))
    warn_of(left_out)
    return stiffness


def margin(
    controller: str,
    known: Optional[Mapping[str, float]],
    overshoot_percent: Optional[float],
    fall_back_percent: Optional[float],
) -> Optional[List[float]]:
    """The parts that a margin consists of: time constant, share, gain, overshoot, fall back; None for a controller that has none."""
    for name, percent in (("overshoot_percent", overshoot_percent), ("fall_back_percent", fall_back_percent)):
        if controller != "robust" and percent is not None:
            raise _vsj.BadInput(f"{name} applies to the robust controller only: expected the controller robust")
    if known is None and controller != "robust":
        return None
    if known is not None and not isinstance(known, Mapping):
        raise _vsj.BadInput(f"known: {type(known).__name__}; expected a mapping such as {{'tau': 5}}")
    overshoot_percent = 2.0 if overshoot_percent is None else overshoot_percent
    fall_back_percent = 0.0 if fall_back_percent is None else fall_back_percent
    known = {"tau": 5.0, "share": 5.0} if known is None else known
    unknown = set(known) - {"tau", "share", "gain"}
    if unknown:
        raise _vsj.BadInput(f"known: {', '.join(sorted(map(str, unknown)))}; expected tau, share or gain")
    parts = [number(f"known[{key!r}]", known.get(key, 0.0)) for key in ("tau", "share", "gain")]
    parts += [number("overshoot_percent", overshoot_percent), number("fall_back_percent", fall_back_percent)]
    return [part / 100.0 for part in parts]


def vector(values, name):
    """``values`` as a contiguous array of doubles of shape (n,), NaN where a mask hides them; ``name`` is what messages call them."""
    # A whole number cannot be missing.
    array = _array(values.astype(np.float64) if np.ma.is_masked(values) and values.dtype.kind in "iu" else values, name)
    try:
        if array.dtype.kind in "Mm":
            raise TypeError
        array = np.ascontiguousarray(array, dtype=np.float64)
    except (TypeError, ValueError):
        raise _vsj.BadInput(f"{name}: values of the type {array.dtype}; expected numbers") from None
    if array.ndim != 1:
        raise _vsj.BadInput(f"{name}: shape {array.shape}; expected one dimension")
    return array


def _array(values, name):
    """``values`` as an array in which what a mask hides is missing; ``name`` is what messages call them."""
    try:
        return unmasked(values)
    except ValueError:
        raise _vsj.BadInput(f"{name}: rows of different lengths; expected one dimension of numbers") from None


def _bits(value):
    bits = number("dac_bits", value)
    if not 0 <= bits < 1000 or bits != int(bits):
        raise _vsj.BadInput(f"dac_bits: {value!r}; expected a whole number")
    return int(bits)


def _seconds(time):
    """Times in s: durations as such, time stamps from the first one."""
    array = _array(time, "time")
    if array.size and (array.dtype.kind == "M" or isinstance(array.flat[0], datetime)):
        try:
            if array.dtype.kind == "O":
                array = np.frompyfunc(_in_utc, 1, 1)(array)
            array = unmasked(array - array.flat[:1])
        except TypeError as error:
            raise _vsj.BadInput(f"time: {error}; expected time stamps, all with a zone or all without") from None
    return vector(array / np.timedelta64(1, "s") if array.dtype.kind == "m" else array, "time")


def _in_utc(stamp):
    """The stamp in UTC if it has a zone: Python's difference of two in one zone is that of its clock, which summer time sets."""
    return stamp.astimezone(timezone.utc) if getattr(stamp, "tzinfo", None) else stamp


def warn_of(left_out):
    """Warns of parts of a plant file that the tick does not simulate."""
    if left_out:
        warnings.warn(f"not simulated: {', '.join(left_out)}", RecordWarning, stacklevel=3)
