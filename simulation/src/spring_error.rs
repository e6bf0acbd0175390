//! A spring whose parameters differ from those of a controller's model, in closed loop with the fixed-point tick.
//!
//! Each parameter of the spring is `1 + error` times the model's. A share keeps the settled value, and an error of the time constant
//! changes all time constants.

use anyhow::Result;
use model::estimator::Estimator;
use model::units::Signal;
use model::{Config, Input, Output, Reading, ScaledStiffness, State, Volts};
use rand_chacha::ChaCha8Rng;
use rand_chacha::rand_core::SeedableRng;
use rand_distr::{Distribution, StandardNormal};
use serde::Serialize;

use crate::bad_input;
use crate::bad_input::BadInput;
use crate::plant_file::PlantFile;
use crate::run::Sample;
use crate::sampled::Spring;

/// A parameter of the spring that differs from the model.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize)]
#[serde(rename_all = "kebab-case")]
pub enum Parameter {
    /// The instantaneous share, at constant settled value.
    Share,
    /// All time constants.
    TimeConstant,
    /// The gain of the whole response.
    Gain,
}

impl Parameter {
    /// All parameters.
    pub const ALL: [Self; 3] = [Self::Share, Self::TimeConstant, Self::Gain];

    /// Name for texts and tables.
    pub fn name(self) -> &'static str {
        match self {
            Self::Share => "share",
            Self::TimeConstant => "time constant",
            Self::Gain => "gain",
        }
    }
}

/// Relative differences of the spring's parameters from the model's, above -1.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize)]
pub struct SpringError {
    /// Relative difference of the instantaneous share.
    pub share: f64,
    /// Relative difference of all time constants.
    pub time_constant: f64,
    /// Relative difference of the gain of the whole response.
    pub gain: f64,
    /// Difference of the instantaneous share as a part of the settled response, which also says something of a share near 0. The share
    /// that results is kept within 0 to 1.
    #[serde(skip_serializing_if = "is_zero")]
    pub share_of_response: f64,
}

/// Returns true for 0; serde omits such a field.
fn is_zero(value: &f64) -> bool {
    *value == 0.0
}

impl SpringError {
    /// The error of a parameter.
    pub fn of(&mut self, parameter: Parameter) -> &mut f64 {
        match parameter {
            Parameter::Share => &mut self.share,
            Parameter::TimeConstant => &mut self.time_constant,
            Parameter::Gain => &mut self.gain,
        }
    }

    /// The errors with another error of a parameter.
    #[must_use]
    pub fn with(mut self, parameter: Parameter, error: f64) -> Self {
        *self.of(parameter) = error;
        self
    }

    /// The errors of the springs at the ends of these errors: every combination in which each parameter that has an error is off by one of
    /// these parts of it.
    #[must_use]
    pub fn ends(&self, parts: &[f64]) -> Vec<Self> {
        let all = vec![*self];
        Parameter::ALL.into_iter().filter(|parameter| self.is_off(*parameter)).fold(all, |ends, parameter| {
            ends.iter().flat_map(|end| parts.iter().map(move |part| end.times(parameter, *part))).collect()
        })
    }

    fn is_off(mut self, parameter: Parameter) -> bool {
        *self.of(parameter) != 0.0 || parameter == Parameter::Share && self.share_of_response != 0.0
    }

    fn times(mut self, parameter: Parameter, part: f64) -> Self {
        *self.of(parameter) *= part;
        if parameter == Parameter::Share {
            self.share_of_response *= part;
        }
        self
    }
}

/// The spring that a controller drives.
#[derive(Clone, Debug)]
pub struct DifferingSpring {
    /// The spring but for its gain.
    pub file: PlantFile,
    /// Factor of its stiffness.
    pub gain: f64,
}

impl DifferingSpring {
    /// A spring that differs from a file's, whether or not it can be.
    pub fn new(file: &PlantFile, error: &SpringError) -> Self {
        let mut file = file.clone();
        let relaxation = &mut file.relaxation;
        let factor = 1.0 + error.time_constant;
        relaxation.tau_s.iter_mut().chain(&mut relaxation.tau_high_s).for_each(|tau| *tau *= factor);
        let share = match error.share_of_response {
            0.0 => relaxation.share * (1.0 + error.share),
            of_response => (relaxation.share * (1.0 + error.share) + of_response).clamp(0.0, 1.0),
        };
        let later: f64 = relaxation.weights.iter().sum();
        if later != 0.0 {
            let left = (later + relaxation.share - share) / later;
            relaxation.weights.iter_mut().for_each(|weight| *weight *= left);
        }
        relaxation.share = share;
        Self { file, gain: 1.0 + error.gain }
    }

    /// Checks whether there can be such a spring.
    ///
    /// # Errors
    /// [`BadInput`] with the parameter and its range.
    pub fn check(&self) -> Result<()> {
        let share = self.file.relaxation.share;
        if !(0.0..=1.0).contains(&share) {
            bad_input!("the spring with its errors: relaxation.share = {share} is not allowed: expected 0 to 1");
        }
        self.file.check_for_host().map_err(|error| BadInput(format!("the spring with its errors: {error}")).into())
    }

    /// The spring in double precision, without its gain.
    pub fn spring(&self) -> Spring {
        Spring::from(self.file.extended())
    }

    /// Runs the tick on this spring from rest, with one target in V per tick of `sample_s` s; the stiffness of the samples is the
    /// spring's. A sensor reads it before each tick with white noise of a standard deviation in V.
    ///
    /// # Errors
    /// [`BadInput`] for targets beyond +-2000 V.
    pub fn closed_loop<E: Estimator>(
        &self,
        config: &Config<E>,
        targets: &[f64],
        sample_s: f64,
        sensor_noise_v: Option<f64>,
    ) -> Result<Vec<Sample>> {
        let spring = self.spring();
        let (mut at, mut state) = (spring.at_rest(), State::default());
        let mut random = ChaCha8Rng::seed_from_u64(1);
        let stiffness = |volts: f64| ScaledStiffness(Signal::saturating_from_num(volts));
        let tick = |&target: &f64| {
            let target = Volts::new(target).map_err(BadInput::from)?;
            let measured = sensor_noise_v.and_then(|noise_v| {
                let noise: f64 = StandardNormal.sample(&mut random);
                Reading::fresh(stiffness(self.gain * spring.stiffness(&at) + noise_v * noise))
            });
            let Output { code, applied, limits, .. } = config.tick(&mut state, Input { target, measured });
            spring.apply(&mut at, applied.to_f64());
            let now = self.gain * spring.stiffness(&at);
            spring.hold(&mut at, sample_s);
            Ok(Sample { code, applied, stiffness: stiffness(now), limits, reference: now })
        };
        targets.iter().map(tick).collect()
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::plant_file::parse;
    use crate::sampled::simulate;
    use model::Plant;

    fn differing(file: &PlantFile, parameter: Parameter, by: f64) -> DifferingSpring {
        DifferingSpring::new(file, &SpringError::default().with(parameter, by))
    }

    /// The settled value is independent of share and time constants.
    #[test]
    fn share_and_time_constant_do_not_change_the_settled_value() {
        let text = "schema = 1\n[relaxation]\nshare = 0.1\ntau_s = [2.0, 9.0]\nweights = [0.5, 0.3]\n";
        for file in [PlantFile::from(Plant::PAPER), parse("two lags", text).unwrap()] {
            let settled = |of: &DifferingSpring| of.gain * simulate(&of.spring(), &[0.0, 1e4], &[100.0, 100.0])[1];
            let nominal = settled(&DifferingSpring::new(&file, &SpringError::default()));
            for parameter in Parameter::ALL {
                let of = differing(&file, parameter, 0.4);
                let expected = if parameter == Parameter::Gain { 1.4 * nominal } else { nominal };
                assert!((settled(&of) - expected).abs() < 1e-6, "{parameter:?}");
            }
        }
    }

    /// Of a share of 0 a part is 0; a part of the response is not.
    #[test]
    fn an_error_as_a_part_of_the_response_changes_a_share_of_zero() {
        let file = PlantFile::from(Plant { share: 0.0, time_constant_s: 40.0 });
        let error = SpringError { share_of_response: 0.05, gain: 0.01, ..SpringError::default() };
        let shares: Vec<f64> =
            error.ends(&[1.0, -1.0]).iter().map(|end| DifferingSpring::new(&file, end).file.relaxation.share).collect();
        assert_eq!(shares, [0.05, 0.05, 0.0, 0.0]);
    }

    #[test]
    fn a_spring_that_cannot_be_is_refused() {
        let paper = PlantFile::from(Plant::PAPER);
        for (parameter, by) in [(Parameter::TimeConstant, -1.0), (Parameter::Share, 20.0)] {
            let error = differing(&paper, parameter, by).check().unwrap_err();
            assert!(error.is::<BadInput>(), "{parameter:?}: {error}");
        }
    }
}
