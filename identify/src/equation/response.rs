//! The response of a structure as columns with one element per row: one column for each linear coefficient.

use crate::equation::operator::run;
use crate::equation::scale::Scale;
use crate::equation::structure::{Place, Structure};
use crate::record::signal::Signal;

/// Largest number of free responses of an unknown initial state.
const MOST_STATES: usize = 2;
/// Ratio of two time constants below which their free responses count as one.
const ALIKE: f64 = 1.3;

/// The response of a structure to the voltage of a record.
pub(super) struct Response {
    /// Signal in front of each operator of the chain, and behind the last; not behind a last sum.
    stages: Vec<Signal>,
    /// Part of the prediction without a coefficient; empty if the chain ends in a sum.
    pub(super) fixed: Vec<f64>,
    /// Columns of the linear coefficients: the zero, the branches of a last sum, the terms, the free responses.
    pub(super) columns: Vec<Vec<f64>>,
    /// Work that it took, in pieces of the voltage through one lag.
    pub(super) work: u64,
}

/// What a response is computed from.
#[derive(Clone, Copy)]
pub(super) struct Source<'a> {
    /// The commanded voltage.
    pub(super) input: &'a Signal,
    /// Times since the first row, in s.
    pub(super) time_s: &'a [f64],
    /// Scales of the record.
    pub(super) scale: &'a Scale,
    /// True if the spring may not have been at rest at the first row.
    pub(super) initial_state_unknown: bool,
}

impl Response {
    /// Computes the response.
    pub(super) fn of(structure: &Structure, source: Source) -> Self {
        let mut work = 0;
        let mut stages = vec![source.input.clone()];
        let linear = structure.is_linear_at_end();
        let before_last = structure.chain.len() - usize::from(linear);
        for operator in &structure.chain[..before_last] {
            let mut signal = stages[stages.len() - 1].clone();
            work += operator.apply(&mut signal, source.scale);
            stages.push(signal);
        }
        let mut response = Self { stages, fixed: Vec::new(), columns: vec![vec![1.0; source.time_s.len()]], work };
        match structure.last_sum() {
            None => response.fixed = response.stages[before_last].at_rows().collect(),
            Some(sum) => (0..sum.chains.len()).for_each(|branch| {
                let (column, work) = response.branch(structure, branch, source.scale);
                response.columns.push(column);
                response.work += work;
            }),
        }
        for term in &structure.terms {
            response.columns.extend(term.columns(source.time_s, source.scale));
        }
        if source.initial_state_unknown {
            let mut taus: Vec<f64> = Vec::new();
            for tau_s in structure.taus(source.scale) {
                if taus.len() < MOST_STATES && taus.iter().all(|other| (tau_s / other).ln().abs() > ALIKE.ln()) {
                    taus.push(tau_s);
                }
            }
            let free = |tau_s: f64| source.time_s.iter().map(|time_s| (-time_s / tau_s).exp()).collect();
            response.columns.extend(taus.into_iter().map(free));
        }
        response
    }

    /// Computes the column of one branch of the last sum from the signal in front of it, and the work.
    fn branch(&self, structure: &Structure, branch: usize, scale: &Scale) -> (Vec<f64>, u64) {
        let mut signal = self.stages[self.stages.len() - 1].clone();
        let chain = structure.last_sum().map_or(&[][..], |sum| &sum.chains[branch]);
        let work = run(chain, &mut signal, scale);
        (signal.at_rows().collect(), work)
    }

    /// Returns the prediction with the coefficients.
    pub(super) fn prediction(&self, coefficients: &[f64]) -> Vec<f64> {
        let mut sum = if self.fixed.is_empty() { vec![0.0; self.columns[0].len()] } else { self.fixed.clone() };
        for (column, coefficient) in self.columns.iter().zip(coefficients) {
            sum.iter_mut().zip(column).for_each(|(sum, value)| *sum += coefficient * value);
        }
        sum
    }

    /// Returns the prediction of a structure that differs from that of the response at one place only, less the response's own,
    /// and the work.
    pub(super) fn change(
        &self,
        moved: &Structure,
        place: Place,
        coefficients: &[f64],
        source: Source,
    ) -> (Vec<f64>, u64) {
        let difference = |there: &[f64], here: &[f64], factor: f64| -> Vec<f64> {
            there.iter().zip(here).map(|(there, here)| factor * (there - here)).collect()
        };
        match place {
            Place::Branch(branch) => {
                let (column, work) = self.branch(moved, branch, source.scale);
                (difference(&column, &self.columns[1 + branch], coefficients[1 + branch]), work)
            }
            Place::Term(term) => {
                let before = moved.terms[..term].iter().map(|term| term.amplitudes()).sum::<usize>();
                let first = 1 + moved.last_sum().map_or(0, |sum| sum.chains.len()) + before;
                let mut sum = vec![0.0; source.time_s.len()];
                for (index, column) in moved.terms[term].columns(source.time_s, source.scale).iter().enumerate() {
                    let change = difference(column, &self.columns[first + index], coefficients[first + index]);
                    sum.iter_mut().zip(change).for_each(|(sum, change)| *sum += change);
                }
                (sum, source.time_s.len() as u64)
            }
            Place::Chain(index) => {
                let mut signal = self.stages[index].clone();
                let linear = moved.is_linear_at_end();
                let before_last = moved.chain.len() - usize::from(linear);
                let mut work = run(&moved.chain[index..before_last], &mut signal, source.scale);
                let Some(sum) = moved.last_sum() else {
                    return (difference(&signal.at_rows().collect::<Vec<_>>(), &self.fixed, 1.0), work);
                };
                let mut total = vec![0.0; source.time_s.len()];
                for (branch, chain) in sum.chains.iter().enumerate() {
                    let mut through = signal.clone();
                    work += run(chain, &mut through, source.scale);
                    let (factor, here) = (coefficients[1 + branch], &self.columns[1 + branch]);
                    for ((total, there), here) in total.iter_mut().zip(through.at_rows()).zip(here) {
                        *total += factor * (there - here);
                    }
                }
                (total, work)
            }
        }
    }
}
