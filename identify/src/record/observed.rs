//! What a reading says: a number, a cell of a lattice, or "at least" a bound.
//!
//! Continuous noise never gives the same number twice. So readings that all lie on one lattice were rounded to it, and
//! readings that pile up exactly at the extreme stopped there. Both are seen in the readings themselves, before any model.

use std::borrow::Cow;
use std::sync::Arc;

use crate::record::data::Data;
use crate::record::growth;
use crate::record::quantisation_grid::Lattice;
use crate::stats::median::deviation;
use crate::stats::scale::{FINEST_V, bends};

/// One row's reading.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Kind {
    /// The number that was read.
    Exact,
    /// It stopped at the upper bound.
    AtLeast,
    /// It stopped at the lower bound.
    AtMost,
}

/// What the readings say of themselves.
#[derive(Clone, Debug)]
pub struct Observed {
    /// Of each row.
    pub kinds: Vec<Kind>,
    /// The lattice that all readings lie on, however fine.
    pub lattice: Option<Lattice>,
    /// The bounds at which readings stopped, in V.
    pub upper: Option<f64>,
    /// As [`Observed::upper`], below.
    pub lower: Option<f64>,
    /// Scale of what they scatter from row to row, in V.
    pub scatter_v: f64,
    /// What readings were cut by on average, in V: half a step if their converter cuts off instead of rounding.
    pub cut_v: f64,
    /// One over each row's scale of noise, where that grows with the reading; their geometric mean is 1.
    pub weights: Option<Arc<[f64]>>,
}

/// Fewest readings at an extreme that are a bound, on a continuous scale.
const FEWEST_TIES: usize = 3;
/// A step coarser than this many of the noise's scales is a cell, a finer one is noise.
pub const COARSE: f64 = 2.0;
/// Half of a step that is this part of the noise's scale is seen in its mean.
const SEEN: f64 = 0.5;
/// A reading so many of the noise's scales from a bound is not on its way there.
const FAR: f64 = 30.0;
/// On a lattice, readings at a bound are this many times as many as on the next step.
const PILE: usize = 6;

impl Observed {
    /// Looks at the readings.
    pub fn new(data: &Data) -> Self {
        let mut sorted = data.reading.clone();
        sorted.sort_by(f64::total_cmp);
        let mut counts: Vec<(f64, usize)> = Vec::new();
        for value in sorted {
            match counts.last_mut() {
                Some((last, count)) if *last == value => *count += 1,
                _ => counts.push((value, 1)),
            }
        }
        let inner: Vec<f64> = counts.iter().map(|&(value, _)| value).collect();
        let lattice = match inner.len() {
            0..=5 => None,
            many => Lattice::of(&inner[1..many - 1]),
        };
        let ties = counts.iter().filter(|(_, count)| *count > 1).count();
        let continuous = ties <= counts.len() / 50 + 2;
        let scatter_v = scatter(&data.reading).max(FINEST_V);
        let far = FAR * scatter_v;
        let bound = |extreme: Option<&(f64, usize)>, next: Option<&(f64, usize)>| {
            let (value, count) = *extreme?;
            let piled = count >= FEWEST_TIES && (continuous || count >= PILE * next.map_or(1, |next| next.1));
            // A spring at rest reads zero again and again.
            (piled && count < data.rows() && value != 0.0 && stays(&data.reading, value, far)).then_some(value)
        };
        let moves = data.reading.first() != data.reading.last() || counts.len() > 2;
        let upper = bound(counts.last(), counts.iter().rev().nth(1)).filter(|_| moves);
        let lower = bound(counts.first(), counts.get(1)).filter(|_| moves);
        let kinds: Vec<Kind> = data
            .reading
            .iter()
            .map(|&reading| {
                if upper.is_some_and(|bound| reading >= bound) {
                    Kind::AtLeast
                } else if lower.is_some_and(|bound| reading <= bound) {
                    Kind::AtMost
                } else {
                    Kind::Exact
                }
            })
            .collect();
        let mut observed = Self { kinds, lattice, upper, lower, scatter_v, cut_v: 0.0, weights: None };
        // Steps of a lattice are even, whatever the noise.
        if observed.step_beyond(COARSE).is_none() {
            observed.weights = growth::weights(data, |row| observed.kinds[row] == Kind::Exact);
        }
        observed
    }

    /// The same where no bound is believed: a spring that settles at its highest voltage also reads the same for long.
    pub fn without_bounds(&self) -> Self {
        Self { kinds: vec![Kind::Exact; self.kinds.len()], upper: None, lower: None, ..self.clone() }
    }

    /// Of a part of the rows, with what was concluded from all of them.
    pub fn like(self, all: &Self) -> Self {
        let bounded = if all.all_exact() { self.without_bounds() } else { self };
        Self { cut_v: all.cut_v, ..bounded }
    }

    /// The step, in V, if it is at least so many times as large as what readings scatter.
    pub fn step_beyond(&self, times: f64) -> Option<f64> {
        self.lattice.map(|lattice| lattice.step).filter(|step| *step >= times * self.scatter_v)
    }

    /// The same where the converter cuts off what is less than a step; `None` where that is little.
    pub fn cut(&self) -> Option<Self> {
        let step = self.step_beyond(SEEN)?;
        Some(Self { cut_v: step / 2.0, ..self.clone() })
    }

    /// What rows are off by at least: one that stopped at a bound is not off while the prediction is beyond it.
    pub fn errors<'r>(&self, residual: &'r [f64]) -> Cow<'r, [f64]> {
        if self.all_exact() {
            return Cow::Borrowed(residual);
        }
        let error = |(&r, kind): (&f64, &Kind)| match kind {
            Kind::Exact => r,
            Kind::AtLeast => r.max(0.0),
            Kind::AtMost => r.min(0.0),
        };
        residual.iter().zip(&self.kinds).map(error).collect()
    }

    /// True if no reading stopped at a bound.
    pub fn all_exact(&self) -> bool {
        self.upper.is_none() && self.lower.is_none()
    }
}

/// True if readings come to a value and stay: of those that read it, half have another beside them, or one not far from it.
/// Codes of readings that failed stand alone.
fn stays(reading: &[f64], value: f64, far: f64) -> bool {
    let near = |row: Option<&f64>| row.is_some_and(|other| (other - value).abs() <= far);
    let rows = || (0..reading.len()).filter(|&row| reading[row] == value);
    let staying = rows().filter(|&row| near(reading.get(row + 1)) || near(reading.get(row.wrapping_sub(1)))).count();
    2 * staying >= rows().count()
}

/// Scale of independent noise on readings; none where most are the same.
fn scatter(reading: &[f64]) -> f64 {
    deviation(bends(reading)).unwrap_or(f64::INFINITY)
}
