"""Identification of the spring with PySINDy and SysIdentPy, for comparison with `vsj diagnose` in `cargo campaign rivals`.

    identification.py FOLDER [--any-unit]

Each CSV of the folder (time_s, voltage_v, stiffness; even rows) is split: the first 60 % for identification, the last 40 % for
a free run from the state at the split and the voltages alone. Prints one JSON object: for each file and tool the root mean
square error of the free run, the CPU time, and the best settings.

Both tools get what a competent user would provide: several libraries and lags are tried on the first three quarters of the
identification part; the settings with the smallest free-run error on its last quarter are identified again on all of it.

With `--any-unit` (`cargo campaign real`) nothing is known of the plant: voltages and readings are scaled to mean 0 and deviation
1 over the identification part, and no part of the response is taken as immediate.

PySINDy identifies dw/dt = f(w, u), polynomials up to degree 3, by thresholded least squares. It is given the paper's split of
the response, w = (y - u/11) 11/10, because y itself jumps with the voltage and has no derivative. Derivatives tried: the
difference to the next row, exact for a held voltage (the free run then uses the same differences), and Savitzky-Golay filters
of several windows (the free run then uses Runge-Kutta). Voltages are in units of 500 V, columns normalised.

SysIdentPy identifies a polynomial NARX model by forward regression (FROLS) with BIC, by least squares and by extended least
squares against the bias of noisy lags of y. Its input is shifted by one row, because its lags begin at 1 and the spring
responds in the same row.
"""

import contextlib
import csv
import io
import json
import math
import sys
import time
import warnings
from pathlib import Path

import numpy as np
import pysindy as ps
from sysidentpy.basis_function import Polynomial
from sysidentpy.model_structure_selection import FROLS
from sysidentpy.parameter_estimation import LeastSquares

PAPER_SHARE = 1 / 11
FULL_V = 500.0
LEARN = 0.6
TRY = 0.75  # of the identification part
LARGEST = 1e3  # in scaled units: a free run beyond has diverged


def read(path):
    with path.open() as file:
        rows = list(csv.DictReader(line for line in file if not line.startswith("#")))
    return (np.array([float(row[name]) for row in rows]) for name in ("time_s", "voltage_v", "stiffness"))


def rmse(error):
    value = math.sqrt(float(np.mean(np.square(error)))) if np.all(np.isfinite(error)) else math.inf
    return value if value < LARGEST else math.inf


class Sindy:
    """dw/dt = f(w, u)."""

    SETTINGS = [
        {"degree": degree, "threshold": threshold, "window": window}
        for degree in (1, 2, 3)
        for threshold in (0.0, 0.01, 0.05)
        for window in (0, 11, 41)
    ]

    share = PAPER_SHARE

    def __init__(self, degree, threshold, window):
        self.degree, self.threshold, self.window = degree, threshold, window

    def fit(self, t, u, y):
        self.step = float(np.mean(np.diff(t)))
        w = (y - self.share * u) / (1 - self.share)
        optimizer = ps.STLSQ(threshold=self.threshold, alpha=1e-6, normalize_columns=True)
        library = ps.PolynomialLibrary(degree=self.degree)
        if self.window == 0:
            model = ps.SINDy(optimizer=optimizer, feature_library=library)
            model.fit(w[:-1, None], t=self.step, x_dot=np.diff(w)[:, None] / self.step, u=u[:-1, None])
        else:
            derivative = ps.SmoothedFiniteDifference(smoother_kws={"window_length": self.window, "polyorder": 2})
            model = ps.SINDy(optimizer=optimizer, feature_library=library, differentiation_method=derivative)
            model.fit(w[:, None], t=self.step, u=u[:, None])
        self.terms = [
            (float(c), int(i), int(j)) for c, (i, j) in zip(model.coefficients()[0], library.powers_) if c != 0
        ]
        # Start of the free run: a line through the last rows, extrapolated by one row.
        last = 11
        self.start = float(np.polyval(np.polyfit(np.arange(last), w[-last:], 1), last))
        return self

    def run(self, u):
        """Free run with the voltage of every row held."""

        def rate(w, volts):
            return sum(c * w**i * volts**j for c, i, j in self.terms)

        y, w, h = np.full(len(u), np.inf), self.start, self.step
        for k, volts in enumerate(u):
            if not abs(w) < LARGEST:
                break
            y[k] = self.share * volts + (1 - self.share) * w
            k1 = rate(w, volts)
            if self.window == 0:
                w += h * k1
                continue
            k2 = rate(w + h / 2 * k1, volts)
            k3 = rate(w + h / 2 * k2, volts)
            k4 = rate(w + h * k3, volts)
            w += h / 6 * (k1 + 2 * k2 + 2 * k3 + k4)
        return y


class Narx:
    """y_k = f(y_(k-1), ..., u_k, u_(k-1), ...)."""

    SETTINGS = [
        {"degree": degree, "lags": lags, "unbiased": unbiased}
        for degree, lags in ((1, 2), (1, 4), (1, 10), (1, 20), (2, 1), (2, 2), (2, 4), (3, 1), (3, 2))
        for unbiased in (False, True)
    ]

    def __init__(self, degree, lags, unbiased):
        self.degree, self.lags, self.unbiased = degree, lags, unbiased

    def fit(self, t, u, y):
        self.model = FROLS(
            ylag=self.lags,
            xlag=self.lags + 1,
            order_selection=True,
            info_criteria="bic",
            n_info_values=20,
            estimator=LeastSquares(unbiased=self.unbiased),
            basis_function=Polynomial(degree=self.degree),
            model_type="NARMAX",
        )
        self.model.fit(X=np.append(u[1:], u[-1])[:, None], y=y[:, None])
        self.past = u, y
        return self

    def run(self, u):
        keep = self.lags + 1
        past_u, past_y = self.past
        volts = np.concatenate([past_u[-keep:], u])
        ahead = np.append(volts[1:], volts[-1])[:, None]
        lag = self.model.max_lag
        start = past_y[len(past_y) - keep : len(past_y) - keep + lag, None]
        return self.model.predict(X=ahead, y=start)[keep:, 0]


def learn(tool, t, u, y):
    """Free-run error, in scaled units, of the best settings, and these settings."""
    split = int(LEARN * len(y))
    tried = int(TRY * split)
    errors = []
    for settings in tool.SETTINGS:
        try:
            found = tool(**settings).fit(t[:tried], u[:tried], y[:tried]).run(u[tried:split])
            errors.append(rmse(found - y[tried:split]))
        except (ValueError, FloatingPointError, np.linalg.LinAlgError, IndexError):
            errors.append(math.inf)
    best = tool.SETTINGS[int(np.argmin(errors))]
    return rmse(tool(**best).fit(t[:split], u[:split], y[:split]).run(u[split:]) - y[split:]), best


def scales(values):
    """Mean and deviation over the identification part; 0 and 1 for a constant."""
    learnt = values[: int(LEARN * len(values))]
    return float(np.mean(learnt)), float(np.std(learnt)) or 1.0


def main():
    any_unit = "--any-unit" in sys.argv
    if any_unit:
        Sindy.share = 0.0
    warnings.simplefilter("ignore")
    np.seterr(all="ignore")
    answers = {}
    for path in sorted(Path(sys.argv[1]).glob("*.csv")):
        t, u, y = read(path)
        (u0, us), (y0, ys) = (scales(u), scales(y)) if any_unit else ((0.0, FULL_V), (0.0, FULL_V))
        answers[path.stem] = {}
        for name, tool in (("pysindy", Sindy), ("sysidentpy", Narx)):
            start = time.process_time()
            # Both tools print progress to stdout.
            with contextlib.redirect_stdout(io.StringIO()):
                error, settings = learn(tool, t, (u - u0) / us, (y - y0) / ys)
            answer = {"rmse": ys * error if math.isfinite(error) else None, "settings": settings}
            answers[path.stem][name] = answer | {"seconds": time.process_time() - start}
        print(path.stem, answers[path.stem], file=sys.stderr)
    print(json.dumps(answers))


if __name__ == "__main__":
    main()
