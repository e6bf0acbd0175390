//! The operators that an edit may insert, each at several parameters from which a fit may start.

use std::f64::consts::TAU;

use crate::equation::curve::Curve;
use crate::equation::kind::Kind;
use crate::equation::operator::Operator;
use crate::equation::scale::Scale;

/// Small weight from which a fit finds sign and size.
pub(super) const SMALL: f64 = 0.05;

/// Operators for a record with the given scales.
pub(super) struct Candidates<'s>(pub(super) &'s Scale);

impl Candidates<'_> {
    /// Returns an operator at parameters.
    pub(super) fn operator(&self, kind: Kind, parameters: &[f64]) -> Operator {
        Operator::new(kind, parameters, self.0)
    }

    /// Returns one operator at several parameters.
    pub(super) fn each(&self, kind: Kind, starts: &[&[f64]]) -> Vec<Operator> {
        starts.iter().map(|parameters| self.operator(kind, parameters)).collect()
    }

    /// Returns an operator at several times, from two rows to most of the record, with the same further parameters.
    pub(super) fn at_times(&self, kind: Kind, count: f64, then: &[f64]) -> Vec<Operator> {
        let times = self.0.times(2.0 * self.0.sample_s, 0.7 * self.0.duration_s, count);
        times.into_iter().map(|time| self.operator(kind, &[&[time], then].concat())).collect()
    }

    /// Second orders: underdamped ones over the range of frequencies, and overdamped ones.
    pub(super) fn seconds(&self) -> Vec<Operator> {
        let times = self.0.times(self.0.sample_s, 0.1 * self.0.duration_s, 6.0);
        let of = |time: f64| [0.1, 0.7, 1.5].map(|zeta| self.operator(Kind::Second, &[1.0 / (TAU * time), zeta]));
        times.into_iter().flat_map(of).collect()
    }

    /// Static curves, each at several parameters.
    pub(super) fn curves(&self) -> Vec<Vec<Operator>> {
        let full_v = self.0.full_v;
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

    /// Operators with memory, each at several parameters.
    pub(super) fn memories(&self) -> Vec<Vec<Operator>> {
        let full_v = self.0.full_v;
        let radii = [0.01, 0.03, 0.08, 0.2].map(|part| part * full_v);
        let play = radii.iter().flat_map(|&radius| [0.4, 1.0].map(|part| self.operator(Kind::Play, &[radius, part])));
        let distances = [0.03, 0.1, 0.3, 1.0].map(|part| part * full_v);
        let travel = distances.iter().map(|&distance| self.operator(Kind::Travel, &[distance, 0.2]));
        vec![play.collect(), travel.collect(), self.each(Kind::Direction, &[&[0.02]])]
    }

    /// Products with one plus a lag, of the signal and of its square.
    pub(super) fn products(&self) -> Vec<Vec<Operator>> {
        let squared = self.operator(Kind::Curve(Curve::Even), &[1.0]);
        let times = |before: &[Operator]| {
            let of = |lag: Operator| {
                [SMALL, -SMALL].map(|a| Operator::times(a, [before, std::slice::from_ref(&lag)].concat()))
            };
            self.at_times(Kind::Lag, 4.0, &[]).into_iter().flat_map(of).collect()
        };
        vec![times(&[]), times(&[squared])]
    }

    /// Bounded rates.
    pub(super) fn slews(&self) -> Vec<Operator> {
        let of = |rows: f64| self.operator(Kind::Slew, &[self.0.full_v / (rows * self.0.sample_s)]);
        [2.0, 6.0, 20.0, 60.0, 200.0].map(of).into()
    }

    /// Delays.
    pub(super) fn delays(&self) -> Vec<Operator> {
        [0.5, 1.5, 4.0, 10.0].map(|rows| self.operator(Kind::Delay, &[rows * self.0.sample_s])).into()
    }
}
