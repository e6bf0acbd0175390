"""The estimator."""

import numpy as np
import pytest

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
