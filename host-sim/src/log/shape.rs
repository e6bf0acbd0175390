//! Length of a frame, found without allocating: a damaged frame may claim billions of elements.

use std::collections::BTreeMap;

use defmt_parser::{DisplayHint, Fragment, Parameter, ParserMode, TimePrecision, Type, get_max_bitfield_range};

use simulation::bad_input::{BadInput, excerpt};

/// Deepest nesting accepted.
const DEEPEST: usize = 32;
/// Largest number of elements of all slices in a frame.
const MOST_ELEMENTS: u32 = 1 << 16;

/// Largest number in a format string: no frame has more arguments or bytes.
const MOST_NUMBER: usize = 1 << 16;
/// Number of digits of any number up to [`MOST_NUMBER`], with leading zeros.
const MOST_DIGITS: usize = 12;
/// Largest number of digits to which a number is padded: twice those of the longest.
const MOST_WIDTH: usize = 256;
/// Largest number of bytes of all format strings that a frame uses, each counted as often as it is used.
const MOST_TEXT: usize = 1 << 20;
/// Largest number of bytes shown as CBOR: each may be one level of nesting.
const MOST_CBOR: usize = 1 << 10;
/// First second after the year 9999, since 1970; a date beyond has no form in ISO 8601.
const END_OF_DATES_S: u64 = 253_402_300_800;

/// Why no frame was found.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Stop {
    /// The frame is incomplete.
    More,
    /// The bytes are not a valid frame.
    Damaged,
}

/// An argument of a format string: its type, and how it is shown.
struct Argument {
    ty: Type,
    hint: Option<DisplayHint>,
}

/// The arguments of a format string, in the order of their bytes.
pub(super) struct Shape {
    arguments: Vec<Argument>,
    /// Length of the format string, in bytes.
    text: usize,
}

impl Shape {
    /// Parses a format string; `None` if it is invalid.
    ///
    /// # Errors
    /// [`BadInput`] if a number in it is beyond any that a frame could need: as an index or a width it would be the size
    /// of an allocation.
    pub(super) fn of(format: &str) -> Result<Option<Self>, BadInput> {
        let text = format.replace("{{", "");
        let parameters = text.split('{').skip(1).filter_map(|parameter| parameter.split('}').next());
        let numbers = parameters.flat_map(|parameter| parameter.split(|letter: char| !letter.is_ascii_digit()));
        let is_large =
            |digits: &&str| digits.len() > MOST_DIGITS || digits.parse::<usize>().is_ok_and(|n| n > MOST_NUMBER);
        if let Some(digits) = numbers.into_iter().find(is_large) {
            let number = excerpt(digits);
            return Err(BadInput(format!("a format string has the number {number}; expected at most {MOST_NUMBER}")));
        }
        let Ok(fragments) = defmt_parser::parse(format, ParserMode::ForwardsCompatible) else { return Ok(None) };
        let mut arguments: BTreeMap<usize, Vec<Parameter>> = BTreeMap::new();
        for fragment in fragments {
            if let Fragment::Parameter(parameter) = fragment {
                if let Some(width) = width(parameter.hint.as_ref()).filter(|width| *width > MOST_WIDTH) {
                    return Err(BadInput(format!(
                        "a format string has the width {width}; expected at most {MOST_WIDTH}"
                    )));
                }
                arguments.entry(parameter.index).or_default().push(parameter);
            }
        }
        let arguments = arguments.into_values().map(|uses| {
            // Several bit fields of one argument are sent as the bytes that contain all of them.
            let fields: Vec<&Parameter> = uses.iter().filter(|p| matches!(p.ty, Type::BitField(_))).collect();
            let ty = match get_max_bitfield_range(fields.into_iter()) {
                Some((start, end)) => Type::BitField(start..end),
                None => uses[0].ty.clone(),
            };
            // The use with the tightest bound counts.
            let is_bound = |hint: &&DisplayHint| matches!(hint, DisplayHint::ISO8601(_) | DisplayHint::Cbor);
            let hints = || uses.iter().filter_map(|parameter| parameter.hint.as_ref());
            Argument { ty, hint: hints().find(is_bound).or_else(|| hints().next()).cloned() }
        });
        Ok(Some(Self { arguments: arguments.collect(), text: format.len() }))
    }
}

/// Number of digits to which a number is padded.
fn width(hint: Option<&DisplayHint>) -> Option<usize> {
    match hint? {
        DisplayHint::NoHint { zero_pad }
        | DisplayHint::Binary { zero_pad, .. }
        | DisplayHint::Octal { zero_pad, .. }
        | DisplayHint::Hexadecimal { zero_pad, .. } => Some(*zero_pad),
        _ => None,
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
    pub(super) fn new(tag: &str, text: String) -> Result<Self, BadInput> {
        let levelled =
            ["trace", "debug", "info", "warn", "error"].iter().any(|l| tag.strip_prefix("defmt_") == Some(l));
        let is_enum = text.contains('|');
        Ok(Self {
            is_line: levelled || tag == "defmt_println",
            is_argument: !levelled,
            whole: Shape::of(&text)?,
            variants: if is_enum { text.split('|').map(Shape::of).collect::<Result<_, _>>()? } else { Vec::new() },
        })
    }
}

/// Position within the bytes of a frame, and the limits that remain.
pub(super) struct Walk<'a> {
    formatted: &'a BTreeMap<u16, Formatted>,
    bytes: &'a [u8],
    depth: usize,
    elements: u32,
    /// Bytes of the format strings used so far.
    text: usize,
    /// How the argument around this one is shown, which holds for it too unless it has its own hint.
    hint: Option<&'a DisplayHint>,
}

impl<'a> Walk<'a> {
    pub(super) fn new(formatted: &'a BTreeMap<u16, Formatted>, bytes: &'a [u8]) -> Self {
        Self { formatted, bytes, depth: 0, elements: 0, text: 0, hint: None }
    }

    pub(super) fn index(&mut self) -> Result<u16, Stop> {
        Ok(self.number(2)? as u16)
    }

    pub(super) fn shape(&mut self, shape: &'a Shape) -> Result<(), Stop> {
        self.depth += 1;
        self.text += shape.text;
        if self.depth > DEEPEST || self.text > MOST_TEXT {
            return Err(Stop::Damaged);
        }
        let outer = self.hint;
        for argument in &shape.arguments {
            self.hint = argument.hint.as_ref().or(outer);
            self.argument(&argument.ty)?;
        }
        self.hint = outer;
        self.depth -= 1;
        Ok(())
    }

    /// Checks that the bytes of an argument can be shown as its hint says.
    fn check_shown(&self, ty: &Type) -> Result<(), Stop> {
        let shown = match (self.hint, ty) {
            (Some(DisplayHint::ISO8601(precision)), Type::U64 | Type::U128) => {
                let (bytes, _) = self.bytes.split_first_chunk().ok_or(Stop::More)?;
                let per_s = match precision {
                    TimePrecision::Seconds => 1,
                    TimePrecision::Millis => 1000,
                    TimePrecision::Micros => 1_000_000,
                };
                u64::from_le_bytes(*bytes) / per_s < END_OF_DATES_S
            }
            (Some(DisplayHint::Cbor), Type::U8Array(length)) => *length <= MOST_CBOR,
            (Some(DisplayHint::Cbor), Type::U8Slice) => {
                let (bytes, _) = self.bytes.split_first_chunk().ok_or(Stop::More)?;
                u32::from_le_bytes(*bytes) as usize <= MOST_CBOR
            }
            _ => true,
        };
        if shown { Ok(()) } else { Err(Stop::Damaged) }
    }

    fn argument(&mut self, ty: &Type) -> Result<(), Stop> {
        self.check_shown(ty)?;
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
