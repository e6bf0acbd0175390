//! Between the host's task and the control task.

use core::cell::Cell;

use embassy_sync::blocking_mutex::Mutex;
use embassy_sync::blocking_mutex::raw::CriticalSectionRawMutex;
use embassy_sync::signal::Signal;
use link::{Telemetry, View};
use model::supervisor::State;

use crate::control::{Control, Orders, Tick};
use crate::post::{Letter, Post};
use crate::tasks::Source;

static POST: Mutex<CriticalSectionRawMutex, Cell<Post>> = Mutex::new(Cell::new(Post::EMPTY));
/// The view of the tick that took an order out.
static DONE: Signal<CriticalSectionRawMutex, View> = Signal::new();

pub(super) fn with_post<T>(work: impl FnOnce(&mut Post) -> T) -> T {
    POST.lock(|cell| {
        let mut post = cell.get();
        let result = work(&mut post);
        cell.set(post);
        result
    })
}

/// Waits for the tick that takes the order out.
pub(super) async fn hand_over(letter: Letter, heard: bool) -> View {
    DONE.reset();
    with_post(|post| {
        post.hear(heard);
        post.put(letter);
    });
    DONE.wait().await
}

/// The host, as the control task sees it.
#[derive(Debug)]
pub struct Host {
    state: State,
    ordered: bool,
    tick: u64,
}

impl Host {
    /// Before the first tick of `control`.
    pub fn new(control: &Control) -> Self {
        Self { state: control.supervisor().state(), ordered: false, tick: 0 }
    }
}

impl Source for Host {
    fn orders(&mut self, _tick: u32) -> Option<Orders> {
        let (orders, ordered) = with_post(|post| post.take(self.state));
        self.ordered = ordered;
        Some(orders)
    }

    fn done(&mut self, tick: &Tick, control: &Control, overruns: u32) {
        let supervisor = control.supervisor();
        self.state = supervisor.state();
        self.tick += 1;
        let output = &tick.output;
        let sample = Telemetry {
            tick: self.tick,
            state: supervisor.into(),
            target: output.target.into(),
            applied: output.applied.into(),
            estimate: output.stiffness.into(),
            measured: tick.measured.map(Into::into),
            code: tick.drive.code().0,
            limits: supervisor.limits(output).bits(),
        };
        let view = View { sample, state: self.state, refusal: supervisor.refusal(), overruns };
        with_post(|post| post.show(view));
        if self.ordered {
            DONE.signal(view);
        }
    }
}
