//! The identified spring as a plant file, as far as the format can hold it.

use simulation::plant_file::{Amplifier, PlantFile, Reading, Relaxation};
use simulation::units::{UnitNames, Units};

use crate::nominal::report::{InputLaw, Nominal, Oscillation};

/// The plant file. An oscillation is written as instantaneous and described under `[unmodelled]`, as is an instantaneous part outside
/// of 0 to 1. `spacing_s` stands in for the time constant of a spring that has none.
pub(super) fn plant_file(
    nominal: &Nominal,
    oscillations: &[Oscillation],
    law: InputLaw,
    units: &Units,
    spacing_s: f64,
) -> PlantFile {
    let mut unmodelled = toml::Table::new();
    let quick: f64 = oscillations.iter().map(|oscillation| oscillation.weight.value).sum();
    let whole = nominal.share.value + quick;
    let share = whole.clamp(0.0, 1.0);
    if share != whole {
        unmodelled.insert("instantaneous_share".into(), whole.into());
    }
    for (index, Oscillation { freq_hz, zeta, weight }) in oscillations.iter().enumerate() {
        let mut table = toml::Table::new();
        for (name, quantity) in [("freq_hz", freq_hz), ("zeta", zeta), ("weight", weight)] {
            table.insert(name.into(), quantity.value.into());
        }
        unmodelled.insert(format!("oscillation_{}", index + 1), table.into());
    }
    let mut tau_s: Vec<f64> = nominal.tau_s.iter().map(|lag| lag.tau.value).collect();
    let mut weights: Vec<f64> = nominal.tau_s.iter().map(|lag| lag.weight.value).collect();
    // The static gain stays what was identified.
    let lagging: f64 = weights.iter().sum();
    if share != whole && lagging != 0.0 {
        weights.iter_mut().for_each(|weight| *weight *= (1.0 - share) / lagging);
    }
    if tau_s.is_empty() {
        (tau_s, weights) = (vec![spacing_s], vec![1.0 - share]);
    }
    if tau_s.len() == 1 && (weights[0] - (1.0 - share)).abs() < 1e-9 {
        weights.clear();
    }
    let delay_s = nominal.delay_s.value;
    PlantFile {
        schema: 1,
        even: law == InputLaw::Even,
        units: Some(UnitNames::from(units)),
        reading: Some(Reading { gain: nominal.gain.value, zero: nominal.zero.value }),
        memory: None,
        law: None,
        leakage: None,
        relaxation: Relaxation { share, tau_s, weights, tau_high_s: None, tau_high_at_v: None },
        amplifier: (delay_s > 0.0).then(|| Amplifier { delay_s: Some(delay_s), ..Amplifier::default() }),
        unmodelled: (!unmodelled.is_empty()).then_some(unmodelled),
    }
}
