//! Where a record begins in mid-course: how far each state of the chain is off its rest by then.
//!
//! Behind memory and law all is linear (but for two forms, a time constant by the spring's state and a law behind the
//! relaxation, which are not tried here), so the prediction is straight in the states at the first row,
//! `prediction(x) = prediction(0) + sum x_i kernel_i`, and the kernels die away. So `x` is no coordinate of a fit; every
//! model gets the one that suits it best, by Huber's robust least squares with a normal prior as wide as the record's
//! voltages (of kernels alike, only the sum is known). It counts as given, also for stretches that are held out; what the
//! states cost, as by Schwarz's criterion, their model pays.

use nalgebra::{DMatrix, DVector};

use crate::stats::scale::robust_scale;
use crate::stats::sums::dot;

/// Errors this many scales large count as that large.
const FAR: f64 = 3.0;
/// Rounds of reweighting.
const ROUNDS: usize = 4;
/// Rows where the start matters less, as a part of where it matters most, do not tell its scale.
const FADED: f64 = 0.05;

/// The states of a chain, in the order in which they ask: all at rest, or one of them 1 V off.
#[derive(Debug, Default)]
pub struct InitialState {
    asked: usize,
    off: Option<usize>,
}

impl InitialState {
    /// All at rest.
    pub fn at_rest() -> Self {
        Self::default()
    }

    /// All but one.
    pub(crate) fn off(state: usize) -> Self {
        Self { asked: 0, off: Some(state) }
    }

    /// How far the next state is off its rest, in V.
    pub fn next_offset_v(&mut self) -> f64 {
        self.asked += 1;
        f64::from(u8::from(self.off == Some(self.asked - 1)))
    }

    /// How many states have asked.
    pub(crate) fn states(&self) -> usize {
        self.asked
    }
}

/// Takes the likeliest start off a residual, by what `counts` of its rows; states are off by about `reach_v`. What that start
/// costs, in nats: each state by Schwarz's criterion, and what the prior says against it.
pub(crate) fn subtract_estimate(
    residual: &mut [f64],
    kernels: &[Vec<f64>],
    reach_v: f64,
    counts: impl Fn(usize) -> bool,
) -> f64 {
    let early = kernels.iter().map(|kernel| faded(kernel)).max().unwrap_or(0);
    let counted = |values: &[f64]| (0..early).filter(|&row| counts(row)).map(|row| values[row]).collect::<Vec<f64>>();
    let read = counted(residual);
    let told: Vec<Vec<f64>> = kernels.iter().map(|kernel| counted(kernel)).collect();
    let mut start = DVector::zeros(kernels.len());
    let mut left = read.clone();
    let mut weighted = left.clone();
    let (mut usual, mut far) = (robust_scale(&left), f64::INFINITY);
    for round in 1..=ROUNDS {
        let prior = (usual / reach_v).powi(2);
        let mut normal = DMatrix::from_diagonal_element(kernels.len(), kernels.len(), prior);
        for (i, kernel) in told.iter().enumerate() {
            let weights = left.iter().map(|left| (far / left.abs()).min(1.0));
            weighted.iter_mut().zip(kernel).zip(weights).for_each(|((to, kernel), weight)| *to = weight * kernel);
            start[i] = dot(&weighted, &read);
            // The lower triangle is all that is read.
            told[..=i].iter().enumerate().for_each(|(j, other)| normal[(i, j)] += dot(&weighted, other));
        }
        let Some(cholesky) = normal.cholesky() else { return 0.0 };
        cholesky.solve_mut(&mut start);
        if round < ROUNDS {
            left.clone_from(&read);
            take(&start, &told, &mut left);
            usual = robust_scale(&left);
            far = FAR * usual;
        }
    }
    take(&start, kernels, residual);
    0.5 * (residual.len().max(2) as f64).ln() * kernels.len() as f64 + 0.5 * start.norm_squared() / reach_v.powi(2)
}

fn take(start: &DVector<f64>, kernels: &[Vec<f64>], from: &mut [f64]) {
    for (start, kernel) in start.iter().zip(kernels) {
        from.iter_mut().zip(kernel).for_each(|(left, kernel)| *left -= start * kernel);
    }
}

/// The first row from which on a kernel hardly matters.
fn faded(kernel: &[f64]) -> usize {
    let most = kernel.iter().fold(0.0, |most: f64, value| most.max(value.abs()));
    kernel.iter().rposition(|value| value.abs() > FADED * most).map_or(0, |last| last + 1)
}

#[cfg(test)]
mod tests {
    use crate::effects::index_of;
    use crate::effects::model::{Block, Model};
    use crate::fit::engine::Engine;
    use crate::fit::simulator::Simulator;
    use crate::plant::base::Base;
    use crate::record::data::{Data, Input};
    use crate::record::observed::Observed;
    use simulation::record::{Record, Row};

    const ROWS: usize = 900;
    /// Just after a step.
    const CUT: usize = 302;

    fn record(rows: impl Iterator<Item = usize>, reading: impl Fn(usize) -> f64) -> Record {
        let volts = |row: usize| [0.0, 300.0, 100.0, 500.0, 200.0, 400.0][row / 60 * 7 % 6];
        let row = |row| Row { line: 0, time_s: 0.1 * row as f64, voltage_v: volts(row), measured: Some(reading(row)) };
        Record { name: String::new(), rows: rows.map(row).collect() }
    }

    /// Cut out of a longer one, a record shows the same spring.
    #[test]
    fn a_start_makes_up_for_all_that_was_before() {
        let springs: [&[(&str, usize, &[f64])]; 6] = [
            &[("time-constant", 0, &[2.0])],
            &[("charge-leakage", 1, &[0.2, 3.0, 0.4]), ("second-relaxation", 1, &[0.2, 3.6])],
            &[("voltage-dependent-time-constant", 0, &[1.2, 2.0]), ("resonance", 2, &[-0.5, -3.0, 0.8, 0.0])],
            &[("delay", 0, &[0.3, 0.1]), ("gain-error", 0, &[1.1])],
            &[("amplifier-slew", 2, &[-0.5])],
            &[("hysteresis", 0, &[3.0]), ("static-nonlinearity", 0, &[0.2])],
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
