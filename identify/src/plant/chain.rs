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

use crate::plant::initial_state::InitialState;
use crate::plant::law::Law;
use crate::plant::leakage::{InstantaneousLoss, Loss};
use crate::plant::play_bank::PlayBank;
use crate::plant::relaxation::Relaxation;
use crate::record::signal::{Lag, Piece, Signal};
use simulation::plant_file::{Amplifier, Leakage, PlantFile};

/// Everything between the command and the stiffness that a plant file can hold.
pub struct Chain<'a> {
    /// Largest voltage of the amplifier, either way, in V.
    pub limit_v: f64,
    /// Its fastest rise, in V/s.
    pub rising_v_per_s: f64,
    /// And fall, in V/s.
    pub falling_v_per_s: f64,
    /// Where it begins, in V, if not at the command.
    pub initial_v: Option<f64>,
    /// Time constant of its output's resistance with the spring's capacitance, in s.
    pub output_tau_s: f64,
    /// How late it answers, in s.
    pub delay_s: f64,
    /// Hysteresis.
    pub memory: PlayBank,
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
/// What had been sent before may have stepped at the ends of so many parts of the delay.
const SENT: usize = 6;
/// Higher than any voltage of a record.
const HIGHEST_V: f64 = 1e6;

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
            initial_v: None,
            output_tau_s: 0.0,
            delay_s: number(|amplifier| amplifier.delay_s, 0.0),
            memory: PlayBank::of(file.memory.as_ref()),
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
        let (gain, relaxation, leakage) = self.as_plant_file_tables();
        file.law = self.law.table(gain, &self.law_behind, full_scale_v);
        file.leakage = leakage;
        relaxation.extend(file);
    }

    /// Gain, relaxation and loss as a plant file has them.
    fn as_plant_file_tables(&self) -> (f64, Relaxation, Option<Leakage>) {
        match self.losses.first() {
            Some(loss) if loss.instantaneous > 0.0 => match loss.equivalent_leakage(&self.relaxation) {
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
            signal.before = self.initial_v.unwrap_or(signal.before);
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
    pub fn static_response(&self, signal: &mut Signal) {
        let mut memory = self.memory.clone();
        if memory.table().is_some() {
            signal.map(|voltage| memory.at(voltage));
        }
        if !self.law.is_none() {
            signal.map(|voltage| self.law.at(voltage));
        }
    }

    /// From there to the stiffness; `applied` is what is on the electrodes, `levels_v` becomes what the relaxation needs to
    /// know of it.
    pub fn relax(&self, signal: &mut Signal, applied: &Signal, levels_v: &mut Vec<f64>) {
        if self.relaxation.varies() && self.relaxation.by_state.is_none() {
            applied.middles(levels_v);
        }
        self.follow(signal, &mut InitialState::at_rest(), levels_v);
        if !self.law_behind.is_none() {
            signal.map(|stiffness| self.law_behind.at(stiffness));
        }
    }

    /// What is linear: from where memory and law would have it settle on.
    fn follow(&self, signal: &mut Signal, start: &mut InitialState, levels_v: &[f64]) {
        let mut lost = InstantaneousLoss::default();
        self.losses.iter().for_each(|loss| loss.take(signal, start, &mut lost));
        self.relaxation.pass(signal, start, levels_v);
        if !lost.is_none() {
            lost.off(signal);
        }
    }

    /// What a start adds to the stiffness under the voltage of `signal` at the electrodes. Behind them, what had been sent
    /// before arrives late, and plays may have been left as the highest voltage leaves them.
    pub fn initial_state_response(&self, signal: &mut Signal, start: &mut InitialState, levels_v: &[f64]) {
        let mut output = Lag::at(self.output_tau_s, if self.output_tau_s > 0.0 { start.next_offset_v() } else { 0.0 });
        let late = if self.delay_s > 0.0 { [0.0; SENT].map(|_| start.next_offset_v()) } else { [0.0; SENT] };
        let kept = if self.memory.table().is_some() { start.next_offset_v() } else { 0.0 };
        let (mut rest, mut above) = (self.memory.clone(), self.memory.clone());
        rest.at(signal.before);
        above.at(HIGHEST_V);
        let mut apart = |voltage| match kept {
            0.0 => 0.0,
            _ => kept * (self.law.at(above.at(voltage)) - self.law.at(rest.at(voltage))),
        };
        let mut at_s = 0.0;
        signal.before = 0.0;
        let at_rest = output.value() == 0.0 && kept == 0.0 && late == [0.0; SENT];
        signal.pass(|piece| {
            if at_rest {
                return (0.0, 0.0);
            }
            let part = (at_s + piece.duration_s / 2.0) / self.delay_s * SENT as f64;
            at_s += piece.duration_s;
            let sent = late.get(part as usize).copied().unwrap_or(0.0);
            let (from, to) = output.pass(Piece { from: 0.0, to: 0.0, ..piece });
            (from + sent + apart(piece.from), to + sent + apart(piece.to))
        });
        self.follow(signal, start, levels_v);
    }
}
