//! The initial state of the chain at the first row, where the spring may not have been at rest.
//!
//! Behind hysteresis and static law most chains are linear, so that the prediction is linear in the states at the first
//! row, `prediction(x) = prediction(0) + sum x_i kernel_i`, and the kernels decay. The states
//! are not coordinates of the fit: for every model they are estimated by Huber's robust least squares, with a normal
//! prior whose width is the record's full scale (the prior decides between kernels of the same shape). Where a law, a play
//! operator or the time constant depends on the state, the estimate takes Gauss-Newton steps, with the kernels where
//! the first one ended. Held-out
//! segments use the same estimate. The likelihood is reduced by the cost of the states, by Schwarz's criterion.

use nalgebra::{Cholesky, DMatrix, DVector, Dyn};

use crate::stats::scale::robust_scale;
use crate::stats::sums::dot;
use crate::stats::thresholds::empirical::HUBER_THRESHOLD;

/// Number of reweighting rounds.
const ROUNDS: usize = 4;
/// Rows in which all kernels are below this fraction of their maximum do not contribute to the estimate.
const NEGLIGIBLE: f64 = 0.05;

/// The initial offsets of a chain's states, requested one after the other.
#[derive(Debug, Default)]
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
        let early = kernels.iter().map(|kernel| decay_end(kernel)).max().unwrap_or(0);
        let rows: Vec<usize> = (0..early).filter(|&row| counts(row)).collect();
        let counted = |values: &[f64]| rows.iter().map(|&row| values[row]).collect::<Vec<f64>>();
        let read = counted(residual);
        let used: Vec<Vec<f64>> = kernels.iter().map(|kernel| counted(kernel)).collect();
        let mut weighted = used.clone();
        let mut start = DVector::zeros(kernels.len());
        let mut left = read.clone();
        let (mut usual, mut far) = (robust_scale(&left), f64::INFINITY);
        for round in 1.. {
            let prior = (usual / reach_v).powi(2);
            let mut normal = DMatrix::from_diagonal_element(kernels.len(), kernels.len(), prior);
            for (i, kernel) in used.iter().enumerate() {
                let weights = left.iter().map(|left| (far / left.abs()).min(1.0));
                weighted[i].iter_mut().zip(kernel).zip(weights).for_each(|((to, kernel), of)| *to = of * kernel);
                start[i] = dot(&weighted[i], &read);
                // The Cholesky decomposition reads the lower triangle only.
                used[..=i].iter().enumerate().for_each(|(j, other)| normal[(i, j)] += dot(&weighted[i], other));
            }
            let normal = normal.cholesky()?;
            normal.solve_mut(&mut start);
            if round == ROUNDS {
                return Some(Self { start_v: start.as_slice().to_vec(), rows, weighted, normal });
            }
            left.clone_from(&read);
            subtract(start.as_slice(), &used, &mut left);
            usual = robust_scale(&left);
            far = HUBER_THRESHOLD.get() * usual;
        }
        None
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

/// Subtracts the response to the most likely initial state from a residual, estimated from the rows for which `counts`
/// is true, with a prior of standard deviation `reach_v`, in V. Returns its [cost], in nats.
pub(crate) fn subtract_estimate(
    residual: &mut [f64],
    kernels: &[Vec<f64>],
    reach_v: f64,
    counts: impl Fn(usize) -> bool,
) -> f64 {
    let Some(Estimate { start_v, .. }) = Estimate::of(residual, kernels, reach_v, counts) else { return 0.0 };
    subtract(&start_v, kernels, residual);
    cost(&start_v, reach_v, residual.len())
}

/// Returns the cost of an initial state that was estimated from a number of rows, in nats: Schwarz's criterion for each state, and the
/// prior of standard deviation `reach_v`, in V.
pub(crate) fn cost(start_v: &[f64], reach_v: f64, rows: usize) -> f64 {
    0.5 * (rows.max(2) as f64).ln() * start_v.len() as f64 + 0.5 * dot(start_v, start_v) / reach_v.powi(2)
}

fn subtract(start: &[f64], kernels: &[Vec<f64>], from: &mut [f64]) {
    for (start, kernel) in start.iter().zip(kernels) {
        from.iter_mut().zip(kernel).for_each(|(left, kernel)| *left -= start * kernel);
    }
}

/// Returns the first row from which on a kernel stays below [`NEGLIGIBLE`] of its maximum.
fn decay_end(kernel: &[f64]) -> usize {
    let most = kernel.iter().fold(0.0, |most: f64, value| most.max(value.abs()));
    kernel.iter().rposition(|value| value.abs() > NEGLIGIBLE * most).map_or(0, |last| last + 1)
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
            let left = residual.iter().fold(0.0f64, |far, left| far.max(left.abs()));
            assert!(data.initial_state_unknown && left < 0.01, "{blocks:?}: {left} V");
        }
    }
}
