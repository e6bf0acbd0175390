//! A log as text: table, CSV, summary.

use std::borrow::Cow;
use std::fmt::{Display, Write};

use model::Limits;
use simulation::bad_input::one_line;

use crate::log::{Cause, Event, Item, Line, Summary};

/// Header of the table.
pub const TABLE_HEADER: &str = "    time [s]  level  message";

/// Header of the CSV file.
pub const CSV_HEADER: &str = "time_s,level,event,message";

/// An item as a line of the table, without line break.
pub fn table_row(item: &Item) -> String {
    match item {
        Item::Line(line) => {
            let time = line.time_us.map_or_else(|| "-".to_owned(), seconds);
            let level = line.level.map_or_else(|| "-".to_owned(), |level| level.to_string());
            format!("{time:>12}  {level:<5}  {}{}", one_line(&line.message), limits(line))
        }
        other => format!("{:>12}  {:<5}  {}", "-", "-", damage(other)),
    }
}

/// An item as a row of the CSV file, without line break; damage is a comment.
pub fn csv_row(item: &Item) -> String {
    match item {
        Item::Line(line) => {
            let time = line.time_us.map(seconds).unwrap_or_default();
            let level = line.level.map(|level| level.to_string().to_lowercase()).unwrap_or_default();
            format!("{time},{level},{},{}", line.event.name(), quoted(&one_line(&line.message)))
        }
        other => format!("# {}", damage(other)),
    }
}

/// The summary as several lines of text.
pub fn summary_text(summary: &Summary) -> String {
    let mut text = String::from("summary\n");
    let Summary { lines, errors, warnings, .. } = summary;
    entry(&mut text, "lines", &format!("{lines} (error {errors}, warn {warnings})"));
    entry(&mut text, "starts", &starts(summary));
    entry(&mut text, "ticks", &summary.ticks.to_string());
    entry(&mut text, "overruns", &optional(summary.overruns, ""));
    entry(&mut text, "worst lateness", &optional(summary.worst_lateness_us, " us"));
    entry(&mut text, "time in limits", &time_in_limits(summary));
    entry(&mut text, "faults", &faults(summary));
    if !summary.causes.is_empty() {
        entry(&mut text, "named causes", &causes(summary));
    }
    if summary.panics > 0 {
        entry(&mut text, "panics", &summary.panics.to_string());
    }
    if summary.dropped > 0 {
        entry(&mut text, "dropped", &format!("lines {}, by the firmware", summary.dropped));
    }
    if let Some(done) = &summary.done {
        let run = format!("{} ticks, {} missed, digest {:016x}", done.ticks, done.missed, done.digest);
        entry(&mut text, "run", &run);
        entry(&mut text, "instructions", &format!("{} to {} a tick, mean {}", done.min, done.max, done.mean));
    }
    if summary.damaged_frames > 0 {
        let Summary { damaged_frames, damaged_bytes, .. } = summary;
        entry(&mut text, "damaged", &format!("frames {damaged_frames}, bytes {damaged_bytes}"));
    }
    if summary.cut_off_bytes > 0 {
        entry(&mut text, "cut off", &format!("bytes {} of a last frame", summary.cut_off_bytes));
    }
    text
}

fn starts(summary: &Summary) -> String {
    let mut text = summary.boots.len().to_string();
    for (number, boot) in summary.boots.iter().enumerate() {
        text += if number == 0 { ": " } else { ", " };
        text += &one_line(&boot.reset);
        if boot.last_fault != 0 {
            text += &format!(" after fault {}", boot.last_fault);
        }
    }
    if summary.boots_not_seen > 0 {
        text += &format!("; {} more without a boot line", summary.boots_not_seen);
    }
    text
}

fn time_in_limits(summary: &Summary) -> String {
    let mut text = match (summary.limited_s, summary.limited_ticks) {
        (Some(time), Some(ticks)) => format!("{time:.3} s (ticks {ticks})"),
        (None, Some(ticks)) => format!("- (ticks {ticks}, their rate is not known)"),
        (_, None) => "-".to_owned(),
    };
    let lines = summary.limit_lines;
    for (name, count) in
        [("upper", lines.upper), ("lower", lines.lower), ("slew", lines.slew), ("target", lines.target)]
    {
        if count > 0 {
            text += &format!(", {name} x{count}");
        }
    }
    text
}

fn faults(summary: &Summary) -> String {
    let all: u64 = summary.faults.iter().map(|fault| fault.count).sum();
    let mut text = all.to_string();
    for (number, fault) in summary.faults.iter().enumerate() {
        text += if number == 0 { ": " } else { ", " };
        text += &format!("{} (code {}) x{}", one_line(&fault.name), fault.code, fault.count);
    }
    text
}

fn causes(summary: &Summary) -> String {
    let one = |Cause { cause, named, withdrawn }: &Cause| {
        let withdrawn = if *withdrawn > 0 { format!(", withdrawn x{withdrawn}") } else { String::new() };
        format!("{} x{named}{withdrawn}", one_line(cause))
    };
    summary.causes.iter().map(one).collect::<Vec<_>>().join(", ")
}

/// Names of the limits in a limit line.
fn limits(line: &Line) -> String {
    let Event::Limit { bits, .. } = line.event else { return String::new() };
    let names =
        [(Limits::UPPER, "upper"), (Limits::LOWER, "lower"), (Limits::SLEW, "slew"), (Limits::TARGET, "target")];
    let names: Vec<&str> = names.iter().filter(|(limit, _)| bits & limit.bits() != 0).map(|&(_, name)| name).collect();
    if names.is_empty() { " (none)".to_owned() } else { format!(" ({})", names.join(", ")) }
}

/// A line of the table that stands for a run of damaged frames after its first.
pub fn more_damage_table_row(frames: u64, bytes: u64) -> String {
    format!("{:>12}  {:<5}  {}", "-", "-", more_damage(frames, bytes))
}

/// A comment of the CSV file that stands for a run of damaged frames after its first.
pub fn more_damage_csv_row(frames: u64, bytes: u64) -> String {
    format!("# {}", more_damage(frames, bytes))
}

fn more_damage(frames: u64, bytes: u64) -> String {
    format!("damaged: and {bytes} bytes after it, {frames} frames")
}

fn damage(item: &Item) -> String {
    match item {
        Item::Line(_) => String::new(),
        Item::Damaged { offset, bytes } => format!("damaged: {bytes} bytes at byte {offset} are not a valid frame"),
        Item::Lost { offset } => {
            format!("damaged: invalid frame at byte {offset}, after which a raw log has no marks to continue from")
        }
        Item::Unread { bytes } => format!("damaged: {bytes} bytes not read"),
        Item::CutOff { offset, bytes } => format!("cut off: {bytes} bytes at byte {offset} are an incomplete frame"),
    }
}

fn entry(text: &mut String, name: &str, value: &str) {
    // Writing to a string cannot fail.
    let _ = writeln!(text, "  {name:<15} {value}");
}

fn optional<T: Display>(value: Option<T>, unit: &str) -> String {
    value.map_or_else(|| "-".to_owned(), |value| format!("{value}{unit}"))
}

fn seconds(us: u64) -> String {
    format!("{}.{:06}", us / 1_000_000, us % 1_000_000)
}

fn quoted(text: &str) -> Cow<'_, str> {
    if text.contains(['"', ',']) { format!("\"{}\"", text.replace('"', "\"\"")).into() } else { text.into() }
}
