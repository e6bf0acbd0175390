//! The bank with its state, built with the feature `isolation`.

use link::isolation::Off;
use link::{Command, IsolationReport};
#[cfg(feature = "adaptation")]
use model::adaptation;
use model::isolation::{self, Causes, Report, Verdict};
use model::supervisor::{self, Fault, State};
use model::{OutOfRange, Plant, SampleTime, ScaledStiffness, Validate, Volts, device};

use crate::control::{Control, Tick};

/// The state in which a command may acknowledge the bank's fault.
const TRIPPED: State = State::Faulted(Fault::Isolation);

/// Properties of the bank that are constant from the start on, in SI units.
#[derive(Clone, Copy, Debug)]
pub struct Terms {
    bank: Result<isolation::Settings, Off>,
    rate_hz: f64,
    trip_on_cause: Causes,
}

impl Terms {
    /// The bank for the spring `plant`, `None` for one that is not plain, behind an amplifier with this highest voltage, in V.
    #[inline(never)]
    pub fn new(settings: &device::Settings, plant: Option<Plant>, highest_v: f64) -> Self {
        let rate_hz = settings.control.rate_hz;
        let bank = match (&settings.control.feedback, plant) {
            (None, _) => Err(Off::NoSensor),
            (_, None) => Err(Off::ExtendedSpring),
            (_, Some(plant)) => settings.isolation(plant, highest_v).ok_or(Off::NoSensor),
        };
        let in_range = |bank: isolation::Settings| {
            let valid = SampleTime::from_rate(rate_hz).and_then(|sample_time| bank.validate(sample_time).map(drop));
            valid.map(|()| bank).map_err(|_| Off::OutOfRange)
        };
        Self { bank: bank.and_then(in_range), rate_hz, trip_on_cause: settings.trip_on_cause }
    }

    /// The bank's settings.
    ///
    /// # Errors
    /// Why no bank runs.
    #[cfg(feature = "adaptation")]
    pub fn bank(&self) -> Result<isolation::Settings, Off> {
        self.bank
    }

    /// Checks that a bank runs if the settings demand a trip.
    ///
    /// # Errors
    /// [`OutOfRange`] names `trip_on_cause`, of which no cause is allowed.
    pub fn check(&self) -> Result<(), OutOfRange> {
        match self.bank {
            Ok(_) => Ok(()),
            Err(_) => self.trip_on_cause.check_none("causes, since no isolation bank runs"),
        }
    }

    /// Returns `report` in SI units for the host, at `tick`; `since_tick` is the tick after which the fault has been there.
    #[inline(never)]
    pub fn describe(&self, report: &Report, tick: u64, since_tick: u64) -> IsolationReport {
        match &self.bank {
            Err(why) => IsolationReport::off(*why, tick, self.trip_on_cause),
            Ok(bank) => {
                let finding = report.finding(bank, self.rate_hz);
                IsolationReport::new(report.verdict, finding, tick, since_tick, self.trip_on_cause)
            }
        }
    }
}

/// A change of what the bank says.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct News {
    /// What it says now.
    pub report: Report,
    /// For how many ticks the fault has been there; 0 without an alarm.
    pub since_ticks: u64,
    /// The verdict before.
    pub before: Verdict,
}

impl News {
    /// The tick after which the fault has been there, for news of `tick`; `tick` itself without an alarm.
    pub const fn since_tick(&self, tick: u64) -> u64 {
        tick.saturating_sub(self.since_ticks)
    }
}

/// Voltage and model of one tick, with which the reading of the next tick is compared.
#[derive(Clone, Copy, Debug)]
struct Moment {
    applied: Volts,
    /// The model's stiffness just after the voltage was applied.
    model: ScaledStiffness,
    enabled: bool,
}

/// The bank of one controller, with its state.
#[derive(Debug)]
pub struct Isolation {
    config: Option<isolation::Config>,
    trip_on_cause: Causes,
    /// A cause of that setting was named; the fault stays until it is acknowledged, whatever the bank says then.
    tripped: bool,
    /// The command of this tick may acknowledge that fault.
    acknowledging: bool,
    last: Option<Moment>,
    /// Verdict, age and number of decisions of the last news.
    reported: (Verdict, u32, u32),
    state: isolation::State,
    #[cfg(feature = "adaptation")]
    watch: adaptation::Watch,
    /// Largest distance of the estimate from the target in an exchange, in V.
    #[cfg(feature = "adaptation")]
    tolerance: Volts,
}

impl Isolation {
    /// Creates the state in which no bank runs. Inlined, so that it is built in its place: it is too large for the stack, and a
    /// constant, of which nearly all is zero, would be in the image.
    #[inline(always)]
    pub const fn off() -> Self {
        Self {
            config: None,
            trip_on_cause: Causes::NONE,
            tripped: false,
            acknowledging: false,
            last: None,
            reported: (Verdict::Quiet, 0, 0),
            state: isolation::State::at_rest(),
            #[cfg(feature = "adaptation")]
            watch: adaptation::Watch::NEW,
            #[cfg(feature = "adaptation")]
            tolerance: Volts::ZERO,
        }
    }

    /// Starts the bank for a spring at rest at 0 V. Call it before the first tick.
    #[inline(never)]
    pub fn start(&mut self, terms: &Terms) {
        self.config = terms.bank.ok().and_then(|bank| {
            let sample_time = SampleTime::from_rate(terms.rate_hz).ok()?;
            Some(bank.validate(sample_time).ok()?.quantize())
        });
        self.trip_on_cause = terms.trip_on_cause;
        #[cfg(feature = "adaptation")]
        if let Ok(bank) = terms.bank {
            self.tolerance = adaptation::settled_within(bank.range_v);
        }
    }

    /// Before a tick: returns the bank's fault after a cause of the setting `trip_on_cause` was named, until it is acknowledged; not in
    /// the tick whose command may do so.
    #[inline]
    pub fn begin(&mut self, command: &Command, state: State) -> Option<Fault> {
        self.acknowledging = command.arming == Some(supervisor::Command::Disarm) && state == TRIPPED;
        (self.tripped && !self.acknowledging).then_some(Fault::Isolation)
    }

    /// After the output of a tick is written: advances the bank. Returns what has changed. Bounded work, no float, no panic: not
    /// inlined, so that the audit of the image verifies it.
    #[inline(never)]
    pub fn tick(&mut self, control: &Control, tick: &Tick) -> Option<News> {
        if core::mem::take(&mut self.acknowledging) && control.supervisor().state() != TRIPPED {
            self.tripped = false;
            self.state.acknowledge();
        }
        let config = self.config.as_ref()?;
        let Tick { drive, output, measured } = tick;
        let now = Moment { applied: output.applied, model: control.uncorrected(output), enabled: drive.enabled() };
        if let Some(last) = self.last.replace(now) {
            // The reading was sampled after the output of the tick before.
            let reading = measured.filter(|_| last.enabled).map(|volts| control.inward(ScaledStiffness(volts.0)));
            config.tick(&mut self.state, last.applied, last.model, reading);
        }
        let verdict = self.state.verdict();
        self.tripped |= matches!(verdict, Verdict::Named(cause) if self.trip_on_cause.contains(cause));
        let says = (verdict, self.state.since_blocks(), self.state.decisions());
        if says == self.reported {
            return None;
        }
        let (before, ..) = core::mem::replace(&mut self.reported, says);
        let report = self.state.report();
        let since_ticks = u64::from(report.since_blocks) * u64::from(config.block_ticks());
        Some(News { report, since_ticks, before })
    }

    /// Ends an alarm: the bank looks for a fault anew. A fault of `trip_on_cause` stays.
    pub fn acknowledge(&mut self) {
        self.state.acknowledge();
    }
}

#[cfg(feature = "adaptation")]
impl Isolation {
    /// After [`Isolation::tick`]: watches a tick for the adaptation. True at the end of a block, and never if no bank runs.
    pub fn ends_block(&mut self, tick: &Tick) -> bool {
        self.config.as_ref().is_some_and(|bank| self.watch.tick(bank, &self.state, &tick.output, self.tolerance))
    }

    /// At the end of a block: exchanges controller and bank for `next` if the loop is settled. The bank then begins anew. Returns what the
    /// block has shown.
    pub fn end_block(
        &mut self,
        control: &mut Control,
        tick: &Tick,
        next: Option<&adaptation::Variant>,
    ) -> adaptation::Observation {
        let next = next.filter(|_| self.watch.settled() && tick.drive.enabled());
        if let Some(variant) = next {
            control.exchange(variant, tick.output.target);
            self.config = Some(variant.bank);
            self.acknowledge();
        }
        self.watch.observe(&self.state, next.is_some())
    }
}
