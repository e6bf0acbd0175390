//! Properties of the readings that need no model: quantisation, bounds of the sensor, and the scale of their noise.
//!
//! Continuous noise does not give the same number twice. Readings that are all multiples of one step were therefore
//! rounded to it, and readings that accumulate exactly at an extreme stopped there.

use std::borrow::Cow;
use std::sync::Arc;

use crate::dimension::Dimension;
use crate::record::bounds::{Bounds, Distinct, scatter};
use crate::record::data::Data;
use crate::record::heteroscedasticity;
use crate::record::missing_codes;
use crate::record::quantisation_grid::QuantisationGrid;
use crate::record::scales::Scales;
use crate::stats::sums::dot;
use crate::stats::thresholds::empirical::{COARSE, FINEST_V, LEAST_TRUNCATION};

/// What one reading says about the true value.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Kind {
    /// The reading is the true value with noise.
    Exact,
    /// A code next to the reading's is missing: the true value with noise less the reading is between two values, in V
    /// (interval-censored).
    Within(f64, f64),
    /// The sensor reports changes and reported none: the true value with noise is at most this far from the last reading, in V.
    Unreported(f64),
    /// The reading stopped at the upper bound; the true value is at least that (right-censored).
    AtLeast,
    /// The reading stopped at the lower bound; the true value is at most that (left-censored).
    AtMost,
}

impl Kind {
    /// The reading says nothing of the true value.
    const ANYTHING: Self = Self::Within(f64::NEG_INFINITY, f64::INFINITY);

    /// True for a reading that is known up to an interval.
    fn is_interval(&self) -> bool {
        matches!(self, Self::Within(..) | Self::Unreported(_))
    }

    /// Returns the smallest error that explains a reading with a residual, both in V.
    fn error(&self, residual: f64) -> f64 {
        match self {
            Self::Exact => residual,
            Self::Within(low, high) => (residual + low).max(0.0) + (residual + high).min(0.0),
            Self::Unreported(change) => residual - residual.clamp(-change, *change),
            Self::AtLeast => residual.max(0.0),
            Self::AtMost => residual.min(0.0),
        }
    }
}

/// What is known about the readings before any model is fitted.
#[derive(Clone, Debug)]
pub struct Observed {
    /// The kind of each row's reading.
    pub kinds: Vec<Kind>,
    /// The grid on which all readings lie, however fine; `None` if there is no common step.
    pub grid: Option<QuantisationGrid>,
    /// The upper bound at which readings stopped, in V.
    pub upper: Option<f64>,
    /// The lower bound at which readings stopped, in V.
    pub lower: Option<f64>,
    /// Scale of the noise from row to row, in V.
    pub scatter_v: f64,
    /// Mean error of truncation, in V: half a step if the converter truncates, 0 if it rounds; negative for readings that fall
    /// as the stiffness rises.
    pub truncation_v: f64,
    /// Number of codes that the converter never gives.
    pub missing_codes: usize,
    /// Sign of the reading's change with the stiffness, 1 or -1.
    pub sign: f64,
    /// The reciprocal scale of each row's noise, with a geometric mean of 1; `None` if the scale is constant.
    pub weights: Option<Arc<[f64]>>,
}

impl Observed {
    /// Examines the readings of a record, or of several, each on its own.
    pub fn new(data: &Data) -> Self {
        if data.is_joined() {
            return Self::joined(&data.parts.iter().map(|part| Self::new(&part.data)).collect::<Vec<_>>());
        }
        let unreported = |row: usize| data.unreported_v.as_ref().map_or(0.0, |changes| changes[row]);
        let reported = (0..data.rows()).filter(|&row| unreported(row) == 0.0).map(|row| data.reading[row]);
        let reading: Vec<f64> = reported.collect();
        let distinct = Distinct::of(&reading);
        let grid = distinct.between_extremes().and_then(|values| printed_grid(&values, data.scales()));
        let scatter_v = scatter(&reading).max(FINEST_V.get());
        let Bounds { upper, lower } = Bounds::of(&reading, &distinct, grid.map(|grid| grid.step), scatter_v);
        let coarse = grid.map(|grid| grid.step).filter(|step| *step >= COARSE.get() * scatter_v);
        let cells = coarse.and_then(|step| missing_codes::cells(&data.reading, &data.voltage_v, step));
        let kind = |(row, &reading): (usize, &f64)| {
            if upper == Some(reading) {
                return Kind::AtLeast;
            }
            if lower == Some(reading) {
                return Kind::AtMost;
            }
            let change = unreported(row);
            if change > 0.0 {
                return Kind::Unreported(change);
            }
            let wider = cells.as_ref().and_then(|cells| cells.wider[row]);
            wider.map_or(Kind::Exact, |(low, high)| Kind::Within(low, high))
        };
        let kinds: Vec<Kind> = data.reading.iter().enumerate().map(kind).collect();
        let missing_codes = cells.as_ref().map_or(0, |cells| cells.missing);
        let sign = data.scales().reading.signum();
        let mut observed =
            Self { kinds, grid, upper, lower, scatter_v, truncation_v: 0.0, missing_codes, sign, weights: None };
        // Rounding makes the scale constant.
        if observed.step_beyond(COARSE.get()).is_none() {
            observed.weights = heteroscedasticity::weights(data, |row| observed.is_exact(row));
        }
        observed
    }

    /// Joins the properties of several records. A grid or a bound is one of the sensor if all records have it; the weights follow
    /// from the noise of each record.
    fn joined(records: &[Self]) -> Self {
        let common = |of: fn(&Self) -> Option<f64>| {
            of(&records[0]).filter(|_| records.iter().all(|record| of(record) == of(&records[0])))
        };
        let step = common(|record| record.grid.map(|grid| grid.step));
        // Readings on a grid of their own repeat, and would look free of noise: rounding is a part of it.
        let rounding =
            |record: &Self| record.grid.filter(|_| step.is_none()).map_or(0.0, |grid| grid.step / 12f64.sqrt());
        let scales: Vec<f64> = records.iter().map(|record| record.scatter_v.max(rounding(record))).collect();
        let rows: usize = records.iter().map(|record| record.kinds.len()).sum();
        let of_rows = |(record, scale): (&Self, &f64)| record.kinds.len() as f64 * scale.ln();
        let scatter_v = (records.iter().zip(&scales).map(of_rows).sum::<f64>() / rows as f64).exp();
        let weights = records.iter().zip(&scales).flat_map(|(record, scale)| {
            let own = record.weights.clone();
            let weight = move |row: usize| own.as_ref().map_or(1.0, |own| own[row]) * scatter_v / scale;
            (0..record.kinds.len()).map(weight)
        });
        let weights: Arc<[f64]> = weights.collect();
        Self {
            kinds: records.iter().flat_map(|record| record.kinds.iter().copied()).collect(),
            grid: records[0].grid.filter(|_| step.is_some()),
            upper: common(|record| record.upper),
            lower: common(|record| record.lower),
            scatter_v,
            truncation_v: 0.0,
            missing_codes: records.iter().map(|record| record.missing_codes).max().unwrap_or(0),
            sign: records[0].sign,
            weights: weights.iter().any(|weight| (weight - 1.0).abs() > 1e-9).then_some(weights),
        }
    }

    /// Returns the same without bounds; a spring that settles at its highest voltage also repeats one reading.
    pub fn without_bounds(&self) -> Self {
        let unbounded = |kind: &Kind| match kind {
            Kind::AtLeast | Kind::AtMost => Kind::Exact,
            kind => *kind,
        };
        Self { kinds: self.kinds.iter().map(unbounded).collect(), upper: None, lower: None, ..self.clone() }
    }

    /// Returns the properties of a subset of the rows, with bounds and truncation as concluded from all rows.
    pub fn with_conclusions_of(self, all: &Self) -> Self {
        let stops = all.kinds.iter().any(|kind| matches!(kind, Kind::AtLeast | Kind::AtMost));
        let bounded = if stops { self } else { self.without_bounds() };
        Self { truncation_v: all.truncation_v, ..bounded }
    }

    /// Returns the same with nothing known of the readings for which `ignored` is true.
    pub fn ignoring(&self, ignored: &[bool]) -> Self {
        let kind = |(kind, ignored): (&Kind, &bool)| if *ignored { Kind::ANYTHING } else { *kind };
        Self { kinds: self.kinds.iter().zip(ignored).map(kind).collect(), ..self.clone() }
    }

    /// Returns the step of the grid, in V, if it is at least `times` the scale of the noise.
    pub fn step_beyond(&self, times: f64) -> Option<f64> {
        self.grid.map(|grid| grid.step).filter(|step| *step >= times * self.scatter_v)
    }

    /// Returns the same for a converter that truncates instead of rounding; `None` if the step is too small to matter.
    pub fn truncated(&self) -> Option<Self> {
        let step = self.step_beyond(LEAST_TRUNCATION.get())?;
        Some(Self { truncation_v: self.sign * step / 2.0, ..self.clone() })
    }

    /// Returns the same for a converter that reads a missing code as the one below it, or as the one above it; `None` if no code is
    /// missing.
    pub fn reading_missing_codes_as(&self, below: bool) -> Option<Self> {
        let half = 0.5 * self.grid.filter(|_| self.missing_codes > 0)?.step;
        let narrower = |kind: &Kind| match *kind {
            Kind::Within(low, high) if below => Kind::Within(low.max(-half), high),
            Kind::Within(low, high) => Kind::Within(low, high.min(half)),
            kind => kind,
        };
        Some(Self { kinds: self.kinds.iter().map(narrower).collect(), ..self.clone() })
    }

    /// Returns the number of rows whose true value is that of a missing code, given their residuals, in V.
    pub fn count_missing(&self, residual: &[f64]) -> usize {
        let half = self.grid.map_or(0.0, |grid| 0.5 * grid.step);
        let rows = residual.iter().zip(&self.kinds);
        rows.filter(|(left, kind)| matches!(kind, Kind::Within(..)) && left.abs() > half).count()
    }

    /// Returns the smallest error of each row that explains its reading, in V: 0 for a reading at a bound when the
    /// prediction is beyond it, and for one that is known up to an interval when the prediction is in it.
    pub fn errors<'r>(&self, residual: &'r [f64]) -> Cow<'r, [f64]> {
        if self.all_exact() {
            return Cow::Borrowed(residual);
        }
        residual.iter().zip(&self.kinds).map(|(&residual, kind)| kind.error(residual)).collect()
    }

    /// Returns the root mean square of the smallest errors that explain the readings, in V. Readings that are known up to an interval add
    /// their errors, but not their number: most have none, and would lower the mean of the others.
    pub fn rms(&self, residual: &[f64]) -> f64 {
        let errors = self.errors(residual);
        (dot(&errors, &errors) / (errors.len().saturating_sub(self.intervals())).max(1) as f64).sqrt()
    }

    /// Returns the number of readings that are known up to an interval.
    pub fn intervals(&self) -> usize {
        self.kinds.iter().filter(|kind| kind.is_interval()).count()
    }

    /// Returns a residual in which that of a reading which is known up to an interval is the smallest error that explains it, in V.
    pub fn outside<'r>(&self, residual: &'r [f64]) -> Cow<'r, [f64]> {
        if self.intervals() == 0 {
            return Cow::Borrowed(residual);
        }
        let rows = residual.iter().zip(&self.kinds);
        rows.map(|(&residual, kind)| if kind.is_interval() { kind.error(residual) } else { residual }).collect()
    }

    /// Returns the residuals of the readings that are not known up to an interval only, in V; all of them if no reading is.
    pub fn known<'r>(&self, residual: &'r [f64]) -> Cow<'r, [f64]> {
        if self.intervals() == 0 {
            return Cow::Borrowed(residual);
        }
        let known = residual.iter().zip(&self.kinds).filter(|(_, kind)| !kind.is_interval());
        known.map(|(error, _)| *error).collect()
    }

    /// Returns the values of the rows whose readings are known but for noise and rounding.
    pub fn uncensored<'v>(&self, values: &'v [f64]) -> Cow<'v, [f64]> {
        if self.all_exact() {
            return Cow::Borrowed(values);
        }
        values.iter().zip(&self.kinds).filter(|(_, kind)| **kind == Kind::Exact).map(|(value, _)| *value).collect()
    }

    /// Returns true if the reading of a row is the true value with noise.
    pub fn is_exact(&self, row: usize) -> bool {
        self.kinds[row] == Kind::Exact
    }

    /// Returns true if no reading stopped at a bound or is known up to an interval only.
    pub fn all_exact(&self) -> bool {
        self.kinds.iter().all(|kind| *kind == Kind::Exact)
    }
}

/// Returns the normalised grid of distinct normalised readings in ascending order. It is found in the file's numbers, whose
/// printed digits count.
fn printed_grid(values: &[f64], scales: &Scales) -> Option<QuantisationGrid> {
    let mut file: Vec<f64> = values.iter().map(|&value| scales.restored(Dimension::Reading, value)).collect();
    file.sort_by(f64::total_cmp);
    let [step, low, high] = {
        let grid = QuantisationGrid::of(&file)?;
        [grid.step, grid.low, grid.high].map(|size| size / scales.reading.abs())
    };
    Some(QuantisationGrid { step, low, high })
}
