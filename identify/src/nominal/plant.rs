//! The identified spring as a plant file, as far as the format can hold it.

use std::f64::consts::TAU;

use simulation::plant_file::{Amplifier, Law, Mode, PlantFile, Range, Reading, Relaxation};
use simulation::record::Record;
use simulation::units::{UnitNames, Units};

use crate::nominal::report::{InputLaw, Nominal, Oscillation, Quantity};

/// Largest damping ratio of an oscillation in a plant file.
const MOST_DAMPED: f64 = 1.0 - 1e-6;

/// Number of straight lines that stand for a square law: they are off by at most 1/4096 of the full scale.
const CHORDS: usize = 32;

/// The voltages of the records.
#[derive(Clone, Copy, Debug)]
pub(super) struct VoltageRange {
    /// Largest magnitude, in V.
    pub(super) full_scale_v: f64,
    /// True if both signs occur.
    pub(super) both_signs: bool,
    /// Lowest and highest voltage.
    pub(super) range: Range,
}

/// Returns the voltages of the records.
pub(super) fn range(records: &[Record]) -> Range {
    let voltages = || records.iter().flat_map(|record| &record.rows).map(|row| row.voltage_v);
    Range {
        lowest_v: voltages().fold(f64::INFINITY, f64::min),
        highest_v: voltages().fold(f64::NEG_INFINITY, f64::max),
    }
}

/// The law `v^2 / full scale` as a table.
fn square(full_scale_v: f64) -> Law {
    let parts = (0..=CHORDS).map(|chord| chord as f64 / CHORDS as f64);
    let (voltage_v, stiffness) = parts.map(|part| (full_scale_v * part, full_scale_v * part * part)).unzip();
    Law { voltage_v, stiffness }
}

/// The instantaneous share; one below 0 or above 1, which a controller cannot use, is replaced by that limit where its interval contains
/// it. Relative to a gain that may be 0 every share has a wide interval, whatever the response is.
fn whole_share(nominal: &Nominal) -> f64 {
    let Quantity { value, low, high, .. } = nominal.share;
    if (nominal.gain.low..=nominal.gain.high).contains(&0.0) {
        return value;
    }
    let limits = [(value < 0.0 && high >= 0.0, 0.0), (value > 1.0 && low <= 1.0, 1.0)];
    limits.into_iter().find_map(|(applies, limit)| applies.then_some(limit)).unwrap_or(value)
}

/// The plant file. `spacing_s` stands in for the time constant of a spring that has neither a time constant nor an oscillation.
pub(super) fn plant_file(
    nominal: &Nominal,
    oscillations: &[Oscillation],
    law: InputLaw,
    voltage: VoltageRange,
    units: &Units,
    spacing_s: f64,
) -> PlantFile {
    let share = whole_share(nominal);
    let mut tau_s: Vec<f64> = nominal.tau_s.iter().map(|lag| lag.tau.value).collect();
    let mut weights: Vec<f64> = nominal.tau_s.iter().map(|lag| lag.weight.value).collect();
    let mode = |of: &Oscillation| Mode {
        freq_hz: of.freq_hz.value,
        zeta: of.zeta.value.min(MOST_DAMPED),
        weight: of.weight.value,
        rate_weight: of.rate_weight.value,
    };
    let mut modes: Vec<Mode> = oscillations.iter().map(mode).collect();
    // The static gain stays what was identified.
    let slow: f64 = weights.iter().copied().chain(modes.iter().map(|mode| mode.weight)).sum();
    if slow != 0.0 {
        let factor = (1.0 - share) / slow;
        weights.iter_mut().for_each(|weight| *weight *= factor);
        for mode in &mut modes {
            (mode.weight, mode.rate_weight) = (factor * mode.weight, factor * mode.rate_weight);
        }
    }
    if tau_s.is_empty() {
        let slowest_s = modes.iter().map(|mode| 1.0 / (TAU * mode.freq_hz)).fold(0.0, f64::max);
        (tau_s, weights) = (vec![if slowest_s > 0.0 { slowest_s } else { spacing_s }], Vec::new());
    }
    if tau_s.len() == 1 {
        weights.clear();
    }
    let delay_s = nominal.delay_s.value;
    PlantFile {
        schema: 1,
        even: law == InputLaw::Even || law == InputLaw::Square && voltage.both_signs,
        units: Some(UnitNames::from(units)),
        reading: Some(Reading { gain: nominal.gain.value, zero: nominal.zero.value }),
        memory: None,
        law: (law == InputLaw::Square).then(|| square(voltage.full_scale_v)),
        leakage: None,
        // Curves over the voltage refer to what the spring has seen, whatever the unit.
        relaxation: Relaxation { share, tau_s, weights, tau_high_s: None, tau_high_at_v: Some(voltage.full_scale_v) },
        amplifier: (delay_s > 0.0).then(|| Amplifier { delay_s: Some(delay_s), ..Amplifier::default() }),
        range: Some(voltage.range),
        modes,
        unmodelled: None,
    }
}
