"""Identification, diagnosis and plan compared with the command's JSON."""

import json
import re
import threading
import time
from dataclasses import is_dataclass, replace

import numpy as np
import pandas
import polars
import pyarrow.parquet
import pytest
from matplotlib import pyplot

import vsj
from conftest import SAMPLE
from vsj.answers import RecordReport


def without_names(answer):
    """The JSON of an answer without the names of its records."""
    answer = json.loads(answer)
    for start in answer.get("start", []):
        start.pop("record")
    return answer


def every_field_is_there(value, parsed, path="answer"):
    """Fails for a field of the JSON that the data classes do not have or have with another value."""
    if is_dataclass(value):
        names = {"with": "with_"}
        for name, inner in parsed.items():
            every_field_is_there(getattr(value, names.get(name, name)), inner, f"{path}.{name}")
    elif isinstance(value, dict):
        assert value.keys() == parsed.keys(), path
        for name, inner in parsed.items():
            every_field_is_there(value[name], inner, f"{path}.{name}")
    elif isinstance(value, list):
        assert len(value) == len(parsed), path
        for index, inner in enumerate(parsed):
            every_field_is_there(value[index], inner, f"{path}[{index}]")
    else:
        assert value == parsed, path


def test_identify_equals_the_command(command):
    found = vsj.identify(SAMPLE)
    assert json.loads(found.to_json()) == json.loads(command("identify", SAMPLE, "--json"))
    every_field_is_there(found, json.loads(found.to_json()))


def test_identify_with_an_order_equals_the_command(command):
    for order in (1, 2, np.int64(3)):
        found = vsj.identify(SAMPLE, order=order)
        assert found.order == order
        assert json.loads(found.to_json()) == json.loads(command("identify", SAMPLE, "--order", str(order), "--json"))


def test_an_order_that_cannot_be_fitted_is_an_error():
    for order, expected in ((-1, "1 or more"), (0, "1 to 4"), (5, "1 to 4"), (2**40, "1 to 4")):
        with pytest.raises(vsj.BadInput, match=f"order {order}: expected {expected}"):
            vsj.identify(SAMPLE, order=order)
    few = np.column_stack([np.arange(20.0), np.repeat([0.0, 100.0], 10), np.linspace(0.0, 50.0, 20)])
    with pytest.raises(vsj.BadInput, match="order 3: expected 1; a model of order 2 is not tried with fewer than 27 readings"):
        vsj.identify(few, order=3)
    with pytest.raises(TypeError):
        vsj.identify(SAMPLE, order=1.5)


def test_diagnose_equals_the_command(command, diagnosis):
    expected = json.loads(command("diagnose", SAMPLE, "--effort", "quick", "--json"))
    assert json.loads(diagnosis.to_json()) == expected
    every_field_is_there(diagnosis, expected)
    assert diagnosis.findings[0].cause == "hysteresis"


def test_plan_equals_the_command(command, diagnosis, tmp_path):
    file = tmp_path / "diagnosis.json"
    file.write_text(diagnosis.to_json())
    expected = json.loads(command("plan", file, "--minutes", 2, "--json"))
    plan = vsj.plan(diagnosis, minutes=2)
    assert json.loads(plan.to_json()) == expected
    every_field_is_there(plan, expected)
    assert plan.plot().axes[0].lines and plan.plot(pyplot.subplots(squeeze=False)[1]).axes[0].lines
    command("plan", file, "--minutes", 2, "--out", tmp_path / "plan")
    schedule = pandas.read_csv(tmp_path / "plan/schedule.csv", comment="#")
    np.testing.assert_allclose(plan.to_frame()[["time_s", "voltage_v"]], schedule[["time_s", "voltage_v"]], atol=1e-6)


def test_a_bound_that_the_record_does_not_show_is_infinite():
    """In JSON, which has no infinite number, it is null; an integral of the voltage has time constants that no record shows."""
    random = np.random.default_rng(0)
    voltage = np.repeat(random.choice([-1.0, 1.0], 80), 10)
    reading = 0.1 * np.cumsum(voltage) + random.normal(0, 0.2, 800)
    found = vsj.identify((np.arange(800.0), voltage, reading))
    assert [(tau.low, tau.high) for tau in found.nominal.tau_s] == [(0, np.inf)] * 2
    assert "[0, inf] s" in repr(found)
    assert json.loads(found.to_json())["nominal"]["tau_s"][0]["high"] is None
    assert any("integrates the voltage" in remark for remark in found.remarks)


def test_a_reading_that_no_spring_made_is_left_out():
    time = 0.05 * np.arange(1200)
    voltage = np.repeat([0.0, 1200.0, 400.0, 2100.0, 900.0, 0.0], 200)
    reading = 100 + 0.3 * voltage + np.random.default_rng(1).normal(0, 2, 1200)
    reading[700] = 0
    found = vsj.identify((time, voltage, reading))
    assert [(far.time_s, far.reading) for far in found.left_out] == [(35.0, 0.0)]
    assert found.rows == len(found.courses[0][1]["reading"]) == 1199


def test_the_index_of_a_frame_is_a_column(sample):
    expected = without_names(vsj.identify(SAMPLE).to_json())
    frame = pandas.DataFrame(sample)
    stamps = pandas.Timestamp("2026-01-31 23:59:30") + pandas.to_timedelta(frame["time_s"], unit="s")
    unnamed = frame[["voltage_v", "stiffness"]].set_index(pandas.DatetimeIndex(stamps.to_numpy()))
    assert without_names(vsj.identify(frame.set_index("time_s")).to_json()) == expected
    with pytest.warns(vsj.RecordWarning, match="counted from the first row"):
        assert without_names(vsj.identify(unnamed).to_json())["rows"] == expected["rows"]


def test_frames_and_arrays_have_the_answer_of_the_file(sample):
    expected = without_names(vsj.identify(SAMPLE).to_json())
    arrays = tuple(sample[name] for name in ("time_s", "voltage_v", "stiffness"))
    structured = np.rec.fromarrays(list(sample.values()), names=list(sample))
    for record in (
        pandas.DataFrame(sample),
        polars.DataFrame(sample),
        sample,
        arrays,
        np.column_stack(arrays),
        structured,
    ):
        assert without_names(vsj.identify(record).to_json()) == expected, type(record)


def test_units_and_names_mean_what_the_options_mean(command, sample, tmp_path):
    frame = pandas.DataFrame(
        {"t": 1e3 * sample["time_s"], "u": 1e-3 * sample["voltage_v"], "x": sample["stiffness"], "note": "a, b"}
    )
    frame.loc[[5, 9], "x"] = np.nan
    file = tmp_path / "record.csv"
    frame.to_csv(file, index=False)
    options = dict(time="t:ms", voltage="u:kV", reading="x:mm")
    words = [word for name, value in options.items() for word in (f"--{name}", value)]
    expected = without_names(command("identify", file, *words, "--json"))
    assert expected["unit"] == "mm" and expected["rows"] == len(frame) - 2
    with pytest.warns(vsj.RecordWarning, match="2 of .* rows without a reading"):
        assert without_names(vsj.identify(frame, **options).to_json()) == expected
    with pytest.warns(vsj.RecordWarning):
        assert without_names(vsj.identify(polars.DataFrame(frame.to_dict("list")).fill_nan(None), **options).to_json()) == expected
    arrays = tuple(frame[name].to_numpy() for name in ("t", "u", "x"))
    with pytest.warns(vsj.RecordWarning):
        assert without_names(vsj.identify(arrays, **options).to_json()) == expected


@pytest.mark.filterwarnings("ignore::vsj.RecordWarning")
def test_time_stamps_and_nanoseconds_are_times(sample):
    # Nanoseconds are rounded.
    expected = vsj.identify(SAMPLE).nominal.tau_s[0].value
    nanoseconds = np.round(1e9 * sample["time_s"]).astype(np.int64) + 1_769_900_000_000_000_000
    for time_column in (pandas.to_datetime(nanoseconds), nanoseconds, pandas.to_timedelta(sample["time_s"], unit="s")):
        frame = pandas.DataFrame(
            {"time": time_column, "voltage_v": sample["voltage_v"], "stiffness": sample["stiffness"]}
        )
        unit = "time:ns" if time_column is nanoseconds else "time"
        assert vsj.identify(frame, time=unit).nominal.tau_s[0].value == pytest.approx(expected, rel=1e-7)


def test_several_records_are_of_one_spring(command, sample):
    expected = json.loads(command("identify", SAMPLE, SAMPLE, "--json"))
    assert json.loads(vsj.identify([SAMPLE, SAMPLE]).to_json()) == expected
    found = vsj.diagnose([sample, sample], effort="quick")
    assert [name for name, _ in found.courses] == ["columns 1", "columns 2"]
    assert len(found.courses_frame()) == 2 * len(sample["time_s"]) and len(found.records) == 2


def test_a_prompt_shows_a_line_and_a_notebook_a_table(command, diagnosis):
    assert re.fullmatch(r"<vsj\.Diagnosis explained: hysteresis \((1\.000|0\.9\d\d)\); 2401 rows>", repr(diagnosis))
    said = command("diagnose", SAMPLE, "--effort", "quick")
    html = diagnosis._repr_html_()
    [probability, size] = re.search(r"^hysteresis +(\S+) +(width_v = .*)$", said, re.M).groups()
    assert f"<tr><td>hysteresis</td><td>{probability}</td><td>{size}</td></tr>" in html and "<b>explained</b>" in html
    [before, after] = re.search(r"held-out error decreases from (\S+) to (\S+) V", said).groups()
    assert f"Held-out error {before} without the causes, {after} with them." in html
    assert len(html) < 2000

    found = vsj.identify(SAMPLE)
    assert repr(found).startswith("<vsj.Identified gain ") and len(repr(found)) < 200
    value, unit, interval = re.search(r"^gain +(\S+) (\S+) +(\[.*?\])", command("identify", SAMPLE), re.M).groups()
    assert f"gain {value} {interval} {unit}, time constants" in repr(found)
    assert re.fullmatch(r"<vsj\.Plan 2 minutes.*>", repr(vsj.plan(diagnosis, minutes=2)))


def test_a_table_shows_what_is_open_and_no_name_gets_through(diagnosis):
    finding = replace(diagnosis.findings[0], cause="<b>")
    record = RecordReport("<i>.csv", 9, 0.0, 1.0, 1.0, "explained", [finding], None)
    open_ = dict(complete=False, alternatives=[[], ["drift", "hum"]], next_experiment="hold 300 V", leftover="Structure & more")
    html = replace(diagnosis, verdict="ambiguous", findings=[], records=[record], **open_)._repr_html_()
    for part in (
        "<b>ambiguous</b>",
        "&lt;b&gt; in &lt;i&gt;.csv only",
        "The search was stopped",
        "Alternatives: no error at all; drift with hum.",
        "To decide, hold 300 V.",
        "Structure &amp; more.",
    ):
        assert part in html
    nothing = replace(diagnosis, verdict="consistent", findings=[])
    assert repr(nothing) == "<vsj.Diagnosis consistent; 2401 rows>" and "<table" not in nothing._repr_html_()


def test_errors_have_the_text_of_the_command(command, sample, tmp_path):
    frame = pandas.DataFrame(sample)
    frame.loc[7, "voltage_v"] = np.inf
    file = tmp_path / "bad.csv"
    frame.to_csv(file, index=False)
    text = command.error("identify", file)
    with pytest.raises(vsj.BadInput) as error:
        vsj.identify(file)
    assert str(error.value) == text and isinstance(error.value, ValueError)
    with pytest.raises(vsj.BadInput) as error:
        vsj.identify(frame)
    assert str(error.value) == text.replace(str(file), "DataFrame")
    for options in ({"reading": "force"}, {"time": "time_s:parsec"}, {"columns": tmp_path / "no.toml"}):
        words = [str(word) for name, value in options.items() for word in (f"--{name}", value)]
        with pytest.raises(vsj.BadInput) as error:
            vsj.diagnose(SAMPLE, **options)
        assert str(error.value) == command.error("diagnose", SAMPLE, *words)
    with pytest.raises(vsj.BadInput) as error:
        vsj.diagnose(SAMPLE, plant=tmp_path / "no.toml")
    assert str(error.value) == command.error("diagnose", SAMPLE, "--plant", tmp_path / "no.toml")
    for call in (
        lambda: vsj.identify(tmp_path / "no.csv"),
        lambda: vsj.identify(np.zeros((4, 2))),
        lambda: vsj.identify((np.zeros(3), np.zeros(4), np.zeros(3))),
        lambda: vsj.identify([]),
        lambda: vsj.identify(SAMPLE, input="stair"),
        lambda: vsj.diagnose(SAMPLE, effort="much"),
        lambda: vsj.diagnose(SAMPLE, within=-1),
        lambda: vsj.plan(tmp_path / "no.json"),
        lambda: vsj.plan(SAMPLE),
    ):
        with pytest.raises(vsj.BadInput):
            call()


def test_a_diagnosis_of_the_identified_spring_is_that_of_the_command(command, tmp_path):
    expected = json.loads(command("diagnose", SAMPLE, "--plant", "identify", "--effort", "quick", "--json"))
    assert json.loads(vsj.diagnose(SAMPLE, plant="identify", effort="quick").to_json()) == expected
    command("identify", SAMPLE, "--out", tmp_path)
    expected = command("diagnose", SAMPLE, "--plant", tmp_path / "plant.toml", "--effort", "quick", "--json")
    found = vsj.diagnose(SAMPLE, plant=vsj.identify(SAMPLE), effort="quick")
    found, expected = json.loads(found.to_json()), json.loads(expected)
    for answer in (found, expected):
        answer["nominal"].pop("plant")
    assert found == expected


def test_courses_have_the_errors_of_the_report(diagnosis):
    [(_, course)] = diagnosis.courses
    for quality, residual in ((diagnosis.baseline, "baseline_residual"), (diagnosis.extended, "residual")):
        assert np.sqrt(np.mean(course[residual] ** 2)) == pytest.approx(quality.rmse, rel=1e-6)
    frame = diagnosis.to_frame()
    assert list(frame["cause"])[:1] == ["hysteresis"] and frame.loc[0, "low"] < frame.loc[0, "value"]


def test_other_threads_run_during_a_diagnosis():
    ticks, done = 0, threading.Event()

    def work():
        vsj.diagnose(SAMPLE, effort="quick")
        done.set()

    thread = threading.Thread(target=work)
    thread.start()
    while not done.is_set():
        ticks += 1
        time.sleep(0.001)
    thread.join()
    assert ticks > 10


def test_figures_are_drawn(diagnosis):
    found = vsj.identify(SAMPLE)
    for answer in (found, diagnosis, vsj.Controller().run(np.full(100, 200.0))):
        figure = answer.plot()
        assert figure.axes and figure.axes[0].lines
        _, axes = pyplot.subplots(2, 1, squeeze=False)
        assert answer.plot(axes) is axes[0, 0].figure and all(axis.lines for axis in axes.flat)
    assert set(found.to_frame()["quantity"]) >= {"gain", "zero", "share", "delay_s", "tau_s[0]", "weight[0]"}


def test_units_of_a_frame_are_those_of_the_command(command, sample, tmp_path):
    frame = pandas.DataFrame({"t": 1e3 * sample["time_s"], "u": 1e-3 * sample["voltage_v"], "x": sample["stiffness"]})
    frame.attrs["units"] = {"t": "ms", "u": "kV", "x": "mm"}
    file = tmp_path / "frame.parquet"
    frame.to_parquet(file)
    expected = json.loads(command("identify", file, "--json"))
    for data in (frame, pyarrow.parquet.read_table(file), pandas.read_parquet(file)):
        found = vsj.identify(data)
        assert without_names(found.to_json()) == {**expected, "start": without_names(json.dumps(expected))["start"]}
        assert found.unit == "mm"
    table = pyarrow.parquet.read_table(file)
    for keys in (("units", "PANDAS_ATTRS"), ("PANDAS_ATTRS", "units")):
        units = {"units": {"x": "um", "note": "V"}, "PANDAS_ATTRS": {"units": frame.attrs["units"]}}
        both = table.replace_schema_metadata({key: json.dumps(units[key]) for key in keys})
        pyarrow.parquet.write_table(both, file)
        assert json.loads(command("identify", file, "--json"))["unit"] == vsj.identify(both).unit == "mm", keys


def test_durations_are_in_s_whatever_the_name_says(sample):
    expected = vsj.identify((sample["time_s"], sample["voltage_v"], sample["stiffness"])).nominal.tau_s[0].value
    frame = pandas.DataFrame({"t_ms": pandas.to_timedelta(sample["time_s"], unit="s"), "u_V": sample["voltage_v"], "x_mm": sample["stiffness"]})
    assert vsj.identify(frame).nominal.tau_s[0].value == pytest.approx(expected, rel=1e-6)
    frame["t_ms"] = frame["t_ms"].to_numpy().astype("m8[s]") + np.timedelta64(10**10, "s")
    with pytest.raises(vsj.BadInput, match="a duration of more than 292 years"):
        vsj.identify(frame)


def test_what_a_mask_hides_is_no_reading(sample):
    time, voltage, reading = sample["time_s"], sample["voltage_v"], sample["stiffness"].copy()
    hidden = np.zeros(len(time), bool)
    hidden[100:110] = True
    expected = vsj.identify((time, voltage, np.where(hidden, np.nan, reading)))
    reading[hidden] = 1e6
    of_columns = np.zeros((len(time), 3), bool)
    of_columns[:, 2] = hidden
    rows = np.ma.array(np.c_[time, voltage, reading], mask=of_columns)
    for data in ((time, voltage, np.ma.array(reading, mask=hidden)), rows):
        with pytest.warns(vsj.RecordWarning, match="10 of 2401 rows without a reading"):
            assert vsj.identify(data).to_json() == expected.to_json()
    for data in (
        (np.ma.array(time, mask=hidden), voltage, reading),
        (time, np.ma.array(voltage, mask=hidden), reading),
        (time, np.ma.array(voltage.astype(int), mask=hidden), reading),
        (np.ma.array(np.datetime64("2026-01-31", "ms") + (1000 * time).astype("m8[ms]"), mask=hidden), voltage, reading),
    ):
        with pytest.raises(vsj.BadInput, match="line 102"):
            vsj.identify(data, time="time", voltage="voltage_v", reading="x")


@pytest.mark.parametrize(
    "call, expected",
    [
        (lambda: vsj.identify(SAMPLE, time=0), "time: 0; expected a text"),
        (lambda: vsj.identify(SAMPLE, reading=["x"]), r"reading: \['x'\]; expected a text"),
        (lambda: vsj.identify(SAMPLE, columns=3), "columns: int; expected the path of a file"),
        (lambda: vsj.diagnose(SAMPLE, effort=1), "effort: 1; expected a text"),
        (lambda: vsj.diagnose(SAMPLE, within="10s"), "within: '10s'; expected a number"),
        (lambda: vsj.diagnose(SAMPLE, plant=None), "plant: NoneType; expected paper, a plant file, or an answer with a spring"),
        (lambda: vsj.plan(vsj.identify(SAMPLE)), "diagnosis: Identified; expected a Diagnosis, or the path of its JSON"),
        (lambda: vsj.plan(SAMPLE, minutes="long"), "expected"),
    ],
)
def test_an_argument_of_another_kind_is_bad_input(call, expected):
    with pytest.raises(vsj.BadInput, match=expected):
        call()


def test_a_lazy_frame_is_collected(sample):
    frame = polars.DataFrame(sample)
    assert vsj.identify(frame.lazy()).to_json() == vsj.identify(frame).to_json()


def test_a_figure_has_the_unit_and_all_its_axes(diagnosis, sample):
    assert diagnosis.plot().axes[0].get_ylabel() == "reading (V)"
    _, axis = pyplot.subplots()
    for answer in (diagnosis, vsj.Controller().run([100.0])):
        with pytest.raises(vsj.BadInput, match="axes: 1; expected 2 matplotlib Axes, one above the other, or none"):
            answer.plot(axis)
    figure, axes = pyplot.subplots(2, 1)
    assert diagnosis.plot(axes) is figure
