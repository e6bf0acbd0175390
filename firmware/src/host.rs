//! The host's task, and its orders as the control task's [`Source`].

use core::cell::Cell;
use core::future::Future;

use cortex_m::singleton;
use embassy_sync::blocking_mutex::Mutex;
use embassy_sync::blocking_mutex::raw::CriticalSectionRawMutex;
use embassy_sync::signal::Signal;
use embassy_time::{Duration, Timer, with_timeout};
use link::reply::Firmware;
use link::{About, Controller, Desk, Keep, ModelId, Reason, Step, Telemetry, View};
use model::stiffness::{Cantilever, YoungsModulus};
use model::supervisor::{Fault, State};
use model::{OutOfRange, SampleTime, Settings, Spring};

use crate::RATE_HZ;
use crate::control::{Control, Orders, Tick};
use crate::post::{Letter, Post};
use crate::roll_call::Member;
use crate::settings::SUPERVISION;
use crate::start::{self, Start};
use crate::store::{Pages, Store};
use crate::tasks::{ROLL_CALL, Source};
use crate::{log, stop};

/// Longest wait for a byte: so often is looked whether telemetry is due.
const LISTEN: Duration = Duration::from_millis(1);
/// Longest wait until the line takes an answer, longer than it needs for the longest one. A host that does not read must
/// not keep this task from the roll call; the rest of the answer is lost, and the host asks again.
const SPEAK: Duration = Duration::from_millis(20);

static POST: Mutex<CriticalSectionRawMutex, Cell<Post>> = Mutex::new(Cell::new(Post::EMPTY));
/// The view of the tick that took an order out.
static DONE: Signal<CriticalSectionRawMutex, View> = Signal::new();

/// For the store of models.
static KEEP: Mutex<CriticalSectionRawMutex, Cell<Option<Keep>>> = Mutex::new(Cell::new(None));
/// What came of it.
static KEPT: Signal<CriticalSectionRawMutex, Result<Option<ModelId>, Reason>> = Signal::new();

fn with_post<T>(work: impl FnOnce(&mut Post) -> T) -> T {
    POST.lock(|cell| {
        let mut post = cell.get();
        let result = work(&mut post);
        cell.set(post);
        result
    })
}

/// Where bytes come from and go to.
pub trait Line {
    /// Waits for bytes; how many came. May be dropped while waiting, without loss.
    fn read(&mut self, buffer: &mut [u8]) -> impl Future<Output = usize>;

    /// Sends all of `bytes`.
    fn write(&mut self, bytes: &[u8]) -> impl Future<Output = ()>;
}

/// Between the host and the control task, for ever.
pub async fn talk(line: &mut impl Line, desk: &mut Desk) -> ! {
    ROLL_CALL.enrol(Member::Link);
    let mut buffer = [0; 32];
    loop {
        ROLL_CALL.check_in(Member::Link);
        let count = with_timeout(LISTEN, line.read(&mut buffer)).await.unwrap_or(0);
        for byte in buffer.iter().take(count) {
            // None before the first tick: nobody can be answered yet, and hosts ask again.
            let Some(view) = with_post(|post| post.view()) else { break };
            match desk.on_byte(*byte, &view) {
                None => {}
                Some(Step::Send(bytes)) => say(line, bytes).await,
                Some(Step::Order(order)) => {
                    let heard = desk.take_heard();
                    let after = hand_over(Letter { order, made_in: view.state }, heard).await;
                    say(line, desk.settle(&after)).await;
                }
                Some(Step::Keep(keep)) => {
                    KEPT.reset();
                    KEEP.lock(|cell| cell.set(Some(keep)));
                    let kept = KEPT.wait().await;
                    say(line, desk.kept(kept, &view)).await;
                }
                Some(Step::Restart(bytes)) => {
                    say(line, bytes).await;
                    // Until the last bytes have left.
                    Timer::after(SPEAK).await;
                    stop::restart()
                }
            }
            if desk.take_heard() {
                with_post(|post| post.hear(true));
            }
        }
        if let Some(view) = with_post(|post| post.view())
            && let Some(bytes) = desk.telemetry(&view)
        {
            say(line, bytes).await;
        }
    }
}

/// Keeps what the host's task wants kept. The thread below all tasks does it, again and again: erasing takes long, and
/// checking a model takes a deep stack.
pub fn keep<P: Pages>(store: &mut Store<P>) {
    let Some(keep) = KEEP.lock(Cell::take) else { return };
    KEPT.signal(match keep {
        Keep::Part(number, bytes) => store.part(number, &bytes).map(|()| None),
        Keep::End { length, checksum } => store.end(length, checksum, start::check).map(Some),
    });
}

async fn say(line: &mut impl Line, bytes: &[u8]) {
    // A timeout needs no answer of its own: the frame is cut off, and the host drops it.
    let _ = with_timeout(SPEAK, line.write(bytes)).await;
    ROLL_CALL.check_in(Member::Link);
}

/// Waits for the tick that takes the order out.
async fn hand_over(letter: Letter, heard: bool) -> View {
    DONE.reset();
    with_post(|post| {
        post.hear(heard);
        post.put(letter);
    });
    DONE.wait().await
}

/// Controller and desk, from what is stored; `None` if somebody has them already.
///
/// # Errors
/// [`OutOfRange`] names the setting.
pub fn open<P: Pages>(
    settings: &Settings,
    store: &Store<P>,
    last_fault: Option<Fault>,
) -> Result<Option<(&'static mut Control, &'static mut Desk)>, OutOfRange> {
    let Some(place) = singleton!(: Option<Control> = None) else { return Ok(None) };
    let (control, start) = start::control(settings, store.newest(), last_fault, place)?;
    if let Some(field) = start.refused {
        log::refused(field);
    }
    Ok(desk(&start, Controller::of(&settings.compensation))?.map(|desk| (control, desk)))
}

/// Not inlined: what it needs on the stack is not to stay there.
#[inline(never)]
fn desk(start: &Start, controller: Controller) -> Result<Option<&'static mut Desk>, OutOfRange> {
    let amplifier = &start.amplifier;
    let spring = Spring::new(YoungsModulus::PAPER, Cantilever::PAPER, amplifier.min_v, amplifier.max_v)?;
    let part = |text: &str| text.parse().unwrap_or(0);
    let revision = env!("GIT_REVISION").get(..8).and_then(|digits| u32::from_str_radix(digits, 16).ok());
    let firmware = Firmware {
        major: part(env!("CARGO_PKG_VERSION_MAJOR")),
        minor: part(env!("CARGO_PKG_VERSION_MINOR")),
        patch: part(env!("CARGO_PKG_VERSION_PATCH")),
        revision: revision.unwrap_or(0),
        controller,
    };
    let about = About {
        firmware,
        rate_hz: RATE_HZ,
        silence_limit_ticks: SUPERVISION.host_timeout_ticks(SampleTime::from_rate(f64::from(RATE_HZ))?),
        last_fault: start.last_fault.map_or(link::Fault::NONE, Into::into),
        model: start.model,
        stored: start.stored,
    };
    Ok(singleton!(: Desk = Desk::new(spring, about)))
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
