//! The status of a running loop: refreshed in place on a terminal, one line a sample anywhere else.

use std::io::{self, IsTerminal};

use anyhow::Result;

use super::terminal::{print_error, print_to_reader};
use crate::link::{Row, StatusReport};

/// Where the samples of `vsj link watch` go.
pub struct Screen {
    /// True if the samples go to stderr.
    on_stderr: bool,
    /// True on a terminal: each status overwrites the one before.
    live: bool,
    /// Lines of the last status on a terminal; otherwise rows written so far.
    lines: usize,
}

impl Screen {
    /// Writes to stdout, or with `json` to stderr, since stdout then takes one JSON object only.
    pub fn new(json: bool) -> Self {
        let live = if json { io::stderr().is_terminal() } else { io::stdout().is_terminal() };
        Self { on_stderr: json, live, lines: 0 }
    }

    /// Shows a status; returns false if the reader of stdout has closed the pipe.
    ///
    /// # Errors
    /// If stdout cannot be written for another reason.
    pub fn show(&mut self, report: &StatusReport) -> Result<bool> {
        let mut text = String::new();
        if self.live {
            if self.lines > 0 {
                // Move the cursor up to the first line of the last status.
                text += &format!("\x1b[{}A", self.lines);
            }
            for line in report.text().lines() {
                // Clear what the longer line before it left to its right.
                text += &format!("{line}\x1b[K\n");
            }
            self.lines = report.text().lines().count();
        } else {
            if self.lines == 0 {
                text += &format!("{}\n", Row::HEADER);
            }
            text += &format!("{}\n", report.sample.line());
            self.lines += 1;
        }
        if self.on_stderr {
            print_error(&text);
            return Ok(true);
        }
        print_to_reader(&text)
    }
}
