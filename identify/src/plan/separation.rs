//! How far a candidate separates the hypotheses, and what it tells about causes that none of them has.
//!
//! ```text
//! d = whitened difference of truth and rival        J = whitened sensitivities of the rival, per standard deviation
//! f = 1 / (1 + 2 tau rest^2 i)                      part of the information that an unmodelled rest leaves
//! separation = f d'd / 2 - f^2 d'J (f J'J + 1)^-1 J'd / 2        [nats]
//! ```
//!
//! The rest is what the first record left unexplained, and a part of what the truth changes, since no law is exact. It lasts for
//! about a time constant of `tau` rows, over which `i`, the information of one reading, cannot reduce it.

use nalgebra::{DMatrix, DVector};
use simulation::units::Unit;

use crate::effects::EFFECTS;
use crate::effects::effect::FitContext;
use crate::effects::model::{Block, Model};
use crate::hypotheses::{Coordinates, FittedNoise};
use crate::plan::candidate::{Candidate, Commands, Frame};
use crate::plan::design::{Bend, Hypothesis, of_the_spring};
use crate::plan::grid::Grid;
use crate::plan::predictor::{Predictor, Whitening};
use crate::plant::base::Base;
use crate::record::data::Data;
use crate::stats::scale::root_mean_square;
use crate::stats::sums::dot;

/// Assumed difference between the spring and the law of a hypothesis, relative to what that changes.
const MODEL_ERROR: f64 = 0.05;
/// Size of a probe relative to the response, at which the information on a cause is stated.
const PROBE: f64 = 0.03;

/// All that is the same for every candidate.
pub(super) struct Design {
    pub(super) frame: Frame,
    pub(super) coordinates: Coordinates,
    pub(super) noise: FittedNoise,
    /// Name of the reading's unit.
    pub(super) reading_unit: String,
    /// Unit of the commanded voltage in the record.
    pub(super) command_unit: Unit,
    pub(super) base: Base,
    pub(super) whitening: Whitening,
    /// What the plan is to decide between, the likeliest first; at least one.
    pub(super) hypotheses: Vec<Hypothesis>,
    /// Models drawn from the posterior of each.
    pub(super) draws: Vec<Vec<Model>>,
    /// Coordinates that each may bend.
    pub(super) bends: Vec<Vec<Bend>>,
    /// The likeliest hypothesis with each cause that it has not.
    pub(super) probes: Vec<Model>,
}

/// The sensitivities of a hypothesis, and their products.
struct Sensitivities {
    columns: Vec<Vec<f64>>,
    products: DMatrix<f64>,
}

/// A truth compared with a rival.
#[derive(Clone, Debug)]
pub(super) struct Pair {
    /// Index of the true hypothesis.
    pub(super) truth: usize,
    /// Index of its rival.
    pub(super) rival: usize,
    /// True if the diagnosis names both.
    pub(super) named: bool,
    /// Separation for each draw of the truth, in nats.
    pub(super) nats: Vec<f64>,
}

/// What a candidate would show.
#[derive(Clone, Debug)]
pub(super) struct Evaluation {
    /// All ordered pairs of hypotheses in which the rival lacks a cause of the truth.
    pub(super) pairs: Vec<Pair>,
    /// Information on the causes with all others unknown, in nats: between the mean and the least of all.
    pub(super) breadth: f64,
}

impl Design {
    /// Returns the record and the grid of a candidate.
    pub(super) fn record(&self, commands: &Commands, complete: bool) -> (Data, Grid) {
        let grid = if complete { Grid::complete(&self.frame) } else { Grid::thinned(commands, &self.frame) };
        (grid.data(commands, &self.frame, &self.coordinates), grid)
    }

    /// Returns the probes: the likeliest hypothesis with each cause of the spring that it has not, of a size that changes the
    /// response to a schedule by a few percent.
    pub(super) fn probes(&self, candidate: &Candidate) -> Vec<Model> {
        let (data, grid) = self.record(&candidate.commands(&self.frame), false);
        let mut predictor = Predictor::new(&data, &self.base, &grid, &self.whitening, &self.noise);
        let best = &self.hypotheses[0];
        let here = predictor.readings(&best.model);
        let size = PROBE * root_mean_square(&here);
        let bent = |cause: &str| self.bends[0].iter().any(|bend| bend.extra == Some(cause));
        let wanted = |cause: &str| of_the_spring(cause) && !best.claims(cause) && !bent(cause);
        let mut probes = Vec::new();
        for (effect, form) in
            (0..EFFECTS.len()).filter(|&effect| wanted(EFFECTS[effect].cause())).map(|effect| (effect, 0))
        {
            let context = FitContext { data: &data, residual: &here, sigma: self.noise.sigma };
            let starts = EFFECTS[effect].initial_points(form, &context).into_iter();
            let models = starts.map(|point| best.model.with(Block { effect, form }, point));
            let off = |model: &Model, predictor: &mut Predictor| {
                let there = predictor.readings(model);
                let change = predictor.mean_square(&there, &here).sqrt();
                (change.max(f64::MIN_POSITIVE) / size).ln().abs()
            };
            let sized = models.map(|model| (off(&model, &mut predictor), model));
            probes.extend(sized.min_by(|a, b| a.0.total_cmp(&b.0)).map(|(_, model)| model));
        }
        probes
    }

    /// Evaluates commands, on all rows or on a few.
    pub(super) fn evaluate(&self, commands: &Commands, complete: bool) -> Evaluation {
        let (data, grid) = self.record(commands, complete);
        let mut predictor = Predictor::new(&data, &self.base, &grid, &self.whitening, &self.noise);
        let nominal = predictor.readings(&Model::default());
        let predicted: Vec<Vec<Vec<f64>>> =
            self.draws.iter().map(|models| models.iter().map(|model| predictor.readings(model)).collect()).collect();
        let sensitivities: Vec<Sensitivities> =
            self.bends.iter().zip(&predicted).map(|(bends, at)| sensitivities(&mut predictor, bends, &at[0])).collect();
        let mut pairs = Vec::new();
        for (truth, of_truth) in predicted.iter().enumerate() {
            let imitates = |rival: usize| self.hypotheses[rival].contains(&self.hypotheses[truth]);
            for rival in (0..predicted.len()).filter(|&rival| !imitates(rival)) {
                let allowed = self.allowed(truth, rival);
                let of_rival = &sensitivities[rival];
                let nats = of_truth.iter().map(|readings| {
                    let difference = predictor.whitened_difference(readings, &predicted[rival][0]);
                    let part = self.part(predictor.mean_square(readings, &nominal));
                    projected(&difference, of_rival, &allowed, part).0
                });
                let named = [truth, rival].iter().all(|&index| self.hypotheses[index].named);
                pairs.push(Pair { truth, rival, named, nats: nats.collect() });
            }
        }
        let breadth = self.breadth(&mut predictor, &predicted[0][0], &sensitivities[0]);
        Evaluation { pairs, breadth }
    }

    /// Returns the indices of the columns that a rival may bend if a truth holds: none that is what the truth claims.
    fn allowed(&self, truth: usize, rival: usize) -> Vec<usize> {
        let bends = &self.bends[rival];
        let free = |bend: &Bend| bend.extra.is_none_or(|cause| !self.hypotheses[truth].claims(cause));
        // The last column is the shift of all readings.
        (0..bends.len()).filter(|&index| free(&bends[index])).chain([bends.len()]).collect()
    }

    /// Returns the part of the information that the unmodelled rest leaves, given the mean square of what the truth changes, in V^2.
    pub(super) fn part(&self, changed: f64) -> f64 {
        let rest = self.noise.unexplained.powi(2) + MODEL_ERROR.powi(2) * changed;
        1.0 / (1.0 + 2.0 * self.frame.tau_rows * rest * self.whitening.at_corner())
    }

    /// Returns the information on the coordinates and probes of the likeliest hypothesis, in nats: between the mean and the least.
    fn breadth(&self, predictor: &mut Predictor, here: &[f64], own: &Sensitivities) -> f64 {
        let probes = self.probes.iter().map(|model| {
            let there = predictor.readings(model);
            predictor.whitened_difference(&there, here)
        });
        let columns: Vec<Vec<f64>> = probes.chain(own.columns.iter().cloned()).collect();
        let Some(covariance) = posterior(&products(&columns), self.part(0.0)) else { return 0.0 };
        // Without the shift of all readings.
        let count = columns.len() - 1;
        let known: Vec<f64> = (0..count).map(|index| -0.5 * covariance[(index, index)].ln()).collect();
        let mean = known.iter().sum::<f64>() / count.max(1) as f64;
        0.5 * (mean + known.into_iter().fold(mean, f64::min))
    }

    /// Returns the part of a pair's separation that each of the commands' parts contributes, on all rows.
    pub(super) fn contributions(&self, commands: &Commands, truth: usize, rival: usize) -> Vec<f64> {
        let (data, grid) = self.record(commands, false);
        let mut predictor = Predictor::new(&data, &self.base, &grid, &self.whitening, &self.noise);
        let [here, there] = [truth, rival].map(|index| predictor.readings(&self.draws[index][0]));
        let nominal = predictor.readings(&Model::default());
        let of_rival = sensitivities(&mut predictor, &self.bends[rival], &there);
        let difference = predictor.whitened_difference(&here, &there);
        let part = self.part(predictor.mean_square(&here, &nominal));
        let (_, left) = projected(&difference, &of_rival, &self.allowed(truth, rival), part);
        let sum = dot(&left, &left).max(f64::MIN_POSITIVE);
        let of_part = |&(from, to, _): &(usize, usize, f64)| {
            let rows = grid.rows.iter().zip(&left).filter(|(row, _)| (from..to).contains(*row));
            rows.map(|(_, left)| left * left).sum::<f64>() / sum
        };
        commands.parts.iter().map(of_part).collect()
    }

    /// Returns the covariance of the coordinates of the likeliest hypothesis after an experiment, in units of their standard
    /// deviations before; `None` if it cannot be computed.
    pub(super) fn posterior(&self, commands: &Commands) -> Option<DMatrix<f64>> {
        let (data, grid) = self.record(commands, false);
        let mut predictor = Predictor::new(&data, &self.base, &grid, &self.whitening, &self.noise);
        let here = predictor.readings(&self.draws[0][0]);
        posterior(&sensitivities(&mut predictor, &self.bends[0], &here).products, self.part(0.0))
    }
}

fn sensitivities(predictor: &mut Predictor, bends: &[Bend], here: &[f64]) -> Sensitivities {
    let mut columns: Vec<Vec<f64>> = bends.iter().map(|bend| predictor.sensitivity(bend, here)).collect();
    columns.push(predictor.shift());
    let products = products(&columns);
    Sensitivities { columns, products }
}

fn products(columns: &[Vec<f64>]) -> DMatrix<f64> {
    let mut products = DMatrix::zeros(columns.len(), columns.len());
    for row in 0..columns.len() {
        for column in row..columns.len() {
            let product = dot(&columns[row], &columns[column]);
            (products[(row, column)], products[(column, row)]) = (product, product);
        }
    }
    products
}

/// Returns `(part products + 1)^-1`.
fn posterior(products: &DMatrix<f64>, part: f64) -> Option<DMatrix<f64>> {
    let size = products.nrows();
    (products * part + DMatrix::identity(size, size)).cholesky().map(|factor| factor.inverse())
}

/// Returns the separation of a difference after the allowed columns were fitted to it, in nats, and what is left of it.
fn projected(difference: &[f64], rival: &Sensitivities, allowed: &[usize], part: f64) -> (f64, Vec<f64>) {
    let products = rival.products.select_rows(allowed).select_columns(allowed);
    let along = DVector::from_iterator(
        allowed.len(),
        allowed.iter().map(|&column| part * dot(&rival.columns[column], difference)),
    );
    let size = allowed.len();
    let whole = part * dot(difference, difference);
    let Some(factor) = (products * part + DMatrix::identity(size, size)).cholesky() else {
        return (0.0, difference.to_vec());
    };
    let step = factor.solve(&along);
    let mut left = difference.to_vec();
    for (&column, step) in allowed.iter().zip(step.iter()) {
        left.iter_mut().zip(&rival.columns[column]).for_each(|(left, value)| *left -= step * value);
    }
    ((0.5 * (whole - along.dot(&step))).max(0.0), left)
}
