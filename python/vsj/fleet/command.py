"""The command line: ``python -m vsj.fleet``."""

import argparse
import json
import sys

import numpy as np
from tqdm import tqdm

from .. import BadInput, __version__, _vsj
from . import cluster, cost, page, records, run, store
from .settings import NAMED_PLANTS, Settings
from .summary import summary

_EXAMPLES = """\
Examples:
  python -m vsj.fleet data/springs --out out/fleet
  python -m vsj.fleet springs.csv --out out/fleet --plant identify --effort quick
  python -m vsj.fleet s3://lab/springs --out s3://lab/fleet --scheduler tcp://10.0.0.5:8786
  python -m vsj.fleet data/springs --out out/fleet --scheduler slurm --workers 40
  python -m vsj.fleet --cost 1000000 --out out/fleet --cores 500 --price 0.04

RECORDS is a folder with SPRING/DATE.csv, .mcap or .parquet, or a CSV or Parquet manifest with the columns record, and optionally
spring, time, plant. The same command goes on where an earlier one ended, however it ended. In --out: diagnoses.parquet, a row for
each record; fleet.html, the summary; parts/, the state.

Exit codes: 0 every record is diagnosed, 1 a record has an error in its row, results cannot be written, or scheduler or workers are lost,
2 bad arguments or input, 130 Ctrl-C."""


def main(arguments=None):
    """Run the command; returns the exit code."""
    parser = _parser()
    wanted = parser.parse_args(arguments)
    try:
        _expect_no_ignored(parser, wanted)
        if wanted.cost:
            return _cost(wanted)
        if wanted.records is None:
            parser.error("RECORDS: expected a folder of records, or a manifest")
        return _diagnose(wanted)
    except BadInput as error:
        return _said(error, 2)
    except KeyboardInterrupt:
        return _said("interrupted", 130)
    except FileNotFoundError as error:
        return _said(f"{error.filename or error}: not found", 2)
    except (OSError, RuntimeError) as error:
        return _said(error, 1)


_OF_BOTH, _OF_ESTIMATES = ("out", "batch", "json", "cost"), ("cores", "price")
"""Arguments of every run, and of an estimate alone; all others are of a diagnosis."""


def _expect_no_ignored(parser, wanted):
    for name, value in vars(wanted).items():
        if name in _OF_BOTH or value == parser.get_default(name) or (name in _OF_ESTIMATES) == bool(wanted.cost):
            continue
        shown = "RECORDS" if name == "records" else f"--{name}"
        if wanted.cost:
            parser.error(f"{shown}: --cost diagnoses nothing and reads the results in --out; expected no {shown}")
        parser.error(f"{shown}: applies to an estimate only; expected --cost")


def _diagnose(wanted):
    out = records.absolute(wanted.out)
    folder, table = records.listed(wanted.records, store.addresses(out), lambda text: _said(f"{wanted.records}: {text}", 0))
    settings, plants = _settings(wanted, table, folder)
    table = _with_plants(table, wanted.plant)
    store.expect_writable(out)
    outcome, count = run.Outcome(len(table)), len(table)
    try:
        with run.interrupts() as interrupts, tqdm(total=count, unit="record", disable=None, desc="diagnosed", smoothing=0.05) as bar:

            def show(now):
                nonlocal outcome
                outcome = now
                if interrupts:
                    raise KeyboardInterrupt
                bar.update(now.new + now.before - bar.n)
                bar.set_postfix(refused=now.refused, failed=int(now.failed.sum()), refresh=False)

            with cluster.connected(wanted.scheduler, wanted.workers, wanted.wait) as client:
                outcome = run.run(client, table, settings, plants, folder, out, wanted.batch, show, wanted.wait)
        store.write_table(out, table, outcome.key)
        found = summary(store.rows(out))
        store.write_text(out, page.NAME, page.page(found, wanted.records, settings))
    except KeyboardInterrupt:
        return _said(f"interrupted; {_progress(outcome, count)}", 130)
    except run.SchedulerLost as error:
        return _said(f"--scheduler {wanted.scheduler}: {error}; {_progress(outcome, count)}", 1)
    except store.WriteError as error:
        return _said(f"--out {wanted.out}: {error}; {_progress(outcome, count)}", 1)
    errors = outcome.refused + int(outcome.failed.sum())
    if wanted.json:
        print(json.dumps(_json(found, outcome)))
    else:
        print(f"{count} records: {outcome.before} finished before, {outcome.new} now; {errors} with an error in their row")
        print(f"wrote {wanted.out}/{store.TABLE}\nwrote {wanted.out}/{page.NAME}")
    if errors:
        [first] = [f"{it.record}: {it.error}" for it in found.problems[:1]]
        return _said(f"{errors} of {count} records have no diagnosis, such as {first}", 1)
    return 0


def _progress(outcome, count):
    return f"at least {outcome.new + outcome.before} of {count} records are finished; the same command goes on"


def _settings(wanted, table, folder):
    """The settings, and the text of each plant by its name."""
    options = {name: getattr(wanted, name) for name in ("time", "voltage", "reading", "column", "separator", "decimal", "topic", "sort", "input")}
    columns = _text(wanted.columns, "--columns") if wanted.columns else None
    plants = dict.fromkeys(NAMED_PLANTS)
    if wanted.plant not in plants:
        plants[wanted.plant] = _text(wanted.plant, "--plant")
    for name in table["plant"].unique().to_pylist():
        if name is None or name in NAMED_PLANTS:
            continue
        where = name if "://" in name or name.startswith("/") else f"{folder}/{name}"
        text = _text(where, f"{wanted.records}, column plant:")
        if plants.setdefault(name, text) != text:
            raise BadInput(f"{wanted.records}, column plant: {name} is another file than --plant {name}; expected different names")
    for name, text in plants.items():
        if text is not None:
            # Refused here, not in the row of every record.
            _vsj.predict((name, text), np.array([0.0, 1.0]), np.zeros(2), "hold")
    return Settings(options | {"columns": None}, wanted.effort, columns), plants


def _with_plants(table, default):
    index = table.column_names.index("plant")
    return table.set_column(index, "plant", table["plant"].fill_null(default))


def _text(url, option):
    fs, path = records.filesystem(url)
    try:
        return fs.cat_file(path).decode()
    except Exception as error:
        raise BadInput(f"{option} {url}: cannot be read: {getattr(error, 'strerror', None) or records.reason(error)}") from error


def _json(found, outcome):
    moment = lambda it: {"record": it.record, "time": it.time and it.time.isoformat()}
    drift = lambda it: {
        "spring": it.spring,
        "parameter": it.parameter,
        "unit": it.unit,
        "after": moment(it.after_record),
        "by": moment(it.by_record),
        "until": moment(it.until),
        "stands": it.stands,
        "value_before": it.before,
        "value_after": it.after,
    }
    presence = lambda it: {"cause": it.cause, "since": moment(it.since), "last": moment(it.last), "found": it.found, "of": it.of}
    spring = lambda it: {
        "spring": it.name,
        "records": it.records,
        "verdict": it.verdict,
        "causes": [presence(cause) for cause in it.causes],
        "drifts": [drift(each) for each in it.drifts],
    }
    return {
        "schema": 1,
        "finished_before": outcome.before,
        "finished_now": outcome.new,
        "status": found.status,
        "verdicts": found.verdicts,
        "causes": [{"cause": it.cause, "springs": it.springs, "records": it.records} for it in found.causes],
        "springs": [spring(it) for it in found.springs],
    }


def _cost(wanted):
    measured = cost.measured(wanted.out)
    cores = cost.CORES if wanted.cores is None else wanted.cores
    price = cost.PRICE if wanted.price is None else wanted.price
    estimate = cost.estimate(measured, wanted.cost, cores, price, wanted.batch)
    if wanted.json:
        print(json.dumps(cost.as_json(measured, estimate)))
    else:
        print(cost.text(measured, estimate), end="")
    return 0


def _said(text, code):
    print(f"vsj.fleet: {text}", file=sys.stderr)
    return code


class _Parser(argparse.ArgumentParser):
    """Errors in one line."""

    def error(self, message):
        self.exit(2, f"vsj.fleet: {message}\n")


def _number(kind, low, high=sys.float_info.max):
    def parse(text):
        try:
            value = kind(text)
        except ValueError:
            value = None
        if value is None or not low <= value <= high:
            bound = f"{low:g} or more" if high == sys.float_info.max else f"{low:g} to {high:g}"
            raise argparse.ArgumentTypeError(f"{text}: expected a number, {bound}")
        return value

    return parse


def _parser():
    parser = _Parser(
        prog="python -m vsj.fleet",
        description="Diagnose thousands of records of hundreds of springs, and summarise them on one page.",
        epilog=_EXAMPLES,
        formatter_class=argparse.RawDescriptionHelpFormatter,
        allow_abbrev=False,
    )
    add = parser.add_argument
    add("records", nargs="?", metavar="RECORDS", help="folder, manifest, or URL of one that fsspec knows (s3://, gs://, abfs://)")
    add("--out", default="out/fleet", metavar="DIR", help="folder or URL of the results; default: out/fleet")
    add("--scheduler", default="local", metavar="ADDRESS", help="local, slurm, or the address of a Dask scheduler, tcp://HOST:8786; default: local")
    add("--workers", type=_number(int, 1), metavar="N", help="processes (local) or jobs (slurm); default: one for each core, or one job")
    add("--wait", type=_number(float, 1, 1_000_000), default=600, metavar="S", help="longest time without a worker, at the start and later, in s; default: 600")
    add("--batch", type=_number(int, 1, 100_000), default=16, metavar="N", help="records in one task, and in one file of the state; default: 16")
    add("--json", action="store_true", help="print the summary as one JSON object")
    add("--version", action="version", version=f"vsj {__version__}")
    diagnosis = parser.add_argument_group("diagnosis, as for `vsj diagnose`")
    add = diagnosis.add_argument
    add("--plant", default="paper", metavar="PLANT", help="paper, identify, or a plant file, where a manifest names none; default: paper")
    add("--effort", default="normal", choices=("quick", "normal", "thorough"), help="how long causes are searched for; default: normal")
    add("--time", metavar="NAME[:UNIT]", help="column of the times")
    add("--voltage", metavar="NAME[:UNIT]", help="column of the voltages")
    add("--reading", metavar="NAME[:UNIT]", help="column of the readings")
    add("--column", metavar="NAME", help="column of a reading that is the stiffness, in V")
    add("--columns", metavar="FILE", help="file with these options")
    add("--separator", metavar="CHAR", help="separator of CSV files")
    add("--decimal", metavar="CHAR", help="decimal mark of CSV files")
    add("--topic", metavar="NAME", help="topic of the messages in MCAP files")
    add("--sort", action="store_true", help="order the rows by time")
    add("--input", choices=("hold", "linear", "stair"), help="the voltage between the rows; default: hold")
    paper = parser.add_argument_group("cost of a larger fleet, computed from the results in --out")
    add = paper.add_argument
    add("--cost", type=_number(int, 1), metavar="RECORDS", help="compute time and price of this number of records; diagnose nothing")
    add("--cores", type=_number(int, 1), metavar="N", help=f"cores; default: {cost.CORES}")
    add("--price", type=_number(float, 0), metavar="X", help=f"price of a core for an hour, in any currency; default: {cost.PRICE}")
    return parser
