//! Stand-ins without values, built without the feature `isolation`.

use link::isolation::{Isolation as Request, Off};
use link::{Command, IsolationReport, Notice, Reply};
use model::isolation::Causes;
use model::supervisor::{Fault, State};
use model::{OutOfRange, Plant, device};

use crate::control::{Control, Tick};

/// Properties of the bank; without the feature `isolation` there are none.
#[derive(Clone, Copy, Debug)]
pub struct Terms;

impl Terms {
    /// Without the feature `isolation` no bank runs.
    pub fn new(_: &device::Settings, _: Option<Plant>, _: f64) -> Self {
        Self
    }

    /// Returns no error: without the feature `isolation` the settings cannot demand a trip.
    ///
    /// # Errors
    /// None.
    pub fn check(&self) -> Result<(), OutOfRange> {
        Ok(())
    }
}

/// A change of what the bank says; without the feature `isolation` it has no values.
#[derive(Clone, Copy, Debug)]
pub enum News {}

/// The bank; without the feature `isolation` it is empty.
#[derive(Debug)]
pub struct Isolation;

impl Isolation {
    /// An empty bank.
    pub const fn off() -> Self {
        Self
    }

    /// Starts nothing.
    pub fn start(&mut self, _: &Terms) {}

    /// Returns no fault.
    pub fn begin(&mut self, _: &Command, _: State) -> Option<Fault> {
        None
    }

    /// Returns no news.
    pub fn tick(&mut self, _: &Control, _: &Tick) -> Option<News> {
        None
    }

    /// Without the feature `isolation` there is no alarm.
    pub fn acknowledge(&mut self) {}
}

/// Without the feature `isolation` nothing is shared.
pub fn set_terms(_: Terms) {}

/// Without the feature `isolation` there are no news.
pub fn publish(news: &News, _: u64) {
    match *news {}
}

/// Without the feature `isolation` there is nothing to acknowledge.
pub fn take_acknowledged() -> bool {
    false
}

/// Without the feature `isolation` there is nothing to send with the telemetry.
pub fn notice(_: u64, _: impl FnOnce(u16) -> bool) -> Option<(u16, Notice)> {
    None
}

/// Replies that the image is built without the bank.
pub async fn execute(_: Request, tick: u64) -> Reply {
    Reply::Isolation(IsolationReport::off(Off::NotBuiltIn, tick, Causes::NONE))
}
