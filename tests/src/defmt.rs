//! A synthetic firmware that only logs: its ELF file and its log frames, as the linker and defmt would write them.

use object::write::{Object, Symbol, SymbolSection};
use object::{Architecture, BinaryFormat, Endianness, SectionKind, SymbolFlags, SymbolKind, SymbolScope};
use serde_json::json;

/// The format strings of a firmware; their addresses start at 1.
pub struct Firmware {
    /// Encoding of the frames, `raw` or `rzcobs`.
    pub encoding: &'static str,
    /// Tag, such as `info`, and text of each format string.
    pub strings: Vec<(&'static str, &'static str)>,
}

/// An argument of a log line.
#[derive(Clone, Copy, Debug)]
#[expect(missing_docs, reason = "the variants are named as their types")]
pub enum Value<'a> {
    U8(u8),
    U16(u16),
    U32(u32),
    I32(i32),
    U64(u64),
    Str(&'a str),
}

impl Firmware {
    /// ELF file with the format strings and without code; times are in microseconds.
    pub fn elf(&self) -> Vec<u8> {
        self.elf_stamped("{=u64:us}")
    }

    /// ELF file with the format strings and without code; `timestamp` is the format string of the times.
    pub fn elf_stamped(&self, timestamp: &str) -> Vec<u8> {
        let mut elf = Object::new(BinaryFormat::Elf, Architecture::Arm, Endianness::Little);
        let section = elf.add_section(Vec::new(), b".defmt".to_vec(), SectionKind::Metadata);
        elf.append_section_data(section, &vec![0; self.strings.len() + 1], 1);
        let mut add = |name: String, value: usize, section: SymbolSection| {
            elf.add_symbol(Symbol {
                name: name.into_bytes(),
                value: value as u64,
                size: 1,
                kind: SymbolKind::Data,
                scope: SymbolScope::Linkage,
                weak: false,
                section,
                flags: SymbolFlags::None,
            });
        };
        add("_defmt_version_ = 4".to_owned(), 0, SymbolSection::Absolute);
        add(format!("_defmt_encoding_ = {}", self.encoding), 0, SymbolSection::Absolute);
        let strings = self.strings.iter().copied().chain([("timestamp", timestamp)]);
        for (number, (tag, text)) in strings.enumerate() {
            let symbol = json!({"package": "firmware", "disambiguator": number.to_string(), "tag": format!("defmt_{tag}"),
                "data": text, "crate_name": "firmware"});
            add(symbol.to_string(), number + 1, SymbolSection::Section(section));
        }
        elf.write().expect("the ELF file is small")
    }

    /// Frame of a log line, as the MCU sends it.
    pub fn frame(&self, text: &str, time_us: u64, values: &[Value<'_>]) -> Vec<u8> {
        let mut frame = self.place(text).to_le_bytes().to_vec();
        frame.extend(time_us.to_le_bytes());
        for value in values {
            match *value {
                Value::U8(value) => frame.push(value),
                Value::U16(value) => frame.extend(value.to_le_bytes()),
                Value::U32(value) => frame.extend(value.to_le_bytes()),
                Value::I32(value) => frame.extend(value.to_le_bytes()),
                Value::U64(value) => frame.extend(value.to_le_bytes()),
                Value::Str(text) => {
                    frame.extend((text.len() as u32).to_le_bytes());
                    frame.extend(text.as_bytes());
                }
            }
        }
        if self.encoding == "rzcobs" {
            frame = rzcobs::encode(&frame);
            frame.push(0);
        }
        frame
    }

    /// Address of a format string.
    pub fn place(&self, text: &str) -> u16 {
        let index = self.strings.iter().position(|(_, string)| *string == text);
        index.unwrap_or_else(|| panic!("no string `{text}`")) as u16 + 1
    }
}
