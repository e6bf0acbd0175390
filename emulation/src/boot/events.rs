//! What the register models report: each event outside of the core, with its time.

use anyhow::{Context, Result, bail};
use host_sim::log::Formats;
use serde::Deserialize;

use crate::qemu::emulator;

/// Period of the control tick, in us.
pub(super) const PERIOD_US: f64 = 1000.0;
/// Largest difference between the earliest and the latest tick relative to their grid, in us: the logger disables
/// interrupts briefly.
pub(super) const JITTER_US: f64 = 20.0;
/// Duration of a byte on the line at 115 200 bit/s, in us.
pub(super) const BYTE_US: f64 = 1e7 / 115_200.0;

/// An event outside of the core: time in us, name, value.
#[derive(Clone, Debug, PartialEq, Deserialize)]
pub(super) struct Event(pub(super) f64, pub(super) String, pub(super) serde_json::Value);

impl Event {
    /// Whether the event is a DAC code above zero or the amplifier's enable.
    pub(super) fn drives(&self) -> bool {
        let Self(_, what, value) = self;
        (what == "dac" && value != 0) || value == "on"
    }
}

/// The events of one run.
#[derive(Clone, Debug, Deserialize)]
pub(super) struct Events(pub(super) Vec<Event>);

impl Events {
    /// Times of the events named `what`, in us.
    pub(super) fn times(&self, what: &str) -> Vec<f64> {
        self.0.iter().filter(|event| event.1 == what).map(|event| event.0).collect()
    }

    /// The events before the first one named `what`, and those from it on.
    pub(super) fn split(&self, what: &str) -> Result<(Self, Self)> {
        let at = self.0.iter().position(|event| event.1 == what).with_context(|| format!("no {what}"))?;
        Ok((Self(self.0[..at].to_vec()), Self(self.0[at..].to_vec())))
    }

    /// The events of each start, from its reset on.
    pub(super) fn starts(&self) -> Vec<Self> {
        self.0.chunk_by(|_, next| next.1 != "reset").map(|start| Self(start.to_vec())).collect()
    }

    /// An error unless every DAC code is zero and the amplifier is never enabled.
    pub(super) fn safe(&self) -> Result<()> {
        match self.0.iter().find(|event| event.drives()) {
            Some(Event(us, what, value)) => bail!("{what} {value} at {us:.2} us"),
            None => Ok(()),
        }
    }

    /// The messages of the log, decoded with the formats of `image`.
    pub(super) fn log(&self, image: &[u8]) -> Result<Vec<String>> {
        let mut bytes = Vec::new();
        for Event(_, _, value) in self.0.iter().filter(|event| event.1 == "log") {
            let hex = value.as_str().context("a log that is no text")?;
            for at in (0..hex.len()).step_by(2) {
                bytes.push(u8::from_str_radix(hex.get(at..at + 2).context("half a byte")?, 16)?);
            }
        }
        let lines = emulator::decode(Formats::parse(image)?, &mut bytes.as_slice(), |_| {})?.whole()?;
        Ok(lines.into_iter().map(|line| line.message).collect())
    }
}

/// Difference between the latest and the earliest of `ticks` on a grid from the first one on, all in us, so that drift and missing ticks
/// show.
pub(super) fn jitter(ticks: &[f64]) -> f64 {
    let late = ticks.iter().zip(0u32..).map(|(us, tick)| us - ticks[0] - f64::from(tick) * PERIOD_US);
    let (earliest, latest) = late.fold((0.0, 0.0), |(least, most): (f64, f64), late| (least.min(late), most.max(late)));
    latest - earliest
}
