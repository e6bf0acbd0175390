"""Figures. matplotlib is imported when the first one is drawn."""

import numpy as np

from .records import bad_input


def courses(records, models, unit, axes=None):
    """Readings with models, and residuals below them. ``axes`` are two matplotlib Axes, or ``None`` for a new figure."""
    figure, (above, below) = _figure(axes, 2)
    multiple = len(records) > 1
    for name, course in records:
        label = f", {name}" if multiple else ""
        time = course["time_s"]
        above.plot(time, course["reading"], ".", markersize=2, color="0.6", label=f"reading{label}")
        for model in models:
            above.plot(time, course[model], linewidth=1, label=f"{model}{label}")
            below.plot(time, course["reading"] - course[model], linewidth=0.8, label=f"reading - {model}{label}")
    bracket = f" ({unit})" if unit else ""
    above.set_ylabel(f"reading{bracket}")
    below.set_ylabel(f"residual{bracket}")
    below.set_xlabel("time (s)")
    above.legend(fontsize="small", loc="upper left")
    below.legend(fontsize="small", loc="upper left")
    return figure


def schedule(course, axes=None):
    """A voltage that is held between its times."""
    figure, (axis,) = _figure(axes, 1)
    axis.step(course["time_s"], course["voltage_v"], where="post", linewidth=1)
    axis.set_xlabel("time (s)")
    axis.set_ylabel("voltage (V)")
    return figure


def run(ticks, axes=None):
    """Target and stiffness, and the applied voltage below them."""
    figure, (above, below) = _figure(axes, 2)
    above.step(ticks.time_s, ticks.target_v, where="post", linewidth=1, color="0.6", label="target")
    above.plot(ticks.time_s, ticks.stiffness_v, linewidth=1, label="stiffness")
    below.step(ticks.time_s, ticks.applied_v, where="post", linewidth=1, label="applied")
    above.set_ylabel("stiffness (V)")
    below.set_ylabel("voltage (V)")
    below.set_xlabel("time (s)")
    above.legend(fontsize="small", loc="upper left")
    return figure


def _figure(axes, rows):
    if axes is not None:
        axes = list(np.ravel(axes))
        if len(axes) != rows or not all(hasattr(it, "figure") for it in axes):
            raise bad_input(f"axes: {len(axes)}; expected {rows} matplotlib Axes, one above the other, or none")
        return axes[0].figure, axes
    from matplotlib import pyplot

    figure, axes = pyplot.subplots(rows, 1, sharex=True, squeeze=False, layout="constrained")
    return figure, axes[:, 0]
