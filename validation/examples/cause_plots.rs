//! Draws the pictures of docs/causes: one record with each cause, compared with the paper's simulation.
//!
//! ```sh
//! cargo run --release -p validation --example cause_plots -- docs/causes
//! ```

use std::path::{Path, PathBuf};

use anyhow::Context;
use host_sim::output::diagnosis::panels::panels;
use identify::effects::model::Model;
use identify::fit::simulator::Simulator;
use identify::record::data::Data;
use identify::{Input, Options};
use simulation::record::Record;
use validation::ground_truth::{Cause, Effect, LabelledRecord, Noise, Schedule};

/// Values of the effect, in the order of [`Effect::values`], and a schedule in which it is visible.
fn shown(cause: Cause) -> (Vec<f64>, Schedule) {
    match cause {
        Cause::GainError => (vec![1.1], slow()),
        Cause::InstantaneousShare => (vec![0.2], slow()),
        Cause::TimeConstant => (vec![8.0], slow()),
        Cause::SecondRelaxation => (vec![0.2, 40.0], slow()),
        Cause::VoltageDependentTimeConstant => (vec![4.0, 9.0], slow()),
        Cause::StaticNonlinearity => (vec![0.3], slow()),
        Cause::Hysteresis => (vec![60.0], slow()),
        Cause::ChargeLeakage => (vec![0.2, 30.0], slow()),
        Cause::Drift => (vec![0.001], slow()),
        Cause::Resonance => (vec![4.0, 0.08, 1.0], fast()),
        Cause::Delay => (vec![0.1], fast()),
        Cause::AmplifierLimit => (vec![400.0], slow()),
        Cause::AmplifierSlew => (vec![1.0 / 800.0], fast()),
        Cause::SensorSaturation => (vec![0.8], slow()),
        Cause::Quantisation => (vec![15.0], slow()),
        Cause::Hum => (vec![6.0, 1.5, 0.0], fast()),
        Cause::ReadingOffset => (vec![52.0, 71.0, 15.0], slow()),
        Cause::SeriesLag => (vec![0.3], fast()),
        Cause::Outliers => (vec![0.01, 40.0], slow()),
    }
}

/// Times from and to which the sensor is stuck, in s.
const STUCK_S: [f64; 2] = [52.0, 71.0];

/// A stair up and down and one full step, 15 s each, ten rows per second.
fn slow() -> Schedule {
    schedule(&[0.0, 125.0, 250.0, 375.0, 500.0, 375.0, 250.0, 125.0, 0.0, 500.0, 500.0, 0.0, 0.0], 15.0, 0.1)
}

/// Steps of different heights, 2 s each, a hundred rows per second.
fn fast() -> Schedule {
    schedule(&[0.0, 100.0, 500.0, 300.0, 0.0], 2.0, 0.01)
}

fn schedule(levels_v: &[f64], hold_s: f64, every_s: f64) -> Schedule {
    let rows_per_level = (hold_s / every_s).round() as usize;
    let rows = levels_v.len() * rows_per_level;
    Schedule {
        time_s: (0..rows).map(|row| row as f64 * every_s).collect(),
        voltage_v: (0..rows).map(|row| levels_v[row / rows_per_level]).collect(),
    }
}

/// Draws a record with the simulation.
fn draw(path: &Path, record: &Record) -> anyhow::Result<()> {
    let data = Data::new(record, Input::Hold);
    let mut simulation = Vec::new();
    Simulator::new(&data, &Options::default().base).run(&Model::default(), &mut simulation);
    std::fs::write(path, panels(&data, &simulation)).with_context(|| path.display().to_string())?;
    println!("wrote {}", path.display());
    Ok(())
}

fn main() -> anyhow::Result<()> {
    let folder = PathBuf::from(std::env::args().nth(1).context("expected a folder to write to")?);
    for cause in Cause::ALL {
        let (values, schedule) = shown(cause);
        let effect = Effect { cause, form: 0, full_size: values.clone(), neutral: values, size: 1.0 };
        let record = LabelledRecord::new(schedule, vec![effect], Noise::white(0.1), 1);
        draw(&folder.join(format!("{cause}.svg")), &record.record())?;
    }
    // The simulator of the campaign has no stuck sensor: it is proved by equal readings, not by an effect of some size.
    let mut stuck = LabelledRecord::new(slow(), Vec::new(), Noise::white(0.1), 1).record();
    let from = stuck.rows.partition_point(|row| row.time_s < STUCK_S[0]);
    let repeated = stuck.rows[from].measured;
    let until_end = stuck.rows[from..].iter_mut().take_while(|row| row.time_s <= STUCK_S[1]);
    until_end.for_each(|row| row.measured = repeated);
    draw(&folder.join("stuck-sensor.svg"), &stuck)
}
