"""Units of `vsj export fmu`, loaded by FMPy: valid, and equal to the tick to the bit."""

import json
import re
import warnings
import zipfile
from pathlib import Path

import fmpy
import numpy as np
import pytest
from fmpy.fmi1 import FMICallException
from fmpy.validation import validate_fmu

import vsj
from conftest import ROOT

TICK_S = 1e-3
# Steps of 100 to 350 V, long enough for the limits and for the relaxation to matter.
TARGETS = np.repeat([100.0, 350.0, 0.0, 250.0], 150)
UNITS = [(unit, fmi) for unit in ("spring", "controller", "both") for fmi in (2, 3)]
CASES = {
    "paper": ("paper", dict(controller="paper"), []),
    "example": (ROOT / "docs/plant.toml", dict(controller="paper", slew_v_per_s=2000.0), ["--slew-v-per-s", 2000]),
    "fast": ("paper", dict(controller="fast", limit_v=1000.0), ["--controller", "fast", "--limit-v", 1000]),
    "robust": (
        ROOT / "docs/plant.toml",
        dict(controller="robust", known={"tau": 7, "share": 3}, overshoot_percent=3),
        ["--known", "tau=7", "--known", "share=3", "--overshoot-percent", 3],
    ),
}


@pytest.fixture(scope="module")
def export(command, tmp_path_factory):
    """Folder of the six units of a case."""
    made = {}

    def export(case):
        if case not in made:
            made[case] = tmp_path_factory.mktemp(case)
            plant, _, words = CASES[case]
            command("export", "fmu", "--plant", plant, *words, "--out", made[case])
        return made[case]

    return export


def extracted(path):
    """The folder of a unit, extracted once: a library that is loaded must not be written again."""
    folder = Path(path).with_suffix("")
    return str(folder) if folder.exists() else fmpy.extract(path, str(folder))


class Instance:
    """An instance of a unit, at the start of its simulation unless parameters are refused; the messages of its errors."""

    def __init__(self, path, **parameters):
        self.description = fmpy.read_model_description(path)
        self.three = self.description.fmiVersion.startswith("3")
        self.references = {variable.name: variable for variable in self.description.modelVariables}
        self.messages, self.time, self.state = [], 0.0, None
        self.fmu = fmpy.instantiate_fmu(extracted(path), self.description, fmi_type="CoSimulation", logger=self.log)
        if not self.three:
            self.fmu.setupExperiment(startTime=0.0)
        self.fmu.enterInitializationMode()
        for name, value in parameters.items():
            self.set(name, value)
        self.fmu.exitInitializationMode()

    def log(self, *arguments):
        self.messages.append(arguments[-1].decode())

    def set(self, name, value):
        variable = self.references[name]
        kind = {"Real": "Real", "Float64": "Float64", "Int32": "Int32", "Integer": "Integer"}.get(
            variable.type, "Int64" if self.three else "Integer"
        )
        getattr(self.fmu, f"set{kind}")([variable.valueReference], [value])

    def get(self, name):
        variable = self.references[name]
        return getattr(self.fmu, f"get{variable.type}")([variable.valueReference])[0]

    def step(self, seconds=TICK_S):
        self.fmu.doStep(currentCommunicationPoint=self.time, communicationStepSize=seconds)
        self.time += seconds

    def run(self, name, values, outputs):
        rows = []
        for value in values:
            self.set(name, value)
            self.step()
            rows.append([self.get(output) for output in outputs])
        return np.array(rows).T


@pytest.mark.parametrize("unit, fmi", UNITS)
@pytest.mark.parametrize("case", CASES)
def test_a_unit_is_valid_and_equal_to_the_tick_to_the_bit(export, case, unit, fmi):
    path = str(export(case) / f"vsj_{unit}.fmi{fmi}.fmu")
    assert validate_fmu(path) == []
    plant, options, _ = CASES[case]
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", vsj.RecordWarning)
        expected = vsj.Controller(plant, **options).run(TARGETS)
    instance = Instance(path)
    if unit == "spring":
        (stiffness,) = instance.run("applied_v", expected.applied_v, ["stiffness_v"])
        np.testing.assert_array_equal(stiffness, expected.stiffness_v)
        return
    code, applied, estimate, limits = instance.run("target_v", TARGETS, ["dac_code", "applied_v", "estimate_v", "limits"])
    np.testing.assert_array_equal(code, expected.code)
    np.testing.assert_array_equal(applied, expected.applied_v)
    np.testing.assert_array_equal(estimate, expected.stiffness_v)
    np.testing.assert_array_equal(limits, expected.limits)
    # The robust controller's lead keeps the amplifier at its slew rate or its range in every tick.
    assert len(np.unique(code)) > 4 and (case == "robust" or len(np.unique(limits)) > 1)
    if unit == "both":
        assert instance.get("stiffness_v") == estimate[-1]


@pytest.mark.parametrize("unit, fmi", UNITS)
@pytest.mark.parametrize("case", CASES)
def test_variables_have_units_ranges_and_the_start_values_of_the_export(export, case, unit, fmi):
    description = fmpy.read_model_description(str(export(case) / f"vsj_{unit}.fmi{fmi}.fmu"))
    variables = {variable.name: variable for variable in description.modelVariables}
    for name, variable in variables.items():
        assert variable.description, name
        ending = name.rstrip("0123456789[]")
        unit_of = "V/s" if ending.endswith("_v_per_s") else {"v": "V", "s": "s", "hz": "Hz"}.get(ending.rsplit("_", 1)[-1])
        assert unit_of is None or variable.unit == unit_of, f"{name} in {variable.unit}"
        if variable.causality in ("parameter", "input"):
            start = float(variable.start)
            assert variable.min is None or float(variable.min) <= start, name
            assert variable.max is None or start <= float(variable.max), name
    assert {unit.name for unit in description.unitDefinitions} >= {"V", "s", "Hz"}
    if unit == "spring":
        return
    _, options, _ = CASES[case]
    start = lambda name: float(variables[name].start)
    names = ["none", "paper", "fast", "robust"]
    assert variables["controller"].start == str(1 + names.index(options["controller"]))
    assert start("limit_v") == options.get("limit_v", 700.0) and start("rate_hz") == 1000.0
    known = options.get("known", {})
    assert [start("known_tau"), start("known_share")] == pytest.approx([known.get(key, 5) / 100 for key in ("tau", "share")])
    if case == "paper":
        assert start("model.relaxation.tau_s[1]") == 5.5 and start("model.relaxation.share") == pytest.approx(1 / 11)


@pytest.mark.parametrize("fmi", [2, 3])
def test_an_importer_simulates_a_unit_with_a_signal(export, fmi):
    """A step of the importer may be several ticks; row k + 1 has the outputs of the step from row k on."""
    path = str(export("paper") / f"vsj_both.fmi{fmi}.fmu")
    times = np.arange(61) * 0.01
    targets = np.repeat([100.0, 350.0, 250.0], [20, 20, 21])
    signal = np.array(list(zip(times, targets)), dtype=[("time", float), ("target_v", float)])
    result = fmpy.simulate_fmu(path, stop_time=0.6, step_size=0.01, output_interval=0.01, input=signal)
    expected = vsj.Controller("paper").run(np.repeat(targets[:60], 10))
    np.testing.assert_array_equal(result["stiffness_v"][1:], expected.stiffness_v[9::10])
    np.testing.assert_array_equal(result["applied_v"][1:], expected.applied_v[9::10])


def test_the_example_of_the_manual_runs(command, tmp_path, monkeypatch):
    """The spring of the example is half as fast as its controller knows."""
    [example] = re.findall(r"```python\n(.*?)```", (ROOT / "docs/export.md").read_text(), re.DOTALL)
    monkeypatch.chdir(tmp_path)
    command("export", "fmu", "--out", tmp_path / "out/fmu")
    names = {}
    exec(example, names)
    last = names["result"][-1]
    assert last["time"] == 10 and abs(last["estimate_v"] - 300) < 10 < last["estimate_v"] - last["stiffness_v"]


@pytest.mark.parametrize("fmi", [2, 3])
def test_parameters_are_those_of_the_command_and_its_plant_file(export, tmp_path, fmi):
    path = str(export("paper") / f"vsj_both.fmi{fmi}.fmu")
    instance = Instance(path, controller=3, limit_v=1000.0, slew_v_per_s=5000.0, dac_bits=16)
    (code,) = instance.run("target_v", TARGETS, ["dac_code"])
    expected = vsj.Controller("paper", "fast", limit_v=1000.0, slew_v_per_s=5000.0, dac_bits=16).run(TARGETS)
    np.testing.assert_array_equal(code, expected.code)
    instance = Instance(path, controller=4, limit_v=1000.0, known_tau=0.1, known_share=0.0, overshoot=0.05)
    (code,) = instance.run("target_v", TARGETS, ["dac_code"])
    known = dict(known={"tau": 10}, overshoot_percent=5)
    np.testing.assert_array_equal(code, vsj.Controller("paper", "robust", limit_v=1000.0, **known).run(TARGETS).code)
    # The spring is half as fast as the controller's model of it.
    instance = Instance(path, **{"spring.relaxation.tau_s[1]": 11.0})
    applied, estimate, stiffness = instance.run("target_v", TARGETS, ["applied_v", "estimate_v", "stiffness_v"])
    slow = tmp_path / "slow.toml"
    slow.write_text(f"schema = 1\n[relaxation]\nshare = {1 / 11}\ntau_s = 11.0\n")
    np.testing.assert_array_equal(estimate, vsj.Controller("paper").run(TARGETS).stiffness_v)
    assert abs(stiffness[149] - vsj.simulate(slow, np.arange(150) * TICK_S, applied[:150])[-1]) < 1e-5
    assert estimate[149] - stiffness[149] > 1.0


@pytest.mark.parametrize("fmi", [2, 3])
def test_every_parameter_beyond_the_range_of_the_description_is_an_error(export, fmi):
    path = str(export("example") / f"vsj_both.fmi{fmi}.fmu")
    tried = 0
    for variable in fmpy.read_model_description(path).modelVariables:
        if variable.causality != "parameter":
            continue
        for bound, side in ((variable.min, -1), (variable.max, 1)):
            # The plant file's slew limit is stricter than any beyond the range.
            if bound is not None and (variable.name, side) != ("slew_v_per_s", 1):
                outside = float(bound) + side * max(1e-3, 0.01 * abs(float(bound)))
                value = outside if variable.type in ("Real", "Float64") else int(bound) + side
                # Only one controller has an approach, and only one a margin.
                with_margin = variable.name.startswith("known_") or variable.name in ("overshoot", "fall_back")
                others = dict(controller=4) if with_margin else dict(controller=3) if variable.name == "approach_s" else {}
                with pytest.raises(FMICallException):
                    Instance(path, **{variable.name: value}, **others)
                    pytest.fail(f"{variable.name} = {value} is accepted")
                tried += 1
    assert tried > 60


@pytest.mark.parametrize("fmi", [2, 3])
def test_errors_have_the_text_of_the_command(command, export, tmp_path, fmi):
    path = str(export("paper") / f"vsj_controller.fmi{fmi}.fmu")

    def refused(**parameters):
        messages = []
        log, Instance.log = Instance.log, lambda self, *arguments: messages.append(arguments[-1].decode())
        try:
            with pytest.raises(FMICallException) as error:
                Instance(path, **parameters)
        finally:
            Instance.log = log
        assert error.value.status == 3
        return messages

    assert refused(limit_v=20000.0) == [command.error("stair", "--limit-v", 20000)]
    assert refused(kp=-1.0) == [command.error("stair", "--kp", -1)]
    bad = tmp_path / "bad.toml"
    bad.write_text("schema = 1\n[relaxation]\nshare = 0.1\ntau_s = -1.0\n")
    of_file = command.error("export", "fmu", "--plant", bad).split(": ", 1)[1]
    (of_unit,) = refused(**{"model.relaxation.tau_s[1]": -1.0})
    assert of_unit == f"model.relaxation.{of_file}" and of_file.startswith("tau_s = -1 is not allowed: expected ")


@pytest.mark.parametrize("fmi", [2, 3])
def test_a_step_is_a_whole_number_of_ticks_wherever_rounding_puts_its_ends(export, fmi):
    path = str(export("paper") / f"vsj_controller.fmi{fmi}.fmu")
    instance = Instance(path)
    instance.set("target_v", 300.0)
    for work, words in (
        (lambda: instance.step(0.0015), "a step of 0.0015 s is 1.5 ticks: expected a whole number of ticks of 0.001 s"),
        (lambda: instance.step(0.0), "a step of 0 s is 0 ticks: expected a whole number of ticks of 0.001 s"),
        (lambda: instance.set("limit_v", 500.0), "limit_v is set in the middle of a simulation: "),
        (lambda: instance.set("applied_v", 500.0), "applied_v is set: expected an input or a parameter"),
    ):
        with pytest.raises(FMICallException):
            work()
        assert instance.messages[-1].startswith(words)
    # Sums of 0.007 s are not multiples of the tick.
    for _ in range(100):
        instance.step(0.007)
    expected = vsj.Controller("paper").run(np.full(700, 300.0))
    assert (instance.get("dac_code"), instance.get("estimate_v")) == (expected.code[-1], expected.stiffness_v[-1])
    instance.time = 1.2
    with pytest.raises(FMICallException):
        instance.step()
    assert instance.messages[-1] == "a step begins at 1.2 s: expected 0.7 s, where the last one has ended"
    instance.time = 0.7
    instance.set("target_v", np.nan)
    with pytest.raises(FMICallException):
        instance.step()
    assert instance.messages[-1] == "target_v: voltage_v = NaN is not allowed: expected -2000 to 2000 V"


@pytest.mark.parametrize("fmi", [2, 3])
def test_a_state_is_saved_and_restored_and_reset_begins_anew(export, fmi):
    instance = Instance(str(export("example") / f"vsj_both.fmi{fmi}.fmu"))
    get, put, free = (getattr(instance.fmu, f"{verb}FMU{'State' if fmi == 3 else 'state'}") for verb in ("get", "set", "free"))
    outputs = ["dac_code", "stiffness_v"]
    first = instance.run("target_v", TARGETS[:200], outputs)
    state, time = get(), instance.time
    second = instance.run("target_v", TARGETS[200:300], outputs)
    instance.run("target_v", [700.0] * 50, outputs)
    put(state)
    free(state)
    instance.time = time
    np.testing.assert_array_equal(instance.run("target_v", TARGETS[200:300], outputs), second)
    instance.fmu.reset()
    if fmi == 2:
        instance.fmu.setupExperiment(startTime=0.0)
    instance.fmu.enterInitializationMode()
    instance.fmu.exitInitializationMode()
    instance.time = 0.0
    np.testing.assert_array_equal(instance.run("target_v", TARGETS[:200], outputs), first)


@pytest.mark.parametrize("fmi", [2, 3])
def test_an_importer_that_begins_twice_is_refused(export, fmi):
    instance = Instance(str(export("paper") / f"vsj_spring.fmi{fmi}.fmu"))
    instance.set("applied_v", 300.0)
    instance.step()
    begun = instance.get("stiffness_v")
    calls = [instance.fmu.enterInitializationMode, instance.fmu.exitInitializationMode]
    for call in calls if fmi == 3 else [lambda: instance.fmu.setupExperiment(startTime=0.0), *calls]:
        with pytest.raises(FMICallException) as error:
            call()
        assert error.value.status == 3
        assert " in the middle of a simulation: expected " in instance.messages[-1]
    instance.step()
    assert instance.get("stiffness_v") > begun > 0.0
    instance.fmu.terminate()
    with pytest.raises(FMICallException):
        instance.step()
    assert instance.messages[-1].startswith("a step after the end of the simulation: expected ")


@pytest.mark.parametrize("fmi", [2, 3])
def test_a_damaged_unit_is_refused_with_the_reason(export, tmp_path, fmi):
    path = export("paper") / f"vsj_spring.fmi{fmi}.fmu"
    for number, (text, reason) in enumerate((
        ("schema = 1\n[relaxation]\nshare = 2\ntau_s = 1\n", "plant.toml, line 3, column 9: share = 2 is not allowed: "),
        ("schema = 1\n[relaxation]\nshare = 0.2\ntau_s = 1\n", "the unit's token is "),
    )):
        folder = tmp_path / f"unit{number}"
        fmpy.extract(str(path), str(folder))
        (folder / "resources/plant.toml").write_text(text)
        messages = []
        with pytest.raises(Exception):
            fmpy.instantiate_fmu(
                str(folder),
                fmpy.read_model_description(str(path)),
                fmi_type="CoSimulation",
                logger=lambda *arguments: messages.append(arguments[-1].decode()),
            )
        assert len(messages) == 1 and reason in messages[0], messages


def test_the_same_export_is_the_same_bytes_and_bad_input_is_named(command, export, tmp_path):
    answer = json.loads(command("export", "fmu", "--unit", "both", "--fmi", 3, "--out", tmp_path, "--json"))
    (unit,) = answer["units"]
    assert (unit["unit"], unit["fmi"], answer["tick_s"]) == ("both", 3, TICK_S)
    assert (tmp_path / unit["file"]).read_bytes() == (export("paper") / unit["file"]).read_bytes()
    with zipfile.ZipFile(tmp_path / unit["file"]) as archive:
        assert "resources/plant.toml" in archive.namelist()
    built = Path(command.path).parent / "deps/libvsj_fmu.so"
    no_library = tmp_path / "library.so"
    no_library.write_bytes(b"\x7fELF")
    for words, expected in (
        (["--library", no_library], "library.so: expected the shared library of the package fmu, for x86_64 or aarch64 "),
        (["--library", built, "--library", built], ": a second one for "),
        (["--plant", "no.toml"], "no.toml: cannot be read: "),
        (["--kp", 0], "--kp: proportional_gain = 0 is not allowed: "),
        (["--approach-s", 0.1], "--approach-s applies to the fast controller only: "),
    ):
        assert expected in command.error("export", "fmu", *words, "--out", tmp_path / "none")
    assert not (tmp_path / "none").exists()
