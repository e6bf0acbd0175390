//! Stability margins of the linearised proportional-integral loop at the controller's rate.
//!
//! ```text
//! L(z) = (Kp + Ki T / (z - 1)) steepness (share + sum_k weight_k r_k / (z - 1 + r_k)),    r = 1 - exp(-T / tau)
//! ```
//!
//! The controller solves for the instantaneous share, so the loop has no delay. `steepness` is the largest slope of law
//! and play operators. Leakage is neglected: it is slow and reduces the gain.
//!
//! Gain margin: the factor on `L` at the stability limit. Phase margin: the phase distance of `L` from -180 degrees
//! where `|L| = 1`. Largest sensitivity: the maximum of `1 / |1 + L|`, for which 2 or less is recommended (K. J.
//! Astrom, R. M. Murray: Feedback Systems, 2008, chapter 11).

use model::Gains;
use nalgebra::Complex;
use serde::Serialize;

use crate::plant_file::PlantFile;

/// Stability margins; a margin is `None` if it is unlimited.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub struct Margins {
    /// Gain margin, a factor.
    pub gain: Option<f64>,
    /// Phase margin, in degrees.
    pub phase_deg: Option<f64>,
    /// Maximum of `1 / |1 + L|`.
    pub greatest_sensitivity: f64,
}

impl Margins {
    /// The margins required of tuned gains.
    pub const LEAST: Self = Self { gain: Some(2.0), phase_deg: Some(45.0), greatest_sensitivity: 2.0 };

    /// Margins of a controller with these gains on a spring, at `rate_hz` ticks per second.
    pub fn of(file: &PlantFile, gains: &Gains, rate_hz: f64) -> Self {
        const POINTS: u32 = 2000;
        let highest = std::f64::consts::PI;
        // Frequencies from 1e-7 of half a turn per tick up to half a turn per tick.
        let angles =
            (0..=POINTS).map(|point| highest * 10f64.powf(-7.0 * (1.0 - f64::from(point) / f64::from(POINTS))));
        let open = |angle: f64| open_loop(file, gains, rate_hz, Complex::from_polar(1.0, angle));
        let mut margins = Self { gain: None, phase_deg: None, greatest_sensitivity: 0.0 };
        let least = |so_far: Option<f64>, found: f64| Some(so_far.map_or(found, |so_far| so_far.min(found)));
        let mut before: Option<Complex<f64>> = None;
        for value in angles.map(open) {
            margins.greatest_sensitivity = margins.greatest_sensitivity.max(1.0 / (value + 1.0).norm());
            if let Some(before) = before {
                if (before.norm() - 1.0) * (value.norm() - 1.0) <= 0.0 {
                    margins.phase_deg = least(margins.phase_deg, 180.0 - value.arg().abs().to_degrees());
                }
                if before.im * value.im <= 0.0 && value.re < 0.0 && value.norm() < 1.0 {
                    margins.gain = least(margins.gain, 1.0 / value.norm());
                }
            }
            before = Some(value);
        }
        margins
    }

    /// True if all margins are at least as good as [`Margins::LEAST`].
    pub fn sufficient(&self) -> bool {
        let at_least =
            |own: Option<f64>, least: Option<f64>| own.is_none_or(|own| least.is_none_or(|least| own >= least));
        at_least(self.gain, Self::LEAST.gain)
            && at_least(self.phase_deg, Self::LEAST.phase_deg)
            && self.greatest_sensitivity <= Self::LEAST.greatest_sensitivity
    }
}

fn open_loop(file: &PlantFile, gains: &Gains, rate_hz: f64, z: Complex<f64>) -> Complex<f64> {
    let plant = file.extended();
    let spring = plant.relaxation.lags().fold(Complex::from(plant.relaxation.share), |sum, (tau, weight)| {
        let made = -(-1.0 / (tau * rate_hz)).exp_m1();
        sum + weight * made / (z - 1.0 + made)
    });
    let law = file.law.as_ref().map_or(1.0, |law| {
        let slopes = law.voltage_v.windows(2).zip(&law.stiffness).zip(law.stiffness.iter().skip(1));
        slopes.map(|((volts, from), to)| (to - from) / (volts[1] - volts[0])).fold(0.0, f64::max)
    });
    let memory = file.memory.as_ref().map_or(1.0, |memory| memory.direct + memory.weights.iter().sum::<f64>());
    let controller = gains.integral_per_s / rate_hz / (z - 1.0) + gains.proportional;
    controller * spring * law * memory
}

#[cfg(test)]
mod tests {
    use super::*;
    use model::Plant;

    /// Low gains on a spring without instantaneous share: in continuous time `L = (Kp + Ki / s) / (1 + tau s)`.
    #[test]
    fn margins_agree_with_the_closed_form_in_continuous_time() {
        let file = PlantFile::from(Plant { share: 0.0, time_constant_s: 5.5 });
        let margins = Margins::of(&file, &Gains { proportional: 2.0, integral_per_s: 4.0 }, 1000.0);
        // |L| = 1: (Kp^2 w^2 + Ki^2) = w^2 (1 + tau^2 w^2)
        let (b, c) = ((1.0 - 4.0) / 30.25, -16.0 / 30.25);
        let w = ((-b + f64::sqrt(b * b - 4.0 * c)) / 2.0).sqrt();
        let phase = 180.0 + (w * 2.0 / 4.0).atan().to_degrees() - 90.0 - (5.5 * w).atan().to_degrees();
        let got = margins.phase_deg.unwrap();
        assert!((got - phase).abs() < 0.5, "{got} {phase}");
        assert_eq!(margins.gain, None, "two lags never turn it to -180 degrees: {margins:?}");
        assert!(!Margins::of(&file, &Gains { proportional: 0.01, integral_per_s: 50.0 }, 1000.0).sufficient());
    }
}
