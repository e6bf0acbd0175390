//! The structures from which a search starts: the simulation as it is given, and the best linear model.

use crate::equation::curve::Curve;
use crate::equation::kind::Kind;
use crate::equation::operator::Operator;
use crate::equation::scale::Scale;
use crate::equation::structure::Structure;
use crate::linear::{Poles, Section};
use simulation::plant_file::PlantFile;

/// Returns the structure of a normalised plant file: its amplifier, hysteresis, leakage and relaxation. A static law is left to the
/// search.
pub(super) fn of_plant(file: &PlantFile, scale: &Scale) -> Structure {
    let operator = |kind, parameters: &[f64]| Operator::new(kind, parameters, scale);
    let mut chain = Vec::new();
    if let Some(amplifier) = &file.amplifier {
        let limit = amplifier.limit_v.filter(|limit| *limit < scale.full_v);
        chain.extend(limit.map(|limit| operator(Kind::Curve(Curve::Limit), &[limit])));
        chain.extend(amplifier.slew_v_per_s.map(|slew| operator(Kind::Slew, &[slew])));
        chain.extend(amplifier.delay_s.filter(|delay| *delay > 0.0).map(|delay| operator(Kind::Delay, &[delay])));
    }
    if let Some(memory) = &file.memory {
        // The play with the largest loop stands for the bank.
        let loops = memory.thresholds_v.iter().zip(&memory.weights);
        let largest = loops.max_by(|a, b| (a.0 * a.1.abs()).total_cmp(&(b.0 * b.1.abs())));
        chain.extend(largest.map(|(radius, weight)| operator(Kind::Play, &[*radius, *weight])));
    }
    let relaxation = &file.relaxation;
    let mut branches = vec![(relaxation.share, Vec::new())];
    let slow = 1.0 - relaxation.share;
    for (index, &tau_s) in relaxation.tau_s.iter().enumerate() {
        let weight = relaxation.weights.get(index).copied().unwrap_or(slow);
        branches.push((weight, vec![operator(Kind::Lag, &[tau_s])]));
    }
    for mode in &file.modes {
        branches.push((mode.weight, vec![operator(Kind::Second, &[mode.freq_hz, mode.zeta])]));
    }
    if let Some(leakage) = &file.leakage {
        branches.push((-leakage.share, vec![operator(Kind::Lag, &[leakage.tau_s])]));
    }
    chain.push(Operator::parallel(branches));
    Structure { chain, terms: Vec::new() }
}

/// Returns the structure of a linear model, whose times are `second_s` times as long as those of the scale.
pub(super) fn of_linear(poles: &Poles, second_s: f64, scale: &Scale) -> Structure {
    let operator = |kind, parameters: &[f64]| Operator::new(kind, parameters, scale);
    let mut chain = Vec::new();
    if poles.delay > 0.0 {
        chain.push(operator(Kind::Delay, &[poles.delay / second_s]));
    }
    let mut branches = vec![(0.5, Vec::new())];
    for section in &poles.sections {
        match (section.time_constants(), *section) {
            (None, Section::Second { frequency, damping }) => {
                let freq_hz = frequency * second_s / std::f64::consts::TAU;
                branches.push((0.5, vec![operator(Kind::Second, &[freq_hz, damping])]));
            }
            (taus, _) => {
                let lags = taus.into_iter().flatten().map(|tau| (0.5, vec![operator(Kind::Lag, &[tau / second_s])]));
                branches.extend(lags);
            }
        }
    }
    chain.push(Operator::parallel(branches));
    Structure { chain, terms: Vec::new() }
}
