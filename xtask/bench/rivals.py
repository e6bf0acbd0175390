"""Times the report's closed loop in Python and C, for `cargo xtask bench`.

Usage: rivals.py [TICK], the shared library of tick.c, without which there is no time for C.
Prints one JSON object, ns per sample of each implementation. Ends with an error if the stiffness of two of them
differs by more than TOLERANCE_V, or that of a loop with limits and DAC codes by more than TICK_TOLERANCE_V.

Spring       w' = (u - w) / 5.5             y = u/11 + 10 w/11
Controller   z' = 1.35 (r - y)              u = 4 (r - y) + z
r target, u voltage, y stiffness, in volts. y and u depend on each other within the same instant; solved for y:
             y = (4 r + z + 10 w) / 15
"""

import ctypes
import json
import statistics
import sys
import time

import numba
import numpy as np
import vsj
from scipy import signal

RATE_HZ = 1000
LIMIT_V = 700.0
DAC_STEPS = 4095
# Largest change of the voltage in a tick: 100 000 V/s.
STEP_V = 100.0
SAMPLES = 70_001
TOLERANCE_V = 1e-6
# Of loops that write DAC codes: steps of 0.17 V, and a voltage that is held between the samples.
TICK_TOLERANCE_V = 1.0

SHARE = 1 / 11
TAU_S = 5.5
KP = 4.0
KI_PER_S = 1.35


def stair():
    """0 to 500 V in steps of 100 V, each a ramp of 0.1 s, from 20, 30, 40, 50 and 60 s."""
    k = np.arange(SAMPLES)
    return sum(100.0 * np.clip((k - start * RATE_HZ) / (0.1 * RATE_HZ), 0, 1) for start in (20, 30, 40, 50, 60))


def closed_loop():
    """(A, B, C, D) of the loop: state (w, z), input r, outputs (y, u)."""
    solved = 1 + SHARE * KP
    y = np.array([(1 - SHARE) / solved, SHARE / solved, SHARE * KP / solved])  # of w, z, r
    u = np.array([0, 1, KP]) - KP * y
    w_rate = (u - [1, 0, 0]) / TAU_S
    z_rate = KI_PER_S * (np.array([0, 0, 1]) - y)
    rates, outputs = np.array([w_rate, z_rate]), np.array([y, u])
    return rates[:, :2], rates[:, 2:], outputs[:, :2], outputs[:, 2:]


def between_samples(a, b):
    """x[k+1] = phi x[k] + now r[k] + next r[k+1], exact for an input that is linear between the samples."""
    h = 1 / RATE_HZ
    n = len(a)
    series = np.eye(n + 2)
    term = np.eye(n + 2)
    block = np.zeros((n + 2, n + 2))
    block[:n, :n], block[:n, n : n + 1], block[n, n + 1] = a * h, b * h, 1
    for i in range(1, 12):  # but for one 1 its entries are about 1e-3: the terms vanish far earlier
        term = term @ block / i
        series = series + term
    later = series[:n, n + 1]
    return series[:n, :n], series[:n, n] - later, later


@numba.njit
def loop(r, phi, now, later, cy, dy, y_out, u_out):
    """Output, controller, then both states. The input's part is bracketed: off the chain from state to state, it costs
    12 % less."""
    a, b, c, d = phi[0, 0], phi[0, 1], phi[1, 0], phi[1, 1]
    now_w, now_z, later_w, later_z = now[0], now[1], later[0], later[1]
    y_w, y_z = cy[0], cy[1]
    w = 0.0
    z = 0.0
    for k in range(len(r)):
        y = y_w * w + y_z * z + dy * r[k]
        y_out[k] = y
        u_out[k] = KP * (r[k] - y) + z
        ahead = r[min(k + 1, len(r) - 1)]
        w, z = a * w + b * z + (now_w * r[k] + later_w * ahead), c * w + d * z + (now_z * r[k] + later_z * ahead)


def numpy_loop(r, phi, now, later, c, d, y_out):
    """The same loop in Python, with the states in NumPy arrays."""
    x = np.zeros(2)
    for k in range(len(r)):
        y_out[k] = c @ x + d * r[k]
        x = phi @ x + now * r[k] + later * r[min(k + 1, len(r) - 1)]


@numba.njit
def tick(r, relaxation, y_out, code_out):
    """What the tick does, in float64: limits of range and slew, DAC codes that the spring sees, an integrator that follows the voltage."""
    g = 1 / (1 + KP * SHARE)
    reset = KI_PER_S / KP / RATE_HZ
    w = 0.0
    z = 0.0
    voltage = 0.0
    for k in range(len(r)):
        target = min(max(r[k], 0.0), LIMIT_V)
        # The equation in the head of this file, with the stiffness that follows from the voltage of the same instant.
        wanted = z + (1 - g) * w + KP * g * (target - w)
        slewed = min(max(wanted, voltage - STEP_V), voltage + STEP_V)
        voltage = min(max(slewed, 0.0), LIMIT_V)
        z += reset * (g * voltage - z)
        code = int(voltage * (DAC_STEPS / LIMIT_V) + 0.5)
        applied = code * (LIMIT_V / DAC_STEPS)
        y_out[k] = w + SHARE * (applied - w)
        code_out[k] = code
        w += relaxation * (applied - w)


def tick_in_c(library, r, relaxation, y_out, code_out):
    """A call of the same loop in C."""
    settings = (ctypes.c_double * 7)(SHARE, relaxation, KP, KI_PER_S / KP / RATE_HZ, LIMIT_V, STEP_V, DAC_STEPS)
    run = ctypes.CDLL(library).tick
    run.restype = None
    arguments = [ctypes.c_void_p(array.ctypes.data) for array in (r, y_out, code_out)]
    return lambda: run(settings, arguments[0], ctypes.c_int64(len(r)), arguments[1], arguments[2])


def median_ns(call, repeats):
    """Median time of a call in ns per sample."""
    times = []
    for _ in range(repeats):
        start = time.perf_counter_ns()
        call()
        times.append(time.perf_counter_ns() - start)
    return statistics.median(times) / SAMPLES


def main():
    r = stair()
    t = np.arange(SAMPLES) / RATE_HZ
    a, b, c, d = closed_loop()
    stiffness = signal.StateSpace(a, b, c[:1], d[:1])

    discrete = signal.cont2discrete((a, b, c[:1], d[:1]), 1 / RATE_HZ, method="foh")[:4]
    # Rounded to 1e-16, these coefficients alone change lfilter's result by up to 5e-7 V: both poles are close to 1.
    numerator, denominator = signal.ss2tf(*discrete)
    numerator = numerator[0]

    phi, now, later = between_samples(a, b)
    cy, dy = c[0].copy(), d[0, 0]
    y, u = np.empty(SAMPLES), np.empty(SAMPLES)
    stepped, held, codes = np.empty(SAMPLES), np.empty(SAMPLES), np.empty(SAMPLES, np.uint16)
    held_in_c, codes_in_c = np.empty(SAMPLES), np.empty(SAMPLES, np.uint16)
    relaxation = -np.expm1(-1 / (TAU_S * RATE_HZ))
    slew = STEP_V * RATE_HZ
    controller = vsj.Controller("paper", "paper", limit_v=LIMIT_V, slew_v_per_s=slew, rate_hz=RATE_HZ, kp=KP, ki=KI_PER_S)

    rivals = {  # name: (call, repeats in one group)
        "lsim": (lambda: signal.lsim(stiffness, r, t), 3),
        "lfilter": (lambda: signal.lfilter(numerator, denominator, r), 101),
        "numba": (lambda: loop(r, phi, now, later, cy, dy, y, u), 101),
        "numpy": (lambda: numpy_loop(r, phi, now, later, cy, dy, stepped), 1),
        "numba_tick": (lambda: tick(r, relaxation, held, codes), 101),
        "controller": (lambda: controller.run(r), 101),
    }
    for library in sys.argv[1:]:
        rivals["c_tick"] = (tick_in_c(library, r, relaxation, held_in_c, codes_in_c), 101)

    # The first calls compile and are compared, but not timed.
    for name in {"numba", "numpy", "numba_tick", "c_tick"} & set(rivals):
        rivals[name][0]()
    both = signal.lsim(signal.StateSpace(a, b, c, d), r, t)[1]
    apart = {
        "lfilter": np.abs(rivals["lfilter"][0]() - both[:, 0]).max(),
        "numba": np.abs(y - both[:, 0]).max(),
        "numba's voltage": np.abs(u - both[:, 1]).max(),
        "numpy": np.abs(stepped - both[:, 0]).max(),
    }
    apart_ticks = {
        "numba with limits and DAC": np.abs(held - both[:, 0]).max(),
        "vsj.Controller": np.abs(controller.run(r).stiffness_v - both[:, 0]).max(),
    }
    if "c_tick" in rivals:
        apart_ticks["C with limits and DAC"] = np.abs(held_in_c - both[:, 0]).max()
    for each, tolerance_v in ((apart, TOLERANCE_V), (apart_ticks, TICK_TOLERANCE_V)):
        for name, volts in each.items():
            print(f"{name} is within {volts:.1e} V of lsim", file=sys.stderr)
            if not volts <= tolerance_v:
                sys.exit(f"rivals.py: {name} does not compute the same loop: {volts} V from lsim, allowed {tolerance_v}")

    # In turns, and the best group of each: disturbances of the machine must not count against one of them.
    groups = {name: [] for name in rivals}
    for _ in range(5):
        for name, (call, repeats) in rivals.items():
            groups[name].append(median_ns(call, repeats))
    print(json.dumps({name: round(min(medians), 3) for name, medians in groups.items()}))


if __name__ == "__main__":
    main()
