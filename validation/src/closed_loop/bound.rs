//! Lower bound on the time of a step under any controller that reads the sensor and does not know which of two springs it drives: the
//! paper's, or the one with the effect.
//!
//! In the first step the voltage is the same for both until the readings differ by 2 standard deviations of their noise under full
//! voltage, under which they differ soonest. Then, and in every later step, since 30 s of readings came before it, each spring has its own
//! voltage. Both have to be above 97 % from then on, and overshoot by at most 2 %.
//!
//! Both springs are known from their responses to the highest and the lowest voltage, which are linear: laws, hysteresis and limits are in
//! front of what is linear, and what comes out of them can be chosen freely. A slew limit is one of the voltage. Only a time constant that
//! changes with the voltage is not linear: for it the bound is the longer one of both springs' shortest times.

use model::Settings;
use simulation::robust_bound::{Apart, Response};

use crate::ground_truth::{Cause, Effect, Live, Noise};

/// Largest overshoot, in percent of the step.
pub const OVERSHOOT_PERCENT: f64 = 2.0;
/// Longest bound that is computed, in s.
pub const LONGEST_S: f64 = 4.0;
/// Difference at which two springs are distinguished, in standard deviations.
const APART: f64 = 2.0;
/// Time after which a spring has settled, in s.
const SETTLED_S: f64 = 60.0;

/// A step of a spring with effects.
#[derive(Clone, Debug)]
pub struct Step {
    /// The spring when the step begins.
    pub live: Live,
    /// Effects of the spring.
    pub effects: Vec<Effect>,
    /// Standard deviation of a reading, in V.
    pub noise_v: f64,
    /// Stiffness before the step, in V.
    pub from: f64,
    /// Target of the step, in V.
    pub to: f64,
}

impl Step {
    /// Returns the bound in s, where `shortest_s` is the spring's time under full voltage; `None` if it is longer than [`LONGEST_S`].
    pub fn shortest_s(&self, shortest_s: f64, settings: &Settings) -> Option<f64> {
        let pair = self.pair(settings);
        let bound_s = pair.apart().shortest_s(LONGEST_S)?;
        Some(if pair.springs.len() == 1 { bound_s.max(shortest_s) } else { bound_s })
    }

    /// True if the bound is at most `time_s`, which is no shorter than the spring's time under full voltage.
    pub fn is_possible(&self, time_s: f64, settings: &Settings) -> bool {
        self.pair(settings).apart().is_possible(time_s)
    }

    /// The paper's spring, and then the one with the effects if it is linear.
    fn pair(&self, settings: &Settings) -> Pair {
        let of = |cause: Cause| self.effects.iter().find(|effect| effect.cause == cause);
        let mut nominal = Live::new(&[], Noise::white(0.0), 0, 0.0, 0);
        nominal.command(self.from);
        nominal.pass(SETTLED_S);
        let paper = self.response(&nominal, settings);
        let other = match of(Cause::AmplifierSlew) {
            _ if of(Cause::VoltageDependentTimeConstant).is_some() => None,
            Some(slew) => {
                let full_v = settings.amplifier.max_v - self.from;
                Some(Response { slew_per_s: Some(1.0 / (slew.values()[0] * full_v)), ..paper.clone() })
            }
            None => Some(self.response(&self.live, settings)),
        };
        // In the first step, from rest, voltages are in one unit where nothing that is not linear is in front.
        let in_front = [Cause::StaticNonlinearity, Cause::Hysteresis, Cause::AmplifierLimit, Cause::AmplifierSlew];
        let is_first = self.from == 0.0 && !in_front.into_iter().any(|cause| of(cause).is_some());
        let common_s = match &other {
            Some(other) if is_first => self.distinguished_s(&paper, other),
            _ => 0.0,
        };
        Pair { springs: std::iter::once(paper).chain(other).collect(), common_s }
    }

    /// Time of the first reading with which full voltage tells two springs apart, in s.
    fn distinguished_s(&self, paper: &Response, other: &Response) -> f64 {
        let differences =
            paper.full.iter().zip(&other.full).map(|(a, b)| (a - b) * (self.to - self.from) / self.noise_v);
        let mut energy = 0.0;
        // The reading of a tick comes before its voltage.
        let tick = differences.take_while(|difference| {
            energy += difference.powi(2);
            energy < APART.powi(2)
        });
        let ticks = 1 + tick.count();
        if ticks > paper.full.len() { f64::INFINITY } else { ticks as f64 * paper.every_s }
    }

    /// The response of a spring to this step.
    fn response(&self, spring: &Live, settings: &Settings) -> Response {
        let every_s = 1.0 / settings.rate_hz;
        let samples = (Response::duration_s(LONGEST_S) * settings.rate_hz) as usize;
        let under = |voltage_v: Option<f64>| -> Vec<f64> {
            let mut spring = spring.clone();
            if let Some(voltage_v) = voltage_v {
                spring.command(voltage_v);
            }
            let sample = |_| {
                let now = (spring.stiffness() - self.from) / (self.to - self.from);
                spring.pass(every_s);
                now
            };
            (0..samples).map(sample).collect()
        };
        let held = under(None);
        let [full, lowest]: [Vec<f64>; 2] = [settings.amplifier.max_v, settings.amplifier.min_v]
            .map(|voltage_v| under(Some(voltage_v)).iter().zip(&held).map(|(a, b)| a - b).collect());
        let last = samples - 1;
        Response { every_s, held, lowest: lowest[last] / full[last], full, slew_per_s: None }
    }
}

/// Two springs, or one if the other one is not linear.
struct Pair {
    springs: Vec<Response>,
    common_s: f64,
}

impl Pair {
    fn apart(&self) -> Apart<'_> {
        Apart { springs: &self.springs, common_s: self.common_s, overshoot: OVERSHOOT_PERCENT / 100.0 }
    }
}
