//! A fitted linear model in the terms of a spring: static gain, zero, instantaneous share, time constants, oscillations.
//!
//! A section with two real poles `1/T1` and `1/T2` is a sum of two lags by partial fractions; of a complex pair, frequency and
//! damping ratio stay.

use std::f64::consts::TAU;

use crate::linear::{Fit, Problem, Section};

/// The quantities of a model, in the units of the record; shares and weights are parts of the static gain.
#[derive(Clone, Debug, PartialEq)]
pub(super) struct Canonical {
    pub(super) gain: f64,
    pub(super) share: f64,
    pub(super) delay: f64,
    /// Time constants with their weights, in the order of the sections.
    pub(super) lags: Vec<(f64, f64)>,
    /// Frequencies in cycles per unit of time, damping ratios, weights, and weights of the rate of change.
    pub(super) oscillations: Vec<[f64; 4]>,
    /// Zero of each record.
    pub(super) zeros: Vec<f64>,
    /// Deviation of each record's first reading from the settled one.
    pub(super) starts: Vec<f64>,
}

impl Canonical {
    pub(super) fn of(problem: &Problem, fit: &Fit) -> Self {
        let gain = fit.gain();
        let (mut lags, mut oscillations) = (Vec::new(), Vec::new());
        for (section, [w, v]) in fit.numerators() {
            match section {
                Section::First { tau } => lags.push((tau, w / gain)),
                Section::Second { frequency, damping } => match section.apart()[..] {
                    [Section::First { tau: slow }, Section::First { tau: fast }] => {
                        let weight = |tau: f64, other: f64| (w - v / (frequency * tau)) * tau / (tau - other) / gain;
                        lags.extend([(slow, weight(slow, fast)), (fast, weight(fast, slow))]);
                    }
                    // Two nearly equal lags in series are an oscillation with a damping ratio of about 1.
                    _ => oscillations.push([frequency / TAU, damping, w / gain, v / gain]),
                },
            }
        }
        let records = 0..problem.series.len();
        Self {
            gain,
            share: fit.instantaneous() / gain,
            delay: fit.poles.delay,
            lags,
            oscillations,
            zeros: records.clone().map(|record| problem.zero(fit, record)).collect(),
            starts: records.map(|record| fit.start(record)).collect(),
        }
    }

    /// All quantities in one order, for differences; `None` if another model has other numbers of lags and oscillations.
    pub(super) fn values(&self, like: &Self) -> Option<Vec<f64>> {
        let same = self.lags.len() == like.lags.len() && self.oscillations.len() == like.oscillations.len();
        same.then(|| {
            let lags = self.lags.iter().flat_map(|&(tau, weight)| [tau, weight]);
            let oscillations = self.oscillations.iter().flatten().copied();
            let records = self.zeros.iter().chain(&self.starts).copied();
            [self.gain, self.share, self.delay].into_iter().chain(lags).chain(oscillations).chain(records).collect()
        })
    }
}
