//! Updates of the store by the host: parts of a block, and the check of the whole before it is sealed.

use link::{Block, BlockId, Reason, Update, WireSettings};

use crate::settings::BUILT_IN;
use crate::start;
use crate::store::{Pages, Store};

/// Executes an update of `block`. Returns the identity of its new content if that is complete and valid.
///
/// # Errors
/// The [`Reason`] for rejecting it; the old content remains.
pub fn execute<P: Pages>(store: &mut Store<P>, block: Block, update: Update) -> Result<Option<BlockId>, Reason> {
    match (block, update) {
        (_, Update::Part(number, bytes)) => store.part(block, number, &bytes).map(|()| None),
        (Block::Model, Update::End { length, checksum }) => {
            store.end(block, length, checksum, start::check_model).map(Some)
        }
        (Block::Settings, Update::End { length, checksum }) => {
            store.end(block, length, checksum, start::check_settings).map(Some)
        }
    }
}

/// Calls `each` with the payload of the built-in settings, which is in RAM only meanwhile.
#[inline(never)]
pub fn with_built_in<T>(each: impl FnOnce(&[u8]) -> T) -> T {
    each(&WireSettings::new(&BUILT_IN).payload().unwrap_or_default())
}
