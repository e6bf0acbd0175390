"""The plain tick of `model`, in integers: one definition for two kinds of numbers.

`theorems.py` runs it on unknowns of a solver, `differential.py` on arrays, which it compares with what the Rust code puts out.
All values are the bits of the fixed-point numbers of `model/src/units.rs` and `model/src/coefficient.rs`: a signal has 20
fraction bits in 32, an accumulator 52 in 64. The order of the operations is that of `Config::tick` in
`model/src/controller.rs`.

`numbers` provides the operations that may overflow or are not linear:

- `sum(name, a, b, bits)`: `a + b`, which must fit `bits` bits.
- `saturated(a)`: `a`, moved to the ends of 32 bits.
- `product(name, a, b, bits)`: `a * b`, which must fit `bits` bits.
- `gain(name, gain, x)`: the products of `x` with the integer, which must fit 32 bits, and with the remainder of a gain.
- `rate(name, rate, x)`: the products of `x` with the upper and the lower half of a rate.
- `floor(a, bits)`: `a / 2^bits`, rounded down; `low_bits(a, bits)`: what that drops.
- `largest(a, b)`, `smallest(a, b)`.
"""

from types import SimpleNamespace


def times(numbers, name, gain, x):
    """`Gain::times`: a signal times a gain, rounded down."""
    by_integer, by_remainder = numbers.gain(name, gain, x)
    return numbers.sum(name, by_integer, numbers.floor(by_remainder, 32), 32)


def step(numbers, name, rate, lag):
    """`Rate::step`: what one tick adds to an accumulator."""
    by_high, by_low = numbers.rate(name, rate, lag)
    return numbers.sum(name, by_high, numbers.floor(by_low, 32), 64)


def code_of(numbers, name, config, voltage):
    """`amplifier::Config::code`: the code nearest to a voltage; its conversion to 16 bits drops nothing."""
    codes = numbers.floor(numbers.product(f"{name}: voltage in codes", config.codes_per_volt, voltage, 64), 32)
    return numbers.fits(name, numbers.floor(numbers.sum(name, codes, 128, 32), 8), 16)


def volts_of(numbers, name, config, code):
    """`amplifier::Config::volts`: the voltage of a code."""
    return numbers.floor(numbers.product(f"{name}: code in volts", config.volts_per_code, code, 64), 9)


def wanted_voltage(numbers, config, state, target):
    """`ProportionalIntegral::voltage`; the operating point of the plain spring is its relaxed part."""
    relaxed = numbers.floor(state.relaxed, 32)
    error = numbers.sum("error", target, -relaxed, 32)
    limited = numbers.smallest(numbers.largest(error, -config.largest_error), config.largest_error)
    without_integrator = numbers.sum(
        "without integrator",
        times(numbers, "operating point gain", config.operating_point_gain, relaxed),
        times(numbers, "error gain", config.error_gain, limited),
        32,
    )
    return numbers.saturated(numbers.floor(state.integrator, 32) + without_integrator)


def tick(numbers, config, state, target):
    """`Config::tick` without a sensor: returns the output and the next state."""
    target = numbers.smallest(numbers.largest(target, config.lowest), config.highest)
    wanted = wanted_voltage(numbers, config, state, target) if config.has_gains else target

    # The amplifier: slew, range, code.
    slew = numbers.sum("slew", config.step, state.carried, 64)
    carried, change = numbers.low_bits(slew, 32), numbers.floor(slew, 32)
    lowest = numbers.sum("slew down", state.voltage, -change, 32)
    highest = numbers.sum("slew up", state.voltage, change, 32)
    slewed = numbers.smallest(numbers.largest(wanted, lowest), highest)
    voltage = numbers.smallest(numbers.largest(slewed, config.lowest), config.highest)
    code = code_of(numbers, "code", config, voltage)
    applied = volts_of(numbers, "applied", config, code)

    # The estimator.
    relaxed = numbers.floor(state.relaxed, 32)
    lag = numbers.sum("lag", applied, -relaxed, 32)
    stiffness = numbers.sum("stiffness", relaxed, times(numbers, "share", config.share, lag), 32)
    next_relaxed = numbers.sum("relaxed", state.relaxed, step(numbers, "relaxation", config.relaxation, lag), 64)

    # The integrator.
    integrator = state.integrator
    if config.has_gains:
        driven = times(numbers, "integrator gain", config.integrator_gain, voltage)
        distance = numbers.saturated(driven - numbers.floor(integrator, 32))
        integrator = numbers.sum("integrator", integrator, step(numbers, "reset", config.reset, distance), 64)

    output = SimpleNamespace(
        target=target,
        wanted=wanted,
        change=change,
        slewed=slewed,
        voltage=voltage,
        code=code,
        applied=applied,
        stiffness=stiffness,
    )
    following = SimpleNamespace(relaxed=next_relaxed, integrator=integrator, voltage=voltage, carried=carried)
    return output, following
