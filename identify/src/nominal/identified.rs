//! An identified spring: the chosen model in the terms of a spring as an answer and as a plant file, and its course beside each record.

use simulation::plant_file::PlantFile;
use simulation::record::Record;
use simulation::units::{Units, quotient};

use crate::answer::SCHEMA;
use crate::linear::{Section, Series};
use crate::nominal::canonical::Canonical;
use crate::nominal::covariance::Spectrum;
use crate::nominal::intervals::{deviations, directions, not_negative, over_places, places, positive};
use crate::nominal::models::{BestLinear, Model, Models, scatter};
use crate::nominal::plant::{self, VoltageRange};
use crate::nominal::remarks;
use crate::nominal::report::{Noise, Nominal, Oscillation, Quantity, Report, Start, TimeConstant};
use crate::stats::scale::root_mean_square;
use crate::stats::thresholds::probability::Z;

/// An identified spring.
#[derive(Clone, Debug)]
pub struct Identified {
    /// The answer.
    pub report: Report,
    /// The spring as a plant file.
    pub plant: PlantFile,
    /// The best spring of the lowest order that may lack no more than a cause, without a delay if one may, as a plant file; `None` if that
    /// is the one that was identified: what is not linear makes a model of higher order or with a delay better, which imitates it.
    pub simpler: Option<PlantFile>,
    /// True if the spring was taken to be at rest when each record begins.
    pub settled: bool,
    /// True if the readings also show a decay that the voltage does not drive: a drift, or what an earlier voltage left behind in a slow
    /// part of the spring.
    pub decays: bool,
    /// What the spring leaves in doubt, in sentences that are remarks of the report as well.
    pub doubts: Vec<String>,
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

/// Describes the chosen model of some records; the best linear model is left to the caller.
pub(super) fn described(records: &[Record], models: &Models, voltage: VoltageRange, units: &Units) -> Identified {
    let of_lower = models.simpler();
    let without_delay = models.without_delay(of_lower.unwrap_or(models.chosen));
    let simpler = match &without_delay {
        Some(without) => Some(of_order(records, without, without.chosen, voltage, units).plant),
        None => of_lower.map(|order| of_order(records, models, order, voltage, units).plant),
    };
    Identified { simpler, ..of_order(records, models, models.chosen, voltage, units) }
}

/// Describes the model of one order.
fn of_order(records: &[Record], models: &Models, order: usize, voltage: VoltageRange, units: &Units) -> Identified {
    let Models { law, problem, fits, in_place_of, .. } = models;
    let Model { fit, held_out, last_part } = &fits[order];
    let rows = problem.rows();
    let driven: usize = fit.poles.driven().map(|(_, section)| section.order()).sum();
    let spectrum = Spectrum::of(&fit.residual, problem.starts(), &directions(problem, fit));
    let canonical = Canonical::of(problem, fit);
    let deviations = deviations(problem, fit, &canonical, &spectrum);
    let places = problem.bounds.held.then(|| places(problem, fit));
    let mut reach = deviations.into_iter().zip(over_places(problem, fit, &canonical, places.as_ref()));
    let base = if units.voltage.si == 1.0 { units.voltage.name.as_str() } else { "V" };
    let reading = units.reading.as_str();
    let mut quantity = |value: f64, unit: &str| {
        let (deviation, (least, most)) = reach.next().unwrap_or((0.0, (value, value)));
        let half = Z * deviation;
        Quantity { value, low: least - half, high: most + half, unit: unit.into() }
    };
    // In the order of `Canonical::values`.
    let gain = quantity(canonical.gain, &quotient(reading, base));
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
    let delay_s = places.unwrap_or_else(|| not_negative(delay));
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
        order: driven,
        undriven_order: order - driven,
        nominal,
        oscillation,
        input_law: *law,
        rmse: root_mean_square(&fit.residual),
        held_out_rmse: root_mean_square(held_out),
        last_40_percent_rmse: *last_part,
        static_held_out_rmse: root_mean_square(&fits[0].held_out),
        linear: models.errors(),
        start,
        noise,
        remarks: Vec::new(),
        left_out: Vec::new(),
        at_bound: Vec::new(),
        zero_shifts: Vec::new(),
        unit: reading.into(),
        model: None,
        bound_command: None,
    };
    report.remarks = remarks::remarks(&report, *in_place_of, problem, fit, units);
    let doubts = remarks::doubts(&report, problem, fit, units);
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
    let decays = fit.poles.undriven.iter().any(|place| matches!(fit.poles.sections[*place], Section::First { .. }));
    Identified { report, plant, simpler: None, settled, decays, doubts, linear: None, records }
}
