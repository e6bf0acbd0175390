//! The variables of a unit. A value reference is the variable's index in the list.
//!
//! Parameters are the options of the command and the numbers of the plant file, by their names there: `spring.` is the simulated
//! spring, `model.` the controller's model of it.

use model::Margin;
use simulation::control_loop::{CONTROLLERS, Options};
use simulation::plant_file::PlantFile;

use crate::unit::Unit;
use crate::variable::{Form, Number, Output, Role, Setting, Variable};

/// Slew limit, in V/s, that stands for none: at every rate a tick is long enough for any change.
const NO_SLEW_LIMIT: f64 = 1e9;
/// Largest magnitude of a voltage that the tick accepts, in V.
const LARGEST_V: f64 = 2000.0;

/// The variables of a unit, in the order of their value references.
pub fn variables(unit: &Unit) -> Vec<Variable> {
    let mut all = vec![Variable::new("time", Role::Time, "s", "Time")];
    let options = &unit.options;
    if unit.kind.has_controller() {
        all.extend(settings(options));
        all.extend(
            numbers("model", Role::Model, &unit.plant)
                .into_iter()
                .filter(|it| !matches!(it.role, Role::Model(number) if number.is_of_reading())),
        );
    } else {
        all.push(rate(options));
    }
    if unit.kind.has_spring() {
        all.extend(numbers("spring", Role::Spring, &unit.plant));
    }
    all.push(input(unit));
    all.extend(outputs(unit));
    all
}

fn rate(options: &Options) -> Variable {
    let description = "Ticks per second; steps are whole numbers of ticks";
    Variable::new("rate_hz", Role::Setting(Setting::RateHz), "Hz", description)
        .within(100.0, 10_000.0)
        .at(options.rate_hz)
}

fn settings(options: &Options) -> [Variable; 14] {
    let setting = |name, setting, unit, description| Variable::new(name, Role::Setting(setting), unit, description);
    let part = |name, of, description| setting(name, of, "", description);
    let controllers = CONTROLLERS.len() as f64;
    let margin = options.margin.unwrap_or(Margin::TYPICAL);
    [
        rate(options),
        Variable {
            form: Form::Controller,
            ..setting("controller", Setting::Controller, "", "The pre-compensator")
                .within(1.0, controllers)
                .at(1.0 + f64::from(options.controller as u8))
        },
        setting(
            "limit_v",
            Setting::LimitV,
            "V",
            "Highest voltage of the amplifier; the plant file's limit acts where it is lower",
        )
        .within(50.0, 1000.0)
        .at(options.limit_v),
        setting("min_v", Setting::MinV, "V", "Lowest voltage of the amplifier").within(0.0, 990.0).at(options.min_v),
        setting("slew_v_per_s", Setting::SlewVPerS, "V/s", "Slew limit of the amplifier; 1e9 for none")
            .within(1.0, NO_SLEW_LIMIT)
            .at(options.slew_v_per_s.unwrap_or(NO_SLEW_LIMIT)),
        Variable {
            form: Form::Integer,
            ..setting("dac_bits", Setting::DacBits, "", "Width of the DAC in bits")
                .within(8.0, 16.0)
                .at(f64::from(options.dac_bits))
        },
        setting("kp", Setting::Kp, "", "Proportional gain of the controller paper").within(0.001, 100.0).at(options.kp),
        Variable {
            lowest: Some(0.0),
            ..setting("ki", Setting::Ki, "1/s", "Integral gain of the controller paper").at(options.ki)
        },
        setting(
            "approach_s",
            Setting::ApproachS,
            "s",
            "Time constant of the approach to the target of the controller fast",
        )
        .within(0.0, 1.0)
        .at(options.approach_s.unwrap_or(0.0)),
        part(
            "known_tau",
            Setting::KnownTau,
            "Error of the time constants within which the controller robust knows them",
        )
        .within(0.0, 0.25)
        .at(margin.time_constant),
        part("known_share", Setting::KnownShare, "Error of the share within which the controller robust knows it")
            .within(0.0, 0.25)
            .at(margin.share),
        part("known_gain", Setting::KnownGain, "Error of the gain within which the controller robust knows it")
            .within(0.0, 0.25)
            .at(margin.gain),
        part("overshoot", Setting::Overshoot, "Overshoot that the controller robust may cause, as a part of a step")
            .within(0.0, 0.2)
            .at(margin.overshoot),
        part(
            "fall_back",
            Setting::FallBack,
            "Part of a step by which the controller robust may let all springs fall back for a while",
        )
        .within(0.0, 0.5)
        .at(margin.fall_back),
    ]
}

/// The numbers that a plant file has, below `part`.
fn numbers(part: &str, role: fn(Number) -> Role, plant: &PlantFile) -> Vec<Variable> {
    let mut plant = plant.clone();
    let share = if plant.extended().plain().is_some() { 0.9 } else { 10.0 };
    let reading = reading_unit(&plant).to_owned();
    let per_volt = if reading.is_empty() { String::new() } else { format!("{reading}/V") };
    let list = |table: &'static str, key: &'static str, count: usize, number: fn(usize) -> Number| {
        (0..count).map(move |index| (format!("{table}.{key}[{}]", index + 1), number(index)))
    };
    // The first point of a law is the origin.
    let is_free = |number: &Number| !matches!(number, Number::LawVoltage(0) | Number::LawStiffness(0));
    let one = |name: &str, number| std::iter::once((name.to_owned(), number));
    let (lags, weights) = (plant.relaxation.tau_s.len(), plant.relaxation.weights.len());
    let plays = plant.memory.as_ref().map_or(0, |memory| memory.thresholds_v.len());
    let points = plant.law.as_ref().map_or(0, |law| law.voltage_v.len());
    let all = one("relaxation.share", Number::Share)
        .chain(list("relaxation", "tau_s", lags, Number::Tau))
        .chain(list("relaxation", "weights", weights, Number::Weight))
        .chain(one("relaxation.tau_high_s", Number::TauHigh))
        .chain(one("relaxation.tau_high_at_v", Number::TauHighAt))
        .chain(one("memory.direct", Number::Direct))
        .chain(list("memory", "thresholds_v", plays, Number::Threshold))
        .chain(list("memory", "weights", plays, Number::PlayWeight))
        .chain(list("law", "voltage_v", points, Number::LawVoltage))
        .chain(list("law", "stiffness", points, Number::LawStiffness))
        .chain(one("leakage.share", Number::LeakageShare))
        .chain(one("leakage.tau_s", Number::LeakageTau))
        .chain(one("reading.gain", Number::ReadingGain))
        .chain(one("reading.zero", Number::ReadingZero));
    all.filter(|(_, number)| is_free(number))
        .filter_map(|(name, number)| {
            let start = *number.place(&mut plant)?;
            let (unit, range, description) = about(number, share);
            let unit = match number {
                Number::ReadingGain => &per_volt,
                Number::ReadingZero => &reading,
                _ => unit,
            };
            let variable = Variable::new(&format!("{part}.{name}"), role(number), unit, description).at(start);
            Some(match range {
                Some((lowest, highest)) => variable.within(lowest, highest),
                None => variable,
            })
        })
        .collect()
}

/// Unit, range and description of a number; `share` is the largest instantaneous share.
const fn about(number: Number, share: f64) -> (&'static str, Option<(f64, f64)>, &'static str) {
    match number {
        Number::Share => ("", Some((0.0, share)), "Part of a change that is instantaneous"),
        Number::Tau(_) => ("s", Some((2e-4, 1e4)), "Time constant of a relaxation; at least two ticks"),
        Number::Weight(_) => ("", Some((-10.0, 10.0)), "Weight of a relaxation"),
        Number::TauHigh => ("s", Some((4e-4, 1e4)), "First time constant at the voltage tau_high_at_v, or at 500 V"),
        Number::TauHighAt => ("V", None, "Voltage of tau_high_s"),
        Number::Direct => ("", Some((-10.0, 10.0)), "Weight of the voltage itself beside the play operators"),
        Number::Threshold(_) => ("V", Some((0.0, 1000.0)), "Half the width of a play operator"),
        Number::PlayWeight(_) => ("", Some((-10.0, 10.0)), "Weight of a play operator"),
        Number::LawVoltage(_) => ("V", Some((0.0, 1000.0)), "Voltage of a point of the static law"),
        Number::LawStiffness(_) => ("V", Some((-LARGEST_V, LARGEST_V)), "Stiffness at a point of the static law"),
        Number::LeakageShare => ("", Some((0.0, 1.0)), "Part of the stiffness that leaks away"),
        Number::LeakageTau => ("s", Some((0.01, 1e5)), "Time constant of the leakage; at least 100 ticks"),
        Number::ReadingGain => ("", None, "Change of the reading per volt of stiffness"),
        Number::ReadingZero => ("", None, "Reading at 0 V"),
    }
}

/// Name of the unit of a plant file's readings; empty if the file does not say.
fn reading_unit(plant: &PlantFile) -> &str {
    plant.units.as_ref().and_then(|units| units.reading.as_deref()).unwrap_or_default()
}

fn input(unit: &Unit) -> Variable {
    let (name, description) = if unit.kind.has_controller() {
        ("target_v", "Desired stiffness as the equivalent static voltage, held during a step")
    } else {
        ("applied_v", "Voltage across the spring, held during a step")
    };
    Variable::new(name, Role::Input, "V", description).within(-LARGEST_V, LARGEST_V)
}

fn outputs(unit: &Unit) -> Vec<Variable> {
    let output = |name, output, unit, description| Variable::new(name, Role::Output(output), unit, description);
    let mut all = Vec::new();
    if unit.kind.has_controller() {
        let code =
            output("dac_code", Output::Code, "", "Code of the DAC in the step's last tick").within(0.0, 65_535.0);
        let limits = "Limits that acted in the step's last tick: upper 1, lower 2, slew 4, target 8";
        all.extend([
            output("applied_v", Output::Applied, "V", "Voltage of the DAC's code in the step's last tick"),
            Variable { form: Form::Integer, ..code },
            output(
                "estimate_v",
                Output::Estimate,
                "V",
                "Stiffness that the controller estimates, just after the voltage was applied",
            ),
            Variable { form: Form::Integer, ..output("limits", Output::Limits, "", limits).within(0.0, 15.0) },
        ]);
    }
    if unit.kind.has_spring() {
        let description =
            "Stiffness as the equivalent static voltage, just after the step's last tick applied the voltage";
        all.push(output("stiffness_v", Output::Stiffness, "V", description));
        if let Some(reading) = unit.plant.reading {
            let description = "Reading of the stiffness in the unit of the plant file";
            all.push(output("reading", Output::Reading, reading_unit(&unit.plant), description).at(reading.zero));
        }
    }
    all
}
