//! The effect of model errors: a controller computed with the nominal spring drives springs that differ from it.
//!
//! Without a sensor the controller cannot detect the difference, so its voltages are those of the nominal run, and only
//! the response of the spring changes. A step is measured from the stiffness at its start.

use model::ScaledStiffness;
use serde::Serialize;

use crate::experiment::{Run, Sample};
use crate::plant_file::PlantFile;
use crate::response::measure;
use crate::sampled::{self, Spring};
use crate::schedule::{Change, Schedule};
use crate::tune::worst::Worst;

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

/// Both controllers on a spring that differs from their model.
#[derive(Clone, Copy, Debug, Serialize)]
pub struct Trade {
    /// The parameter that differs.
    pub parameter: Parameter,
    /// Relative difference of the spring's parameter from the model's, -0.5 to 0.5.
    pub error: f64,
    /// Worst response with the tuned proportional-integral controller; `None` if there are no gains.
    pub proportional_integral: Option<Worst>,
    /// Worst response with the time-optimal controller.
    pub fast: Option<Worst>,
}

/// Evaluates errors of -50 % to +50 % in steps of 5 %.
pub(super) fn over_model_errors(file: &PlantFile, with_gains: Option<&Run>, fast: Option<&Run>) -> Vec<Trade> {
    let mut trade = Vec::new();
    for parameter in Parameter::ALL {
        for part in -10..=10 {
            let error = f64::from(part) / 20.0;
            let on = |run: Option<&Run>| run.map(|run| with_model_error(file, parameter, error, run));
            trade.push(Trade { parameter, error, proportional_integral: on(with_gains), fast: on(fast) });
        }
    }
    trade
}

/// Worst response when the voltages of `run` drive a spring that differs from the file's.
fn with_model_error(file: &PlantFile, parameter: Parameter, error: f64, run: &Run) -> Worst {
    let (spring, gain) = differing_spring(file, parameter, 1.0 + error);
    let times: Vec<f64> = (0..run.with.len()).map(|tick| run.time_s(tick)).collect();
    let volts: Vec<f64> = run.with.iter().map(|sample| sample.applied.to_f64()).collect();
    let stiffness = sampled::simulate(&spring, &times, &volts);
    let answered = |(sample, stiffness): (&Sample, f64)| Sample {
        stiffness: ScaledStiffness(model::units::Signal::saturating_from_num(gain * stiffness)),
        ..*sample
    };
    let samples: Vec<Sample> = run.with.iter().zip(stiffness).map(answered).collect();
    let each = Schedule::ideal_stair().changes().into_iter().map(|change| {
        // The tick before the target changes.
        let from_v = samples[run.tick_at(change.start_s).saturating_sub(1)].stiffness.to_f64();
        let moved = Change { from_v, to_v: from_v + change.to_v - change.from_v, ..change };
        let response = measure(run, &samples, &moved, None);
        (response.t97_s, response.overshoot_percent)
    });
    Worst::of(each)
}

/// A spring whose `parameter` is `factor` times the file's, and the gain of its response.
fn differing_spring(file: &PlantFile, parameter: Parameter, factor: f64) -> (Spring, f64) {
    let mut file = file.clone();
    let relaxation = &mut file.relaxation;
    match parameter {
        Parameter::Gain => return (Spring::from(file.extended()), factor),
        Parameter::TimeConstant => {
            relaxation.tau_s.iter_mut().chain(&mut relaxation.tau_high_s).for_each(|tau| *tau *= factor);
        }
        Parameter::Share => {
            let share = relaxation.share * factor;
            let later: f64 = relaxation.weights.iter().sum();
            if later != 0.0 {
                let left = (later + relaxation.share - share) / later;
                relaxation.weights.iter_mut().for_each(|weight| *weight *= left);
            }
            relaxation.share = share;
        }
    }
    (Spring::from(file.extended()), 1.0)
}

#[cfg(test)]
mod tests {
    use super::*;
    use model::Plant;

    /// The settled value is independent of share and time constants.
    #[test]
    fn share_and_time_constant_do_not_change_the_settled_value() {
        let text = "schema = 1\n[relaxation]\nshare = 0.1\ntau_s = [2.0, 9.0]\nweights = [0.5, 0.3]\n";
        for file in [PlantFile::from(Plant::PAPER), crate::plant_file::parse("two lags", text).unwrap()] {
            let settled = |spring: &Spring| sampled::simulate(spring, &[0.0, 1e4], &[100.0, 100.0])[1];
            let nominal = settled(&Spring::from(file.extended()));
            for parameter in Parameter::ALL {
                let (spring, gain) = differing_spring(&file, parameter, 1.4);
                let expected = if parameter == Parameter::Gain { 1.4 * nominal } else { nominal };
                assert!((gain * settled(&spring) - expected).abs() < 1e-6, "{parameter:?}");
            }
        }
    }
}
