"""The tick compared with the command's, bit for bit."""

import copy
import pickle
import threading
import time
from datetime import datetime, timedelta, timezone
from zoneinfo import ZoneInfo

import numpy as np
import pandas
import pytest

import vsj


@pytest.fixture(scope="module")
def hysteretic(tmp_path_factory, diagnosis):
    file = tmp_path_factory.mktemp("plant") / "plant.toml"
    file.write_text(diagnosis.plant)
    return file


CASES = [
    (dict(controller="paper"), []),
    (dict(controller="none"), []),
    (dict(controller="fast", limit_v=1000), ["--limit-v", 1000]),
    (dict(controller="robust", limit_v=1000), ["--limit-v", 1000]),
    (
        dict(controller="robust", known={"tau": 7, "gain": 1.5}, overshoot_percent=3),
        ["--known", "tau=7", "--known", "gain=1.5", "--overshoot-percent", 3],
    ),
    (
        dict(controller="robust", known={"tau": 7}, fall_back_percent=25, limit_v=1000),
        ["--known", "tau=7", "--fall-back-percent", 25, "--limit-v", 1000],
    ),
    (dict(controller="paper", rate_hz=500, slew_v_per_s=2000.0, dac_bits=16), ["--rate-hz", 500, "--slew-v-per-s", 2000, "--dac-bits", 16]),
]


@pytest.mark.parametrize("options, words", CASES)
@pytest.mark.parametrize("extended", [False, True])
def test_codes_are_those_of_the_command(command, tmp_path, hysteretic, options, words, extended):
    plant = hysteretic if extended else "paper"
    words = ["--controller", options["controller"], *words, "--plant", plant]
    command("stair", "--input", "step", "--out", tmp_path, *words)
    expected = pandas.read_csv(tmp_path / "stair.csv", comment="#")
    controller = vsj.Controller(plant, **options)
    run = controller.run(expected["target_v"].to_numpy())
    assert run.code.dtype == np.uint16 and len(np.unique(run.code)) > 4
    np.testing.assert_array_equal(run.code, expected["dac_code"])
    np.testing.assert_array_equal(np.round(run.applied_v, 6), expected["applied_v"])
    np.testing.assert_array_equal(np.round(run.stiffness_v, 6), expected["stiffness"])
    controller.reset()
    parts = [controller.run(part).code for part in np.array_split(run.target_v, 7)]
    np.testing.assert_array_equal(np.concatenate(parts), run.code)


def test_limits_name_what_acted():
    run = vsj.Controller(limit_v=400).run(np.r_[np.full(10, 300.0), np.full(10, 500.0), np.full(10, 0.0)])
    assert run.limits[0] & vsj.Limit.UPPER and not run.limits[0] & vsj.Limit.TARGET
    assert run.limits[15] & vsj.Limit.TARGET and run.limits[25] & vsj.Limit.LOWER
    frame = run.to_frame()
    assert list(frame) == ["time_s", "target_v", "code", "applied_v", "stiffness_v", "limits"]


def test_readings_correct_the_estimate():
    sensor = vsj.Feedback(noise_v=1.0, fastest_s=0.1)
    targets = np.full(20_000, 300.0)
    without = vsj.Controller(feedback=sensor).run(targets, np.full(20_000, np.nan))
    plain = vsj.Controller().run(targets)
    np.testing.assert_array_equal(without.code, plain.code)
    # Each reading is 20 V above the model's stiffness after the tick before.
    readings = np.r_[np.nan, plain.stiffness_v[:-1]] + 20.0
    with_sensor = vsj.Controller(feedback=sensor).run(targets, readings)
    assert with_sensor.applied_v[-1] < plain.applied_v[-1] - 5.0


def test_simulate_is_the_spring_of_the_controller():
    volts = np.repeat([0.0, 300.0, 600.0, 100.0], 500)
    run = vsj.Controller(controller="none", dac_bits=16).run(volts)
    stiffness = vsj.simulate("paper", run.time_s, run.applied_v)
    np.testing.assert_allclose(stiffness, run.stiffness_v, atol=1e-6)


def test_other_threads_run_during_ticks():
    controller, targets = vsj.Controller(), np.full(5_000_000, 300.0)
    turns, thread = 0, threading.Thread(target=controller.run, args=(targets,))
    thread.start()
    while thread.is_alive():
        turns += 1
        time.sleep(0.001)
    assert turns > 20


def test_settings_and_inputs_out_of_range_are_bad_input(command):
    for options, words in (
        (dict(limit_v=20000), ["--limit-v", 20000]),
        (dict(rate_hz=1), ["--rate-hz", 1]),
        (dict(kp=-1), ["--kp", -1]),
        (dict(dac_bits=40), ["--dac-bits", 40]),
        (dict(approach_s=0.1), ["--approach-s", 0.1]),
        (dict(known={"tau": 5}), ["--controller", "paper", "--known", "tau=5"]),
        (dict(controller="robust", known={"tau": 30}), ["--known", "tau=30"]),
        (dict(controller="robust", overshoot_percent=21), ["--known", "tau=5", "--overshoot-percent", 21]),
        (dict(plant="no.toml"), ["--plant", "no.toml"]),
    ):
        with pytest.raises(vsj.BadInput) as error:
            vsj.Controller(**options)
        assert str(error.value) == command.error("stair", *words)
    for call in (
        lambda: vsj.Controller("paper", "slow"),
        lambda: vsj.Controller("paper", "robust", known={"mass": 5}),
        lambda: vsj.Controller().run([1.0, np.nan]),
        lambda: vsj.Controller().run([1.0], [1.0]),
        lambda: vsj.Controller(feedback=vsj.Feedback()).run([1.0, 2.0], [1.0]),
        lambda: vsj.Controller().run(np.zeros((2, 2))),
        lambda: vsj.simulate("paper", [0.0, 1.0], [0.0]),
        lambda: vsj.simulate("paper", [1.0, 0.0], [0.0, 0.0]),
    ):
        with pytest.raises(vsj.BadInput):
            call()
    controller = vsj.Controller()
    with pytest.raises(vsj.BadInput, match=r"targets\[1\]"):
        controller.run([500.0, np.nan])
    np.testing.assert_array_equal(controller.run([300.0]).code, vsj.Controller().run([300.0]).code)


def test_a_plant_is_taken_from_an_answer(hysteretic, diagnosis):
    targets = np.repeat([200.0, 400.0, 100.0], 300)
    codes = [vsj.Controller(plant).run(targets).code for plant in (hysteretic, diagnosis)]
    np.testing.assert_array_equal(*codes)
    assert np.any(codes[0] != vsj.Controller().run(targets).code)


def test_times_of_a_simulation_may_be_stamps_and_durations():
    expected = vsj.simulate("paper", [0.0, 1.0, 2.5], [0.0, 300.0, 300.0])
    stamps = np.array(["2026-01-31T00:00:05", "2026-01-31T00:00:06", "2026-01-31T00:00:07.5"], "M8[ms]")
    for times in (stamps, stamps - stamps[0], pandas.DatetimeIndex(stamps), pandas.Series(stamps).astype("M8[ns]")):
        np.testing.assert_array_equal(vsj.simulate("paper", times, [0.0, 300.0, 300.0]), expected)
    naive = stamps.astype("M8[us]").tolist()
    in_zones = [naive[0].replace(tzinfo=timezone(timedelta(hours=1))), *(it.replace(tzinfo=timezone.utc) - timedelta(hours=1) for it in naive[1:])]
    for times in (naive, in_zones, [pandas.Timestamp(it) for it in naive], [it - naive[0] for it in naive]):
        np.testing.assert_array_equal(vsj.simulate("paper", times, [0.0, 300.0, 300.0]), expected)
    expected = vsj.simulate("paper", [0.0, 1.0, 2.5], [200.0, 300.0, 300.0])
    # The clock goes forward at 2 o'clock.
    berlin = ZoneInfo("Europe/Berlin")
    in_spring = [datetime(2026, 3, 29, *clock, tzinfo=berlin) for clock in ((1, 59, 59), (3, 0, 0), (3, 0, 1, 500_000))]
    # From the longest that is a number of ns on.
    late = [timedelta(seconds=9_223_372_036 + seconds) for seconds in (0, 1, 2.5)]
    for times in (in_spring, [pandas.Timestamp(it) for it in in_spring], late):
        np.testing.assert_array_equal(vsj.simulate("paper", times, [200.0, 300.0, 300.0]), expected)
    with pytest.raises(vsj.BadInput, match="^time: .*; expected numbers$"):
        vsj.simulate("paper", [timedelta.min, timedelta.max], [0.0, 300.0])
    with pytest.raises(vsj.BadInput, match="^time: .*; expected time stamps, all with a zone or all without$"):
        vsj.simulate("paper", [naive[0], in_zones[1]], [0.0, 300.0])


def test_a_copy_has_the_state_and_a_pickle_is_refused(hysteretic):
    sensor = dict(feedback=vsj.Feedback(), controller="robust")
    for original in (vsj.Controller(), vsj.Controller(hysteretic, **sensor)):
        targets = np.repeat([200.0, 400.0], 300)
        original.run(targets)
        copies = [copy.copy(original), copy.deepcopy(original)]
        expected = original.run(targets)
        for it in copies:
            assert it.range_v == original.range_v and it.run(targets[:100]).time_s[-1] == expected.time_s[99]
        for it in copies:
            np.testing.assert_array_equal(it.run(targets[100:]).code, expected.code[100:])
        with pytest.raises(TypeError, match="expected its arguments, from which each process makes its own"):
            pickle.dumps(original)


def test_what_a_mask_hides_is_missing():
    hidden = lambda values: np.ma.array(values, mask=[False, True, False])
    for call in (
        lambda: vsj.simulate("paper", [0.0, 1.0, 2.0], hidden([0.0, 300.0, 300.0])),
        lambda: vsj.simulate("paper", hidden([0.0, 1.0, 2.0]), [0.0, 300.0, 300.0]),
        lambda: vsj.Controller().run(hidden([0, 300, 300])),
    ):
        with pytest.raises(vsj.BadInput, match="NaN"):
            call()
    sensor = vsj.Controller(feedback=vsj.Feedback())
    run = sensor.run([100.0] * 3, hidden([0.0, 900.0, 9.0]))
    sensor.reset()
    np.testing.assert_array_equal(run.stiffness_v, sensor.run([100.0] * 3, [0.0, np.nan, 9.0]).stiffness_v)


def test_a_computation_that_would_not_end_is_refused():
    for times in ([0.0, 1e9], [0.0, np.inf], [np.nan, np.nan], [0.0, 1e9, 1.0]):
        with pytest.raises(vsj.BadInput, match="time_s"):
            vsj.simulate("paper", times, np.zeros(len(times)))
    with pytest.raises(vsj.BadInput, match="targets: 10000001 values; expected at most 10000000 ticks in a run"):
        vsj.Controller().run(np.zeros(10_000_001))


@pytest.mark.parametrize(
    "call, expected",
    [
        (lambda: vsj.Controller(controller="fast", kp=9), "--kp and --ki apply to the paper controller only"),
        (lambda: vsj.Controller(controller="none", ki=9), "--kp and --ki apply to the paper controller only"),
        (lambda: vsj.Controller(overshoot_percent=1), "overshoot_percent applies to the robust controller only"),
        (lambda: vsj.Controller(dac_bits=12.5), "dac_bits: 12.5; expected a whole number"),
        (lambda: vsj.Controller(dac_bits="many"), "dac_bits: 'many'; expected a number"),
        (lambda: vsj.Controller(controller=3), "controller: 3; expected a text"),
        (lambda: vsj.Controller(limit_v="high"), "limit_v: 'high'; expected a number"),
        (lambda: vsj.Controller(feedback={}), "feedback: dict; expected vsj.Feedback"),
        (lambda: vsj.Controller(controller="robust", overshoot_percent="2 %"), "overshoot_percent: '2 %'; expected a number"),
        (lambda: vsj.Controller(controller="robust", known={"tau": "5 %"}), r"known\['tau'\]: '5 %'; expected a number"),
        (lambda: vsj.Controller(controller="robust", known=[5]), "known: list; expected a mapping"),
        (lambda: vsj.Controller(None), "plant: NoneType; expected paper, a plant file, or an answer"),
        (lambda: vsj.Controller(vsj.Spring()), "plant: Spring; expected paper"),
        (lambda: vsj.Controller().run(["a"]), "targets: values of the type <U1; expected numbers"),
        (lambda: vsj.Controller().run(np.array(["2026-01-31"], "M8[s]")), "targets: values of the type datetime64"),
        (lambda: vsj.simulate("paper", [[0.0]], [0.0]), r"time: shape \(1, 1\); expected one dimension"),
    ],
)
def test_an_argument_of_another_kind_is_bad_input(call, expected):
    with pytest.raises(vsj.BadInput, match=expected):
        call()


def test_lowered_gains_are_said(tmp_path):
    plant = tmp_path / "quick.toml"
    plant.write_text("schema = 1\n[relaxation]\nshare = 0.1\ntau_s = 0.002\n")
    with pytest.warns(vsj.RecordWarning, match="--kp 2.0668: the largest for this spring at this rate, instead of 4"):
        vsj.Controller(plant)


def test_a_fall_back_without_effect_is_said():
    with pytest.warns(vsj.RecordWarning, match="a fall back by 20 % has no effect within these errors"):
        vsj.Controller(controller="robust", known={"tau": 5, "share": 5}, fall_back_percent=20)
