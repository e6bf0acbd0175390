//! An equation as a plant file, if it consists of the parts that the tick simulates, in the tick's order.
//!
//! ```text
//! limit, slew, delay -> play -> curve -> share, lags, oscillations
//! ```

use crate::equation::curve::Curve;
use crate::equation::fitted::Fitted;
use crate::equation::kind::Kind;
use crate::equation::lag::By;
use crate::equation::operator::Operator;
use crate::equation::scale::Scale;
use simulation::plant_file::{Amplifier, Law, Memory, Mode, PlantFile, Relaxation};

/// Number of points of a law, the most that a plant file holds.
const POINTS: usize = 9;

/// Returns the plant file of an equation, normalised; `base` gives what an equation does not tell, `output` is the change of the
/// reading for each V of stiffness. `Err` holds the part that the tick does not simulate.
pub(super) fn plant(fit: &Fitted, base: &PlantFile, output: f64, scale: &Scale) -> Result<PlantFile, &'static str> {
    let Some(sum) = fit.structure.last_sum() else { return Err("an operator behind the relaxation") };
    if !fit.structure.terms.is_empty() {
        return Err("a term that follows the clock");
    }
    let mut file =
        PlantFile { memory: None, law: None, leakage: None, amplifier: None, modes: Vec::new(), ..base.clone() };
    let mut amplifier = Amplifier::default();
    let mut curve = None;
    for operator in &fit.structure.chain[..fit.structure.chain.len() - 1] {
        let p = operator.parameters(scale);
        let first = file.memory.is_none() && curve.is_none();
        match operator.kind {
            Kind::Curve(Curve::Limit) if first => amplifier.limit_v = Some(p[0]),
            Kind::Slew if first => amplifier.slew_v_per_s = Some(p[0]),
            Kind::Delay if first => amplifier.delay_s = Some(p[0]),
            Kind::Play if first => {
                file.memory = Some(Memory { direct: 1.0 - p[1], thresholds_v: vec![p[0]], weights: vec![p[1]] });
            }
            Kind::Curve(of) if curve.is_none() && of != Curve::Floor => curve = Some((of, p[0])),
            _ => return Err(named(operator)),
        }
    }
    file.amplifier = (amplifier != Amplifier::default()).then_some(amplifier);

    let weights = fit.coefficients[1..=sum.chains.len()].iter().map(|weight| weight / output);
    let (mut share, mut lags, mut gain) = (0.0, Vec::new(), 0.0);
    let mut modes = Vec::new();
    let mut high = None;
    for (chain, weight) in sum.chains.iter().zip(weights) {
        gain += weight;
        match chain.as_slice() {
            [] => share += weight,
            [one] => {
                let p = one.parameters(scale);
                match one.kind {
                    Kind::Lag => lags.push((p[0], weight)),
                    Kind::Varying(By::Input) if high.is_none() => {
                        high = Some(p[0] * (1.0 + p[1]));
                        lags.insert(0, (p[0], weight));
                    }
                    Kind::Second if p[1] < 1.0 => {
                        modes.push(Mode { freq_hz: p[0], zeta: p[1], weight, rate_weight: 0.0 });
                    }
                    _ => return Err(named(one)),
                }
            }
            _ => return Err("a branch of several operators"),
        }
    }
    if gain <= 0.0 || lags.is_empty() {
        return Err("no relaxation with a positive gain");
    }
    modes.iter_mut().for_each(|mode| mode.weight /= gain);
    let weights =
        if lags.len() == 1 && modes.is_empty() { Vec::new() } else { lags.iter().map(|lag| lag.1 / gain).collect() };
    file.relaxation = Relaxation {
        share: share / gain,
        tau_s: lags.iter().map(|lag| lag.0).collect(),
        weights,
        tau_high_s: high,
        tau_high_at_v: high.map(|_| scale.full_v),
    };
    file.modes = modes;
    if curve.is_some() || gain != 1.0 {
        let at = |part: usize| scale.full_v * part as f64 / (POINTS - 1) as f64;
        let stiffness = |v: f64| gain * curve.map_or(v, |(curve, parameter)| curve.at(v, parameter, scale.full_v));
        let voltage_v: Vec<f64> = (0..POINTS).map(at).collect();
        let voltage_v = if curve.is_none() { vec![0.0, scale.full_v] } else { voltage_v };
        file.law = Some(Law { stiffness: voltage_v.iter().map(|&v| stiffness(v)).collect(), voltage_v });
    }
    Ok(file)
}

/// The part of an equation that a plant file cannot hold.
fn named(operator: &Operator) -> &'static str {
    match operator.kind {
        Kind::Varying(_) => "a time constant that does not depend on the voltage linearly",
        Kind::Creep => "creep as a power of the time",
        Kind::Play | Kind::Travel | Kind::Direction => "a second operator with memory",
        Kind::Curve(_) => "a second curve",
        Kind::Swing | Kind::Grow | Kind::Step => "a gain that changes with time",
        Kind::Times => "a product",
        _ => "a lag in series",
    }
}
