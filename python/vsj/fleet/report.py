"""What a summary says, as data classes."""

import dataclasses
import datetime
from typing import Dict, List, Optional

import numpy as np

from .chart import Chart


@dataclasses.dataclass(frozen=True)
class Moment:
    """A record, and when it was measured if that is known."""

    record: str
    time: Optional[datetime.datetime]

    def __str__(self):
        if self.time is None:
            return self.record
        return self.time.strftime("%Y-%m-%d" if self.time.time() == datetime.time() else "%Y-%m-%d %H:%M")


@dataclasses.dataclass(frozen=True)
class Presence:
    """A cause in a spring."""

    cause: str
    since: Moment
    """The first record of the part in which the cause is more frequent than before: the most likely single change of its frequency
    (Hinkley, Hinkley, Biometrika 57, 1970)."""
    last: Moment
    """The last record that has it."""
    found: int
    """Records with the cause from ``since`` on."""
    of: int
    """Records that were judged from ``since`` on."""


@dataclasses.dataclass(frozen=True)
class Drift:
    """A parameter of a spring that changed."""

    spring: str
    parameter: str
    unit: str
    after_record: Moment
    """The change came after this record,"""
    by_record: Moment
    """and by this one."""
    until: Moment
    """The last record at which the chart is outside its limits."""
    stands: bool
    """True if that is the spring's last record."""
    before: float
    after: float
    scatter: float
    """Standard deviation before the change."""

    @property
    def strength(self):
        """Size of the change in standard deviations."""
        return abs(self.after - self.before) / self.scatter if self.scatter > 0 else np.inf


@dataclasses.dataclass(frozen=True)
class Series:
    """A drift with its chart, for a figure."""

    drift: Drift
    moments: List[Moment]
    values: np.ndarray
    low: np.ndarray
    high: np.ndarray
    chart: Chart
    imprecise: int
    """Values that are left out because their intervals are much wider than the others'."""


@dataclasses.dataclass(frozen=True)
class Spring:
    """What there is to say about a spring."""

    name: str
    records: int
    last: Moment
    verdict: Optional[str]
    """The last record's; ``None`` if that has no diagnosis."""
    causes: List[Presence]
    drifts: List[Drift]

    @property
    def strength(self):
        """Springs with more to say come first."""
        return (
            len(self.causes) + len([it for it in self.drifts if it.stands]),
            max((it.strength for it in self.drifts), default=0.0),
        )


@dataclasses.dataclass(frozen=True)
class FleetCause:
    """A cause in a fleet."""

    cause: str
    springs: int
    records: int
    first: Moment
    last: Moment


@dataclasses.dataclass(frozen=True)
class Problem:
    """A record without a diagnosis."""

    record: str
    status: str
    error: str


@dataclasses.dataclass(frozen=True)
class Summary:
    """What there is to say about a fleet."""

    springs: List[Spring]
    status: Dict[str, int]
    """Records by status."""
    verdicts: Dict[str, int]
    """Records by verdict."""
    causes: List[FleetCause]
    series: List[Series]
    """The strongest drifts."""
    problems: List[Problem]
    """The first records without a diagnosis."""
    charts: int
    compared: int
    """Charts, and values that were compared in them."""
