//! The store, served by the thread below all tasks: erasing takes long, and blocks need a deep stack.

use core::cell::Cell;

use embassy_sync::blocking_mutex::Mutex;
use embassy_sync::blocking_mutex::raw::CriticalSectionRawMutex;
use embassy_sync::signal::Signal;
use link::{Block, BlockId, Part, Reason, Update};
use model::device;

use crate::settings::BUILT_IN;
use crate::store::{Pages, Store};
use crate::update;

type UpdateResult = Result<Option<BlockId>, Reason>;

/// What the thread is to do.
enum Work {
    Update(Block, Update),
    /// True for the built-in settings, and the number of the part.
    Read(bool, u8),
}

/// What the thread has done.
enum Done {
    Updated(UpdateResult),
    Read(Part),
}

static PENDING: Mutex<CriticalSectionRawMutex, Cell<Option<Work>>> = Mutex::new(Cell::new(None));
static DONE: Signal<CriticalSectionRawMutex, Done> = Signal::new();

/// Passes `update` of a block to the thread and waits for its result.
pub(super) async fn update(block: Block, update: Update) -> UpdateResult {
    match done(Work::Update(block, update)).await {
        Done::Updated(result) => result,
        Done::Read(_) => Err(Reason::NotStored),
    }
}

/// Waits until the thread has read part `number` of the settings that run, or of those that are built in.
pub(super) async fn settings_part(built_in: bool, number: u8) -> Part {
    match done(Work::Read(built_in, number)).await {
        Done::Read(part) => part,
        Done::Updated(_) => Part::of(number, &[]),
    }
}

async fn done(work: Work) -> Done {
    DONE.reset();
    PENDING.lock(|cell| cell.set(Some(work)));
    DONE.wait().await
}

/// Does what is pending on `store`; `running` are the settings that run. The thread calls it repeatedly.
pub fn serve_store<P: Pages>(store: &mut Store<P>, running: &device::Settings) {
    match PENDING.lock(Cell::take) {
        None => {}
        Some(Work::Update(block, update)) => {
            DONE.signal(Done::Updated(update::execute(store, block, update, &BUILT_IN)))
        }
        Some(Work::Read(built_in, number)) => {
            DONE.signal(Done::Read(update::settings_part(if built_in { &BUILT_IN } else { running }, number)));
        }
    }
}
