//! Length of a frame, found without allocating: a damaged frame may claim billions of elements.

use std::collections::BTreeMap;

use defmt_parser::{Fragment, Parameter, ParserMode, Type, get_max_bitfield_range};

/// Deepest nesting accepted.
const DEEPEST: usize = 32;
/// Largest number of elements of all slices in a frame.
const MOST_ELEMENTS: u32 = 1 << 16;

/// Why no frame was found.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Stop {
    /// The frame is incomplete.
    More,
    /// The bytes are not a valid frame.
    Damaged,
}

/// Types of the arguments of a format string, in the order of their bytes.
pub(super) struct Shape(Vec<Type>);

impl Shape {
    /// Parses a format string; `None` if it is invalid.
    pub(super) fn of(format: &str) -> Option<Self> {
        let fragments = defmt_parser::parse(format, ParserMode::ForwardsCompatible).ok()?;
        let mut arguments: BTreeMap<usize, Vec<Parameter>> = BTreeMap::new();
        for fragment in fragments {
            if let Fragment::Parameter(parameter) = fragment {
                arguments.entry(parameter.index).or_default().push(parameter);
            }
        }
        let types = arguments.into_values().map(|uses| {
            // Several bit fields of one argument are sent as the bytes that contain all of them.
            let fields: Vec<&Parameter> = uses.iter().filter(|p| matches!(p.ty, Type::BitField(_))).collect();
            match get_max_bitfield_range(fields.into_iter()) {
                Some((start, end)) => Type::BitField(start..end),
                None => uses[0].ty.clone(),
            }
        });
        Some(Self(types.collect()))
    }
}

/// An entry of the table: a line, or a formatted argument within a line.
pub(super) struct Formatted {
    /// True if a frame may start with it.
    pub(super) is_line: bool,
    /// True if it may be an argument; lines with a level may not.
    is_argument: bool,
    pub(super) whole: Option<Shape>,
    /// The variants of an enum, selected by a leading number; empty if it is no enum.
    variants: Vec<Option<Shape>>,
}

impl Formatted {
    pub(super) fn new(tag: &str, text: String) -> Self {
        let levelled =
            ["trace", "debug", "info", "warn", "error"].iter().any(|l| tag.strip_prefix("defmt_") == Some(l));
        let is_enum = text.contains('|');
        Self {
            is_line: levelled || tag == "defmt_println",
            is_argument: !levelled,
            whole: Shape::of(&text),
            variants: if is_enum { text.split('|').map(Shape::of).collect() } else { Vec::new() },
        }
    }
}

/// Position within the bytes of a frame, and the limits that remain.
pub(super) struct Walk<'a> {
    formatted: &'a BTreeMap<u16, Formatted>,
    bytes: &'a [u8],
    depth: usize,
    elements: u32,
}

impl<'a> Walk<'a> {
    pub(super) fn new(formatted: &'a BTreeMap<u16, Formatted>, bytes: &'a [u8]) -> Self {
        Self { formatted, bytes, depth: 0, elements: 0 }
    }

    pub(super) fn index(&mut self) -> Result<u16, Stop> {
        Ok(self.number(2)? as u16)
    }

    pub(super) fn shape(&mut self, shape: &Shape) -> Result<(), Stop> {
        self.depth += 1;
        if self.depth > DEEPEST {
            return Err(Stop::Damaged);
        }
        for ty in &shape.0 {
            self.argument(ty)?;
        }
        self.depth -= 1;
        Ok(())
    }

    fn argument(&mut self, ty: &Type) -> Result<(), Stop> {
        match ty {
            Type::Bool | Type::U8 | Type::I8 => self.skip(1),
            Type::U16 | Type::I16 | Type::IStr => self.skip(2),
            Type::U32 | Type::I32 | Type::Usize | Type::Isize | Type::F32 | Type::Char => self.skip(4),
            Type::U64 | Type::I64 | Type::F64 => self.skip(8),
            Type::U128 | Type::I128 => self.skip(16),
            Type::BitField(range) => {
                let bytes = usize::from((range.end - 1) / 8 - range.start / 8 + 1);
                self.skip(bytes.next_power_of_two())
            }
            Type::Str | Type::U8Slice => {
                let length = self.number(4)?;
                self.skip(length as usize)
            }
            Type::U8Array(length) => self.skip(*length),
            Type::Debug | Type::Display => {
                let end = self.bytes.iter().position(|&byte| byte == 0xff).ok_or(Stop::More)?;
                self.skip(end + 1)
            }
            Type::Format => {
                let formatted = self.formatted()?;
                let shape = self.variant(formatted)?;
                self.shape(shape)
            }
            Type::FormatSlice => {
                let length = self.number(4)?;
                self.slice(length)
            }
            Type::FormatArray(length) => self.slice(u32::try_from(*length).map_err(|_| Stop::Damaged)?),
            Type::FormatSequence => self.sequence(),
        }
    }

    fn slice(&mut self, length: u32) -> Result<(), Stop> {
        // Elements may have no bytes, so the frame's length does not limit their number.
        self.elements = self.elements.saturating_add(length);
        if self.elements > MOST_ELEMENTS {
            return Err(Stop::Damaged);
        }
        let formatted = self.formatted()?;
        for _ in 0..length {
            let shape = self.variant(formatted)?;
            self.shape(shape)?;
        }
        Ok(())
    }

    fn sequence(&mut self) -> Result<(), Stop> {
        loop {
            let index = self.index()?;
            if index == 0 {
                return Ok(());
            }
            let shape = self.argument_at(index)?.whole.as_ref().ok_or(Stop::Damaged)?;
            self.shape(shape)?;
        }
    }

    fn formatted(&mut self) -> Result<&'a Formatted, Stop> {
        let index = self.index()?;
        self.argument_at(index)
    }

    fn argument_at(&self, index: u16) -> Result<&'a Formatted, Stop> {
        self.formatted.get(&index).filter(|formatted| formatted.is_argument).ok_or(Stop::Damaged)
    }

    fn variant(&mut self, formatted: &'a Formatted) -> Result<&'a Shape, Stop> {
        let shape = match formatted.variants.len() {
            0 => &formatted.whole,
            variants => {
                // The number is as wide as the last variant needs.
                let width = match variants - 1 {
                    0..=0xff => 1,
                    0x100..=0xffff => 2,
                    _ => 4,
                };
                let number = self.number(width)?;
                formatted.variants.get(number as usize).ok_or(Stop::Damaged)?
            }
        };
        shape.as_ref().ok_or(Stop::Damaged)
    }

    /// Reads a little-endian number of `width` bytes.
    fn number(&mut self, width: usize) -> Result<u32, Stop> {
        let (bytes, rest) = self.bytes.split_at_checked(width).ok_or(Stop::More)?;
        self.bytes = rest;
        Ok(bytes.iter().rev().fold(0, |number, &byte| number << 8 | u32::from(byte)))
    }

    fn skip(&mut self, length: usize) -> Result<(), Stop> {
        self.bytes = self.bytes.get(length..).ok_or(Stop::More)?;
        Ok(())
    }
}
