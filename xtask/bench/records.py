"""Times the identification and the diagnosis of records of several instruments, for `cargo xtask bench`.

Takes the path of `vsj`. Prints one JSON object: for each record its rows, the CPU time in s of `vsj identify`, of
`vsj diagnose --plant identify` and of SciPy's linear output-error fits of order 1 to 4, and the errors of the fits.

SciPy       y(k) = zero + b(q) / a(q) u(k) + free response,   least squares over a, b, zero and start
            (`least_squares`, `lfilter`), started by ARX
"""

import json
import os
import resource
import subprocess
import sys
import tempfile
import time

import numpy as np
from scipy import optimize, signal

RANDOM_SEED = 11
ORDERS = (1, 2, 3, 4)
STEPS_BETWEEN_ROWS = 20


def levels(random, rows, shortest, longest, low, high):
    """Random levels, each held for a random number of rows."""
    held = []
    while len(held) < rows:
        held += [random.uniform(low, high)] * int(random.integers(shortest, longest))
    return np.array(held[:rows])


def multisine(rows, harmonics):
    k = np.arange(1, harmonics + 1)[:, None]
    phase = 2 * np.pi * ((k * k * 0.6180339887) % 1)
    return np.sin(2 * np.pi * k * np.arange(rows) * 4 / rows + phase).sum(axis=0) * np.sqrt(2 / harmonics)


def chirp(rows):
    row = np.arange(rows)
    return np.sin(2 * np.pi * (4e-4 * row + 0.05 / rows * row * row))


def one_over_f(random, rows):
    frequency = np.fft.rfftfreq(rows)
    frequency[0] = frequency[1]
    phases = np.exp(2j * np.pi * random.random(len(frequency)))
    noise = np.fft.irfft(phases / np.sqrt(frequency), rows)
    return (noise - noise.mean()) / noise.std()


def simulated(command, sample_s, start, rates):
    """States of an instrument at each row, by small steps of the command held between the rows."""
    state, states = np.array(start, dtype=float), []
    for value in command:
        states.append(state)
        for _ in range(STEPS_BETWEEN_ROWS):
            state = state + sample_s / STEPS_BETWEEN_ROWS * np.array(rates(value, state))
    return np.array(states).T


def spring(command):
    """A spring with a share of 1/11 and 7 s, read every 0.2 s, 5 % too stiff."""
    return 1.05 * (command / 11 + simulated(command, 0.2, [command[0]], lambda u, x: [(u - x[0]) / 7])[0] * 10 / 11)


def records(random):
    """Name, time between rows in s, command, reading without noise, standard deviation of the noise, step of the converter."""
    heater = levels(random, 500, 40, 120, 0, 80)
    hot = simulated(heater, 3, [22, 22], lambda u, x: [(22 + 0.6 * u - x[0]) / 150, (x[0] - x[1]) / 18])[1]
    yield "heater, two lags", 3, heater, hot, 0.05, 0.25
    pump = levels(random, 1000, 5, 40, 1, 6)
    upper = lambda u, x: [0.05 * u - 0.06 * np.sqrt(max(x[0], 0)), 0.06 * (np.sqrt(max(x[0], 0)) - np.sqrt(max(x[1], 0)))]
    yield "tanks in cascade", 4, pump, simulated(pump, 4, [3, 3], upper)[1], 0.03, 0
    dryer = np.where(random.random(1000) < 0.2, 1, 0).cumsum() % 2 * 3.0 + 3
    warm = simulated(np.roll(dryer, 3), 0.08, [5, 5], lambda u, x: [(u - x[0]) / 0.3, (x[0] - x[1]) / 0.12])[1]
    yield "dryer, delayed", 0.08, dryer, warm, 0.05, 0
    kilovolts = levels(random, 2000, 20, 60, -4, 4)
    force = simulated(kilovolts, 0.004, [0, 0], lambda u, x: [(u * u - x[0]) / 0.012, (u * u - x[1]) / 1.2])
    yield "kilovolt actuator, square law", 0.004, kilovolts, 0.1 * force[0] + 0.01 * force[1], 0.004, 0
    volts = 0.05 * multisine(4000, 200)
    swing = lambda u, x: [x[1], 400.0**2 * (u - x[0] - 4 * x[0] ** 3) - 40 * x[1]]
    yield "resonator, multisine", 0.0016, volts, simulated(volts, 0.0016, [0, 0], swing)[0], 0.0005, 0
    for rows in (2400, 10_000):
        for name, command in (
            ("multisine", 250 + 90 * multisine(rows, 60)),
            ("chirp", 250 + 220 * chirp(rows)),
            ("1/f noise", np.clip(250 + 80 * one_over_f(random, rows), 0, 500)),
            ("square wave", np.where(np.arange(rows) // 60 % 2 == 0, 100.0, 400.0)),
        ):
            yield f"spring, {name}", 0.2, command, spring(command), 0.7, 0


def output_error(command, reading):
    """The smallest root mean square error of the output-error models of order 1 to 4."""
    u, y = command - command.mean(), reading - reading.mean()
    smallest = np.inf
    for order in ORDERS:
        lagged = [-y[order - k : len(y) - k] for k in range(1, order + 1)]
        lagged += [u[order - k : len(u) - k] for k in range(order + 1)]
        arx = np.linalg.lstsq(np.array(lagged).T, y[order:], rcond=None)[0]

        def residual(p):
            a, b, start = np.split(p[:-1], [order, 2 * order + 1])
            with np.errstate(all="ignore"):
                left = y - p[-1] - signal.lfilter(b, np.concatenate(([1], a)), u, zi=start)[0]
            return np.nan_to_num(left, nan=1e6, posinf=1e6, neginf=-1e6).clip(-1e6, 1e6)

        fit = optimize.least_squares(residual, np.append(arx, np.zeros(order + 1)), x_scale="jac", max_nfev=60)
        smallest = min(smallest, float(np.sqrt(np.mean(fit.fun**2))))
    return smallest


def vsj_cpu_s(arguments):
    """The JSON of a command and the CPU time that it takes, in s."""
    before = resource.getrusage(resource.RUSAGE_CHILDREN)
    out = subprocess.run(arguments, check=True, capture_output=True, text=True).stdout
    after = resource.getrusage(resource.RUSAGE_CHILDREN)
    return json.loads(out), after.ru_utime + after.ru_stime - before.ru_utime - before.ru_stime


def main():
    vsj, rows = sys.argv[1], []
    random = np.random.default_rng(RANDOM_SEED)
    with tempfile.TemporaryDirectory() as folder:
        for name, sample_s, command, reading, sigma, step in records(random):
            reading = reading + sigma * random.normal(size=len(reading))
            reading = np.round(reading / step) * step if step > 0 else reading
            path = os.path.join(folder, "record.csv")
            table = np.column_stack((np.arange(len(command)) * sample_s, command, reading))
            np.savetxt(path, table, fmt="%.9g", delimiter=",", header="time_s,voltage_v,stiffness", comments="")
            identified, identify_s = vsj_cpu_s([vsj, "identify", path, "--json"])
            diagnosed, diagnose_s = vsj_cpu_s([vsj, "diagnose", path, "--plant", "identify", "--json"])
            start = time.process_time()
            error = output_error(command, reading)
            rival_s = time.process_time() - start
            rows.append(
                {
                    "name": name,
                    "rows": len(command),
                    "identify_s": identify_s,
                    "diagnose_s": diagnose_s,
                    "output_error_s": rival_s,
                    "identify_rmse": identified["rmse"],
                    "diagnose_rmse": diagnosed["extended"]["rmse"],
                    "output_error_rmse": error,
                }
            )
    print(json.dumps(rows))


if __name__ == "__main__":
    main()
