//! Counts of what a command has tried, kept in the target directory, each with its date and the commit.
//!
//! A command that has run to its end writes its counts with [`Tally::write`]; `cargo xtask counts` prints all of them.

use std::fs;
use std::path::PathBuf;
use std::time::{SystemTime, UNIX_EPOCH};

use anyhow::{Context, Result};
use serde_json::{Value, json};

use crate::{files, shell};

/// What one command has counted.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Tally {
    /// Date in UTC, as `2026-01-31`.
    pub date: String,
    /// Short hash of the commit; a `+` follows if a tracked file differed from it.
    pub commit: String,
    /// What was counted, and how often, in the order of the command.
    pub counts: Vec<(String, u64)>,
}

impl Tally {
    /// Counts of now, of the sources as they are.
    ///
    /// # Errors
    /// If git does not start.
    pub fn now(counts: impl IntoIterator<Item = (String, u64)>) -> Result<Self> {
        let seconds = SystemTime::now().duration_since(UNIX_EPOCH).context("the clock is before 1970")?.as_secs();
        let describe = ["describe", "--always", "--exclude=*", "--dirty=+"];
        let commit = shell::output(shell::command("git").args(describe))?.trim().to_owned();
        Ok(Self { date: date(seconds / 86_400), commit, counts: counts.into_iter().collect() })
    }

    /// Keeps the counts of a command, in place of those of its last run.
    ///
    /// # Errors
    /// If the file cannot be written.
    pub fn write(&self, command: &str) -> Result<()> {
        let path = file(command)?;
        let folder = path.parent().context("a file in a folder")?;
        files::make(folder)?;
        let text = serde_json::to_string_pretty(&self.to_json())? + "\n";
        files::write(&path, text)
    }

    /// The counts of the last run of a command, none if it has not run.
    ///
    /// # Errors
    /// If the file is damaged.
    pub fn read(command: &str) -> Result<Option<Self>> {
        let path = file(command)?;
        let Ok(text) = fs::read_to_string(&path) else { return Ok(None) };
        let tally = serde_json::from_str(&text).ok().as_ref().and_then(Self::from_json);
        tally.map(Some).with_context(|| format!("{} is damaged; delete it", path.display()))
    }

    fn to_json(&self) -> Value {
        let counts: Vec<Value> = self.counts.iter().map(|(what, count)| json!([what, count])).collect();
        json!({ "date": self.date, "commit": self.commit, "counts": counts })
    }

    fn from_json(json: &Value) -> Option<Self> {
        let text = |key: &str| Some(json.get(key)?.as_str()?.to_owned());
        let row = |row: &Value| Some((row.get(0)?.as_str()?.to_owned(), row.get(1)?.as_u64()?));
        let counts = json.get("counts")?.as_array()?.iter().map(row).collect::<Option<_>>()?;
        Some(Self { date: text("date")?, commit: text("commit")?, counts })
    }
}

fn file(command: &str) -> Result<PathBuf> {
    Ok(shell::target_directory()?.join("counts").join(command).with_extension("json"))
}

/// The date of a day after 1970-01-01 in the Gregorian calendar.
fn date(day: u64) -> String {
    let leap = |year: u64| year.is_multiple_of(4) && (!year.is_multiple_of(100) || year.is_multiple_of(400));
    let (mut day, mut year) = (day, 1970);
    while day >= 365 + u64::from(leap(year)) {
        day -= 365 + u64::from(leap(year));
        year += 1;
    }
    let mut month = 0;
    for length in [31, 28 + u64::from(leap(year)), 31, 30, 31, 30, 31, 31, 30, 31, 30, 31] {
        if day < length {
            break;
        }
        day -= length;
        month += 1;
    }
    format!("{year}-{:02}-{:02}", month + 1, day + 1)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn dates_are_those_of_the_calendar() {
        // From `date -u -d @SECONDS`.
        for (seconds, expected) in [
            (0, "1970-01-01"),
            (951_782_400, "2000-02-29"),
            (1_735_603_200, "2024-12-31"),
            (4_107_542_400, "2100-03-01"),
        ] {
            assert_eq!(date(seconds / 86_400), expected);
        }
    }

    #[test]
    fn what_is_read_is_what_was_written() {
        let counts = vec![("inputs".to_owned(), 12), ("findings".to_owned(), 0)];
        let tally = Tally { date: "2026-01-31".into(), commit: "abc+".into(), counts };
        assert_eq!(Tally::from_json(&tally.to_json()), Some(tally));
        assert_eq!(Tally::from_json(&json!({ "date": "2026-01-31" })), None);
    }

    #[test]
    fn the_counts_of_now_name_a_commit() {
        let now = Tally::now([]).unwrap();
        assert!(now.commit.len() >= 7 && now.date.as_str() > "2025", "{now:?}");
    }
}
