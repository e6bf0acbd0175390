//! Decodes the firmware's log, a stream of [defmt](https://defmt.ferrous-systems.com) frames, while it arrives.
//!
//! A [`Decoder`] receives bytes in pieces of any size and returns [`Item`]s: lines, and ranges that are not valid
//! frames. A [`Summary`] accumulates them. Both are independent of the source of the bytes.
//!
//! ```no_run
//! use host_sim::log::{Decoder, Formats, Item, Summary};
//!
//! let mut decoder = Decoder::new(Formats::parse(&std::fs::read("firmware.elf")?)?);
//! let mut summary = Summary::default();
//! let mut items = decoder.feed(&std::fs::read("log.bin")?);
//! items.extend(decoder.finish());
//! for item in &items {
//!     summary.add(item);
//!     if let Item::Line(line) = item {
//!         println!("{}", line.message);
//!     }
//! }
//! # Ok::<(), anyhow::Error>(())
//! ```
//!
//! defmt frames have no checksum: a damaged frame may be decoded as a valid one.

mod decoder;
mod event;
mod formats;
mod frames;
mod line;
mod shape;
mod summary;
mod text;

pub use decoder::{Decoder, Item};
pub use event::{Boot, Done, Event};
pub use formats::{Encoding, Formats, silence_the_decoder};
pub use line::{Level, Line};
pub use summary::{Cause, Fault, LimitLines, Summary};
pub use text::{
    CSV_HEADER, TABLE_HEADER, csv_row, more_damage_csv_row, more_damage_table_row, summary_text, table_row,
};
