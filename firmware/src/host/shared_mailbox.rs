//! The mailbox between the host's task and the control task, and the rows of the fast capture.

use core::cell::Cell;

use embassy_sync::blocking_mutex::Mutex;
use embassy_sync::blocking_mutex::raw::CriticalSectionRawMutex;
use embassy_sync::signal::Signal;
use link::capture::Capture;
use link::{Command, Reply, View};
use model::supervisor::State;

use crate::capture::Recorder;
use crate::capture_memory;
use crate::control::{Control, Source, Tick};
use crate::isolation::{self, News};
use crate::mailbox::Mailbox;

static MAILBOX: Mutex<CriticalSectionRawMutex, Cell<Mailbox>> = Mutex::new(Cell::new(Mailbox::EMPTY));
/// View of the tick that has taken a command.
static DONE: Signal<CriticalSectionRawMutex, View> = Signal::new();

/// The fast capture.
static RECORDER: Recorder = Recorder::new();

/// Executes a request about the capture.
pub(super) fn capture(request: Capture) -> Reply {
    RECORDER.execute(capture_memory::words(), request)
}

/// Runs `work` on the mailbox, with interrupts off.
pub(super) fn with_mailbox<T>(work: impl FnOnce(&mut Mailbox) -> T) -> T {
    MAILBOX.lock(|cell| {
        let mut mailbox = cell.get();
        let result = work(&mut mailbox);
        cell.set(mailbox);
        result
    })
}

/// Stores `command`, which was created in `state`, and waits for the view of the tick that takes it.
pub(super) async fn hand_over(command: Command, state: State) -> View {
    DONE.reset();
    with_mailbox(|mailbox| mailbox.put(command, state));
    DONE.wait().await
}

/// The host as the control task's source of commands.
#[derive(Debug)]
pub struct Host {
    state: State,
    took_command: bool,
    /// Number of ticks since the start, the present one included.
    tick: u64,
}

impl Host {
    /// The host before the first tick of `control`.
    pub fn new(control: &Control) -> Self {
        Self { state: control.supervisor().state(), took_command: false, tick: 0 }
    }
}

impl Source for Host {
    fn command(&mut self, tick: u64) -> Option<Command> {
        self.tick = tick + 1;
        let (command, taken) = with_mailbox(|mailbox| mailbox.take(self.state));
        self.took_command = taken;
        Some(command)
    }

    fn done(&mut self, tick: &Tick, control: &Control, overruns: u32) {
        let supervisor = control.supervisor();
        self.state = supervisor.state();
        let view = tick.view(self.tick, supervisor, overruns);
        RECORDER.tick(capture_memory::words(), &view.sample, overruns);
        with_mailbox(|mailbox| mailbox.show(view));
        if self.took_command {
            DONE.signal(view);
        }
    }

    fn take_acknowledged(&mut self) -> bool {
        isolation::take_acknowledged()
    }

    fn isolated(&mut self, news: &News) {
        isolation::publish(news, self.tick);
    }
}
