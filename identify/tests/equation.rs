//! Equations of records of laws that the diagnosis does not have: the simulator of this file steps through each law in small steps of
//! time and shares nothing with the crate.

use std::f64::consts::TAU;

use identify::equation::fitted::Fitted;
use identify::equation::report::{Rivals, equation};
use identify::fit::budget::{Budget, Effort};
use identify::fit::engine::Engine;
use identify::nominal::best_linear;
use identify::plant::base::Base;
use identify::record::data::Data;
use identify::record::normalisation::Normalisation;
use identify::record::observed::Observed;
use identify::{Input, Options, Stop, Verdict, answer::Equation, diagnose};
use random_numbers::Lcg64;
use simulation::plant_file::Reading;
use simulation::record::{Record, Row};
use simulation::units::Units;

const ROWS: usize = 1600;
const ROW_S: f64 = 0.15;
const PARTS: usize = 50;

/// Independent, nearly normal numbers of variance 1.
fn noise(seed: u64) -> impl FnMut() -> f64 {
    let mut numbers = Lcg64::new(seed.wrapping_mul(0x9e37_79b9_7f4a_7c15) | 1);
    move || numbers.normal()
}

/// A stair of unequal steps up and down, in V, held for 60 rows each, after a rest.
fn command(row: usize) -> f64 {
    const LEVELS: [f64; 13] = [0.0, 150.0, 320.0, 500.0, 260.0, 80.0, 400.0, 0.0, 230.0, 450.0, 120.0, 350.0, 40.0];
    LEVELS[row / 60 % LEVELS.len()]
}

/// A record of a law with noise of 1 V: `law(voltage, time, step of time)` returns the stiffness at the end of the step.
fn record(seed: u64, mut law: impl FnMut(f64, f64, f64) -> f64) -> Record {
    let mut noise = noise(seed);
    let mut before = 0.0;
    let row = |row: usize| {
        let (time_s, voltage_v) = (ROW_S * row as f64, command(row));
        let dt = ROW_S / PARTS as f64;
        if row > 0 {
            for part in 1..=PARTS {
                law(before, time_s - ROW_S + dt * part as f64, dt);
            }
        }
        before = voltage_v;
        Row { line: row + 2, time_s, voltage_v, measured: Some(law(voltage_v, time_s, 0.0) + noise()) }
    };
    Record { name: "law".into(), rows: (0..ROWS).map(row).collect() }
}

/// One Euler step of the paper's spring with a time constant; returns the stiffness.
fn spring(state: &mut f64, voltage_v: f64, tau_s: f64, dt: f64) -> f64 {
    *state += dt / tau_s * (voltage_v - *state);
    voltage_v / 11.0 + *state * 10.0 / 11.0
}

/// The equation of a record compared with a spring, whatever the verdict would be.
fn found(record: &Record, base: &Base, effort: Effort, stop: Stop) -> (Option<(Fitted, Equation)>, Budget) {
    let normalisation = Normalisation::of(record, base.file(), Input::Hold, Units::default());
    let base = base.normalised(&normalisation);
    let data = Data::thinned(&normalisation.record(record), Input::Hold, 1, &normalisation);
    let observed = Observed::new(&data);
    let left = Engine::new(&data, &observed, &base).baseline_residual;
    let linear = best_linear(std::slice::from_ref(record), Input::Hold).expect("a linear model");
    let normalised: Vec<f64> = linear.held_out.iter().map(|error| error / normalisation.scales.reading).collect();
    let rivals = Rivals {
        nominal: base.file(),
        nominal_residual: &left,
        extended: base.file(),
        extended_residual: &left,
        poles: &linear.poles,
        linear_residual: &normalised,
    };
    let budget = Budget::new(effort, data.rows(), stop);
    (equation(&data, &observed, &rivals, &budget), budget)
}

fn of(record: &Record) -> Option<Equation> {
    found(record, &Base::paper(), Effort::Normal, Stop::default()).0.map(|(_, equation)| equation)
}

fn value(equation: &Equation, name: &str) -> f64 {
    let parameter = equation.parameters.iter().find(|(other, _)| other == name).map(|(_, parameter)| parameter);
    parameter.unwrap_or_else(|| panic!("{name}: {equation:?}")).value
}

/// True if an equation is at the noise floor of 1 V.
fn at_floor(equation: &Equation) -> bool {
    equation.held_out.equation < 1.06
}

fn by_direction(seed: u64) -> Record {
    let (mut state, mut last, mut sign) = (0.0, 0.0, 0.0);
    record(seed, move |v, _, dt| {
        if v != last {
            (sign, last) = ((v - last).signum(), v);
        }
        spring(&mut state, v * (1.0 + 0.06 * sign), 5.5, dt)
    })
}

#[test]
fn gain_by_direction_is_recovered_with_its_size() {
    let equation = of(&by_direction(1)).expect("an equation");
    assert_eq!(equation.blocks, ["direction-gain"], "{equation:?}");
    assert!(at_floor(&equation) && (value(&equation, "a1") - 0.06).abs() < 0.002, "{equation:?}");
    assert!(
        equation.held_out.extended > 2.0 && equation.nats_over_linear > 100.0 && equation.nats_over_extended > 100.0
    );
    assert!(equation.plant.is_none() && equation.no_plant.is_some());
}

/// The leakage starts above a threshold, so that no linear model and no cause describes it.
fn leakage_above(seed: u64) -> Record {
    let (mut state, mut lost) = (0.0, 0.0);
    record(seed, move |v, _, dt| {
        lost += dt / 14.0 * ((v - 200.0f64).max(0.0) - lost);
        spring(&mut state, v, 5.5, dt) - 0.3 * lost
    })
}

#[test]
fn leakage_above_a_threshold_is_recovered_with_its_parameters() {
    let equation = of(&leakage_above(2)).expect("an equation");
    assert_eq!(equation.blocks, ["dead-band"], "{equation:?}");
    assert!(at_floor(&equation) && (value(&equation, "r1") - 200.0).abs() < 8.0, "{equation:?}");
    let time_constants = ["T1", "T2"].map(|name| value(&equation, name));
    assert!(time_constants.iter().any(|tau_s| (tau_s - 14.0).abs() < 1.0), "{equation:?}");
}

#[test]
fn swinging_gain_is_recovered_with_its_frequency() {
    let mut state = 0.0;
    let law = move |v: f64, t: f64, dt: f64| spring(&mut state, v, 5.5, dt) * (1.0 + 0.06 * (TAU * t / 90.0).sin());
    let equation = of(&record(3, law)).expect("an equation");
    assert_eq!(equation.blocks, ["periodic-gain"], "{equation:?}");
    assert!(at_floor(&equation) && (value(&equation, "f1") * 90.0 - 1.0).abs() < 0.02, "{equation:?}");
}

/// Stress-activated flow: `dw/dt = V/tau sinh((v - w)/V)`.
#[test]
fn flow_that_is_fast_under_a_large_stress_is_recovered() {
    let mut state = 0.0;
    let law = move |v: f64, _: f64, dt: f64| {
        state += dt * 150.0 / 5.5 * f64::sinh((v - state) / 150.0);
        v / 11.0 + state * 10.0 / 11.0
    };
    let equation = of(&record(4, law)).expect("an equation");
    assert_eq!(equation.blocks, ["lag-by-distance"], "{equation:?}");
    assert!(at_floor(&equation) && (value(&equation, "a1") - 500.0 / 150.0).abs() < 0.3, "{equation:?}");
}

/// Steps larger than twice the radius show its product with the part only.
#[test]
fn play_is_recovered_with_its_loop() {
    let (mut state, mut play) = (0.0, 0.0f64);
    let law = move |v: f64, _: f64, dt: f64| {
        play = play.clamp(v - 40.0, v + 40.0);
        spring(&mut state, 0.4 * v + 0.6 * play, 5.5, dt)
    };
    let equation = of(&record(5, law)).expect("an equation");
    assert_eq!(equation.blocks, ["play"], "{equation:?}");
    assert!(
        at_floor(&equation) && (value(&equation, "r1") * value(&equation, "a1") - 24.0).abs() < 1.0,
        "{equation:?}"
    );
}

#[test]
fn dead_band_in_front_of_the_relaxation_becomes_a_plant_file() {
    let mut state = 0.0;
    let law = move |v: f64, _: f64, dt: f64| spring(&mut state, (v - 45.0).max(0.0), 5.5, dt);
    let equation = of(&record(6, law)).expect("an equation");
    assert_eq!(equation.blocks, ["dead-band"], "{equation:?}");
    let text = equation.plant.as_ref().expect("a plant file");
    let file: simulation::plant_file::PlantFile = toml::from_str(text).expect("a plant file");
    file.check().expect("a spring that the tick accepts");
    let law = file.law.expect("a law");
    assert!((law.stiffness.last().expect("a point") - 455.0).abs() < 3.0 && law.stiffness[0] == 0.0, "{text}");
    assert!(
        (file.relaxation.tau_s[0] - 5.5).abs() < 0.1 && (file.relaxation.share - 1.0 / 11.0).abs() < 0.005,
        "{text}"
    );
}

/// Neither the paper's spring nor a linear spring of another time constant leaves anything that an equation could gain, in white
/// noise and in noise that follows itself.
#[test]
fn records_without_a_departure_have_no_equation() {
    for seed in 10..16 {
        let mut state = 0.0;
        let tau_s = if seed % 2 == 0 { 5.5 } else { 9.0 };
        let mut plain = record(seed, move |v, _, dt| spring(&mut state, v, tau_s, dt));
        if seed >= 13 {
            let (mut more, mut slow) = (noise(seed + 100), 0.0);
            for row in &mut plain.rows {
                slow = 0.95 * slow + 0.6 * more();
                row.measured = row.measured.map(|reading| reading + slow);
            }
        }
        if let Some(equation) = of(&plain) {
            panic!("seed {seed}: {equation:?}");
        }
    }
}

/// A record and its spring in milliseconds and 10 mV have the equation that they have in s and V, with its parameters in these units.
#[test]
fn scales_of_time_voltage_and_reading_change_no_equation() {
    let plain = by_direction(7);
    let row = |row: &Row| Row { time_s: 1e-3 * row.time_s, voltage_v: 0.01 * row.voltage_v, ..*row };
    let scaled = Record { name: plain.name.clone(), rows: plain.rows.iter().map(row).collect() };
    let plain_equation = of(&plain).expect("an equation");
    let mut file = Base::paper().file().clone();
    file.relaxation.tau_s = vec![5.5e-3];
    file.reading = Some(Reading { gain: 100.0, zero: 0.0 });
    let base = Base::new(file).expect("a spring");
    let (_, equation) = found(&scaled, &base, Effort::Normal, Stop::default()).0.expect("an equation");
    assert_eq!((&equation.text, &equation.blocks), (&plain_equation.text, &plain_equation.blocks));
    let ratio = |name: &str| value(&equation, name) / value(&plain_equation, name);
    for (name, expected) in [("T1", 1e-3), ("a1", 1.0), ("c1", 100.0), ("c2", 100.0)] {
        assert!((ratio(name) / expected - 1.0).abs() < 2e-3, "{name}: {}", ratio(name));
    }
}

/// The work stays within that of a diagnosis, but for the step that is under way; none is done after a stop.
#[test]
fn work_is_bounded_and_a_stop_ends_it() {
    // Steps at random times: nothing in the grammar fits.
    let mut random = noise(20);
    let (mut state, mut level) = (0.0, 0.0);
    let law = move |v: f64, _: f64, dt: f64| {
        level = 0.9995 * level + 0.4 * if dt > 0.0 { random() } else { 0.0 };
        spring(&mut state, v + level * v / 100.0, 5.5, dt)
    };
    let wild = record(8, law);
    let (_, budget) = found(&wild, &Base::paper(), Effort::Normal, Stop::default());
    assert!(budget.spent() < budget.total() * 11 / 10, "{} of {}", budget.spent(), budget.total());
    let stop = Stop::default();
    stop.request();
    let (none, budget) = found(&wild, &Base::paper(), Effort::Normal, stop);
    assert!(none.is_none() && budget.spent() < budget.total() / 20, "{}", budget.spent());
}

#[test]
fn only_an_unexplained_record_has_an_equation_and_none_with_quick_effort() {
    let record = leakage_above(9);
    let report = diagnose(&record, &Options::default()).expect("a report");
    assert_eq!(report.verdict, Verdict::Unexplained);
    let text = report.equation.expect("an equation");
    assert_eq!(report.equation_details.expect("details").text, text);
    assert!(text.is_ascii() && text.contains("r1"), "{text}");
    let quick = diagnose(&record, &Options { effort: Effort::Quick, ..Options::default() }).expect("a report");
    assert!(quick.equation.is_none() && quick.equation_details.is_none());

    let mut state = 0.0;
    let plain = self::record(21, move |v, _, dt| spring(&mut state, 1.1 * v, 5.5, dt));
    let report = diagnose(&plain, &Options::default()).expect("a report");
    assert_eq!(report.verdict, Verdict::Explained);
    assert!(report.equation.is_none());
}
