//! Whether a record can tell anything of the spring, and what to do if not.

use model::Plant;

use crate::adequacy::standstill;
use crate::answer::Verdict;
use crate::effects::index_of;
use crate::effects::model::{Block, Model};
use crate::fit::engine::{Engine, Fit};
use crate::fit::interval::covariance;
use crate::noise::Noise;
use crate::record::data::Data;
use crate::stats::sums::dot;

/// A stair moves the simulation at least so far, in V: readings that stay where they are then are no spring's.
const FAR_V: f64 = 5.0;
/// Correlation with the simulation from which on readings are the same on another scale.
const ALIKE: f64 = 0.98;
/// Correlation below which readings may have nothing to do with the voltage.
const STRANGE: f64 = 0.2;
/// Gain and time constant that are likelier than the simulation's by so many nats are no chance.
const CLEAR: f64 = 20.0;

/// Why no cause is looked for.
#[derive(Clone, Debug, PartialEq)]
pub(crate) enum Silent {
    /// Too little happens, or noise hides it.
    Excitation,
    /// The readings are those of no spring: what they do.
    Sensor(String),
}

impl Silent {
    pub(crate) fn verdict(&self) -> Verdict {
        match self {
            Self::Excitation => Verdict::Insufficient,
            Self::Sensor(_) => Verdict::Unexplained,
        }
    }

    /// What the simulation leaves, in words.
    pub(crate) fn leftover(&self) -> Option<String> {
        match self {
            Self::Excitation => None,
            Self::Sensor(what) => Some(what.clone()),
        }
    }

    pub(crate) fn next_experiment(&self) -> &'static str {
        match self {
            Self::Excitation => {
                "run a stair over the whole range up and down again, each step held for five time constants: from this \
                 record the gain or the time constant could be almost anything"
            }
            Self::Sensor(_) => {
                "look at the sensor, its cable and its unit (volts of equivalent static voltage are expected), then repeat \
                 the record"
            }
        }
    }
}

/// `None` if gain and time constant would show in this record.
pub(crate) fn silent(engine: &mut Engine, baseline: &Fit) -> Option<Silent> {
    let data = engine.data;
    let moves = |values: &[f64]| values.iter().any(|value| *value != values[0]);
    // Under one voltage all the time, what the spring does may be its start as well as its answer.
    if !moves(&data.voltage_v) {
        return Some(Silent::Excitation);
    }
    let beside = Beside::of(data, baseline);
    if !moves(&data.reading) {
        let far = beside.simulated[1] - beside.simulated[0] > FAR_V;
        return Some(if far { Silent::Sensor(beside.still()) } else { Silent::Excitation });
    }
    let start = of_both(engine.base().relaxation.tau_s);
    let mut best = engine.fit(start.clone(), &Noise::default_robust());
    // A simulation may be so far off that no way leads from there.
    let paper = of_both(Plant::PAPER.time_constant_s);
    if paper != start {
        let other = engine.fit(paper, &Noise::default_robust());
        best = if other.log_likelihood > best.log_likelihood { other } else { best };
    }
    let [gain, _] = gain_and_time_constant();
    let bounds = &gain.coordinates(data)[0];
    let found = best.model.point(gain.effect).map_or(1.0, |point| point[0]);
    if !(1.01 * bounds.lowest..0.99 * bounds.highest).contains(&found) && beside.correlation.abs() > ALIKE {
        return Some(Silent::Sensor(beside.scaled()));
    }
    // Half of the gain, or a factor of e in the time constant, is no knowledge.
    let known = |fit: &Fit, engine: &mut Engine| {
        covariance(engine, fit).is_some_and(|of| of[(0, 0)].sqrt() < 0.5 && of[(1, 1)].sqrt() < 1.0)
    };
    // The noise as it is at best, the information as it is where the search starts; of a start far off there is none.
    let residual = engine.residual(&start);
    let start = Fit { model: start, residual, noise: best.noise.clone(), ..best.clone() };
    let is_clear = best.log_likelihood > baseline.log_likelihood + CLEAR;
    let tells = known(&start, engine) || is_clear && known(&best, engine);
    if !tells {
        return Some(Silent::Excitation);
    }
    // Quick to tell, and a search for causes in noise alone is long.
    let still = beside.correlation.abs() < STRANGE && standstill::as_likely(engine, &best.model, best.log_likelihood);
    still.then(|| Silent::Sensor(beside.still()))
}

/// The two numbers that every record of use tells.
pub(crate) fn gain_and_time_constant() -> [Block; 2] {
    ["gain-error", "time-constant"].map(|cause| Block { effect: index_of(cause).expect("an effect"), form: 0 })
}

/// A model of both: the gain as it is simulated, and a time constant.
pub(crate) fn of_both(tau_s: f64) -> Model {
    let [gain, time_constant] = gain_and_time_constant();
    Model::default().with(gain, vec![1.0]).with(time_constant, vec![tau_s.ln()])
}

/// Of a spring that was found, if one that stands still is as likely.
pub(crate) fn no_spring(engine: &mut Engine, baseline: &Fit, found: &Fit, score: f64) -> Option<Silent> {
    let still = !found.model.blocks.is_empty() && standstill::as_likely(engine, &found.model, score);
    still.then(|| Silent::Sensor(Beside::of(engine.data, baseline).still()))
}

/// Readings beside the simulation: the range of both, and how one goes with the other.
struct Beside {
    read: [f64; 2],
    simulated: [f64; 2],
    /// 0 where one of them stays.
    correlation: f64,
    /// Of the readings over the simulation.
    slope: f64,
}

impl Beside {
    fn of(data: &Data, baseline: &Fit) -> Self {
        let read = &data.reading;
        let simulated: Vec<f64> = read.iter().zip(&baseline.residual).map(|(read, left)| read - left).collect();
        let range = |values: &[f64]| {
            values.iter().fold([f64::INFINITY, f64::NEG_INFINITY], |[low, high], &v| [low.min(v), high.max(v)])
        };
        let centred = |values: &[f64]| -> Vec<f64> {
            let mean = values.iter().sum::<f64>() / values.len() as f64;
            values.iter().map(|value| value - mean).collect()
        };
        let (a, b) = (centred(read), centred(&simulated));
        Self {
            read: range(read),
            simulated: range(&simulated),
            correlation: dot(&a, &b) / (dot(&a, &a) * dot(&b, &b)).sqrt().max(f64::MIN_POSITIVE),
            slope: dot(&a, &b) / dot(&b, &b).max(f64::MIN_POSITIVE),
        }
    }

    fn still(&self) -> String {
        let ([low, high], [from, to]) = (self.read, self.simulated);
        format!(
            "The readings, {low:.3} to {high:.3} V, do not follow the voltage, under which the simulation goes from \
             {from:.0} to {to:.0} V"
        )
    }

    fn scaled(&self) -> String {
        format!("The readings are {} times what the simulation says, beyond any spring", significant(self.slope))
    }
}

/// To three digits, however large or small.
fn significant(number: f64) -> String {
    match number.abs() {
        0.001..1e5 => format!("{number:.3}"),
        _ => format!("{number:.2e}"),
    }
}
