//! The store, served by the thread below all tasks: erasing takes long, and validating a block needs a deep stack.

use core::cell::Cell;

use embassy_sync::blocking_mutex::Mutex;
use embassy_sync::blocking_mutex::raw::CriticalSectionRawMutex;
use embassy_sync::signal::Signal;
use link::{Block, BlockId, Reason, Update};

use crate::store::{Pages, Store};
use crate::update;

type UpdateResult = Result<Option<BlockId>, Reason>;

static PENDING: Mutex<CriticalSectionRawMutex, Cell<Option<(Block, Update)>>> = Mutex::new(Cell::new(None));
static RESULT: Signal<CriticalSectionRawMutex, UpdateResult> = Signal::new();

/// Passes `update` of a block to the thread and waits for its result.
pub(super) async fn update(block: Block, update: Update) -> UpdateResult {
    RESULT.reset();
    PENDING.lock(|cell| cell.set(Some((block, update))));
    RESULT.wait().await
}

/// Executes a pending update on `store`. The thread calls it repeatedly.
pub fn serve_store<P: Pages>(store: &mut Store<P>) {
    let Some((block, update)) = PENDING.lock(Cell::take) else { return };
    RESULT.signal(update::execute(store, block, update));
}
