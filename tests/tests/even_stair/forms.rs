//! Laws that depend on the state of the spring instead of the voltage, and ageing.

use super::{LEVELS_V, ROWS_PER_LEVEL, SAMPLE_S, causes, diagnosed, noise};

const SHARE: f64 = 1.0 / 11.0;
/// Integration steps per row.
const STEPS: usize = 40;

/// Diagnosis of `dw/dt = (u - w)/tau(s, w, y)`, `s` from 0 to 1 along the record, read as `read(y)` in noise of 1 V.
fn diagnosis_of(seed: u64, tau: impl Fn(f64, f64, f64) -> f64, read: impl Fn(f64) -> f64) -> serde_json::Value {
    let volts: Vec<f64> = LEVELS_V.into_iter().flat_map(|volts| std::iter::repeat_n(volts, ROWS_PER_LEVEL)).collect();
    let rows_in_all = volts.len() as f64;
    let (mut w, mut rows) = (0.0, Vec::new());
    for (row, (volts, noise)) in volts.iter().zip(noise(seed, volts.len())).enumerate() {
        rows.push((*volts, read(w + SHARE * (volts - w)) + noise));
        let along = row as f64 / rows_in_all;
        let rate = |w: f64| (volts - w) / tau(along, w, w + SHARE * (volts - w));
        for _ in 0..STEPS {
            // Heun's method.
            let step_s = SAMPLE_S / STEPS as f64;
            let first = rate(w);
            w += 0.5 * step_s * (first + rate(w + step_s * first));
        }
    }
    diagnosed(&rows)
}

/// Asserts that the cause is found, the error is that of the noise, and the parameters are within 3 % of the truth.
fn assert_explained(report: &serde_json::Value, cause: &str, parameters: &[(&str, f64)]) {
    assert_eq!(causes(report), [cause], "{report}");
    assert_eq!(report["verdict"], "explained", "{report}");
    assert!(report["extended"]["held_out_rmse"].as_f64().unwrap() < 1.06, "{report}");
    for (name, truth) in parameters {
        let found = report["findings"][0]["parameters"][name]["value"].as_f64().unwrap();
        assert!((found / truth - 1.0).abs() < 0.03, "{name}: {found} instead of {truth}");
    }
}

#[test]
fn a_time_constant_that_depends_on_the_springs_state_is_found() {
    for (seed, (low, high)) in [(5.5, 14.0), (5.5, 2.2), (9.0, 5.5)].into_iter().enumerate() {
        let (straight, ratio) = (move |x: f64| low + (high - low) * x / 500.0, f64::ln(high / low));
        let geometric = move |x: f64| low * (ratio * x / 500.0).exp();
        let parameters = [("tau_low_s", low), ("tau_high_s", high)];
        let cause = "voltage-dependent-time-constant";
        assert_explained(&diagnosis_of(seed as u64, |_, w, _| straight(w), |y| y), cause, &parameters);
        assert_explained(&diagnosis_of(seed as u64 + 10, |_, _, y| geometric(y), |y| y), cause, &parameters);
    }
}

#[test]
fn a_nonlinearity_after_the_relaxation_is_found() {
    for (seed, bend) in [0.12, -0.12, 0.5, -0.5].into_iter().enumerate() {
        let law = |y: f64| y * (1.0 + bend * (y / 500.0 - 1.0));
        let settled = [("at_200_v", law(200.0)), ("at_400_v", law(400.0))];
        assert_explained(&diagnosis_of(seed as u64 + 20, |_, _, _| 5.5, law), "static-nonlinearity", &settled);
    }
}

#[test]
fn a_relaxation_that_slows_down_with_time_is_found() {
    for seed in 0..3 {
        let aged = 0.6 + 0.2 * seed as f64;
        let tau = |along: f64| 5.5 * f64::exp(aged * (along - 0.5));
        let parameters = [("tau_first_s", tau(0.0)), ("tau_last_s", tau(1.0))];
        assert_explained(&diagnosis_of(seed + 30, |along, _, _| tau(along), |y| y), "time-constant", &parameters);
    }
}

/// A relaxation that slows down and recovers is not explained by a cause and must not be mistaken for autocorrelated noise.
#[test]
fn ageing_and_recovery_are_unexplained_and_not_consistent() {
    for seed in 0..3 {
        let aged = 0.6 + 0.2 * seed as f64;
        let bump = |along: f64| (std::f64::consts::PI * along).sin() - 0.5;
        let report = diagnosis_of(seed + 40, |along, _, _| 5.5 * f64::exp(aged * bump(along)), |y| y);
        assert!(report["extended"]["rmse"].as_f64().unwrap() > 1.1, "{report}");
        assert_eq!(report["verdict"], "unexplained", "{report}");
    }
}
