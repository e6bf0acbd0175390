"""Compares the tick that `theorems.py` reasons about with the one that the MCU runs.

Reads what `cargo run -p vsj-model --example trace` prints, from a file or a pipe: random configurations, each with its numbers and with
what it puts out under random targets. Each output must be that of `tick.py`, each configuration must be as the theorems assume.

Usage: differential.py TICKS_PER_CONFIGURATION < TRACE. Exit codes: 0 all agree, 1 something differs.
"""

import re
import sys
from fractions import Fraction
from types import SimpleNamespace

import numpy as np

from theorems import MOST, MOST_ACTION, assumptions
from tick import code_of, tick, volts_of

# Numbers of one tick of the trace.
OUTPUT = ["target", "code", "applied", "voltage", "stiffness", "limits"]
UPPER, LOWER, TARGET = 1, 2, 8
# Configurations that are run side by side.
BATCH = 2000


class Arrays:
    """The operations of `tick.py` on arrays of 64-bit integers, one element for each configuration."""

    def fits(self, name, value, width):
        low, high = (0, 65535) if width == 16 else (-(1 << (width - 1)), (1 << (width - 1)) - 1)
        if width < 64:
            assert ((low <= value) & (value <= high)).all(), f"{name} does not fit {width} bits"
        return value

    def sum(self, name, a, b, width):
        total = a + b
        if width == 64:
            assert ((total >= a) == (b >= 0)).all(), f"{name} does not fit 64 bits"
        return self.fits(name, total, width)

    def saturated(self, a):
        return np.clip(a, -(1 << 31), (1 << 31) - 1)

    def product(self, name, factor, x, width):
        return self.fits(name, factor * x, width)

    def gain(self, name, factor, x):
        whole, part = factor
        return self.fits(name, whole * x, 32), part * x

    def rate(self, name, factor, x):
        high, low = factor
        return high * x, low * x

    def floor(self, a, width):
        return a >> width

    def low_bits(self, a, width):
        return a & ((1 << width) - 1)

    def largest(self, a, b):
        return np.maximum(a, b)

    def smallest(self, a, b):
        return np.minimum(a, b)


def number(text, name, fraction_bits):
    """The bits of a fixed-point number that a configuration's line names."""
    found = re.search(rf"\b{name}: (-?[0-9.]+)", text)
    assert found, f"no {name} in {text}"
    return round(Fraction(found[1]) * (1 << fraction_bits))


def gain(text, name):
    found = re.search(rf"\b{name}: Gain {{ (.*?) }}", text)
    return number(found[1], "integer", 0), number(found[1], "remainder", 32)


def rate(text, name):
    found = re.search(rf"\b{name}: Rate {{ (.*?) }}", text)
    return number(found[1], "high", 32), number(found[1], "low", 0)


def parse(line):
    """A configuration from the line that Rust prints for it."""
    has_gains = "ProportionalIntegral" in line
    config = SimpleNamespace(
        has_gains=has_gains,
        share=gain(line, "share"),
        relaxation=rate(line, "relaxation"),
        lowest=number(line, "lowest", 20),
        highest=number(line, "highest", 20),
        slew_limit=int(re.search(r"slew: Limits\((\d+)\)", line)[1]),
        step=number(line, "step", 52),
        codes_per_volt=number(line, "codes_per_volt", 20),
        volts_per_code=number(line, "volts_per_code", 29),
        largest_error=number(line, "largest_error", 20) if has_gains else 0,
    )
    for name in ["error_gain", "operating_point_gain", "integrator_gain"]:
        setattr(config, name, gain(line, name) if has_gains else (0, 0))
    config.reset = rate(line, "reset") if has_gains else (0, 0)
    return config


def check(config):
    """The assumptions of the theorems."""
    exact = Arrays()
    one = np.array([config.lowest, config.highest])
    codes = code_of(exact, "end", config, one)
    config.lowest_code, config.highest_code = map(int, codes)
    assert (volts_of(exact, "end", config, codes) == one).all(), f"the ends of the range are no codes: {config}"
    for name, holds in assumptions(config):
        assert holds, f"{name}: {config}"
    values = {name: value[0] * (1 << 32) + value[1] for name, value in vars(config).items() if isinstance(value, tuple)}
    values |= {"codes_per_volt": config.codes_per_volt, "volts_per_code": config.volts_per_code}
    for name, most in MOST.items():
        assert 0 <= values[name] <= most, f"{name} = {values[name]}: {config}"
    assert values["error_gain"] * config.largest_error <= MOST_ACTION << 32, f"action: {config}"


def compare(configs, outputs):
    """Runs configurations of one kind side by side over their targets; `outputs` is (configuration, tick, number)."""
    numbers, size = Arrays(), len(configs)
    column = lambda name: np.array([getattr(config, name) for config in configs], dtype=np.int64)
    pair = lambda name: tuple(np.array([getattr(c, name)[half] for c in configs], dtype=np.int64) for half in (0, 1))
    config = SimpleNamespace(has_gains=configs[0].has_gains)
    for name, value in vars(configs[0]).items():
        if name != "has_gains":
            setattr(config, name, pair(name) if isinstance(value, tuple) else column(name))
    zeros = np.zeros(size, dtype=np.int64)
    state = SimpleNamespace(relaxed=zeros, integrator=zeros, voltage=zeros, carried=zeros)
    for index in range(outputs.shape[1]):
        expected = dict(zip(OUTPUT, outputs[:, index, :].astype(np.int64).T))
        found, state = tick(numbers, config, state, expected["target"])
        for name in ["code", "applied", "voltage", "stiffness"]:
            differs = np.flatnonzero(getattr(found, name) != expected[name])
            assert not differs.size, f"tick {index}, {name}: {configs[differs[0]]}"
        limits = UPPER * (found.slewed > config.highest) + LOWER * (found.slewed < config.lowest)
        limits += config.slew_limit * (found.slewed != found.wanted) + TARGET * (found.target != expected["target"])
        assert (limits == expected["limits"]).all(), f"tick {index}: the limits differ"
    return size * outputs.shape[1]


def main(ticks):
    stream, compared, configurations = sys.stdin.buffer, 0, 0
    size = ticks * len(OUTPUT) * 4
    while True:
        kinds = {True: ([], []), False: ([], [])}
        for _ in range(BATCH):
            line = stream.readline()
            if not line:
                break
            config = parse(line.decode())
            check(config)
            rows = np.frombuffer(stream.read(size), dtype="<i4").reshape(ticks, len(OUTPUT))
            configs, outputs = kinds[config.has_gains]
            configs.append(config)
            outputs.append(rows)
        for configs, outputs in kinds.values():
            if configs:
                compared += compare(configs, np.stack(outputs))
                configurations += len(configs)
        if not line:
            break
    assert configurations, "no configurations; expected those of `cargo run -p vsj-model --example trace`"
    print(f"{compared} ticks of {configurations} random configurations agree, and are as the theorems assume")


if __name__ == "__main__":
    try:
        main(int(sys.argv[1]))
    except AssertionError as error:
        sys.exit(f"error: {error}")
