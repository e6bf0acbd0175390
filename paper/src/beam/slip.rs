//! Slip between the layers: the interlayer stiffness identified from measured spring constants.
//!
//! Perfect bonding gives a spring several times too stiff, free sliding one several times too soft. The slip is
//! identified from the lines of the beam experiment at its lowest and highest voltage and checked on the remaining
//! data: the lines between, and displacements that were measured separately (section 4.1.4).
//!
//! Two hypotheses on the effect of the voltage are compared: it stiffens the active layer only, or it also increases
//! the coupling of the layers, `K(V) = K(0) + growth V^n`. The exponent is `n` = 2 if electrodes press the layers
//! together (the pressure is proportional to the squared voltage), `n` = 1 if the coupling grows like Young's modulus
//! of the whole beam.

use anyhow::{Context, Result};
use serde::{Deserialize, Serialize};

use crate::beam::experiment::Experiment;
use crate::beam::layered::{BONDED_PA_PER_M, ELEMENTS, spring_constant_n_per_m};
use crate::beam::limits::{bonded_n_per_m, sliding_n_per_m};
use crate::beam::regression::Interval;
use crate::beam::stack::{ACTIVE, Stack, active_modulus_pa};
use simulation::bad_input;

/// The report's section 4.1.4, as printed.
const TIPS: &str = include_str!("../../../data/section414_tip_displacement.csv");

/// Magnitude of a function below which [`crossing`] takes it for zero.
const CROSSED: f64 = 1e-10;
/// Number of steps after which [`crossing`] returns the end that is nearer.
const MOST_STEPS: usize = 60;

/// A tip displacement under a force: measured, and computed by the report's finite elements.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct Tip {
    /// Force at the tip, in uN.
    pub force_un: f64,
    /// Voltage across the spring, in V.
    pub voltage_v: f64,
    /// Measured displacement, in mm.
    pub measured_mm: f64,
    /// Displacement by the report's three-dimensional finite elements, in mm.
    pub fem_mm: f64,
}

/// The printed rows of section 4.1.4.
///
/// # Errors
/// If the built-in data file is damaged.
pub fn tips() -> Result<Vec<Tip>> {
    csv::ReaderBuilder::new()
        .comment(Some(b'#'))
        .from_reader(TIPS.as_bytes())
        .deserialize()
        .collect::<Result<_, _>>()
        .context("data/section414_tip_displacement.csv")
}

/// The interlayer stiffness, in Pa/m, at which the stack has the spring constant `measured_n_per_m` (N/m).
///
/// # Errors
/// [`simulation::bad_input::BadInput`] if the spring constant does not lie between free sliding and bonding.
pub fn identify_pa_per_m(stack: &Stack, measured_n_per_m: f64) -> Result<f64> {
    let (sliding, bonded) = (sliding_n_per_m(stack), bonded_n_per_m(stack));
    // Close to bonding, the spring constant hardly depends on the interlayer stiffness.
    let highest = 0.99 * bonded;
    if !(measured_n_per_m > sliding && measured_n_per_m < highest) {
        bad_input!(
            "a spring constant of {measured_n_per_m:.4} N/m: expected {sliding:.4} N/m (layers slide) to {highest:.4} N/m \
             (nearly bonded)"
        );
    }
    crossing(1.0, BONDED_PA_PER_M, |slip| Ok((spring_constant_n_per_m(stack, slip, ELEMENTS)? / measured_n_per_m).ln()))
}

/// The spring with identified interlayer stiffness.
#[derive(Clone, Debug, Serialize)]
pub struct Identified {
    /// Interlayer stiffness at the lowest voltage, in Pa/m, with the 95 % interval that the line there implies.
    pub at_lowest_pa_per_m: Interval,
    /// The lowest voltage of the experiment, in V.
    pub lowest_v: f64,
    /// Interlayer stiffness at the highest voltage, in Pa/m, with its 95 % interval.
    pub at_highest_pa_per_m: Interval,
    /// The highest voltage of the experiment, in V.
    pub highest_v: f64,
    /// Spring constants, one row for each voltage of the experiment.
    pub lines: Vec<Line>,
    /// Separately measured displacements compared with the model; the identification does not use them.
    pub tips: Vec<Predicted>,
    /// Young's modulus, in Pa, that the active layer alone would need at the highest voltage; `None` if no value
    /// suffices.
    pub active_alone_pa: Option<f64>,
}

/// Spring constants at one voltage of the experiment, in uN/mm.
#[derive(Clone, Debug, Serialize)]
pub struct Line {
    /// Voltage across the spring, in V.
    pub voltage_v: f64,
    /// Measured spring constant.
    pub measured: f64,
    /// Spring constant with bonded layers.
    pub bonded: f64,
    /// Spring constant with layers that slide freely.
    pub sliding: f64,
    /// Spring constant with the interlayer stiffness of 0 V and a stiffer active layer.
    pub active_only: f64,
    /// Spring constant with a stiffer active layer and a coupling that grows linearly with the voltage.
    pub linear: f64,
    /// Spring constant with a stiffer active layer and a coupling that grows with the squared voltage.
    pub quadratic: f64,
    /// True if the line was used for the identification.
    pub used: bool,
}

/// One row of section 4.1.4 compared with the model; displacements in mm.
#[derive(Clone, Debug, Serialize)]
pub struct Predicted {
    /// The printed row.
    #[serde(flatten)]
    pub printed: Tip,
    /// Displacement with bonded layers.
    pub bonded_mm: f64,
    /// Displacement with the identified interlayer stiffness, which grows linearly with the voltage.
    pub slip_mm: f64,
}

impl Identified {
    /// Interlayer stiffness in Pa/m at a voltage in V, growing linearly with the voltage.
    pub fn interlayer_pa_per_m(&self, voltage_v: f64) -> f64 {
        self.growing(voltage_v, 1)
    }

    /// Interlayer stiffness in Pa/m at a voltage in V, growing with a power of the voltage.
    fn growing(&self, voltage_v: f64, power: i32) -> f64 {
        let [lowest, highest, here] = [self.lowest_v, self.highest_v, voltage_v].map(|volts| volts.powi(power));
        let (low, high) = (self.at_lowest_pa_per_m.value, self.at_highest_pa_per_m.value);
        (low + (high - low) * (here - lowest) / (highest - lowest)).max(0.0)
    }

    /// Identifies the interlayer stiffness from an experiment; `tips` are only compared with the result.
    ///
    /// # Errors
    /// [`simulation::bad_input::BadInput`] if a measured spring constant does not lie between free sliding and bonding.
    pub fn new(stack: &Stack, experiment: &Experiment, tips: &[Tip]) -> Result<Self> {
        let at = |voltage_v: f64| stack.with_modulus(ACTIVE, active_modulus_pa(voltage_v)?);
        let (lowest, highest) =
            (experiment.lines.first().context("a line")?, experiment.lines.last().context("a line")?);
        let identify = |line: &crate::beam::experiment::Line| {
            let stack = at(line.voltage_v)?;
            let place = || format!("the beam experiment at {} V", line.voltage_v);
            let slip = |un_per_mm: f64| identify_pa_per_m(&stack, 1e-3 * un_per_mm).with_context(place);
            let Interval { value, low, high } = line.un_per_mm;
            Ok::<_, anyhow::Error>(Interval { value: slip(value)?, low: slip(low)?, high: slip(high)? })
        };
        let mut identified = Self {
            at_lowest_pa_per_m: identify(lowest)?,
            lowest_v: lowest.voltage_v,
            at_highest_pa_per_m: identify(highest)?,
            highest_v: highest.voltage_v,
            lines: Vec::new(),
            tips: Vec::new(),
            active_alone_pa: None,
        };
        let low = identified.at_lowest_pa_per_m.value;
        let slip = |voltage_v: f64, power: i32| identified.growing(voltage_v, power);
        let lines = experiment.lines.iter().map(|line| {
            let stack = at(line.voltage_v)?;
            Ok(Line {
                voltage_v: line.voltage_v,
                measured: line.un_per_mm.value,
                bonded: 1e3 * bonded_n_per_m(&stack),
                sliding: 1e3 * sliding_n_per_m(&stack),
                active_only: 1e3 * spring_constant_n_per_m(&stack, low, ELEMENTS)?,
                linear: 1e3 * spring_constant_n_per_m(&stack, slip(line.voltage_v, 1), ELEMENTS)?,
                quadratic: 1e3 * spring_constant_n_per_m(&stack, slip(line.voltage_v, 2), ELEMENTS)?,
                used: line.voltage_v == lowest.voltage_v || line.voltage_v == highest.voltage_v,
            })
        });
        let tips = tips.iter().map(|&printed| {
            let stack = at(printed.voltage_v)?;
            // uN by N/m is um.
            let mm = |newton_per_metre: f64| 1e-3 * printed.force_un / newton_per_metre;
            Ok(Predicted {
                printed,
                bonded_mm: mm(bonded_n_per_m(&stack)),
                slip_mm: mm(spring_constant_n_per_m(&stack, slip(printed.voltage_v, 1), ELEMENTS)?),
            })
        });
        let (lines, tips) = (lines.collect::<Result<_>>()?, tips.collect::<Result<_>>()?);
        (identified.lines, identified.tips) = (lines, tips);
        identified.active_alone_pa = active_alone(stack, low, 1e-3 * highest.un_per_mm.value)?;
        Ok(identified)
    }
}

/// Young's modulus in Pa of the active layer that gives a spring constant at unchanged slip; `None` above 10 TPa.
fn active_alone(stack: &Stack, interlayer_pa_per_m: f64, n_per_m: f64) -> Result<Option<f64>> {
    let stiffer = |pascal: f64| {
        let stack = stack.with_modulus(ACTIVE, pascal)?;
        Ok::<_, anyhow::Error>((spring_constant_n_per_m(&stack, interlayer_pa_per_m, ELEMENTS)? / n_per_m).ln())
    };
    let highest = 1e13;
    if stiffer(highest)? < 0.0 { Ok(None) } else { crossing(1e6, highest, stiffer).map(Some) }
}

/// Returns where a rising function of a positive argument passes zero between `low` and `high`, or the end that is nearer if it does
/// not pass zero: false position on a logarithmic scale, with the value of an end halved that stays (the Illinois method; Dowell and
/// Jarratt, *BIT* 11, 1971).
fn crossing(low: f64, high: f64, rising: impl Fn(f64) -> Result<f64>) -> Result<f64> {
    let point = |at: f64| Ok::<_, anyhow::Error>((at, rising(at.exp())?));
    let (mut low, mut high) = (point(low.ln())?, point(high.ln())?);
    let mut rose = None;
    let steps = if low.1 < 0.0 && high.1 > 0.0 { MOST_STEPS } else { 0 };
    for _ in 0..steps {
        let new = point((low.0 * high.1 - high.0 * low.1) / (high.1 - low.1))?;
        if new.1.abs() < CROSSED {
            return Ok(new.0.exp());
        }
        let rises = new.1 < 0.0;
        let (end, other) = if rises { (&mut low, &mut high) } else { (&mut high, &mut low) };
        *end = new;
        if rose.replace(rises) == Some(rises) {
            other.1 *= 0.5;
        }
    }
    Ok(if low.1.abs() < high.1.abs() { low.0 } else { high.0 }.exp())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_known_interlayer_stiffness_is_recovered() {
        let stack = Stack::paper().unwrap();
        for slip in [1e7, 1e9, 1e10] {
            let constant = spring_constant_n_per_m(&stack, slip, ELEMENTS).unwrap();
            let found = identify_pa_per_m(&stack, constant).unwrap();
            assert!((found / slip - 1.0).abs() < 1e-4, "{slip} {found}");
        }
        for constant in [0.0, 100.0, f64::NAN] {
            assert!(identify_pa_per_m(&stack, constant).unwrap_err().is::<simulation::bad_input::BadInput>());
        }
    }

    /// The steep end of the second function is where false position alone hardly moves.
    #[test]
    fn a_crossing_is_found_in_few_steps_or_its_nearer_end_returned() {
        let steps = std::cell::Cell::new(0);
        let counted = |value: f64| {
            steps.set(steps.get() + 1);
            Ok(value)
        };
        assert!((crossing(1.0, 1e14, |at| counted((at / 3e8).ln())).unwrap() / 3e8 - 1.0).abs() < 1e-9);
        assert!((crossing(1.0, 1e14, |at| counted(at / 3e8 - 1.0)).unwrap() / 3e8 - 1.0).abs() < 1e-9);
        assert!(steps.get() < 60, "{}", steps.get());
        assert_eq!(crossing(2.0, 8.0, Ok).unwrap(), 2.0);
        assert!((crossing(2.0, 8.0, |at| Ok(at - 9.0)).unwrap() - 8.0).abs() < 1e-12);
    }

    /// Identified at 0 and 700 V, checked at 400 V: linear growth predicts it within 2 %, quadratic growth does not.
    #[test]
    fn the_middle_voltage_supports_linear_growth_of_the_coupling() {
        let found = Identified::new(&Stack::paper().unwrap(), &Experiment::paper().unwrap(), &[]).unwrap();
        let [low, between, high] = &found.lines[..] else { panic!("three voltages") };
        for used in [low, high] {
            assert!(used.used && (used.linear / used.measured - 1.0).abs() < 1e-6);
            assert!(used.bonded > 3.0 * used.measured && used.sliding < used.measured / 3.0);
        }
        assert!(!between.used);
        assert!((between.linear / between.measured - 1.0).abs() < 0.02, "{between:?}");
        assert!((between.quadratic / between.measured - 1.0).abs() > 0.05, "{between:?}");
        assert!(high.active_only < 1.05 * low.measured, "the active layer alone does next to nothing");
    }
}
