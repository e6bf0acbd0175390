//! One line of the log.

use std::fmt;

use defmt_decoder::Frame;
use serde::{Serialize, Serializer};

use crate::log::event::Event;

/// Severity of a line.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Serialize)]
#[serde(rename_all = "lowercase")]
#[expect(missing_docs, reason = "the names say it")]
pub enum Level {
    Trace,
    Debug,
    Info,
    Warn,
    Error,
}

impl fmt::Display for Level {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.pad(match self {
            Self::Trace => "TRACE",
            Self::Debug => "DEBUG",
            Self::Info => "INFO",
            Self::Warn => "WARN",
            Self::Error => "ERROR",
        })
    }
}

/// A decoded frame.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Line {
    /// Time since the MCU's start, in us, if the firmware sends times.
    #[serde(rename = "time_s", serialize_with = "in_seconds")]
    pub time_us: Option<u64>,
    /// Severity; `None` for lines of `println!`.
    pub level: Option<Level>,
    /// Text of the line.
    pub message: String,
    /// Meaning of the line.
    #[serde(flatten)]
    pub event: Event,
}

impl Line {
    pub(super) fn new(frame: &Frame<'_>) -> Self {
        Self {
            time_us: frame.display_timestamp().and_then(|time| microseconds(&time.to_string())),
            level: frame.level().map(|level| match level {
                defmt_parser::Level::Trace => Level::Trace,
                defmt_parser::Level::Debug => Level::Debug,
                defmt_parser::Level::Info => Level::Info,
                defmt_parser::Level::Warn => Level::Warn,
                defmt_parser::Level::Error => Level::Error,
            }),
            message: frame.display_message().to_string(),
            event: Event::of(&frame.fragments(), frame.display_fragments()),
        }
    }
}

fn in_seconds<S: Serializer>(time_us: &Option<u64>, serializer: S) -> Result<S::Ok, S::Error> {
    time_us.map(|us| us as f64 / 1e6).serialize(serializer)
}

/// Parses a time as defmt formats it: `1.000250`, `00:01:01.000250`, or a plain number of microseconds.
fn microseconds(text: &str) -> Option<u64> {
    if !text.contains(['.', ':']) {
        return text.parse().ok();
    }
    let (whole, fraction) = text.split_once('.').unwrap_or((text, ""));
    // Hours and minutes, or days, may precede the seconds.
    let units = [1, 60, 3600, 86_400];
    let mut seconds: u64 = 0;
    for (part, unit) in whole.rsplit(':').zip(units) {
        seconds = seconds.checked_add(part.parse::<u64>().ok()?.checked_mul(unit)?)?;
    }
    let fraction: u64 = if fraction.is_empty() { 0 } else { format!("{fraction:0<6}").get(..6)?.parse().ok()? };
    seconds.checked_mul(1_000_000)?.checked_add(fraction)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn times_formatted_by_defmt_are_parsed() {
        for (text, expected) in [
            ("0.000000", Some(0)),
            ("1.000250", Some(1_000_250)),
            ("1.25", Some(1_250_000)),
            ("42", Some(42)),
            ("00:01:01", Some(61_000_000)),
            ("2:00:01:01.5", Some(172_861_500_000)),
            ("tick 5", None),
            ("99999999999999999999.0", None),
            ("18446744073709551615.0", None),
        ] {
            assert_eq!(microseconds(text), expected, "{text}");
        }
    }
}
