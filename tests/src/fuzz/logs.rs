//! The firmware's log and the image that it is decoded with.

use std::sync::Once;

use host_sim::log::{Decoder, Formats, Item, Summary, silence_the_decoder, summary_text, table_row};

use super::check_error;
use crate::defmt::{Firmware, Value};

/// Format strings with every kind of argument that the firmware logs, and those that decoders find difficult.
const STRINGS: &[(&str, &str)] = &[
    ("info", "boot version={=str} git={=str} reset={=str} last_fault={=u8} rate_hz={=u32}"),
    ("info", "state {=str} -> {=str}"),
    ("error", "fault code={=u8} name={=str} tick={=u32}"),
    ("warn", "limit bits={=u8} tick={=u32}"),
    ("println", "{=str}"),
    ("info", "x {=[u8]:02x}"),
    ("info", "y {=?}"),
    ("prim", "{=[?]}"),
    ("derived", "N({=?})"),
    ("derived", "None|Some({=u16})"),
    ("info", "z {=u64:iso8601s} {=f32} {=bool} {=char} {=i64} {0=0..8}"),
    ("info", "plain"),
];

fn firmware(encoding: &'static str) -> Firmware {
    Firmware { encoding, strings: STRINGS.to_vec() }
}

/// Keeps panics that the decoder of defmt catches off stderr, and out of the fuzzer, which would take them for findings.
fn silence() {
    static SILENCED: Once = Once::new();
    SILENCED.call_once(silence_the_decoder);
}

/// A log: each of its bytes is decoded or reported, and the lines do not depend on the pieces in which it arrives.
pub(super) fn log(bytes: &[u8]) {
    silence();
    let Some((choice, bytes)) = bytes.split_first() else { return };
    let encoding = if choice % 2 == 0 { "rzcobs" } else { "raw" };
    let image = firmware(encoding).elf();
    let items = |piece: usize| {
        let mut decoder = Decoder::new(Formats::parse(&image).expect("the image is valid"));
        let mut items: Vec<Item> = bytes.chunks(piece).flat_map(|piece| decoder.feed(piece)).collect();
        items.extend(decoder.finish());
        items
    };
    let whole = items(bytes.len().max(1));
    let parts = items(usize::from(choice / 2) + 1);
    assert_eq!(format!("{parts:?}"), format!("{whole:?}"), "the lines depend on the pieces");
    let mut end = 0;
    for item in &whole {
        if let Item::Damaged { offset, bytes } | Item::CutOff { offset, bytes } = item {
            assert!(*offset >= end, "byte {offset} is reported after byte {end}");
            end = offset + bytes;
        }
        assert!(!table_row(item).is_empty());
    }
    assert!(end <= bytes.len() as u64, "{end} of {} bytes are reported", bytes.len());
    let mut summary = Summary::default();
    whole.iter().for_each(|item| summary.add(item));
    assert!(!summary_text(&summary).is_empty());
}

/// An image: it is refused in one line, or decodes a log without a panic and without much memory.
pub(super) fn elf(bytes: &[u8]) {
    silence();
    let formats = match Formats::parse(bytes) {
        Ok(formats) => formats,
        Err(error) => return check_error(&error, ""),
    };
    let mut decoder = Decoder::new(formats);
    let log: Vec<u8> = [
        firmware("rzcobs").frame(STRINGS[1].1, 2000, &[Value::Str("disarmed"), Value::Str("armed")]),
        firmware("raw").frame(STRINGS[3].1, u64::MAX, &[Value::U8(3), Value::U32(7)]),
        [1, 0].repeat(200),
    ]
    .concat();
    let mut items = decoder.feed(&log);
    items.extend(decoder.finish());
    assert!(items.len() <= log.len() + 1, "{} items of {} bytes", items.len(), log.len());
}
