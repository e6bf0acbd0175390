use crate::reference::*;

const PAPER: Loop = Loop {
    share: 1.0 / 11.0,
    time_constant_s: 5.5,
    gains: Some((4.0, 1.35)),
    range_v: (0.0, 1e9),
    slew_v_per_s: f64::INFINITY,
};

/// Classical Runge-Kutta method with small steps and clamped limits, an independent solution.
fn runge_kutta(system: &Loop, target: impl Fn(f64) -> f64, end_s: f64) -> f64 {
    let (kp, ki) = system.gains.unwrap();
    let voltage = |t: f64, x: [f64; 2]| {
        let law = (kp * (target(t) - (1.0 - system.share) * x[0]) + x[1]) / (1.0 + kp * system.share);
        law.clamp(system.range_v.0, system.range_v.1)
    };
    let rates = |t: f64, x: [f64; 2]| {
        let u = voltage(t, x);
        [(u - x[0]) / system.time_constant_s, (u - x[1]) * ki / kp]
    };
    let (h, mut x) = (1e-4, [0.0; 2]);
    let along = |x: [f64; 2], k: [f64; 2], h: f64| [x[0] + h * k[0], x[1] + h * k[1]];
    let steps = (end_s / h).round() as usize;
    for step in 0..steps {
        let t = step as f64 * h;
        let k1 = rates(t, x);
        let k2 = rates(t + h / 2.0, along(x, k1, h / 2.0));
        let k3 = rates(t + h / 2.0, along(x, k2, h / 2.0));
        let k4 = rates(t + h, along(x, k3, h));
        for i in 0..2 {
            x[i] += h / 6.0 * (k1[i] + 2.0 * k2[i] + 2.0 * k3[i] + k4[i]);
        }
    }
    x[0] + system.share * (voltage(end_s, x) - x[0])
}

fn solve(system: Loop, target: impl Fn(f64) -> f64, sample_s: f64, end_s: f64) -> f64 {
    let samples = (end_s / sample_s).round() as usize;
    let targets: Vec<f64> = (0..=samples).map(|sample| target(sample as f64 * sample_s)).collect();
    let mut moments = vec![Moment::default(); samples];
    system.at_rest(sample_s).run(&targets, &mut moments);
    moments[samples - 1].stiffness
}

#[test]
fn solution_agrees_with_runge_kutta_with_and_without_limits() {
    let ramp = |t: f64| 100.0 * (t / 0.5).clamp(0.0, 1.0);
    for limit in [1e9, 250.0, 120.0] {
        let system = Loop { range_v: (0.0, limit), ..PAPER };
        for end in [0.3, 0.5, 2.0, 6.0] {
            let (got, expected) = (solve(system, ramp, 0.01, end), runge_kutta(&system, ramp, end));
            assert!((got - expected).abs() < 2e-4, "limit {limit}, {end} s: {got} {expected}");
        }
    }
}

/// For slow, fast and oscillating loops the kernel is as exact as one long stretch.
#[test]
fn many_samples_equal_one_long_stretch() {
    let ramp = |t: f64| 100.0 * (t / 0.5).clamp(0.0, 1.0);
    for gains in [Some((4.0, 1.35)), Some((4.0, 0.0)), Some((1.0, 0.4)), Some((4.0, 40.0)), None] {
        let system = Loop { gains, ..PAPER };
        let (got, mut long) = (solve(system, ramp, 0.001, 3.0), system.at_rest(1.0));
        long.advance(0.0, 200.0, 0.5);
        long.advance(100.0, 0.0, 2.5);
        assert!((got - long.moment().stiffness).abs() < 1e-8, "{gains:?}: {got} {:?}", long.moment());
    }
}

#[test]
fn the_solution_is_independent_of_the_sample_time() {
    let target = |t: f64| if t < 3.0 { 100.0 * t.min(1.0) } else { 40.0_f64.max(100.0 - 400.0 * (t - 3.0)) };
    for (limit, slew) in [(1e9, f64::INFINITY), (130.0, f64::INFINITY), (1e9, 150.0), (130.0, 90.0)] {
        let system = Loop { range_v: (0.0, limit), slew_v_per_s: slew, ..PAPER };
        let coarse = solve(system, target, 0.05, 8.0);
        let fine = solve(system, target, 0.001, 8.0);
        assert!((coarse - fine).abs() < 1e-5, "{limit} {slew}: {coarse} {fine}");
    }
}

/// A loop that oscillates into its limits: a long stretch sees the same limits as single samples.
#[test]
fn limits_within_a_long_stretch_are_seen() {
    for (range_v, slew_v_per_s) in
        [((0.0, 120.0), f64::INFINITY), ((95.0, 700.0), f64::INFINITY), ((0.0, 700.0), 60.0), ((20.0, 130.0), 100.0)]
    {
        let system = Loop { gains: Some((1.0, 5.0)), range_v, slew_v_per_s, ..PAPER };
        let mut long = system.at_rest(1e-3);
        long.advance(100.0, 0.0, 10.0);
        let mut moments = vec![Moment::default(); 10_000];
        system.at_rest(1e-3).run(&[100.0; 10_001], &mut moments);
        let last = moments[9_999];
        assert!((last.stiffness - long.moment().stiffness).abs() < 1e-6, "{range_v:?} {slew_v_per_s} {last:?}");
        for Moment { voltage, .. } in moments {
            assert!((range_v.0 - 1e-6..=range_v.1 + 1e-6).contains(&voltage), "{voltage} outside of {range_v:?}");
        }
    }
}

/// A very high slew limit is cheap to solve and has no effect.
#[test]
fn a_very_high_slew_limit_has_no_effect() {
    let at = |slew_v_per_s| {
        let mut solution = Loop { slew_v_per_s, range_v: (50.0, 700.0), ..PAPER }.at_rest(1e-3);
        solution.advance(100.0, 0.0, 3.0);
        solution.moment().stiffness
    };
    for slew in [1e5, 1e7, 1e9] {
        assert!((at(slew) - at(f64::INFINITY)).abs() < 0.1, "{slew}: {} {}", at(slew), at(f64::INFINITY));
    }
}

#[test]
fn the_slew_limit_acts_and_is_left_again() {
    let system = Loop { slew_v_per_s: 100.0, ..PAPER };
    let mut solution = system.at_rest(0.01);
    solution.advance(100.0, 0.0, 1.0);
    assert!((solution.moment().voltage - 100.0).abs() < 1e-6, "one second at 100 V/s: {:?}", solution.moment());
    solution.advance(100.0, 0.0, 50.0);
    assert!((solution.moment().stiffness - 100.0).abs() < 1e-3, "{:?}", solution.moment());
}

#[test]
fn without_a_controller_the_response_is_exponential() {
    let mut solution = Loop { gains: None, ..PAPER }.at_rest(0.1);
    solution.jump(100.0);
    assert!((solution.moment().stiffness - 100.0 / 11.0).abs() < 1e-12);
    solution.advance(100.0, 0.0, 5.5);
    assert!((solution.moment().stiffness - (100.0 - 1000.0 / 11.0 * (-1f64).exp())).abs() < 1e-9);
}
