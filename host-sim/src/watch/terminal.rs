//! The full screen: raw mode and the terminal's second screen, both left again however the program ends.

use std::io::{self, IsTerminal, Stdout, stdout};
use std::panic;
use std::sync::Once;
use std::sync::atomic::{AtomicBool, Ordering};

use ratatui::Terminal;
use ratatui::backend::CrosstermBackend;
use ratatui::crossterm::cursor::Show;
use ratatui::crossterm::execute;
use ratatui::crossterm::terminal::{
    Clear, ClearType, EnterAlternateScreen, LeaveAlternateScreen, disable_raw_mode, enable_raw_mode,
};

use crate::signals;

/// True while the full screen is shown.
static IS_FULL: AtomicBool = AtomicBool::new(false);

/// The full screen, left when dropped.
pub struct FullScreen {
    /// What is drawn to.
    pub terminal: Terminal<CrosstermBackend<Stdout>>,
}

impl FullScreen {
    /// Shows an empty full screen. A panic in any thread and a signal leave it before they print or end anything.
    ///
    /// # Errors
    /// If the terminal refuses it.
    pub fn enter() -> io::Result<Self> {
        static HOOKS: Once = Once::new();
        HOOKS.call_once(|| {
            signals::at_end(leave);
            let print = panic::take_hook();
            panic::set_hook(Box::new(move |what| {
                leave();
                print(what);
            }));
        });
        enable_raw_mode()?;
        IS_FULL.store(true, Ordering::SeqCst);
        // From here on dropping it restores the terminal.
        let screen = Self { terminal: Terminal::new(CrosstermBackend::new(stdout()))? };
        // A terminal without a second screen would still show what was on it before.
        execute!(stdout(), EnterAlternateScreen, Clear(ClearType::All))?;
        Ok(screen)
    }

    /// True until it was left by [`leave`].
    pub fn is_shown(&self) -> bool {
        IS_FULL.load(Ordering::SeqCst)
    }
}

impl Drop for FullScreen {
    fn drop(&mut self) {
        leave();
    }
}

/// Leaves the full screen if it is shown: the terminal is as before, with what was on it.
pub fn leave() {
    if IS_FULL.swap(false, Ordering::SeqCst) {
        // There is nothing else to be done for a terminal that is gone.
        let _ = disable_raw_mode();
        let _ = execute!(stdout(), LeaveAlternateScreen, Show);
    }
}

/// Why there is no full screen; `None` if there can be one.
pub fn obstacle() -> Option<&'static str> {
    if !stdout().is_terminal() {
        return Some("stdout is no terminal");
    }
    if !io::stdin().is_terminal() {
        return Some("stdin is no terminal");
    }
    match std::env::var("TERM") {
        Ok(name) if name == "dumb" => Some("TERM=dumb"),
        Ok(name) if name.is_empty() => Some("TERM is empty"),
        Err(_) if cfg!(unix) => Some("TERM is not set"),
        _ => None,
    }
}
