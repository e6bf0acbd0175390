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
///
/// Nothing is read from the flash: the payload is made of settings that were validated at the start. The longest one fits, which a test
/// of [`WireSettings`] shows; a longer one would be sent as no bytes, which are no settings, so that the host reports an error.
#[inline(never)]
pub fn settings_part(settings: &device::Settings, number: u8) -> Part {
    Part::of(number, &WireSettings::new(settings).payload().unwrap_or_default())
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::settings::BUILT_IN;
    use crate::store::Memory;
    use link::{WireModel, frame};
    use model::adaptation;
    use model::isolation::{Cause, Causes, Tolerance};

    /// Sends a payload in parts and ends it; returns what each part and the end were answered.
    fn send(store: &mut Store<Memory>, block: Block, payload: &[u8]) -> Result<Option<BlockId>, Reason> {
        for (number, bytes) in (0..).zip(payload.chunks(link::block::PART)) {
            let bytes: std::vec::Vec<u8> = bytes.iter().copied().chain([0; link::block::PART]).collect();
            let part = Update::Part(number, *bytes.first_chunk().unwrap());
            assert_eq!(execute(store, block, part, &BUILT_IN), Ok(None), "part {number}");
        }
        let end = Update::End { length: payload.len() as u16, checksum: frame::checksum(payload) };
        execute(store, block, end, &BUILT_IN)
    }

    #[test]
    fn a_block_is_stored_once_it_is_complete_and_valid_and_its_identity_is_returned() {
        let mut store = Store::new(Memory::default());
        let model = WireModel { share: 0.1, time_constants_s: [5.5].into_iter().collect(), ..WireModel::default() };
        let model = model.payload().unwrap();
        let settings = WireSettings::new(&BUILT_IN).payload().unwrap();
        for (block, payload) in [(Block::Model, &model[..]), (Block::Settings, &settings[..])] {
            let id = BlockId::of(1, payload);
            assert_eq!(send(&mut store, block, payload), Ok(Some(id)), "{block:?}");
            assert_eq!(store.newest(block).map(|(id, stored)| (id, stored.to_vec())), Some((id, payload.to_vec())));
            assert_eq!(send(&mut store, block, b"noise"), Err(Reason::Damaged), "{block:?}");
            assert_eq!(store.newest(block).map(|(id, _)| id), Some(id), "the old content remains");
        }
    }

    /// Of settings without and with the optional tables that every image can keep.
    #[test]
    fn parts_of_settings_are_their_whole_payload() {
        let mut all = BUILT_IN;
        all.control.amplifier.slew_v_per_s = Some(1e4);
        all.trip_on_cause = Causes::NONE.with(Cause::GainError);
        all.tolerance = Tolerance { time_constant: 0.01, share: 0.02, gain: 0.005 };
        all.adaptation = Some(adaptation::Settings::TYPICAL);
        for settings in [BUILT_IN, all] {
            let (mut bytes, mut number) = (std::vec::Vec::new(), 0);
            let length = loop {
                let part = settings_part(&settings, number);
                assert_eq!(part.number, number);
                bytes.extend(part.bytes);
                if bytes.len() >= usize::from(part.length) {
                    break part.length;
                }
                number += 1;
            };
            bytes.truncate(usize::from(length));
            assert_eq!(WireSettings::read(&bytes), Some(WireSettings::new(&settings)));
        }
        assert_eq!(WireSettings::read(&[]), None, "no bytes are no settings");
    }
}
