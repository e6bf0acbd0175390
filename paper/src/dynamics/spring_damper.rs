//! The simplified model (Appendix 8.1.6): a spring and a damper in parallel, of relaxed length `l`, under a constant
//! force.
//!
//! ```text
//! K (l - x) - D dx/dt = F
//! ```

use anyhow::Result;
use serde::Serialize;

use crate::dynamics::input::{Input, follow};
use crate::dynamics::runge_kutta;
use crate::dynamics::zener::{Sample, Start};
use simulation::bad_input::check;

/// A damper parallel to a spring whose stiffness is the level times `k_n_per_m`.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub struct SpringDamper {
    /// Spring at level 1, in N/m.
    pub k_n_per_m: f64,
    /// Damper, in N s/m.
    pub damper_n_s_per_m: f64,
    /// Relaxed length, in m.
    pub length_m: f64,
    /// Constant force, in N, compressive.
    pub force_n: f64,
}

impl SpringDamper {
    /// The response, one sample every `every_s` seconds; its `elongation_m` is the compression `l - x`.
    ///
    /// # Errors
    /// [`simulation::bad_input::BadInput`] names the parameter that is out of range.
    pub fn response(&self, input: &Input, start: Start, every_s: f64) -> Result<Vec<Sample>> {
        let Self { k_n_per_m, damper_n_s_per_m: damper, length_m: length, force_n: force } = *self;
        check("k2_n_per_m", k_n_per_m, 1e-9..=1e12, "N/m")?;
        check("damper_n_s_per_m", damper, 1e-9..=1e12, "N s/m")?;
        check("length_m", length, 0.0..=1e12, "m")?;
        check("force_n", force, 1e-12..=1e12, "N")?;
        input.check_positive()?;
        input.check_pace(every_s, damper / (k_n_per_m * input.highest()))?;
        let x = if start == Start::Settled { length - force / (input.first() * k_n_per_m) } else { length };
        let states = follow(input, every_s, x, |piece, t, x, h| {
            let fastest = k_n_per_m * piece.from_v.max(piece.to_v) / damper;
            let parts = (h * fastest / 0.02).ceil().max(1.0);
            let h = h / parts;
            let slope = |t: f64, x: f64| (k_n_per_m * piece.at(t) * (length - x) - force) / damper;
            (0..parts as usize).fold(x, |x, part| runge_kutta(slope, t + h * part as f64, x, h))
        });
        let sample = |(time_s, level, x): (f64, f64, f64)| {
            let compression = length - x;
            // Before any motion the apparent stiffness F / 0 is infinite.
            Sample { time_s, level, elongation_m: Some(compression), stiffness: force / compression }
        };
        Ok(states.into_iter().map(sample).collect())
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::dynamics::zener::{Changes, Zener};

    const PAPER: SpringDamper = SpringDamper { k_n_per_m: 1.0, damper_n_s_per_m: 10.0, length_m: 1.0, force_n: 10.0 };

    /// Section 8.2.1: the position settles at l - F/K = -9, -1.5, -0.43 and -9 m.
    #[test]
    fn settles_where_the_spring_carries_the_force() {
        let samples = PAPER.response(&Input::report().unwrap(), Start::Settled, 0.1).unwrap();
        for (time, x, within) in
            [(30.0, -9.0, 1e-9), (60.0, -1.5, 1e-4), (90.0, 1.0 - 10.0 / 7.0, 1e-6), (120.0, -9.0, 0.5)]
        {
            let sample = samples.iter().rfind(|sample| (sample.time_s - time).abs() < 1e-6).unwrap();
            assert!((PAPER.length_m - sample.elongation_m.unwrap() - x).abs() < within, "{sample:?}");
        }
    }

    /// A rigid series spring reduces the Zener model to this one.
    #[test]
    fn it_is_the_zener_model_with_a_rigid_series_spring() {
        let zener =
            Zener { k1_n_per_m: 1e9, k2_n_per_m: 1.0, damper_n_s_per_m: 10.0, force_n: 10.0, changes: Changes::K2 };
        let input = Input::report().unwrap();
        let full = zener.response(&input, Start::Unloaded, 0.1).unwrap();
        for (full, simple) in full.iter().zip(PAPER.response(&input, Start::Unloaded, 0.1).unwrap()) {
            assert!((full.elongation_m.unwrap() - simple.elongation_m.unwrap()).abs() < 1e-7);
        }
    }
}
