//! The initial state of the chain at the first row, where the spring may not have been at rest.
//!
//! Behind hysteresis and static law most chains are linear, so that the prediction is linear in the states at the first
//! row, `prediction(x) = prediction(0) + sum x_i kernel_i`, and the kernels decay. The states
//! are not coordinates of the fit: for every model they are estimated by Huber's robust least squares, with a normal
//! prior whose width is the record's full scale (the prior decides between kernels of the same shape). Where a law, a play
//! operator or the time constant depends on the state, the estimate takes Gauss-Newton steps, with the kernels where
//! the first one ended. Held-out
//! segments use the same estimate. The likelihood is reduced by the cost of the states, by Schwarz's criterion.

use std::borrow::Cow;

use nalgebra::{Cholesky, DMatrix, DVector, Dyn};

use crate::stats::scale::{largest_magnitude, robust_scale};
use crate::stats::sums::dot;
use crate::stats::thresholds::empirical::HUBER_THRESHOLD;

/// Largest number of reweighting rounds, and the change of an offset, in scales of the residual, below which no other is needed.
const ROUNDS: usize = 4;
const SETTLED: f64 = 1e-5;
/// Largest number of rows from which the scale of the residual is estimated, by which its weights are set.
const ROWS_OF_SCALE: usize = 500;
/// Rows in which all kernels are below this fraction of their maximum do not contribute to the estimate.
const NEGLIGIBLE: f64 = 0.05;
/// Fraction of its maximum below which a kernel changes nothing in an estimate.
const VANISHED: f64 = 1e-4;

/// The initial offsets of a chain's states, requested one after the other.
#[derive(Clone, Debug, Default)]
pub struct InitialState {
    asked: usize,
    /// Offsets by the index of their state, in V; 0 beyond.
    offsets_v: Vec<f64>,
}

impl InitialState {
    /// Returns the state in which every offset is 0.
    pub fn at_rest() -> Self {
        Self::default()
    }

    /// Returns the state in which the offset with this index is 1 V and all others are 0.
    pub(crate) fn off(state: usize) -> Self {
        let mut offsets_v = vec![0.0; state + 1];
        offsets_v[state] = 1.0;
        Self::of(offsets_v)
    }

    /// Returns the state with these offsets, in V, and all others 0.
    pub(crate) fn of(offsets_v: Vec<f64>) -> Self {
        Self { asked: 0, offsets_v }
    }

    /// Returns the offset of the next state from its settled value, in V.
    pub fn next_offset_v(&mut self) -> f64 {
        self.asked += 1;
        self.offsets_v.get(self.asked - 1).copied().unwrap_or(0.0)
    }

    /// Returns the number of offsets that have been requested.
    pub(crate) fn states(&self) -> usize {
        self.asked
    }
}

/// The most likely initial state, and how it follows a change of the residual.
pub(crate) struct Estimate {
    /// Offset of each kernel's state, in V.
    pub(crate) start_v: Vec<f64>,
    /// Rows that the estimate uses.
    rows: Vec<usize>,
    /// Kernels in these rows, weighted.
    weighted: Vec<Vec<f64>>,
    /// Normal matrix of the weighted least squares, factorised.
    normal: Cholesky<f64, Dyn>,
}

impl Estimate {
    /// Estimates the initial state from the rows of a residual for which `counts` is true, with a prior of standard deviation
    /// `reach_v`, in V; `None` if it cannot be estimated.
    pub(crate) fn of(
        residual: &[f64],
        kernels: &[Vec<f64>],
        reach_v: f64,
        counts: impl Fn(usize) -> bool,
    ) -> Option<Self> {
        let used = Used::of(residual, kernels, counts);
        let Solution { start_v, weights, normal } = used.solved(reach_v)?;
        let weighted = |kernel: &Cow<[f64]>| kernel.iter().zip(&weights).map(|(kernel, of)| of * kernel).collect();
        Some(Self { start_v, weighted: used.kernels.iter().map(weighted).collect(), rows: used.rows, normal })
    }

    /// Subtracts from a change of the residual what the initial state takes over of it, its weights unchanged.
    pub(crate) fn follow(&self, change: &mut [f64], kernels: &[Vec<f64>]) {
        subtract(&self.moved_by(change), kernels, change);
    }

    /// Returns the change of the offsets, in V, that follows a change of the residual, its weights unchanged.
    pub(crate) fn moved_by(&self, change: &[f64]) -> Vec<f64> {
        let counted: Vec<f64> = self.rows.iter().map(|&row| change[row]).collect();
        let mut start = DVector::from_iterator(self.weighted.len(), self.weighted.iter().map(|of| dot(of, &counted)));
        self.normal.solve_mut(&mut start);
        start.as_slice().to_vec()
    }

    /// Returns the covariance of the offsets, in V^2, under independent noise of standard deviation `scale_v`, in V.
    pub(crate) fn covariance(&self, scale_v: f64) -> DMatrix<f64> {
        self.normal.inverse() * scale_v.powi(2)
    }
}

/// The estimate at a model, of a single record.
pub(crate) struct Start {
    /// Offset of each kernel's state, in V.
    pub(crate) start_v: Vec<f64>,
    /// How it follows a change of the residual.
    pub(crate) estimate: Estimate,
    /// Change of the prediction at each row for each state that is 1 V higher.
    pub(crate) kernels: Vec<Vec<f64>>,
    /// Reading minus prediction from there, in V.
    pub(crate) residual: Vec<f64>,
    /// True if the prediction is linear in the offsets.
    pub(crate) linear: bool,
}

/// What an estimate of the initial state uses.
struct Used<'a> {
    rows: Vec<usize>,
    /// Residual in these rows, in V.
    residual: Cow<'a, [f64]>,
    /// Kernels in these rows, each up to the row where it has vanished.
    kernels: Vec<Cow<'a, [f64]>>,
}

/// Offsets, in V, with the weight of each row and the factorised normal matrix of the last round.
struct Solution {
    start_v: Vec<f64>,
    weights: Vec<f64>,
    normal: Cholesky<f64, Dyn>,
}

impl<'a> Used<'a> {
    fn of(residual: &'a [f64], kernels: &'a [Vec<f64>], counts: impl Fn(usize) -> bool) -> Self {
        let ends: Vec<Ends> = kernels.iter().map(|kernel| Ends::of(kernel)).collect();
        let early = ends.iter().map(|ends| ends.negligible).max().unwrap_or(0);
        let rows: Vec<usize> = (0..early).filter(|&row| counts(row)).collect();
        let counted = |values: &'a [f64], end: usize| -> Cow<'a, [f64]> {
            let used = &rows[..rows.partition_point(|row| *row < end)];
            match rows.len() == early {
                true => Cow::Borrowed(&values[..used.len()]),
                false => used.iter().map(|&row| values[row]).collect(),
            }
        };
        let residual = counted(residual, early);
        let kernels = kernels.iter().zip(&ends).map(|(kernel, ends)| counted(kernel, ends.vanished)).collect();
        Self { rows, residual, kernels }
    }

    /// Solves the least squares of Huber's weights, with a prior of standard deviation `reach_v`, in V.
    fn solved(&self, reach_v: f64) -> Option<Solution> {
        let states = self.kernels.len();
        let mut unweighted = DMatrix::zeros(states, states);
        for (i, kernel) in self.kernels.iter().enumerate() {
            // The Cholesky decomposition reads the lower triangle only.
            self.kernels[..=i].iter().enumerate().for_each(|(j, other)| unweighted[(i, j)] = dot(kernel, other));
        }
        let mut weights = vec![1.0; self.rows.len()];
        let mut weighted = self.residual.to_vec();
        let mut left = self.residual.to_vec();
        let mut usual = scale(&left);
        let mut before = DVector::zeros(states);
        for round in 1.. {
            let mut normal = unweighted.clone();
            for (row, lost) in weights.iter().enumerate().filter(|(_, of)| **of < 1.0).map(|(row, of)| (row, 1.0 - of))
            {
                let at = |kernel: &Cow<[f64]>| kernel.get(row).copied().unwrap_or(0.0);
                for i in 0..states {
                    let taken = lost * at(&self.kernels[i]);
                    (0..=i).for_each(|j| normal[(i, j)] -= taken * at(&self.kernels[j]));
                }
            }
            let prior = (usual / reach_v).powi(2);
            (0..states).for_each(|state| normal[(state, state)] += prior);
            let normal = normal.cholesky()?;
            let mut start = DVector::from_iterator(states, self.kernels.iter().map(|kernel| dot(kernel, &weighted)));
            normal.solve_mut(&mut start);
            let moved_v = (&start - &before).amax();
            if round == ROUNDS || round > 1 && moved_v < SETTLED * usual {
                return Some(Solution { start_v: start.as_slice().to_vec(), weights, normal });
            }
            left.copy_from_slice(&self.residual);
            subtract(start.as_slice(), &self.kernels, &mut left);
            usual = scale(&left);
            let far = HUBER_THRESHOLD.get() * usual;
            for (row, left) in left.iter().enumerate() {
                weights[row] = if left.abs() > far { far / left.abs() } else { 1.0 };
                weighted[row] = weights[row] * self.residual[row];
            }
            before = start;
        }
        None
    }
}

/// Subtracts the response to the most likely initial state from a residual, estimated from the rows for which `counts`
/// is true, with a prior of standard deviation `reach_v`, in V. Returns its [cost], in nats.
pub(crate) fn subtract_estimate(
    residual: &mut [f64],
    kernels: &[Vec<f64>],
    reach_v: f64,
    counts: impl Fn(usize) -> bool,
) -> f64 {
    let Some(Solution { start_v, .. }) = Used::of(residual, kernels, counts).solved(reach_v) else { return 0.0 };
    subtract(&start_v, kernels, residual);
    cost(&start_v, reach_v, residual.len())
}

/// Returns the cost of an initial state that was estimated from a number of rows, in nats: Schwarz's criterion for each state, and the
/// prior of standard deviation `reach_v`, in V.
pub(crate) fn cost(start_v: &[f64], reach_v: f64, rows: usize) -> f64 {
    0.5 * (rows.max(2) as f64).ln() * start_v.len() as f64 + 0.5 * dot(start_v, start_v) / reach_v.powi(2)
}

/// Returns the robust scale of a residual, in V, from rows that are equally far apart.
fn scale(left: &[f64]) -> f64 {
    robust_scale(&left.iter().copied().step_by(left.len().div_ceil(ROWS_OF_SCALE).max(1)).collect::<Vec<_>>())
}

fn subtract(start: &[f64], kernels: &[impl AsRef<[f64]>], from: &mut [f64]) {
    for (start, kernel) in start.iter().zip(kernels) {
        from.iter_mut().zip(kernel.as_ref()).for_each(|(left, kernel)| *left -= start * kernel);
    }
}

/// The first rows from which on a kernel stays below [`NEGLIGIBLE`] and below [`VANISHED`] of its maximum.
struct Ends {
    negligible: usize,
    vanished: usize,
}

impl Ends {
    fn of(kernel: &[f64]) -> Self {
        let most = largest_magnitude(kernel);
        let end =
            |rows: &[f64], least: f64| rows.iter().rposition(|value| value.abs() > least).map_or(0, |last| last + 1);
        let vanished = end(kernel, VANISHED * most);
        Self { negligible: end(&kernel[..vanished], NEGLIGIBLE * most), vanished }
    }
}

#[cfg(test)]
mod tests {
    use crate::effects::index_of;
    use crate::effects::model::{Block, Model};
    use crate::fit::engine::Engine;
    use crate::fit::simulator::Simulator;
    use crate::plant::base::Base;
    use crate::record::data::Data;
    use crate::record::input::Input;
    use crate::record::observed::Observed;
    use crate::stats::scale::largest_magnitude;
    use simulation::record::{Record, Row};

    const ROWS: usize = 900;
    /// Row just after a step at which the record is cut.
    const CUT: usize = 302;

    fn record(rows: impl Iterator<Item = usize>, reading: impl Fn(usize) -> f64) -> Record {
        let volts = |row: usize| [0.0, 300.0, 100.0, 500.0, 200.0, 400.0][row / 60 * 7 % 6];
        let row = |row| Row { line: 0, time_s: 0.1 * row as f64, voltage_v: volts(row), measured: Some(reading(row)) };
        Record { name: String::new(), rows: rows.map(row).collect() }
    }

    /// The readings of a spring from any row on are explained without residual by the model of that spring.
    #[test]
    fn initial_state_explains_a_record_cut_from_a_longer_one() {
        let springs: [&[(&str, usize, &[f64])]; 12] = [
            &[("time-constant", 0, &[2.0])],
            &[("charge-leakage", 1, &[0.2, 3.0, 0.4]), ("second-relaxation", 1, &[0.2, 3.6])],
            &[("voltage-dependent-time-constant", 0, &[1.2, 2.0]), ("resonance", 2, &[-0.5, -3.0, 0.8, 0.0])],
            &[("delay", 0, &[0.3, 0.1]), ("gain-error", 0, &[1.1])],
            &[("series-lag", 2, &[-0.5])],
            &[("series-lag", 1, &[0.5, 0.2])],
            &[("series-lag", 0, &[0.5]), ("voltage-dependent-time-constant", 0, &[1.2, 2.0])],
            &[("hysteresis", 0, &[3.0]), ("static-nonlinearity", 0, &[0.2])],
            // Not linear in the initial state.
            &[("static-nonlinearity", 4, &[0.3])],
            &[("static-nonlinearity", 5, &[2.0]), ("second-relaxation", 1, &[0.2, 3.6])],
            &[("voltage-dependent-time-constant", 2, &[1.0, 2.5, 0.1])],
            &[("voltage-dependent-time-constant", 4, &[1.2, 2.2])],
        ];
        for blocks in springs {
            let model = blocks.iter().fold(Model::default(), |model, &(cause, form, point)| {
                model.with(Block { effect: index_of(cause).unwrap(), form }, point.to_vec())
            });
            let base = Base::paper();
            let whole = Data::new(&record(0..ROWS, |_| 0.0), Input::Hold);
            let mut readings = Vec::new();
            Simulator::new(&whole, &base).run(&model, &mut readings);
            let data = Data::new(&record(CUT..ROWS, |row| readings[row]), Input::Hold);
            let observed = Observed::new(&data);
            let mut engine = Engine::new(&data, &observed, &base);
            let residual = engine.residual(&model);
            let left = largest_magnitude(&residual);
            assert!(data.initial_state_unknown && left < 0.01, "{blocks:?}: {left} V");
        }
    }
}
