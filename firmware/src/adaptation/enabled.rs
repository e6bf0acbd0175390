//! The adaptation with its state, built with the feature `adaptation`.

pub use model::adaptation::Scale;

use link::AdaptationReport;
use link::isolation::Off;
use model::adaptation::{Observation, Parameters, Phase, Settings, State, Variant};
use model::isolation::{self, bank};
use model::{Amplifier, SampleTime, Validate, controller, device};

use crate::control::{Control, Tick};
use crate::isolation::Isolation;

/// What the adaptation starts from, in SI units; or why nothing can adapt: the settings say so, no bank runs, or the spring cannot be run
/// at the ends of the bounds.
#[derive(Clone, Copy, Debug)]
pub struct Terms(Result<Stored, Off>);

/// Controller and bank with the stored model.
#[derive(Clone, Copy, Debug)]
struct Stored {
    control: controller::Settings,
    bank: isolation::Settings,
    settings: Settings,
}

impl Terms {
    /// No bank runs.
    pub const NONE: Self = Self(Err(Off::NoSensor));

    /// The adaptation beside the bank of `isolation`; `amplifier` has the limits of the running model.
    #[inline(never)]
    pub fn new(settings: &device::Settings, amplifier: Amplifier, isolation: &crate::isolation::Terms) -> Self {
        Self(settings.adaptation.ok_or(Off::Settings).and_then(|adaptation| {
            let bank = isolation.bank()?;
            let control = controller::Settings { plant: bank.plant, amplifier, ..settings.control };
            let in_range = SampleTime::from_rate(control.rate_hz).and_then(|sample_time| {
                adaptation.validate(sample_time)?;
                adaptation.check_for(&control, &bank)
            });
            in_range.map_err(|_| Off::OutOfRange)?;
            Ok(Stored { control, bank, settings: adaptation })
        }))
    }
}

/// A change of the adaptation.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Change {
    /// What it does.
    pub phase: Phase,
    /// The running parameters.
    pub parameters: Parameters,
}

/// Plans the next parameters. Floating point: not for the control task.
#[derive(Debug)]
pub struct Planner {
    terms: Terms,
    state: State,
    reported: Change,
    /// Number of exchanges, and the last tick before the last of them.
    exchanged: (u32, u64),
    /// What is to be exchanged at the end of the next block.
    next: Option<Variant>,
}

impl Planner {
    /// A planner for the stored model.
    pub fn new(terms: Terms) -> Self {
        let reported = Change { phase: Phase::Watching, parameters: Parameters::STORED };
        Self { terms, state: State::default(), reported, exchanged: (0, 0), next: None }
    }

    /// Plans from what the block that ended with `tick` has shown. Returns what has changed; [`Planner::next`] is the plan.
    pub fn plan(&mut self, seen: &Observation, tick: u64) -> Option<Change> {
        let Ok(Stored { control, settings, .. }) = &self.terms.0 else { return None };
        let block_s = bank::block_s(control.rate_hz);
        let next = self.state.update(settings, seen, control.plant, control.amplifier.max_v, block_s);
        if seen.exchanged {
            self.exchanged = (self.exchanged.0.saturating_add(1), tick);
        }
        self.next = None;
        if let Some(parameters) = next {
            self.build(&parameters);
        }
        self.change()
    }

    /// Switches the adaptation off, so that the model goes back to the stored one, or on again. Returns what has changed.
    pub fn switch(&mut self, on: bool) -> Option<Change> {
        self.terms.0.ok()?;
        self.state.switch(on);
        self.change()
    }

    /// Returns what has changed since the last time.
    fn change(&mut self) -> Option<Change> {
        let now = Change { phase: self.state.phase(), parameters: self.state.parameters() };
        let before = core::mem::replace(&mut self.reported, now);
        (now != before).then_some(now)
    }

    /// Returns the report for the host, whose tick is left 0.
    pub fn report(&self) -> AdaptationReport {
        match &self.terms.0 {
            Err(why) => AdaptationReport::off(*why, 0),
            Ok(Stored { control, settings, .. }) => {
                let Change { phase, parameters } = self.reported;
                let (exchanges, exchange_tick) = self.exchanged;
                let report = AdaptationReport::new(phase, &parameters, settings, control.plant);
                AdaptationReport { exchanges, exchange_tick, ..report }
            }
        }
    }

    /// Returns what is to be exchanged at the end of the next block.
    pub const fn next(&self) -> Option<&Variant> {
        self.next.as_ref()
    }

    /// Builds the next variant. Not inlined: its frame is large.
    #[inline(never)]
    fn build(&mut self, parameters: &Parameters) {
        if let Ok(Stored { control, bank, .. }) = &self.terms.0 {
            // Parameters within the bounds have been checked at the start.
            self.next = Variant::new(control, bank, parameters).ok();
        }
    }
}

/// Planner and control task in one thread: what a host runs instead of two tasks.
#[derive(Debug)]
pub struct Alone {
    planner: Planner,
    ticks: u64,
}

impl Alone {
    /// At the start.
    pub fn new(terms: Terms) -> Self {
        Self { planner: Planner::new(terms), ticks: 0 }
    }

    /// The planner.
    pub fn planner(&mut self) -> &mut Planner {
        &mut self.planner
    }

    /// After a tick of the bank: exchanges at the end of a block what was planned at the end of the last one. Returns what has changed.
    pub fn after_tick(&mut self, control: &mut Control, isolation: &mut Isolation, tick: &Tick) -> Option<Change> {
        self.ticks += 1;
        if !isolation.ends_block(tick) {
            return None;
        }
        let seen = isolation.end_block(control, tick, self.planner.next());
        self.planner.plan(&seen, self.ticks)
    }
}
