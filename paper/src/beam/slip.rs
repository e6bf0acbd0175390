//! How much the layers slip: the interlayer stiffness that a measured spring constant asks for.
//!
//! Perfect bonding is several times too stiff, free sliding several times too soft. Slip is identified on one part of the
//! data, the lines of the beam experiment at its lowest and highest voltage, and checked on the rest: the lines between,
//! and displacements that were measured separately (section 4.1.4).
//!
//! What the voltage does is asked in two ways: it stiffens the active layer and nothing else, or it couples the layers
//! more strongly too, `K(V) = K(0) + growth V^n`: `n` = 2 if electrodes press the layers together (their pressure grows
//! with the square of the voltage), `n` = 1 if the coupling grows as Young's modulus of the whole beam does.

use anyhow::{Context, Result};
use serde::{Deserialize, Serialize};

use crate::beam::experiment::Experiment;
use crate::beam::layered::{BONDED_PA_PER_M, ELEMENTS, spring_constant_n_per_m};
use crate::beam::limits::{bonded_n_per_m, sliding_n_per_m};
use crate::beam::regression::Interval;
use crate::beam::stack::{ACTIVE, Stack, active_modulus_pa};
use simulation::bad_input;

/// Section 4.1.4 as it was printed.
const TIPS: &str = include_str!("../../../data/section414_tip_displacement.csv");

/// A displacement under a force, measured and by the report's finite elements.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct Tip {
    /// At the tip, in uN.
    pub force_un: f64,
    /// Across the spring, in V.
    pub voltage_v: f64,
    /// In mm.
    pub measured_mm: f64,
    /// The report's solid model, in mm.
    pub fem_mm: f64,
}

/// The printed rows of section 4.1.4.
///
/// # Errors
/// If the file that was built in is damaged.
pub fn tips() -> Result<Vec<Tip>> {
    csv::ReaderBuilder::new()
        .comment(Some(b'#'))
        .from_reader(TIPS.as_bytes())
        .deserialize()
        .collect::<Result<_, _>>()
        .context("data/section414_tip_displacement.csv")
}

/// The interlayer stiffness, in Pa/m, with which a stack has a spring constant.
///
/// # Errors
/// [`simulation::bad_input::BadInput`] if no slip gives it: it must lie between free sliding and bonding.
pub fn identify_pa_per_m(stack: &Stack, measured_n_per_m: f64) -> Result<f64> {
    let (sliding, bonded) = (sliding_n_per_m(stack), bonded_n_per_m(stack));
    // Nearly bonded, the interlayer stiffness means nothing any more.
    let highest = 0.99 * bonded;
    if !(measured_n_per_m > sliding && measured_n_per_m < highest) {
        bad_input!(
            "a spring constant of {measured_n_per_m:.4} N/m: expected {sliding:.4} N/m (layers slide) to {highest:.4} N/m \
             (nearly bonded)"
        );
    }
    let (mut low, mut high) = (1.0, BONDED_PA_PER_M);
    for _ in 0..50 {
        let middle = (low * high).sqrt();
        let softer = spring_constant_n_per_m(stack, middle, ELEMENTS)? < measured_n_per_m;
        if softer { low = middle } else { high = middle }
    }
    Ok((low * high).sqrt())
}

/// The identified spring.
#[derive(Clone, Debug, Serialize)]
pub struct Identified {
    /// Interlayer stiffness at the lowest voltage, in Pa/m, by the line there and its 95 % interval.
    pub at_lowest_pa_per_m: Interval,
    /// The lowest voltage, in V.
    pub lowest_v: f64,
    /// Interlayer stiffness at the highest voltage, in Pa/m.
    pub at_highest_pa_per_m: Interval,
    /// The highest voltage, in V.
    pub highest_v: f64,
    /// Spring constants in uN/mm, one row a voltage of the experiment.
    pub lines: Vec<Line>,
    /// Displacements that were measured apart: never used for the identification.
    pub tips: Vec<Predicted>,
    /// Young's modulus, in Pa, that the active layer would need at the highest voltage to explain it alone; `None` if none.
    pub active_alone_pa: Option<f64>,
}

/// One voltage of the experiment. Spring constants in uN/mm.
#[derive(Clone, Debug, Serialize)]
pub struct Line {
    /// In V.
    pub voltage_v: f64,
    /// Measured.
    pub measured: f64,
    /// Layers bonded.
    pub bonded: f64,
    /// Layers slide freely.
    pub sliding: f64,
    /// Slip as without voltage: only the active layer gets stiffer.
    pub active_only: f64,
    /// The active layer gets stiffer, and the coupling grows with the voltage.
    pub linear: f64,
    /// The same, growing with its square.
    pub quadratic: f64,
    /// True if the line was used to identify.
    pub used: bool,
}

/// One row of section 4.1.4. Displacements in mm.
#[derive(Clone, Debug, Serialize)]
pub struct Predicted {
    /// As printed.
    #[serde(flatten)]
    pub printed: Tip,
    /// Layers bonded.
    pub bonded_mm: f64,
    /// By the identified spring, its coupling growing with the voltage.
    pub slip_mm: f64,
}

impl Identified {
    /// Interlayer stiffness at a voltage, growing with it, in Pa/m.
    pub fn interlayer_pa_per_m(&self, voltage_v: f64) -> f64 {
        self.growing(voltage_v, 1)
    }

    /// The same, growing with a power of the voltage.
    fn growing(&self, voltage_v: f64, power: i32) -> f64 {
        let [lowest, highest, here] = [self.lowest_v, self.highest_v, voltage_v].map(|volts| volts.powi(power));
        let (low, high) = (self.at_lowest_pa_per_m.value, self.at_highest_pa_per_m.value);
        (low + (high - low) * (here - lowest) / (highest - lowest)).max(0.0)
    }

    /// Identifies slip on an experiment; `tips` were measured apart, and are only compared.
    ///
    /// # Errors
    /// [`simulation::bad_input::BadInput`] if no slip explains it.
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

/// Young's modulus of the active layer that gives a spring constant while the slip stays; `None` beyond 10 TPa.
fn active_alone(stack: &Stack, interlayer_pa_per_m: f64, n_per_m: f64) -> Result<Option<f64>> {
    let stiff = |pascal: f64| {
        Ok::<_, anyhow::Error>(
            spring_constant_n_per_m(&stack.with_modulus(ACTIVE, pascal)?, interlayer_pa_per_m, ELEMENTS)? >= n_per_m,
        )
    };
    let (mut low, mut high) = (1e6f64, 1e13f64);
    if !stiff(high)? {
        return Ok(None);
    }
    for _ in 0..40 {
        let middle = (low * high).sqrt();
        if stiff(middle)? { high = middle } else { low = middle }
    }
    Ok(Some(high))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn slip_that_was_put_in_is_found() {
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

    /// Identified at 0 and 700 V, checked at 400 V: growing with the voltage it comes out within 2 %, with the square not.
    #[test]
    fn the_line_between_decides_how_the_coupling_grows() {
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
