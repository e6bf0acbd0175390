"""Causes and drifts of each spring, from the table of results.

Rows come in, ordered by spring and time; one spring is in memory at a time. A :class:`report.Summary` goes out, whose size depends on the
number of springs, not on that of records.
"""

import datetime
import itertools
from collections import Counter

import numpy as np

from . import work
from .chart import chart
from .report import Drift, FleetCause, Moment, Presence, Problem, Series, Spring, Summary

_CHARTS = 24
"""Most charts that are kept."""
_PROBLEMS = 100
"""Most records without a diagnosis that are named."""
_IMPRECISE = 5.0
"""A value whose interval is wider than this many times the median of its series says nothing about a change."""


def summary(rows):
    """The summary of rows that are ordered by spring and time."""
    springs, status, verdicts, series, problems = [], Counter(), Counter(), [], []
    causes, charts, compared = {}, 0, 0
    for name, group in itertools.groupby(rows, lambda row: row["spring"]):
        group = list(group)
        for row in group:
            status[row["status"]] += 1
            if row["verdict"]:
                verdicts[row["verdict"]] += 1
            if row["error"] and len(problems) < _PROBLEMS:
                problems.append(Problem(row["record"], row["status"], row["error"]))
        present = _causes(group)
        drifting, tried, values = _drifts(name, group)
        charts, compared = charts + tried, compared + values
        series = sorted(series + drifting, key=lambda it: (not it.drift.stands, -it.drift.strength))[:_CHARTS]
        drifts = [it.drift for it in drifting]
        springs.append(Spring(name, len(group), _moment(group[-1]), group[-1]["verdict"], present, drifts))
        for it in present:
            causes.setdefault(it.cause, []).append(it)
    fleet_causes = (_fleet_cause(cause, where) for cause, where in causes.items())
    return Summary(
        springs=sorted(springs, key=lambda it: it.strength, reverse=True),
        status=dict(status),
        verdicts=dict(verdicts),
        causes=sorted(fleet_causes, key=lambda it: (-it.springs, -it.records)),
        series=series,
        problems=problems,
        charts=charts,
        compared=compared,
    )


def _moment(row):
    return Moment(row["record"], row["time"])


def _causes(group):
    """The causes of a spring, the most frequent first."""
    judged = [row for row in group if row["status"] == work.DIAGNOSED and row["verdict"] != "insufficient"]
    names = [{finding["cause"] for finding in row["findings"]} for row in judged]
    found = []
    for cause in set().union(*names):
        present = np.array([cause in it for it in names])
        since = _since(present)
        last = int(np.flatnonzero(present)[-1])
        there = present[since:]
        found.append(Presence(cause, _moment(judged[since]), _moment(judged[last]), int(there.sum()), len(there)))
    return sorted(found, key=lambda it: (-it.found / it.of, -it.found, it.cause))


def _since(present):
    """The index from which something is more frequent than before, of largest likelihood; 0 if it is nowhere."""
    count, total = len(present), int(present.sum())
    before = np.concatenate([[0], np.cumsum(present)[:-1]])
    length = np.arange(count)

    def likelihood(hits, trials):
        rate = np.divide(hits, trials, out=np.zeros(count), where=trials > 0)
        with np.errstate(divide="ignore", invalid="ignore"):
            return np.nan_to_num(hits * np.log(rate)) + np.nan_to_num((trials - hits) * np.log1p(-rate)), rate

    (left, rate_before), (right, rate_after) = likelihood(before, length), likelihood(total - before, count - length)
    return int(np.argmax(np.where((rate_after > rate_before) | (length == 0), left + right, -np.inf)))


def _drifts(name, group):
    """The drifts of a spring, the number of charts, and that of compared values."""
    series = {}
    for row in group:
        if row["status"] != work.DIAGNOSED:
            continue
        named = [(it["name"], it) for it in row["identified"] or []]
        named += [(f"{finding['cause']} {it['name']}", it) for finding in row["findings"] for it in finding["parameters"]]
        for parameter, it in named:
            if it["value"] is not None and np.isfinite(it["value"]):
                series.setdefault((parameter, it["unit"]), []).append((_moment(row), it["value"], it["low"], it["high"]))
    drifting, charts, compared = [], 0, 0
    for (parameter, unit), points in series.items():
        moments = [moment for moment, *_ in points]
        values, low, high = np.array([numbers for _, *numbers in points], dtype=float).T
        width = high - low
        # A parameter may have no interval.
        precise = np.isnan(width) | (width <= _IMPRECISE * np.nanmedian(width) if np.any(~np.isnan(width)) else False)
        moments, values, low, high = list(itertools.compress(moments, precise)), values[precise], low[precise], high[precise]
        found = chart(values)
        if found is None:
            continue
        charts, compared = charts + 1, compared + found.compared
        change = found.change
        if change is None:
            continue
        drift = Drift(
            spring=name,
            parameter=parameter,
            unit=unit,
            after_record=moments[change.first - 1],
            by_record=moments[change.first],
            until=moments[change.last],
            stands=change.last == len(values) - 1,
            before=change.before,
            after=change.after,
            scatter=float(np.std(values[: change.first], ddof=min(1, change.first - 1))),
        )
        drifting.append(Series(drift, moments, values, low, high, found, int(np.sum(~precise))))
    return drifting, charts, compared


def _fleet_cause(cause, where):
    first = min((it.since for it in where), key=_order)
    last = max((it.last for it in where), key=_order)
    return FleetCause(cause, len(where), sum(it.found for it in where), first, last)


def _order(moment):
    return (moment.time is not None, moment.time or datetime.datetime.min, moment.record)
