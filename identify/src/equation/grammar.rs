//! The grammar: every structure that one edit makes of another, each with several values from which a fit may start.
//!
//! | edit | where |
//! | --- | --- |
//! | insert an operator | in front of the first sum, or behind it |
//! | add a branch | to the first sum |
//! | insert a curve | into one branch of that sum |
//! | let a time constant vary | each lag |
//! | multiply by one plus a chain | in front of the first sum, or behind it |
//! | add a term | to the readings |
//! | replace | an operator with memory by another one, a curve or product by a curve |
//! | take out | each operator, branch or term |

use std::f64::consts::TAU;

use crate::equation::candidates::{Candidates, SMALL};
use crate::equation::clock::Term;
use crate::equation::curve::Curve;
use crate::equation::fitted::Fitted;
use crate::equation::kind::Kind;
use crate::equation::lag::By;
use crate::equation::operator::Operator;
use crate::equation::problem::Problem;
use crate::equation::scale::Scale;
use crate::equation::smaller::taken_out;
use crate::equation::structure::Structure;
use crate::record::spectrum::peaks;

/// Most operators in front of the first sum, and behind it.
const MOST_IN_SERIES: usize = 3;
/// Most branches of a sum.
const MOST_BRANCHES: usize = 5;
/// Most terms.
const MOST_TERMS: usize = 3;
/// Number of spectral lines of the residual that are tried as frequencies.
const LINES: usize = 3;
/// Slow frequencies that are tried, in periods in the record.
const SLOW: [f64; 5] = [0.7, 1.3, 2.0, 3.0, 4.5];

/// One edit: the same structure at several values.
pub(super) type Edit = Vec<Structure>;

/// Returns all edits of a fitted equation.
pub(super) fn edits(parent: &Fitted, problem: &Problem) -> Vec<Edit> {
    let scale = &problem.scale;
    let grammar = Grammar { scale, candidates: Candidates(scale), parent: parent.weighted() };
    let mut edits = grammar.in_series(parent, problem);
    edits.extend(grammar.in_parallel());
    edits.extend(grammar.within_branches());
    edits.extend(grammar.terms(parent, problem));
    edits.extend(grammar.replaced());
    edits.extend(taken_out(parent, problem).into_iter().map(|smaller| vec![smaller]));
    edits
}

struct Grammar<'s> {
    scale: &'s Scale,
    candidates: Candidates<'s>,
    parent: Structure,
}

impl Grammar<'_> {
    /// Gains that change with time; the places of a step and of swings are those of the residual relative to the response.
    fn gains(&self, parent: &Fitted, problem: &Problem) -> Vec<Vec<Operator>> {
        let response: Vec<f64> =
            problem.reading.iter().zip(&parent.residual).map(|(reading, left)| reading - left).collect();
        let of_residual: Vec<f64> = parent.residual.iter().zip(&response).map(|(left, of)| left * of).collect();
        let squares: Vec<f64> = response.iter().map(|of| of * of).collect();
        let swing = |freq_hz: f64| {
            // Amplitudes as if the two oscillations were orthogonal.
            let power = 0.5 * squares.iter().sum::<f64>().max(f64::MIN_POSITIVE);
            let turn = TAU * freq_hz;
            let part = |of: fn(f64) -> f64| {
                let start_s = problem.data.time_s[0];
                let each = of_residual.iter().zip(&problem.data.time_s);
                each.map(|(value, time_s)| value * of(turn * (time_s - start_s))).sum::<f64>() / power
            };
            self.candidates.operator(Kind::Swing, &[freq_hz, part(f64::cos), part(f64::sin)])
        };
        vec![
            self.frequencies(&of_residual, problem).into_iter().map(swing).collect(),
            self.candidates.each(Kind::Grow, &[&[SMALL]]),
            vec![self.candidates.operator(Kind::Step, &[step_at(&of_residual, &squares, problem), SMALL])],
        ]
    }

    fn frequencies(&self, values: &[f64], problem: &Problem) -> Vec<f64> {
        let lines = peaks(values, problem.data, LINES).into_iter().map(|peak| peak.frequency_hz);
        lines.filter(|of| *of > 0.0).chain(SLOW.map(|periods| periods / self.scale.duration_s)).collect()
    }

    fn inserted(&self, at: usize, starts: Vec<Operator>) -> Edit {
        let with = |operator| {
            let mut structure = self.parent.clone();
            structure.chain.insert(at, operator);
            structure
        };
        starts.into_iter().map(with).collect()
    }

    fn in_series(&self, parent: &Fitted, problem: &Problem) -> Vec<Edit> {
        let sum = self.parent.sum_at();
        let mut edits = Vec::new();
        if sum < MOST_IN_SERIES {
            for starts in [
                self.candidates.at_times(Kind::Lag, 5.0, &[]),
                self.candidates.seconds(),
                self.candidates.delays(),
                self.candidates.slews(),
            ] {
                edits.push(self.inserted(sum, starts));
            }
            for starts in [self.candidates.curves(), self.candidates.memories(), self.candidates.products()].concat() {
                // Curves and memories in front of other operators differ from those behind them.
                for at in if sum > 0 { vec![0, sum] } else { vec![0] } {
                    edits.push(self.inserted(at, starts.clone()));
                }
            }
        }
        let end = self.parent.chain.len();
        if end - sum <= MOST_IN_SERIES {
            let behind = [
                vec![self.candidates.slews()],
                self.candidates.curves(),
                self.candidates.memories(),
                self.candidates.products(),
            ]
            .concat();
            let behind = behind.into_iter().chain(self.gains(parent, problem));
            let behind: Vec<_> = behind.collect();
            edits.extend(behind.into_iter().map(|starts| self.inserted(end, starts)));
            let by_direction = [0.7, -0.7].map(|a| self.candidates.at_times(Kind::Varying(By::Direction), 4.0, &[a]));
            edits.push(self.inserted(end, by_direction.concat()));
            if end > sum + 1 {
                edits.push(self.inserted(end, self.candidates.at_times(Kind::Lag, 5.0, &[])));
            }
        }
        edits
    }

    /// Other operators with memory, and other curves, in the place of one.
    fn replaced(&self) -> Vec<Edit> {
        let mut edits = Vec::new();
        for (index, operator) in self.parent.chain.iter().enumerate() {
            let others = match operator.kind {
                Kind::Play | Kind::Travel | Kind::Direction => self.candidates.memories(),
                Kind::Curve(_) | Kind::Times => self.candidates.curves(),
                _ => continue,
            };
            let with = |other: Operator| {
                let mut structure = self.parent.clone();
                structure.chain[index] = other;
                structure
            };
            let others = others.into_iter().filter(|starts| starts.iter().all(|other| other.kind != operator.kind));
            edits.extend(others.map(|starts| starts.into_iter().map(with).collect()));
        }
        edits
    }

    fn in_parallel(&self) -> Vec<Edit> {
        let sum = self.parent.sum_at();
        if self.parent.chain.get(sum).is_none_or(|of| of.chains.len() >= MOST_BRANCHES) {
            return Vec::new();
        }
        let alone = |operators: Vec<Operator>| operators.into_iter().map(|operator| vec![operator]).collect();
        let lags = self.candidates.at_times(Kind::Lag, 7.0, &[]);
        let behind = |first: &Operator| lags.iter().map(|lag| vec![first.clone(), lag.clone()]).collect::<Vec<_>>();
        let full_v = self.scale.full_v;
        let dead_bands =
            [0.15, 0.4].map(|part| self.candidates.operator(Kind::Curve(Curve::DeadBand), &[part * full_v]));
        let play = |part: f64| vec![self.candidates.operator(Kind::Play, &[part * full_v, 1.0])];
        let travel = |part: f64| vec![self.candidates.operator(Kind::Travel, &[part * full_v, 1.0])];
        let chains: Vec<Vec<Vec<Operator>>> = vec![
            alone(lags.clone()),
            alone(self.candidates.seconds()),
            alone(self.candidates.each(Kind::Creep, &[&[0.0], &[0.3]])),
            dead_bands.iter().flat_map(behind).collect(),
            behind(&self.candidates.operator(Kind::Curve(Curve::Even), &[1.0])),
            [0.02, 0.06, 0.2].map(play).into(),
            [0.03, 0.1, 0.3].map(travel).into(),
        ];
        let with = |chain: Vec<Operator>| {
            let mut structure = self.parent.clone();
            structure.chain[sum].chains.push(chain);
            structure.chain[sum].point.push(SMALL);
            structure
        };
        chains.into_iter().map(|starts| starts.into_iter().map(with).collect()).collect()
    }

    fn within_branches(&self) -> Vec<Edit> {
        let sum = self.parent.sum_at();
        let Some(operator) = self.parent.chain.get(sum) else { return Vec::new() };
        let mut edits = Vec::new();
        for (branch, chain) in operator.chains.iter().enumerate() {
            let replaced = |chain: Vec<Operator>| {
                let mut structure = self.parent.clone();
                structure.chain[sum].chains[branch] = chain;
                structure
            };
            for (index, operator) in chain.iter().enumerate() {
                if operator.kind != Kind::Lag {
                    continue;
                }
                let tau_s = operator.parameters(self.scale)[0];
                for by in [By::Direction, By::State, By::Input, By::Distance] {
                    let with = |a: f64| {
                        let mut chain = chain.clone();
                        chain[index] = self.candidates.operator(Kind::Varying(by), &[tau_s, a]);
                        replaced(chain)
                    };
                    edits.push(vec![with(0.3), with(-0.3)]);
                }
            }
            if operator.chains.len() > 1 && chain.iter().all(|of| !matches!(of.kind, Kind::Curve(_))) {
                for curve in [Curve::Square, Curve::Cube] {
                    let first = self.candidates.operator(Kind::Curve(curve), &[SMALL]);
                    edits.push(vec![replaced([&[first][..], chain].concat())]);
                }
            }
        }
        edits
    }

    fn terms(&self, parent: &Fitted, problem: &Problem) -> Vec<Edit> {
        if self.parent.terms.len() >= MOST_TERMS {
            return Vec::new();
        }
        let with = |term: Term| {
            let mut structure = self.parent.clone();
            structure.terms.push(term);
            structure
        };
        let ones = vec![1.0; parent.residual.len()];
        let sines = self.frequencies(&parent.residual, problem).into_iter().map(|of| with(Term::Sine(of.ln())));
        vec![sines.collect(), vec![with(Term::Ramp)], vec![with(Term::Step(step_at(&parent.residual, &ones, problem)))]]
    }
}

/// Returns the time since the first row from which a step of `values` relative to `squares` explains most, in s.
fn step_at(values: &[f64], squares: &[f64], problem: &Problem) -> f64 {
    let (mut sum, mut power): (f64, f64) = (values.iter().sum(), squares.iter().sum());
    let (all, whole) = (sum, power.max(f64::MIN_POSITIVE));
    let mut best = (0.0, 0);
    for row in 0..values.len() {
        // Explained by a step from this row on, beside a constant.
        let part = (power / whole).clamp(0.0, 1.0);
        let explained = (sum - part * all).powi(2) / (part * (1.0 - part) * whole);
        if part > 0.02 && part < 0.98 && explained > best.0 {
            best = (explained, row);
        }
        sum -= values[row];
        power -= squares[row];
    }
    problem.data.time_s[best.1] - problem.data.time_s[0]
}
