//! The settings of C as those of the tick, and back.

use model::extended;
use model::{Amplifier, Compensation, ExtendedPlant, Feedback, Gains, Margin, OutOfRange, Settings};

use crate::settings::{All, FAST, Known, NONE, PAPER, ROBUST, Sensor, Spring};

impl All {
    /// The settings as C has them. Of lists that are longer than those of the tick, which refuses them, the beginning.
    pub fn new(settings: &Settings<ExtendedPlant<'_>>) -> Self {
        let Amplifier { full_scale_v, min_v, max_v, slew_v_per_s, dac_bits } = settings.amplifier;
        let mut all = Self {
            rate_hz: settings.rate_hz,
            full_scale_v,
            min_v,
            max_v,
            slew_v_per_s: slew_v_per_s.unwrap_or(0.0),
            dac_bits,
            spring: Spring::new(&settings.plant),
            sensor: settings.feedback.map(Sensor::from).unwrap_or_default(),
            ..Self::paper()
        };
        match settings.compensation {
            Compensation::None => all.controller = NONE,
            Compensation::ProportionalIntegral(Gains { proportional, integral_per_s }) => {
                (all.controller, all.kp, all.ki) = (PAPER, proportional, integral_per_s);
            }
            Compensation::TimeOptimal(approach) => (all.controller, all.approach_s) = (FAST, time_constant_s(approach)),
            Compensation::Robust(margin) => {
                let [time_constant, share, gain, overshoot, fall_back] = margin.values();
                (all.controller, all.margin) = (ROBUST, Known { time_constant, share, gain, overshoot, fall_back });
            }
        }
        all
    }

    /// The settings of the tick.
    ///
    /// # Errors
    /// [`OutOfRange`] for more values than a list holds, an unknown controller, and a sensor without the feature `feedback`.
    pub fn settings(&self) -> Result<Settings<ExtendedPlant<'_>>, OutOfRange> {
        let Self { full_scale_v, min_v, max_v, slew_v_per_s, dac_bits, .. } = *self;
        let slew_v_per_s = Some(slew_v_per_s).filter(|slew| *slew != 0.0);
        let compensation = match self.controller {
            NONE => Compensation::None,
            PAPER => Compensation::ProportionalIntegral(Gains { proportional: self.kp, integral_per_s: self.ki }),
            FAST => time_optimal(self.approach_s)?,
            ROBUST => self.margin.compensation()?,
            other => {
                let (field, lowest, highest) = ("controller", f64::from(NONE), f64::from(ROBUST));
                return Err(OutOfRange { field, value: f64::from(other), lowest, highest, unit: "" });
            }
        };
        Ok(Settings {
            rate_hz: self.rate_hz,
            plant: self.spring.plant()?,
            compensation,
            amplifier: Amplifier { full_scale_v, min_v, max_v, slew_v_per_s, dac_bits },
            feedback: self.sensor.feedback()?,
        })
    }
}

#[cfg(feature = "time-optimal")]
fn time_optimal(time_constant_s: f64) -> Result<Compensation, OutOfRange> {
    Ok(Compensation::TimeOptimal(model::Approach { time_constant_s }))
}

#[cfg(feature = "time-optimal")]
const fn time_constant_s(approach: model::Approach) -> f64 {
    approach.time_constant_s
}

#[cfg(not(feature = "time-optimal"))]
const fn time_constant_s(_: model::Approach) -> f64 {
    0.0
}

#[cfg(not(feature = "time-optimal"))]
fn time_optimal(_: f64) -> Result<Compensation, OutOfRange> {
    let (value, highest) = (f64::from(FAST), f64::from(PAPER));
    Err(OutOfRange { field: "controller", value, lowest: 0.0, highest, unit: "in a library without time-optimal" })
}

impl From<Feedback> for Sensor {
    fn from(feedback: Feedback) -> Self {
        let [noise_v, model_uncertainty, fastest_s, interval_s, oldest_s, lowest_v, highest_v, fade_s] =
            feedback.values();
        Self { noise_v, model_uncertainty, fastest_s, interval_s, oldest_s, lowest_v, highest_v, fade_s }
    }
}

impl Sensor {
    fn feedback(&self) -> Result<Option<Feedback>, OutOfRange> {
        let Self { noise_v, model_uncertainty, fastest_s, interval_s, oldest_s, lowest_v, highest_v, fade_s } = *self;
        if noise_v == 0.0 {
            return Ok(None);
        }
        let values = [noise_v, model_uncertainty, fastest_s, interval_s, oldest_s, lowest_v, highest_v, fade_s];
        let unit = "V in a library without feedback";
        let none = OutOfRange { field: "noise_v", value: noise_v, lowest: 0.0, highest: 0.0, unit };
        Feedback::from_values(values).map(Some).ok_or(none)
    }
}

impl Known {
    fn compensation(&self) -> Result<Compensation, OutOfRange> {
        let Self { time_constant, share, gain, overshoot, fall_back } = *self;
        let (value, highest) = (f64::from(ROBUST), f64::from(FAST));
        let none = OutOfRange { field: "controller", value, lowest: 0.0, highest, unit: "in a library without robust" };
        Margin::from_values([time_constant, share, gain, overshoot, fall_back]).map(Compensation::Robust).ok_or(none)
    }
}

impl Spring {
    fn new(plant: &ExtendedPlant<'_>) -> Self {
        let ExtendedPlant { memory, law, leakage, relaxation } = plant;
        let mut spring = Self { share: relaxation.share, ..Self::default() };
        spring.lags = fill(&mut spring.tau_s, relaxation.time_constants_s);
        fill(&mut spring.weights, relaxation.weights);
        spring.tau_high_s = relaxation.time_constant_high_s.unwrap_or(0.0);
        if let Some(memory) = memory {
            spring.direct = memory.direct;
            spring.plays = fill(&mut spring.thresholds_v, memory.thresholds_v);
            fill(&mut spring.play_weights, memory.weights);
        }
        if let Some(law) = law {
            spring.points = fill(&mut spring.law_voltage_v, law.voltage_v);
            fill(&mut spring.law_stiffness, law.stiffness);
        }
        if let Some(leakage) = leakage {
            (spring.leakage_share, spring.leakage_tau_s) = (leakage.share, leakage.time_constant_s);
        }
        spring
    }

    fn plant(&self) -> Result<ExtendedPlant<'_>, OutOfRange> {
        let Self { share, tau_s, weights, tau_high_s, leakage_share, leakage_tau_s, lags, plays, points, .. } = self;
        // A single weight of 0 is none.
        let given = if *lags == 1 && weights[0] == 0.0 { 0 } else { *lags };
        let relaxation = extended::Relaxation {
            share: *share,
            time_constants_s: first("relaxation.tau_s", tau_s, *lags)?,
            weights: first("relaxation.weights", weights, given)?,
            time_constant_high_s: Some(*tau_high_s).filter(|tau| *tau != 0.0),
        };
        let memory = extended::Memory {
            direct: self.direct,
            thresholds_v: first("memory.thresholds_v", &self.thresholds_v, *plays)?,
            weights: first("memory.weights", &self.play_weights, *plays)?,
        };
        let law = extended::Law {
            voltage_v: first("law.voltage_v", &self.law_voltage_v, *points)?,
            stiffness: first("law.stiffness", &self.law_stiffness, *points)?,
        };
        let leakage = extended::Leakage { share: *leakage_share, time_constant_s: *leakage_tau_s };
        Ok(ExtendedPlant {
            memory: (*plays > 0 || self.direct != 0.0).then_some(memory),
            law: (*points > 0).then_some(law),
            leakage: (*leakage_tau_s != 0.0).then_some(leakage),
            relaxation,
        })
    }
}

/// Copies a list into `places`; returns the number of values.
fn fill(places: &mut [f64], values: &[f64]) -> u32 {
    places.iter_mut().zip(values).for_each(|(place, value)| *place = *value);
    values.len().min(places.len()) as u32
}

/// The first `count` values of a list.
fn first<'a>(field: &'static str, list: &'a [f64], count: u32) -> Result<&'a [f64], OutOfRange> {
    let (value, highest) = (f64::from(count), list.len() as f64);
    list.get(..count as usize).ok_or(OutOfRange { field, value, lowest: 0.0, highest, unit: "values" })
}
