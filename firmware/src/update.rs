//! Updates of the store by the host: parts of a block, and the check of the whole before it is sealed.

use link::{Block, BlockId, Part, Reason, Update, WireSettings};
use model::device;

use crate::start;
use crate::store::{Pages, Store};

/// Executes an update of `block` on an MCU whose image has the settings `built_in`. Returns the identity of its new content if that is complete and valid.
///
/// # Errors
/// The [`Reason`] for rejecting it; the old content remains.
pub fn execute<P: Pages>(
    store: &mut Store<P>,
    block: Block,
    update: Update,
    built_in: &device::Settings,
) -> Result<Option<BlockId>, Reason> {
    match (block, update) {
        (_, Update::Part(number, bytes)) => store.part(block, number, &bytes).map(|()| None),
        (Block::Model, Update::End { length, checksum }) => {
            let check = |store: &_, payload: &_| start::check_model(store, payload, built_in);
            store.end(block, length, checksum, check).map(Some)
        }
        (Block::Settings, Update::End { length, checksum }) => {
            let check = |store: &_, payload: &_| start::check_settings(store, payload, built_in);
            store.end(block, length, checksum, check).map(Some)
        }
    }
}

/// Part `number` of the payload of `settings`, which is in RAM only meanwhile. What the chosen controller does not use is not
/// kept, and has its default value here.
#[inline(never)]
pub fn settings_part(settings: &device::Settings, number: u8) -> Part {
    Part::of(number, &WireSettings::new(settings).payload().unwrap_or_default())
}
