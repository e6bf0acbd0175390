//! The Zener model: spring `K1` in series with a spring `K2` parallel to a damper `D`, under a constant force.
//!
//! ```text
//! e = F / K1 + y,   D dy/dt + K2 y = F
//! ```
//!
//! `e` is the elongation, `y` that of the damped part, and `F / e` the apparent stiffness. Appendix 8.1.5 prints the
//! damper's force with the wrong sign (`F_D = -D d(x2 - x1)/dt`, where `-F1 + F2 + F_D = 0` needs plus); its next
//! equation is correct and agrees with the above.

use anyhow::Result;
use serde::Serialize;

use crate::dynamics::input::{Input, follow};
use crate::dynamics::runge_kutta;
use simulation::bad_input::check;

/// A Zener model; a spring that follows the level has the stiffness given here times the level.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub struct Zener {
    /// Series spring at level 1, in N/m.
    pub k1_n_per_m: f64,
    /// Damped spring at level 1, in N/m.
    pub k2_n_per_m: f64,
    /// Damper, in N s/m.
    pub damper_n_s_per_m: f64,
    /// Constant force, in N.
    pub force_n: f64,
    /// The springs that follow the level.
    pub changes: Changes,
}

/// The springs that follow the level.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize)]
#[serde(rename_all = "kebab-case")]
pub enum Changes {
    /// The series spring: the whole change is instantaneous.
    K1,
    /// The damped spring: the whole change is delayed.
    #[default]
    K2,
    /// Both in the same ratio: part of the change is instantaneous, as measured.
    Both,
}

/// One sample of a response.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub struct Sample {
    /// Time, in s.
    pub time_s: f64,
    /// Level of the input.
    pub level: f64,
    /// Elongation, in m; `None` for the proportional-integral plant.
    pub elongation_m: Option<f64>,
    /// Apparent stiffness, force by elongation, in N/m; for the plant its output in V.
    pub stiffness: f64,
}

/// Initial state of a response.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Start {
    /// The force has just been applied: the damper has not moved.
    Unloaded,
    /// In equilibrium under the force and the first level.
    Settled,
}

impl Zener {
    /// Returns the model if all parameters are within range.
    ///
    /// # Errors
    /// [`simulation::bad_input::BadInput`] names the field, its value and the allowed range.
    pub fn checked(self) -> Result<Self> {
        check("k1_n_per_m", self.k1_n_per_m, 1e-9..=1e12, "N/m")?;
        check("k2_n_per_m", self.k2_n_per_m, 1e-9..=1e12, "N/m")?;
        check("damper_n_s_per_m", self.damper_n_s_per_m, 1e-9..=1e12, "N s/m")?;
        check("force_n", self.force_n, 1e-12..=1e12, "N")?;
        Ok(self)
    }

    /// Stiffness of both springs, in N/m, at a level.
    pub fn springs_at(&self, level: f64) -> [f64; 2] {
        let [first, second] = match self.changes {
            Changes::K1 => [level, 1.0],
            Changes::K2 => [1.0, level],
            Changes::Both => [level, level],
        };
        [first * self.k1_n_per_m, second * self.k2_n_per_m]
    }

    /// The response, one sample every `every_s` seconds and at both ends of every piece of the input.
    ///
    /// # Errors
    /// [`simulation::bad_input::BadInput`] names the parameter that is out of range.
    pub fn response(&self, input: &Input, start: Start, every_s: f64) -> Result<Vec<Sample>> {
        let Self { damper_n_s_per_m: damper, force_n: force, .. } = self.checked()?;
        input.check_positive()?;
        input.check_pace(every_s, damper / self.springs_at(input.highest())[1])?;
        let y = if start == Start::Settled { force / self.springs_at(input.first())[1] } else { 0.0 };
        let states = follow(input, every_s, y, |piece, t, y, h| {
            // Steps much shorter than the smallest time constant within the piece.
            let fastest = self.springs_at(piece.from_v.max(piece.to_v))[1] / damper;
            let parts = (h * fastest / 0.02).ceil().max(1.0);
            let h = h / parts;
            let slope = |t: f64, y: f64| (force - self.springs_at(piece.at(t))[1] * y) / damper;
            (0..parts as usize).fold(y, |y, part| runge_kutta(slope, t + h * part as f64, y, h))
        });
        let sample = |(time_s, level, y): (f64, f64, f64)| {
            let elongation = force / self.springs_at(level)[0] + y;
            Sample { time_s, level, elongation_m: Some(elongation), stiffness: force / elongation }
        };
        Ok(states.into_iter().map(sample).collect())
    }
}

#[cfg(test)]
mod tests {
    use proptest::prelude::*;

    use super::*;

    pub(crate) const PAPER: Zener =
        Zener { k1_n_per_m: 10.0, k2_n_per_m: 1.0, damper_n_s_per_m: 10.0, force_n: 10.0, changes: Changes::K2 };

    /// Held levels have a closed-form response.
    #[test]
    fn a_step_of_the_damped_spring_agrees_with_the_closed_form() {
        let input = Input::held(&[(0.0, 1.0), (30.0, 4.0), (60.0, 4.0)]);
        for sample in PAPER.response(&input, Start::Settled, 0.5).unwrap() {
            let y = if sample.time_s <= 30.0 { 10.0 } else { 2.5 + 7.5 * (-(sample.time_s - 30.0) / 2.5).exp() };
            assert!((sample.elongation_m.unwrap() - 1.0 - y).abs() < 1e-7, "{sample:?}");
        }
    }

    #[test]
    fn a_step_of_the_series_spring_is_instantaneous() {
        let zener = Zener { changes: Changes::K1, ..PAPER };
        let input = Input::held(&[(0.0, 1.0), (5.0, 2.0), (9.0, 2.0)]);
        for sample in zener.response(&input, Start::Settled, 1.0).unwrap() {
            let series = if sample.level == 1.0 { 1.0 } else { 0.5 };
            assert!((sample.elongation_m.unwrap() - 10.0 - series).abs() < 1e-9, "{sample:?}");
        }
    }

    #[test]
    fn an_invalid_model_is_rejected_with_its_field() {
        let input = Input::report().unwrap();
        for (zener, field) in [
            (Zener { k1_n_per_m: 0.0, ..PAPER }, "k1_n_per_m"),
            (Zener { k2_n_per_m: -1.0, ..PAPER }, "k2_n_per_m"),
            (Zener { damper_n_s_per_m: f64::NAN, ..PAPER }, "damper_n_s_per_m"),
            (Zener { force_n: f64::INFINITY, ..PAPER }, "force_n"),
        ] {
            let error = zener.response(&input, Start::Unloaded, 1.0).unwrap_err();
            assert!(error.is::<simulation::bad_input::BadInput>() && error.to_string().starts_with(field), "{error}");
        }
        let zero = Input::held(&[(0.0, 1.0), (1.0, 0.0), (2.0, 0.0)]);
        let error = PAPER.response(&zero, Start::Unloaded, 1.0).unwrap_err().to_string();
        assert!(error.contains("level 0 at 1 s"), "{error}");
    }

    proptest! {
        #![proptest_config(ProptestConfig::with_cases(32))]
        /// Elongation is proportional to the force, stiffness independent of it; times are proportional to the damper.
        #[test]
        fn elongation_scales_with_force_and_time_with_the_damper(force in 0.1..100.0f64, slow in 0.2..5.0f64) {
            let input = Input::held(&[(0.0, 1.0), (10.0, 3.0), (20.0, 3.0)]);
            let slowly = Input::held(&[(0.0, 1.0), (10.0 * slow, 3.0), (20.0 * slow, 3.0)]);
            let other = Zener { force_n: force, damper_n_s_per_m: slow * PAPER.damper_n_s_per_m, ..PAPER };
            let one = PAPER.response(&input, Start::Unloaded, 1.0).unwrap();
            let two = other.response(&slowly, Start::Unloaded, slow).unwrap();
            prop_assert_eq!(one.len(), two.len());
            for (one, two) in one.iter().zip(&two) {
                prop_assert!((one.stiffness / two.stiffness - 1.0).abs() < 1e-7, "{:?} {:?}", one, two);
            }
        }
    }
}
