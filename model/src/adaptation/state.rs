//! The decision at the end of each block: which parameters the model should have next.

use super::{Observation, Parameters, Settings};
use crate::estimator::Plant;
use crate::isolation::{Cause, Report, Verdict, bank, thresholds};

/// Blocks that the bank needs to name an error after an exchange: a round to the first decision, then those that have to agree, and one
/// more.
const TRIAL_BLOCKS: u32 = (thresholds::AGREED as u32 + 2) * bank::ROUND;
/// Blocks after which a trial ends that was not quiet, and after which a bank that cannot tell a cause from another begins anew.
const LONGEST_TRIAL_BLOCKS: u32 = 4 * TRIAL_BLOCKS;
/// Time constants of the stored model after which a model that has moved has forgotten that it was another one.
const SETTLING: f64 = 3.0;
/// Largest ratio of the size that a takeover leaves to the size that was taken over.
const SHRINKS: f64 = 0.5;
/// Largest ratio of the residual's energy in a block after a takeover to that before.
const SHRINKS_ENERGY: f64 = 1.0 / 16.0;
/// Largest number of takeovers in a row without a confirmation.
const MOST_TAKEOVERS: u8 = 4;

/// What the adaptation does.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
#[repr(u8)]
pub enum Phase {
    /// The adaptation waits for a cause that it can take over.
    #[default]
    Watching,
    /// The adaptation moves a parameter.
    Moving,
    /// The adaptation has moved a parameter, and waits until the model has forgotten that it had another one.
    Settling,
    /// The adaptation has taken over a parameter, which is not confirmed yet.
    Trial,
    /// The sensor is not trusted, or the bank suspects it: nothing moves.
    Frozen,
    /// The adaptation goes back to earlier parameters.
    Returning,
    /// The adaptation has gone back, and does nothing until [`State::switch`] is called.
    Stopped,
    /// The adaptation is switched off, and the stored model runs.
    Off,
}

impl Phase {
    /// All phases, in the order of their numbers.
    pub const ALL: [Self; 8] = [
        Self::Watching,
        Self::Moving,
        Self::Settling,
        Self::Trial,
        Self::Frozen,
        Self::Returning,
        Self::Stopped,
        Self::Off,
    ];

    /// Returns the word for logs and JSON.
    pub const fn name(self) -> &'static str {
        match self {
            Self::Watching => "watching",
            Self::Moving => "moving",
            Self::Settling => "settling",
            Self::Trial => "trial",
            Self::Frozen => "frozen",
            Self::Returning => "returning",
            Self::Stopped => "stopped",
            Self::Off => "off",
        }
    }
}

/// State of the adaptation; by default the stored model runs.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct State {
    now: Parameters,
    goal: Parameters,
    /// The last confirmed parameters.
    pub(super) confirmed: Parameters,
    /// The last proposal, which an exchange makes the running parameters.
    proposed: Parameters,
    /// The last takeover that is not confirmed.
    trial: Option<Takeover>,
    takeovers: u8,
    blocks_since_exchange: u32,
    /// Whether the bank is to begin anew, which it does with an exchange for the same parameters.
    anew: bool,
    phase: Phase,
    /// What follows [`Phase::Returning`].
    after_return: Phase,
}

/// What was taken over.
#[derive(Clone, Copy, Debug, PartialEq)]
struct Takeover {
    cause: Cause,
    /// Magnitude of the size, relative to the parameter.
    magnitude: f64,
    /// Energy of the residual in a block, in variances, without that of the noise.
    energy: f64,
}

/// Mean energy of the residual in a block since the fault began, in variances, without that of the noise.
fn energy(report: &Report) -> f64 {
    let blocks = report.since_blocks.clamp(1, bank::MOST_BLOCKS);
    (report.energies().0 / f64::from(blocks) - 1.0).max(0.0)
}

/// Returns true for the causes that are taken over.
const fn is_adaptable(cause: Cause) -> bool {
    matches!(cause, Cause::GainError | Cause::TimeConstant | Cause::InstantaneousShare)
}

/// Returns true if the sensor was trusted since the fault began.
const fn trusted_throughout(seen: &Observation) -> bool {
    seen.trusted_blocks >= seen.report.since_blocks
}

impl State {
    /// Returns the running parameters.
    pub const fn parameters(&self) -> Parameters {
        self.now
    }

    /// Returns what the adaptation does.
    pub const fn phase(&self) -> Phase {
        self.phase
    }

    /// Switches the adaptation off, so that the model goes back to the stored one and stays there, or on again. Switching on also ends
    /// [`Phase::Stopped`].
    pub fn switch(&mut self, on: bool) {
        match (on, self.phase) {
            (true, Phase::Returning) => self.after_return = Phase::Watching,
            (true, Phase::Stopped | Phase::Off) => self.phase = Phase::Watching,
            (true, _) | (false, Phase::Off) => {}
            (false, _) => {
                self.undo(Parameters::STORED);
                self.after_return = Phase::Off;
            }
        }
    }

    /// Advances by one block of `block_s` s. `plant` is the stored model, `range_v` the highest voltage of the amplifier, in V. Returns
    /// the parameters to be exchanged at the end of the next block if the loop is settled then; `None` if those that run stay. Floating
    /// point: not for the tick.
    pub fn update(
        &mut self,
        settings: &Settings,
        seen: &Observation,
        plant: Plant,
        range_v: f64,
        block_s: f64,
    ) -> Option<Parameters> {
        self.blocks_since_exchange = self.blocks_since_exchange.saturating_add(1);
        if seen.exchanged {
            (self.now, self.blocks_since_exchange, self.anew) = (self.proposed, 0, false);
        }
        let trusted = seen.trusted_blocks > 0;
        match self.phase {
            Phase::Stopped | Phase::Off => {}
            Phase::Returning if self.now == self.goal => self.phase = self.after_return,
            Phase::Moving if self.now == self.goal => self.phase = Phase::Settling,
            // The bank begins anew with each exchange, and says nothing of a model that has just moved.
            Phase::Returning | Phase::Moving => {}
            Phase::Settling => {
                if f64::from(self.blocks_since_exchange) * block_s >= SETTLING * plant.time_constant_s {
                    (self.anew, self.phase) = (true, Phase::Trial);
                }
            }
            Phase::Watching | Phase::Trial | Phase::Frozen if self.anew => {}
            Phase::Watching | Phase::Trial | Phase::Frozen => {
                self.phase = match self.trial {
                    _ if !trusted => Phase::Frozen,
                    Some(_) => Phase::Trial,
                    None => Phase::Watching,
                };
                if trusted {
                    self.judge(settings, seen, plant, settings.excitation * range_v);
                }
            }
        }
        let moves = self.phase == Phase::Returning || self.phase == Phase::Moving && trusted;
        let most = settings.rate_per_s * block_s;
        let step = |from: f64, to: f64| from + (to - from).max(-most).min(most);
        self.proposed = if moves { self.now.combined(self.goal, step) } else { self.now };
        (moves || self.anew).then_some(self.proposed)
    }

    /// Draws the conclusion from what the bank says of the running model; the sensor is trusted. `enough_v` is the excitation, in V.
    fn judge(&mut self, settings: &Settings, seen: &Observation, plant: Plant, enough_v: f64) {
        let moved = seen.moved_since_exchange.to_f64() >= enough_v;
        if let Some(takeover) = self.trial
            && moved
        {
            let quiet = seen.report.verdict == Verdict::Quiet;
            if quiet && self.blocks_since_exchange >= TRIAL_BLOCKS {
                return self.confirm();
            }
            if !quiet && self.blocks_since_exchange >= LONGEST_TRIAL_BLOCKS {
                let shrinks = energy(&seen.report) <= SHRINKS_ENERGY * takeover.energy;
                return if shrinks { self.confirm() } else { self.undo(self.confirmed) };
            }
        }
        match seen.report.verdict {
            Verdict::Named(cause) if is_adaptable(cause) => {
                if seen.moved.to_f64() >= enough_v {
                    self.consider(settings, seen, cause, plant);
                }
            }
            Verdict::Named(Cause::ReadingOffset | Cause::Drift | Cause::SensorSaturation | Cause::StuckSensor) => {
                self.suspect(true)
            }
            Verdict::Unknown => {
                let shrinks = |takeover: Takeover| energy(&seen.report) <= SHRINKS_ENERGY * takeover.energy;
                self.suspect(!self.trial.is_some_and(shrinks));
            }
            // What happened in the meantime, or readings that were not trusted, may be what keeps it from naming one.
            Verdict::Ambiguous(one, other) => {
                let hopeless = !trusted_throughout(seen) || seen.report.since_blocks >= LONGEST_TRIAL_BLOCKS;
                self.anew = (is_adaptable(one) || is_adaptable(other)) && hopeless;
            }
            Verdict::Quiet | Verdict::Alarm | Verdict::Named(_) => {}
        }
    }

    /// Takes over the cause that the bank has named if its size is known well enough.
    fn consider(&mut self, settings: &Settings, seen: &Observation, cause: Cause, plant: Plant) {
        let (size, deviation) = seen.report.size();
        let unit = if cause == Cause::InstantaneousShare { self.now.share * plant.share } else { 1.0 };
        let next = self.now.after(cause, size, plant);
        if !(deviation > 0.0 && 1.96 * deviation <= settings.precision * unit) {
            return;
        }
        if !trusted_throughout(seen) {
            self.anew = true;
            return;
        }
        let now = Takeover { cause, magnitude: libm::fabs(size) / unit, energy: energy(&seen.report) };
        let shrinks = |last: Takeover| last.cause != cause || now.magnitude <= SHRINKS * last.magnitude;
        let goal = next.within(settings.bounds());
        if goal == self.now {
            self.undo(Parameters::STORED);
        } else if self.takeovers == MOST_TAKEOVERS || !self.trial.is_none_or(shrinks) {
            self.undo(self.confirmed);
        } else {
            (self.goal, self.phase) = (goal, Phase::Moving);
            (self.trial, self.takeovers) = (Some(now), self.takeovers + 1);
        }
    }

    /// The bank suspects the sensor, or knows no cause: what was taken over last may be wrong.
    fn suspect(&mut self, wrong: bool) {
        self.phase = Phase::Frozen;
        if wrong && self.trial.is_some() {
            self.undo(self.confirmed);
        }
    }

    fn confirm(&mut self) {
        (self.confirmed, self.trial, self.takeovers) = (self.now, None, 0);
        (self.phase, self.anew) = (Phase::Watching, true);
    }

    fn undo(&mut self, goal: Parameters) {
        (self.goal, self.confirmed, self.phase, self.after_return) = (goal, goal, Phase::Returning, Phase::Stopped);
        (self.trial, self.takeovers) = (None, 0);
    }
}
