"""Parquet files of the command and of others."""

import json
import re

import polars
import pytest
import vsj
from conftest import SAMPLE


def test_a_parquet_file_of_polars_is_the_record_that_its_csv_is(command, sample, tmp_path):
    file = tmp_path / "sample.parquet"
    expected = json.loads(command("identify", SAMPLE, "--json"))
    for compression in ("zstd", "snappy", "gzip", "uncompressed"):
        polars.DataFrame(sample).write_parquet(file, compression=compression)
        found = json.loads(command("identify", file, "--json"))
        assert {**found, "start": None} == {**expected, "start": None}, "all but the name of the record"
    polars.DataFrame(sample).write_parquet(file, compression="brotli")
    assert "compressed by brotli; expected Snappy, zstd, gzip or none" in command.error("identify", file)
    stamped = polars.DataFrame(sample).with_columns(
        time=polars.datetime(2026, 1, 31) + polars.duration(milliseconds=polars.col("time_s") * 1000)
    )
    stamped.drop("time_s").write_parquet(file, compression="snappy")
    found = json.loads(command("identify", file, "--json"))
    tau_s = lambda answer: answer["nominal"]["tau_s"][0]["value"]
    assert tau_s(found) == pytest.approx(tau_s(expected), rel=1e-6)
    for unit in ("ms", "us", "ns"):
        elapsed = stamped.with_columns(time=(polars.col("time") - polars.datetime(2026, 1, 31)).cast(polars.Duration(unit)))
        elapsed.drop("time_s").write_parquet(file, compression="snappy")
        found = json.loads(command("identify", file, "--json"))
        assert tau_s(found) == pytest.approx(tau_s(expected), rel=1e-6)
    expected = "column time [s]: durations, not numbers in ms; expected numbers, or no unit"
    assert expected in command.error("identify", file, "--time", "time:ms")
    with pytest.raises(vsj.BadInput, match=re.escape(expected)):
        vsj.identify(polars.read_parquet(file), time="time:ms")


def test_typed_dates_are_the_days_of_typed_times(command, sample, tmp_path):
    file, text = tmp_path / "sample.parquet", tmp_path / "sample.csv"
    stamps = polars.datetime(2026, 1, 31, 23, 59) + polars.duration(milliseconds=polars.col("time_s") * 1000)
    frame = polars.DataFrame(sample).with_columns(date=stamps.dt.date(), time=stamps.dt.time()).drop("time_s")
    frame.write_parquet(file, compression="snappy")
    frame.write_csv(text)
    found, expected = (json.loads(command("identify", record, "--json")) for record in (file, text))
    assert {**found, "start": None} == {**expected, "start": None}


def test_polars_reads_what_the_command_writes(command, tmp_path):
    file = tmp_path / "stair.parquet"
    command("stair", "--out", file, "--every", "0.1")
    frame = polars.read_parquet(file)
    assert frame.columns == ["time_s", "target_v", "applied_v", "dac_code", "stiffness", "youngs_modulus_pa"]
    assert frame.height == 701 and frame["time_s"][1] == 0.1 and frame["dac_code"].dtype == polars.Int64
    attributes = json.loads(polars.read_parquet_metadata(file)["PANDAS_ATTRS"])
    assert attributes["units"]["youngs_modulus_pa"] == "Pa"


@pytest.mark.parametrize("ending", ["mcap", "parquet", "Parquet"])
def test_the_path_of_another_file_is_read_as_by_the_command(command, tmp_path, ending):
    file = tmp_path / f"stair.{ending}"
    command("stair", "--out", file, "--every", "0.1")
    found, expected = vsj.identify(file, voltage="applied_v"), command("identify", file, "--voltage", "applied_v", "--json")
    assert json.loads(found.to_json()) == json.loads(expected)
    file.write_bytes(b"time_s,voltage_v,stiffness")
    with pytest.raises(vsj.BadInput) as error:
        vsj.identify(file)
    assert str(error.value) == command.error("identify", file)


def test_options_of_other_files_are_refused(command, sample, tmp_path):
    file = tmp_path / "stair.mcap"
    command("stair", "--out", file, "--every", "0.1")
    for data, options, where in (
        (sample, {"separator": ";"}, "CSV"),
        (sample, {"topic": "/a"}, "MCAP"),
        (file, {"separator": ";"}, "CSV"),
        (tmp_path / "a.parquet", {"decimal": ","}, "CSV"),
    ):
        with pytest.raises(vsj.BadInput) as error:
            vsj.identify(data, **options)
        assert str(error.value) == f"{[*options][0]}: applies to paths of {where} files only; expected none"
    for path in (file, SAMPLE):
        with pytest.raises(vsj.BadInput) as error:
            vsj.identify(path, topic="/nope")
        assert str(error.value) == command.error("identify", path, "--topic", "/nope")
    assert vsj.identify(file, topic="/stair", voltage="applied_v").nominal
