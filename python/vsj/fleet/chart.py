"""The control chart of a parameter over a spring's life: did it change, and since when?

Values of one parameter in the order of time come in, a :class:`Chart` goes out. An individuals chart and an EWMA chart need the mean and
the standard deviation of the process, which nobody knows of a new spring, and with estimates from few records their false alarms
multiply (Jones, Champ, Rigdon, Technometrics 43, 2001). So the chart is self-starting: each value is compared with all that came before,
as a standard normal Q (Quesenberry, Journal of Quality Technology 23, 1991, case of unknown mean and variance), from the third value on,

    Q[n] = Phi^-1( T[k-1]( (x[n] - mean) / (s sqrt(1 + 1/k)) ) ),    k values before, of this mean and standard deviation s,

and the EWMA of Q (Roberts, Technometrics 1, 1959) has the exact limits of a known process,

    z[n] = (1 - 0.2) z[n-1] + 0.2 Q[n],    |z[n]| <= 2.962 sqrt( 0.2 / 1.8 (1 - 0.8^(2n)) ),

which one value in 500 of an unchanged process leaves (Lucas, Saccucci, Technometrics 32, 1990). Three further rules:

- A value whose abs(Q) is above 3 is learnt as one of 3, and a value while z is outside not at all (Hawkins, Olwell, Cumulative Sum
  Charts, 1998, chapter 7).
- Q enters the EWMA within 2.962, so that no single record is a change, however far off (after Lucas, Crosier, Technometrics 24, 1982).
- When a change began is the most likely time of a step, up to the signal (Hinkley, Biometrika 57, 1970).

With these rules 350 to 440 values of an unchanged process are compared for each signal, in series of 10 to 200 (simulated, 2000 series).
A chart counts records. A gap in time is no change, and hides none: it says only after which record and by which one it came.
"""

import dataclasses
import math
from typing import List, Optional

import numpy as np
from scipy import special

WEIGHT = 0.2
WIDTH = 2.962
COMPARED_PER_FALSE_ALARM = 400
_SINGLE = 3.0


@dataclasses.dataclass(frozen=True)
class Change:
    """A change of the process. Numbers are indices of values."""

    first: int
    """The first value after the change."""
    last: int
    """The last value at which z is outside."""
    before: float
    """Mean of the values before the change."""
    after: float
    """Mean of the values from the change to ``last``."""


@dataclasses.dataclass(frozen=True)
class Chart:
    """The chart of a series; arrays have one element for each value, NaN before the first comparison."""

    z: np.ndarray
    limit: np.ndarray
    singles: List[int]
    """Values that are off by themselves."""
    change: Optional[Change]
    """The last change."""
    compared: int
    """Values that were compared."""


class _Process:
    """Mean and standard deviation of the values that were learnt (Welford, Technometrics 4, 1962)."""

    def __init__(self):
        self.count, self.mean, self.squares, self.largest = 0, 0.0, 0.0, 0.0

    def learn(self, value):
        self.count += 1
        away = value - self.mean
        self.mean += away / self.count
        self.squares += away * (value - self.mean)
        self.largest = max(self.largest, abs(value))

    def scale(self):
        """Standard deviation of the difference between a new value and the mean; ``None`` without a scatter."""
        if self.count < 2:
            return None
        scale = math.sqrt(self.squares / (self.count - 1) * (1 + 1 / self.count))
        # Values that differ by rounding only do not scatter.
        return scale if scale > 1e-12 * self.largest else None

    def q(self, value, scale):
        t = (value - self.mean) / scale
        # In the lower tail, where probabilities keep their digits.
        return -math.copysign(1, t) * max(float(special.ndtri(special.stdtr(self.count - 1, -abs(t)))), -38.0)

    def at(self, q, scale):
        """The value of a Q."""
        return self.mean + float(special.stdtrit(self.count - 1, special.ndtr(q))) * scale


def chart(values):
    """The chart of a series; ``None`` if it is too short to compare anything, or if its values do not scatter."""
    values = np.asarray(values, dtype=float)
    z, limit = np.full(len(values), np.nan), np.full(len(values), np.nan)
    process, singles, change = _Process(), [], None
    smooth, compared = 0.0, 0
    for index, value in enumerate(values):
        scale = process.scale()
        if scale is None:
            process.learn(value)
            continue
        q = process.q(value, scale)
        compared += 1
        if abs(q) > _SINGLE:
            singles.append(index)
        z[index] = smooth = (1 - WEIGHT) * smooth + WEIGHT * min(max(q, -WIDTH), WIDTH)
        limit[index] = WIDTH * math.sqrt(WEIGHT / (2 - WEIGHT) * (1 - (1 - WEIGHT) ** (2 * compared)))
        # The first comparison reaches the limit at most, but for rounding.
        if abs(smooth) <= limit[index] * (1 + 1e-9):
            process.learn(process.at(math.copysign(min(abs(q), _SINGLE), q), scale))
        elif change and change[1] == index - 1:
            change = (change[0], index)
        else:
            change = (index, index)
    if not compared:
        return None
    return Chart(z, limit, singles, change and _change(values, *change), compared)


def _change(values, signal, last):
    """The change that the chart signals from ``signal`` to ``last``; its first value is where two means leave the least squares."""
    values = values[: last + 1]
    count = np.arange(1, signal + 1)
    left = np.cumsum(values)[:signal]
    right = values.sum() - left
    first = int(np.argmax(left**2 / count + right**2 / (len(values) - count))) + 1
    return Change(first, last, float(values[:first].mean()), float(values[first:].mean()))
