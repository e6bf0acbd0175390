//! Times of a record: numbers in a unit, time stamps, or times of day.

use chrono::{DateTime, NaiveDate, NaiveDateTime, NaiveTime, Timelike};

use anyhow::Result;

use crate::bad_input;
use crate::bad_input::excerpt;
use crate::csv_table::Row;

/// Nanoseconds in a minute; a time below may be the first one of a stopwatch.
const MINUTE_NS: i128 = 60_000_000_000;
/// Nanoseconds in an hour.
const HOUR_NS: i128 = 60 * MINUTE_NS;
/// Nanoseconds in a day.
const DAY_NS: i128 = 24 * HOUR_NS;

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
    /// The last time of day or of the hour, in ns since the first midnight or the first full hour.
    last: i128,
    /// Time from the row before the last one to the last one, in ns.
    last_step: i128,
    /// True once a time has 24 h, or 60 min, or more: those of a stopwatch, which do not begin again.
    is_stopwatch: bool,
    dates: Dates,
}

/// The columns of dates beside times of day.
#[derive(Debug, Default)]
struct Dates {
    /// Index and first date of each.
    columns: Vec<(usize, String)>,
    /// The first one whose date has changed: its dates are the days of the times.
    changed: Option<usize>,
    /// Days from the first date to the last one.
    days: i128,
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

    /// Index of the column whose dates are the days of the times.
    pub(super) fn dates(&self) -> Option<usize> {
        self.dates.changed.map(|place| self.dates.columns[place].0)
    }

    /// The next time of the column.
    ///
    /// # Errors
    /// [`crate::bad_input::BadInput`] with file, line and column.
    pub(super) fn read(&mut self, row: &Row<'_>, column: usize) -> Result<Time> {
        let text = row.text(column);
        let stamp = Stamp::parse(text);
        if self.first.is_none()
            && let Some(stamp) = stamp
        {
            if stamp.form == Form::TimeOfDay {
                self.dates = Dates::of(row, column);
            }
            self.last = stamp.nanoseconds;
        }
        let first = match (self.first, stamp) {
            (Some(first), _) => first,
            (None, Some(stamp)) => First::Stamp(stamp),
            _ if is_date(text) => bad_input!(
                "{}: `{text}` is a date without time; expected a number or a time stamp such as 2026-01-31T23:59:58.5",
                row.place(column)
            ),
            // `31/01/2026` or `01/31/2026`, `59:58`: which number is the day, the hour?
            _ if text.contains([':', '/']) => bad_input!(
                "{}: `{}` is not a time stamp; expected a number, or one such as 2026-01-31T23:59:58.5, 31.01.2026 23:59:58.5, 23:59:58.5, 59:58.5",
                row.place(column),
                excerpt(text)
            ),
            _ => First::Number(row.number(column)?, Exact::parse(text)),
        };
        self.first = Some(first);
        match (first, stamp) {
            (First::Stamp(first), Some(mut stamp)) if first.form == stamp.form => {
                if let Some(period) = stamp.form.period_ns() {
                    self.is_stopwatch |= stamp.nanoseconds >= period;
                    let had_changed = self.dates.changed.is_some();
                    let wraps = self.last - stamp.nanoseconds >= period / 2;
                    let days = if self.is_stopwatch { None } else { self.dates.days(row, wraps)? };
                    if let Some(days) = days {
                        let step = stamp.nanoseconds - self.last;
                        // A clock would have been silent for a day, and then gone on as if it had not.
                        let goes_on = step <= 2 * self.last_step;
                        if !had_changed && step > 0 && (first.nanoseconds < MINUTE_NS || goes_on) {
                            bad_input!(
                                "{}: `{text}` follows a smaller time while the date changes, as a stopwatch does; expected times of day, or \
                                 time stamps such as 2026-01-31T23:59:58.5",
                                row.place(column)
                            );
                        }
                        stamp.nanoseconds += days * DAY_NS;
                    } else if !self.is_stopwatch {
                        // A clock begins again at midnight, one without hours at the full hour: a time that is earlier by half a
                        // period or more is one of the next.
                        stamp.nanoseconds += period * ((self.last - stamp.nanoseconds + period / 2) / period).max(0);
                    }
                    self.last_step = stamp.nanoseconds - self.last;
                    self.last = stamp.nanoseconds;
                }
                let since_first = stamp.since(first);
                Ok(Time { value: since_first, since_first })
            }
            (First::Stamp(Stamp { form, .. }), _) => {
                Err(row.is_not(column, &format!("{}, as in the first row; expected another such", form.name())))
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

impl Dates {
    /// The columns of a record's first row that hold dates, without the column of times.
    fn of(row: &Row<'_>, time: usize) -> Self {
        let cells = row.cells().enumerate().filter(|(index, text)| *index != time && is_like_date(text));
        Self { columns: cells.map(|(index, text)| (index, text.to_owned())).collect(), changed: None, days: 0 }
    }

    /// Days from the first date to that of a row; `None` as long as no date has changed, or if dates in another form change where the
    /// clock begins again (`wraps`), which shows the day as well. Where a sheet has merged cells, a date is in the first of them only.
    ///
    /// # Errors
    /// [`crate::bad_input::BadInput`] with file, line and column of another form of date.
    fn days(&mut self, row: &Row<'_>, wraps: bool) -> Result<Option<i128>> {
        let has_changed = |(index, first): &(usize, String)| !row.text(*index).is_empty() && row.text(*index) != first;
        self.changed = self.changed.or_else(|| self.columns.iter().position(has_changed));
        let Some((index, first)) = self.changed.map(|place| &self.columns[place]) else { return Ok(None) };
        if row.text(*index).is_empty() {
            return Ok(Some(self.days));
        }
        match date(first).zip(date(row.text(*index))) {
            Some((first, date)) => {
                self.days = date.signed_duration_since(first).num_days().into();
                Ok(Some(self.days))
            }
            None if wraps => Ok(None),
            None => {
                Err(row.is_not(*index, "a date such as 2026-01-31 or 31.01.2026; expected one with every time of day"))
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

/// What a time stamp counts from.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Form {
    /// Midnight, or the start of a measurement: `23:59:58.5`, hours may exceed a day.
    TimeOfDay,
    /// A full hour, or the start of a measurement: `59:58.5`, minutes may exceed an hour. Spreadsheets write such times without hours.
    TimeOfHour,
    WithoutZone,
    WithZone,
}

impl Form {
    fn name(self) -> &'static str {
        ["a time of day", "a time in minutes and seconds", "a time stamp without a zone", "a time stamp with a zone"]
            [self as usize]
    }

    /// The time after which a clock of this form begins again, in ns; `None` for one with dates.
    fn period_ns(self) -> Option<i128> {
        [Some(DAY_NS), Some(HOUR_NS), None, None][self as usize]
    }
}

/// A point in time, UTC unless it has no zone.
#[derive(Clone, Copy, Debug)]
struct Stamp {
    nanoseconds: i128,
    form: Form,
}

impl Stamp {
    fn parse(text: &str) -> Option<Self> {
        let text = text.replacen(',', ".", 1);
        let stamp = |seconds: i64, below: u32, form: Form| Self {
            nanoseconds: i128::from(seconds) * 1_000_000_000 + i128::from(below),
            form,
        };
        if let Some((first, rest)) = text.split_once(':').filter(|(first, _)| is_digits(first, 1, 4)) {
            // `59:58` may be a time of day without seconds; those of `59:58.5` have a fraction.
            let (form, unit_s, rest) = match rest.contains(':') || !rest.contains('.') {
                true => (Form::TimeOfDay, 3600, format!("0:{rest}")),
                false => (Form::TimeOfHour, 60, format!("0:0:{rest}")),
            };
            let time = NaiveTime::parse_from_str(&rest, "%H:%M:%S%.f").ok()?;
            let seconds = unit_s * first.parse::<i64>().ok()? + i64::from(time.num_seconds_from_midnight());
            return Some(stamp(seconds, time.nanosecond(), form));
        }
        if !is_dated(&text) {
            return None;
        }
        let dates = ["%Y-%m-%dT", "%Y-%m-%d ", "%d.%m.%Y "];
        dates.iter().flat_map(|date| ["%H:%M:%S%.f", "%H:%M"].map(|time| format!("{date}{time}"))).find_map(|form| {
            if let Ok(time) = NaiveDateTime::parse_from_str(&text, &form).map(|time| time.and_utc()) {
                return Some(stamp(time.timestamp(), time.timestamp_subsec_nanos(), Form::WithoutZone));
            }
            let time = DateTime::parse_from_str(&text.replace(['Z', 'z'], "+00:00"), &format!("{form}%#z")).ok()?;
            Some(stamp(time.timestamp(), time.timestamp_subsec_nanos(), Form::WithZone))
        })
    }

    /// Time since another stamp of the same form, in s: the double next to the decimal number, which a product with 1e-9 is not.
    fn since(self, first: Self) -> f64 {
        (self.nanoseconds - first.nanoseconds) as f64 / 1e9
    }
}

/// True for a text that is a time of day or of the hour, or starts with a date.
pub(super) fn is_stamp(text: &str) -> bool {
    is_dated(text) || Stamp::parse(text).is_some()
}

fn is_dated(text: &str) -> bool {
    text.split(['T', ' ']).next().is_some_and(is_date)
}

/// True for `2026-01-31` and `31.01.2026`.
fn is_date(text: &str) -> bool {
    let has_parts = |separator: char, digits: [(usize, usize); 3]| {
        let parts: Vec<&str> = text.split(separator).collect();
        parts.len() == 3 && parts.iter().zip(digits).all(|(part, (fewest, most))| is_digits(part, fewest, most))
    };
    has_parts('-', [(4, 4), (2, 2), (2, 2)]) || has_parts('.', [(1, 2), (1, 2), (4, 4)])
}

/// True for a cell that may hold the day of a time in another one, in any usual form.
pub fn is_like_date(text: &str) -> bool {
    date(text).is_some() || text.split('/').filter(|part| is_digits(part, 1, 4)).count() == 3
}

/// The date in a cell that holds nothing else, or midnight with it.
fn date(text: &str) -> Option<NaiveDate> {
    let (date, rest) = text.split_once(['T', ' ']).unwrap_or((text, ""));
    let is_midnight = rest.chars().all(|letter| "0:.".contains(letter));
    let forms = ["%Y-%m-%d", "%d.%m.%Y"].into_iter().filter(|_| is_midnight && is_date(date));
    forms.filter_map(|form| NaiveDate::parse_from_str(date, form).ok()).next()
}

fn is_digits(text: &str, fewest: usize, most: usize) -> bool {
    (fewest..=most).contains(&text.len()) && text.bytes().all(|byte| byte.is_ascii_digit())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn time_stamps_have_fractions_and_zones_or_none() {
        let since = |first: &str, text: &str| {
            let first = Stamp::parse(first)?;
            Some(Stamp::parse(text)?.since(first))
        };
        for (first, text, seconds) in [
            ("2026-01-31T23:59:58", "2026-02-01 00:00:00.25", Some(2.25)),
            ("2026-01-31 23:59", "2026-01-31T23:59:01,5", Some(1.5)),
            ("2026-01-31T12:00:00Z", "2026-01-31T14:00:00+01:00", Some(3600.0)),
            ("2026-01-31 12:00:00Z", "2026-01-31 12:00:00.000000001-0000", Some(1e-9)),
            ("2026-01-31T12:00:00+01", "2026-01-31T12:00:00Z", Some(3600.0)),
            ("1969-12-31T23:59:59.5Z", "1970-01-01T00:00:00Z", Some(0.5)),
            ("31.01.2026 23:59:58", "1.2.2026 00:00:00,25", Some(2.25)),
            ("31.01.2026 23:59", "2026-01-31T23:59:01.5", Some(1.5)),
            ("9:59:58.5", "10:00:00", Some(1.5)),
            ("0:00:00,000", "100:00:00,001", Some(360_000.001)),
            ("0:00:00", "0:60:00", None),
            ("59:58.5", "60:00,0", Some(1.5)),
            ("00:00.0", "59:58", None),
            ("00:00.0", "12345:00.0", None),
            ("0:00:00", "12:00", None),
            ("31.01.2026 12:00", "01/31/2026 12:00", None),
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
