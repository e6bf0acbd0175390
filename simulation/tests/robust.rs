//! The robust controller on every spring at the ends of its margin, compared with the shortest possible times.

use model::{Amplifier, Approach, Compensation, Feedback, Margin, Settings};
use simulation::experiment::{Experiment, max_fixed_point_error};
use simulation::plant_file::{PlantFile, parse};
use simulation::robust_bound::{Allowed, OF_KNOWN, RobustBound};
use simulation::run::Sample;
use simulation::schedule::Schedule;
use simulation::spring_error::{DifferingSpring, SpringError};

const RATE_HZ: f64 = 1000.0;
const OVERSHOOT: f64 = 0.02;
/// What rounding to a DAC code of 0.24 V adds to the overshoot of 100 V.
const ROUNDING: f64 = 0.001;

/// The nominal spring and those at all ends of a margin.
fn springs(margin: &Margin) -> Vec<SpringError> {
    let of = |a: f64, b: f64, c: f64| SpringError {
        time_constant: a * margin.time_constant,
        share: b * margin.share,
        gain: c * margin.gain,
        ..SpringError::default()
    };
    let signs = || [-1.0, 0.0, 1.0].into_iter();
    let pairs = signs().flat_map(|a| signs().map(move |b| (a, b)));
    pairs.flat_map(|(a, b)| signs().map(move |c| of(a, b, c))).collect()
}

fn settings(compensation: Compensation, feedback: Option<Feedback>) -> Settings {
    Settings { rate_hz: RATE_HZ, compensation, amplifier: Amplifier::up_to(1000.0), feedback, ..Settings::PAPER }
}

/// Number of ticks of a time in s.
fn ticks(seconds: f64) -> usize {
    (seconds * RATE_HZ) as usize
}

/// The samples of a spring on targets in V, each for some seconds.
fn run(settings: &Settings, spring: &SpringError, targets: &[(f64, f64)], sensor_noise_v: Option<f64>) -> Vec<Sample> {
    let config = settings.validate().unwrap().quantize();
    let targets: Vec<f64> = targets.iter().flat_map(|&(v, s)| std::iter::repeat_n(v, ticks(s))).collect();
    let spring = DifferingSpring::new(&PlantFile::from(settings.plant), spring);
    spring.closed_loop(&config, &targets, 1.0 / RATE_HZ, sensor_noise_v).unwrap()
}

/// Time after which each step stays above 97 %, in s, and its overshoot as a part of the step. Targets in V, each for some seconds; the
/// first is where the steps begin.
fn steps(
    settings: &Settings,
    spring: &SpringError,
    targets: &[(f64, f64)],
    sensor_noise_v: Option<f64>,
) -> Vec<(f64, f64)> {
    let samples = run(settings, spring, targets, sensor_noise_v);
    let mut start = 0;
    let each = targets.windows(2).map(|pair| {
        let [(from, before_s), (to, lasts_s)] = *pair else { unreachable!("windows of two") };
        start += ticks(before_s);
        let before = samples[start - 1].reference;
        let part = |at: usize| (samples[at].reference - before) / (to - from);
        let end = start + ticks(lasts_s);
        let late = (start..end).rev().find(|&at| part(at) < 0.97).map_or(start, |at| at + 1);
        let most = (start..end).map(part).fold(0.0, f64::max);
        ((late - start) as f64 / RATE_HZ, most - 1.0)
    });
    each.collect()
}

/// Time and overshoot of the last of the [`steps`].
fn last_step(
    settings: &Settings,
    spring: &SpringError,
    targets: &[(f64, f64)],
    sensor_noise_v: Option<f64>,
) -> (f64, f64) {
    *steps(settings, spring, targets, sensor_noise_v).last().unwrap()
}

/// `vsj bound` on the same errors, from a settled spring. 2.1 % instead of 2 % are the rounding to a code.
#[test]
fn without_a_sensor_every_spring_is_within_a_tenth_of_the_bound() {
    let file = PlantFile::from(settings(Compensation::None, None).plant);
    let allowed = Allowed { amplifier: Amplifier::up_to(1000.0), overshoot: OVERSHOOT };
    let bound = RobustBound::new(&file, allowed).unwrap();
    for (time_constant, share, gain) in
        [(0.0, 0.1, 0.0), (0.05, 0.05, 0.0), (0.02, 0.02, 0.01), (0.0, 0.0, 0.01), (0.02, 0.0, 0.01)]
    {
        let margin = Margin { time_constant, share, gain, overshoot: OVERSHOOT, ..Margin::TYPICAL };
        let settings = settings(Compensation::Robust(margin), None);
        for (from, to) in [(0.0, 100.0), (400.0, 500.0), (500.0, 400.0)] {
            let each = springs(&margin)
                .into_iter()
                .map(|spring| last_step(&settings, &spring, &[(from, 100.0), (to, 12.0)], None));
            let (late_s, overshoot) = each.fold((0.0, 0.0), |(a, b), (c, d)| (f64::max(a, c), f64::max(b, d)));
            let errors = SpringError { time_constant, share, gain, ..SpringError::default() };
            let shortest_s = bound.shortest_s(from, to, &errors).unwrap();
            println!("{margin:?} {from} V: {late_s} s of {shortest_s:.3} s, {:.2} %", 100.0 * overshoot);
            assert!(late_s <= 1.1 * shortest_s, "{margin:?} {from} V: {late_s} s, bound {shortest_s} s");
            assert!(overshoot <= OVERSHOOT + ROUNDING, "{margin:?} {from} V: {overshoot}");
        }
    }
}

/// Where only the time constant is uncertain, the bound without further conditions is lower: it belongs to a voltage under which every
/// spring falls back by most of the step. With the nominal spring at 97 % in its own time, the controller is within a tenth of the bound.
#[test]
fn with_an_uncertain_time_constant_it_is_within_a_tenth_of_the_bound_for_which_no_spring_falls_back() {
    let file = PlantFile::from(settings(Compensation::None, None).plant);
    let allowed = Allowed { amplifier: Amplifier::up_to(1000.0), overshoot: OVERSHOOT };
    let bound = RobustBound::new(&file, allowed).unwrap();
    // At 3.5 %, where the bound leaves 0.6 s, the springs are at both ends of the band, and the rounding to a code decides.
    for time_constant in [0.03, 0.05, 0.06] {
        let margin = Margin { time_constant, share: 0.0, gain: 0.0, overshoot: OVERSHOOT, ..Margin::TYPICAL };
        let settings = settings(Compensation::Robust(margin), None);
        for (from, to) in [(0.0, 100.0), (400.0, 500.0)] {
            let step = |spring| last_step(&settings, &spring, &[(from, 100.0), (to, 12.0)], None);
            let (nominal_s, _) = step(SpringError::default());
            let each = springs(&margin).into_iter().map(step);
            let (late_s, overshoot) = each.fold((0.0, 0.0), |(a, b), (c, d)| (f64::max(a, c), f64::max(b, d)));
            let error = SpringError { time_constant, ..SpringError::default() };
            let known_s = bound.shortest_s(from, to, &SpringError::default()).unwrap();
            let shortest_s = bound.shortest_with_nominal_s(from, to, &error, OF_KNOWN * known_s).unwrap();
            println!("{time_constant} {from} V: {nominal_s} of {known_s:.3} s, {late_s} s of {shortest_s:.3} s");
            assert!(nominal_s <= OF_KNOWN * known_s, "{time_constant} {from} V: {nominal_s} s, bound {known_s} s");
            assert!(late_s <= 1.1 * shortest_s, "{time_constant} {from} V: {late_s} s, bound {shortest_s} s");
            assert!(overshoot <= OVERSHOOT + ROUNDING, "{time_constant} {from} V: {overshoot}");
        }
    }
}

/// Where a fall back is allowed, the slowest of the springs is within a tenth of the bound without further conditions, also for time constants
/// between the ends of the errors. Without it this controller takes 1.3 to 1.4 times the bound at 5 %.
#[test]
fn with_a_fall_back_an_uncertain_time_constant_is_within_a_tenth_of_the_bound() {
    let file = PlantFile::from(settings(Compensation::None, None).plant);
    let allowed = Allowed { amplifier: Amplifier::up_to(1000.0), overshoot: OVERSHOOT };
    let bound = RobustBound::new(&file, allowed).unwrap();
    for time_constant in [0.05, 0.07, 0.1] {
        let margin = Margin { time_constant, share: 0.0, gain: 0.0, overshoot: OVERSHOOT, fall_back: 0.25 };
        let settings = settings(Compensation::Robust(margin), None);
        for (from, to) in [(0.0, 100.0), (100.0, 200.0), (200.0, 300.0), (300.0, 400.0), (400.0, 500.0), (500.0, 400.0)]
        {
            let spring = |part: i32| SpringError {
                time_constant: f64::from(part) / 5.0 * time_constant,
                ..SpringError::default()
            };
            let each = (-5..=5).map(|part| last_step(&settings, &spring(part), &[(from, 100.0), (to, 14.0)], None));
            let (late_s, overshoot) = each.fold((0.0, 0.0), |(a, b), (c, d)| (f64::max(a, c), f64::max(b, d)));
            let shortest_s = bound.shortest_s(from, to, &spring(5)).unwrap();
            println!("{time_constant} {from} V: {late_s} s of {shortest_s:.3} s, {:.2} %", 100.0 * overshoot);
            assert!(late_s <= 1.1 * shortest_s, "{time_constant} {from} V: {late_s} s, bound {shortest_s} s");
            assert!(overshoot <= OVERSHOOT + ROUNDING, "{time_constant} {from} V: {overshoot}");
        }
    }
}

/// A step back from a spring that still goes the other way, whose quick spring's lead does not come down to the end of a fall back.
#[test]
fn after_a_fall_back_the_target_is_reached_wherever_the_step_begins() {
    for (time_constant, fall_back) in [(0.07, 0.25), (0.05, 0.1), (0.05, 0.25), (0.1, 0.5), (0.25, 0.25)] {
        let margin = Margin { time_constant, share: 0.0, gain: 0.0, overshoot: OVERSHOOT, fall_back };
        let settings = settings(Compensation::Robust(margin), None);
        for before_s in [1.0, 3.0, 6.0, 9.0, 11.0, 11.5, 14.0, 20.0] {
            for (before, to) in [(500.0, 400.0), (300.0, 200.0), (200.0, 300.0)] {
                let samples = run(&settings, &SpringError::default(), &[(before, before_s), (to, 60.0)], None);
                let rests = samples.last().unwrap().reference;
                assert!(
                    (rests - to).abs() < 0.5,
                    "{margin:?} {before} V for {before_s} s: {rests} V instead of {to} V"
                );
            }
        }
    }
}

#[test]
fn with_a_sensor_nothing_depends_on_the_fall_back() {
    let feedback = Some(Feedback { noise_v: 1.0, interval_s: 1.0 / RATE_HZ, ..Feedback::TYPICAL });
    let codes = |fall_back: f64, feedback: Option<Feedback>| {
        let margin = Margin { time_constant: 0.05, share: 0.0, gain: 0.0, overshoot: OVERSHOOT, fall_back };
        let settings = settings(Compensation::Robust(margin), feedback);
        let targets = [(0.0, 1.0), (100.0, 8.0), (200.0, 8.0)];
        let samples = run(&settings, &SpringError::default(), &targets, feedback.map(|_| 1.0));
        samples.iter().map(|sample| sample.code).collect::<Vec<_>>()
    };
    assert!(codes(0.25, feedback) == codes(0.0, feedback));
    assert!(codes(0.25, None) != codes(0.0, None), "there is a fall back");
}

/// Errors of the time constant for which the lead of the end is negative: only the step back takes the springs there.
#[test]
fn springs_also_fall_back_where_the_time_constant_is_known_badly() {
    let codes = |fall_back: f64| {
        let margin = Margin { time_constant: 0.2, share: 0.0, gain: 0.0, overshoot: OVERSHOOT, fall_back };
        let settings = settings(Compensation::Robust(margin), None);
        let samples = run(&settings, &SpringError::default(), &[(0.0, 1.0), (100.0, 30.0)], None);
        samples.iter().map(|sample| sample.code).collect::<Vec<_>>()
    };
    assert!(codes(0.25) != codes(0.0));
}

/// A sensor with a noise of 1 V. A step that takes longer is as fast as that spring can be.
#[test]
fn with_a_sensor_every_spring_within_10_percent_takes_0_6_s_or_the_shortest_time() {
    let margin = Margin { time_constant: 0.1, share: 0.1, gain: 0.1, overshoot: OVERSHOOT, ..Margin::TYPICAL };
    let feedback = Some(Feedback { noise_v: 1.0, interval_s: 1.0 / RATE_HZ, ..Feedback::TYPICAL });
    let settings = settings(Compensation::Robust(margin), feedback);
    let stair = [&[(0.0, 1.0)][..], &[100.0, 200.0, 300.0, 400.0, 500.0].map(|target| (target, 8.0))].concat();
    let allowed = Allowed { amplifier: settings.amplifier, overshoot: OVERSHOOT };
    for spring in springs(&margin) {
        let gained = DifferingSpring::new(&PlantFile::from(settings.plant), &spring);
        let known = RobustBound::new(&gained.file, allowed).unwrap();
        let each = steps(&settings, &spring, &stair, Some(1.0));
        for (pair, (late_s, overshoot)) in stair.windows(2).zip(each) {
            let (from, to) = (pair[0].0 / gained.gain, pair[1].0 / gained.gain);
            let shortest_s = || known.shortest_s(from, to, &SpringError::default()).unwrap();
            println!("{spring:?} to {} V: {late_s} s, {:.2} %", pair[1].0, 100.0 * overshoot);
            assert!(late_s <= 0.6 || late_s <= 1.05 * shortest_s(), "{spring:?} to {} V: {late_s} s", pair[1].0);
            assert!(overshoot <= OVERSHOOT, "{spring:?} to {} V: {overshoot}", pair[1].0);
        }
    }
}

/// The voltage rises step by step, and falls so in a step downward: a share that is twice the model's shows before the target is passed.
#[test]
fn with_a_sensor_a_share_far_beyond_the_margin_overshoots_little_both_ways() {
    let margin = Margin { time_constant: 0.1, share: 0.1, gain: 0.1, overshoot: OVERSHOOT, ..Margin::TYPICAL };
    let feedback = Some(Feedback { noise_v: 1.0, interval_s: 1.0 / RATE_HZ, ..Feedback::TYPICAL });
    let settings = settings(Compensation::Robust(margin), feedback);
    let spring = SpringError { share: 1.0, ..SpringError::default() };
    for targets in [[(0.0, 1.0), (100.0, 8.0)], [(900.0, 20.0), (800.0, 8.0)]] {
        let (_, overshoot) = last_step(&settings, &spring, &targets, Some(1.0));
        println!("{targets:?}: {:.2} %", 100.0 * overshoot);
        assert!(overshoot <= 0.03, "{targets:?}: {overshoot}");
    }
}

/// The largest change of the voltage in a tick of `rate_hz` toward 500 V, or from there to 100 V, in V, as the codes show it.
fn fastest_v(rate_hz: f64, sensor_noise_v: Option<f64>, downward: bool) -> f64 {
    let margin = Margin { time_constant: 0.1, share: 0.1, gain: 0.1, overshoot: OVERSHOOT, ..Margin::TYPICAL };
    let feedback = sensor_noise_v.map(|noise_v| Feedback { noise_v, interval_s: 1.0 / rate_hz, ..Feedback::TYPICAL });
    let settings = Settings { rate_hz, ..settings(Compensation::Robust(margin), feedback) };
    let config = settings.validate().unwrap().quantize();
    let ticks = |volts, seconds: f64| std::iter::repeat_n(volts, (seconds * rate_hz) as usize);
    let targets: Vec<f64> = ticks(0.0, 1.0).chain(ticks(500.0, 20.0)).chain(ticks(100.0, 2.0)).collect();
    let spring = DifferingSpring::new(&PlantFile::from(settings.plant), &SpringError::default());
    let samples = spring.closed_loop(&config, &targets, 1.0 / rate_hz, sensor_noise_v).unwrap();
    let step = ((if downward { 21.0 } else { 1.0 }) * rate_hz) as usize;
    let volts: Vec<f64> = samples[step - 1..].iter().map(|sample| f64::from(sample.code.0) * 1000.0 / 4095.0).collect();
    let sign = if downward { -1.0 } else { 1.0 };
    let within_s = 1.5;
    volts.windows(2).take((within_s * rate_hz) as usize).map(|pair| sign * (pair[1] - pair[0])).fold(0.0, f64::max)
}

/// At every rate, in both directions; without a sensor nothing holds it back.
#[test]
fn with_a_sensor_the_voltage_rises_by_20_v_in_a_millisecond() {
    let code_v = 1000.0 / 4095.0;
    for (rate_hz, most_v) in [(500.0, 40.0), (1000.0, 20.0), (2000.0, 10.0)] {
        for downward in [false, true] {
            let fastest = fastest_v(rate_hz, Some(1.0), downward);
            assert!((fastest - most_v).abs() <= code_v, "{rate_hz} Hz, downward {downward}: {fastest} V");
            let free = fastest_v(rate_hz, None, downward);
            assert!(free > 100.0, "{rate_hz} Hz, downward {downward}, no sensor: {free} V");
        }
    }
}

/// The control law in double precision, written from its equations, gives the voltages of the tick, on a plain and on an extended spring.
#[test]
fn the_fixed_point_tick_agrees_with_double_precision() {
    let text = "schema = 1\n[relaxation]\nshare = 0.1\ntau_s = [2.0, 9.0]\nweights = [0.5, 0.4]\n\
                [memory]\ndirect = 0.9\nthresholds_v = [30.0]\nweights = [0.1]\n";
    let margin = Margin { time_constant: 0.05, share: 0.1, gain: 0.01, overshoot: OVERSHOOT, ..Margin::TYPICAL };
    for file in [PlantFile::from(Settings::PAPER.plant), parse("extended", text).unwrap()] {
        let off_v = max_fixed_point_error(&on_stair(&file, margin));
        assert!(off_v > 0.0 && off_v < 0.05, "{off_v} V");
    }
}

/// The springs fall back and return in the same ticks but for one: there the stiffness differs by the depth of the fall back. Each extension
/// of the spring alone, and all of them.
#[test]
fn the_fixed_point_tick_falls_back_with_double_precision() {
    let lags = "schema = 1\n[relaxation]\nshare = 0.1\ntau_s = [5.0, 7.0]\nweights = [0.6, 0.3]\n";
    let varying = "schema = 1\n[relaxation]\nshare = 0.1\ntau_s = 5.5\ntau_high_s = 6.0\n";
    let memory = "[memory]\ndirect = 0.95\nthresholds_v = [30.0]\nweights = [0.1]\n";
    let law = "[law]\nvoltage_v = [0.0, 300.0, 1000.0]\nstiffness = [0.0, 270.0, 950.0]\n";
    let leakage = "[leakage]\nshare = 0.05\ntau_s = 60.0\n";
    let one = "schema = 1\n[relaxation]\nshare = 0.1\ntau_s = 5.5\n";
    let extended = [
        lags.to_owned(),
        varying.to_owned(),
        [one, memory].concat(),
        [one, law].concat(),
        [one, leakage].concat(),
        [lags, memory, law, leakage].concat(),
    ];
    let extended = extended.iter().map(|text| parse("extended", text).unwrap());
    let margin = Margin { share: 0.0, fall_back: 0.25, ..Margin::TYPICAL };
    for file in [PlantFile::from(Settings::PAPER.plant)].into_iter().chain(extended) {
        let (samples, without) = (on_stair(&file, margin), on_stair(&file, Margin { fall_back: 0.0, ..margin }));
        let apart = |pair: (&Sample, &Sample)| pair.0.code != pair.1.code;
        let apart = samples.iter().zip(&without).filter(|pair| apart(*pair)).count();
        let off = samples.iter().filter(|sample| (sample.stiffness.to_f64() - sample.reference).abs() > 0.05).count();
        assert!(apart > 10_000, "the voltage is another one in {apart} ticks only: {file:?}");
        // Each of the five steps has two of these ticks.
        assert!(off <= 10, "{off} ticks: {file:?}");
    }
}

/// The robust controller on the ideal stair with a converter of 16 bits.
fn on_stair(file: &PlantFile, margin: Margin) -> Vec<Sample> {
    let settings = Settings {
        rate_hz: RATE_HZ,
        plant: file.extended(),
        compensation: Compensation::Robust(margin),
        amplifier: Amplifier { dac_bits: 16, ..Amplifier::up_to(1000.0) },
        feedback: None,
    };
    let experiment = Experiment { name: "stair".to_owned(), schedule: Schedule::ideal_stair(), settings };
    experiment.run(|_, _| ()).unwrap().with
}

/// A spring that is known exactly: the codes are those of the time-optimal controller.
#[test]
fn without_errors_it_is_the_time_optimal_controller() {
    let margin = Margin { time_constant: 0.0, share: 0.0, gain: 0.0, overshoot: OVERSHOOT, ..Margin::TYPICAL };
    let codes = |compensation| {
        let settings = settings(compensation, None);
        let config = settings.validate().unwrap().quantize();
        let targets: Vec<f64> = [100.0, 480.0, 200.0].into_iter().flat_map(|v| std::iter::repeat_n(v, 3000)).collect();
        let spring = DifferingSpring::new(&PlantFile::from(settings.plant), &SpringError::default());
        let samples = spring.closed_loop(&config, &targets, 1.0 / RATE_HZ, None).unwrap();
        samples.iter().map(|sample| sample.code).collect::<Vec<_>>()
    };
    assert!(codes(Compensation::Robust(margin)) == codes(Compensation::TimeOptimal(Approach::DEAD_BEAT)));
}

/// Steps of other sizes, downward, to the ends of the range, and behind slow amplifiers: no spring overshoots by more, and the slowest one
/// is not later than without a fall back.
#[test]
fn a_fall_back_near_the_limits_overshoots_no_more_and_is_not_later() {
    for slew_v_per_s in [None, Some(5000.0), Some(1000.0), Some(300.0)] {
        let amplifier = Amplifier { slew_v_per_s, ..Amplifier::up_to(1000.0) };
        for (from, to) in [
            (0.0, 30.0),
            (0.0, 400.0),
            (100.0, 800.0),
            (600.0, 590.0),
            (800.0, 150.0),
            (30.0, 0.0),
            (700.0, 900.0),
            (900.0, 980.0),
            (100.0, 5.0),
        ] {
            let slowest = |fall_back: f64| {
                let margin = Margin { time_constant: 0.06, share: 0.0, gain: 0.0, overshoot: OVERSHOOT, fall_back };
                let settings = Settings { amplifier, ..settings(Compensation::Robust(margin), None) };
                let spring =
                    |part: i32| SpringError { time_constant: 0.02 * f64::from(part), ..SpringError::default() };
                let each = (-3..=3).map(|part| last_step(&settings, &spring(part), &[(from, 100.0), (to, 40.0)], None));
                each.fold((0.0, 0.0), |(a, b), (c, d)| (f64::max(a, c), f64::max(b, d)))
            };
            let (without, with) = (slowest(0.0), slowest(0.25));
            println!("{slew_v_per_s:?} {from} to {to} V: {without:?} {with:?}");
            assert!(with.0 <= 1.01 * without.0 + 0.01, "{slew_v_per_s:?} {from} to {to} V: {without:?} {with:?}");
            // A code is 2.4 % of the smallest step.
            assert!(
                with.1 <= f64::max(without.1, OVERSHOOT) + 5e-4,
                "{slew_v_per_s:?} {from} to {to} V: {without:?} {with:?}"
            );
        }
    }
}

/// Each step of a stair begins 10 s after the one before, when the springs still differ. Measured from where the spring is then, a fall back
/// saves a tenth of the time; to 3 V below the target, which slow springs approach from below, it costs a little.
#[test]
fn a_fall_back_saves_a_tenth_of_the_time_on_a_stair() {
    let stair = [&[(0.0, 1.0)][..], &[100.0, 200.0, 300.0, 400.0, 500.0].map(|target| (target, 10.0))].concat();
    let slowest = |fall_back: f64| {
        let margin = Margin { time_constant: 0.05, share: 0.0, gain: 0.0, overshoot: OVERSHOOT, fall_back };
        let settings = settings(Compensation::Robust(margin), None);
        let springs =
            (-5..=5).map(|part| SpringError { time_constant: 0.01 * f64::from(part), ..SpringError::default() });
        let worst = |each: Vec<Vec<f64>>| -> Vec<f64> {
            (0..5).map(|step| each.iter().map(|times| times[step]).fold(0.0, f64::max)).collect()
        };
        let of_change =
            |spring: SpringError| steps(&settings, &spring, &stair, None).iter().map(|step| step.0).collect();
        let to_target = |spring: SpringError| {
            let samples = run(&settings, &spring, &stair, None);
            let late = |(step, held): (usize, &[Sample])| {
                let below = |sample: &Sample| sample.reference < 100.0 * (step + 1) as f64 - 3.0;
                held.iter().rposition(below).map_or(0.0, |at| (at + 1) as f64 / RATE_HZ)
            };
            samples[ticks(1.0)..].chunks(ticks(10.0)).enumerate().map(late).collect()
        };
        (worst(springs.clone().map(of_change).collect()), worst(springs.map(to_target).collect()))
    };
    let (without, with) = (slowest(0.0), slowest(0.25));
    println!("without {without:?}, with {with:?}");
    assert!(with.0.iter().zip(&without.0).all(|(with, without)| with < &(0.9 * without)), "{without:?} {with:?}");
    assert!(with.1.iter().zip(&without.1).all(|(with, without)| with < &(1.1 * without)), "{without:?} {with:?}");
}
