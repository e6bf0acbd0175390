//! The proportional-integral plant (section 4.2.2) without a controller; its input is the level as a voltage `u` in V.
//!
//! ```text
//! (Kp s + Ki) / ((1 + Kp) s + Ki),   that is   y = w + share (u - w),   tau dw/dt = u - w
//! ```

use anyhow::Result;
use model::Plant;
use serde::Serialize;

use crate::dynamics::input::{Input, follow};
use crate::dynamics::zener::{Sample, Start};
use simulation::bad_input::check;

/// Gains of the proportional-integral plant.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub struct PlantGains {
    /// Proportional gain Kp, dimensionless.
    pub proportional: f64,
    /// Integral gain Ki, in 1/s.
    pub integral_per_s: f64,
}

impl PlantGains {
    /// The gains of a plant given by instantaneous share and time constant.
    pub fn of(plant: &Plant) -> Self {
        let proportional = plant.share / (1.0 - plant.share);
        Self { proportional, integral_per_s: (1.0 + proportional) / plant.time_constant_s }
    }

    /// Instantaneous share and time constant of these gains.
    pub fn plant(&self) -> Plant {
        let sum = 1.0 + self.proportional;
        Plant { share: self.proportional / sum, time_constant_s: sum / self.integral_per_s }
    }

    /// Returns the gains if both are positive and within range.
    ///
    /// # Errors
    /// [`simulation::bad_input::BadInput`] names the gain that is out of range.
    pub fn checked(self) -> Result<Self> {
        check("proportional", self.proportional, 1e-9..=1e9, "")?;
        check("integral_per_s", self.integral_per_s, 1e-9..=1e9, "1/s")?;
        Ok(self)
    }

    /// The exact response, one sample every `every_s` seconds.
    ///
    /// # Errors
    /// [`simulation::bad_input::BadInput`] names the gain or interval that is out of range.
    pub fn response(&self, input: &Input, start: Start, every_s: f64) -> Result<Vec<Sample>> {
        // The solution is exact, so any time constant can be followed.
        input.check_pace(every_s, f64::INFINITY)?;
        let Plant { share, time_constant_s: tau } = self.checked()?.plant();
        let relaxed = if start == Start::Settled { input.first() } else { 0.0 };
        let states = follow(input, every_s, relaxed, |piece, t, relaxed, h| {
            let (voltage, lag) = (piece.at(t), piece.slope() * tau);
            voltage + piece.slope() * h - lag + (relaxed - voltage + lag) * (-h / tau).exp()
        });
        let sample = |(time_s, level, relaxed): (f64, f64, f64)| {
            let output = relaxed + share * (level - relaxed);
            Sample { time_s, level, elongation_m: None, stiffness: output }
        };
        Ok(states.into_iter().map(sample).collect())
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::table3;

    /// On the stair, the plant gives the column "without controller" of Table 3 to the last digit but for one number.
    #[test]
    fn the_plant_reproduces_table_3_without_controller() {
        let gains = PlantGains { proportional: 0.1, integral_per_s: 0.2 };
        let stair = Input::open("stair", Default::default()).unwrap();
        let samples = gains.response(&stair, Start::Unloaded, 0.1).unwrap();
        for row in table3::rows().unwrap() {
            let at = samples.iter().rfind(|sample| (sample.time_s - row.time_s).abs() < 1e-6).unwrap();
            assert!((-1e-4..0.01).contains(&(at.stiffness - row.without)), "{row:?} {at:?}");
        }
    }
}
