"""Answers as data classes. Their fields are those of the command's JSON; a field that the JSON leaves out has its default."""

import json
import math
from dataclasses import dataclass, field, fields, is_dataclass
from typing import Any, Dict, List, Optional, Union, get_args, get_origin, get_type_hints

from . import display

_HINTS = {}


def build(kind, value):
    """``value`` of parsed JSON as an instance of the type ``kind``."""
    if value is None:
        return None
    origin, inner = get_origin(kind), get_args(kind)
    if origin is Union:
        return build(inner[0], value)
    if origin is list:
        return [build(inner[0], each) for each in value]
    if origin is dict:
        return {key: build(inner[1], each) for key, each in value.items()}
    if not is_dataclass(kind):
        return value
    if "low" in value and "high" in value:
        # JSON has no infinite number: a bound that is none is null.
        low, high = (infinite if value[end] is None else value[end] for end, infinite in (("low", -math.inf), ("high", math.inf)))
        value = {**value, "low": low, "high": high}
    hints = _HINTS.get(kind) or _HINTS.setdefault(kind, get_type_hints(kind))
    return kind(**{it.name: build(hints[it.name], value[it.name]) for it in fields(kind) if it.init and it.name in value})


@dataclass(frozen=True)
class Quantity:
    """A quantity with its 95 % interval, in ``unit`` (``""`` for a dimensionless number)."""

    value: float
    low: float
    high: float
    unit: str


@dataclass(frozen=True)
class TimeConstant(Quantity):
    """A time constant in s; ``weight`` is its part of the static gain."""

    weight: Quantity


@dataclass(frozen=True)
class Oscillation:
    """A complex pair of poles."""

    freq_hz: Quantity
    zeta: Quantity
    weight: Quantity
    rate_weight: Quantity


@dataclass(frozen=True)
class LinearError:
    """Errors of the best linear model of one order, in the reading's unit."""

    order: int
    rmse: float
    held_out_rmse: float
    last_40_percent_rmse: float


@dataclass(frozen=True)
class LinearSpring:
    """The linear spring that a record shows."""

    gain: Quantity
    zero: Quantity
    share: Quantity
    delay_s: Quantity
    tau_s: List[TimeConstant]


@dataclass(frozen=True)
class Start:
    """What a record's first reading tells, in the reading's unit."""

    record: str
    zero: Quantity
    offset: Quantity


@dataclass(frozen=True)
class FarReading:
    """A reading far from those around it and from every model: ``time_s`` in s, ``reading`` in its unit."""

    record: str
    time_s: float
    reading: float


@dataclass(frozen=True)
class AtBound:
    """``readings`` readings of a record that stopped at the sensor's bound ``limit``, in their unit."""

    record: str
    limit: float
    readings: int


@dataclass(frozen=True)
class ZeroShift:
    """A shift of a record's readings ``by`` a constant, in their unit, ``from_s`` on, in s."""

    record: str
    from_s: float
    by: float


@dataclass(frozen=True)
class ErrorStatistics:
    """The errors that the linear spring leaves."""

    sigma: float
    autocorrelation: float
    scatter: float


@dataclass(frozen=True)
class Parameter:
    """A parameter of a cause with its 95 % interval, in ``unit``."""

    value: float
    low: float
    high: float
    unit: str
    at_bound: bool = False
    extrapolated_from_v: Optional[List[float]] = None


@dataclass(frozen=True)
class Finding:
    """A cause that the record supports; errors are in the reading's unit."""

    cause: str
    probability: float
    parameters: Dict[str, Parameter]
    rmse_before: float
    rmse_after: float
    evidence: str


@dataclass(frozen=True)
class Suspect:
    """A cause that comes close to a finding but is none."""

    cause: str
    parameters: Dict[str, Parameter]
    rmse_before: float
    rmse_after: float
    nats_short: float
    judge: str
    # `with` in the JSON, which is a word of Python.
    with_: List[str] = field(default_factory=list)
    probability: Optional[float] = None


@dataclass(frozen=True)
class Quality:
    """Errors of a simulation, in the reading's unit."""

    rmse: float
    fit_percent: float
    held_out_rmse: float
    one_step_rmse: float


@dataclass(frozen=True)
class Extended(Quality):
    """Errors of the simulation extended by the findings; ``gain`` is the held-out improvement, 0 to 1."""

    gain: float
    law_range_v: Optional[List[float]] = None
    model: Optional[str] = None
    fixed_point_error_v: Optional[float] = None
    tick_refuses: Optional[str] = None


@dataclass(frozen=True)
class NominalPlant:
    """The simulation that a record is compared with."""

    plant: str
    gain: float
    zero: float
    share: float
    tau_s: List[float]
    delay_s: float
    freq_hz: List[float]


@dataclass(frozen=True)
class SearchReport:
    """How far a search got."""

    effort: str
    work: int
    allowed: int
    finished: bool


@dataclass(frozen=True)
class NoiseReport:
    """Parameters of the noise of the readings, in the reading's unit."""

    sigma: float
    tail: Optional[float]
    memory_rows: int


@dataclass(frozen=True)
class ResidualReport:
    """Correlations of the whitened residual."""

    autocorrelation: List[float]
    input_correlation: List[float]
    band: float


@dataclass(frozen=True)
class Margins:
    """Smallest errors that the record would have shown, as fractions."""

    gain: float
    time_constant: float


@dataclass(frozen=True)
class RecordReport:
    """What one of several records shows beyond the causes that they share; offset, sigma and rmse are in the reading's unit."""

    name: str
    rows: int
    offset: float
    sigma: float
    rmse: float
    verdict: str
    findings: List[Finding]
    leftover: Optional[str]


@dataclass(frozen=True)
class HeldOutErrors:
    """Errors of four models on the same held-out segments, in the reading's unit."""

    nominal: float
    extended: float
    linear: float
    equation: float


@dataclass(frozen=True)
class Equation:
    """What is known of an equation."""

    blocks: List[str]
    definitions: List[str]
    parameters: Dict[str, Parameter]
    rmse: float
    held_out: HeldOutErrors
    nats_over_extended: float
    nats_over_linear: float
    plant: Optional[str]
    no_plant: Optional[str]


@dataclass(frozen=True)
class Suspected:
    """A suspect of a diagnosis, with the logarithm of its odds in nats, and what an experiment is predicted to show of it."""

    cause: str
    causes: List[str]
    nats: float
    probability: float
    rival: List[str]


@dataclass(frozen=True)
class Separation:
    """A true set of causes compared with a rival."""

    truth: List[str]
    rival: List[str]
    nats: float
    probability: float


@dataclass(frozen=True)
class Part:
    """A part of a schedule; times in s, voltage in V."""

    from_s: float
    to_s: float
    voltage_v: float
    ramp: bool
    separates: Optional[List[int]]
    contribution: float


@dataclass(frozen=True)
class Sharper:
    """Half of a parameter's 95 % interval before and after an experiment, in ``unit``."""

    cause: str
    parameter: str
    value: float
    now: Optional[float]
    planned: float
    unit: str


class Answer:
    """What all answers have in common."""

    @classmethod
    def _of(cls, text, **parts):
        value = json.loads(text)
        for suspect in value.get("suspects", []):
            suspect["with_"] = suspect.pop("with", [])
        answer = build(cls, value)
        for name, part in dict(parts, _json=text).items():
            object.__setattr__(answer, name, part)
        return answer

    def to_json(self) -> str:
        """The answer as one line of JSON, equal to the command's with ``--json``."""
        return self._json

    def _courses_frame(self):
        import pandas

        frames = [pandas.DataFrame(course).assign(record=name) for name, course in self.courses]
        return pandas.concat(frames, ignore_index=True)


@dataclass(frozen=True)
class Identified(Answer):
    """The linear spring that records show.

    ``order`` counts its poles, ``undriven_order`` those beside it that the voltage does not drive.
    ``plant`` is the text of a plant file. ``courses`` holds the name of each record and its arrays of shape ``(n,)``: ``time_s``
    in s, ``voltage_v`` in V, ``reading``, ``model``, ``residual`` and ``held_out`` (reading minus a prediction by a fit that did
    not use the segment) in the reading's unit, without the readings of ``left_out`` and ``at_bound``.
    """

    schema: int
    rows: int
    order: int
    undriven_order: int
    nominal: LinearSpring
    oscillation: List[Oscillation]
    input_law: str
    rmse: float
    held_out_rmse: float
    last_40_percent_rmse: float
    static_held_out_rmse: float
    linear: List[LinearError]
    start: List[Start]
    noise: ErrorStatistics
    left_out: List[FarReading]
    at_bound: List[AtBound]
    zero_shifts: List[ZeroShift]
    remarks: List[str]
    unit: str
    model: Optional[str]
    bound_command: Optional[str]
    plant: str = field(init=False, repr=False, compare=False)
    courses: list = field(init=False, repr=False, compare=False)

    def __repr__(self):
        return display.identified_line(self)

    def to_frame(self):
        """A pandas DataFrame with one row per quantity: ``quantity``, ``value``, ``low``, ``high``, ``unit``."""
        import pandas

        nominal = self.nominal
        rows = [(name, getattr(nominal, name)) for name in ("gain", "zero", "share", "delay_s")]
        for index, tau in enumerate(nominal.tau_s):
            rows += [(f"tau_s[{index}]", tau), (f"weight[{index}]", tau.weight)]
        for index, pair in enumerate(self.oscillation):
            rows += [(f"{it.name}[{index}]", getattr(pair, it.name)) for it in fields(pair)]
        return pandas.DataFrame([(name, it.value, it.low, it.high, it.unit) for name, it in rows], columns=_QUANTITY)

    def courses_frame(self):
        """A pandas DataFrame with one row per reading: the columns of ``courses``, and the name of the record."""
        return self._courses_frame()

    def plot(self, axes=None):
        """Draw readings, model and residual over time; returns the matplotlib Figure."""
        from .plots import courses

        return courses(self.courses, ("model",), self.unit, axes)


@dataclass(frozen=True)
class Diagnosis(Answer):
    """What a simulation gets wrong on records, and the causes.

    ``plant`` is the text of the plant file of the extended simulation, ``unit`` the readings' unit. ``courses`` holds the name of each record and its arrays of
    shape ``(n,)``: ``time_s`` in s, ``voltage_v`` in V, ``reading``, ``baseline``, ``extended`` and their residuals in the
    reading's unit.
    """

    schema: int
    rows: int
    complete: bool
    search: SearchReport
    verdict: str
    nominal: NominalPlant
    baseline: Quality
    findings: List[Finding]
    suspects: List[Suspect]
    alternatives: List[List[str]]
    next_experiment: Optional[str]
    extended: Extended
    linear: Optional[LinearError]
    equation: Optional[str]
    equation_details: Optional[Equation]
    leftover: Optional[str]
    noise: NoiseReport
    residual: ResidualReport
    rivals: List[Dict[str, Any]]
    experiment: Optional[Dict[str, Any]]
    take_out: List[str] = field(default_factory=list)
    would_show: Optional[Margins] = None
    records: List[RecordReport] = field(default_factory=list)
    plant: str = field(init=False, repr=False, compare=False)
    unit: str = field(init=False, repr=False, compare=False)
    courses: list = field(init=False, repr=False, compare=False)

    def __repr__(self):
        return display.diagnosis_line(self)

    def _repr_html_(self):
        return display.diagnosis_html(self)

    def to_frame(self):
        """A pandas DataFrame with one row per parameter of each finding: ``cause``, ``probability``, ``parameter``, ``value``,
        ``low``, ``high``, ``unit``, ``rmse_before``, ``rmse_after``."""
        import pandas

        rows = [
            (it.cause, it.probability, name, par.value, par.low, par.high, par.unit, it.rmse_before, it.rmse_after)
            for it in self.findings
            for name, par in it.parameters.items()
        ]
        columns = ["cause", "probability", "parameter", *_QUANTITY[1:], "rmse_before", "rmse_after"]
        return pandas.DataFrame(rows, columns=columns)

    def courses_frame(self):
        """A pandas DataFrame with one row per reading: the columns of ``courses``, and the name of the record."""
        return self._courses_frame()

    def plot(self, axes=None):
        """Draw readings, both simulations and their residuals over time; returns the matplotlib Figure."""
        from .plots import courses

        return courses(self.courses, ("baseline", "extended"), self.unit, axes)


@dataclass(frozen=True)
class Plan(Answer):
    """The next experiment.

    ``course`` holds arrays of shape ``(n,)``: ``time_s`` in s, and ``voltage_v`` in V, each held until the next time.
    """

    schedule: Optional[str]
    decides: List[List[str]]
    probability: Optional[float]
    minutes: float
    range_v: List[float]
    suspects: List[Suspected]
    separations: List[Separation]
    parts: List[Part]
    intervals: List[Sharper]
    remarks: List[str]
    course: dict = field(init=False, repr=False, compare=False)

    def __repr__(self):
        return display.plan_line(self)

    def to_frame(self):
        """The schedule as a pandas DataFrame with the columns ``time_s`` and ``voltage_v``."""
        import pandas

        return pandas.DataFrame(self.course)

    def plot(self, axes=None):
        """Draw the schedule; returns the matplotlib Figure."""
        from .plots import schedule

        return schedule(self.course, axes)


_QUANTITY = ["quantity", "value", "low", "high", "unit"]
