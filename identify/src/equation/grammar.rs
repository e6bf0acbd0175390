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
//! | take out | each operator, branch or term |

use std::f64::consts::TAU;

use crate::equation::clock::Term;
use crate::equation::curve::Curve;
use crate::equation::lag::By;
use crate::equation::operator::{Kind, Operator};
use crate::equation::problem::{Fitted, Problem};
use crate::equation::scale::Scale;
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
/// Small weight from which a fit finds sign and size of a product.
const SMALL: f64 = 0.05;

/// One edit: the same structure at several values.
pub(super) type Edit = Vec<Structure>;

/// Returns all edits of a fitted equation.
pub(super) fn edits(parent: &Fitted, problem: &Problem) -> Vec<Edit> {
    let grammar = Grammar { scale: &problem.scale, parent: weighted(parent) };
    let mut edits = grammar.in_series(parent, problem);
    edits.extend(grammar.in_parallel());
    edits.extend(grammar.within_branches());
    edits.extend(grammar.terms(parent, problem));
    edits.extend(grammar.taken_out().into_iter().map(|smaller| vec![smaller]));
    edits
}

/// Returns the structures that lack one part of a fitted equation.
pub(super) fn taken_out(parent: &Fitted, problem: &Problem) -> Vec<Structure> {
    Grammar { scale: &problem.scale, parent: weighted(parent) }.taken_out()
}

/// Returns the structure with the fitted weights of its last sum.
pub(super) fn weighted(fit: &Fitted) -> Structure {
    let mut structure = fit.structure.clone();
    if structure.is_linear_at_end()
        && let Some(sum) = structure.chain.last_mut()
    {
        let count = sum.point.len();
        sum.point.copy_from_slice(&fit.coefficients[1..=count]);
    }
    structure
}

struct Grammar<'s> {
    scale: &'s Scale,
    parent: Structure,
}

impl Grammar<'_> {
    fn operator(&self, kind: Kind, parameters: &[f64]) -> Operator {
        Operator::new(kind, parameters, self.scale)
    }

    fn each(&self, kind: Kind, starts: &[&[f64]]) -> Vec<Operator> {
        starts.iter().map(|parameters| self.operator(kind, parameters)).collect()
    }

    fn at_times(&self, kind: Kind, count: f64, then: &[f64]) -> Vec<Operator> {
        let times = self.scale.times(2.0 * self.scale.sample_s, 0.7 * self.scale.duration_s, count);
        times.into_iter().map(|time| self.operator(kind, &[&[time], then].concat())).collect()
    }

    /// Second orders: underdamped ones over the range of frequencies, and overdamped ones.
    fn seconds(&self) -> Vec<Operator> {
        let times = self.scale.times(self.scale.sample_s, 0.1 * self.scale.duration_s, 6.0);
        let of = |time: f64| [0.1, 0.7, 1.5].map(|zeta| self.operator(Kind::Second, &[1.0 / (TAU * time), zeta]));
        times.into_iter().flat_map(of).collect()
    }

    fn curves(&self) -> Vec<Vec<Operator>> {
        let full_v = self.scale.full_v;
        let parts = |parts: &[f64]| parts.iter().map(|part| vec![part * full_v]).collect::<Vec<_>>();
        let starts = |curve| match curve {
            Curve::Square | Curve::Cube => vec![vec![0.2], vec![-0.2]],
            Curve::Even => vec![vec![SMALL], vec![1.0]],
            Curve::Power => vec![vec![0.9], vec![1.1]],
            Curve::Tanh => vec![vec![0.5], vec![1.0]],
            Curve::Limit => parts(&[0.6, 0.8, 0.9]),
            Curve::Floor => parts(&[0.05, 0.15, 0.3]),
            Curve::DeadBand => parts(&[0.02, 0.06, 0.15]),
        };
        let all = |curve| starts(curve).iter().map(|start| self.operator(Kind::Curve(curve), start)).collect();
        Curve::ALL.map(all).into()
    }

    fn memories(&self) -> Vec<Vec<Operator>> {
        let full_v = self.scale.full_v;
        let radii = [0.01, 0.03, 0.08, 0.2].map(|part| part * full_v);
        let play = radii.iter().flat_map(|&radius| [0.4, 1.0].map(|part| self.operator(Kind::Play, &[radius, part])));
        let distances = [0.03, 0.1, 0.3, 1.0].map(|part| part * full_v);
        let travel = distances.iter().map(|&distance| self.operator(Kind::Travel, &[distance, 0.2]));
        vec![play.collect(), travel.collect(), self.each(Kind::Direction, &[&[0.02]])]
    }

    fn products(&self) -> Vec<Vec<Operator>> {
        let squared = self.operator(Kind::Curve(Curve::Even), &[1.0]);
        let times = |before: &[Operator]| {
            let of = |lag: Operator| [SMALL, -SMALL].map(|a| Operator::times(a, [before, &[lag.clone()]].concat()));
            self.at_times(Kind::Lag, 4.0, &[]).into_iter().flat_map(of).collect()
        };
        vec![times(&[]), times(&[squared])]
    }

    fn slews(&self) -> Vec<Operator> {
        let of = |rows: f64| self.operator(Kind::Slew, &[self.scale.full_v / (rows * self.scale.sample_s)]);
        [2.0, 6.0, 20.0, 60.0, 200.0].map(of).into()
    }

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
            self.operator(Kind::Swing, &[freq_hz, part(f64::cos), part(f64::sin)])
        };
        vec![
            self.frequencies(&of_residual, problem).into_iter().map(swing).collect(),
            self.each(Kind::Grow, &[&[SMALL]]),
            vec![self.operator(Kind::Step, &[step_at(&of_residual, &squares, problem), SMALL])],
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
            for starts in [self.at_times(Kind::Lag, 5.0, &[]), self.seconds(), self.delays(), self.slews()] {
                edits.push(self.inserted(sum, starts));
            }
            for starts in [self.curves(), self.memories(), self.products()].concat() {
                // Curves and memories in front of other operators differ from those behind them.
                for at in if sum > 0 { vec![0, sum] } else { vec![0] } {
                    edits.push(self.inserted(at, starts.clone()));
                }
            }
        }
        let end = self.parent.chain.len();
        if end - sum <= MOST_IN_SERIES {
            let behind = [vec![self.slews()], self.curves(), self.memories(), self.products()].concat();
            let behind = behind.into_iter().chain(self.gains(parent, problem));
            let behind: Vec<_> = behind.collect();
            edits.extend(behind.into_iter().map(|starts| self.inserted(end, starts)));
            let by_direction = [0.7, -0.7].map(|a| self.at_times(Kind::Varying(By::Direction), 4.0, &[a]));
            edits.push(self.inserted(end, by_direction.concat()));
            if end > sum + 1 {
                edits.push(self.inserted(end, self.at_times(Kind::Lag, 5.0, &[])));
            }
        }
        edits
    }

    fn delays(&self) -> Vec<Operator> {
        [0.5, 1.5, 4.0, 10.0].map(|rows| self.operator(Kind::Delay, &[rows * self.scale.sample_s])).into()
    }

    fn in_parallel(&self) -> Vec<Edit> {
        let sum = self.parent.sum_at();
        if self.parent.chain.get(sum).is_none_or(|of| of.chains.len() >= MOST_BRANCHES) {
            return Vec::new();
        }
        let alone = |operators: Vec<Operator>| operators.into_iter().map(|operator| vec![operator]).collect();
        let lags = self.at_times(Kind::Lag, 7.0, &[]);
        let behind = |first: &Operator| lags.iter().map(|lag| vec![first.clone(), lag.clone()]).collect::<Vec<_>>();
        let full_v = self.scale.full_v;
        let dead_bands = [0.15, 0.4].map(|part| self.operator(Kind::Curve(Curve::DeadBand), &[part * full_v]));
        let play = |part: f64| vec![self.operator(Kind::Play, &[part * full_v, 1.0])];
        let travel = |part: f64| vec![self.operator(Kind::Travel, &[part * full_v, 1.0])];
        let chains: Vec<Vec<Vec<Operator>>> = vec![
            alone(lags.clone()),
            alone(self.seconds()),
            alone(self.each(Kind::Creep, &[&[0.0], &[0.3]])),
            dead_bands.iter().flat_map(behind).collect(),
            behind(&self.operator(Kind::Curve(Curve::Even), &[1.0])),
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
                        chain[index] = self.operator(Kind::Varying(by), &[tau_s, a]);
                        replaced(chain)
                    };
                    edits.push(vec![with(0.3), with(-0.3)]);
                }
            }
            if operator.chains.len() > 1 && chain.iter().all(|of| !matches!(of.kind, Kind::Curve(_))) {
                for curve in [Curve::Square, Curve::Cube] {
                    let first = self.operator(Kind::Curve(curve), &[SMALL]);
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
        vec![
            sines.collect(),
            vec![with(Term::Ramp)],
            vec![with(Term::Step(step_at(&parent.residual, &ones, problem)))],
        ]
    }

    /// Structures that lack one part.
    fn taken_out(&self) -> Vec<Structure> {
        let mut smaller = Vec::new();
        for (index, operator) in self.parent.chain.iter().enumerate() {
            if operator.kind != Kind::Parallel {
                let mut structure = self.parent.clone();
                structure.chain.remove(index);
                smaller.push(structure);
                continue;
            }
            for branch in 0..operator.chains.len() {
                if operator.chains.len() > 1 {
                    let mut structure = self.parent.clone();
                    structure.chain[index].chains.remove(branch);
                    structure.chain[index].point.remove(branch);
                    smaller.push(structure);
                }
                for (inner, of) in operator.chains[branch].iter().enumerate() {
                    let mut structure = self.parent.clone();
                    match of.kind {
                        Kind::Varying(_) => {
                            let tau_s = of.parameters(self.scale)[0];
                            structure.chain[index].chains[branch][inner] = self.operator(Kind::Lag, &[tau_s]);
                        }
                        Kind::Curve(_) => drop(structure.chain[index].chains[branch].remove(inner)),
                        _ => continue,
                    }
                    smaller.push(structure);
                }
            }
        }
        for term in 0..self.parent.terms.len() {
            let mut structure = self.parent.clone();
            structure.terms.remove(term);
            smaller.push(structure);
        }
        smaller
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
