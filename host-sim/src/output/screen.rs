//! The status of a running loop: refreshed in place on a terminal, one line a sample anywhere else.

use std::io::{self, IsTerminal, Write};

use crate::link::{Row, StatusReport};

/// Where the samples of `vsj link watch` go.
pub struct Screen {
    out: Box<dyn Write>,
    /// True on a terminal: each status overwrites the one before.
    live: bool,
    /// Lines of the last status on a terminal; otherwise rows written so far.
    lines: usize,
}

impl Screen {
    /// Writes to stdout, or with `json` to stderr, since stdout then takes one JSON object only.
    pub fn new(json: bool) -> Self {
        let (out, live): (Box<dyn Write>, _) = if json {
            (Box::new(io::stderr()), io::stderr().is_terminal())
        } else {
            (Box::new(io::stdout()), io::stdout().is_terminal())
        };
        Self { out, live, lines: 0 }
    }

    /// Shows a status.
    ///
    /// # Errors
    /// If it cannot be written, for example to a pipe that its reader has closed.
    pub fn show(&mut self, report: &StatusReport) -> io::Result<()> {
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
        self.out.write_all(text.as_bytes())?;
        self.out.flush()
    }
}
