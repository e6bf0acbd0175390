//! The electrical analogue of the Zener model (Appendix 8.1.7): force corresponds to voltage, elongation to charge, a
//! spring `K` to a capacitor `1/K`, a damper `D` to a resistor `D`.
//!
//! Springs in series carry the same force, so their capacitors have the same voltage: `1/K1` lies across the source, in
//! parallel with the resistor `D` in series with `1/K2`. The circuit is solved by [`crate::dynamics::circuit`],
//! independently of the mechanical equations.

use anyhow::Result;

use crate::dynamics::circuit::{Circuit, Component};
use crate::dynamics::input::{Input, follow};
use crate::dynamics::zener::{Sample, Start, Zener};

/// Smallest number of steps of the circuit between two samples.
const STEPS: usize = 40;

/// The response of the circuit analogous to a Zener model, its charges as elongations in m, one sample every `every_s`
/// seconds.
///
/// # Errors
/// [`simulation::bad_input::BadInput`] as for the Zener model.
pub fn response(zener: &Zener, input: &Input, start: Start, every_s: f64) -> Result<Vec<Sample>> {
    let zener = zener.checked()?;
    input.check_positive()?;
    input.check_pace(every_s, zener.damper_n_s_per_m / zener.springs_at(input.highest())[1])?;
    let volt = zener.force_n;
    let charge = if start == Start::Settled { volt / zener.springs_at(input.first())[1] } else { 0.0 };

    let mut failed = None;
    // The state carried from step to step is the charge of the damped capacitor.
    let states = follow(input, every_s, charge, |piece, t, charge, h| {
        let farad = |spring: usize, time: f64| 1.0 / zener.springs_at(piece.at(time))[spring];
        let (series, damped) = (|time: f64| farad(0, time), |time: f64| farad(1, time));
        let components = vec![
            Component::Source(1, 0, volt),
            Component::Capacitor(1, 0, &series),
            Component::Resistor(1, 2, zener.damper_n_s_per_m),
            Component::Capacitor(2, 0, &damped),
        ];
        let mut circuit = Circuit::new(components, vec![0.0, volt * series(t), 0.0, charge]);
        let fastest = zener.springs_at(piece.from_v.max(piece.to_v))[1] / zener.damper_n_s_per_m;
        let parts = (h * fastest * 100.0).ceil().max(STEPS as f64);
        let part = h / parts;
        let mut done = circuit.find_currents(t, 1e-5 * part);
        for number in 1..=parts as usize {
            done = done.and_then(|()| circuit.step(t + part * number as f64, part, false));
        }
        if let Err(error) = done {
            failed.get_or_insert(error);
        }
        circuit.charge(3)
    });
    if let Some(error) = failed {
        return Err(error);
    }
    let sample = |(time_s, level, damped): (f64, f64, f64)| {
        let charge = volt / zener.springs_at(level)[0] + damped;
        Sample { time_s, level, elongation_m: Some(charge), stiffness: volt / charge }
    };
    Ok(states.into_iter().map(sample).collect())
}

/// Largest difference between two responses, as a part of the largest elongation of the first.
pub fn largest_difference(one: &[Sample], other: &[Sample]) -> f64 {
    let elongation = |sample: &Sample| sample.elongation_m.unwrap_or(f64::NAN);
    let scale = one.iter().map(|sample| elongation(sample).abs()).fold(0.0, f64::max);
    one.iter().zip(other).map(|(one, other)| (elongation(one) - elongation(other)).abs()).fold(0.0, f64::max) / scale
}

#[cfg(test)]
mod tests {
    use proptest::prelude::*;

    use super::*;
    use crate::dynamics::zener::Changes;

    /// The capacitor of the series spring lies across the source, so the rest of the circuit does not depend on it.
    #[test]
    fn the_series_capacitor_does_not_affect_the_rest() {
        let zener = |k1_n_per_m| Zener {
            k1_n_per_m,
            k2_n_per_m: 1.0,
            damper_n_s_per_m: 10.0,
            force_n: 10.0,
            changes: Changes::K2,
        };
        let input = Input::report().unwrap();
        let [soft, hard] = [0.5, 1e9].map(|k1| response(&zener(k1), &input, Start::Unloaded, 1.0).unwrap());
        for (soft, hard) in soft.iter().zip(&hard) {
            let rest = soft.elongation_m.unwrap() - 10.0 / 0.5 - hard.elongation_m.unwrap() + 10.0 / 1e9;
            // Elongations are about 10 m, plus 20 m of the soft series spring.
            assert!(rest.abs() < 1e-6, "{soft:?} {hard:?}");
        }
    }

    proptest! {
        #![proptest_config(ProptestConfig::with_cases(24))]
        /// The responses agree for any springs, damper and changing spring.
        #[test]
        fn the_circuit_response_equals_the_mechanical_response(
            k1 in 0.5..50.0f64, k2 in 0.2..5.0f64, damper in 1.0..30.0f64, force in 0.1..20.0f64,
            settled: bool, which in 0usize..3,
        ) {
            let changes = [Changes::K1, Changes::K2, Changes::Both][which];
            let zener = Zener { k1_n_per_m: k1, k2_n_per_m: k2, damper_n_s_per_m: damper, force_n: force, changes };
            let start = if settled { Start::Settled } else { Start::Unloaded };
            let input = Input::report().unwrap();
            let springs = zener.response(&input, start, 0.5).unwrap();
            let circuit = response(&zener, &input, start, 0.5).unwrap();
            prop_assert!(largest_difference(&springs, &circuit) < 2e-5, "{}", largest_difference(&springs, &circuit));
        }
    }
}
