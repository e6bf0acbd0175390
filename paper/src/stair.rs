//! What a run says, laid beside what the report printed and measured.

use anyhow::Result;
use model::{Compensation, Limits, Settings};
use serde::Serialize;

use crate::misprint::Pair;
use crate::table3;
use simulation::experiment::{Experiment, HasReference, Run, Sample, StartsFrom, max_fixed_point_error};
use simulation::record::Record;
use simulation::response::{Response, responses};

/// The whole answer of `vsj stair --json`.
#[derive(Clone, Debug, Serialize)]
pub struct Report {
    /// One a row of the table or file.
    pub rows: Vec<Row>,
    /// One a change of the target.
    pub steps: Vec<Response>,
    /// Where the fastest drive of `bound_t97_s` starts.
    pub bound_from: StartsFrom,
    /// Largest difference between fixed point and reference over every tick of the controlled loop, in V.
    pub max_fixed_point_error: f64,
    /// The same of the spring left alone: nothing there corrects the rounding of the DAC.
    pub max_fixed_point_error_without: f64,
    /// In how many ticks of the shown loop a limit acted.
    pub limited_ticks: LimitedTicks,
    /// How many printed numbers were compared, and how many of them the reference reproduces to the last digit.
    pub printed_compared: usize,
    /// See `printed_compared`.
    pub printed_agree: usize,
}

/// Ticks in which a limit acted, by limit.
#[derive(Clone, Copy, Debug, Serialize)]
pub struct LimitedTicks {
    /// The upper end of the amplifier's range.
    pub upper: usize,
    /// Its lower end.
    pub lower: usize,
    /// Its slew.
    pub slew: usize,
}

impl LimitedTicks {
    fn of(samples: &[Sample]) -> Self {
        let count = |limit| samples.iter().filter(|sample| sample.limits.any_of(limit)).count();
        Self { upper: count(Limits::UPPER), lower: count(Limits::LOWER), slew: count(Limits::SLEW) }
    }
}

/// One moment of the experiment. Stiffness on the scale of volts.
#[derive(Clone, Debug, Serialize)]
pub struct Row {
    /// In s.
    pub time_s: f64,
    /// The voltage asked for, in V.
    pub voltage_v: f64,
    /// Printed, with controller.
    pub printed_with: Option<f64>,
    /// Printed, without controller.
    pub printed_without: Option<f64>,
    /// Reference with controller.
    pub with: f64,
    /// Reference without.
    pub without: f64,
    /// Fixed point with controller.
    pub with_fixed: f64,
    /// Fixed point without.
    pub without_fixed: f64,
    /// Measured.
    pub measured: Option<f64>,
    /// Why a printed number is not reproduced, where the run is the printed one.
    pub note: Option<String>,
}

/// Where rows come from.
pub enum Rows<'a> {
    /// Table 3; `same` says that the run is the report's own, so that its printed numbers should come out.
    Table3 {
        /// See above.
        same: bool,
    },
    /// A file of the user's.
    Record(&'a Record),
}

impl Report {
    /// Reads the answer off a finished run; `controlled` says which loop the steps are measured on.
    ///
    /// # Errors
    /// If the table that was built in is damaged.
    pub fn new<P: HasReference>(
        experiment: &Experiment<P>,
        run: &Run,
        source: &Rows<'_>,
        controlled: bool,
    ) -> Result<Self> {
        let compared = matches!(source, Rows::Table3 { same: true });
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

/// Rows at the moments of a table or file: the reference at the very moment, fixed point at the last tick before.
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

/// Notes why a printed number does not come out; returns how many were compared and how many agree.
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
