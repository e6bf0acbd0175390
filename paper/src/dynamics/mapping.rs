//! The Zener model that is equivalent to the proportional-integral plant, and the limits of that equivalence.
//!
//! The plant's transfer function from voltage to stiffness is `(Kp s + Ki) / ((1 + Kp) s + Ki)`; that of the Zener
//! model, elongation by force with static gain 1, is `K2/(K1+K2) (D s + K1 + K2) / (D s + K2)`. They are equal for
//!
//! ```text
//! share = Kp / (1 + Kp) = K2 / (K1 + K2),   tau = (1 + Kp) / Ki = D / K2     that is   Kp = K2 / K1
//! ```
//!
//! This holds for a changing force. If instead the *stiffness* changes under a constant force, the Zener model has the
//! time constant `D / K2` of the new stiffness, and its stiffness is the reciprocal of a quantity that relaxes
//! exponentially, whereas the plant keeps one time constant. The plant therefore approximates the Zener model for small
//! changes only.

use anyhow::Result;
use model::Plant;

use crate::dynamics::input::Input;
use crate::dynamics::plant::PlantGains;
use crate::dynamics::zener::{Changes, Start, Zener};
use simulation::bad_input::check;

impl PlantGains {
    /// The Zener model equivalent to this plant, given the damped spring at level 1 (N/m) and the force (N).
    ///
    /// # Errors
    /// [`simulation::bad_input::BadInput`] for gains that are not positive.
    pub fn zener(&self, k2_n_per_m: f64, force_n: f64) -> Result<Zener> {
        let Self { proportional, .. } = self.checked()?;
        let zener = Zener {
            k1_n_per_m: k2_n_per_m / proportional,
            k2_n_per_m,
            damper_n_s_per_m: self.plant().time_constant_s * k2_n_per_m,
            force_n,
            changes: Changes::Both,
        };
        zener.checked()
    }
}

/// The plant that is equivalent to a Zener model at level 1 under a changing force.
pub fn plant_of(zener: &Zener) -> PlantGains {
    let proportional = zener.k2_n_per_m / zener.k1_n_per_m;
    let time_constant_s = zener.damper_n_s_per_m / zener.k2_n_per_m;
    PlantGains { proportional, integral_per_s: (1.0 + proportional) / time_constant_s }
}

/// Largest difference between plant and Zener model, as a part of the change, after both springs step by `ratio`.
///
/// # Errors
/// [`simulation::bad_input::BadInput`] for a ratio that is not positive.
pub fn stand_in_error(zener: &Zener, ratio: f64) -> Result<f64> {
    check("ratio", ratio, 1e-3..=1e3, "")?;
    // Only ratios matter: with a damper numerically equal to its spring, times are in units of the time constant.
    let both = Zener { changes: Changes::Both, damper_n_s_per_m: zener.k2_n_per_m, ..*zener };
    let Plant { share, time_constant_s: tau } = plant_of(&both).plant();
    let end_s = 8.0 * tau * ratio.recip().max(1.0);
    let input = Input::held(&[(0.0, 1.0), (tau, ratio), (tau + end_s, ratio)]);
    let samples = both.response(&input, Start::Settled, tau / 200.0)?;
    let before = samples[0].stiffness;
    let part = |stiffness: f64| (stiffness / before - 1.0) / (ratio - 1.0);
    let after = samples.iter().filter(|sample| sample.level == ratio);
    let error = |sample: &crate::dynamics::zener::Sample| {
        let plant = 1.0 - (1.0 - share) * (-(sample.time_s - tau) / tau).exp();
        (part(sample.stiffness) - plant).abs()
    };
    Ok(after.map(error).fold(0.0, f64::max))
}

/// Largest ratio, 1 to 100, by which both springs may step up before the plant's error exceeds `tolerance`.
///
/// # Errors
/// [`simulation::bad_input::BadInput`] for a tolerance that is not between 0.0001 and 0.2.
pub fn stand_in_limit(zener: &Zener, tolerance: f64) -> Result<f64> {
    check("tolerance", tolerance, 1e-4..=0.2, "of the change")?;
    let (mut low, mut high) = (1.0 + 1e-6, 100.0);
    for _ in 0..40 {
        let middle = 0.5 * (low + high);
        if stand_in_error(zener, middle)? < tolerance { low = middle } else { high = middle }
    }
    Ok(low)
}

#[cfg(test)]
mod tests {
    use proptest::prelude::*;

    use super::*;

    #[test]
    fn the_plant_of_the_report_has_its_zener_model() {
        let gains = PlantGains::of(&Plant::PAPER);
        assert!((gains.proportional - 0.1).abs() < 1e-9 && (gains.integral_per_s - 0.2).abs() < 1e-9, "{gains:?}");
        let zener = gains.zener(1.0, 10.0).unwrap();
        assert!((zener.k1_n_per_m - 10.0).abs() < 1e-8 && (zener.damper_n_s_per_m - 5.5).abs() < 1e-8, "{zener:?}");
        assert!(PlantGains { proportional: 0.0, integral_per_s: 1.0 }.zener(1.0, 1.0).is_err());
    }

    proptest! {
        #[test]
        fn converting_to_a_zener_model_and_back_recovers_the_gains(kp in 0.01..10.0f64, ki in 0.01..10.0f64, k2 in 0.1..10.0f64) {
            let gains = PlantGains { proportional: kp, integral_per_s: ki };
            let back = plant_of(&gains.zener(k2, 1.0).unwrap());
            prop_assert!((back.proportional / kp - 1.0).abs() < 1e-9 && (back.integral_per_s / ki - 1.0).abs() < 1e-9);
        }

        /// At every frequency the two transfer functions are equal.
        #[test]
        fn transfer_functions_are_equal(kp in 0.01..10.0f64, ki in 0.01..10.0f64, omega in 0.001..100.0f64) {
            use nalgebra::Complex;
            let zener = PlantGains { proportional: kp, integral_per_s: ki }.zener(1.0, 1.0).unwrap();
            let s = Complex::new(0.0, omega);
            let plant = (s * kp + ki) / (s * (1.0 + kp) + ki);
            let Zener { k1_n_per_m: k1, k2_n_per_m: k2, damper_n_s_per_m: d, .. } = zener;
            let compliance = |s: Complex<f64>| (s * d + k2).inv() + 1.0 / k1;
            let zener = compliance(s) / compliance(Complex::new(0.0, 0.0));
            prop_assert!((plant - zener).norm() < 1e-12);
        }
    }

    /// The error vanishes with the size of the change and is of first order in it, because the time constant changes.
    #[test]
    fn the_error_vanishes_with_the_size_of_the_change() {
        let zener = PlantGains::of(&Plant::PAPER).zener(1.0, 1.0).unwrap();
        let [tenth, hundredth] = [1.1, 1.01].map(|ratio| stand_in_error(&zener, ratio).unwrap());
        assert!(tenth > 0.01 && hundredth < 0.15 * tenth, "{tenth} {hundredth}");
        let limit = stand_in_limit(&zener, 0.05).unwrap();
        assert!((stand_in_error(&zener, limit).unwrap() - 0.05).abs() < 1e-4 && limit > 1.01);
    }
}
