//! Times of a record: numbers in a unit, or time stamps of ISO 8601.

use chrono::{DateTime, NaiveDateTime};

use anyhow::Result;

use crate::bad_input;
use crate::bad_input::excerpt;
use crate::csv_table::Row;

/// A time as read from a cell.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Time {
    /// The number in the cell, in the unit of the column; for a stamp the time since the first one, in s.
    pub(super) value: f64,
    /// Time since the first row, in the same unit. Large times are subtracted without rounding: the nanoseconds since 1970
    /// have more digits than a double.
    pub(super) since_first: f64,
}

impl Time {
    /// True if this time is after `other`.
    pub(super) fn is_after(self, other: Self) -> bool {
        self.value > other.value || self.since_first > other.since_first
    }
}

/// Reads the times of a column, whose first cell decides between numbers and stamps.
#[derive(Debug, Default)]
pub(super) struct Clock {
    first: Option<First>,
}

#[derive(Clone, Copy, Debug)]
enum First {
    Number(f64, Option<Exact>),
    Stamp(Stamp),
}

impl Clock {
    /// True if the times are stamps.
    pub(super) fn has_stamps(&self) -> bool {
        matches!(self.first, Some(First::Stamp(_)))
    }

    /// The next time of the column.
    ///
    /// # Errors
    /// [`crate::bad_input::BadInput`] with file, line and column.
    pub(super) fn read(&mut self, row: &Row<'_>, column: usize) -> Result<Time> {
        let text = row.text(column);
        let stamp = Stamp::parse(text);
        let first = *self.first.get_or_insert(match stamp {
            Some(stamp) => First::Stamp(stamp),
            None if is_date(text) => bad_input!(
                "{}: `{text}` is a date without time; expected a number or a time stamp such as 2026-01-31T23:59:58.5",
                row.place(column)
            ),
            // A clock's time or a date of another form.
            None if text.contains([':', '/']) => bad_input!(
                "{}: `{}` is not a time stamp of ISO 8601; expected a number or one such as 2026-01-31T23:59:58.5",
                row.place(column),
                excerpt(text)
            ),
            None => First::Number(row.number(column)?, Exact::parse(text)),
        });
        match (first, stamp) {
            (First::Stamp(first), Some(stamp)) if first.has_zone == stamp.has_zone => {
                let since_first = (stamp.nanoseconds - first.nanoseconds) as f64 * 1e-9;
                Ok(Time { value: since_first, since_first })
            }
            (First::Stamp(Stamp { has_zone, .. }), _) => {
                let zone = if has_zone { "with" } else { "without" };
                Err(row
                    .is_not(column, &format!("a time stamp {zone} a zone, as in the first row; expected another such")))
            }
            (First::Number(..), Some(_)) => {
                Err(row.is_not(column, "a finite number, as in the first row; expected another"))
            }
            (First::Number(first, exact), None) => {
                let value = row.number(column)?;
                let exactly = exact.zip(Exact::parse(text)).map(|(first, time)| time.since(first));
                Ok(Time { value, since_first: exactly.unwrap_or(value - first) })
            }
        }
    }
}

/// A decimal number without exponent, as its whole part and its fraction of the same sign.
#[derive(Clone, Copy, Debug)]
struct Exact {
    whole: i128,
    fraction: f64,
}

impl Exact {
    /// Digits that a whole part may have.
    const MOST_DIGITS: usize = 36;

    fn parse(text: &str) -> Option<Self> {
        let (whole, fraction) = text.split_once(['.', ',']).unwrap_or((text, ""));
        let is_short = whole.len() <= Self::MOST_DIGITS && fraction.bytes().all(|digit| digit.is_ascii_digit());
        let sign = if whole.starts_with('-') { -1.0 } else { 1.0 };
        let fraction = format!("0.{fraction}0").parse::<f64>().ok()? * sign;
        is_short.then(|| whole.parse().ok().map(|whole| Self { whole, fraction })).flatten()
    }

    fn since(self, first: Self) -> f64 {
        (self.whole - first.whole) as f64 + (self.fraction - first.fraction)
    }
}

/// A point in time, UTC unless it has no zone.
#[derive(Clone, Copy, Debug)]
struct Stamp {
    nanoseconds: i128,
    has_zone: bool,
}

impl Stamp {
    fn parse(text: &str) -> Option<Self> {
        if !is_dated(text) {
            return None;
        }
        let text = text.replacen(',', ".", 1);
        let nanoseconds = |seconds: i64, below: u32| i128::from(seconds) * 1_000_000_000 + i128::from(below);
        ["%Y-%m-%dT%H:%M:%S%.f", "%Y-%m-%d %H:%M:%S%.f", "%Y-%m-%dT%H:%M", "%Y-%m-%d %H:%M"].iter().find_map(|form| {
            if let Ok(time) = NaiveDateTime::parse_from_str(&text, form).map(|time| time.and_utc()) {
                return Some(Self {
                    nanoseconds: nanoseconds(time.timestamp(), time.timestamp_subsec_nanos()),
                    has_zone: false,
                });
            }
            let time = DateTime::parse_from_str(&text.replace(['Z', 'z'], "+00:00"), &format!("{form}%#z")).ok()?;
            Some(Self { nanoseconds: nanoseconds(time.timestamp(), time.timestamp_subsec_nanos()), has_zone: true })
        })
    }
}

/// True for a text that starts with a date, `2026-01-31`.
pub(super) fn is_dated(text: &str) -> bool {
    text.get(..10).is_some_and(is_date)
}

/// True for `2026-01-31`.
fn is_date(text: &str) -> bool {
    let is_digit = |byte: u8| byte.is_ascii_digit();
    text.len() == 10
        && text.bytes().enumerate().all(|(at, byte)| if [4, 7].contains(&at) { byte == b'-' } else { is_digit(byte) })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn time_stamps_have_fractions_and_zones_or_none() {
        let since = |first: &str, text: &str| {
            Some((Stamp::parse(text)?.nanoseconds - Stamp::parse(first)?.nanoseconds) as f64 * 1e-9)
        };
        for (first, text, seconds) in [
            ("2026-01-31T23:59:58", "2026-02-01 00:00:00.25", Some(2.25)),
            ("2026-01-31 23:59", "2026-01-31T23:59:01,5", Some(1.5)),
            ("2026-01-31T12:00:00Z", "2026-01-31T14:00:00+01:00", Some(3600.0)),
            ("2026-01-31 12:00:00Z", "2026-01-31 12:00:00.000000001-0000", Some(1e-9)),
            ("2026-01-31T12:00:00+01", "2026-01-31T12:00:00Z", Some(3600.0)),
            ("1969-12-31T23:59:59.5Z", "1970-01-01T00:00:00Z", Some(0.5)),
            ("2026-01-31T12:00:00", "2026-02-30T12:00:00", None),
            ("2026-01-31T12:00:00", "2026-01-31", None),
            ("2026-01-31T12:00:00", "2026-01-31T12:00:00 noon", None),
            ("2026-01-31T12:00:00", "2026-01-3\u{b5}T12:00:00", None),
        ] {
            assert_eq!(since(first, text), seconds, "{first} {text}");
        }
    }

    #[test]
    fn large_times_are_subtracted_without_rounding() {
        let since = |first: &str, text: &str| Exact::parse(text).unwrap().since(Exact::parse(first).unwrap());
        assert_eq!(since("1767225600123456789", "1767225600123456790"), 1.0);
        assert_eq!(since("1767225600.5", "1767225600.5000001"), 0.5000001 - 0.5);
        assert_eq!(since("-1,25", "-0,5"), 0.75);
        assert!(Exact::parse("1e3").is_none() && Exact::parse("").is_none() && Exact::parse("1.-5").is_none());
    }
}
