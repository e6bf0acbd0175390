"""An estimator with the interface of scikit-learn's, which it does not need."""

import inspect
import sys

import numpy as np
from numpy.typing import ArrayLike

from . import _vsj
from .analysis import Plant, diagnose, identify
from .control import vector
from .records import unmasked


class Spring:
    """A spring that is fitted to readings, and predicts others.

    ``X`` is an array of shape ``(n, 2)``: increasing times in s, and commanded voltages in V. ``y`` is an array of shape ``(n,)``:
    readings in any unit, NaN where there is none. Before the first row the spring is at rest at 0 V.

    Parameters
    ----------
    extend : str, path or answer, optional
        The simulation that a diagnosis extends by what it finds, hysteresis, a nonlinear law and others: ``"paper"``,
        ``"identify"`` for the linear spring, or a plant file. Default: none, the linear spring itself.
    effort : {"quick", "normal", "thorough"}
        How long causes are searched for.
    input : {"hold", "linear"}
        The voltage between the rows.

    Attributes
    ----------
    fitted_ : Identified or Diagnosis
        The linear spring, or with ``extend`` the diagnosis, after :meth:`fit`.
    """

    _estimator_type = "regressor"

    def __init__(self, extend: Plant = None, effort: str = "normal", input: str = "hold") -> None:
        self.extend = extend
        self.effort = effort
        self.input = input

    def fit(self, X: ArrayLike, y: ArrayLike) -> "Spring":
        """Fit the spring to readings; returns ``self``."""
        if y is None:
            raise _vsj.BadInput("Spring requires y to be passed, but the target y is None; expected an array of shape (n,)")
        time, voltage = _columns(X)
        record = (time, voltage, vector(y, "y"))
        if self.extend is None:
            self.fitted_ = identify(record, input=self.input)
        else:
            self.fitted_ = diagnose(record, plant=self.extend, effort=self.effort, input=self.input)
        self.n_features_in_ = 2
        return self

    def predict(self, X: ArrayLike) -> np.ndarray:
        """Predict the readings, an array of shape ``(n,)`` in the unit of those that were fitted."""
        if not self.__sklearn_is_fitted__():
            raise _not_fitted()("this Spring is not fitted; call fit first")
        time, voltage = _columns(X)
        return _vsj.predict(("Spring", self.plant), time, voltage, self.input)

    def score(self, X: ArrayLike, y: ArrayLike) -> float:
        """The coefficient of determination of the prediction: 1 is perfect, 0 is no better than the mean of ``y``."""
        y = vector(y, "y")
        there = ~np.isnan(y)
        if not there.any():
            raise _vsj.BadInput("y: no reading; expected one or more")
        error = (y - self.predict(X))[there]
        spread, left = float(np.sum((y[there] - y[there].mean()) ** 2)), float(error @ error)
        # As scikit-learn does for readings that are all equal.
        return 1.0 - left / spread if spread > 0.0 else float(left == 0.0)

    def get_params(self, deep=True):
        """The parameters by name."""
        return {name: getattr(self, name) for name in inspect.signature(type(self)).parameters}

    def set_params(self, **params):
        """Set parameters by name; returns ``self``."""
        known = self.get_params()
        for name, value in params.items():
            if name not in known:
                raise ValueError(f"no parameter {name}; expected {', '.join(known)}")
            setattr(self, name, value)
        return self

    @property
    def plant(self) -> str:
        """Text of the plant file of the fitted spring."""
        return self.fitted_.plant

    def __sklearn_is_fitted__(self):
        return hasattr(self, "fitted_")

    def __sklearn_tags__(self):
        # scikit-learn asks for it, so it is there.
        from sklearn.utils import InputTags, RegressorTags, Tags, TargetTags

        return Tags("regressor", TargetTags(required=True), regressor_tags=RegressorTags(), input_tags=InputTags())

    def __repr__(self):
        return f"Spring({', '.join(f'{name}={value!r}' for name, value in self.get_params().items())})"


def _not_fitted():
    """The exception of scikit-learn where that is loaded; it is an AttributeError too."""
    return getattr(sys.modules.get("sklearn.exceptions"), "NotFittedError", AttributeError)


def _columns(X):
    if hasattr(X, "toarray"):
        raise _vsj.BadInput("X: sparse data is not supported; expected a dense array, such as X.toarray()")
    array = unmasked(X)
    if np.iscomplexobj(array):
        raise _vsj.BadInput("X: Complex data not supported; expected real numbers")
    array = array.astype(np.float64)
    if array.ndim != 2 or array.shape[1] != 2:
        raise _vsj.BadInput(f"X: shape {array.shape}; expected (n, 2) with time in s and voltage in V")
    return np.ascontiguousarray(array[:, 0]), np.ascontiguousarray(array[:, 1])
