//! The simulation that is judged, as a plant file has it: the blocks that are there before any cause is looked for.

use anyhow::Result;
use model::Plant;

use super::relaxation::Relaxation;
use super::signal::{Lag, Signal};
use crate::bad_input;
use crate::plant_file::{Law, PlantFile};

/// A plant file's chain, in the order of [`model::extended`].
#[derive(Clone, Debug, PartialEq)]
pub struct Base {
    file: PlantFile,
    /// Its relaxation, which causes may change.
    pub relaxation: Relaxation,
}

impl Base {
    /// The paper's plant.
    pub fn paper() -> Self {
        let Plant { share, time_constant_s } = Plant::PAPER;
        Self { file: Plant::PAPER.into(), relaxation: Relaxation::plain(share, time_constant_s) }
    }

    /// The chain of a plant file.
    ///
    /// # Errors
    /// [`crate::BadInput`] for one with more than two relaxations.
    pub fn new(file: PlantFile) -> Result<Self> {
        match Relaxation::of(&file.relaxation) {
            Some(relaxation) => Ok(Self { file, relaxation }),
            None => bad_input!("--plant: {} time constants; expected one or two", file.relaxation.tau_s.len()),
        }
    }

    /// The file, to be extended.
    pub fn file(&self) -> &PlantFile {
        &self.file
    }

    /// From the command to the spring's electrodes.
    pub(super) fn amplify(&self, signal: &mut Signal) {
        let Some(amplifier) = &self.file.amplifier else { return };
        if let Some(limit) = amplifier.limit_v {
            signal.map(|voltage| voltage.min(limit));
        }
        if let Some(slew) = amplifier.slew_v_per_s {
            *signal = signal.slewed(slew);
        }
        if let Some(delay) = amplifier.delay_s.filter(|delay| *delay > 0.0) {
            *signal = signal.delayed(delay);
        }
    }

    /// Memory, static law and leakage.
    pub(super) fn drive(&self, signal: &mut Signal) {
        if let Some(memory) = &self.file.memory {
            let mut plays: Vec<(f64, f64, f64)> =
                memory.thresholds_v.iter().zip(&memory.weights).map(|(&r, &weight)| (r, weight, 0.0)).collect();
            let mut at = |voltage: f64| {
                plays.iter_mut().fold(memory.direct * voltage, |sum, (threshold, weight, value)| {
                    *value = value.clamp(voltage - *threshold, voltage + *threshold);
                    sum + *weight * *value
                })
            };
            signal.before = at(signal.before);
            signal.pass(|piece| (at(piece.from), at(piece.to)));
        }
        if let Some(law) = &self.file.law {
            signal.map(|voltage| straight(&law.voltage_v, &law.stiffness, voltage));
        }
        if let Some(leakage) = &self.file.leakage {
            let mut lag = Lag::at(leakage.tau_s, signal.before);
            signal.before *= 1.0 - leakage.share;
            signal.pass(|piece| {
                let (start, end) = lag.pass(piece);
                (piece.from - leakage.share * start, piece.to - leakage.share * end)
            });
        }
    }
}

/// Puts a law behind a file's own: at its points, or at some from 0 to `full_scale_v`.
pub(super) fn extend_law(file: &mut PlantFile, full_scale_v: f64, points: u32, law: impl Fn(f64) -> f64) {
    if let Some(own) = &mut file.law {
        own.stiffness.iter_mut().for_each(|stiffness| *stiffness = law(*stiffness));
        return;
    }
    let voltage_v: Vec<f64> = (0..points).map(|i| full_scale_v * f64::from(i) / f64::from(points - 1)).collect();
    let mut stiffness: Vec<f64> = voltage_v.iter().map(|&voltage| law(voltage)).collect();
    // A chord is off on one side of its bow: half of that to either side.
    let bow = |pair: &[f64]| law((pair[0] + pair[1]) / 2.0) - (law(pair[0]) + law(pair[1])) / 2.0;
    let bows: Vec<f64> = voltage_v.windows(2).map(bow).collect();
    for (point, value) in stiffness.iter_mut().enumerate().skip(1) {
        let after = bows.get(point).copied().unwrap_or(bows[point - 1]);
        *value += (bows[point - 1] + after) / 4.0;
    }
    file.law = Some(Law { voltage_v, stiffness });
}

/// Straight between points and beyond them.
fn straight(x: &[f64], y: &[f64], at: f64) -> f64 {
    let upper = x.partition_point(|&point| point <= at).clamp(1, x.len() - 1);
    let slope = (y[upper] - y[upper - 1]) / (x[upper] - x[upper - 1]);
    y[upper - 1] + slope * (at - x[upper - 1])
}
