//! The loop that joins keyboard, worker and screen; without a full screen, a line for each moment.

use std::io;
use std::sync::atomic::{AtomicI32, Ordering};
use std::sync::mpsc::{Receiver, RecvTimeoutError, Sender, TryRecvError, channel};
use std::thread;
use std::time::{Duration, Instant};

use anyhow::{Context, Result, anyhow};
use link::{Fault, Status};
use ratatui::crossterm::event::{self, KeyEventKind};

use super::draw::draw;
use super::message::{Event, Order};
use super::terminal::FullScreen;
use super::view::View;
use super::worker::{Outcome, Settings, Worker};
use crate::link::{Client, Row};
use crate::output::terminal::{print_to_reader, remark};
use crate::signals;

/// Longest wait for a key before the screen is drawn again.
const FRAME: Duration = Duration::from_millis(50);
/// Number of the signal that asked for the end, 0 before.
static SIGNAL: AtomicI32 = AtomicI32::new(0);

/// How long and how to watch.
#[derive(Clone, Copy, Debug)]
pub struct Options {
    /// Time after which it ends by itself.
    pub whole: Duration,
    /// Time between two lines where there is no full screen.
    pub every: Duration,
    /// True to record from the beginning.
    pub record: bool,
    /// True for lines instead of a full screen.
    pub lines: bool,
}

/// Watches the MCU behind `client` until it is asked to end, and disarms it then. Returns what is left to be said, and the
/// number of the signal that ended it, if one did.
///
/// # Errors
/// If the terminal or stdout fails.
pub fn run(
    settings: &Settings,
    (client, status): (Client, Status),
    options: Options,
) -> Result<(Outcome, Option<i32>)> {
    signals::on_signal(|signal| SIGNAL.store(signal, Ordering::SeqCst));
    thread::scope(|scope| {
        let (events, from_worker) = channel();
        let (orders, to_worker) = channel();
        let worker = Worker::new(settings, status, events, to_worker);
        let thread = scope.spawn(move || worker.run(client));
        if options.record {
            let _ = orders.send(Order::Record);
        }
        let view = View::new(&settings.port, &settings.schedule.0, status);
        // Both end with the worker, or drop `orders`, which ends it.
        let shown = if options.lines {
            lines(view, orders, &from_worker, options)
        } else {
            full_screen(view, orders, &from_worker, options)
        };
        let outcome = thread.join().map_err(|_| anyhow!("{}: the thread of the link has failed", settings.port))?;
        shown?;
        let signal = SIGNAL.load(Ordering::SeqCst);
        Ok((outcome, (signal != 0).then_some(signal)))
    })
}

/// True once it is time to end.
fn is_over(begin: Instant, options: Options) -> bool {
    begin.elapsed() >= options.whole || SIGNAL.load(Ordering::SeqCst) != 0
}

fn full_screen(mut view: View, orders: Sender<Order>, events: &Receiver<Event>, options: Options) -> Result<()> {
    let begin = Instant::now();
    let mut screen = FullScreen::enter().context("the terminal cannot show a full screen")?;
    loop {
        loop {
            match events.try_recv() {
                Ok(event) => view.on_event(event),
                Err(TryRecvError::Empty) => break,
                Err(TryRecvError::Disconnected) => return Ok(()),
            }
        }
        if is_over(begin, options) && !view.is_ending {
            view.quit().map(|order| orders.send(order));
        }
        if !screen.is_shown() {
            // The worker has panicked.
            return Ok(());
        }
        screen.terminal.draw(|frame| draw(&view, frame)).context("the terminal cannot be written")?;
        if let Some(key) = next_key().context("the keyboard cannot be read")? {
            view.on_key(key).map(|order| orders.send(order));
        }
    }
}

/// The next key, `None` if none comes in time or something else happens, such as another size of the terminal.
fn next_key() -> io::Result<Option<event::KeyEvent>> {
    if !event::poll(FRAME)? {
        return Ok(None);
    }
    Ok(event::read()?.as_key_event().filter(|key| key.kind != KeyEventKind::Release))
}

fn lines(mut view: View, orders: Sender<Order>, events: &Receiver<Event>, options: Options) -> Result<()> {
    let begin = Instant::now();
    let mut next = begin;
    let mut is_read = print_to_reader(&format!("{}\n", Row::HEADER))?;
    let (mut lost, mut fault) = (None, Fault::NONE);
    loop {
        match events.recv_timeout(FRAME.min(options.every)) {
            Ok(event) => {
                if let Event::Lost(reason) = &event
                    && lost.replace(reason.clone()).is_none()
                {
                    remark(&format!("{}: lost, reconnecting: {reason}", view.port));
                }
                if let Event::Connected(_) = &event
                    && lost.take().is_some()
                {
                    remark(&format!("{}: connected again", view.port));
                }
                if let Event::Failed(reason) = &event {
                    remark(&format!("{}: {reason}", view.port));
                }
                view.on_event(event);
            }
            Err(RecvTimeoutError::Timeout) => {}
            Err(RecvTimeoutError::Disconnected) => return Ok(()),
        }
        if std::mem::replace(&mut fault, view.status.fault) != view.status.fault && fault != Fault::NONE {
            remark(&format!("{}: fault {fault}: {}", view.port, fault.remedy().unwrap_or("unknown to this program")));
        }
        if (is_over(begin, options) || !is_read) && !view.is_ending {
            view.quit().map(|order| orders.send(order));
        }
        if Instant::now() >= next && lost.is_none() && !view.is_ending {
            is_read = print_to_reader(&format!("{}\n", Row::new(&view.sample, view.status.rate_hz).line()))?;
            next = (next + options.every).max(Instant::now());
        }
    }
}
