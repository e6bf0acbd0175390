//! Panics of the library that decodes Parquet, which some damaged files cause, as an absent answer.

use std::cell::Cell;
use std::panic::{AssertUnwindSafe, catch_unwind, set_hook, take_hook};
use std::sync::Once;

thread_local! {
    static CATCHING: Cell<bool> = const { Cell::new(false) };
}

/// Does `work`; `None` if it panics, which nothing is printed of.
pub(super) fn caught<T>(work: impl FnOnce() -> T) -> Option<T> {
    static QUIET: Once = Once::new();
    QUIET.call_once(|| {
        let report = take_hook();
        set_hook(Box::new(move |panic| {
            if !CATCHING.get() {
                report(panic);
            }
        }));
    });
    CATCHING.set(true);
    // What the work has changed is dropped with its answer.
    let answer = catch_unwind(AssertUnwindSafe(work));
    CATCHING.set(false);
    answer.ok()
}
