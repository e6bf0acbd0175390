//! Fits of a model's points to a record: the Levenberg-Marquardt method on the log-likelihood of the noise.
//!
//! Each round computes the weights of the rows for the present residual (iteratively reweighted least squares) and
//! takes the step only if the likelihood increases. Coordinates stay within their bounds.

use std::ops::Range;

use crate::effects::effect::FitContext;
use crate::effects::identified;
use crate::effects::model::{Block, Model};
use crate::fit::budget::{Budget, UNLIMITED};
use crate::fit::known::Known;
use crate::fit::known_held_out::KnownHeldOut;
use crate::fit::normal_equations::{Jacobian, damped_step, normal_equations, predicted_gain};
use crate::fit::simulator::Simulator;
use crate::noise::{Noise, Term};
use crate::plant::base::Base;
use crate::plant::initial_state::{self, Start};
use crate::record::data::Data;
use crate::record::observed::{Kind, Observed};
use crate::stats::scale::robust_scale;
use crate::stats::thresholds::empirical::STRONG_AUTOCORRELATION;

/// A model with fitted points.
#[derive(Clone, Debug)]
pub struct Fit {
    /// The model at its most likely points.
    pub model: Model,
    /// Reading minus prediction of each row, in V.
    pub residual: Vec<f64>,
    /// The law of the noise for this residual.
    pub noise: Noise,
    /// Log-likelihood under that law minus [`Fit::cost`], in nats.
    pub log_likelihood: f64,
    /// Log-likelihood under independent noise, in nats, where autocorrelation cannot hide structure.
    pub white_noise_log_likelihood: f64,
    /// Cost of the estimated initial state, in nats.
    pub initial_state_cost: f64,
}

impl Fit {
    /// Returns true if the autocorrelation of the noise predicts nearly all of the residual, so that slow structure may
    /// be hidden in it.
    pub fn strongly_autocorrelated(&self) -> bool {
        self.noise.marginal > STRONG_AUTOCORRELATION.get() * self.noise.sigma
    }

    /// Returns the cost of the law of the noise and of the initial state, in nats.
    pub fn cost(&self) -> f64 {
        self.noise.cost(self.residual.len()) + self.initial_state_cost
    }
}

/// Work for each row, in units of one piece of the voltage through one lag.
pub(super) mod work {
    /// The difference between reading and prediction.
    pub(in crate::fit) const RESIDUAL: u64 = 1;
    /// The estimate of one initial state.
    pub(in crate::fit) const INITIAL_STATE: u64 = 6;
    /// What one initial state takes over of a change.
    pub(super) const FOLLOWING: u64 = 1;
    /// The scale of the noise and the likelihood.
    pub(super) const SCALE: u64 = 4;
    /// One column of derivatives, with its products with the others.
    pub(super) const WHITENING: u64 = 4;
    /// The law of the noise.
    pub(super) const LAW: u64 = 60;
}

/// Largest number of rounds of a fit.
const ROUNDS: usize = 14;
/// Largest number of rounds of the first fit of a block, which decides whether the block is fitted further.
const FIRST_ROUNDS: usize = 6;
/// Number of these after which most blocks are given up.
const EARLY_ROUNDS: usize = 2;
/// The fit ends with a round that gains less than this, in nats.
const LEAST_GAIN: f64 = 0.02;
/// A step with a smaller predicted gain, in nats, is not tried.
const LEAST_PREDICTED_GAIN: f64 = 0.1 * LEAST_GAIN;

/// Largest number of discontinuities of the prediction that a fit crosses one after the other.
const MOST_JUMPS: usize = 30;

/// A model whose points were moved towards the likeliest.
pub struct Approach {
    /// The model.
    pub model: Model,
    /// Log-likelihood of the model under the law of the fit, in nats.
    pub log_likelihood: f64,
    /// True if a further round would gain nothing.
    pub settled: bool,
}

/// Fits models to one record.
///
/// ```
/// use identify::Input;
/// use identify::effects::index_of;
/// use identify::effects::model::{Block, Model};
/// use identify::fit::engine::Engine;
/// use identify::fit::interval;
/// use identify::plant::base::Base;
/// use identify::record::data::Data;
/// use identify::record::observed::Observed;
/// use simulation::record::Record;
///
/// // A step of 300 V at 1 s, read once per second from a spring with a time constant of 8 s instead of 5.5 s.
/// let stiffness = |time_s: f64| 300.0 * (1.0 - (1.0 - 1.0 / 11.0) * f64::exp(-(time_s - 1.0) / 8.0));
/// let row = |second: i32| match second {
///     0 => "0,0,0\n".to_string(),
///     _ => format!("{second},300,{:.1}\n", stiffness(f64::from(second))),
/// };
/// let text = format!("time_s,voltage_v,stiffness\n{}", (0..60).map(row).collect::<String>());
/// let record = Record::parse("step", &text, "stiffness")?;
///
/// let (data, base) = (Data::new(&record, Input::Hold), Base::paper());
/// let observed = Observed::new(&data);
/// let mut engine = Engine::new(&data, &observed, &base);
/// let effect = index_of("time-constant").expect("a cause");
/// let model = Model::default().with(Block { effect, form: 0 }, vec![5.5f64.ln()]);
/// let fit = engine.fit_twice(model);
/// let (name, tau) = &interval::parameters(&mut engine, &fit, effect)[0];
/// assert_eq!((name.as_str(), tau.dimension), ("tau_s", identify::dimension::Dimension::Time));
/// assert!((tau.value - 8.0).abs() < 0.01 && tau.low < tau.value && tau.value < tau.high);
/// # Ok::<(), anyhow::Error>(())
/// ```
pub struct Engine<'a> {
    /// The record.
    pub data: &'a Data,
    /// Properties of its readings.
    pub observed: &'a Observed,
    /// Runs the models.
    pub(super) simulator: Simulator<'a>,
    /// Reading minus prediction of the plant without any effect, in V.
    pub baseline_residual: Vec<f64>,
    pub(super) predicted: Vec<f64>,
    pub(super) kernels: Vec<Vec<f64>>,
    /// Work that fits may do, and that was done.
    pub(super) budget: &'a Budget,
    /// The last held-out residuals.
    pub(super) known_held_out: KnownHeldOut,
    /// Causes that a search may add; `None` for all.
    candidates: Option<&'a [&'static str]>,
}

impl<'a> Engine<'a> {
    /// Prepares fits to one record, of models that extend the plant `base`.
    pub fn new(data: &'a Data, observed: &'a Observed, base: &'a Base) -> Self {
        Self::within(data, observed, base, &UNLIMITED)
    }

    /// Prepares the same within a budget of work: once it is over, fits end where they are.
    pub fn within(data: &'a Data, observed: &'a Observed, base: &'a Base, budget: &'a Budget) -> Self {
        let simulator = Simulator::new(data, base);
        let (predicted, kernels) = (Vec::new(), Vec::new());
        let candidates = None;
        let baseline_residual = Vec::new();
        let known_held_out = KnownHeldOut::default();
        let mut engine = Self {
            data,
            observed,
            simulator,
            baseline_residual,
            predicted,
            kernels,
            budget,
            known_held_out,
            candidates,
        };
        engine.baseline_residual = engine.residual(&Model::default());
        engine
    }

    /// Limits a search to some causes; `None` for all.
    pub fn limited_to(self, candidates: Option<&'a [&'static str]>) -> Self {
        Self { candidates, ..self }
    }

    /// Returns true if a search may add a cause.
    pub fn allows(&self, cause: &str) -> bool {
        let estimated = self.data.normalisation.identified && identified::contains(&self.base().relaxation, cause);
        !estimated && self.candidates.is_none_or(|candidates| candidates.contains(&cause))
    }

    /// Returns the plant without any effect.
    pub fn base(&self) -> &'a Base {
        self.simulator.base
    }

    /// Returns the model without any effect, whose relaxation a fit moves if it was identified from the same readings.
    pub fn simulation(&self) -> Model {
        let relaxation = match self.data.normalisation.identified {
            true => identified::coordinates(&self.base().relaxation, self.data),
            false => Vec::new(),
        };
        Model { relaxation, ..Model::default() }
    }

    /// Returns the work that fits may do, and that was done.
    pub fn budget(&self) -> &'a Budget {
        self.budget
    }

    /// Returns reading minus prediction of each row, in V, with the most likely initial state if that is unknown.
    pub fn residual(&mut self, model: &Model) -> Vec<f64> {
        self.residual_and_start(model).0
    }

    /// Returns the same with all that is estimated for each model, such as the initial state, estimated from the first `rows` rows.
    pub fn residual_by_first(&mut self, rows: usize, model: &Model) -> Vec<f64> {
        self.residual_and_start_by(model, |row| row < rows).0
    }

    /// Returns the residual, and the cost of the initial state in nats.
    fn residual_and_start(&mut self, model: &Model) -> (Vec<f64>, f64) {
        let (residual, cost, _) = self.residual_and_start_by(model, |_| true);
        (residual, cost)
    }

    /// Returns the same with an initial state that is estimated from the rows that `counts` selects, and the estimate of one in which the
    /// prediction is not linear.
    fn residual_and_start_by(
        &mut self,
        model: &Model,
        counts: impl Fn(usize) -> bool,
    ) -> (Vec<f64>, f64, Option<Start>) {
        let estimated = self.data.has_nuisances();
        if estimated {
            self.simulator.run_with_initial_states(model, &mut self.predicted, &mut self.kernels);
        } else {
            self.simulator.run(model, &mut self.predicted);
        }
        let observed = self.observed;
        let exact = |row: usize| counts(row) && observed.is_exact(row);
        if estimated && !self.simulator.is_linear_in_start() {
            let Some(start) = self.start_by(model, exact) else {
                return (self.residual_from_rest(model), 0.0, None);
            };
            let residual = start.residual.clone();
            let cost = initial_state::cost(&start.start_v, self.data.full_scale_v, residual.len());
            return (residual, cost, Some(start));
        }
        let mut residual = self.residual_of_predicted();
        let initial_state_cost = match estimated {
            true => initial_state::subtract_estimate(&mut residual, &self.kernels, self.data.full_scale_v, exact),
            false => 0.0,
        };
        let states = if self.has_kernels() { self.kernels.len() as u64 } else { 0 };
        self.budget.spend(work::INITIAL_STATE * states * residual.len() as u64);
        (residual, initial_state_cost, None)
    }

    /// Returns true if the prediction has kernels besides the zero of each of several records.
    fn has_kernels(&self) -> bool {
        self.data.initial_state_unknown || self.data.estimates_zero()
    }

    /// Returns reading minus prediction of each row, in V, without an estimate of the initial state.
    pub fn residual_from_rest(&mut self, model: &Model) -> Vec<f64> {
        self.simulator.run(model, &mut self.predicted);
        self.residual_of_predicted()
    }

    /// Returns reading minus what was predicted last, of each row, in V, and counts the work for it.
    pub(super) fn residual_of_predicted(&mut self) -> Vec<f64> {
        self.budget.spend(self.simulator.take_work() + work::RESIDUAL * self.predicted.len() as u64);
        let truncation_v = self.observed.truncation_v;
        let left = |(reading, predicted): (&f64, &f64)| reading + truncation_v - predicted;
        self.data.reading.iter().zip(&self.predicted).map(left).collect()
    }

    /// Returns the change of the prediction, in V, for each initial state that is 1 V away from rest; empty if the spring was at
    /// rest.
    pub fn initial_states(&mut self, model: &Model) -> &[Vec<f64>] {
        self.kernels.clear();
        if self.has_kernels() {
            self.simulator.run_with_initial_states(model, &mut self.predicted, &mut self.kernels);
        }
        &self.kernels
    }

    /// Evaluates a model at its present points, with the law of the noise fitted to its residual.
    pub fn evaluate(&mut self, model: Model) -> Fit {
        let (residual, initial_state_cost) = self.residual_and_start(&model);
        let noise = Noise::fitted(&residual, self.observed);
        self.budget.spend(work::LAW * residual.len() as u64);
        let log_likelihood = self.log(&noise, &residual);
        let white_noise_log_likelihood = self.log(&Noise::robust(&self.observed.errors(&residual)), &residual);
        let fit = Fit { model, residual, noise, log_likelihood, white_noise_log_likelihood, initial_state_cost };
        Fit { log_likelihood: log_likelihood - fit.cost(), ..fit }
    }

    /// Fits the points of a model under a given law of the noise, whose scale is fitted as well, then the law to the
    /// residual.
    pub fn fit(&mut self, model: Model, law: &Noise) -> Fit {
        let model = self.refine_searched(model, |_| true);
        let Approach { model, .. } = self.levenberg_marquardt(model, law, &Known::default(), ROUNDS);
        self.across_jumps(model, law, |_| true)
    }

    /// Returns the derivatives at a fit, whitened by the law under which its extensions are fitted.
    pub fn known(&mut self, fit: &Fit, law: &Noise) -> Known {
        Known::of(&fit.model, self.jacobian(&fit.model, law, &fit.residual))
    }

    /// Moves the points of a model that extends a fit by a block towards the likeliest near them, with the derivatives that are
    /// `known` there.
    pub fn approached(&mut self, model: Model, law: &Noise, known: &Known) -> Approach {
        let model = self.refine_searched(model, |_| true);
        self.levenberg_marquardt(model, law, known, EARLY_ROUNDS)
    }

    /// Continues a fit that was [approached](Engine::approached), unless a further round would gain nothing.
    pub fn approach_further(&mut self, approach: &mut Approach, law: &Noise, known: &Known) {
        if !approach.settled {
            *approach = self.levenberg_marquardt(approach.model.clone(), law, known, FIRST_ROUNDS - EARLY_ROUNDS);
        }
    }

    /// Completes a fit that was [approached](Engine::approached), with derivatives of its own, and crosses discontinuities of the
    /// prediction by the effect that was added: those of the others are where an earlier fit left them.
    pub fn completed(&mut self, model: Model, law: &Noise, effect: usize) -> Fit {
        let Approach { model, .. } = self.levenberg_marquardt(model, law, &Known::default(), FIRST_ROUNDS);
        self.across_jumps(model, law, |block| block.effect == effect)
    }

    /// Fits the law of the noise to a model, and continues the fit beyond discontinuities of the prediction on either side as long as
    /// the likelihood increases.
    fn across_jumps(&mut self, model: Model, law: &Noise, crosses: impl Fn(&Block) -> bool) -> Fit {
        let mut here = self.evaluate(model);
        let sides = |index| [(index, -1.0), (index, 1.0)];
        for (index, side) in (0..here.model.blocks.len()).flat_map(sides) {
            if !crosses(&here.model.blocks[index].0) {
                continue;
            }
            let mut steps = side;
            for _ in 0..MOST_JUMPS {
                if self.budget.is_over() {
                    return here;
                }
                let (block, point) = &here.model.blocks[index];
                let Some(point) = block.effect().across_jumps(block.form, point, steps, self.data) else { break };
                let mut model = here.model.clone();
                model.blocks[index].1 = point;
                let Approach { model, .. } = self.levenberg_marquardt(model, law, &Known::default(), ROUNDS);
                let there = self.evaluate(model);
                if there.log_likelihood > here.log_likelihood {
                    here = there;
                    steps *= 2.0;
                } else if steps != side {
                    steps = side;
                } else {
                    break;
                }
            }
        }
        here
    }

    /// Moves the coordinates that need a search, block by block, given the residual of the other blocks in the rows
    /// that `seen` selects.
    pub fn refine_searched(&mut self, mut model: Model, seen: impl Fn(usize) -> bool) -> Model {
        for index in 0..model.blocks.len() {
            let block = model.blocks[index].0;
            if !block.searched() {
                continue;
            }
            let mut residual = self.residual(&model.without(block.effect));
            let rows = 0..residual.len();
            let errors: Vec<f64> = rows.clone().filter(|&row| seen(row)).map(|row| residual[row]).collect();
            rows.filter(|&row| !seen(row)).for_each(|row| residual[row] = f64::NAN);
            let context = FitContext { data: self.data, residual: &residual, sigma: robust_scale(&errors) };
            block.effect().refine_searched(block.form, &mut model.blocks[index].1, &context);
        }
        model
    }

    /// Fits first under robust independent noise, then under the law of the noise of the first fit.
    pub fn fit_twice(&mut self, model: Model) -> Fit {
        let first = self.fit(model, &Noise::default_robust());
        self.refit(first)
    }

    /// Fits again under the law of the noise of a first fit; returns the more likely of both.
    ///
    /// Under a nominal spring that was identified the first fit stays, unless the readings are rounded: an autocorrelation would take
    /// errors of the model for noise, and the free-running error would grow while the likelihood does.
    pub fn refit(&mut self, first: Fit) -> Fit {
        if self.ignores_autocorrelation(&first.noise) {
            return first;
        }
        let second = self.fit(first.model.clone(), &first.noise);
        if second.log_likelihood >= first.log_likelihood { second } else { first }
    }

    /// Returns the zero offset of each record at a fit, in V: what the estimated nuisance parameters add to the
    /// prediction at the record's end, where its initial state has decayed.
    pub fn zero_offsets(&mut self, fit: &Fit) -> Vec<f64> {
        let mut predicted = Vec::new();
        self.simulator.run(&fit.model, &mut predicted);
        let ends = self.data.rows_of_records().into_iter().map(|rows| rows.end - 1);
        ends.map(|row| self.data.reading[row] + self.observed.truncation_v - predicted[row] - fit.residual[row])
            .collect()
    }

    /// Returns true if a fit is one under independent noise, whatever its law.
    fn ignores_autocorrelation(&self, law: &Noise) -> bool {
        self.data.normalisation.identified && law.half_step == 0.0
    }

    fn log(&self, noise: &Noise, residual: &[f64]) -> f64 {
        noise.log_likelihood(residual, self.observed)
    }

    fn levenberg_marquardt(&mut self, mut model: Model, law: &Noise, known: &Known, rounds: usize) -> Approach {
        let independent = self.ignores_autocorrelation(law).then(Noise::default_robust);
        let law = independent.as_ref().unwrap_or(law);
        let bounds = model.coordinates(self.data);
        let mut points = model.points();
        for (point, bound) in points.iter_mut().zip(&bounds) {
            *point = point.clamp(bound.lowest, bound.highest);
        }
        model.set_points(&points);
        let (mut residual, _, start) = self.residual_and_start_by(&model, |_| true);
        let mut start = start.filter(|_| !self.data.is_joined());
        let mut starts_here = start.is_some();
        let (mut noise, mut value) = law.rescaled(&residual, self.observed);
        let mut damping = 1e-3;
        let mut settled = false;
        for _ in 0..rounds {
            if self.budget.is_over() {
                break;
            }
            if !starts_here {
                start = self.start_near(&model, start.as_ref());
            }
            let all = 0..points.len();
            let jacobian = self.jacobian_of(all, known, start.as_ref(), &model, &noise, &residual);
            if jacobian.places.is_empty() {
                settled = true;
                break;
            }
            let (normal, gradient) = normal_equations(&jacobian, &self.terms(&noise, &residual));
            let mut gained = 0.0;
            for _ in 0..6 {
                let Some(step) = damped_step(&normal, &gradient, damping) else {
                    damping *= 10.0;
                    continue;
                };
                let mut moved = points.clone();
                for (&place, step) in jacobian.places.iter().zip(step.iter()) {
                    moved[place] = (moved[place] + step).clamp(bounds[place].lowest, bounds[place].highest);
                }
                if predicted_gain(&normal, &gradient, &jacobian.places, &points, &moved) < LEAST_PREDICTED_GAIN {
                    break;
                }
                let mut candidate = model.clone();
                candidate.set_points(&moved);
                let there = self.residual_near(&candidate, start.as_ref());
                self.budget.spend(work::SCALE * there.len() as u64);
                let (noise_there, value_there) = law.rescaled(&there, self.observed);
                if value_there > value {
                    gained = value_there - value;
                    starts_here = false;
                    (points, model, residual, noise, value) = (moved, candidate, there, noise_there, value_there);
                    damping = (damping / 8.0).max(1e-9);
                    break;
                }
                damping *= 6.0;
            }
            if gained < LEAST_GAIN {
                settled = true;
                break;
            }
        }
        Approach { model, log_likelihood: value, settled }
    }

    /// Returns the derivatives of the prediction and the contribution of each row at a fit.
    pub fn linearised(&mut self, fit: &Fit) -> (Jacobian, Vec<Term>) {
        (self.jacobian(&fit.model, &fit.noise, &fit.residual), self.terms(&fit.noise, &fit.residual))
    }

    /// Returns the same for the coordinates of the blocks alone.
    pub fn linearised_by_blocks(&mut self, fit: &Fit) -> (Jacobian, Vec<Term>) {
        let blocks = fit.model.blocks.iter().map(|(_, point)| point.len()).sum();
        let start = self.start(&fit.model);
        let jacobian =
            self.jacobian_of(0..blocks, &Known::default(), start.as_ref(), &fit.model, &fit.noise, &fit.residual);
        (jacobian, self.terms(&fit.noise, &fit.residual))
    }

    /// Returns the contribution of each row to the fit.
    pub fn terms(&self, noise: &Noise, residual: &[f64]) -> Vec<Term> {
        let white = noise.innovations(&self.observed.errors(residual));
        (0..residual.len()).map(|row| noise.term(self.observed.kinds[row], residual[row], white[row])).collect()
    }

    /// Returns the derivatives of the prediction by forward differences, or backward differences at upper bounds. An unknown
    /// initial state follows with the weights and kernels that it has at the model (Kaufman's approximation of variable
    /// projection, BIT 15, 1975): one simulation for each column instead of one for each state of it as well.
    pub fn jacobian(&mut self, model: &Model, noise: &Noise, residual: &[f64]) -> Jacobian {
        let start = self.start(model);
        self.jacobian_of(0..model.points().len(), &Known::default(), start.as_ref(), model, noise, residual)
    }

    /// Returns the same for a range of the coordinates, with the columns that are known and from the initial state at the model, if that
    /// is unknown.
    fn jacobian_of(
        &mut self,
        wanted: Range<usize>,
        known: &Known,
        start: Option<&Start>,
        model: &Model,
        noise: &Noise,
        residual: &[f64],
    ) -> Jacobian {
        let coordinates = Known::places(model);
        let bounds = model.coordinates(self.data);
        let points = model.points();
        let places: Vec<usize> = wanted.filter(|&place| bounds[place].fitted).collect();
        let mut nudged = model.clone();
        let residual = start.map_or(residual, |start| &start.residual);
        let columns = places.iter().map(|&place| {
            if let Some(column) = known.column(coordinates[place]) {
                return column.clone();
            }
            let bound = &bounds[place];
            let mut step = 1e-5 * (bound.highest - bound.lowest).min(1.0 + points[place].abs());
            if points[place] + step > bound.highest {
                step = -step;
            }
            let mut moved = points.clone();
            moved[place] += step;
            nudged.set_points(&moved);
            let there = match start {
                Some(start) => self.residual_from(&nudged, &start.start_v),
                None => self.residual(&nudged),
            };
            let mut column: Vec<f64> = residual.iter().zip(&there).map(|(here, there)| (here - there) / step).collect();
            if let Some(start) = start {
                start.estimate.follow(&mut column, &start.kernels);
                self.budget.spend(start.kernels.len() as u64 * work::FOLLOWING * column.len() as u64);
            }
            // Readings that stopped at a bound or are known up to an interval are not whitened.
            let mut white = noise.whitened(&column);
            self.budget.spend(work::WHITENING * column.len() as u64);
            for (row, kind) in self.observed.kinds.iter().enumerate() {
                if *kind != Kind::Exact {
                    white[row] = column[row];
                }
            }
            white
        });
        let columns = columns.collect();
        Jacobian { places, columns }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::effects::index_of;
    use crate::fit::budget::Effort;
    use crate::record::input::Input;
    use crate::stats::scale::normals;
    use simulation::record::{Record, Row};

    /// A step of a spring with another time constant and gain: the time constant is added to a fit of the gain alone.
    #[test]
    fn known_derivatives_lead_to_the_same_fit_for_less_work() {
        let noise = normals(200);
        let reading = |row: usize| match row {
            0..20 => noise[row],
            _ => 330.0 * (1.0 - 10.0 / 11.0 * f64::exp(-(row as f64 - 20.0) * 0.2 / 8.0)) + noise[row],
        };
        let voltage_v = |row: usize| if row < 20 { 0.0 } else { 300.0 };
        let row = |row: usize| Row {
            line: row,
            time_s: row as f64 * 0.2,
            voltage_v: voltage_v(row),
            measured: Some(reading(row)),
        };
        let record = Record { name: String::new(), rows: (0..200).map(row).collect() };
        let data = Data { initial_state_unknown: false, ..Data::new(&record, Input::Hold) };
        let (observed, base) = (Observed::new(&data), Base::paper());
        let block = |cause| Block { effect: index_of(cause).unwrap(), form: 0 };
        let approached = |is_known: bool| {
            let budget = Budget::new(Effort::Thorough, 200, Default::default());
            let mut engine = Engine::within(&data, &observed, &base, &budget);
            let gain = engine.fit_twice(Model::default().with(block("gain-error"), vec![1.0]));
            let law = Noise::default_robust();
            let known = if is_known { engine.known(&gain, &law) } else { Known::default() };
            let before = budget.spent();
            let model = gain.model.with(block("time-constant"), vec![5.5f64.ln()]);
            let mut approach = engine.approached(model, &law, &known);
            engine.approach_further(&mut approach, &law, &known);
            (approach.model.points(), approach.log_likelihood, budget.spent() - before)
        };
        let (known, full) = (approached(true), approached(false));
        let near = |of: usize| (known.0[of] - full.0[of]).abs() < 0.003;
        assert!(near(0) && near(1) && (known.1 - full.1).abs() < 0.1, "{known:?} {full:?}");
        assert!(4 * known.2 < 3 * full.2, "{known:?} {full:?}");
    }
}
