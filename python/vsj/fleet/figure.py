"""A control chart as an inline SVG: values with their intervals above, the EWMA within its limits below."""

import dataclasses
import datetime
import math
from typing import List

import numpy as np
from markupsafe import Markup, escape

STYLE = """
svg.chart { max-width: 100%; height: auto; font: 15px system-ui, "DejaVu Sans", Helvetica, Arial, sans-serif; fill: var(--soft); }
svg.chart path { fill: none; stroke: var(--rule); }
svg.chart .value { fill: var(--after); } svg.chart .interval { stroke: var(--after); opacity: .55; }
svg.chart .off { fill: var(--before); } svg.chart path.off { fill: none; stroke: var(--before); opacity: .55; }
svg.chart .mean { stroke: var(--ink); stroke-dasharray: 4 4; } svg.chart .limit { stroke: var(--before); }
svg.chart .smooth { stroke: var(--after); stroke-width: 2; }
@media (max-width: 560px) { svg.chart { font-size: 24px; } }
"""

_COLUMNS = ["record", "value", "low", "high", "EWMA", "limit"]
_WIDTH, _LEFT, _RIGHT = 800, 110, 785
_TOP, _MIDDLE, _LOWER, _BOTTOM = 15, 215, 240, 330
_HEIGHT = 375
_POINTS = 200
"""Most values that are drawn: the last ones."""
_GAP = 5.0
"""A line ends where two records are apart by more than this many times the median interval."""


@dataclasses.dataclass(frozen=True)
class Figure:
    """A chart with its caption and the values that it shows."""

    svg: Markup
    caption: str
    columns: List[str]
    rows: List[List[str]]


def digits(scatter):
    """Decimals that show a standard deviation with two digits."""
    return min(12, max(0, 1 - math.floor(math.log10(scatter)))) if scatter > 0 else 6


def drawn(series):
    """The figure of a series."""
    shown = slice(max(0, len(series.values) - _POINTS), None)
    drift, chart = series.drift, series.chart
    moments, values, low, high = series.moments[shown], series.values[shown], series.low[shown], series.high[shown]
    z, limit = chart.z[shown], chart.limit[shown]
    outside = np.abs(z) > limit
    dated = all(it.time is not None for it in moments)
    at = np.array([it.time.timestamp() for it in moments]) if dated else np.arange(len(moments), dtype=float)
    x = _scale(at.min(), at.max(), _LEFT + 10, _RIGHT - 10)
    # Wide intervals of single records may leave the picture; the values may not.
    span = np.ptp(values) or abs(values[0]) or 1.0
    bottom = max(np.nanmin(low, initial=values.min()), values.min() - span)
    top = min(np.nanmax(high, initial=values.max()), values.max() + span)
    y = _scale(bottom, top, _MIDDLE - 8, _TOP + 8)
    reach = max(np.nanmax(np.abs(z)), np.nanmax(limit)) * 1.1
    below = _scale(-reach, reach, _BOTTOM, _LOWER)
    parts = [_axis(bottom, top, y), _time_axis(moments, at, x, dated)]
    parts += [_path([(_LEFT, below(0)), (_RIGHT, below(0))], ""), _text(_LEFT - 8, below(0) + 5, "EWMA", "end")]
    mean = drift.before
    parts.append(_path([(_LEFT, y(mean)), (_RIGHT, y(mean))], "mean"))
    decimals = digits(drift.scatter)
    number = lambda it, places: "" if np.isnan(it) else f"{it:.{places}f}"
    rows = [
        [str(moment), *(number(it, decimals) for it in quantity), *(number(it, 2) for it in ewma)]
        for moment, quantity, ewma in zip(moments, zip(values, low, high), zip(z, limit))
    ]
    for each, value, one, other, is_off, row in zip(at, values, low, high, outside, rows):
        name = "off" if is_off else "interval"
        parts.append(_path([(x(each), y(max(one, bottom))), (x(each), y(min(other, top)))], name))
        # The text that browsers show on hover.
        shown_values = "\n".join(f"{column}: {cell}" for column, cell in zip(_COLUMNS, row) if cell)
        circle = Markup('<circle class="{}" cx="{:.1f}" cy="{:.1f}" r="3.5"><title>{}</title></circle>')
        parts.append(circle.format("off" if is_off else "value", x(each), y(value), shown_values))
    steps = np.diff(at)
    breaks = np.flatnonzero(steps > _GAP * np.median(steps)) + 1 if len(steps) else []
    for piece in np.split(np.arange(len(at)), breaks):
        piece = piece[~np.isnan(z[piece])]
        for course, name in ((limit, "limit"), (-limit, "limit"), (z, "smooth")):
            parts.append(_path([(x(at[it]), below(course[it])) for it in piece], name))
    title = f"{drift.spring}: {drift.parameter}" + (f" [{drift.unit}]" if drift.unit else "")
    label = escape(f"{title} over the records, with the EWMA and its limits")
    svg = Markup('<svg class="chart" viewBox="0 0 {} {}" role="img" aria-label="{}">{}</svg>').format(
        _WIDTH, _HEIGHT, label, Markup("").join(parts)
    )
    caption = (
        f"{title}, with 95 % intervals of each record; dashed: mean before the change. Below: EWMA and its limits; records at which it "
        "is outside of them have the other colour."
    )
    if series.imprecise:
        caption += f" {series.imprecise} records with much wider intervals are left out."
    if len(series.values) > _POINTS:
        caption += f" The last {_POINTS} of {len(series.values)} records."
    return Figure(svg, caption, _COLUMNS, rows)


def _scale(low, high, start, end):
    width = (high - low) or 1.0
    return lambda value: float(start + (value - low) / width * (end - start))


def _path(points, name):
    if not points:
        return Markup("")
    return Markup('<path class="{}" d="M{}"/>').format(name, "L".join(f"{x:.1f} {y:.1f}" for x, y in points))


def _text(x, y, text, anchor):
    return Markup('<text x="{:.0f}" y="{:.0f}" text-anchor="{}">{}</text>').format(x, y, anchor, text)


def _axis(low, high, y):
    step = 10.0 ** math.floor(math.log10((high - low) / 2)) if high > low else 1.0
    step *= next(it for it in (1, 2, 5, 10) if (high - low) / (step * it) <= 4.5)
    first = math.ceil(low / step)
    decimals = max(0, -math.floor(math.log10(step)))
    marks = [it * step for it in range(first, math.floor(high / step) + 1)]
    return Markup("").join(
        _path([(_LEFT, y(it)), (_RIGHT, y(it))], "") + _text(_LEFT - 8, y(it) + 5, f"{it:.{decimals}f}", "end") for it in marks
    )


def _time_axis(moments, at, x, dated):
    if not dated:
        ends = [(0, "start"), (len(moments) - 1, "end")]
        return Markup("").join(_text(x(at[it]), _BOTTOM + 30, str(moments[it]), anchor) for it, anchor in ends)
    style = "%Y-%m-%d" if at[-1] - at[0] > 3 * 86400 else "%m-%d %H:%M"
    marks = []
    for anchor, share in (("start", 0.0), ("middle", 0.5), ("end", 1.0)):
        time = datetime.datetime.fromtimestamp(at[0] + share * (at[-1] - at[0]), datetime.timezone.utc)
        marks.append(_text(x(time.timestamp()), _BOTTOM + 30, time.strftime(style), anchor))
    return Markup("").join(marks)
