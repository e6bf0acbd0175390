//! The ticks of a run as CSV, MCAP or Parquet, all with the same columns.

use std::io::{self, Write};

use anyhow::Result;
use model::Spring;
use record_files::{Cell, Column, Container, Sheet, Writer};
use simulation::experiment::{Experiment, Run, Sample};

const COLUMNS: [Column; 6] = [
    Column::number("time_s", "s"),
    Column::number("target_v", "V"),
    Column::number("applied_v", "V"),
    Column::whole("dac_code"),
    Column::number("stiffness", "V"),
    Column::number("youngs_modulus_pa", "Pa"),
];

/// The ticks to be written.
#[derive(Debug)]
pub struct Ticks<'a, P> {
    /// What was run.
    pub experiment: &'a Experiment<P>,
    /// The run.
    pub run: &'a Run,
    /// The samples of the run that are written.
    pub samples: &'a [Sample],
    /// Spring that gives Young's modulus.
    pub spring: &'a Spring,
    /// Number of ticks from one row to the next.
    pub stride: usize,
}

/// A row.
struct Row {
    time_s: f64,
    target_v: f64,
    applied_v: f64,
    code: u16,
    stiffness: f64,
    youngs_modulus_pa: f64,
}

impl<P> Ticks<'_, P> {
    /// Writes the ticks as CSV.
    ///
    /// # Errors
    /// If `out` cannot be written.
    pub fn write_csv(&self, out: &mut dyn Write) -> io::Result<()> {
        writeln!(out, "# {}", self.source())?;
        writeln!(out, "{}", COLUMNS.map(|column| column.name).join(","))?;
        for Row { time_s, target_v, applied_v, code, stiffness, youngs_modulus_pa } in self.rows() {
            writeln!(out, "{time_s},{target_v:.6},{applied_v:.6},{code},{stiffness:.6},{youngs_modulus_pa:.1}")?;
        }
        Ok(())
    }

    /// Writes the ticks as an MCAP or Parquet file.
    ///
    /// # Errors
    /// If `out` cannot be written.
    pub fn write_container(&self, container: Container, out: impl Write + Send) -> Result<()> {
        let sheet = Sheet { name: "stair", source: &self.source(), columns: &COLUMNS };
        let mut writer = Writer::new(container, &sheet, out)?;
        for row in self.rows() {
            let cells = [
                Cell::Number(row.time_s),
                Cell::Number(row.target_v),
                Cell::Number(row.applied_v),
                Cell::Whole(row.code.into()),
                Cell::Number(row.stiffness),
                Cell::Number(row.youngs_modulus_pa),
            ];
            writer.row((row.time_s.max(0.0) * 1e9).round() as u64, &cells)?;
        }
        writer.finish()
    }

    /// Where the rows come from, as a sentence.
    fn source(&self) -> String {
        let (name, rate_hz) = (&self.experiment.name, self.run.rate_hz);
        format!("{name} at {rate_hz} Hz, fixed point; stiffness in volts of equivalent static voltage")
    }

    fn rows(&self) -> impl Iterator<Item = Row> {
        let mut reader = self.experiment.schedule.reader();
        self.samples.iter().enumerate().step_by(self.stride).map(move |(tick, sample)| {
            let time = self.run.time_s(tick);
            Row {
                // Nine decimals hide floating-point errors of decimal times.
                time_s: (time * 1e9).round() / 1e9,
                target_v: reader.at(time),
                applied_v: sample.applied.to_f64(),
                code: sample.code.0,
                stiffness: sample.stiffness.to_f64(),
                youngs_modulus_pa: self.spring.estimate_pa(sample.stiffness),
            }
        })
    }
}
