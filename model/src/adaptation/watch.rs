//! What the adaptation needs to know of each tick, in fixed point, and what is known at the end of a block.

use crate::amplifier::Limits;
use crate::controller::Output;
use crate::feedback::Sensor;
use crate::isolation::{self, Report};
use crate::units::{Signal, Volts, signal};

/// What bank, sensor and voltage have shown by the end of a block.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Observation {
    /// What the bank says.
    pub report: Report,
    /// Distance between the lowest and the highest mean voltage of a block since the fault began, in V.
    pub moved: Volts,
    /// Distance between the lowest and the highest mean voltage of a block since the last exchange, in V.
    pub moved_since_exchange: Volts,
    /// Number of blocks since the sensor was not trusted last; saturates.
    pub trusted_blocks: u32,
    /// Whether the last proposal has been exchanged at the end of this block.
    pub exchanged: bool,
}

/// Part of the amplifier's range within which the estimate of a settled loop is from its target.
const SETTLED: f64 = 0.01;

/// Returns the largest distance of the estimate from the target in an exchange, in V, for a highest voltage in V.
pub fn settled_within(range_v: f64) -> Volts {
    Volts(signal(SETTLED * range_v))
}

/// Lowest and highest of some voltages.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
struct Span {
    lowest: Signal,
    highest: Signal,
}

impl Span {
    const NEW: Self = Self { lowest: Signal::MAX, highest: Signal::MIN };

    fn add(&mut self, voltage: Signal) {
        self.lowest = self.lowest.min(voltage);
        self.highest = self.highest.max(voltage);
    }

    /// Distance of the two; 0 V of no voltage.
    fn width(self) -> Volts {
        Volts(self.highest.saturating_sub(self.lowest).max(Signal::ZERO))
    }
}

/// State of what is watched in each tick.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Watch {
    ticks: u32,
    since_fault: Span,
    since_exchange: Span,
    trusted: bool,
    trusted_blocks: u32,
    settled: bool,
}

impl Watch {
    /// Before the first tick. A constant, as that of the bank.
    pub const NEW: Self = Self {
        ticks: 0,
        since_fault: Span::NEW,
        since_exchange: Span::NEW,
        trusted: true,
        trusted_blocks: 0,
        settled: false,
    };

    /// Advances by one tick with its output, after the bank's tick. Returns true at the end of a block of the bank. `tolerance` is the
    /// largest distance of the estimate from the target of a settled loop, in V. No float, no panic, no loop.
    #[inline]
    pub fn tick(
        &mut self,
        bank: &isolation::Config,
        state: &isolation::State,
        output: &Output,
        tolerance: Volts,
    ) -> bool {
        self.trusted &= output.sensor.is_some_and(Sensor::is_trusted);
        self.ticks += 1;
        if self.ticks < bank.block_ticks() {
            return false;
        }
        let error = output.target.0.saturating_sub(output.stiffness.0).saturating_abs();
        self.settled = error <= tolerance.0 && output.limits == Limits::NONE;
        self.trusted_blocks = if self.trusted { self.trusted_blocks.saturating_add(1) } else { 0 };
        (self.ticks, self.trusted) = (0, true);
        if state.since_blocks() == 0 {
            self.since_fault = Span::NEW;
        }
        let voltage = state.mean_voltage().0;
        self.since_fault.add(voltage);
        self.since_exchange.add(voltage);
        true
    }

    /// True at the end of a block if an exchange is allowed: the loop is settled and no limit acts.
    pub const fn settled(&self) -> bool {
        self.settled
    }

    /// Returns what is known at the end of a block. `exchanged`: with it an exchange has taken place; the bank then begins anew.
    pub fn observe(&mut self, state: &isolation::State, exchanged: bool) -> Observation {
        if exchanged {
            (self.since_fault, self.since_exchange) = (Span::NEW, Span::NEW);
        }
        Observation {
            report: state.report(),
            moved: self.since_fault.width(),
            moved_since_exchange: self.since_exchange.width(),
            trusted_blocks: self.trusted_blocks,
            exchanged,
        }
    }
}
