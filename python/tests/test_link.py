"""The client of the link: its errors without a board, and the emulated board of `cargo xtask clients`."""

import gc
import os
import re
import signal
import socket
import threading
import time
from collections import Counter

import pytest
import vsj

from conftest import ROOT


@pytest.fixture(autouse=True)
def interrupts():
    """Ctrl-C raises KeyboardInterrupt, also where a shell has started the tests in the background, which ignores it."""
    before = signal.signal(signal.SIGINT, signal.default_int_handler)
    yield
    signal.signal(signal.SIGINT, before)


@pytest.fixture
def board():
    port = os.environ.get("VSJ_BOARD")
    if port is None:
        pytest.skip("no board; cargo xtask clients starts one")
    return port


@pytest.fixture
def board_with_bank():
    port = os.environ.get("VSJ_BOARD_WITH_BANK")
    if port is None:
        pytest.skip("no board with an isolation bank; cargo xtask clients starts one")
    return port


# Codes of requests, see docs/link.md.
HELLO, STATUS, SET, ARM, DISARM, HEARTBEAT, STREAM, HEARD = 0, 1, 2, 3, 4, 6, 7, 12


def checksum(data):
    crc = 0xFFFFFFFF
    for byte in data:
        crc ^= byte
        for _ in range(8):
            crc = crc >> 1 ^ (0x82F63B78 if crc & 1 else 0)
    return (crc ^ 0xFFFFFFFF).to_bytes(4, "little")


def frame(sequence, message):
    packet = b"\x05A" + sequence + message + (1).to_bytes(4, "little")
    blocks = (packet + checksum(packet)).split(b"\0")
    return b"\0" + b"".join(bytes([len(block) + 1]) + block for block in blocks) + b"\0"


def number(value):
    return bytes([value & 0x7F | 0x80]) + number(value >> 7) if value > 0x7F else bytes([value])


def unstuffed(encoded):
    blocks = []
    while encoded:
        blocks.append(encoded[1 : encoded[0]])
        encoded = encoded[encoded[0] :]
    return b"\0".join(blocks)


class Mcu:
    """An MCU within the test, which does what no healthy board does."""

    def __init__(self, folder):
        self.asked = Counter()
        #: What is sent ahead of the answer to the next request with this code.
        self.ahead = {}
        #: Longest silence in ticks of 1 ms.
        self.silence = number(60_000)
        #: Called with the code of a request; its answer is lost unless it is true.
        self.answers = lambda code: True
        #: Whether each request is refused as of another session.
        self.refuses = False
        self.port = f"unix:{folder}/mcu"
        self._listener = socket.socket(socket.AF_UNIX)
        self._listener.bind(f"{folder}/mcu")
        self._listener.listen()
        self._thread = threading.Thread(target=self._serve)
        self._thread.start()

    def _serve(self):
        connection, _ = self._listener.accept()
        buffer = b""
        with connection, self._listener:
            while received := connection.recv(4096):
                *frames, buffer = (buffer + received).split(b"\0")
                for packet in map(unstuffed, filter(None, frames)):
                    code = packet[4]
                    self.asked[code] += 1
                    if self.answers(code):
                        connection.sendall(self.ahead.pop(code, b"") + frame(packet[2:4], self._reply(code)))

    def _reply(self, code):
        if code in (HELLO, STATUS):
            return b"\2\0\1\0\0\0" + number(1000) + self.silence + bytes(23)
        if self.refuses:
            return b"\1\x12"
        # What came later than the first MCUs is unknown to this one.
        return bytes(3) if code < 18 else b"\1\7"

    def wait_for(self, code, count):
        begin = time.monotonic()
        while self.asked[code] < count:
            assert time.monotonic() - begin < 30, self.asked
            time.sleep(0.005)

    def ended(self):
        self._thread.join(30)
        assert not self._thread.is_alive()
        return self.asked


@pytest.fixture
def mcu(tmp_path):
    return Mcu(tmp_path)


def test_ctrl_c_ends_a_call_that_waits_for_an_answer_and_the_output_is_disabled(mcu):
    def answers(code):
        # The third time that the request is sent.
        if code == ARM and mcu.asked[ARM] == 3:
            os.kill(os.getpid(), signal.SIGINT)
        return code != ARM

    with pytest.raises(KeyboardInterrupt):
        with vsj.Link(mcu.port, timeout=25) as link:
            mcu.answers = answers
            link.arm()
    assert mcu.asked[ARM] < 100 and mcu.ended()[DISARM] > 0


def test_ctrl_c_ends_a_call_also_while_a_heartbeat_waits_for_its_answer(mcu):
    mcu.silence = number(1000)
    link = vsj.Link(mcu.port, timeout=25)
    mcu.answers = lambda code: False
    mcu.wait_for(HEARTBEAT, 1)
    begin = time.monotonic()
    with pytest.warns(RuntimeWarning, match="not disarmed: no answer to 5 requests"), pytest.raises(KeyboardInterrupt):
        with link:
            threading.Timer(0.1, os.kill, (os.getpid(), signal.SIGINT)).start()
            link.arm()
    assert time.monotonic() - begin < 10
    assert mcu.ended()[DISARM] == 5


def test_closing_a_link_warns_of_an_output_that_may_be_enabled(mcu):
    link = vsj.Link(mcu.port, timeout=25)
    mcu.answers = lambda code: False
    with pytest.warns(RuntimeWarning, match="not disarmed: no answer to 5 requests"):
        link.close()
    mcu.ended()


def test_a_fault_is_reported_once_and_the_mcu_hears_of_its_receipt(mcu):
    with vsj.Link(mcu.port, timeout=25) as link:
        mcu.ahead[ARM] = 2 * frame(bytes(2), bytes([5, 1, 7, 4, 0b1000, 0]))
        link.arm()
        [fault] = link.faults()
        assert (fault["fault"], fault["fault_code"], fault["tick"], fault["time_s"]) == ("interlock", 4, 7, 0.007)
        assert fault["standing"] == ["interlock"] and link.faults() == []
    assert mcu.ended()[HEARD] == 1


def test_the_output_of_another_program_is_left_and_one_that_may_be_enabled_is_an_error(mcu, tmp_path):
    with vsj.Link(mcu.port, timeout=25):
        mcu.refuses = True
    assert mcu.ended()[DISARM] == 0
    mute = Mcu(tmp_path / "..")
    with pytest.raises(vsj.LinkError, match="not disarmed: no answer to 5 requests.* ramps its voltage down by itself 60 s"):
        with vsj.Link(mute.port, timeout=25):
            mute.answers = lambda code: False
    assert mute.ended()[DISARM] == 5


def test_the_heartbeats_follow_a_silence_limit_that_has_become_shorter(mcu):
    with vsj.Link(mcu.port, timeout=25) as link:
        # With the first limit they would take a minute.
        mcu.silence = number(20)
        link.status()
        mcu.wait_for(HEARTBEAT, 60)
    mcu.ended()


def test_the_oldest_samples_that_nobody_takes_are_dropped_and_counted(mcu):
    with vsj.Link(mcu.port, timeout=25) as link:
        mcu.ahead[ARM] = frame(bytes(2), b"\x03" + bytes(10)) * (65_536 + 3)
        link.arm()
        assert link.dropped_samples() == 3
    mcu.ended()


def test_a_port_that_is_none_is_bad_input_with_the_words_of_the_command(command):
    port = "unix:/nonexistent/link"
    with pytest.raises(vsj.BadInput) as raised:
        vsj.Link(port)
    assert str(raised.value) == command.error("link", port, "status")
    with pytest.raises(vsj.BadInput, match="timeout 0: expected a positive number of seconds"):
        vsj.Link(port, timeout=0)


def test_what_is_no_number_is_bad_input_that_names_it(mcu):
    for options in ({"baud": "fast"}, {"baud": None}, {"baud": 9600.5}, {"baud": -1}, {"timeout": "long"}, {"port": None}):
        [name] = options
        with pytest.raises(vsj.BadInput, match=f"^{name}: .*; expected a "):
            vsj.Link(**({"port": "unix:/nonexistent/link"} | options))
    with vsj.Link(mcu.port, timeout=25) as link:
        for name, call in (
            ("value", lambda: link.set("x")),
            ("value", lambda: link.set(None)),
            ("unit", lambda: link.set(1, None)),
            ("rate_hz", lambda: next(link.watch(rate_hz=None))),
            ("seconds", lambda: next(link.watch(seconds="x"))),
            ("seconds", lambda: link.record(seconds="x")),
            ("seconds", lambda: link.record(seconds="x", schedule=[(0, 0), (1, 0)])),
            ("schedule", lambda: link.record(schedule=[("x", 0), (1, 0)])),
            ("file", lambda: link.settings(7)),
        ):
            with pytest.raises(vsj.BadInput, match=f"^{name}: .*; expected "):
                call()
    mcu.ended()


@pytest.mark.parametrize("seconds, length_s", [(None, 0.4), (0.1, 0.4), (0.6, 0.6)])
def test_a_recording_ends_with_the_schedule_unless_it_is_longer(mcu, seconds, length_s):
    with vsj.Link(mcu.port, timeout=25) as link:
        begin = time.monotonic()
        link.record(schedule=[(0, 0), (0.2, 0), (0.4, 0)], seconds=seconds)
        assert length_s <= time.monotonic() - begin < length_s + 5
        with pytest.raises(vsj.BadInput, match="seconds -1: expected a positive number"):
            link.record(schedule=[(0, 0), (0.2, 0)], seconds=-1)
        with pytest.raises(vsj.BadInput, match="rate_hz 0: expected 0.02 to 10000"):
            link.record(seconds=1, rate_hz=0)
    # The last row of a schedule is a target only if something follows.
    assert mcu.ended()[SET] >= 2


@pytest.mark.filterwarnings("error::pytest.PytestUnraisableExceptionWarning")
def test_an_iterator_may_outlive_its_link(mcu):
    mcu.ahead[STREAM] = frame(bytes(2), b"\x03" + bytes(10))
    with vsj.Link(mcu.port, timeout=25) as link:
        samples = link.watch()
        assert next(samples).tick == 0
    mcu.ended()
    del samples
    gc.collect()


def test_the_link_arms_sets_watches_and_disarms(board):
    with vsj.Link(board, timeout=5) as link:
        assert link.status()["sample"]["state"] == "disarmed"
        assert (link.arm(), link.set(300)) == ("armed", 300.0)
        # Longer than the MCU allows its host to be silent.
        time.sleep(1.2 * link.status()["silence_limit_s"])
        samples = list(link.watch(rate_hz=50, seconds=0.5))
        assert {sample.state for sample in samples} == {"armed"}
        # Up to half a period is jitter, not a loss.
        assert all(10 < after.tick - before.tick < 30 for before, after in zip(samples, samples[1:]))
        assert samples[-1].target_v == 300.0 and samples[-1].applied_v > 300
        assert link.faults() == []
    with vsj.Link(board, timeout=5) as link:
        assert link.status()["sample"]["state"] == "disarmed"
        with pytest.raises(vsj.LinkError, match="refused: not armed"):
            link.set(10)
    with pytest.raises(vsj.LinkError, match="the link is closed"):
        link.status()


def test_the_board_names_the_revision_of_the_command(board, command):
    version, revision = re.fullmatch(r"vsj (\S+) \((\w+)\)\n", command("--version")).groups()
    with vsj.Link(board, timeout=5) as link:
        named = "" if revision == "unknown" else f" ({revision[:8]})"
        assert link.status()["firmware"] == version + named


def test_the_example_of_the_manual_runs(board, capsys):
    """The last line is for a board with a sensor; without one it is refused."""
    [example] = re.findall(r"```python\n(.*?)```", (ROOT / "docs/clients.md").read_text(), re.DOTALL)
    session, diagnosis = example.replace("/dev/ttyACM0", board).split("\n\nprint(")
    names = {}
    exec(session, names)
    assert len(capsys.readouterr().out.splitlines()) > 100
    assert names["record"].time_s.iloc[-1] == pytest.approx(15, abs=0.1)
    with pytest.raises(vsj.BadInput, match="the controller's own estimate"):
        exec(f"print({diagnosis}", names)


def test_a_schedule_is_recorded_from_its_first_row_on(board):
    with vsj.Link(board, timeout=5) as link:
        link.arm()
        for _ in link.watch(rate_hz=100, seconds=0.1):
            pass
        frame = link.record(schedule=[(0, 200), (0.2, 0), (0.4, 0)])
        assert list(frame.columns) == ["time_s", "voltage_v", "estimate"]
        assert frame.time_s[0] == 0 and frame.time_s.diff().max() < 0.015
        assert frame.voltage_v.max() > 200 and frame.voltage_v.iloc[-1] < 200
        # The last row is the end, not a target.
        link.record(schedule=[(0, 150), (0.1, 300)])
        assert link.status()["sample"]["target_v"] == 150
        with pytest.raises(vsj.BadInput, match="the controller's own estimate"):
            vsj.identify(frame)


def test_a_recording_ends_with_an_error_when_the_output_is_disabled(board):
    with vsj.Link(board, timeout=5) as link:
        link.arm()
        threading.Timer(0.5, link.disarm).start()
        with pytest.raises(vsj.LinkError, match="no longer armed: the MCU is disarmed"):
            link.record(schedule=[(0, 100), (60, 0)])
        link.arm()
        with pytest.raises(vsj.BadInput, match="expected 0 to 700 V"):
            link.record(schedule=[(0, 100), (1, 5000), (2, 0)])


@pytest.mark.parametrize("end", [vsj.Link.close, lambda link: None], ids=["closed", "deleted"])
def test_the_output_is_disabled_when_the_link_ends(board, end):
    link = vsj.Link(board, timeout=5)
    link.arm()
    link.set(300)
    end(link)
    del link
    # Sooner than the silence limit of 1 s, after which the MCU would ramp down by itself.
    time.sleep(0.3)
    with vsj.Link(board, timeout=5) as link:
        assert link.status()["sample"]["state"] == "disarmed"


def test_errors_of_requests_have_the_words_of_the_command(board, command):
    with vsj.Link(board, timeout=5) as link:
        link.arm()
        for value, unit in [(5000, "V"), (1e12, "Pa")]:
            with pytest.raises(vsj.BadInput, match=f"out of range: expected .* {unit}$"):
                link.set(value, unit)
        with pytest.raises(vsj.BadInput, match="expected V, Pa or N/m"):
            link.set(1, "mm")
        for options, words in (
            ({}, "neither seconds nor a schedule"),
            ({"seconds": float("nan")}, "seconds nan: expected a positive number"),
            ({"schedule": [(0, 1), (0, 2)]}, "times that do not increase"),
            ({"schedule": [(0, 1), (1, float("nan"))]}, "not finite"),
            ({"schedule": [0, 1, 2]}, r"schedule: shape \(3,\)"),
        ):
            with pytest.raises(vsj.BadInput, match=words):
                link.record(**options)
        with pytest.raises(vsj.BadInput) as raised:
            link.acknowledge("nonsense")
        assert str(raised.value) == command.error("link", "unix:none", "acknowledge", "nonsense")


def test_model_and_settings_are_sent_checked_and_run(board, tmp_path):
    settings = tmp_path / "settings.toml"
    settings.write_text("schema = 1\n[gains]\nproportional = 3.5\n")
    with vsj.Link(board, timeout=5) as link:
        assert link.model()["active"]["number"] == 0
        late = tmp_path / "late.toml"
        late.write_text("schema = 1\n[relaxation]\nshare = 0.1\ntau_s = [5.0]\n[amplifier]\ndelay_s = 0.01\n")
        with pytest.warns(vsj.RecordWarning, match="not run by the MCU: amplifier.delay_s"):
            assert link.model(late)["active"]["number"] == 1
        assert "proportional = 3.5" in link.settings(settings)["toml"]
        settings.write_text("schema = 1\n[gains]\nproportional = 1e9\n")
        with pytest.raises(vsj.BadInput, match="proportional"):
            link.settings(settings)
        assert link.status()["sample"]["state"] == "disarmed"


def test_the_verdict_of_the_isolation_bank_comes_with_the_telemetry(board_with_bank):
    with vsj.Link(board_with_bank, timeout=5) as link:
        samples = list(link.watch(rate_hz=50, seconds=1))
    # A board at rest gives the bank nothing to name.
    said = samples[-1].isolation
    assert (said.verdict, said.why, said.cause, said.size) == ("quiet", None, None, None)
    assert {said} == {sample.isolation for sample in samples[20:]}


def test_a_verdict_has_size_and_interval_of_its_cause():
    row = {"verdict": "named", "cause": "drift", "other": None, "since_s": 2.5, "explained": 0.99, "why": None}
    size = {"value": 0.5, "low": 0.25, "high": 0.75, "unit": "1/s"}
    said = vsj.Isolation._of({**row, "time_s": 3.0, "size": size, "trip_on_cause": []})
    assert said == vsj.Isolation(**row, size=0.5, low=0.25, high=0.75, unit="1/s")
    assert vsj.Isolation._of(None) is None
