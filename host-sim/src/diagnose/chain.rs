//! The chain from the command to the stiffness, in the order of [`model::extended`]:
//!
//! ```text
//! command -> limit -> slew -> output's lag -> delay -> memory -> law -> leakage -> relaxation -> law behind -> stiffness
//! ```
//!
//! No plant file holds a law behind the relaxation: it is written as one before it, which settles at the same stiffness.
//!
//! A plant file says what it is at first, effects change it; it runs, and writes itself into a plant file. So what is
//! fitted is what is written: a second limit is the lower one, a second slew the slower, delays add up, memories and laws
//! stand one behind the other, the relaxation's numbers are replaced.

use super::bank::Bank;
use super::law::Law;
use super::leakage::{Loss, Lost};
use super::relaxation::Relaxation;
use super::signal::{Lag, Signal};
use crate::plant_file::{Amplifier, Leakage, PlantFile};

/// Everything between the command and the stiffness that a plant file can hold.
pub struct Chain<'a> {
    /// Largest voltage of the amplifier, either way, in V.
    pub limit_v: f64,
    /// Its fastest rise, in V/s.
    pub rising_v_per_s: f64,
    /// And fall, in V/s.
    pub falling_v_per_s: f64,
    /// Time constant of its output's resistance with the spring's capacitance, in s.
    pub output_tau_s: f64,
    /// How late it answers, in s.
    pub delay_s: f64,
    /// Hysteresis.
    pub memory: Bank,
    /// The static law.
    pub law: Law<'a>,
    /// Another one, behind the relaxation.
    pub law_behind: Law<'a>,
    /// Losses of charge; a plant file holds the first.
    pub losses: Vec<Loss>,
    /// What comes at once, and what later.
    pub relaxation: Relaxation,
}

/// A jump that falls on a row's moment counts as before it, however sums of times are rounded: parts of the delay.
const ROUNDING: f64 = 1e-5;

impl<'a> Chain<'a> {
    /// Of a plant file, whose relaxation is given.
    pub fn of(file: &'a PlantFile, relaxation: Relaxation) -> Self {
        let amplifier = file.amplifier.as_ref();
        let number = |of: fn(&Amplifier) -> Option<f64>, else_value| amplifier.and_then(of).unwrap_or(else_value);
        let slew_v_per_s = number(|amplifier| amplifier.slew_v_per_s, f64::INFINITY);
        Self {
            limit_v: number(|amplifier| amplifier.limit_v, f64::INFINITY),
            rising_v_per_s: slew_v_per_s,
            falling_v_per_s: slew_v_per_s,
            output_tau_s: 0.0,
            delay_s: number(|amplifier| amplifier.delay_s, 0.0),
            memory: Bank::of(file.memory.as_ref()),
            law: Law::of(file.law.as_ref()),
            law_behind: Law::of(None),
            losses: file.leakage.iter().map(Loss::of).collect(),
            relaxation,
        }
    }

    /// Writes itself into a plant file, for a record up to `full_scale_v`.
    pub fn write(&self, file: &mut PlantFile, full_scale_v: f64) {
        let amplifier = Amplifier {
            limit_v: Some(self.limit_v).filter(|limit| limit.is_finite()),
            // Of two rates a file holds the faster: it is a bound for both.
            slew_v_per_s: Some(self.rising_v_per_s.max(self.falling_v_per_s)).filter(|slew| slew.is_finite()),
            delay_s: Some(self.delay_s).filter(|delay| *delay > 0.0),
        };
        file.amplifier = (amplifier != Amplifier::default()).then_some(amplifier);
        if self.memory.fits() {
            file.memory = self.memory.table();
        }
        let (gain, relaxation, leakage) = self.passed();
        file.law = self.law.table(gain, &self.law_behind, full_scale_v);
        file.leakage = leakage;
        relaxation.extend(file);
    }

    /// Gain, relaxation and loss as a plant file has them.
    fn passed(&self) -> (f64, Relaxation, Option<Leakage>) {
        match self.losses.first() {
            Some(loss) if loss.at_once > 0.0 => match loss.passed(&self.relaxation) {
                Some((gain, share, leakage)) => (gain, Relaxation { share, ..self.relaxation }, Some(leakage)),
                None => (1.0, self.relaxation, None),
            },
            loss => (1.0, self.relaxation, loss.map(|loss| Leakage { share: loss.share, tau_s: loss.tau_s })),
        }
    }

    /// From the command to the spring's electrodes.
    pub fn amplify(&self, signal: &mut Signal) {
        if self.limit_v.is_finite() {
            signal.map(|voltage| voltage.clamp(-self.limit_v, self.limit_v));
        }
        if self.rising_v_per_s.is_finite() || self.falling_v_per_s.is_finite() {
            *signal = signal.slewed(self.rising_v_per_s, self.falling_v_per_s);
        }
        if self.output_tau_s > 0.0 {
            let mut output = Lag::at(self.output_tau_s, signal.before);
            signal.pass(|piece| output.pass(piece));
        }
        if self.delay_s > 0.0 {
            *signal = signal.delayed(self.delay_s * (1.0 - ROUNDING));
        }
    }

    /// From the electrodes to where the stiffness would settle.
    pub fn settle(&self, signal: &mut Signal) {
        let mut memory = self.memory.clone();
        if memory.table().is_some() {
            signal.map(|voltage| memory.at(voltage));
        }
        if !self.law.is_none() {
            signal.map(|voltage| self.law.at(voltage));
        }
    }

    /// From there to the stiffness, from `ahead_v` of where the lags would be at rest; `applied` is what is on the electrodes,
    /// `levels_v` room to work in.
    pub fn relax(&self, signal: &mut Signal, ahead_v: f64, applied: &Signal, levels_v: &mut Vec<f64>) {
        if self.relaxation.varies() && self.relaxation.by_state.is_none() {
            applied.middles(levels_v);
        }
        let mut lost = Lost::default();
        self.losses.iter().for_each(|loss| loss.take(signal, &mut lost));
        signal.before += ahead_v;
        self.relaxation.pass(signal, levels_v);
        if !lost.is_none() {
            lost.off(signal);
        }
        if !self.law_behind.is_none() {
            signal.map(|stiffness| self.law_behind.at(stiffness));
        }
    }
}
