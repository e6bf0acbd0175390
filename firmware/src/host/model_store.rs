//! The model store, served by the thread below all tasks: erasing takes long, and validating a model needs a deep stack.

use core::cell::Cell;

use embassy_sync::blocking_mutex::Mutex;
use embassy_sync::blocking_mutex::raw::CriticalSectionRawMutex;
use embassy_sync::signal::Signal;
use link::{BlockId, ModelUpdate, Reason};

use crate::start;
use crate::store::{Pages, Store};

type UpdateResult = Result<Option<BlockId>, Reason>;

static PENDING: Mutex<CriticalSectionRawMutex, Cell<Option<ModelUpdate>>> = Mutex::new(Cell::new(None));
static RESULT: Signal<CriticalSectionRawMutex, UpdateResult> = Signal::new();

/// Passes `update` to the thread and waits for its result.
pub(super) async fn update_model(update: ModelUpdate) -> UpdateResult {
    RESULT.reset();
    PENDING.lock(|cell| cell.set(Some(update)));
    RESULT.wait().await
}

/// Executes a pending update on `store`. The thread calls it repeatedly.
pub fn serve_model_store<P: Pages>(store: &mut Store<P>) {
    let Some(update) = PENDING.lock(Cell::take) else { return };
    RESULT.signal(match update {
        ModelUpdate::Part(number, bytes) => store.part(number, &bytes).map(|()| None),
        ModelUpdate::End { length, checksum } => store.end(length, checksum, start::check).map(Some),
    });
}
