//! Properties of the readings that need no model: quantisation, bounds of the sensor, and the scale of their noise.
//!
//! Continuous noise does not give the same number twice. Readings that are all multiples of one step were therefore
//! rounded to it, and readings that accumulate exactly at an extreme stopped there.

use std::borrow::Cow;
use std::sync::Arc;

use crate::dimension::Dimension;
use crate::record::data::Data;
use crate::record::heteroscedasticity;
use crate::record::quantisation_grid::QuantisationGrid;
use crate::record::scales::Scales;
use crate::stats::median::robust_deviation;
use crate::stats::scale::second_differences;
use crate::stats::thresholds::empirical::{
    BOUND_TO_NEXT_STEP, CLOSE_TO_BOUND, COARSE, FEWEST_TIES, FINEST_V, LEAST_TRUNCATION,
};

/// What one reading says about the true value.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Kind {
    /// The reading is the true value with noise.
    Exact,
    /// The reading stopped at the upper bound; the true value is at least that (right-censored).
    AtLeast,
    /// The reading stopped at the lower bound; the true value is at most that (left-censored).
    AtMost,
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
        let mut sorted = data.reading.clone();
        sorted.sort_by(f64::total_cmp);
        let mut counts: Vec<(f64, usize)> = Vec::new();
        for value in sorted {
            match counts.last_mut() {
                Some((last, count)) if *last == value => *count += 1,
                _ => counts.push((value, 1)),
            }
        }
        let distinct: Vec<f64> = counts.iter().map(|&(value, _)| value).collect();
        let grid = match distinct.len() {
            0..=5 => None,
            many => printed_grid(&distinct[1..many - 1], data.scales()),
        };
        let ties = counts.iter().filter(|(_, count)| *count > 1).count();
        let continuous = ties <= counts.len() / 50 + 2;
        let most_repeated = counts.iter().skip(1).rev().skip(1).map(|(_, count)| *count).max().unwrap_or(1);
        let scatter_v = scatter(&data.reading).max(FINEST_V.get());
        let far = CLOSE_TO_BOUND.get() * scatter_v;
        let bound = |extreme: Option<&(f64, usize)>, next: Option<&(f64, usize)>| {
            let (value, count) = *extreme?;
            // On a grid the next step is a fair judge; without one, any reading that is often the same.
            let compared = if grid.is_some() { next.map_or(1, |next| next.1) } else { most_repeated };
            let piled = count >= FEWEST_TIES.count() && (continuous || count >= BOUND_TO_NEXT_STEP.count() * compared);
            // A spring at rest reads exactly zero many times.
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
        let sign = data.scales().reading.signum();
        let mut observed = Self { kinds, grid, upper, lower, scatter_v, truncation_v: 0.0, sign, weights: None };
        // Rounding makes the scale constant.
        if observed.step_beyond(COARSE.get()).is_none() {
            observed.weights = heteroscedasticity::weights(data, |row| observed.kinds[row] == Kind::Exact);
        }
        observed
    }

    /// Joins the properties of several records. A grid or a bound is one of the sensor if all records have it; the weights follow
    /// from the noise of each record.
    fn joined(records: &[Self]) -> Self {
        let scales: Vec<f64> = records.iter().map(|record| record.scatter_v).collect();
        let rows: usize = records.iter().map(|record| record.kinds.len()).sum();
        let of_rows = |record: &Self| record.kinds.len() as f64 * record.scatter_v.ln();
        let scatter_v = (records.iter().map(of_rows).sum::<f64>() / rows as f64).exp();
        let weights = records.iter().zip(&scales).flat_map(|(record, scale)| {
            let own = record.weights.clone();
            let weight = move |row: usize| own.as_ref().map_or(1.0, |own| own[row]) * scatter_v / scale;
            (0..record.kinds.len()).map(weight)
        });
        let weights: Arc<[f64]> = weights.collect();
        let common = |of: fn(&Self) -> Option<f64>| {
            of(&records[0]).filter(|_| records.iter().all(|record| of(record) == of(&records[0])))
        };
        let step = common(|record| record.grid.map(|grid| grid.step));
        Self {
            kinds: records.iter().flat_map(|record| record.kinds.iter().copied()).collect(),
            grid: records[0].grid.filter(|_| step.is_some()),
            upper: common(|record| record.upper),
            lower: common(|record| record.lower),
            scatter_v,
            truncation_v: 0.0,
            sign: records[0].sign,
            weights: weights.iter().any(|weight| (weight - 1.0).abs() > 1e-9).then_some(weights),
        }
    }

    /// Returns the same without bounds; a spring that settles at its highest voltage also repeats one reading.
    pub fn without_bounds(&self) -> Self {
        Self { kinds: vec![Kind::Exact; self.kinds.len()], upper: None, lower: None, ..self.clone() }
    }

    /// Returns the properties of a subset of the rows, with bounds and truncation as concluded from all rows.
    pub fn with_conclusions_of(self, all: &Self) -> Self {
        let bounded = if all.all_exact() { self.without_bounds() } else { self };
        Self { truncation_v: all.truncation_v, ..bounded }
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

    /// Returns the smallest error of each row that explains its reading, in V: 0 for a reading at a bound when the
    /// prediction is beyond it.
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

    /// Returns the values of the rows that did not stop at a bound.
    pub fn uncensored<'v>(&self, values: &'v [f64]) -> Cow<'v, [f64]> {
        if self.all_exact() {
            return Cow::Borrowed(values);
        }
        values.iter().zip(&self.kinds).filter(|(_, kind)| **kind == Kind::Exact).map(|(value, _)| *value).collect()
    }

    /// Returns true if no reading stopped at a bound.
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

/// Returns true if at least half of the readings with this value have a neighbour within `far`, in V; isolated error
/// codes have none.
fn stays(reading: &[f64], value: f64, far: f64) -> bool {
    let near = |row: Option<&f64>| row.is_some_and(|other| (other - value).abs() <= far);
    let rows = || (0..reading.len()).filter(|&row| reading[row] == value);
    let staying = rows().filter(|&row| near(reading.get(row + 1)) || near(reading.get(row.wrapping_sub(1)))).count();
    2 * staying >= rows().count()
}

/// Returns the scale of independent noise, in V; 0 if most readings repeat.
fn scatter(reading: &[f64]) -> f64 {
    robust_deviation(second_differences(reading)).unwrap_or(f64::INFINITY)
}

#[cfg(test)]
mod tests {
    use simulation::record::{Record, Row};

    use super::*;
    use crate::record::input::Input;
    use crate::stats::scale::normals;

    /// Upper bound of readings of a stair of 0 to 400 V in 1200 rows with noise of 1 V, as a sensor takes them.
    fn upper(seed: usize, sensor: impl Fn(Vec<f64>) -> Vec<f64>) -> Option<f64> {
        let volts = |row: usize| 100.0 * (row / 120 % 5) as f64;
        let noisy = normals(1200 * (seed + 1))[1200 * seed..]
            .iter()
            .enumerate()
            .map(|(row, noise)| volts(row) + noise)
            .collect();
        let row =
            |(row, reading)| Row { line: row, time_s: row as f64, voltage_v: volts(row), measured: Some(reading) };
        let record = Record { name: String::new(), rows: sensor(noisy).into_iter().enumerate().map(row).collect() };
        Observed::new(&Data::new(&record, Input::Hold)).upper
    }

    #[test]
    fn readings_that_accumulate_at_the_extreme_alone_are_a_bound() {
        let stopped = |read: Vec<f64>| read.into_iter().map(|reading| reading.min(350.0)).collect();
        assert_eq!(upper(0, stopped), Some(350.0));
        assert_eq!(upper(0, |read| read), None);
        // A median of some readings is often the same reading as the one before, at the extreme as well.
        let median = |length: usize, read: Vec<f64>| {
            let of = |rows: &[f64]| {
                let mut rows = rows.to_vec();
                rows.sort_by(f64::total_cmp);
                rows[rows.len() / 2]
            };
            (0..read.len()).map(|row| of(&read[(row + 1).saturating_sub(length)..=row])).collect::<Vec<_>>()
        };
        for (seed, length) in (0..20).flat_map(|seed| [9, 17, 25].map(|length| (seed, length))) {
            assert_eq!(upper(seed, |read| median(length, read)), None, "{seed}, {length}");
        }
        assert_eq!(upper(0, |read| stopped(median(15, read))), Some(350.0));
        // A counter of periods has steps that grow with the reading, and two codes for the highest level, one of them seldom.
        let counted =
            |read: Vec<f64>| read.into_iter().map(|y| 30_199.0 / (30_199.0 / (y + 200.0)).round() - 200.0).collect();
        assert_eq!(upper(0, counted), None);
    }
}
