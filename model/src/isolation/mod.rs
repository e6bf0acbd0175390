//! Fault isolation in the tick: which fault explains that the readings of the stiffness sensor differ from the model.
//!
//! Important terms:
//!
//! - *residual*: reading minus the model's stiffness, in V; the mean over a *block* of ticks.
//! - *signature*: the sensitivity of the reading to a cause; a filter of the applied voltage and of the model ([`bank`]).
//! - *innovation*: the residual, whitened to first order and divided by its standard deviation.
//! - *restart*: the sums begin anew as long as no sequential test is near its threshold, so that they hold what came after the
//!   beginning of a fault.
//! - *leftover*: the energy of the innovations that a least-squares fit with the signatures of a cause does not explain, in
//!   variances.
//!
//! In each tick a [`State`] gets the applied voltage, the model's stiffness (without the sensor's correction) and the reading:
//!
//! ```text
//! tick -> sums -> (block) -> signatures -> whitening -> sequential tests -> alarm
//!                                              |               | below the restart threshold: restart
//!                                              +-> products of each hypothesis, summed
//!                                                      | every 20 blocks after the alarm
//!                                                      +-> elimination -> leftovers -> verdict
//! ```
//!
//! The work of a block is spread over the ticks of the next one; a decision, over about 17 blocks. The verdict never acts on the
//! output. It stays until [`State::acknowledge`].
//!
//! A cause is named if it leaves no more than noise and the error of its linear signature can leave, and every other cause leaves
//! much more. If another one does not, both are named as ambiguous; if no cause leaves so little, the verdict is unknown. Three
//! decisions in a row have to agree; three in a row against a name withdraw it.
//!
//! The reference in double precision is `simulation::isolation`.

pub mod bank;
mod cause;
mod decision;
mod products;
mod report;
mod sequential;
mod settings;
mod signatures;
mod sums;
pub mod thresholds;

pub use cause::{Cause, Causes};
pub use report::{Finding, Report};
pub use settings::{Settings, Tolerance};

use crate::coefficient::{Gain, Rate, Weight, WideGain};
use crate::units::{ScaledStiffness, Signal, Volts, signal, steps};
use crate::validated::Validated;

/// Length of the arrays of vectors: a power of two, so that a masked index is inside.
const SLOTS: usize = 64;
/// Number of causes.
const CAUSES: usize = Cause::ALL.len();
/// Number of vectors that one tick whitens.
const WHITENED: usize = 25;
/// Largest whitened value, in standard deviations with 10 fraction bits: the products of two of them in all blocks fit 64 bits.
const LARGEST: i32 = i32::MAX >> 7;

/// What the bank says of the spring and its sensor.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Verdict {
    /// The readings agree with the model.
    #[default]
    Quiet,
    /// The readings do not agree with the model, and the cause is not known yet.
    Alarm,
    /// One cause explains the readings, and no other does.
    Named(Cause),
    /// At least these two causes explain the readings; the first leaves least.
    Ambiguous(Cause, Cause),
    /// No cause of the bank explains the readings.
    Unknown,
}

impl Verdict {
    /// Returns the cause that explains most, `None` unless named or ambiguous, and the other one, `None` unless ambiguous.
    pub const fn causes(self) -> (Option<Cause>, Option<Cause>) {
        match self {
            Self::Named(cause) => (Some(cause), None),
            Self::Ambiguous(cause, other) => (Some(cause), Some(other)),
            Self::Quiet | Self::Alarm | Self::Unknown => (None, None),
        }
    }

    /// Returns true if both say the same, whichever of two ambiguous causes leaves less.
    fn is_like(self, other: Self) -> bool {
        match (self, other) {
            (Self::Ambiguous(a, b), Self::Ambiguous(c, d)) => (a, b) == (c, d) || (a, b) == (d, c),
            _ => self == other,
        }
    }

    /// Returns the word for logs and JSON: `quiet`, `alarm`, `named`, `ambiguous` or `unknown`.
    pub const fn name(self) -> &'static str {
        match self {
            Self::Quiet => "quiet",
            Self::Alarm => "alarm",
            Self::Unknown => "unknown",
            Self::Named(_) => "named",
            Self::Ambiguous(..) => "ambiguous",
        }
    }

    /// Returns a number for frames and logs: the state in the upper byte (quiet 0, alarm 1, unknown 2, named 3, ambiguous 4), then the
    /// numbers of the two causes, four bits each, as their places in [`Cause::ALL`].
    pub const fn code(self) -> u16 {
        match self {
            Self::Quiet => 0,
            Self::Alarm => 1 << 8,
            Self::Unknown => 2 << 8,
            Self::Named(cause) => (3 << 8) + cause as u16,
            Self::Ambiguous(cause, other) => (4 << 8) + ((other as u16) << 4) + cause as u16,
        }
    }

    /// Returns the verdict with this number; `None` if there is none.
    pub fn from_code(code: u16) -> Option<Self> {
        let cause = |number: u16| Cause::ALL.get(usize::from(number & 15)).copied();
        let verdict = match code >> 8 {
            0 => Self::Quiet,
            1 => Self::Alarm,
            2 => Self::Unknown,
            3 => Self::Named(cause(code)?),
            4 => Self::Ambiguous(cause(code)?, cause(code >> 4)?),
            _ => return None,
        };
        (verdict.code() == code).then_some(verdict)
    }
}

/// The bank for one spring, sensor and sample time, quantized for the tick.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Config {
    ticks: u32,
    /// One tick of a block, with 32 fraction bits, and one step of a slewed voltage.
    part: i32,
    slew_part: i32,
    /// Ticks of a quarter of a block, less one.
    quarter_mask: u32,
    fewest: u32,
    reach: [i32; 3],
    share: Gain,
    rest: Gain,
    share_over_rest: Weight,
    rate: Rate,
    decays: [Rate; 3],
    slow: [Rate; 2],
    series: [Rate; 3],
    range: i32,
    per_range: WideGain,
    half_widths: [i32; 3],
    per_width: [WideGain; 3],
    starts: [i32; 3],
    per_rest: [WideGain; 3],
    jump: WideGain,
    per_slew: [WideGain; 3],
    per_lag: [WideGain; 3],
    /// With 32 fraction bits; below one half, since the range is at least 50 V.
    whitening: i32,
    correlation: Option<Gain>,
    pinned_below: i32,
    smallest: [i32; bank::SMALLEST.len()],
    /// Coefficients of [`bank::DOUBTFUL`] that are no fault; `None` if each is 0.
    doubt: Option<[i32; bank::DOUBTFUL.len()]>,
    bounds: [(i32, i32); bank::HYPOTHESES.len()],
    alarm: i32,
    restart: i32,
    margin: i64,
}

impl Validated<'_, Settings> {
    /// Quantizes the bank for the tick.
    pub fn quantize(self) -> Config {
        let (settings, sample_time) = (self.settings(), self.sample_time());
        let rate_hz = 1.0 / sample_time.seconds();
        let ticks = bank::block_ticks(rate_hz);
        let block_s = f64::from(ticks) * sample_time.seconds();
        let (share, tau, range) = (settings.plant.share, settings.plant.time_constant_s, settings.range_v);
        let lag = |tau_s: f64| Rate::new(crate::units::lag_fraction(block_s, tau_s).min(bank::FASTEST));
        let slow = bank::SLOW_TAUS.map(|times| lag(times * tau));
        let (sigma_v, correlation) = settings.block_noise(block_s);
        // Below, signatures of the size of the range would not fit.
        let whitened_v =
            (sigma_v * libm::sqrt(1.0 - correlation * correlation)).max(range * 1024.0 / f64::from(LARGEST));
        let bits = |value: f64, fraction: u32| steps(value, f64::from(1u32 << fraction)) as i32;
        Config {
            ticks,
            part: 1 << (32 - ticks.trailing_zeros()),
            slew_part: (bank::SLEW_TICKS as i32) << (32 - ticks.trailing_zeros()),
            quarter_mask: ticks / 4 - 1,
            fewest: (settings.readings(block_s) * bank::FEWEST).div_ceil(256),
            reach: bank::SLEW_RATES
                .map(|rate| signal(rate * range / tau * sample_time.seconds() * f64::from(bank::SLEW_TICKS)).to_bits()),
            share: Gain::new(share),
            rest: Gain::new(1.0 - share),
            share_over_rest: Weight::new(share / (1.0 - share)),
            rate: lag(tau),
            decays: [lag(tau), slow[0], slow[1]],
            slow,
            series: bank::LAG_TAUS.map(|times| lag(times * tau)),
            range: signal(range).to_bits(),
            per_range: WideGain::new(1.0 / range),
            half_widths: bank::PLAYS.map(|width| signal(0.5 * width * range).to_bits()),
            per_width: bank::PLAYS.map(|width| WideGain::new(1.0 / width)),
            starts: bank::LIMITS.map(|start| signal(start * range).to_bits()),
            per_rest: bank::LIMITS.map(|start| WideGain::new(1.0 / (1.0 - start))),
            // The jumps have 10 fraction bits.
            jump: WideGain::new(1024.0 / (2.0 * range)),
            per_slew: bank::SLEW_RATES.map(|rate| WideGain::new(rate * block_s / tau)),
            per_lag: bank::LAG_TAUS.map(|times| WideGain::new(block_s / (times * tau))),
            whitening: 2 * bits(1.0 / (1024.0 * whitened_v), 31),
            correlation: (correlation > 0.0).then(|| Gain::new(correlation)),
            pinned_below: signal(-3.0 * sigma_v).to_bits(),
            smallest: bank::SMALLEST.map(|(_, size)| bits(size, 28)),
            doubt: (settings.tolerance != Tolerance::NONE).then(|| {
                let Tolerance { time_constant, share: of_share, gain } = settings.tolerance;
                [libm::log1p(time_constant), of_share * share, gain].map(|size| bits(size, 28))
            }),
            bounds: bank::HYPOTHESES.map(|hypothesis| (bits(hypothesis.lowest, 16), bits(hypothesis.highest, 16))),
            alarm: bits(settings.alarm_nats, 20),
            restart: bits(thresholds::RESTART_NATS, 20),
            margin: i64::from(bits(2.0 * settings.margin_nats, 20)),
        }
    }
}

/// State of the bank; the default is a spring at rest at 0 V.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct State {
    sums: sums::Sums,
    means: sums::Means,
    filters: signatures::Filters,
    vectors: [i32; SLOTS],
    last: [i32; SLOTS],
    whitened: products::Whitened,
    /// Place of the present block in its group.
    place: usize,
    /// Number of blocks of the group whose products are to be added.
    held: usize,
    tests: sequential::Tests,
    products: products::Products,
    mode: products::Mode,
    decision: decision::Decision,
    /// Tick of the present block in which there is work to do next.
    next: u32,
    alarmed: bool,
    blocks: u32,
    age: u32,
    since_decision: u32,
    /// Largest energy that an error of the model within its tolerance adds to the sums, in variances with 20 fraction bits.
    doubted: i64,
    pinned: bool,
    pinned_at: Option<i32>,
    released: bool,
}

impl State {
    /// Creates the state of a spring at rest at 0 V. Inlined, so that a program builds it in its place: as a constant, of
    /// which nearly all is zero, it would be in the image, otherwise in a copy on the stack.
    #[inline(always)]
    pub const fn at_rest() -> Self {
        Self {
            sums: sums::Sums::NEW,
            means: sums::Means::NEW,
            filters: signatures::Filters::NEW,
            vectors: [0; SLOTS],
            last: [0; SLOTS],
            whitened: [[0; products::GROUP]; SLOTS],
            place: 0,
            held: 0,
            tests: sequential::Tests::NEW,
            products: products::Products::NEW,
            mode: products::Mode::NEW,
            decision: decision::Decision::NEW,
            next: IDLE,
            alarmed: false,
            blocks: 0,
            age: 0,
            since_decision: 0,
            doubted: 0,
            pinned: false,
            pinned_at: None,
            released: false,
        }
    }
}

impl Default for State {
    fn default() -> Self {
        Self::at_rest()
    }
}

/// First tick of each part of a block's work.
const WHITEN: u32 = 25;
const TEST: u32 = 49;
const ASSESS: u32 = TEST + sequential::STEPS;
/// First tick of the steps that add up the products; the last of them, the longest, are not in the ticks that add up the sums.
const ADD: u32 = 55;
const CLOSE: u32 = ADD + products::STEPS as u32;
/// First tick of the steps of a decision, which takes about 17 blocks with the 30 that are left in a block of 128 ticks.
const DECIDE: u32 = 98;
/// No tick: there is no work left.
const IDLE: u32 = u32::MAX;
const _: () = assert!(bank::VECTORS < SLOTS && signatures::STEPS <= WHITEN);
const _: () = assert!(WHITEN + (bank::VECTORS as u32 + 1).div_ceil(WHITENED as u32) <= TEST);
const _: () = assert!(bank::ROUND as usize >= products::GROUP, "no decision before a group is complete");
const _: () = assert!(ASSESS <= ADD && CLOSE < DECIDE, "the sums are complete before a decision begins");

impl Config {
    /// Returns the number of ticks of a block.
    pub const fn block_ticks(&self) -> u32 {
        self.ticks
    }

    /// Advances the bank by one tick: applied voltage, the model's stiffness just after it was applied without the sensor's
    /// correction, and the reading at that time. No heap, no float, no panic, no unbounded loop.
    #[inline]
    pub fn tick(&self, state: &mut State, applied: Volts, model: ScaledStiffness, reading: Option<ScaledStiffness>) {
        let step = state.sums.keep(applied, model, reading);
        if step as usize % sums::TOGETHER == sums::TOGETHER - 1 {
            self.add(state, step);
        } else if step == state.next {
            self.work(state, step);
        }
    }

    /// Adds the ticks that are kept; the last of them is `step`.
    #[inline(never)]
    fn add(&self, state: &mut State, step: u32) {
        state.sums.add(self);
        if step + 1 == self.ticks {
            self.end_block(state);
        } else if step == state.next {
            self.work(state, step);
        }
    }

    /// Begins the work on the block that has ended.
    #[inline(never)]
    fn end_block(&self, state: &mut State) {
        state.means = state.sums.finish(self);
        // A sensor that rounds coarsely repeats readings at many values; one that is stuck or saturated, at one.
        if state.means.pinned {
            state.means.pinned = *state.pinned_at.get_or_insert(state.means.last_reading) == state.means.last_reading;
        }
        state.next = 0;
    }

    /// Does the work of one tick for the block before, and finds the next tick with work.
    #[inline(never)]
    fn work(&self, state: &mut State, step: u32) {
        state.next = step + 1;
        if step >= DECIDE {
            self.decide(state);
        } else if step < signatures::STEPS {
            signatures::step(self, state, step);
            if step + 1 == signatures::STEPS {
                state.next = WHITEN;
            }
        } else if !state.means.usable {
            if step == WHITEN {
                // A gap in the readings is a part of the time since the restart.
                state.age = state.age.saturating_add(1);
            }
            self.decide(state);
        } else if step < TEST {
            self.whiten(state, (step - WHITEN) as usize);
            if step > WHITEN {
                state.next = TEST;
            }
        } else if step < ASSESS {
            state.tests.step(self, step - TEST, &state.whitened, state.place);
            if step + 1 == ASSESS {
                self.assess(state);
            }
        } else if state.held == 0 {
            // The alarm has been acknowledged.
            state.rest();
        } else if step < CLOSE {
            state.products.step(step - ADD, state.mode, &state.whitened);
        } else {
            self.close(state);
        }
    }

    /// Whitens a part of the vectors.
    #[inline(never)]
    fn whiten(&self, state: &mut State, part: usize) {
        state.vectors[bank::VECTORS] = state.means.residual;
        let block = state.place & (products::GROUP - 1);
        let whitened = |difference: i32| {
            (((i64::from(difference) * i64::from(self.whitening)) >> 32) as i32).clamp(-LARGEST - 1, LARGEST)
        };
        let vectors = state.vectors.as_chunks::<WHITENED>().0.get(part);
        let slots = vectors.zip(state.whitened.as_chunks_mut::<WHITENED>().0.get_mut(part));
        let Some(((new, slots), last)) = slots.zip(state.last.as_chunks_mut::<WHITENED>().0.get_mut(part)) else {
            return;
        };
        if let Some(gain) = self.correlation {
            for ((new, slot), last) in new.iter().zip(slots).zip(last) {
                slot[block] = whitened(new.saturating_sub(gain.times(Signal::from_bits(*last)).to_bits()));
                *last = *new;
            }
        } else {
            for (new, slot) in new.iter().zip(slots) {
                slot[block] = whitened(*new);
            }
        }
    }

    /// Restarts the sums, or counts the block.
    #[inline(never)]
    fn assess(&self, state: &mut State) {
        let highest = state.tests.highest;
        if !state.alarmed && highest < self.restart {
            state.restart();
            state.rest();
            return;
        }
        state.age = state.age.saturating_add(1);
        let doubt = i64::from(state.tests.doubt);
        state.doubted = if state.blocks == 0 { 0 } else { state.doubted } + doubt * doubt;
        state.blocks += 1;
        state.held += 1;
        state.place += 1;
        if state.means.pinned && state.means.residual < self.pinned_below {
            state.pinned = true;
        } else if !state.means.pinned && state.pinned {
            state.released = true;
        }
        if highest >= self.alarm {
            state.alarmed = true;
        }
        state.since_decision = state.since_decision.saturating_add(1);
        state.mode = products::Mode {
            fresh: state.blocks as usize == state.held,
            halve: state.blocks >= bank::MOST_BLOCKS,
            copy: state.alarmed && state.since_decision >= bank::ROUND && state.decision.idle(),
        };
        if state.held == products::GROUP || state.mode.halve || state.mode.copy {
            state.next = ADD;
        } else {
            state.rest();
        }
    }

    /// Ends the work on the sums.
    #[inline(never)]
    fn close(&self, state: &mut State) {
        state.held = 0;
        if state.mode.copy {
            state.decision.begin(state.blocks, state.doubted);
            state.since_decision = 0;
        }
        if state.mode.halve {
            state.blocks >>= 1;
            state.doubted >>= 1;
        }
        state.rest();
    }

    #[inline(always)]
    fn decide(&self, state: &mut State) {
        if !state.decision.idle() {
            state.decision.step(self, &state.products.copy, state.released);
        } else {
            state.next = IDLE;
        }
    }
}

impl State {
    /// Leaves no work for the present block but that of a decision.
    fn rest(&mut self) {
        self.next = if self.decision.idle() { IDLE } else { DECIDE };
    }

    fn restart(&mut self) {
        self.filters.restart();
        self.held = 0;
        (self.blocks, self.age, self.since_decision) = (0, 0, 0);
        (self.pinned, self.pinned_at, self.released) = (false, None, false);
    }

    /// Ends an alarm: the bank looks for a fault anew, and one that lasts is found again.
    pub fn acknowledge(&mut self) {
        self.alarmed = false;
        self.tests = sequential::Tests::NEW;
        self.decision.reset();
        self.restart();
    }

    /// Returns what the bank says.
    pub fn verdict(&self) -> Verdict {
        match self.decision.verdict {
            Verdict::Quiet if self.alarmed => Verdict::Alarm,
            verdict => verdict,
        }
    }

    /// Returns the number of decisions made since the start.
    pub fn decisions(&self) -> u32 {
        self.decision.rounds
    }

    /// Returns for how many blocks the fault has been there, those without readings included: since the last restart of the sums; 0
    /// without an alarm.
    pub fn since_blocks(&self) -> u32 {
        if self.alarmed { self.age } else { 0 }
    }

    /// Returns the mean voltage of the last block, in V.
    pub fn mean_voltage(&self) -> Volts {
        Volts(Signal::from_bits(self.means.voltage))
    }

    /// Returns what the bank says, in the numbers of the tick.
    pub fn report(&self) -> Report {
        let decision::Decision { size, energies, decided, .. } = self.decision;
        Report { verdict: self.verdict(), since_blocks: self.since_blocks(), size, energies, blocks: decided }
    }
}

#[cfg(test)]
mod tests;
