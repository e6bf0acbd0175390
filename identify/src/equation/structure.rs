//! The structure of an equation: a chain of operators from the voltage, and terms that follow the clock.
//!
//! ```text
//! reading(t) = zero + chain(voltage) + terms(t)
//! ```
//!
//! A sum at the end of the chain has linear weights, which a fit solves for; all other numbers are coordinates that it moves.

use crate::equation::clock::Term;
use crate::equation::kind::Kind;
use crate::equation::operator::{Coordinate, Operator};
use crate::equation::scale::Scale;

/// The structure of an equation with the values of its coordinates.
#[derive(Clone, Debug, PartialEq)]
pub struct Structure {
    /// Operators from the voltage to the reading, in their order.
    pub chain: Vec<Operator>,
    /// Terms that are added.
    pub terms: Vec<Term>,
}

/// Where a coordinate is, which decides what a change of it changes.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Place {
    /// In the operator of this index in the chain, so that everything behind it changes.
    Chain(usize),
    /// In the branch of this index of the last sum.
    Branch(usize),
    /// In the term of this index.
    Term(usize),
}

impl Structure {
    /// Returns true if the chain ends in a sum, whose weights are linear coefficients.
    pub fn is_linear_at_end(&self) -> bool {
        self.chain.last().is_some_and(|last| last.kind == Kind::Parallel)
    }

    /// Returns the sum at the end of the chain, if it ends in one.
    pub fn last_sum(&self) -> Option<&Operator> {
        self.chain.last().filter(|last| last.kind == Kind::Parallel)
    }

    /// Returns the index of the first sum in the chain.
    pub fn sum_at(&self) -> usize {
        self.chain.iter().position(|operator| operator.kind == Kind::Parallel).unwrap_or(self.chain.len())
    }

    /// Calls `visit` for every number that is no linear coefficient, with its place and its coordinate.
    pub fn visit(&mut self, scale: &Scale, mut visit: impl FnMut(Place, &mut f64, &Coordinate)) {
        let linear = self.is_linear_at_end();
        let last = self.chain.len().saturating_sub(1);
        for (index, operator) in self.chain.iter_mut().enumerate() {
            if linear && index == last {
                for (branch, chain) in operator.chains.iter_mut().enumerate() {
                    chain.iter_mut().for_each(|operator| within(operator, Place::Branch(branch), scale, &mut visit));
                }
            } else {
                within(operator, Place::Chain(index), scale, &mut visit);
            }
        }
        for (index, term) in self.terms.iter_mut().enumerate() {
            if let Term::Sine(log) = term {
                visit(Place::Term(index), log, &Self::of_sine(scale));
            }
        }
    }

    /// Returns the coordinate of a term's frequency.
    fn of_sine(scale: &Scale) -> Coordinate {
        Operator { kind: Kind::Second, point: vec![0.0; 2], chains: Vec::new() }.coordinates(scale)[0]
    }

    /// Returns places, values and coordinates in the order of [`Structure::visit`].
    pub fn coordinates(&self, scale: &Scale) -> Vec<(Place, f64, Coordinate)> {
        let mut all = Vec::new();
        self.clone().visit(scale, |place, value, coordinate| all.push((place, *value, *coordinate)));
        all
    }

    /// Replaces the values by others in the order of [`Structure::visit`], within their bounds.
    pub fn set(&mut self, scale: &Scale, values: &[f64]) {
        let mut values = values.iter();
        self.visit(scale, |_, value, coordinate| {
            let new = values.next().copied().unwrap_or(*value);
            *value = new.clamp(coordinate.lowest, coordinate.highest);
        });
    }

    /// Returns the number of linear coefficients: the zero, the weights of the last sum, the amplitudes of the terms.
    pub fn linear(&self) -> usize {
        let weights = self.last_sum().map_or(0, |last| last.chains.len());
        1 + weights + self.terms.iter().map(Term::amplitudes).sum::<usize>()
    }

    /// Returns the number of parameters, linear coefficients and times of steps included.
    pub fn parameters(&self, scale: &Scale) -> usize {
        let steps = self.terms.iter().filter(|term| matches!(term, Term::Step(_))).count();
        self.linear() + steps + self.coordinates(scale).len()
    }

    /// Returns the number of parameters for the price, in which a frequency or a time of a step that was found among as many as there
    /// are rows counts as two further ones.
    pub fn priced(&self, scale: &Scale) -> usize {
        let in_chain = self.chain.iter().filter(|of| matches!(of.kind, Kind::Swing | Kind::Step)).count();
        let in_terms = self.terms.iter().filter(|term| !matches!(term, Term::Ramp)).count();
        self.parameters(scale) + 2 * (in_chain + in_terms)
    }

    /// Returns the codes of what the equation has beyond a feedthrough and one lag, each once. A lag outside of sums is a
    /// `series-lag`, each but the first in a sum a `further-lag`.
    pub fn blocks(&self) -> Vec<&'static str> {
        let mut blocks = Vec::new();
        for operator in &self.chain {
            match operator.kind {
                Kind::Parallel => {
                    let alone = |chain: &&Vec<Operator>| matches!(chain.as_slice(), [one] if one.kind == Kind::Lag);
                    if operator.chains.iter().filter(alone).count() > 1 {
                        blocks.push("further-lag");
                    }
                    let inside = operator.chains.iter().flatten().map(|inner| inner.kind.code());
                    blocks.extend(inside.filter(|code| *code != "lag"));
                }
                Kind::Lag => blocks.push("series-lag"),
                kind => blocks.push(kind.code()),
            }
        }
        blocks.extend(self.terms.iter().map(|term| match term {
            Term::Sine(_) => "sine",
            Term::Ramp => "ramp",
            Term::Step(_) => "step",
        }));
        blocks.sort_unstable();
        blocks.dedup();
        blocks
    }

    /// Returns the time constants of all lags, in s.
    pub fn taus(&self, scale: &Scale) -> Vec<f64> {
        fn of(operator: &Operator, scale: &Scale, taus: &mut Vec<f64>) {
            if matches!(operator.kind, Kind::Lag | Kind::Varying(_)) {
                taus.push(operator.parameters(scale)[0]);
            }
            operator.chains.iter().flatten().for_each(|inner| of(inner, scale, taus));
        }
        let mut taus = Vec::new();
        self.chain.iter().for_each(|operator| of(operator, scale, &mut taus));
        taus
    }
}

fn within(operator: &mut Operator, place: Place, scale: &Scale, visit: &mut impl FnMut(Place, &mut f64, &Coordinate)) {
    let coordinates = operator.coordinates(scale);
    for (value, coordinate) in operator.point.iter_mut().zip(&coordinates) {
        visit(place, value, coordinate);
    }
    operator.chains.iter_mut().flatten().for_each(|inner| within(inner, place, scale, visit));
}
