//! The nominal model of a spring: records come in; the smallest linear model that no larger one beats by more than its noise goes
//! out, in the terms of a spring, with intervals and held-out errors, and as a plant file.
//!
//! - *Share*: part of the static gain that is instantaneous.
//! - *Weight*: part of the static gain that a time constant or an oscillation contributes.
//! - *Even*: the spring responds to the magnitude of the voltage.
//! - *Square*: it responds to the square of the voltage, as electrostatic forces do.

mod canonical;
pub mod covariance;
mod far_readings;
mod identified;
mod intervals;
mod models;
mod plant;
pub mod remarks;
pub mod report;
mod usable;
mod zero_shifts;

pub use identified::{Course, Identified};
pub use models::{BestLinear, PRICE_OF_POLE, WORTHWHILE, best_linear, is_unpredictive};

use std::borrow::Cow;

use anyhow::Result;

use simulation::bad_input;
use simulation::record::Record;
use simulation::units::Units;

use crate::linear::{LARGEST_ORDER, Problem, Series, best_up_to, fewest_readings};
use crate::nominal::identified::described;
use crate::nominal::models::Models;
use crate::nominal::plant::{VoltageRange, range};
use crate::nominal::report::{AtBound, FarReading, InputLaw, ZeroShift};
use crate::nominal::usable::check;
use crate::record::bounds::Bounds;
use crate::record::clock::with_times_of_clock;
use crate::record::held::without_held;
use crate::record::input::Input;

/// Largest held-out error under the square of a voltage of one sign, relative to that under the voltage, with which it is the law.
const MOST_OF_SQUARE: f64 = 0.5;
/// Most searches for the best model without the readings that were far from the one before.
const MOST_SEARCHES: usize = 3;

/// Identifies the spring of one or several records; each has its own zero and start. Readings that repeat the one before because no new one was taken or sent,
/// those that stopped at a bound of the sensor, and those that are far from all around them, are left out; shifts of a zero within a
/// record are fitted with the spring.
///
/// # Errors
/// [`simulation::bad_input::BadInput`] for a record with too few readings, or whose voltage or reading never changes.
pub fn identify(records: &[Record], input: Input, units: &Units) -> Result<Identified> {
    identify_asked(records, Asked { input, units, order: None })
}

/// Identifies the spring as [`identify()`] does, but with a model of the given order: the number of poles, all of which the voltage drives.
///
/// # Errors
/// Those of [`identify()`], and [`simulation::bad_input::BadInput`] for an order that is not searched, or not with so few readings.
pub fn identify_with_order(records: &[Record], order: usize, input: Input, units: &Units) -> Result<Identified> {
    if !(1..=LARGEST_ORDER).contains(&order) {
        bad_input!("order {order}: expected 1 to {LARGEST_ORDER}");
    }
    identify_asked(records, Asked { input, units, order: Some(order) })
}

/// What is asked of an identification, besides the records.
#[derive(Clone, Copy)]
struct Asked<'a> {
    input: Input,
    units: &'a Units,
    /// The number of poles, if it is not to be chosen.
    order: Option<usize>,
}

fn identify_asked(records: &[Record], asked: Asked) -> Result<Identified> {
    let units = asked.units;
    if records.is_empty() {
        bad_input!("no record; expected at least one");
    }
    for record in records {
        check(record)?;
    }
    let new = without_held(&with_times_of_clock(records)).into_owned();
    let (mut kept, stopped) = without_stopped(&new);
    let mut left_out = Vec::new();
    let far = kept.iter().map(far_readings::at_start).collect();
    leave_out(&mut kept, far, &mut left_out);
    let (mut identified, mut models) = of_all(&kept, &[], asked);
    for _ in 1..MOST_SEARCHES {
        let delay = identified.report.nominal.delay_s.value;
        let far = identified.records.iter().map(|course| far_readings::of_errors(course, delay)).collect();
        if !leave_out(&mut kept, far, &mut left_out) {
            break;
        }
        (identified, models) = of_all(&kept, &[], asked);
    }
    if let Some(order) = asked.order.filter(|order| *order >= models.fits.len()) {
        let (largest, fewest) = (models.fits.len() - 1, fewest_readings(&models.problem, models.fits.len()));
        let range = if largest == 1 { "1".to_owned() } else { format!("1 to {largest}") };
        bad_input!(
            "order {order}: expected {range}; a model of order {} is not tried with fewer than {fewest} readings",
            largest + 1
        );
    }
    let mut identified = with_zero_shifts(&kept, identified, models, asked);
    if !left_out.is_empty() {
        left_out.sort_by(|a, b| a.record.cmp(&b.record).then(a.time_s.total_cmp(&b.time_s)));
        identified.linear = None;
        identified.report.remarks.insert(0, remarks::left_out(&left_out, units));
        identified.report.left_out = left_out;
    }
    if !identified.report.zero_shifts.is_empty() {
        identified.linear = None;
        let shifts = &mut identified.report.zero_shifts;
        shifts.sort_by(|a, b| a.record.cmp(&b.record).then(a.from_s.total_cmp(&b.from_s)));
        let remark = remarks::zero_shifts(shifts, records.len() > 1, units);
        identified.report.remarks.insert(0, remark);
    }
    if !stopped.is_empty() {
        identified.linear = None;
        identified.report.remarks.insert(0, remarks::at_bounds(&stopped, units));
        identified.report.at_bound = stopped;
    }
    let readings =
        |of: &[Record]| of.iter().flat_map(|record| &record.rows).filter(|row| row.measured.is_some()).count();
    let held = readings(records) - readings(&new);
    if held > 0 {
        identified.report.remarks.insert(0, remarks::held(held));
    }
    Ok(identified)
}

/// Returns the spring of records as it is with the shifts of their zeros that the records show, from the one without any.
fn with_zero_shifts(records: &[Record], mut identified: Identified, mut models: Models, asked: Asked) -> Identified {
    let mut shifts = vec![Vec::new(); records.len()];
    // One edge of a stretch shows nothing as long as the other is missing, so that a better model is followed further.
    let mut latest: Option<(Identified, Models)> = None;
    for _ in 0..zero_shifts::MOST_SEARCHES {
        let (spring, before) = latest.as_ref().map_or((&identified, &models), |latest| (&latest.0, &latest.1));
        let delay = spring.report.nominal.delay_s.value;
        let shortest = zero_shifts::shortest_stretch(&spring.report.oscillation);
        let steps = |course| zero_shifts::steps(course, delay, shortest);
        let further: Vec<Vec<f64>> = spring.records.iter().map(steps).collect();
        if further.iter().all(Vec::is_empty) {
            break;
        }
        shifts.iter_mut().zip(further).for_each(|(known, further)| known.extend(further));
        let with = of_all(records, &shifts, asked);
        if with.1.held_out_rmse() > (1.0 - WORTHWHILE) * before.held_out_rmse() {
            break;
        }
        if zero_shifts::are_shown(&with.1, &models) {
            (identified, models) = with;
            latest = None;
        } else {
            latest = Some(with);
        }
    }
    identified
}

/// Takes the readings that stopped at a bound of the sensor out of each record, and lists them; all stay in a record that could not be
/// identified without them.
fn without_stopped(records: &[Record]) -> (Cow<'_, [Record]>, Vec<AtBound>) {
    let mut stopped = Vec::new();
    let mut kept = Cow::Borrowed(records);
    for (index, record) in records.iter().enumerate() {
        let readings: Vec<f64> = record.rows.iter().filter_map(|row| row.measured).collect();
        let bounds = Bounds::of_file(&readings);
        if bounds == Bounds::default() {
            continue;
        }
        let mut without = record.clone();
        for row in &mut without.rows {
            row.measured = row.measured.filter(|reading| !bounds.stopped(*reading));
        }
        if check(&without).is_err() {
            continue;
        }
        let limits = bounds.upper.into_iter().chain(bounds.lower);
        kept.to_mut()[index] = without;
        stopped.extend(limits.map(|limit| AtBound {
            record: record.name.clone(),
            limit,
            readings: readings.iter().filter(|reading| **reading == limit).count(),
        }));
    }
    (kept, stopped)
}

/// Takes readings out of each record, by their number among its readings, and adds them to a list. Returns false if there are none, or
/// if a record would be left that cannot be identified.
fn leave_out(records: &mut Cow<[Record]>, far: Vec<Vec<usize>>, left_out: &mut Vec<FarReading>) -> bool {
    if far.iter().all(Vec::is_empty) {
        return false;
    }
    let mut kept = records.to_vec();
    let mut taken = Vec::new();
    for (record, far) in kept.iter_mut().zip(far) {
        let mut rows: Vec<_> = record.rows.iter_mut().filter(|row| row.measured.is_some()).collect();
        for reading in far {
            let row = &mut rows[reading];
            let value = row.measured.take().expect("a row with a reading");
            taken.push(FarReading { record: record.name.clone(), time_s: row.time_s, reading: value });
        }
    }
    if kept.iter().any(|record| check(record).is_err()) {
        return false;
    }
    *records = Cow::Owned(kept);
    left_out.append(&mut taken);
    true
}

/// Identifies the spring of records that were checked, from all of their readings, with shifts of each record's zero from some times on,
/// in s; without any if there are no lists of them.
fn of_all(records: &[Record], shifts: &[Vec<f64>], asked: Asked) -> (Identified, Models) {
    let Asked { input, units, order: asked_order } = asked;
    let shifted = |(index, record): (usize, &Record)| {
        let after_first = shifts.get(index).into_iter().flatten().map(|at| at - record.rows[0].time_s);
        Series::new(record, input).shifted(after_first.collect())
    };
    let series: Vec<Series> = records.iter().enumerate().map(shifted).collect();
    let mut models = Models::of(series.clone(), InputLaw::Linear, asked_order);
    let linear = models.best();
    let both_signs = series.iter().any(Series::has_both_signs);
    if both_signs {
        let even = Models::of(series.iter().map(Series::rectified).collect(), InputLaw::Even, asked_order);
        if even.held_out_rmse() < models.held_out_rmse() {
            models = even;
        }
    }
    // A curved law is not a square one: where one sign alone cannot tell, the square has to explain most of what is left.
    let most = if both_signs { 1.0 } else { MOST_OF_SQUARE };
    let full_scale = series.iter().map(Series::full_scale).fold(0.0, f64::max);
    let squared: Vec<Series> = series.iter().map(|series| series.squared(full_scale)).collect();
    let (order, best) = models.fits.iter().enumerate().take(2).next_back().expect("a model of order 0");
    if best_up_to(&Problem::new(squared.clone()), order).last().expect("a model of order 0").cost < best.fit.cost {
        let square = Models::of(squared, InputLaw::Square, asked_order);
        if square.held_out_rmse() < most * models.held_out_rmse() {
            models = square;
        }
    }
    let voltage = VoltageRange { full_scale_v: full_scale, both_signs, range: range(records) };
    let mut identified = Identified { linear, ..described(records, &models, voltage, units) };
    let names = records.iter().zip(shifts).flat_map(|(record, shifts)| shifts.iter().map(|at| (&record.name, *at)));
    let sizes = models.problem.shift_sizes(models.best_fit());
    let shift = |((record, from_s), &by): ((&String, f64), &f64)| ZeroShift { record: record.clone(), from_s, by };
    identified.report.zero_shifts = names.zip(sizes).map(shift).collect();
    (identified, models)
}

#[cfg(test)]
mod tests;
