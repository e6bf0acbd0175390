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
mod plant;
pub mod remarks;
pub mod report;

use anyhow::Result;

use simulation::bad_input;
use simulation::plant_file::PlantFile;
use simulation::record::Record;
use simulation::units::Units;

use crate::answer::{LinearError, SCHEMA};
use crate::linear::{Fit, Poles, Problem, Series, best_of_each_order, best_up_to, held_out_residual};
use crate::nominal::canonical::Canonical;
use crate::nominal::covariance::Spectrum;
use crate::nominal::plant::VoltageRange;
use crate::nominal::report::{
    FarReading, InputLaw, Noise, Nominal, Oscillation, Quantity, Report, Start, TimeConstant,
};
use crate::record::input::Input;
use crate::stats::median::robust_deviation;
use crate::stats::scale::{root_mean_square, second_differences};
use crate::stats::segments::excess;
use crate::stats::sums::dot;
use crate::stats::thresholds::probability::{RIVAL_ODDS, Z, Z_DOUBTFUL, Z_WORSE};

/// A larger model is preferred if its held-out error is smaller by this part, ...
const WORTHWHILE: f64 = 0.005;
/// ... and its error on the last part of the records, which is an extrapolation, is at most this many times as large: beyond, it
/// does not hold at all. Below, a remark says what is lost.
const MOST_SPOILED: f64 = 10.0;
/// Gain in log-likelihood, in nats, that each further pole has to bring beyond chance, ...
const PRICE_OF_POLE: f64 = 4.0;
/// ... and that it has to bring if the last part of the records confirms it by a smaller error.
const PRICE_IF_CONFIRMED: f64 = 3.0;
/// Errors that are larger than their scatter from row to row by this factor are no noise of the sensor.
const STRUCTURED: f64 = 3.0;
/// Largest held-out error under the square of a voltage of one sign, relative to that under the voltage, with which it is the law.
const MOST_OF_SQUARE: f64 = 0.5;
/// Fewest readings of a record.
const FEWEST_READINGS: usize = 8;
/// Part of a record to which a model is fitted that predicts the rest.
const FIRST_PART: f64 = 0.6;
/// Step of a parameter for a difference quotient, in standard deviations of the parameter.
const DIFFERENCE: f64 = 1e-2;
/// Records with more readings lose a negligible part of the errors to the fit.
const LONG: usize = 20_000;
/// Steps of a refinement from a fit to similar readings, and the relative reduction of the cost below which it ends.
const REFIT: (usize, f64) = (10, 1e-5);
/// Readings times steps that such a refinement may cost.
const MOST_REFITTED: usize = 300_000;
/// Most searches for the best model without the readings that were far from the one before.
const MOST_SEARCHES: usize = 3;

/// An identified spring.
#[derive(Clone, Debug)]
pub struct Identified {
    /// The answer.
    pub report: Report,
    /// The spring as a plant file.
    pub plant: PlantFile,
    /// True if the spring was taken to be at rest when each record begins.
    pub settled: bool,
    /// The best linear model of the records, which may be of another order or law of the input; `None` if readings were left out.
    pub linear: Option<BestLinear>,
    /// The readings of each record and the model of them.
    pub records: Vec<Course>,
}

/// One record compared with the model; all vectors have one element per reading that was not left out.
#[derive(Clone, Debug)]
pub struct Course {
    /// Name of the record.
    pub name: String,
    /// Times, in s.
    pub time_s: Vec<f64>,
    /// Commanded voltages, in V.
    pub voltage_v: Vec<f64>,
    /// Readings, in their unit.
    pub reading: Vec<f64>,
    /// Reading minus model.
    pub residual: Vec<f64>,
    /// Reading minus prediction by a fit that did not use the segment.
    pub held_out: Vec<f64>,
}

/// The best models under one input law.
struct Models {
    law: InputLaw,
    problem: Problem,
    /// The best model of each order.
    fits: Vec<Model>,
    chosen: usize,
}

/// The best model of one order.
struct Model {
    fit: Fit,
    /// Reading minus prediction by a fit without the segment.
    held_out: Vec<f64>,
    /// Root mean square error on the last part of the records by a fit to the first part.
    last_part: f64,
}

impl Models {
    /// The best models, from rest if the records start at rest; with free responses all the same, if these explain what is left of the
    /// best one: readings before the first voltage do not show a slow decay.
    fn of(series: Vec<Series>, law: InputLaw) -> Self {
        let models = Self::with_starts(series, law);
        let from_rest = models.problem.series.iter().any(|series| series.is_at_rest());
        if !from_rest || !is_structured(&models.problem, &models.best_fit().residual) {
            return models;
        }
        let started = models.problem.series.iter().map(|series| series.clone().started()).collect();
        let others = Self::with_starts(started, law);
        if is_structured(&others.problem, &others.best_fit().residual) { models } else { others }
    }

    fn with_starts(series: Vec<Series>, law: InputLaw) -> Self {
        let problem = Problem::new(series);
        let with_errors = |fit: Fit| {
            let held_out = held_out_residual(&problem, &fit);
            Model { last_part: last_part(&problem, &fit.poles), held_out, fit }
        };
        let fits: Vec<Model> = best_of_each_order(&problem).map(with_errors).collect();
        let beaten = |small: usize| (small + 1..fits.len()).any(|large| beats(&problem, &fits[large], &fits[small]));
        let chosen = (0..fits.len()).find(|&order| !beaten(order)).expect("the largest order is never beaten");
        Self { law, problem, fits, chosen }
    }

    /// Errors of the best model of each order from 1.
    fn errors(&self) -> Vec<LinearError> {
        let error = |(order, model): (usize, &Model)| error(order, &model.fit, &model.held_out, model.last_part);
        self.fits.iter().enumerate().skip(1).map(error).collect()
    }

    /// The best model of order 1 or more by its held-out error.
    fn best(&self) -> Option<BestLinear> {
        let errors = self.errors().into_iter().zip(self.fits.iter().skip(1));
        let (error, model) = errors.min_by(|(a, _), (b, _)| a.held_out_rmse.total_cmp(&b.held_out_rmse))?;
        Some(BestLinear { poles: model.fit.poles.clone(), error, held_out: model.held_out.clone() })
    }

    fn held_out_rmse(&self) -> f64 {
        root_mean_square(&self.fits[self.chosen].held_out)
    }

    fn best_fit(&self) -> &Fit {
        &self.fits[self.chosen].fit
    }
}

/// True if errors are no noise of the sensor.
fn is_structured(problem: &Problem, residual: &[f64]) -> bool {
    root_mean_square(residual) > STRUCTURED * scatter(problem, residual)
}

fn error(order: usize, fit: &Fit, held_out: &[f64], last_part: f64) -> LinearError {
    LinearError {
        order,
        rmse: root_mean_square(&fit.residual),
        held_out_rmse: root_mean_square(held_out),
        last_40_percent_rmse: last_part,
    }
}

/// True if the held-out error of a larger model is smaller by more than is worthwhile and beyond chance, and the model extrapolates. The
/// difference is beyond chance if even the larger model's errors are no noise, if it is in most of the record's segments, or if the
/// gain in log-likelihood is. Of autocorrelated errors as many count as have the same information on a mean:
///
/// ```text
/// gain = n_eff ln(error of the smaller / error of the larger),      n_eff = n variance (1 - sum phi)^2 / variance of innovations
/// ```
fn beats(problem: &Problem, large: &Model, small: &Model) -> bool {
    let ratio = root_mean_square(&large.held_out) / root_mean_square(&small.held_out);
    if ratio.is_nan() || ratio > 1.0 - WORTHWHILE || large.last_part > MOST_SPOILED * small.last_part {
        return false;
    }
    let confirmed = large.last_part < (1.0 - WORTHWHILE) * small.last_part;
    // Errors of a spring that is not linear are no noise, so that no order is right and their likelihood says little.
    if is_structured(problem, &large.fit.residual)
        || excess(&small.held_out, &large.held_out) > if confirmed { Z_DOUBTFUL } else { Z_WORSE }
    {
        return true;
    }
    let Spectrum { ar, innovations } = Spectrum::of(&large.held_out, problem.starts(), &[]);
    let power = dot(&large.held_out, &large.held_out);
    let rows = large.held_out.len() as f64;
    let effective = power * (1.0 - ar.iter().sum::<f64>()).powi(2) / innovations;
    let price = if confirmed { PRICE_IF_CONFIRMED } else { PRICE_OF_POLE };
    let more = (large.fit.poles.order() - small.fit.poles.order()) as f64;
    -effective.min(rows) * ratio.ln() > RIVAL_ODDS + price * more
}

/// Identifies the spring of one or several records; each has its own zero and start. Readings that are far from all around them are
/// left out.
///
/// # Errors
/// [`simulation::bad_input::BadInput`] for a record with too few readings, or whose voltage or reading never changes.
pub fn identify(records: &[Record], input: Input, units: &Units) -> Result<Identified> {
    if records.is_empty() {
        bad_input!("no record; expected at least one");
    }
    for record in records {
        check(record)?;
    }
    let mut kept = records.to_vec();
    let mut left_out = Vec::new();
    let far = kept.iter().map(far_readings::at_start).collect();
    leave_out(&mut kept, far, &mut left_out);
    let mut identified = of_all(&kept, input, units);
    for _ in 1..MOST_SEARCHES {
        let delay = identified.report.nominal.delay_s.value;
        let far = identified.records.iter().map(|course| far_readings::of_errors(course, delay)).collect();
        if !leave_out(&mut kept, far, &mut left_out) {
            break;
        }
        identified = of_all(&kept, input, units);
    }
    if !left_out.is_empty() {
        left_out.sort_by(|a, b| a.record.cmp(&b.record).then(a.time_s.total_cmp(&b.time_s)));
        identified.linear = None;
        identified.report.remarks.insert(0, remarks::left_out(&left_out, units));
        identified.report.left_out = left_out;
    }
    Ok(identified)
}

/// Takes readings out of each record, by their number among its readings, and adds them to a list. Returns false if there are none, or
/// if a record would be left that cannot be identified.
fn leave_out(records: &mut Vec<Record>, far: Vec<Vec<usize>>, left_out: &mut Vec<FarReading>) -> bool {
    let mut kept = records.clone();
    let mut taken = Vec::new();
    for (record, far) in kept.iter_mut().zip(far) {
        let mut rows: Vec<_> = record.rows.iter_mut().filter(|row| row.measured.is_some()).collect();
        for reading in far {
            let row = &mut rows[reading];
            let value = row.measured.take().expect("a row with a reading");
            taken.push(FarReading { record: record.name.clone(), time_s: row.time_s, reading: value });
        }
    }
    if taken.is_empty() || kept.iter().any(|record| check(record).is_err()) {
        return false;
    }
    *records = kept;
    left_out.append(&mut taken);
    true
}

/// Identifies the spring of records that were checked, from all of their readings.
fn of_all(records: &[Record], input: Input, units: &Units) -> Identified {
    let series: Vec<Series> = records.iter().map(|record| Series::new(record, input)).collect();
    let mut models = Models::of(series.clone(), InputLaw::Linear);
    let linear = models.best();
    let both_signs = series.iter().any(Series::has_both_signs);
    if both_signs {
        let even = Models::of(series.iter().map(Series::rectified).collect(), InputLaw::Even);
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
        let square = Models::of(squared, InputLaw::Square);
        if square.held_out_rmse() < most * models.held_out_rmse() {
            models = square;
        }
    }
    let voltage = VoltageRange { full_scale_v: full_scale, both_signs };
    Identified { linear, ..identified(records, models, voltage, units) }
}

/// The best linear model of some records.
#[derive(Clone, Debug)]
pub struct BestLinear {
    /// Its denominator and delay.
    pub poles: Poles,
    /// Its order and errors.
    pub error: LinearError,
    /// Readings less predictions by fits without the segment, in the reading's unit.
    pub held_out: Vec<f64>,
}

/// Returns the best linear model of order 1 to 4 by its held-out error; `None` if there is none.
pub fn best_linear(records: &[Record], input: Input) -> Option<BestLinear> {
    if input == Input::Stair || records.iter().any(|record| check(record).is_err()) {
        return None;
    }
    let problem = Problem::new(records.iter().map(|record| Series::new(record, input)).collect());
    let fits = best_of_each_order(&problem).enumerate().skip(1);
    let with_error = |(order, fit): (usize, Fit)| (order, held_out_residual(&problem, &fit), fit);
    let square = |of: &[f64]| dot(of, of);
    let (order, held_out, fit) = fits.map(with_error).min_by(|a, b| square(&a.1).total_cmp(&square(&b.1)))?;
    let error = error(order, &fit, &held_out, last_part(&problem, &fit.poles));
    Some(BestLinear { poles: fit.poles, error, held_out })
}

fn check(record: &Record) -> Result<()> {
    let readings = || record.rows.iter().filter_map(|row| row.measured);
    if readings().count() < FEWEST_READINGS {
        bad_input!(
            "{}: {} row(s) with a reading; expected at least {FEWEST_READINGS}",
            record.name,
            readings().count()
        );
    }
    let first = record.rows[0].voltage_v;
    if record.rows.iter().all(|row| row.voltage_v == first) {
        bad_input!("{}: the voltage never changes; expected a record in which it does", record.name);
    }
    let first = readings().next();
    if readings().all(|reading| Some(reading) == first) {
        bad_input!("{}: the reading never changes; expected a record in which it does", record.name);
    }
    Ok(())
}

fn identified(records: &[Record], models: Models, voltage: VoltageRange, units: &Units) -> Identified {
    let Models { law, problem, fits, chosen } = &models;
    let Model { fit, held_out, last_part } = &fits[*chosen];
    let rows = problem.rows();
    let spectrum = Spectrum::of(&fit.residual, problem.starts(), &directions(problem, fit));
    let canonical = Canonical::of(problem, fit);
    let mut deviations = deviations(problem, fit, &canonical, &spectrum).into_iter();
    let base = if units.voltage.si == 1.0 { units.voltage.name.as_str() } else { "V" };
    let reading = units.reading.as_str();
    let mut quantity = |value: f64, unit: &str| {
        let half = Z * deviations.next().unwrap_or(0.0);
        Quantity { value, low: value - half, high: value + half, unit: unit.into() }
    };
    // In the order of `Canonical::values`.
    let gain = quantity(canonical.gain, &format!("{reading}/{base}"));
    let share = quantity(canonical.share, "");
    let delay = quantity(canonical.delay, "s");
    let mut tau_s: Vec<TimeConstant> = canonical
        .lags
        .iter()
        .map(|&(tau, weight)| TimeConstant { tau: positive(quantity(tau, "s")), weight: quantity(weight, "") })
        .collect();
    let oscillation: Vec<Oscillation> = canonical
        .oscillations
        .iter()
        .map(|&[frequency, damping, weight, rate_weight]| Oscillation {
            freq_hz: positive(quantity(frequency, "Hz")),
            zeta: positive(quantity(damping, "")),
            weight: quantity(weight, ""),
            rate_weight: quantity(rate_weight, ""),
        })
        .collect();
    let zeros: Vec<Quantity> = canonical.zeros.iter().map(|&zero| quantity(zero, reading)).collect();
    let offsets: Vec<Quantity> = canonical.starts.iter().map(|&start| quantity(start, reading)).collect();
    tau_s.sort_by(|a, b| b.weight.value.abs().total_cmp(&a.weight.value.abs()));
    let delay_s = if problem.bounds.whole_rows { whole_rows(problem, fit) } else { not_negative(delay) };
    let nominal = Nominal { gain, zero: zeros[0].clone(), share, delay_s, tau_s };
    let start = records
        .iter()
        .zip(zeros.into_iter().zip(offsets))
        .map(|(record, (zero, offset))| Start { record: record.name.clone(), zero, offset })
        .collect();
    let degrees = (rows.saturating_sub(fit.degrees())).max(1) as f64;
    let noise = Noise {
        sigma: (fit.cost / degrees).sqrt(),
        autocorrelation: Spectrum::neighbours(&fit.residual),
        scatter: scatter(problem, &fit.residual),
    };
    let plant = plant::plant_file(&nominal, &oscillation, *law, voltage, units, problem.spacing);
    let mut report = Report {
        schema: SCHEMA,
        rows,
        order: *chosen,
        nominal,
        oscillation,
        input_law: *law,
        rmse: root_mean_square(&fit.residual),
        held_out_rmse: models.held_out_rmse(),
        last_40_percent_rmse: *last_part,
        static_held_out_rmse: root_mean_square(&fits[0].held_out),
        linear: models.errors(),
        start,
        noise,
        remarks: Vec::new(),
        left_out: Vec::new(),
        unit: reading.into(),
        model: None,
    };
    report.remarks = remarks::remarks(&report, problem, fit, units);
    let course = |(record, (&first, series)): (&Record, (&usize, &Series))| {
        let rows = || record.rows.iter().filter_map(|row| Some((row, row.measured?)));
        let part = first..first + series.rows();
        Course {
            name: record.name.clone(),
            time_s: rows().map(|(row, _)| row.time_s).collect(),
            voltage_v: rows().map(|(row, _)| row.voltage_v).collect(),
            reading: rows().map(|(_, reading)| reading).collect(),
            residual: fit.residual[part.clone()].to_vec(),
            held_out: held_out[part].to_vec(),
        }
    };
    let records = records.iter().zip(problem.starts().iter().zip(&problem.series)).map(course).collect();
    let settled = problem.series.iter().all(Series::is_at_rest);
    Identified { report, plant, settled, linear: None, records }
}

/// Scatter of errors from row to row: what is left of them without their slow part.
fn scatter(problem: &Problem, residual: &[f64]) -> f64 {
    let differences =
        problem.starts().iter().zip(&problem.series).flat_map(|(&first, series)| {
            second_differences(&residual[first..first + series.rows()]).collect::<Vec<_>>()
        });
    robust_deviation(differences).unwrap_or(0.0)
}

/// The directions in which a fit has taken errors away; none for a long record, which has lost a small part of them.
fn directions(problem: &Problem, fit: &Fit) -> Vec<Vec<f64>> {
    if problem.rows() > LONG { Vec::new() } else { fit.directions() }
}

/// Standard deviations of the quantities, in the order of [`Canonical::values`].
fn deviations(problem: &Problem, fit: &Fit, canonical: &Canonical, spectrum: &Spectrum) -> Vec<f64> {
    let parameters = fit.parameters(problem);
    let here = canonical.values(canonical).expect("the same numbers of lags and oscillations");
    let mut derivatives = vec![vec![0.0; parameters.len()]; here.len()];
    for at in 0..parameters.len() {
        let mut unit = vec![0.0; parameters.len()];
        unit[at] = 1.0;
        let influence = fit.influence(&unit);
        let step = DIFFERENCE * (spectrum.innovations * dot(&influence, &influence)).sqrt();
        if step == 0.0 || !step.is_finite() {
            continue;
        }
        let moved = |by: f64| {
            let mut moved = parameters.clone();
            moved[at] += by;
            Canonical::of(problem, &fit.with_parameters(problem, &moved)).values(canonical)
        };
        // Near a double pole only one side may have two time constants.
        let (from, to, width) = match (moved(-step), moved(step)) {
            (Some(from), Some(to)) => (from, to, 2.0 * step),
            (None, Some(to)) => (here.clone(), to, step),
            (Some(from), None) => (from, here.clone(), step),
            (None, None) => continue,
        };
        for (quantity, (from, to)) in from.iter().zip(&to).enumerate() {
            derivatives[quantity][at] = (to - from) / width;
        }
    }
    derivatives.iter().map(|derivatives| spectrum.deviation(&fit.influence(derivatives))).collect()
}

/// The interval of a positive quantity, symmetric in its logarithm.
fn positive(quantity: Quantity) -> Quantity {
    let factor = ((quantity.high - quantity.value) / quantity.value).exp();
    Quantity { low: quantity.value / factor, high: quantity.value * factor, ..quantity }
}

fn not_negative(quantity: Quantity) -> Quantity {
    Quantity { low: quantity.low.max(0.0), ..quantity }
}

/// The delay if only whole rows are searched: all delays whose fit is not significantly worse. A part of a row is
/// equivalent to another numerator, so that the interval reaches one row further down.
fn whole_rows(problem: &Problem, fit: &Fit) -> Quantity {
    const MOST: usize = 4;
    let neighbours = Spectrum::neighbours(&fit.residual).clamp(0.0, 0.95);
    let degrees = problem.rows().saturating_sub(fit.degrees()).max(1) as f64;
    let tolerated = Z * Z * fit.cost / degrees * (1.0 + neighbours) / (1.0 - neighbours);
    let rows = (fit.poles.delay / problem.spacing).round();
    let fits = |rows: f64| {
        let poles = Poles { delay: rows * problem.spacing, ..fit.poles.clone() };
        rows >= 0.0
            && rows * problem.spacing <= problem.bounds.delay.1
            && problem.refined(poles, steps(problem), REFIT.1).cost <= fit.cost + tolerated
    };
    let reach = |sign: f64| (1..=MOST).map(|by| rows + sign * by as f64).take_while(|&rows| fits(rows)).last();
    let low = (reach(-1.0).unwrap_or(rows) - 1.0).max(0.0) * problem.spacing;
    let high = reach(1.0).unwrap_or(rows) * problem.spacing;
    Quantity { value: fit.poles.delay, low, high, unit: "s".into() }
}

/// Most steps of a refinement from a fit to similar readings.
fn steps(problem: &Problem) -> usize {
    (MOST_REFITTED / problem.rows()).clamp(1, REFIT.0)
}

/// Root mean square error on the last part of each record by a fit to its first part.
fn last_part(problem: &Problem, poles: &Poles) -> f64 {
    let starts = problem.starts();
    let ends: Vec<usize> = starts
        .iter()
        .zip(&problem.series)
        .map(|(start, series)| start + (FIRST_PART * series.rows() as f64).round() as usize)
        .collect();
    let first = |row: usize| row < ends[starts.partition_point(|start| *start <= row) - 1];
    let residual = problem.residual(&problem.only(first).refined(poles.clone(), steps(problem), REFIT.1));
    let last: Vec<f64> = (0..residual.len()).filter(|&row| !first(row)).map(|row| residual[row]).collect();
    root_mean_square(&last)
}

#[cfg(test)]
mod tests;
