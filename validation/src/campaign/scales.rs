//! Single effects in springs of any size: nominal time constants from 1 ms to 1 h, instantaneous shares from 0 to 0.8, full scales
//! from 1 mV to 10 kV, readings of any gain and zero.
//!
//! The simulator's spring has the paper's time constant and full scale; its records are written in other units of time and
//! voltage, which is the same. Its instantaneous share is simulated. The diagnosis gets the nominal spring of that size.

use indicatif::ProgressBar;
use rand::{RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;
use rayon::prelude::*;
use serde_json::{Value, json};
use simulation::plant_file::{PlantFile, Reading, Relaxation};
use simulation::record::{Record, Row};

use super::diagnosis;
use super::part::{self, Job};
use super::score::Outcome;
use crate::ground_truth::physics::TAU_S;
use crate::ground_truth::{Cause, LabelledRecord};

/// Full scale of most of the simulator's records, in V.
const FULL_V: f64 = 500.0;
/// Smallest difference between the nominal share and that of an effect on it.
const SHARES_APART: f64 = 0.05;

/// The size of a spring.
#[derive(Clone, Copy, Debug)]
pub struct Size {
    /// Nominal time constant, in s.
    pub tau_s: f64,
    /// Full scale of the voltage, in V.
    pub full_v: f64,
    /// Nominal instantaneous share.
    pub share: f64,
    /// Change of the reading per V, of either sign.
    pub gain: f64,
    /// Reading at 0 V.
    pub zero: f64,
}

impl Size {
    /// Draws a size: time constant, full scale and gain log-uniform.
    pub fn draw(random: &mut impl RngExt) -> Self {
        let mut log = |low: f64, high: f64| random.random_range(low.ln()..high.ln()).exp();
        let (tau_s, full_v, gain) = (log(1e-3, 3600.0), log(1e-3, 1e4), log(1e-3, 1e3));
        let gain = if random.random_bool(0.5) { gain } else { -gain };
        let zero = gain * full_v * random.random_range(-1.0..1.0);
        Self { tau_s, full_v, share: random.random_range(0.0..0.8), gain, zero }
    }

    /// Returns a record of the simulator's spring as one of a spring of this size.
    pub fn record(&self, record: &Record) -> Record {
        let (time, volts) = (self.tau_s / TAU_S, self.full_v / FULL_V);
        let row = |row: &Row| Row {
            time_s: time * row.time_s,
            voltage_v: volts * row.voltage_v,
            measured: row.measured.map(|stiffness| self.zero + self.gain * volts * stiffness),
            ..*row
        };
        Record { name: record.name.clone(), rows: record.rows.iter().map(row).collect() }
    }

    /// Returns the nominal spring of this size.
    pub fn plant(&self) -> PlantFile {
        let mut plant = PlantFile::from(model::Plant::PAPER);
        plant.relaxation = Relaxation { share: self.share, tau_s: vec![self.tau_s], ..plant.relaxation };
        plant.reading = Some(Reading { gain: self.gain, zero: self.zero });
        plant
    }
}

/// `count` records of each cause, grouped by cause.
pub fn jobs(first: u64, count: usize) -> Vec<Job> {
    part::each_cause(first, 14, count, &Cause::ALL, |recipe| recipe)
}

/// Returns the record of a job in a spring of a random size, and that size.
pub fn draw(job: &Job) -> (LabelledRecord, Size) {
    let mut random = ChaCha8Rng::seed_from_u64(job.seed);
    random.set_stream(3);
    let record = job.recipe.draw(job.seed);
    let size = size_for(&record, &mut random);
    (record.with_share(size.share), size)
}

/// Draws a size whose share differs from the one that an effect of the record sets.
pub(super) fn size_for(record: &LabelledRecord, random: &mut ChaCha8Rng) -> Size {
    let changed = record.effects.iter().find(|effect| effect.cause == Cause::InstantaneousShare);
    let changed = changed.map(|effect| effect.values()[0]);
    loop {
        let size = Size::draw(random);
        if changed.is_none_or(|share| (share - size.share).abs() > SHARES_APART) {
            return size;
        }
    }
}

/// Simulates and diagnoses the records on all cores; the outcomes are in the order of the jobs. Errors are in units of the
/// simulator's spring.
pub fn run(jobs: &[Job], progress: &ProgressBar) -> Vec<Outcome> {
    let one = |job: &Job| {
        let (record, size) = draw(job);
        let outcome = Outcome::of(&record, &|hidden| {
            let mut report = diagnosis::compared_with(&size.record(&hidden.record()), size.plant())?;
            let unit = (size.gain * size.full_v / FULL_V).abs();
            if let Some(error) = report.pointer("/extended/held_out_rmse").and_then(Value::as_f64) {
                report["extended"]["held_out_rmse"] = json!(error / unit);
            }
            Ok(report)
        });
        progress.inc(1);
        outcome
    };
    jobs.par_iter().map(one).collect()
}
