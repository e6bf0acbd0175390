//! Records from a plain Runge-Kutta integration, which shares nothing with the models.

use simulation::record::{Record, Row};

use crate::linear::*;
use crate::record::input::Input;
use crate::stats::scale::{normals, root_mean_square};

/// A spring as differential equations: slopes of the states, and the reading from states and voltage.
struct Truth {
    slopes: fn([f64; 2], f64) -> [f64; 2],
    reading: fn([f64; 2], f64) -> f64,
    start: [f64; 2],
    delay: f64,
}

/// Voltage that is held over rows and steps to another level every `every` rows.
fn levels(rows: usize, every: usize) -> Vec<f64> {
    let noise = normals(rows / every + 1);
    (0..rows).map(|row| 100.0 + 40.0 * noise[row / every]).collect()
}

/// Integrates with many Runge-Kutta steps over each stretch of constant voltage, and adds noise.
fn measured(truth: &Truth, times: &[f64], voltage: &[f64], noise: &[f64]) -> Record {
    let mut state = truth.start;
    let mut changes: Vec<(f64, f64)> = times.iter().zip(voltage).map(|(time, v)| (time + truth.delay, *v)).collect();
    changes.push((f64::INFINITY, 0.0));
    let (mut next, mut now, mut held) = (0, times[0], voltage[0]);
    let mut rows = Vec::new();
    for (row, &time) in times.iter().enumerate() {
        loop {
            let until = changes[next].0.min(time);
            let parts = 60;
            let h = (until - now) / f64::from(parts);
            for _ in 0..parts {
                let at = |k: [f64; 2], of: f64| [state[0] + of * h * k[0], state[1] + of * h * k[1]];
                let k1 = (truth.slopes)(state, held);
                let k2 = (truth.slopes)(at(k1, 0.5), held);
                let k3 = (truth.slopes)(at(k2, 0.5), held);
                let k4 = (truth.slopes)(at(k3, 1.0), held);
                for i in 0..2 {
                    state[i] += h / 6.0 * (k1[i] + 2.0 * k2[i] + 2.0 * k3[i] + k4[i]);
                }
            }
            now = until;
            // Rounding does not decide whether a reading is taken after a step.
            if changes[next].0 > time + 1e-9 {
                break;
            }
            held = changes[next].1;
            next += 1;
        }
        let measured = Some((truth.reading)(state, held) + noise[row]);
        rows.push(Row { line: row + 2, time_s: time, voltage_v: voltage[row], measured });
    }
    Record { name: "truth".into(), rows }
}

fn even_times(rows: usize, step: f64) -> Vec<f64> {
    (0..rows).map(|row| step * row as f64).collect()
}

fn scaled(noise: Vec<f64>, sigma: f64) -> Vec<f64> {
    noise.into_iter().map(|value| sigma * value).collect()
}

fn near(found: f64, expected: f64, part: f64) {
    assert!((found / expected - 1.0).abs() < part, "{found}, expected {expected}");
}

/// Lag of 2 s, share 0.3, gain 0.7, zero 20, not at rest at the start.
const LAG: Truth = Truth {
    slopes: |[x, _], u| [(u - x) / 2.0, 0.0],
    reading: |[x, _], u| 20.0 + 0.7 * (0.3 * u + 0.7 * x),
    start: [30.0, 0.0],
    delay: 0.0,
};

/// Lags of 1 s and 15 s in series.
const TWO_LAGS: Truth = Truth {
    slopes: |[x, y], u| [(u - x) / 15.0, (x - y)],
    reading: |[_, y], _| -5.0 + 3.0 * y,
    start: [0.0, 0.0],
    delay: 0.0,
};

/// Resonance at 2 rad/s with a damping ratio of 0.02.
const RESONATOR: Truth = Truth {
    slopes: |[x, v], u| [2.0 * v, 2.0 * (u - x - 0.04 * v)],
    reading: |[x, _], _| 1.0 + 0.5 * x,
    start: [100.0, 0.0],
    delay: 0.0,
};

fn best(record: &Record, order: usize) -> (Problem, Fit) {
    let problem = Problem::new(vec![Series::new(record, Input::Hold)]);
    let fit = best_of_each_order(&problem).nth(order).unwrap();
    (problem, fit)
}

#[test]
fn lag_with_share_delay_and_start_is_recovered() {
    for (delay, rows) in [(0.0, 600), (0.2, 600), (0.74, 600)] {
        let truth = Truth { delay, ..LAG };
        let record = measured(&truth, &even_times(rows, 0.2), &levels(rows, 9), &scaled(normals(rows), 0.05));
        let (problem, fit) = best(&record, 1);
        let Section::First { tau } = fit.poles.sections[0] else { panic!("{:?}", fit.poles) };
        near(tau, 2.0, 0.01);
        near(fit.gain(), 0.7, 0.003);
        // Seen at the rows, 0.06 s of the lag before the next row are a part of what is instantaneous there.
        let share = 1.0 - 0.7 * (-(0.2 * (delay / 0.2_f64).ceil() - delay) / 2.0).exp();
        near(fit.instantaneous() / fit.gain(), share, 0.02);
        near(problem.zero(&fit, 0), 20.0, 0.01);
        near(root_mean_square(&fit.residual), 0.05, 0.05);
        let expected = 0.2 * (delay / 0.2_f64).ceil();
        assert!((fit.poles.delay - expected).abs() < 1e-9, "{} {delay}", fit.poles.delay);
    }
}

#[test]
fn two_lags_in_series_are_recovered_at_uneven_times() {
    let noise = normals(1800);
    let times: Vec<f64> = (0..900).map(|row| 0.5 * row as f64 + 0.1 * noise[row].clamp(-2.0, 2.0)).collect();
    let record = measured(&TWO_LAGS, &times, &levels(900, 13), &scaled(noise[900..].to_vec(), 0.2));
    let (_, fit) = best(&record, 2);
    let taus = fit.poles.sections[0].time_constants().expect("real poles");
    near(taus[0], 15.0, 0.01);
    near(taus[1], 1.0, 0.1);
    near(fit.gain(), 3.0, 0.003);
    assert!(fit.poles.delay < 0.1, "{:?}", fit.poles);
}

#[test]
fn lightly_damped_resonance_is_recovered_in_white_and_coloured_noise() {
    let white = normals(1200);
    let coloured: Vec<f64> = white
        .iter()
        .scan(0.0, |last, noise| {
            *last = 0.9 * *last + noise;
            Some(*last)
        })
        .collect();
    for noise in [white, coloured] {
        let record = measured(&RESONATOR, &even_times(1200, 0.3), &levels(1200, 1), &noise);
        let (_, fit) = best(&record, 2);
        let Section::Second { frequency, damping } = fit.poles.sections[0] else { panic!("{:?}", fit.poles) };
        near(frequency, 2.0, 0.002);
        near(damping, 0.02, 0.1);
        near(fit.gain(), 0.5, 0.1);
    }
}

/// Times in microseconds or months, voltages in kV or uV, readings in any unit and from any zero.
#[test]
fn models_scale_with_the_units() {
    let rows = 700;
    let record = measured(&LAG, &even_times(rows, 0.2), &levels(rows, 9), &scaled(normals(rows), 0.5));
    let fits = |record: &Record| {
        let problem = Problem::new(vec![Series::new(record, Input::Hold)]);
        let fits: Vec<Fit> = best_of_each_order(&problem).collect();
        let held_out: Vec<f64> = fits.iter().map(|fit| root_mean_square(&held_out_residual(&problem, fit))).collect();
        (fits, held_out)
    };
    let (first, errors) = fits(&record);
    for (time, voltage, reading, later, above) in [
        (1e-6, 1.0, 1.0, 0.0, 0.0),
        (1e6, 1e-6, 1e6, -3e8, 0.0),
        (1.0, 1e6, 1e-6, 1e6, 0.0),
        (3600.0, 1.0, 1.0, 0.0, -273.15),
    ] {
        let mut other = record.clone();
        for row in &mut other.rows {
            row.time_s = later + time * row.time_s;
            row.voltage_v *= voltage;
            row.measured = row.measured.map(|value| above + reading * value);
        }
        let (second, other_errors) = fits(&other);
        assert_eq!(first.len(), second.len());
        for (order, (a, b)) in first.iter().zip(&second).enumerate().take(2) {
            near(b.gain() * voltage / reading, a.gain(), 1e-6);
            near(other_errors[order] / reading, errors[order], 1e-6);
            for (a, b) in a.poles.sections.iter().zip(&b.poles.sections) {
                near(b.time_constants().unwrap()[0] / time, a.time_constants().unwrap()[0], 1e-6);
            }
        }
        for (a, b) in errors.iter().zip(&other_errors) {
            near(b / reading, *a, 1e-2);
        }
    }
}

#[test]
fn one_step_agrees_with_a_refit() {
    let rows = 900;
    let record = measured(&TWO_LAGS, &even_times(rows, 0.5), &levels(rows, 13), &scaled(normals(rows), 1.0));
    let (problem, fit) = best(&record, 2);
    let [refit, step] = [held_out::by_refit(&problem, &fit), held_out::by_step(&problem, &fit)];
    let apart: Vec<f64> = refit.iter().zip(&step).map(|(a, b)| a - b).collect();
    let (error, fitted) = (root_mean_square(&refit), root_mean_square(&fit.residual));
    assert!(error > 1.001 * fitted && error < 1.1 * fitted, "{error} {fitted}");
    assert!(root_mean_square(&apart) < 0.1 * error, "{} {error}", root_mean_square(&apart));
}

/// The fold's readings only decide where the other rows know nothing.
#[test]
fn held_out_prediction_does_not_follow_the_fold() {
    let rows = 800;
    let record = measured(&LAG, &even_times(rows, 0.2), &levels(rows, 9), &scaled(normals(rows), 0.5));
    let (problem, fit) = best(&record, 1);
    let fold = problem.series[0].fold.clone();
    let mut other = record.clone();
    for (row, of) in other.rows.iter_mut().zip(&fold) {
        row.measured = row.measured.map(|value| if *of == 2 { value + 5.0 } else { value });
    }
    let (moved, moved_fit) = (Problem::new(vec![Series::new(&other, Input::Hold)]), fit.poles.clone());
    let before = held_out::by_refit(&problem, &fit);
    let after = held_out::by_refit(&moved, &moved.linearised(moved_fit));
    let of_fold = |row: &usize| fold[*row] == 2;
    let change: Vec<f64> = (0..rows).filter(of_fold).map(|row| after[row] - before[row]).collect();
    assert!(change.iter().all(|change| (change - 5.0).abs() < 0.2), "{change:?}");
}

#[test]
fn several_records_share_the_spring_but_neither_zero_nor_start() {
    let truth = [LAG, Truth { reading: |[x, _], u| -3.0 + 0.7 * (0.3 * u + 0.7 * x), start: [200.0, 0.0], ..LAG }];
    let noise = normals(1000);
    let records = [(0, 300), (1, 700)].map(|(which, rows)| {
        let noise = scaled(noise[..rows].to_vec(), 0.1);
        measured(&truth[which], &even_times(rows, 0.2), &levels(rows, 9), &noise)
    });
    let problem = Problem::new(records.iter().map(|record| Series::new(record, Input::Hold)).collect());
    let fit = best_of_each_order(&problem).nth(1).unwrap();
    near(fit.gain(), 0.7, 0.003);
    near(problem.zero(&fit, 0), 20.0, 0.02);
    near(problem.zero(&fit, 1), -3.0, 0.1);
    near(root_mean_square(&held_out_residual(&problem, &fit)), 0.1, 0.1);
}

#[test]
fn magnitude_of_a_linear_voltage_has_its_zeros() {
    let row = |row: usize, voltage_v| Row { line: 0, time_s: row as f64, voltage_v, measured: Some(voltage_v.abs()) };
    let record =
        Record { name: String::new(), rows: (0..40).map(|at| row(at, [4.0, -12.0, 3.0, 3.0, 0.0][at % 5])).collect() };
    let series = Series::new(&record, Input::Linear);
    assert!(series.has_both_signs());
    let problem = Problem::new(vec![series.rectified()]);
    let fit = problem.fit(Poles { sections: Vec::new(), undriven: Vec::new(), delay: 0.0 });
    near(fit.gain(), 1.0, 1e-9);
    // From 4 V to -12 V, the magnitude is zero after a quarter of a row and 4 V after half a row.
    let halves = Poles { sections: Vec::new(), undriven: Vec::new(), delay: 0.5 };
    let left = problem.residual(&Fit { poles: halves, ..fit });
    near(left[1], 12.0 - 4.0, 1e-9);
}

/// Shifts of the zero by 5 from 47 s on and by -3 from 70 s on, at places that are given.
#[test]
fn shifts_of_the_zero_are_fitted_with_the_model() {
    let (times, voltage) = (even_times(500, 0.25), levels(500, 20));
    let mut record = measured(&LAG, &times, &voltage, &scaled(normals(500), 0.1));
    for row in &mut record.rows {
        let by = if row.time_s < 47.0 {
            0.0
        } else if row.time_s < 70.0 {
            5.0
        } else {
            2.0
        };
        row.measured = row.measured.map(|reading| reading + by);
    }
    let problem = Problem::new(vec![Series::new(&record, Input::Hold).shifted(vec![46.9, 69.9])]);
    let fit = best_up_to(&problem, 1).last().unwrap();
    let Section::First { tau } = fit.poles.sections[0] else { panic!("{:?}", fit.poles) };
    near(tau, 2.0, 0.02);
    let [first, second] = problem.shift_sizes(&fit) else { panic!() };
    near(*first, 5.0, 0.01);
    near(*second, -3.0, 0.02);
    // Without noise beyond that of the readings, in all rows and in a part of them.
    let residual = problem.residual(&fit);
    assert!(root_mean_square(&residual) < 0.11, "{}", root_mean_square(&residual));
    near(*problem.shift_sizes(&problem.only(|row| row % 3 > 0).fit(fit.poles.clone())).last().unwrap(), -3.0, 0.02);
    assert!(root_mean_square(&held_out_residual(&problem, &fit)) < 0.11);
}
