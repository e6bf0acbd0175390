"""The summary as one HTML page, which needs no other file.

It has the style of the report page of `vsj diagnose`: light and dark, and on a narrow screen each row of a table is a block.
"""

import dataclasses
import datetime
from typing import List, Tuple

import jinja2
import numpy as np

from .. import __version__
from .._vsj import PAGE_STYLE
from . import figure
from .chart import COMPARED_PER_FALSE_ALARM

NAME = "fleet.html"
_SPRINGS = 200
"""Most springs in the table; the others are in the table of results."""

_PAGE = jinja2.Environment(
    loader=jinja2.PackageLoader("vsj.fleet", ""), autoescape=True, trim_blocks=True, lstrip_blocks=True
).get_template("page.html")


@dataclasses.dataclass(frozen=True)
class Table:
    """Name and class of each column, and the cells of each row."""

    columns: List[Tuple[str, str]]
    rows: List[list]


def page(found, records, settings):
    """The page of a summary; ``records`` is the address of the records. All texts are escaped."""
    springs = found.springs[:_SPRINGS]
    return _PAGE.render(
        found=found,
        style=PAGE_STYLE,
        figure_style=figure.STYLE,
        records=records,
        settings=settings,
        version=__version__,
        count=sum(found.status.values()),
        verdicts=_verdicts(found),
        causes=_causes(found.causes),
        springs=_springs(springs),
        springs_left_out=len(found.springs) - len(springs),
        drifts=_drifts(found.springs),
        drifts_in_all=sum(len(it.drifts) for it in found.springs),
        figures=[figure.drawn(it) for it in found.series],
        false_alarms=found.compared / COMPARED_PER_FALSE_ALARM,
        problems=Table([("record", "cause"), ("status", ""), ("error", "")], [[it.record, it.status, it.error] for it in found.problems]),
        problems_in_all=found.status.get("refused", 0) + found.status.get("failed", 0),
        drawn=datetime.datetime.now(datetime.timezone.utc).strftime("%Y-%m-%d %H:%M UTC"),
    )


def _verdicts(found):
    counted = {**found.verdicts, **{name: found.status[name] for name in ("refused", "failed") if name in found.status}}
    total = sum(counted.values())
    rows = [[name, count, f"{100 * count / total:.1f}"] for name, count in sorted(counted.items(), key=lambda it: -it[1])]
    return Table([("verdict", "cause"), ("records", "number"), ("%", "number")], rows)


def _causes(causes):
    columns = [("cause", "cause"), ("springs", "number"), ("records", "number"), ("earliest since", ""), ("last seen", "")]
    return Table(columns, [[it.cause, it.springs, it.records, str(it.first), str(it.last)] for it in causes])


def _springs(springs):
    def causes(spring):
        counted = lambda it: f"{it.found} of {it.of} record{'' if it.of == 1 else 's'}"
        return "; ".join(f"{it.cause} since {it.since} ({counted(it)})" for it in spring.causes)

    def drifts(spring):
        return ", ".join(it.parameter for it in spring.drifts if it.stands)

    columns = [("spring", "cause"), ("records", "number"), ("last record", ""), ("verdict", ""), ("causes", "set"), ("drifts", "")]
    rows = [[it.name, it.records, str(it.last), it.verdict or "none", causes(it), drifts(it)] for it in springs]
    return Table(columns, rows)


def _drifts(springs):
    drifts = sorted((it for spring in springs for it in spring.drifts), key=lambda it: (not it.stands, -it.strength))
    columns = [
        ("spring", "cause"),
        ("parameter", ""),
        ("before", "number"),
        ("after", "number"),
        ("standard deviations", "number"),
        ("began after", ""),
        ("and by", ""),
        ("until", ""),
    ]
    rows = []
    for it in drifts[:_SPRINGS]:
        digits = figure.digits(it.scatter)
        unit = f" {it.unit}" if it.unit else ""
        until = "now" if it.stands else str(it.until)
        strength = f"{it.strength:.1f}" if np.isfinite(it.strength) else "no scatter before"
        rows.append(
            [it.spring, it.parameter, f"{it.before:.{digits}f}{unit}", f"{it.after:.{digits}f}{unit}", strength]
            + [str(it.after_record), str(it.by_record), until]
        )
    return Table(columns, rows)
