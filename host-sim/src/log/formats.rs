//! The format strings of a firmware image, which define the meaning of its frames.

use std::cell::Cell;
use std::collections::BTreeMap;
use std::panic::{AssertUnwindSafe, catch_unwind, set_hook, take_hook};

use anyhow::Result;
use defmt_decoder::{DecodeError, Table};
use object::{Object, ObjectSection, ObjectSymbol};
use serde::{Deserialize, Serialize};

use crate::log::line::Line;
use crate::log::shape::{Formatted, Shape, Stop, Walk};
use simulation::bad_input;
use simulation::bad_input::{BadInput, excerpt, one_line};

/// Encoding of the frames, as recorded in the image.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize)]
#[serde(rename_all = "lowercase")]
pub enum Encoding {
    /// Frames follow each other without a mark; nothing can be decoded after a damaged one.
    Raw,
    /// Frames end with a zero byte that occurs nowhere else; decoding continues after a damaged one.
    Rzcobs,
}

/// The tables for decoding the log of one firmware image.
pub struct Formats {
    table: Table,
    encoding: Encoding,
    timestamp: Option<Shape>,
    formatted: BTreeMap<u16, Formatted>,
}

thread_local! {
    static DECODING: Cell<bool> = const { Cell::new(false) };
}

/// Keeps the panics of defmt's decoder, which are caught and reported as damage, off stderr.
pub fn silence_the_decoder() {
    let report = take_hook();
    set_hook(Box::new(move |panic| {
        if !DECODING.get() {
            report(panic);
        }
    }));
}

/// The used part of a defmt symbol's name.
#[derive(Deserialize)]
struct Symbol {
    tag: String,
    data: String,
}

impl Formats {
    /// Reads the tables from an ELF file.
    ///
    /// # Errors
    /// [`simulation::bad_input::BadInput`] if it is not an ELF file, or not that of firmware that logs with defmt 0.3
    /// to 1.x.
    pub fn parse(elf: &[u8]) -> Result<Self> {
        let table = match Table::parse(elf) {
            Ok(Some(table)) => table,
            Ok(None) => bad_input!("has no .defmt section; expected the ELF file of the firmware that wrote the log"),
            Err(error) => {
                let why = error.to_string().lines().collect::<Vec<_>>().join(", ");
                bad_input!("{}; expected the ELF file of the firmware that wrote the log", one_line(&why))
            }
        };
        let encoding = match table.encoding() {
            defmt_decoder::Encoding::Raw => Encoding::Raw,
            defmt_decoder::Encoding::Rzcobs => Encoding::Rzcobs,
            other => bad_input!("packs its log as {other:?}; expected raw or rzcobs"),
        };
        let mut formats = Self { table, encoding, timestamp: None, formatted: BTreeMap::new() };
        formats.collect(elf)?;
        Ok(formats)
    }

    /// Encoding of the frames.
    pub fn encoding(&self) -> Encoding {
        self.encoding
    }

    /// Reads the format strings again, since defmt's table does not expose them.
    fn collect(&mut self, elf: &[u8]) -> Result<()> {
        let elf = object::File::parse(elf)?;
        let is_defmt = |name: &str| name == ".defmt" || name.starts_with(".defmt.");
        let sections: Vec<_> =
            elf.sections().filter(|s| s.name().is_ok_and(is_defmt)).map(|section| section.index()).collect();
        let bounded = |name: &str, error: BadInput| {
            BadInput(format!("symbol `{}`: {error}, as in the ELF file of a firmware", one_line(&excerpt(name))))
        };
        for symbol in elf.symbols() {
            let (Ok(name), Some(section)) = (symbol.name(), symbol.section_index()) else { continue };
            if !sections.contains(&section) {
                continue;
            }
            // Symbols of the linker script are not format strings.
            let Ok(Symbol { tag, data }) = serde_json::from_str(name) else { continue };
            match (tag.as_str(), u16::try_from(symbol.address())) {
                ("defmt_timestamp", _) => self.timestamp = Shape::of(&data).map_err(|error| bounded(name, error))?,
                ("defmt_bitflags_value", _) | (_, Err(_)) => {}
                (tag, Ok(index)) => {
                    let formatted = Formatted::new(tag, data).map_err(|error| bounded(name, error))?;
                    self.formatted.insert(index, formatted);
                }
            }
        }
        Ok(())
    }

    /// Decodes the frame at the start of `bytes`; returns its line and length in bytes.
    pub(super) fn decode(&self, bytes: &[u8]) -> Result<(Line, usize), Stop> {
        // The decoder allocates and recurses as the frame says, so the frame is checked first: it may be damaged.
        self.walk(bytes)?;
        DECODING.set(true);
        let decoded = catch_unwind(AssertUnwindSafe(|| {
            let (frame, length) = self.table.decode(bytes)?;
            Ok((Line::new(&frame), length))
        }));
        DECODING.set(false);
        match decoded {
            Ok(Ok(decoded)) => Ok(decoded),
            Ok(Err(DecodeError::UnexpectedEof)) => Err(Stop::More),
            // A panic: a value that the decoder cannot format.
            Ok(Err(DecodeError::Malformed)) | Err(_) => Err(Stop::Damaged),
        }
    }

    fn walk(&self, bytes: &[u8]) -> Result<(), Stop> {
        let mut walk = Walk::new(&self.formatted, bytes);
        let index = walk.index()?;
        if let Some(timestamp) = &self.timestamp {
            walk.shape(timestamp)?;
        }
        let line = self.formatted.get(&index).filter(|formatted| formatted.is_line).ok_or(Stop::Damaged)?;
        walk.shape(line.whole.as_ref().ok_or(Stop::Damaged)?)
    }
}
