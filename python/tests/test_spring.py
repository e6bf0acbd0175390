"""The estimator."""

import pickle

import numpy as np
import pytest
from sklearn.base import clone
from sklearn.model_selection import GridSearchCV
from sklearn.pipeline import make_pipeline
from sklearn.preprocessing import FunctionTransformer
from sklearn.utils.estimator_checks import check_estimator
from sklearn.utils.validation import validate_data
from sysidentpy.basis_function import Polynomial
from sysidentpy.model_structure_selection import FROLS
from sysidentpy.parameter_estimation import LeastSquares

import vsj


@pytest.fixture(scope="module")
def record(sample):
    return np.column_stack([sample["time_s"], sample["voltage_v"]]), sample["stiffness"]


def test_causes_predict_what_the_linear_spring_does_not(record):
    X, y = record
    half = len(y) // 2
    linear = vsj.Spring().fit(X, y)
    full = vsj.Spring(extend="paper", effort="quick").fit(X[:half], y[:half])
    assert full.fitted_.findings[0].cause == "hysteresis"
    # Noise of 1 V over the whole record, half of which it has not seen.
    error_v = lambda spring: np.sqrt(np.mean((y - spring.predict(X)) ** 2))
    assert error_v(full) < 1.1 < error_v(linear)
    for spring in (linear, full):
        assert spring.score(X, y) == pytest.approx(1 - error_v(spring) ** 2 / np.var(y), rel=1e-12)
    assert full.predict(X).shape == y.shape


def test_a_prediction_is_the_simulation_of_the_report(record):
    X, y = record
    spring = vsj.Spring().fit(X, y)
    [(_, course)] = spring.fitted_.courses
    away = spring.predict(X) - course["model"]
    # The report's model does not begin at rest.
    assert np.abs(away[len(away) // 2 :]).max() < 1e-3 * np.ptp(y)


def test_parameters_are_set_by_name():
    spring = vsj.Spring().set_params(extend="paper", effort="thorough")
    assert spring.get_params() == {"extend": "paper", "effort": "thorough", "input": "hold"}
    assert type(spring)(**spring.get_params()).get_params() == spring.get_params()
    assert repr(spring) == "Spring(extend='paper', effort='thorough', input='hold')"
    with pytest.raises(ValueError, match="expected extend, effort, input"):
        spring.set_params(depth=3)


def test_bad_input_is_refused(record):
    X, y = record
    with pytest.raises(AttributeError, match="call fit first"):
        vsj.Spring().predict(X)
    spring = vsj.Spring().fit(X, y)
    for wrong in (X[:, :1], X[::-1], np.full((3, 2), np.nan)):
        with pytest.raises(vsj.BadInput):
            spring.predict(wrong)
    with pytest.raises(vsj.BadInput):
        vsj.Spring(input="spline").fit(X, y)
    with pytest.raises(vsj.BadInput):
        spring.fit(X, y[:-1])


class OnAnyX(vsj.Spring):
    """A Spring for the matrices of scikit-learn's checks, which are no records: each row is 0.2 s, the first column the voltage."""

    def fit(self, X, y):
        X = validate_data(self, X, ensure_min_samples=2)
        super().fit(self.record(X), y)
        self.n_features_in_ = X.shape[1]
        return self

    def predict(self, X):
        if not self.__sklearn_is_fitted__():
            return super().predict(X)
        return super().predict(self.record(validate_data(self, X, reset=False)))

    @staticmethod
    def record(X):
        return np.column_stack([0.2 * np.arange(len(X)), X[:, 0]])


@pytest.mark.filterwarnings("ignore")
def test_the_checks_of_scikit_learn_pass():
    beyond = {
        "check_regressors_train": "expects that a static linear regression explains the readings",
        "check_supervised_y_2d": "expects that a column of readings is flattened with a warning; here it is refused",
    }
    results = check_estimator(OnAnyX(), expected_failed_checks=beyond)
    passed = [it["check_name"] for it in results if it["status"] == "passed"]
    assert len(passed) > 40 and "check_estimators_pickle" in passed and "check_fit_idempotent" in passed


def test_it_stands_in_a_pipeline_and_in_a_search(record):
    X, y = record
    spring = make_pipeline(FunctionTransformer(lambda X: X * [1e-3, 1.0]), vsj.Spring())
    assert clone(spring).fit(X * [1e3, 1.0], y).score(X * [1e3, 1.0], y) == pytest.approx(vsj.Spring().fit(X, y).score(X, y), abs=1e-6)
    half = len(y) // 2
    first, all_rows = np.arange(half), np.arange(len(y))
    search = GridSearchCV(vsj.Spring(effort="quick"), {"extend": [None, "paper"]}, cv=[(first, all_rows)], refit=False)
    assert search.fit(X, y).best_params_ == {"extend": "paper"}
    fitted = vsj.Spring().fit(X, y)
    np.testing.assert_array_equal(pickle.loads(pickle.dumps(fitted)).predict(X), fitted.predict(X))


@pytest.mark.filterwarnings("ignore::UserWarning")
def test_beside_sysidentpy_on_the_same_record(record):
    X, y = record
    half, voltage, readings = len(y) // 2, X[:, 1:], y.reshape(-1, 1)
    narx = FROLS(order_selection=True, n_info_values=6, ylag=2, xlag=2, basis_function=Polynomial(degree=2), estimator=LeastSquares())
    narx.fit(X=voltage[:half], y=readings[:half])
    # Free run over the part that neither has seen, from the last readings before it.
    free = narx.predict(X=voltage[half - narx.max_lag :], y=readings[half - narx.max_lag : half])[narx.max_lag :, 0]
    rms = lambda error: np.sqrt(np.mean(error**2))
    spring = vsj.Spring(extend="paper", effort="quick").fit(X[:half], y[:half])
    assert rms(y[half:] - spring.predict(X)[half:]) < rms(y[half:] - free)


def test_the_score_of_equal_readings_is_that_of_scikit_learn(record):
    X, y = record
    spring = vsj.Spring().fit(X, y)
    assert spring.score(X[:3], np.full(3, 1e9)) == 0.0
    with pytest.raises(vsj.BadInput, match="y: no reading"):
        spring.score(X[:3], np.full(3, np.nan))
    assert spring.score(X, np.ma.array(np.where(y > 400, 1e6, y), mask=y > 400)) == spring.score(X, np.where(y > 400, np.nan, y))
