//! Stability margins of the proportional-integral loop, linearised, at the controller's own rate.
//!
//! ```text
//! L(z) = (Kp + Ki T / (z - 1)) steepness (share + sum_k weight_k r_k / (z - 1 + r_k)),    r = 1 - exp(-T / tau)
//! ```
//!
//! The loop solves for the share that comes at once, so it has no delay. `steepness` is the steepest that law and memory
//! are. Leakage is left out: it is slow, and lowers the gain.
//!
//! Gain margin: what `L` may be multiplied by. Phase margin: how far `L` is from -1 where its magnitude is 1. Greatest
//! sensitivity: the largest of `1 / |1 + L|`; 2 or less is the usual advice (K. J. Astrom, R. M. Murray: Feedback Systems,
//! 2008, chapter 11).

use model::Gains;
use nalgebra::Complex;
use serde::Serialize;

use crate::plant_file::PlantFile;

/// Margins; `None` where nothing ends them.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub struct Margins {
    /// A factor.
    pub gain: Option<f64>,
    /// In degrees.
    pub phase_deg: Option<f64>,
    /// The largest of `1 / |1 + L|`.
    pub greatest_sensitivity: f64,
}

impl Margins {
    /// What tuned gains keep.
    pub const LEAST: Self = Self { gain: Some(2.0), phase_deg: Some(45.0), greatest_sensitivity: 2.0 };

    /// Of these gains on a spring.
    pub fn of(file: &PlantFile, gains: &Gains, rate_hz: f64) -> Self {
        const POINTS: u32 = 2000;
        let highest = std::f64::consts::PI;
        // From a full turn in a day of ticks up to half of one in a tick.
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

    /// Whether they keep [`Margins::LEAST`].
    pub fn enough(&self) -> bool {
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

    /// Slow gains on a spring with little share: in continuous time `L = (Kp + Ki / s) / (1 + tau s)` by hand.
    #[test]
    fn as_by_hand_in_continuous_time() {
        let file = PlantFile::from(Plant { share: 0.0, time_constant_s: 5.5 });
        let margins = Margins::of(&file, &Gains { proportional: 2.0, integral_per_s: 4.0 }, 1000.0);
        // |L| = 1: (Kp^2 w^2 + Ki^2) = w^2 (1 + tau^2 w^2)
        let (b, c) = ((1.0 - 4.0) / 30.25, -16.0 / 30.25);
        let w = ((-b + f64::sqrt(b * b - 4.0 * c)) / 2.0).sqrt();
        let phase = 180.0 + (w * 2.0 / 4.0).atan().to_degrees() - 90.0 - (5.5 * w).atan().to_degrees();
        let got = margins.phase_deg.unwrap();
        assert!((got - phase).abs() < 0.5, "{got} {phase}");
        assert_eq!(margins.gain, None, "two lags never turn it to -180 degrees: {margins:?}");
        assert!(!Margins::of(&file, &Gains { proportional: 0.01, integral_per_s: 50.0 }, 1000.0).enough());
    }
}
