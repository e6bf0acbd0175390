//! What the control task and the planner hand to each other at the end of a block.

use core::cell::Cell;

use model::adaptation::{Observation, Variant};

use crate::control::{Control, Tick};
use crate::isolation::Isolation;

/// What the last block has shown, until the planner takes it, and what is exchanged at the end of the present one.
///
/// The cells hide the unused codes of their content: without them `None` would be one of those, not zero, and the flash would contain a
/// whole variant for the start.
#[derive(Debug)]
pub(super) struct Handover {
    seen: Option<Cell<(Observation, u64)>>,
    next: Option<Cell<Variant>>,
}

impl Handover {
    /// Before the first block.
    pub(super) const EMPTY: Self = Self { seen: None, next: None };

    /// At the end of the block whose last tick has number `number`: exchanges what was planned, and keeps what the block has shown.
    pub(super) fn end_block(&mut self, control: &mut Control, isolation: &mut Isolation, tick: &Tick, number: u64) {
        let next = self.next.as_mut().map(|next| &*next.get_mut());
        let seen = isolation.end_block(control, tick, next);
        *self = Self { seen: Some(Cell::new((seen, number))), next: None };
    }

    /// Returns what the last block has shown, with the number of its last tick, once.
    pub(super) fn take(&mut self) -> Option<(Observation, u64)> {
        self.seen.take().map(Cell::into_inner)
    }

    /// Keeps a plan for the end of the present block. One that comes after the end of its block is dropped: it would be exchanged while the
    /// planner takes a later one for the running one.
    pub(super) fn put(&mut self, next: Option<&Variant>) {
        if self.seen.is_none() {
            self.next = next.copied().map(Cell::new);
        }
    }
}
