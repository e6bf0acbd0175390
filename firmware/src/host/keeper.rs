//! The store of models, kept by the thread below all tasks: erasing takes long, and checking a model takes a deep stack.

use core::cell::Cell;

use embassy_sync::blocking_mutex::Mutex;
use embassy_sync::blocking_mutex::raw::CriticalSectionRawMutex;
use embassy_sync::signal::Signal;
use link::{Keep, ModelId, Reason};

use crate::start;
use crate::store::{Pages, Store};

type Kept = Result<Option<ModelId>, Reason>;

static KEEP: Mutex<CriticalSectionRawMutex, Cell<Option<Keep>>> = Mutex::new(Cell::new(None));
/// What came of it.
static KEPT: Signal<CriticalSectionRawMutex, Kept> = Signal::new();

/// Has `keep` kept, and waits for what comes of it.
pub(super) async fn kept(keep: Keep) -> Kept {
    KEPT.reset();
    KEEP.lock(|cell| cell.set(Some(keep)));
    KEPT.wait().await
}

/// Keeps what the host's task wants kept. The thread does it again and again.
pub fn keep<P: Pages>(store: &mut Store<P>) {
    let Some(keep) = KEEP.lock(Cell::take) else { return };
    KEPT.signal(match keep {
        Keep::Part(number, bytes) => store.part(number, &bytes).map(|()| None),
        Keep::End { length, checksum } => store.end(length, checksum, start::check).map(Some),
    });
}
