"""The fleet: every record has one row, whatever dies on the way, and the page says what is in the rows."""

import ast
import datetime
import gc
import json
import os
import re
import shlex
import shutil
import signal
import subprocess
import sys
import threading
import time
import tomllib
import tracemalloc
import types
from pathlib import Path

import distributed
import numpy as np
import pandas
import psutil
import pyarrow
import pytest

import vsj
from conftest import ROOT
from vsj import _vsj
from vsj.fleet import command as fleet
from vsj.fleet import cost, page, records, run, store, summary, work
from vsj.fleet.chart import COMPARED_PER_FALSE_ALARM, chart
from vsj.fleet.settings import Settings

SPRINGS, RECORDS, ROWS = 3, 12, 120
STEP = 7
# Other than the default, one for each core.
WORKERS = os.cpu_count() + 1


def csv_of(random, gain):
    """A record of the report's spring with another gain."""
    time_s = 0.2 * np.arange(ROWS)
    voltage_v = np.repeat(100.0 * random.integers(0, 6, ROWS // 10), 10)
    stiffness = gain * _vsj.predict("paper", time_s, voltage_v, "hold") + random.normal(size=ROWS)
    return pandas.DataFrame({"time_s": time_s, "voltage_v": voltage_v, "stiffness": stiffness})


@pytest.fixture(scope="session")
def folder(tmp_path_factory):
    """Records of three springs; the gain of the second steps by 8 % between two records that are 100 days apart."""
    folder, random = tmp_path_factory.mktemp("fleet") / "springs", np.random.default_rng(5)
    for spring in range(SPRINGS):
        (folder / f"s{spring}").mkdir(parents=True)
        for index in range(RECORDS):
            date = datetime.date(2026, 1, 1) + datetime.timedelta(days=7 * index + (100 if index >= STEP else 0))
            gain = 1 + 0.002 * random.normal() + (0.08 if spring == 1 and index >= STEP else 0)
            csv_of(random, gain).to_csv(folder / f"s{spring}" / f"{date}.csv", index=False)
    return folder


@pytest.fixture(scope="session")
def engine():
    """The address of a scheduler with one worker in this process."""
    with distributed.LocalCluster(n_workers=1, threads_per_worker=1, processes=False, dashboard_address=":0") as cluster:
        yield cluster.scheduler_address


@pytest.fixture
def copied(folder, tmp_path):
    """Four records of two springs that a test may change."""
    for path in sorted(folder.glob("s[01]/*"))[:: RECORDS // 2]:
        target = tmp_path / "few" / path.relative_to(folder)
        target.parent.mkdir(parents=True, exist_ok=True)
        shutil.copy(path, target)
    return tmp_path / "few"


def rows_of(out):
    """The rows of the table by record; fails if a record has two."""
    rows = list(store.rows(out))
    by_record = {row["record"]: row for row in rows}
    assert len(by_record) == len(rows)
    return by_record


def parts(out):
    return list((out / "parts").glob("*.parquet"))


def until(condition, seconds=60):
    end = time.monotonic() + seconds
    while not condition():
        assert time.monotonic() < end, "waited too long"
        time.sleep(0.01)


def program(*arguments):
    """The command as a program of its own, in a group of processes of its own."""
    words = [sys.executable, "-m", "vsj.fleet", *map(str, arguments)]
    return subprocess.Popen(words, stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True, start_new_session=True)


def test_ctrl_c_and_a_killed_worker_cost_no_record_and_double_none(folder, tmp_path):
    arguments = (folder, "--out", tmp_path, "--workers", WORKERS, "--batch", 1, "--json")
    first = program(*arguments)
    until(lambda: len(parts(tmp_path)) >= 3)
    os.killpg(first.pid, signal.SIGINT)
    out, error = first.communicate(timeout=60)
    assert first.returncode == 130 and not out, error
    [line] = error.strip().splitlines()
    assert re.fullmatch(r"vsj\.fleet: interrupted; at least \d+ of 36 records are finished; the same command goes on", line)
    before = len(parts(tmp_path))
    assert 3 <= before < SPRINGS * RECORDS and not (tmp_path / store.TABLE).exists()

    second = program(*arguments)
    until(lambda: len(parts(tmp_path)) >= before + 3)
    workers = [it for it in psutil.Process(second.pid).children(recursive=True) if "spawn_main" in " ".join(it.cmdline())]
    assert len(workers) == WORKERS
    workers[0].kill()
    out, error = second.communicate(timeout=120)
    assert second.returncode == 0, error
    answer = json.loads(out)
    assert answer["finished_before"] == before and answer["finished_now"] == SPRINGS * RECORDS - before
    rows = rows_of(tmp_path)
    assert len(rows) == SPRINGS * RECORDS and {row["status"] for row in rows.values()} == {"diagnosed"}
    [(spring, drift)] = [
        (it["spring"], drift) for it in answer["springs"] for drift in it["drifts"] if drift["parameter"] == "gain"
    ]
    assert spring == "s1" and drift["value_after"] == pytest.approx(1.08, abs=0.01)
    # The step is in the gap.
    assert drift["after"]["time"].startswith("2026-02-12") and drift["by"]["time"].startswith("2026-05-30")


def test_results_that_cannot_be_written_are_refused_before_anything_is_computed(copied, tmp_path, monkeypatch, capsys):
    monkeypatch.setattr(run, "run", lambda *_: pytest.fail("it computes"))
    (tmp_path / "file").touch()
    for out in (tmp_path / "file", tmp_path / "file" / "out", "/dev/full/out"):
        assert fleet.main([str(copied), "--out", str(out)]) == 2
        line = capsys.readouterr().err.strip()
        assert line.startswith(f"vsj.fleet: --out file://{out}: cannot be written (") and line.endswith("for the results")


@pytest.mark.filterwarnings("ignore::pytest.PytestUnraisableExceptionWarning")
def test_ctrl_c_ends_the_run_also_where_python_drops_the_exception(copied, tmp_path, engine, monkeypatch, capsys):
    class Dropped:
        def __del__(self):
            os.kill(os.getpid(), signal.SIGINT)

    def interrupted(client, table, settings, plants, folder, out, batch_size, on_progress, wait_s):
        Dropped()
        on_progress(run.Outcome(len(table)))
        pytest.fail("the run goes on")

    monkeypatch.setattr(run, "run", interrupted)
    assert fleet.main([str(copied), "--out", str(tmp_path / "out"), "--scheduler", engine]) == 130
    assert "interrupted; at least 0 of 4 records are finished" in capsys.readouterr().err


@pytest.fixture
def programs(tmp_path):
    """A scheduler and a worker as programs: the address, and a function that runs the fleet, kills one after three parts, and then all."""
    file = tmp_path / "scheduler.json"
    start = lambda *words: subprocess.Popen([sys.executable, "-m", *words, "--scheduler-file", file], stderr=subprocess.DEVNULL)
    scheduler = start("distributed.cli.dask_scheduler", "--port", "0", "--no-dashboard")
    worker = start("distributed.cli.dask_worker", "--nthreads", "1", "--no-nanny", "--no-dashboard", "--death-timeout", "5")

    def stop():
        for it in (scheduler, worker):
            it.kill()
            it.wait()

    try:
        until(lambda: file.exists() and file.read_text().endswith("}"))
        address = json.loads(file.read_text())["address"]

        def fleet_until_killed(victim, folder, out, *words):
            def kill():
                until(lambda: len(parts(out)) >= 3)
                victim.kill()

            killer = threading.Thread(target=kill)
            killer.start()
            code = fleet.main([str(folder), "--out", str(out), "--scheduler", address, *words])
            killer.join()
            stop()
            return code

        yield types.SimpleNamespace(address=address, scheduler=scheduler, worker=worker, fleet_until_killed=fleet_until_killed)
    finally:
        stop()


def test_workers_that_leave_for_good_end_the_run(folder, tmp_path, programs, capsys):
    assert programs.fleet_until_killed(programs.worker, folder, tmp_path / "out", "--batch", "1", "--wait", "2") == 1
    line = capsys.readouterr().err.strip().splitlines()[-1]
    expected = rf"vsj\.fleet: --scheduler {programs.address}: no worker for 2 s; expected one or more; at least \d+ of 36 records .*"
    assert re.fullmatch(expected, line), line


def test_after_a_killed_scheduler_the_next_run_goes_on(folder, tmp_path, programs, engine, capsys):
    out = tmp_path / "out"
    assert programs.fleet_until_killed(programs.scheduler, folder, out, "--batch", "2") == 1
    line = capsys.readouterr().err.strip().splitlines()[-1]
    assert re.fullmatch(rf"vsj\.fleet: --scheduler {programs.address}: .* lost; at least \d+ of 36 records are finished; .*", line), line
    there = len(store.finished(out))
    assert 6 <= there < SPRINGS * RECORDS
    # Not even the size of the batches has to be the same.
    assert fleet.main([str(folder), "--out", str(out), "--scheduler", engine, "--batch", "5", "--json"]) == 0
    answer = json.loads(capsys.readouterr().out)
    assert (answer["finished_before"], answer["finished_now"]) == (there, SPRINGS * RECORDS - there)
    assert len(rows_of(out)) == SPRINGS * RECORDS


def test_a_row_is_the_diagnosis_of_its_record(copied, tmp_path, engine):
    out = tmp_path / "out"
    assert fleet.main([str(copied), "--out", str(out), "--scheduler", engine, "--effort", "quick"]) == 0
    for record, row in rows_of(out).items():
        expected, linear = vsj.diagnose(copied / record, effort="quick"), vsj.identify(copied / record).nominal
        assert (row["verdict"], row["rows"], row["gain"]) == (expected.verdict, ROWS, expected.extended.gain)
        assert (row["spring"], row["time"].date().isoformat()) == tuple(record.removesuffix(".csv").split("/"))
        named = {it["name"]: it for it in row["identified"]}
        assert named["gain"]["value"] == linear.gain.value and named["tau_s"]["unit"] == "s"
        assert [it["cause"] for it in row["findings"]] == [it.cause for it in expected.findings]
        for found, finding in zip(row["findings"], expected.findings):
            assert found["probability"] == finding.probability
            for it in found["parameters"]:
                other = finding.parameters[it["name"]]
                assert (it["value"], it["low"], it["high"], it["unit"]) == (other.value, other.low, other.high, other.unit)
    frame = store.read(out)
    assert set(frame["cause"].dropna()) == {it["cause"] for row in rows_of(out).values() for it in row["findings"]}
    assert len(frame) >= 4


@pytest.mark.parametrize(
    "words",
    [
        ("--plant", "identify"),
        ("--time", "nope"),
        ("--voltage", "nope"),
        ("--reading", "nope"),
        ("--column", "nope"),
        ("--columns", "columns.toml"),
        ("--separator", ";"),
        ("--decimal", ","),
        ("--sort",),
        ("--input", "linear"),
    ],
    ids=lambda words: words[0],
)
def test_every_option_of_a_diagnosis_reaches_its_record(copied, tmp_path, engine, command, monkeypatch, words):
    """The row is what the command answers with the option, and another one than without it."""
    monkeypatch.chdir(tmp_path)
    (tmp_path / "columns.toml").write_text('[columns]\ntime = "nope"\n')
    path = sorted(copied.glob("s1/*.csv"))[0]
    if words[0] == "--sort":
        header, first, second, *rest = path.read_text().splitlines(keepends=True)
        path.write_text("".join([header, second, first, *rest]))
    (copied / "list.csv").write_text(f"record\n{path.relative_to(copied)}\n")

    def row(*options):
        out = str(tmp_path / "-".join(["out", *(it.strip("-.;,") for it in options)]))
        fleet.main([str(copied / "list.csv"), "--out", out, "--scheduler", engine, "--effort", "quick", *options])
        [only] = rows_of(out).values()
        return only["error"], only["rmse"]

    options = [tmp_path / "columns.toml" if it == "columns.toml" else it for it in words]
    run = subprocess.run([command.path, "diagnose", path, "--effort", "quick", "--json", *options], capture_output=True, text=True)
    if run.returncode == 0:
        expected = None, json.loads(run.stdout)["baseline"]["rmse"]
    else:
        expected = run.stderr.strip().splitlines()[-1].removeprefix("vsj: "), None
    assert row(*words) == expected != row()


def test_the_effort_is_that_of_the_option(copied, tmp_path, engine, monkeypatch):
    efforts = []

    def diagnose(measured, options, plant, effort, within):
        efforts.append(effort)
        return _vsj.diagnose(measured, options, plant, "quick", within)

    monkeypatch.setattr(work, "_vsj", types.SimpleNamespace(diagnose=diagnose, identify=_vsj.identify))
    for effort in ("quick", "thorough"):
        assert fleet.main([str(copied), "--out", str(tmp_path / effort), "--scheduler", engine, "--effort", effort]) == 0
    assert efforts == ["quick"] * 4 + ["thorough"] * 4


def test_an_error_in_the_file_of_options_names_the_option(copied, tmp_path, engine):
    file, out = tmp_path / "columns.toml", tmp_path / "out"
    file.write_text("[columns]\nspace = 1\n")
    assert fleet.main([str(copied), "--out", str(out), "--scheduler", engine, "--columns", str(file)]) == 1
    assert all(row["error"].startswith("--columns, line 2, column 1: unknown field `space`") for row in rows_of(out).values())


def test_only_what_has_changed_is_diagnosed_again(copied, tmp_path, engine, capsys):
    out = tmp_path / "out"

    def counts(*more):
        assert fleet.main([str(copied), "--out", str(out), "--scheduler", engine, "--json", *more]) == 0
        answer = json.loads(capsys.readouterr().out)
        return answer["finished_before"], answer["finished_now"]

    assert counts() == (0, 4)
    before = rows_of(out)
    os.utime(copied / sorted(before)[0])
    # A part that was written twice, by a worker that was taken for dead.
    shutil.copy(parts(out)[0], out / "parts" / "again.parquet")
    (out / "parts" / ".x.parquet.1.partial").write_bytes(b"half")
    assert counts("--batch", "1") == (4, 0)
    assert rows_of(out) == before
    changed = copied / sorted(before)[0]
    changed.write_text(changed.read_text() + "30.0,0.0,0.0\n")
    assert counts() == (3, 1)
    assert rows_of(out)[sorted(before)[0]]["rows"] == ROWS + 1
    assert counts("--effort", "quick") == (0, 4)
    assert counts() == (4, 0)


def test_an_error_is_in_its_row_with_the_text_of_the_command(copied, tmp_path, engine, capsys, command):
    out, bad, gone = tmp_path / "out", copied / "s0/2026-09-01.csv", copied / "gone.csv"
    bad.write_text("time_s,voltage_v,stiffness\n0,0,0\n1,oops,0\n")
    manifest = copied / "list.csv"
    good = sorted(copied.glob("s1/*.csv"))[0].relative_to(copied)
    manifest.write_text(f"record,spring,time,plant\n{good},s1,2026-03-04,identify\ns0/{bad.name},s0,,\ngone.csv,s0,,\n")
    for _ in range(2):
        assert fleet.main([str(manifest), "--out", str(out), "--scheduler", engine]) == 1
        printed = capsys.readouterr()
        assert "2 of 3 records have no diagnosis" in printed.err
        rows = rows_of(out)
        assert rows[str(good)]["plant"] == "identify" and rows[str(good)]["time"].day == 4
        assert rows[f"s0/{bad.name}"]["status"] == "refused"
        assert rows[f"s0/{bad.name}"]["error"] == command.error("diagnose", bad)
        assert rows["gone.csv"]["status"] == "failed" and "gone.csv: FileNotFoundError" in rows["gone.csv"]["error"]
    # What was refused is finished, what failed is tried again.
    assert "2 finished before, 1 now; 2 with an error" in printed.out
    # A manifest that says more of a finished record is followed.
    manifest.write_text(manifest.read_text().replace("s1,2026-03-04", "s9,2026-03-05"))
    shutil.copy(copied / good, gone)
    assert fleet.main([str(manifest), "--out", str(out), "--scheduler", engine]) == 1
    rows = rows_of(out)
    assert rows["gone.csv"]["status"] == "diagnosed"
    assert (rows[str(good)]["spring"], rows[str(good)]["time"].day) == ("s9", 5)


def test_parquet_records_and_a_parquet_manifest_have_the_same_answers(copied, tmp_path, engine):
    out, other = tmp_path / "out", tmp_path / "parquet"
    names = sorted(path.relative_to(copied) for path in copied.glob("*/*.csv"))
    for name in names:
        (other / name).parent.mkdir(parents=True, exist_ok=True)
        frame = pandas.read_csv(copied / name).rename(columns={"time_s": "t_ms", "stiffness": "x"})
        frame.assign(t_ms=1e3 * frame["t_ms"]).to_parquet((other / name).with_suffix(".parquet"))
    moments = pandas.to_datetime([name.stem for name in names])
    listed = pandas.DataFrame({"record": [str(it.with_suffix(".parquet")) for it in names], "time": moments, "spring": 7})
    listed.to_parquet(other / "list.parquet")
    options = ["--scheduler", engine, "--time", "t_ms:ms", "--column", "x"]
    assert fleet.main([str(other / "list.parquet"), "--out", str(out), *options]) == 0
    for name, row in rows_of(out).items():
        expected = vsj.diagnose((copied / name).with_suffix(".csv"))
        assert row["verdict"] == expected.verdict and row["spring"] == "7"
        assert row["rmse"] == pytest.approx(expected.baseline.rmse, rel=1e-9)


def test_a_parquet_file_has_the_bounds_of_the_command(tmp_path, engine, command):
    folder, out = tmp_path / "springs", tmp_path / "out"
    folder.mkdir()
    number = np.arange(1_000_001.0)
    pandas.DataFrame({"time_s": number, "voltage_v": 0.0, "stiffness": 0.0}).to_parquet(folder / "long.parquet")
    with open(folder / "long.parquet", "r+b") as file:
        # What a reader that begins with the cells would complain of.
        file.seek(4)
        file.write(bytes(1000))
    assert fleet.main([str(folder), "--out", str(out), "--scheduler", engine]) == 1
    [row] = rows_of(out).values()
    assert row["error"] == command.error("diagnose", folder / "long.parquet") and "more than 1000000 rows" in row["error"]


def test_an_mcap_file_is_a_record_beside_others(copied, tmp_path, engine, command):
    folder, out = tmp_path / "springs", tmp_path / "out"
    folder.mkdir()
    for ending in ("mcap", "PARQUET"):
        command("stair", "--out", folder / f"a.{ending}", "--every", "0.1")
    pandas.read_parquet(folder / "a.PARQUET").to_csv(folder / "a.csv", index=False)
    options = ["--voltage", "applied_v", "--topic", "/stair", "--separator", ","]
    assert fleet.main([str(folder), "--out", str(out), "--scheduler", engine, "--effort", "quick", *options]) == 0
    rows = rows_of(out)
    assert len(rows) == 3
    for record, row in rows.items():
        expected = vsj.diagnose(folder / record, effort="quick", voltage="applied_v")
        assert (row["spring"], row["verdict"], row["rmse"]) == ("a", expected.verdict, expected.baseline.rmse)


@pytest.mark.parametrize("where", ["options", "file"])
def test_separator_and_decimal_mark_are_those_of_the_csv_files(copied, tmp_path, engine, where):
    """One fleet may hold files of both kinds."""
    *texts, table = sorted(copied.glob("*/*.csv"))
    expected = {it: vsj.diagnose(it).baseline.rmse for it in (*texts, table)}
    for path in texts:
        pandas.read_csv(path).to_csv(path, index=False, sep=";", decimal=",")
    frame = pandas.read_csv(table)
    # Time stamps are texts on their way to the reader.
    frame["time_s"] = pandas.Timestamp("2026-03-01") + pandas.to_timedelta(frame["time_s"], unit="s")
    frame.rename(columns={"time_s": "time"}).to_parquet(table.with_suffix(".parquet"))
    table.unlink()
    options = ["--separator", ";", "--decimal", ","]
    if where == "file":
        (tmp_path / "columns.toml").write_text('[columns]\nseparator = ";"\ndecimal = ","\n')
        options = ["--columns", str(tmp_path / "columns.toml")]
    out = tmp_path / "out"
    assert fleet.main([str(copied), "--out", str(out), "--scheduler", engine, *options]) == 0
    rows = rows_of(out)
    assert len(rows) == len(expected)
    for path, rmse in expected.items():
        record = path.with_suffix(".parquet") if path == table else path
        assert rows[str(record.relative_to(copied))]["rmse"] == pytest.approx(rmse, rel=1e-9)


def test_records_and_results_may_be_in_an_object_store(copied, engine):
    import fsspec

    fs = fsspec.filesystem("memory")
    fs.put(str(copied), "/lab/springs", recursive=True)
    assert fleet.main(["memory://lab/springs", "--out", "memory://lab/fleet", "--scheduler", engine]) == 0
    assert len(rows_of("memory://lab/fleet")) == 4
    assert fs.cat_file("/lab/fleet/fleet.html").startswith(b"<!DOCTYPE html>")
    assert not [it for it in fs.find("/lab/fleet") if it.endswith(".partial")]


def test_an_exception_of_an_object_stores_package_is_one_line_with_the_address(tmp_path, capsys):
    import fsspec

    class NoCredentialsError(Exception):
        """As of botocore, no ``OSError``."""

    def refuse(*_, **__):
        raise NoCredentialsError("Unable to locate credentials\nof anybody")

    store_of_others = type("Store", (fsspec.AbstractFileSystem,), {"protocol": "lab", "cachable": False, "info": refuse, "ls": refuse, "_open": refuse})
    fsspec.register_implementation("lab", store_of_others, clobber=True)
    (tmp_path / "s").mkdir()
    (tmp_path / "s/a.csv").touch()
    folder, out = str(tmp_path / "s"), str(tmp_path / "out")
    for words, address in (
        (["lab://b/x", "--out", out], "lab://b/x: cannot be read as"),
        ([folder, "--out", "lab://b/y"], "--out lab://b/y: cannot be written"),
        ([folder, "--out", out, "--plant", "lab://b/p.toml"], "--plant lab://b/p.toml: cannot be read"),
        (["--cost", "10", "--out", "lab://b/y"], "b/y/diagnoses.parquet: cannot be read as results"),
    ):
        assert fleet.main(words) == 2, words
        [line] = capsys.readouterr().err.strip().splitlines()
        assert line.startswith("vsj.fleet: " + address) and "Unable to locate credentials" in line, line


class StoreError(Exception):
    """An exception like that of an object store's package: no ``OSError``, and not to be read by another process, as it needs two arguments."""

    def __init__(self, code, words):
        super().__init__(f"{code}: {words}\nand more")


def arrow_invalid(*_, **__):
    raise pyarrow.ArrowInvalid("Could not convert 'x' with type str")


@pytest.mark.parametrize(
    "place, error, why, is_there",
    [
        ("parquet", arrow_invalid, "Could not convert 'x' with type str", False),
        ("before", StoreError("SlowDown", "reduce your rate"), "SlowDown: reduce your rate", False),
        ("after", StoreError("Timeout", "no answer"), "Timeout: no answer", True),
        ("before", OSError(28, "No space left on device"), "No space left on device", False),
    ],
    ids=["pyarrow", "store", "store-that-has-written", "disk"],
)
def test_rows_that_cannot_be_written_are_neither_lost_nor_doubled(copied, tmp_path, engine, monkeypatch, capsys, place, error, why, is_there):
    from fsspec.implementations.local import LocalFileSystem

    out, move, broken = tmp_path / "out", LocalFileSystem.mv, []
    words = [str(copied), "--out", str(out), "--scheduler", engine, "--effort", "quick", "--batch", "1", "--json"]

    def failing(fs, source, target, *rest, **more):
        is_second = "/parts/" in target and len(parts(out)) == 1
        if not is_second or place == "after":
            move(fs, source, target, *rest, **more)
        if is_second and not broken:
            broken.append(target)
            raise error

    def write(table, file):
        writes = pyarrow.parquet.write_table if len(parts(out)) != 1 else error
        writes(table, file)

    with monkeypatch.context() as patched:
        if place == "parquet":
            patched.setattr(store, "parquet", types.SimpleNamespace(read_table=pyarrow.parquet.read_table, write_table=write))
        else:
            patched.setattr(LocalFileSystem, "mv", failing)
        assert fleet.main(words) == 1
    printed = capsys.readouterr()
    [line] = printed.err.strip().splitlines()
    expected = rf"vsj\.fleet: --out {re.escape(str(out))}: parts/\w+\.parquet with 1 record from s\d/\S+\.csv cannot be written: {why}; "
    assert re.fullmatch(expected + r"at least \d of 4 records are finished; the same command goes on", line), line
    there = len(parts(out))
    assert there == 1 + is_there and not list(out.rglob("*.partial")) and not printed.out
    with distributed.Client(engine) as client:
        # Waits for the worker's only thread: it writes the record that it was diagnosing as the run ended.
        client.submit(int, pure=False).result()
    there = len(parts(out))
    assert fleet.main(words) == 0
    answer = json.loads(capsys.readouterr().out)
    assert (answer["finished_before"], answer["finished_now"]) == (there, 4 - there)
    assert len(rows_of(out)) == 4 and len(parts(out)) == 4


@pytest.mark.parametrize("name", [store.TABLE, page.NAME])
def test_a_table_or_page_that_cannot_be_written_is_one_line(copied, tmp_path, engine, monkeypatch, capsys, name):
    from fsspec.implementations.local import LocalFileSystem

    move = LocalFileSystem.mv

    def failing(fs, source, target, *rest, **more):
        if target.endswith(name):
            raise StoreError("SlowDown", "reduce your rate")
        move(fs, source, target, *rest, **more)

    monkeypatch.setattr(LocalFileSystem, "mv", failing)
    assert fleet.main([str(copied), "--out", str(tmp_path / "out"), "--scheduler", engine, "--effort", "quick"]) == 1
    [line] = capsys.readouterr().err.strip().splitlines()
    assert f": {name} cannot be written: SlowDown: reduce your rate; at least 4 of 4 records are finished" in line


@pytest.mark.parametrize("module, name", [(store, "write_table"), (fleet, "summary"), (page, "page"), (records, "listed"), (cost, "measured")])
def test_ctrl_c_before_and_after_the_diagnoses_is_one_line_too(copied, tmp_path, engine, monkeypatch, capsys, module, name):
    def interrupted(*_):
        raise KeyboardInterrupt

    words = [str(copied), "--out", str(tmp_path / "out"), "--scheduler", engine, "--effort", "quick"]
    if name == "measured":
        words = ["--cost", "10", *words[1:3]]
    monkeypatch.setattr(module, name, interrupted)
    assert fleet.main(words) == 130
    [line] = capsys.readouterr().err.strip().splitlines()
    far = "" if name in ("listed", "measured") else "; at least 4 of 4 records are finished; the same command goes on"
    assert line == f"vsj.fleet: interrupted{far}"


def test_a_record_that_ends_its_workers_has_a_row_and_the_others_too(copied, tmp_path, monkeypatch):
    out, _ = str(tmp_path / "out"), (tmp_path / "out").mkdir()
    address, table = records.listed(copied)
    table = fleet._with_plants(table, "paper")
    fatal, diagnose = table["record"][1].as_py(), work.diagnose

    def deadly(batch, *rest):
        if fatal in [it["record"] for it in batch]:
            os._exit(1)
        return diagnose(batch, *rest)

    monkeypatch.setattr(work, "diagnose", deadly)
    with distributed.LocalCluster(n_workers=2, threads_per_worker=1, dashboard_address=":0", silence_logs="CRITICAL") as cluster:
        cluster.scheduler.allowed_failures = 0
        with distributed.Client(cluster) as client:
            outcome = run.run(client, table, Settings(no_options(), "quick"), {"paper": None}, address, out, 2, lambda _: None, 60)
    assert outcome.new == 4 and list(outcome.failed) == [False, True, False, False]
    there = store.finished(out).to_pandas().set_index("record")
    assert there.loc[fatal, "status"] == "failed" and len(there) == 4


def no_options():
    return dict.fromkeys(("time", "voltage", "reading", "column", "columns", "separator", "decimal", "topic", "input")) | {"sort": False}


def test_a_bounded_number_of_batches_is_in_progress(folder, tmp_path, engine, monkeypatch):
    address, table = records.listed(folder)
    table, submitted, ended, most = fleet._with_plants(table, "paper"), [], [], 0
    (tmp_path / "out").mkdir()
    with distributed.Client(engine) as client:
        submit = client.submit

        def counted(*arguments, **options):
            nonlocal most
            submitted.append(arguments)
            most = max(most, len(submitted) - len(ended))
            return submit(*arguments, **options)

        monkeypatch.setattr(client, "submit", counted)
        run.run(client, table, Settings(no_options(), "quick"), {"paper": None}, address, str(tmp_path / "out"), 1, ended.append, 60)
    assert len(ended) == SPRINGS * RECORDS and most == run._AHEAD


@pytest.mark.parametrize("count, batch, threads", [(1000, 16, 8), (120, 16, 2), (1_000_000, 64, 500), (5, 16, 2)])
def test_the_last_batches_are_smaller_so_that_no_thread_waits_long(count, batch, threads):
    left, sizes = count, []
    while left:
        sizes.append(run.next_size(left, batch, threads))
        left -= sizes[-1]
    assert sum(sizes) == count and max(sizes) <= batch and sizes == sorted(sizes, reverse=True)
    assert sizes[-1] == 1
    small = cost.Measured(records=1, seconds=0.0, record_bytes=0, row_bytes=0, task_s=1.0)
    assert cost.estimate(small, count, threads, 0, batch).limits["scheduler"] == pytest.approx(len(sizes), rel=0.2, abs=3)


def test_the_memory_for_each_record_is_at_most_that_of_the_estimate(tmp_path):
    """Names, keys and states of records that are all finished, which is the most that the program ever has."""
    count = 50_000
    names = [f"spring-{index % 500:03}/2026-01-01T{index:06}.csv" for index in range(count)]
    (tmp_path / "list.csv").write_text("record\n" + "\n".join(names) + "\n")
    (tmp_path / "parts").mkdir()
    empty = dict.fromkeys(store.SCHEMA.names)
    rows = [empty | dict(spring=name[:10], record=name, key=f"{index:032x}", status="diagnosed") for index, name in enumerate(names)]
    store.write_part(str(tmp_path), rows)
    del rows
    gc.collect()
    before = pyarrow.total_allocated_bytes()
    tracemalloc.start()
    kept = records.listed(tmp_path / "list.csv"), run.Outcome(count), run._finished(str(tmp_path))
    taken = tracemalloc.get_traced_memory()[0] + pyarrow.total_allocated_bytes() - before
    tracemalloc.stop()
    assert len(kept[2]) == count and 0.5 * cost._CLIENT_BYTES < taken / count < cost._CLIENT_BYTES, taken / count


def test_a_worker_of_another_build_is_refused(tmp_path):
    settings = Settings(no_options(), "quick", build="other")
    with pytest.raises(RuntimeError, match="of vsj; expected other"):
        work.diagnose([], {}, settings, str(tmp_path), str(tmp_path))


@pytest.mark.parametrize("changed", [Path(_vsj.__file__).name, "records.py", "fleet/work.py"])
def test_another_build_of_the_same_version_has_other_keys(tmp_path, changed):
    shutil.copytree(Path(vsj.__file__).parent, tmp_path / "vsj", ignore=shutil.ignore_patterns("__pycache__"))
    program = "import vsj; from vsj.fleet.settings import Settings; print(vsj.__version__, Settings({}, 'quick').key(b'', 'paper'))"
    # Without caches of compiled files, which would be found by time and size.
    options = {"cwd": tmp_path, "env": os.environ | {"PYTHONPATH": str(tmp_path), "PYTHONDONTWRITEBYTECODE": "1"}}
    keys = lambda: subprocess.run([sys.executable, "-c", program], capture_output=True, text=True, check=True, **options).stdout.split()
    before = keys()
    assert before == keys()
    with open(tmp_path / "vsj" / changed, "ab") as file:
        file.write(b"\n")
    after = keys()
    assert after[0] == before[0] == vsj.__version__ and after[1] != before[1]


def test_bad_arguments_end_with_2_and_one_line(tmp_path, engine, capsys):
    folder, empty = tmp_path / "springs", tmp_path / "empty"
    for it in (folder / "a", empty):
        it.mkdir(parents=True)
    (folder / "a/b.csv").write_text("no")
    (tmp_path / "bad.toml").write_text("[relaxation]\nshare = 7\n")
    listed = {"names.csv": "name\nx\n", "dates.csv": "record,time\nx.csv,yesterday\n", "twice.csv": "record\nx.csv\nx.csv\n", "gap.csv": "record,spring\n,s\n", "double.csv": "record,spring,spring\nx.csv,a,b\n"}
    for name, text in listed.items():
        (tmp_path / name).write_text(text)
    for words, part in (
        ([tmp_path / "none"], "not found; expected a folder"),
        ([empty], "no record; expected files"),
        ([tmp_path / "names.csv"], "columns name; expected record"),
        ([tmp_path / "dates.csv"], "row 1, column time: yesterday; expected a date"),
        ([tmp_path / "twice.csv"], "x.csv is listed twice"),
        ([tmp_path / "gap.csv"], "row 1, column record: empty"),
        ([tmp_path / "double.csv"], "columns record, spring, spring; expected record"),
        ([folder, "--wait", "inf"], "inf: expected a number"),
        (["--cost", "10", "--price", "inf"], "inf: expected a number"),
        ([folder, "--plant", "no.toml"], "--plant no.toml: cannot be read"),
        ([folder, "--plant", tmp_path / "bad.toml"], "bad.toml"),
        ([folder, "--columns", "no.toml"], "--columns no.toml: cannot be read"),
        ([folder, "--scheduler", "10.0.0.5"], "expected local, slurm, or an address"),
        ([folder, "--scheduler", engine, "--workers", 2], "--workers 2: " + engine),
        ([folder, "--cores", 2], "--cores: applies to an estimate only"),
        ([folder, "--price", 1], "--price: applies to an estimate only"),
        ([folder, "--cost", 10], "RECORDS: --cost diagnoses nothing and reads the results in --out; expected no RECORDS"),
        (["--cost", 10, "--plant", "identify"], "--plant: --cost diagnoses nothing"),
        (["--cost", 10, "--sort"], "--sort: --cost diagnoses nothing"),
        ([folder, "--batch", "0"], "expected a number, 1 to 100000"),
        ([folder, "--effort", "much"], "quick"),
        ([], "RECORDS: expected"),
        (["--cost", "10", "--out", empty], "no diagnoses.parquet"),
        (["nowhere://x"], "nowhere"),
    ):
        try:
            code = fleet.main([*map(str, words), *([] if "--out" in words else ["--out", str(tmp_path / "out")])])
        except SystemExit as end:
            code = end.code
        [line] = capsys.readouterr().err.strip().splitlines()
        assert code == 2 and line.startswith("vsj.fleet: ") and part in line, (words, line)
    assert fleet.main([str(folder), "--out", str(tmp_path / "out"), "--scheduler", "tcp://127.0.0.1:1", "--wait", "1"]) == 1
    assert "no scheduler answers within 1 s" in capsys.readouterr().err


def test_a_damaged_or_foreign_file_of_results_is_named(copied, tmp_path, engine, capsys):
    out = tmp_path / "out"
    assert fleet.main([str(copied), "--out", str(out), "--scheduler", engine, "--effort", "quick"]) == 0
    part, foreign = parts(out)[0], out / "parts/x.parquet"
    pandas.DataFrame({"a": [1]}).to_parquet(foreign)

    def refused(words, name):
        capsys.readouterr()
        assert fleet.main([*map(str, words), "--out", str(out)]) == 2
        [line] = capsys.readouterr().err.strip().splitlines()
        assert line.startswith(f"vsj.fleet: {name}: cannot be read as results: "), line

    refused([copied, "--scheduler", engine], foreign)
    foreign.unlink()
    part.write_bytes(part.read_bytes()[:300])
    refused([copied, "--scheduler", engine], part)
    (out / store.TABLE).write_bytes(b"PAR1")
    refused(["--cost", 10], out / store.TABLE)


@pytest.mark.parametrize("place", [".", "out/fleet"])
def test_results_in_the_folder_of_the_records_are_no_records(copied, engine, monkeypatch, capsys, place):
    monkeypatch.chdir(copied)
    for counts in ((0, 4), (4, 0)):
        assert fleet.main([".", "--out", place, "--scheduler", engine, "--effort", "quick", "--json"]) == 0
        answer = json.loads(capsys.readouterr().out)
        assert (answer["finished_before"], answer["finished_now"]) == counts


def test_a_plant_of_the_manifest_is_not_the_file_of_the_same_name_that_the_option_names(copied, tmp_path, engine, monkeypatch, capsys):
    for folder, tau_s in ((tmp_path, 5.5), (copied, 11.0)):
        (folder / "plant.toml").write_text(f"schema = 1\n[relaxation]\nshare = 0.09\ntau_s = {tau_s}\n")
    record = sorted(copied.glob("s1/*.csv"))[0].relative_to(copied)
    (copied / "list.csv").write_text(f"record,plant\n{record},plant.toml\n")
    monkeypatch.chdir(tmp_path)
    words = [str(copied / "list.csv"), "--out", str(tmp_path / "out"), "--scheduler", engine]
    assert fleet.main([*words, "--plant", "plant.toml"]) == 2
    assert "plant.toml is another file than --plant plant.toml" in capsys.readouterr().err
    assert fleet.main([*words, "--effort", "quick"]) == 0


def test_the_extra_brings_every_package_that_the_fleet_imports():
    project = tomllib.loads((ROOT / "python/pyproject.toml").read_text())["project"]
    listed = {re.match(r"\w+", it)[0] for it in (*project["dependencies"], *project["optional-dependencies"]["fleet"])}
    trees = [ast.parse(path.read_text()) for path in (ROOT / "python/vsj/fleet").glob("*.py")]
    nodes = [node for tree in trees for node in ast.walk(tree)]
    names = {it.name for node in nodes if isinstance(node, ast.Import) for it in node.names}
    names |= {node.module for node in nodes if isinstance(node, ast.ImportFrom) and not node.level}
    needed = {name.partition(".")[0] for name in names} - sys.stdlib_module_names
    # dask needs fsspec, and jinja2 markupsafe; SLURM's package is named by its own error.
    assert needed - {"fsspec", "markupsafe", "dask_jobqueue"} <= listed


@pytest.mark.parametrize("package", ["distributed", "pyarrow"])
def test_without_its_packages_the_command_says_what_to_install(package):
    program = f"import sys, runpy; sys.modules['{package}'] = None; runpy.run_module('vsj.fleet', run_name='__main__')"
    done = subprocess.run([sys.executable, "-c", program], capture_output=True, text=True, cwd=ROOT)
    assert done.returncode == 2 and done.stderr == f"vsj.fleet: the package {package} is missing; expected: pip install './python[fleet]'\n"


@pytest.mark.parametrize(
    "text, expected",
    [
        ("2026-03-01", "2026-03-01T00:00:00+00:00"),
        ("20260301", "2026-03-01T00:00:00+00:00"),
        ("2026-03-01_second", "2026-03-01T00:00:00+00:00"),
        ("2026-03-01T12-30-05", "2026-03-01T12:30:05+00:00"),
        ("2026-03-01 12:30:05.25+02:00", "2026-03-01T10:30:05.250000+00:00"),
        ("20260301T1230Z", "2026-03-01T12:30:00+00:00"),
        ("2026-13-01", None),
        ("run 7", None),
        ("202603011", None),
    ],
)
def test_the_time_of_a_record_is_the_date_that_its_name_begins_with(text, expected):
    found = records.time_of(text)
    assert (found and found.isoformat()) == expected


def test_a_name_with_several_folders_is_a_spring(tmp_path):
    for name in ("rig/a/1.csv", "rig/a/2.csv", "alone.csv", "note.txt"):
        (tmp_path / name).parent.mkdir(parents=True, exist_ok=True)
        (tmp_path / name).touch()
    _, table = records.listed(tmp_path)
    assert list(zip(table["spring"].to_pylist(), table["record"].to_pylist())) == [
        ("alone", "alone.csv"),
        ("rig/a", "rig/a/1.csv"),
        ("rig/a", "rig/a/2.csv"),
    ]


def test_files_that_are_no_records_are_counted(tmp_path):
    for name in ("a.CSV", "b.csv", ".hidden.csv", ".git/c.csv", "~$b.csv", "note.txt"):
        (tmp_path / name).parent.mkdir(parents=True, exist_ok=True)
        (tmp_path / name).touch()
    os.mkfifo(tmp_path / "pipe.csv")
    (tmp_path / "link.csv").symlink_to(tmp_path / "b.csv")
    remarks = []
    _, table = records.listed(tmp_path, remark=remarks.append)
    assert table["record"].to_pylist() == ["a.CSV", "b.csv", "link.csv"]
    assert remarks == ["2 of 5 files are no records: expected *.csv or *.mcap or *.parquet"]


def test_units_of_a_parquet_file_are_those_of_the_command(copied, tmp_path, engine):
    [csv] = sorted(copied.glob("*/*.csv"))[:1]
    frame = pandas.read_csv(csv).rename(columns={"time_s": "t", "voltage_v": "u", "stiffness": "x"})
    frame = frame.assign(t=1e3 * frame["t"])
    frame.attrs["units"] = {"t": "ms", "u": "V", "x": "V"}
    (tmp_path / "one").mkdir()
    frame.to_parquet(tmp_path / "one/2026-01-31.PARQUET")
    out = tmp_path / "out"
    assert fleet.main([str(tmp_path / "one"), "--out", str(out), "--scheduler", engine]) == 0
    [row] = rows_of(out).values()
    assert row["rmse"] == pytest.approx(vsj.diagnose(csv).baseline.rmse, rel=1e-9)


def test_an_unchanged_parameter_signals_as_rarely_as_stated():
    random, compared, signals = np.random.default_rng(1), 0, 0
    for _ in range(500):
        found = chart(random.normal(10, 3, 60))
        outside = np.abs(found.z) > found.limit
        compared, signals = compared + found.compared, signals + np.sum(outside[1:] & ~outside[:-1]) + outside[0]
    assert 0.7 < compared / signals / COMPARED_PER_FALSE_ALARM < 1.5


def test_a_change_is_found_with_its_time_and_its_size():
    random = np.random.default_rng(2)
    for step, place in ((4.0, 20), (-4.0, 20), (6.0, 9)):
        values = 50 + random.normal(size=40)
        values[place:] += step
        change = chart(values).change
        assert abs(change.first - place) <= 1 and change.last == 39 and change.after - change.before == pytest.approx(step, abs=1)
    slow = chart(50 + random.normal(size=60) + 0.15 * np.arange(60)).change
    assert slow.last == 59 and slow.after > slow.before + 3


def test_single_and_few_and_equal_values_are_no_change():
    values = np.random.default_rng(3).normal(size=30)
    values[12] = 1e6
    found = chart(values)
    assert found.singles == [12] and found.change is None
    assert chart([1.0, 2.0]) is None and chart([]) is None and chart(np.full(50, 0.1)) is None
    assert chart([1.0, 1.1, 5000.0]).change is None


def test_a_cause_is_there_since_it_is_more_frequent():
    since = lambda text: summary._since(np.array([it == "x" for it in text]))
    assert [since(it) for it in ("xxxx", "...x", "...xxx", "x.....xxxx.xx", "..x", "x...")] == [0, 3, 3, 6, 2, 0]


def row(spring, time, gain, **more):
    identified = [{"name": "gain", "value": gain, "low": gain - 0.001, "high": gain + 0.001, "unit": "<V>"}]
    made = dict(spring=spring, record=f"{spring}/{time:03}.csv", time=None, status="diagnosed", verdict="consistent", error=None)
    return made | dict(findings=[], identified=identified) | more


def test_the_page_needs_nothing_else_and_escapes_what_it_is_given():
    random = np.random.default_rng(4)
    gains = 1 + 0.001 * random.normal(size=30) + 0.02 * (np.arange(30) >= 15)
    rows = [row("<b>&", index, gain) for index, gain in enumerate(gains)]
    rows[5]["findings"] = [{"cause": "hysteresis", "probability": 0.9, "parameters": []}]
    # An interval that says nothing, and an error text.
    rows[20]["identified"] = [{"name": "gain", "value": 7.0, "low": -90.0, "high": 90.0, "unit": "<V>"}]
    rows.append(row("<b>&", 30, 1.0, status="refused", verdict=None, error="<script>", findings=None, identified=None))
    found = summary.summary(rows)
    [series] = found.series
    assert series.imprecise == 1 and series.drift.by_record.record.endswith("015.csv") and series.drift.strength > 5
    html = page.page(found, "springs", Settings({}, "quick"))
    assert html.count("<circle") == html.count("<title>record: ") == html.count("\nvalue: ") == 29
    assert "Fleet of 1 spring<" in html and "31 records of 1 spring, 1 of them" in html and "1 parameter changed" in html
    for part in ("prefers-color-scheme: dark", "max-width: 640px", 'data-name="spring"', "&lt;b&gt;&amp;", "&lt;script&gt;", "hysteresis since"):
        assert part in html, part
    assert "<script" not in html and "<b>" not in html and not re.search(r'(src|href)=|url\(|@import', html)
    assert html.count("<svg") == 1 and "nan" not in re.findall("<svg.*?</svg>", html, re.DOTALL)[0]


def test_the_cost_of_a_larger_fleet_is_what_the_page_of_formulas_says():
    small = cost.Measured(records=100, seconds=0.5, record_bytes=1e5, row_bytes=400, task_s=1e-3)
    of = cost.estimate(small, 1_000_000, cores=100, price=0.04, batch=16)
    assert of.cpu_s == 500_000 and of.limits["cores"] == 5000 and of.limits["scheduler"] == pytest.approx(62.78, abs=0.01)
    assert of.bottleneck == "cores" and of.useful_cores == 8000
    # 62 500 parts, and 277 as the last are smaller, read twice by 32 readers of 0.1 s each.
    assert of.end_s == pytest.approx(392.4, abs=0.05) and of.time_s == 5000 + 0.5 + of.end_s
    assert of.cost == pytest.approx(of.time_s / 3600 * 100 * 0.04)
    assert cost.estimate(small, 1_000_000, cores=20_000, price=0.04, batch=16).bottleneck == "object store"
    assert cost.estimate(small, 1_000_000, cores=2000, price=0.04, batch=1).bottleneck == "scheduler"
    assert "bottleneck                              cores" in cost.text(small, of)


def test_the_cost_in_the_manual_is_what_the_formulas_give_for_its_measured_values(capsys, monkeypatch):
    manual = (ROOT / "docs/fleet.md").read_text()
    [command, printed] = re.search(r"python -m vsj.fleet (--cost .*?)\n```\n\n```text\n(.*?)```", manual, re.DOTALL).groups()
    first = {line[:40].strip(): [float(it) for it in re.findall(r"[\d.]+", line[40:])] for line in printed.splitlines()[:4]}
    [records], [seconds], [record_kb, row_kb], [task_ms] = first.values()
    small = cost.Measured(int(records), seconds, 1e3 * record_kb, 1e3 * row_kb, task_ms / 1e3)
    monkeypatch.setattr(cost, "measured", lambda out: small)
    assert fleet.main(shlex.split(command)) == 0
    assert capsys.readouterr().out == printed
    cores, price = 500, 0.04
    assert f"--cores {cores} --price {price} --batch 64" in command
    of = cost.estimate(small, 1_000_000, cores, price, 16)
    assert f"With `--batch 16` the same takes {of.time_s / 3600:.2f} h, {of.end_s / 3600:.2f} h of it at the end" in " ".join(manual.split())


def test_the_schema_of_the_table_is_in_the_manual():
    manual = (ROOT / "docs/fleet.md").read_text()
    assert [name for name in store.SCHEMA.names if f"`{name}`" not in manual] == []


def test_the_commands_of_the_manual_run(copied, tmp_path, monkeypatch, capsys):
    page = (ROOT / "docs/fleet.md").read_text()
    lines = [line for block in re.findall(r"```sh\n(.*?)```", page, re.DOTALL) for line in block.splitlines()]
    commands = [shlex.split(line)[3:] for line in lines if line.startswith("python -m vsj.fleet ")]
    examples = [shlex.split(line)[3:] for line in fleet._EXAMPLES.splitlines() if line.startswith("  python -m vsj.fleet ")]
    assert len(commands) == 5 and len(examples) == 5
    for words in commands + examples:
        fleet._parser().parse_args(words)
    (tmp_path / "data").mkdir()
    copied.rename(tmp_path / "data/springs")
    monkeypatch.chdir(tmp_path)
    monkeypatch.setattr(cost, "_TASKS", 200)
    for words, printed in ((commands[0], "wrote out/fleet/fleet.html"), (commands[-1], "1000000 records in batches of 64")):
        assert fleet.main(words) == 0
        assert printed in capsys.readouterr().out
