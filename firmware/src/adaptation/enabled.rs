//! The adaptation with its state, built with the feature `adaptation`.

pub use model::adaptation::Scale;

use model::adaptation::{Observation, Parameters, Phase, Settings, State, Variant};
use model::isolation::{self, bank};
use model::{Amplifier, SampleTime, Validate, controller, device};

use crate::control::{Control, Tick};
use crate::isolation::Isolation;

/// What the adaptation starts from, in SI units; `None` if nothing adapts: no bank runs, or the spring cannot be run at the ends of the
/// bounds.
#[derive(Clone, Copy, Debug, Default)]
pub struct Terms(Option<Stored>);

/// Controller and bank with the stored model.
#[derive(Clone, Copy, Debug)]
struct Stored {
    control: controller::Settings,
    bank: isolation::Settings,
    settings: Settings,
}

impl Terms {
    /// The adaptation beside the bank of `isolation`; `amplifier` has the limits of the running model. Its bounds are
    /// [`Settings::TYPICAL`].
    #[inline(never)]
    pub fn new(settings: &device::Settings, amplifier: Amplifier, isolation: &crate::isolation::Terms) -> Self {
        Self(isolation.bank().and_then(|bank| {
            let control = controller::Settings { plant: bank.plant, amplifier, ..settings.control };
            let settings = Settings::TYPICAL;
            settings.validate(SampleTime::from_rate(control.rate_hz).ok()?).ok()?;
            settings.check_for(&control, &bank).ok()?;
            Some(Stored { control, bank, settings })
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
    /// What is to be exchanged at the end of the next block.
    next: Option<Variant>,
}

impl Planner {
    /// A planner for the stored model.
    pub fn new(terms: Terms) -> Self {
        let reported = Change { phase: Phase::Watching, parameters: Parameters::STORED };
        Self { terms, state: State::default(), reported, next: None }
    }

    /// Plans from what a block has shown. Returns what has changed; [`Planner::next`] is the plan.
    pub fn plan(&mut self, seen: &Observation) -> Option<Change> {
        let Some(Stored { control, settings, .. }) = &self.terms.0 else { return None };
        let block_s = bank::block_s(control.rate_hz);
        let next = self.state.update(settings, seen, control.plant, control.amplifier.max_v, block_s);
        let now = Change { phase: self.state.phase(), parameters: self.state.parameters() };
        let change = (now != self.reported).then_some(now);
        self.reported = now;
        self.next = None;
        if let Some(parameters) = next {
            self.build(&parameters);
        }
        change
    }

    /// Returns what is to be exchanged at the end of the next block.
    pub const fn next(&self) -> Option<&Variant> {
        self.next.as_ref()
    }

    /// Builds the next variant. Not inlined: its frame is large.
    #[inline(never)]
    fn build(&mut self, parameters: &Parameters) {
        if let Some(Stored { control, bank, .. }) = &self.terms.0 {
            // Parameters within the bounds have been checked at the start.
            self.next = Variant::new(control, bank, parameters).ok();
        }
    }
}

/// Planner and control task in one thread: what a host runs instead of two tasks.
#[derive(Debug)]
pub struct Alone(Planner);

impl Alone {
    /// At the start.
    pub fn new(terms: Terms) -> Self {
        Self(Planner::new(terms))
    }

    /// After a tick of the bank: exchanges at the end of a block what was planned at the end of the last one. Returns what has changed.
    pub fn after_tick(&mut self, control: &mut Control, isolation: &mut Isolation, tick: &Tick) -> Option<Change> {
        if !isolation.ends_block(tick) {
            return None;
        }
        self.0.plan(&isolation.end_block(control, tick, self.0.next()))
    }
}
