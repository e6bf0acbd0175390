//! The answer of `vsj stair`: a run of the stair experiment compared with the report's printed and measured values.

pub mod request;

use anyhow::Result;
use model::{Compensation, Limits, Settings};
use serde::Serialize;

use crate::misprint::Pair;
use crate::table3::{self, Printed};
use simulation::experiment::{Experiment, HasReference, Run, Sample, StartsFrom, max_fixed_point_error};
use simulation::record::Record;
use simulation::response::{Response, responses};
use simulation::schedule::STAIR_STEP_V;

/// The answer of `vsj stair --json`.
#[derive(Clone, Debug, Serialize)]
pub struct Report {
    /// One row per row of the table or file.
    pub rows: Vec<Row>,
    /// One response per change of the target.
    pub steps: Vec<Response>,
    /// Initial state of the spring for `bound_t97_s`.
    pub bound_from: StartsFrom,
    /// Largest difference between the fixed-point loop and its reference over all ticks, in V, with controller.
    pub max_fixed_point_error: f64,
    /// Largest difference without controller, in V, where nothing corrects the rounding of the DAC.
    pub max_fixed_point_error_without: f64,
    /// Number of ticks of the selected loop in which a limit acted.
    pub limited_ticks: LimitedTicks,
    /// Number of printed values that were compared.
    pub printed_compared: usize,
    /// Number of printed values that the reference reproduces to the last digit.
    pub printed_agree: usize,
}

/// Ticks in which a limit acted, by limit.
#[derive(Clone, Copy, Debug, Serialize)]
pub struct LimitedTicks {
    /// At the upper end of the amplifier's range.
    pub upper: usize,
    /// At the lower end of the amplifier's range.
    pub lower: usize,
    /// At the amplifier's slew limit.
    pub slew: usize,
}

impl LimitedTicks {
    fn of(samples: &[Sample]) -> Self {
        let count = |limit| samples.iter().filter(|sample| sample.limits.intersects(limit)).count();
        Self { upper: count(Limits::UPPER), lower: count(Limits::LOWER), slew: count(Limits::SLEW) }
    }
}

/// One time of the experiment; stiffness is expressed as the equivalent static voltage, in V.
#[derive(Clone, Debug, Serialize)]
pub struct Row {
    /// Time, in s.
    pub time_s: f64,
    /// Commanded voltage, in V.
    pub voltage_v: f64,
    /// Stiffness printed in the report, with controller.
    pub printed_with: Option<f64>,
    /// Stiffness printed in the report, without controller.
    pub printed_without: Option<f64>,
    /// Stiffness of the double-precision reference, with controller.
    pub with: f64,
    /// Stiffness of the double-precision reference, without controller.
    pub without: f64,
    /// Stiffness of the fixed-point loop, with controller.
    pub with_fixed: f64,
    /// Stiffness of the fixed-point loop, without controller.
    pub without_fixed: f64,
    /// Measured stiffness.
    pub measured: Option<f64>,
    /// Explanation of a printed value that is not reproduced, for a run of the report's own experiment.
    pub note: Option<String>,
}

/// Source of the rows.
pub enum Rows<'a> {
    /// Table 3 of the report.
    Table3 {
        /// True if the run is the report's own, so that its printed values should be reproduced.
        same: bool,
        /// True if the spring is the report's own, whose printed and measured values belong to the rows.
        spring: bool,
        /// Size of the steps, in V.
        step_v: f64,
    },
    /// A record of the user's.
    Record(&'a Record),
}

impl Report {
    /// Evaluates a finished run; `controlled` selects the loop on which steps and limits are measured.
    ///
    /// # Errors
    /// If the built-in table is damaged.
    pub fn new<P: HasReference>(
        experiment: &Experiment<P>,
        run: &Run,
        source: &Rows<'_>,
        controlled: bool,
    ) -> Result<Self> {
        let compared = matches!(source, Rows::Table3 { same: true, .. });
        let mut rows = rows(experiment, run, source)?;
        let (printed_compared, printed_agree) = if compared { explain(&mut rows) } else { (0, 0) };
        let samples = if controlled { &run.with } else { &run.without };
        Ok(Self {
            rows,
            steps: responses(experiment, run, samples),
            bound_from: P::bounds_from(&experiment.settings),
            max_fixed_point_error: max_fixed_point_error(&run.with),
            max_fixed_point_error_without: max_fixed_point_error(&run.without),
            limited_ticks: LimitedTicks::of(samples),
            printed_compared,
            printed_agree,
        })
    }
}

/// Rows at the times of a table or record: the reference at that very time, fixed point at the last tick before it.
fn rows<P: HasReference>(experiment: &Experiment<P>, run: &Run, source: &Rows<'_>) -> Result<Vec<Row>> {
    let blank = |time_s, voltage_v, measured| {
        let tick = run.tick_at(time_s);
        Row {
            time_s,
            voltage_v,
            printed_with: None,
            printed_without: None,
            with: 0.0,
            without: 0.0,
            with_fixed: run.with[tick].stiffness.to_f64(),
            without_fixed: run.without[tick].stiffness.to_f64(),
            measured,
            note: None,
        }
    };
    let mut rows: Vec<Row> = match source {
        Rows::Table3 { spring: false, step_v, .. } => {
            let voltage_v = |printed: &Printed| printed.voltage_v / STAIR_STEP_V * step_v;
            table3::rows()?.iter().map(|printed| blank(printed.time_s, voltage_v(printed), None)).collect()
        }
        Rows::Table3 { .. } => table3::rows()?
            .iter()
            .map(|printed| Row {
                printed_with: Some(printed.with),
                printed_without: Some(printed.without),
                ..blank(printed.time_s, printed.voltage_v, Some(printed.measured))
            })
            .collect(),
        Rows::Record(record) => {
            record.rows.iter().map(|point| blank(point.time_s, point.voltage_v, point.measured)).collect()
        }
    };
    let Experiment { schedule, settings, .. } = experiment;
    let times: Vec<f64> = rows.iter().map(|row| row.time_s).collect();
    let with = P::reference_at(settings, schedule, run, &run.with, &times);
    let without = P::reference_at(
        &Settings { compensation: Compensation::None, ..*settings },
        schedule,
        run,
        &run.without,
        &times,
    );
    for ((row, with), without) in rows.iter_mut().zip(with).zip(without) {
        (row.with, row.without) = (with, without);
    }
    Ok(rows)
}

/// Explains printed values that are not reproduced; returns the numbers of compared and of reproduced values.
fn explain(rows: &mut [Row]) -> (usize, usize) {
    let pairs = |row: &Row| {
        let pair = |printed: Option<f64>, computed| printed.map(|printed| Pair { printed, computed });
        [("with", pair(row.printed_with, row.with)), ("without", pair(row.printed_without, row.without))]
    };
    let all: Vec<Pair> = rows.iter().flat_map(|row| pairs(row).into_iter().filter_map(|(_, pair)| pair)).collect();
    for row in &mut *rows {
        let notes: Vec<String> = pairs(row)
            .into_iter()
            .filter_map(|(loop_name, pair)| Some((loop_name, pair?)))
            .filter(|(_, pair)| !pair.agrees())
            .map(|(loop_name, pair)| format!("{loop_name} controller: {}", pair.explain(&all)))
            .collect();
        row.note = (!notes.is_empty()).then(|| notes.join("; "));
    }
    (all.len(), all.iter().filter(|pair| pair.agrees()).count())
}
