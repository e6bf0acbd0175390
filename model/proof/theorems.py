"""What holds for the plain tick with every accepted setting, in every reachable state and for every input.

One inductive step: from any state in the invariant and for any target of 32 bits, one tick of `tick.py` overflows nowhere, stays in
the invariant, and its output keeps the promises at the end of `inductive_step`. The unknowns are integers without a bound on their
size; that each result fits its 32 or 64 bits is one of the claims. A product of two unknowns is an unknown of which only bounds and
monotony are known, so that every claim is one of linear arithmetic. What is assumed of a configuration is in `assumptions`;
`differential.py` checks it for random settings, and `round_trip` proves the part about codes for all.

Usage: theorems.py [-v]. Exit codes: 0 everything is proved, 1 something is not.
"""

import sys
from types import SimpleNamespace

import z3

from tick import code_of, tick, volts_of

VOLT = 1 << 20
# Ends of the accepted settings, in bits: 1000 V, and 1 V more for a slew that is never reached.
MOST_V = 1000 * VOLT
MOST_STEP = 1001 << 52
# 65535 codes over 50 V in 20 fraction bits, and 1000 V over 255 codes in 29, rounded up.
MOST_CODES_PER_VOLT = 65535 * VOLT // 50 + 1
MOST_VOLTS_PER_CODE = 1000 * (1 << 29) // 255 + 1
MOST_CODE = 65535
# The proportional action is limited to 1024 V, up to the rounding of gain and limit.
MOST_ACTION = 1025 * VOLT
# A gain of one, a share of 0.9 and more, a gain of 1000, a rate of one half, in 32 and 64 fraction bits.
ONE = 1 << 32
THOUSAND = 1000 << 32
HALF = 1 << 63
# Time for one claim, in ms: each takes less than a tenth of it.
TIMEOUT_MS = 60_000


class Factor:
    """An unknown factor, not negative, of which the largest value is known; `limit` is `(x, y)`: times `x` it is at most `y`."""

    def __init__(self, most, limit=None):
        self.most, self.limit, self.products = most, limit, []


class Unknowns:
    """The operations of `tick.py` on unknown integers. Collects facts and claims in their order."""

    def __init__(self):
        self.log = []
        self.serial = 0
        self.assumes = False

    def unknown(self, name):
        self.serial += 1
        return z3.Int(f"{name} {self.serial}")

    def fact(self, *facts):
        self.log += [(None, fact) for fact in facts]

    def claim(self, name, statement):
        self.log.append((None if self.assumes else name, statement))

    def fits(self, name, value, width):
        low, high = (0, 65535) if width == 16 else (-(1 << (width - 1)), (1 << (width - 1)) - 1)
        self.claim(f"{name} fits {width} bits", z3.And(low <= value, value <= high))
        return value

    def sum(self, name, a, b, width):
        return self.fits(name, a + b, width)

    def saturated(self, a):
        return self.smallest(self.largest(a, -(1 << 31)), (1 << 31) - 1)

    def floor(self, a, width):
        quotient, rest = self.unknown("quotient"), self.unknown("rest")
        self.fact(a == quotient * (1 << width) + rest, 0 <= rest, rest < 1 << width)
        return quotient

    def low_bits(self, a, width):
        return a - self.floor(a, width) * (1 << width)

    def largest(self, a, b):
        return self.named("larger", z3.If(a >= b, a, b))

    def smallest(self, a, b):
        return self.named("smaller", z3.If(a <= b, a, b))

    def named(self, name, value):
        unknown = self.unknown(name)
        self.fact(unknown == value)
        return unknown

    def times(self, name, factor, x):
        """`factor * x`: it has the sign of `x`, is at most `factor.most` times as large, and grows with `x`."""
        product = self.unknown(name)
        self.fact(
            z3.Implies(x >= 0, z3.And(0 <= product, product <= factor.most * x)),
            z3.Implies(x <= 0, z3.And(factor.most * x <= product, product <= 0)),
        )
        for other, known in factor.products:
            self.fact(z3.Implies(x <= other, product <= known), z3.Implies(x >= other, product >= known))
        if factor.limit is not None:
            largest, most = factor.limit
            self.fact(z3.Implies(z3.And(-largest <= x, x <= largest), z3.And(-most <= product, product <= most)))
        factor.products.append((x, product))
        return product

    def product(self, name, factor, x, width):
        return self.fits(name, self.times(name, factor, x), width)

    def halves(self, name, factor, x, width):
        """The products of `x` with the upper half of a factor and with its lower 32 bits, which are signed."""
        whole, lower, upper = self.times(name, factor, x), self.unknown(name), self.unknown(name)
        size = z3.If(x >= 0, x, -x)
        self.fact(-(1 << 31) * size <= lower, lower <= (1 << 31) * size, upper * (1 << 32) + lower == whole)
        return self.fits(f"{name}, upper half", upper, width), self.fits(f"{name}, lower half", lower, 64)

    def gain(self, name, factor, x):
        return self.halves(name, factor, x, 32)

    def rate(self, name, factor, x):
        return self.halves(name, factor, x, 64)

    def prove(self, untrue, verbose):
        """Proves each claim from what stands before it; what is proved may be used. Returns the names of the others.

        An untrue statement must have a counterexample: from facts that contradict each other everything would follow.
        """
        solver, failed = z3.SolverFor("QF_LIA"), []
        solver.set("timeout", TIMEOUT_MS)
        for name, statement in self.log:
            if name is not None:
                solver.push()
                solver.add(z3.Not(statement))
                answer = solver.check()
                solver.pop()
                if verbose:
                    print(f"{'proved' if answer == z3.unsat else 'NOT PROVED'}: {name}", flush=True)
                if answer != z3.unsat:
                    failed.append(name)
            solver.add(statement)
        solver.add(z3.Not(untrue))
        if solver.check() != z3.sat:
            failed.append("a counterexample to what is not true: the facts may contradict each other")
        return failed


def assumptions(config):
    """What is assumed of a configuration whose fields are the bits of its numbers, as pairs of name and statement."""
    return [
        ("range", 0 <= config.lowest),
        ("range", config.lowest < config.highest),
        ("range", config.highest <= MOST_V),
        ("slew", 0 < config.step),
        ("slew", config.step <= MOST_STEP),
        ("codes", 0 <= config.lowest_code),
        ("codes", config.lowest_code < config.highest_code),
        ("codes", config.highest_code <= MOST_CODE),
        ("largest error", 0 <= config.largest_error),
        ("largest error", config.largest_error <= MOST_ACTION),
    ]


# The largest values of the factors of a configuration; all are 0 or more.
MOST = {
    "share": ONE,
    "relaxation": HALF,
    "error_gain": THOUSAND,
    "operating_point_gain": ONE,
    "integrator_gain": ONE,
    "reset": HALF,
    "codes_per_volt": MOST_CODES_PER_VOLT,
    "volts_per_code": MOST_VOLTS_PER_CODE,
}


def inductive_step(has_gains):
    """One tick from any state in the invariant, with the report's controller or without one; and a statement that is not true."""
    numbers = Unknowns()
    known = ["lowest", "highest", "step", "lowest_code", "highest_code", "largest_error"]
    config = SimpleNamespace(has_gains=has_gains, **{name: numbers.unknown(name) for name in known})
    for name, most in MOST.items():
        setattr(config, name, Factor(most))
    config.error_gain.limit = (config.largest_error, MOST_ACTION << 32)
    numbers.fact(*(statement for _, statement in assumptions(config)))
    # The ends of the range are the voltages of codes, and these codes are the nearest to them.
    numbers.assumes = True
    for end, code in [(config.lowest, config.lowest_code), (config.highest, config.highest_code)]:
        numbers.fact(code_of(numbers, "end", config, end) == code, volts_of(numbers, "end", config, code) == end)
    numbers.assumes = False

    state = SimpleNamespace(**{name: numbers.unknown(name) for name in ["relaxed", "integrator", "voltage", "carried"]})
    target = numbers.unknown("target")
    word, double = 1 << 31, 1 << 63
    numbers.fact(-word <= target, target < word, -double <= state.integrator, state.integrator < double)

    def invariant(state):
        """The relaxed part lies between 0 V and the end of the range, and the voltage as well. The integrator may be anything."""
        return {
            "relaxed part within the range": z3.And(
                0 <= state.relaxed, state.relaxed < (config.highest + 1) * (1 << 32)
            ),
            "voltage within the range, or 0 V": z3.And(0 <= state.voltage, state.voltage <= config.highest),
            "carried part below a signal's resolution": z3.And(0 <= state.carried, state.carried < 1 << 32),
        }

    numbers.fact(*invariant(state).values())
    output, following = tick(numbers, config, state, target)
    was_inside = state.voltage >= config.lowest
    moved = output.voltage - state.voltage
    settled, lag = numbers.floor(following.relaxed, 32), numbers.floor(state.relaxed, 32)
    towards = z3.If(
        output.applied >= lag,
        z3.And(settled >= lag, settled <= output.applied),
        z3.And(settled <= lag, settled >= output.applied),
    )
    for name, statement in {
        "relaxed part moves towards the applied voltage, not past it": towards,
        "voltage in range": z3.And(config.lowest <= output.voltage, output.voltage <= config.highest),
        "applied voltage in range": z3.And(config.lowest <= output.applied, output.applied <= config.highest),
        "code in range": z3.And(config.lowest_code <= output.code, output.code <= config.highest_code),
        "slew kept": z3.Implies(was_inside, z3.And(-output.change <= moved, moved <= output.change)),
        "slew on average the one that was set": output.change * (1 << 32) + following.carried == config.step + state.carried,
        "stiffness in range": z3.And(0 <= output.stiffness, output.stiffness <= config.highest),
        "target in range": z3.And(config.lowest <= output.target, output.target <= config.highest),
    }.items():
        numbers.claim(name, statement)
    for name, statement in invariant(following).items():
        numbers.claim(f"after the tick: {name}", statement)
    return numbers, output.code < config.highest_code


def round_trip():
    """The code nearest to the voltage of a code is that code, for every full scale and width of the converter.

    `u` is the voltage between two codes, `q = 1 / u`, and `k = n u` the voltage of code `n`, at most 1000 V. The factors are
    `2^20 q + a` and `2^29 u - b` with rounding errors `a` and `b`; the voltage is `2^20 k - n b / 2^9 - c` with `c` its own
    rounding, below 1. With `k q = n`, their product is `2^40 n + 2^20 k a - (n b / 2^9 + c) (2^20 q + a)`. The two last terms are
    products of numbers within bounds.
    """
    n, first, second, cut = z3.Reals("n first second cut")
    solver = z3.Solver()
    most_a, most_b = z3.RealVal("0.51"), z3.RealVal("1.01")
    most_codes_per_volt = MOST_CODES_PER_VOLT + 1
    solver.add(0 <= n, n <= MOST_CODE, 0 <= cut, cut < 1)
    solver.add(-(1 << 20) * 1001 * most_a <= first, first <= (1 << 20) * 1001 * most_a)
    solver.add(-z3.RealVal("0.01") * MOST_CODE / 512 * most_codes_per_volt <= second)
    solver.add(second <= (most_b * MOST_CODE / 512 + 1) * most_codes_per_volt)
    # The upper half of the product, rounded down, in 256ths of a code.
    upper = ((1 << 40) * n + first - second) / (1 << 32) - cut
    solver.add(z3.Or(upper + 128 < 256 * n, upper + 128 >= 256 * (n + 1)))
    return solver.check() == z3.unsat


def main(verbose):
    failed, proved = [], 0
    for has_gains in [True, False]:
        numbers, untrue = inductive_step(has_gains)
        failed += numbers.prove(untrue, verbose)
        proved += sum(name is not None for name, _ in numbers.log)
    if not round_trip():
        failed.append("the code of the voltage of a code")
    for name in failed:
        print(f"not proved: {name}")
    if not failed:
        print(f"{proved + 1} claims proved: no overflow, codes in range, slew kept, invariant kept, for every accepted setting")
    return 1 if failed else 0


if __name__ == "__main__":
    sys.exit(main("-v" in sys.argv[1:]))
