//! The dialect of a table: the character between its columns, the decimal mark, and the lines above its header.

use std::cell::{Cell, RefCell};
use std::collections::BTreeMap;
use std::str::FromStr;

use anyhow::Result;

use crate::bad_input;
use crate::bad_input::BadInput;

/// How a table is written, as far as its user says; the rest is found in the table.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Dialect {
    /// Separator of the columns.
    pub separator: Option<Separator>,
    /// Decimal mark.
    pub decimal: Option<Decimal>,
}

/// The ASCII character that separates the columns of a table.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Separator(pub(super) u8);

impl Separator {
    /// One or more blanks.
    pub(super) const BLANKS: Self = Self(b' ');
    /// The comma.
    pub const COMMA: Self = Self(b',');
    /// The separators that are recognised, the rarest inside a name first.
    pub(super) const USUAL: [Self; 5] = [Self(b'\t'), Self(b'|'), Self(b';'), Self::COMMA, Self::BLANKS];

    /// The separator that a spreadsheet's line `sep=;` names.
    pub(super) fn named_by(line: &str) -> Option<Self> {
        line.trim().strip_prefix("sep=")?.parse().ok()
    }
}

impl FromStr for Separator {
    type Err = BadInput;

    fn from_str(name: &str) -> Result<Self, BadInput> {
        match (name, name.as_bytes()) {
            ("tab" | "\\t", _) => Ok(Self(b'\t')),
            ("blank" | "blanks", _) => Ok(Self::BLANKS),
            (_, [letter]) if !letter.is_ascii_alphanumeric() && !b"\"#.+-\r\n".contains(letter) => Ok(Self(*letter)),
            _ => Err(BadInput(format!(
                "`{name}` is not a separator; expected `,`, `;`, `tab`, `blanks` or another character"
            ))),
        }
    }
}

/// The mark between the whole part and the fraction of a number.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Decimal {
    /// A point.
    Point,
    /// A comma.
    Comma,
}

impl Decimal {
    /// The mark in a cell; `None` for a whole number.
    fn of(text: &str) -> Option<Self> {
        if text.contains(',') { Some(Self::Comma) } else { text.contains('.').then_some(Self::Point) }
    }

    fn name(self) -> &'static str {
        if self == Self::Comma { "comma" } else { "point" }
    }
}

impl FromStr for Decimal {
    type Err = BadInput;

    fn from_str(name: &str) -> Result<Self, BadInput> {
        match name {
            "." | "point" => Ok(Self::Point),
            "," | "comma" => Ok(Self::Comma),
            _ => Err(BadInput(format!("`{name}` is not a decimal mark; expected `.` or `,`"))),
        }
    }
}

/// Reads the numbers of a table. One decimal mark holds for the whole table: `1,234` would else be two different numbers.
pub(super) struct Numbers {
    accepted: Option<Decimal>,
    /// True if the mark is a point because commas separate the columns.
    is_by_separator: bool,
    /// The first mark found, and its line.
    found: Cell<Option<(Decimal, usize)>>,
    /// The columns by index, as long as the mark can separate thousands; `None` once it is a decimal mark.
    columns: RefCell<Option<BTreeMap<usize, Grouped>>>,
}

/// The numbers of a column whose mark can separate thousands.
#[derive(Default)]
struct Grouped {
    /// Place, text and mark of the first number such as `1,200`.
    first: Option<(String, Decimal)>,
    /// True if a whole number has up to three digits, as some have beside separated thousands.
    has_short: bool,
    /// True if a whole number has four digits or more, as none has where thousands are separated.
    has_long: bool,
}

impl Numbers {
    /// Where commas separate the columns, a decimal comma has to be asked for.
    pub(super) fn new(dialect: Dialect, separator: Separator) -> Self {
        let point = (separator == Separator::COMMA).then_some(Decimal::Point);
        let is_by_separator = dialect.decimal.is_none() && point.is_some();
        Self { is_by_separator, ..Self::of(dialect.decimal.or(point)) }
    }

    fn of(accepted: Option<Decimal>) -> Self {
        let columns = RefCell::new(accepted.is_none().then(BTreeMap::new));
        Self { accepted, is_by_separator: false, found: Cell::default(), columns }
    }

    /// True for a number with either decimal mark.
    pub(super) fn any(text: &str) -> bool {
        Self::of(None).value(text).is_some()
    }

    /// The number in a cell, not necessarily finite; `None` if it is no number.
    pub(super) fn value(&self, text: &str) -> Option<f64> {
        match Decimal::of(text) {
            Some(Decimal::Comma) if self.accepted != Some(Decimal::Point) => text.replacen(',', ".", 1).parse().ok(),
            Some(Decimal::Point) if self.accepted == Some(Decimal::Comma) => None,
            _ => text.parse().ok(),
        }
    }

    /// The number in a cell of a column in line `line`, as [`Numbers::value`]; its decimal mark holds for all later ones.
    ///
    /// # Errors
    /// [`BadInput`] for a decimal mark other than that of an earlier line; `place` starts the message.
    pub(super) fn parse(
        &self,
        text: &str,
        column: usize,
        line: usize,
        place: impl Fn() -> String,
    ) -> Result<Option<f64>> {
        let Some(number) = self.value(text) else { return Ok(None) };
        self.watch(text, column, &place);
        let Some(mark) = Decimal::of(text) else { return Ok(Some(number)) };
        match self.found.get() {
            None => self.found.set(Some((mark, line))),
            Some((other, first)) if other != mark => bad_input!(
                "{}: `{text}` has a decimal {}, line {first} a decimal {}; expected one of them (see --decimal)",
                place(),
                mark.name(),
                other.name()
            ),
            Some(_) => (),
        }
        Ok(Some(number))
    }

    /// Notes what a number shows about the mark of the table.
    fn watch(&self, text: &str, column: usize, place: impl Fn() -> String) {
        let mut watched = self.columns.borrow_mut();
        let Some(columns) = watched.as_mut() else { return };
        let digits = text.trim_start_matches(['+', '-']);
        match Decimal::of(digits).zip(digits.split_once([',', '.'])) {
            Some((mark, (whole, part))) => {
                if is_thousand(whole, part) {
                    let first = &mut columns.entry(column).or_default().first;
                    first.get_or_insert_with(|| (format!("{}: `{text}`", place()), mark));
                } else {
                    *watched = None;
                }
            }
            None if are_digits(digits) => {
                let column = columns.entry(column).or_default();
                let seen = if digits.len() > 3 { &mut column.has_long } else { &mut column.has_short };
                *seen = true;
            }
            None => (),
        }
    }

    /// What may be wrong with a cell that is no number, in brackets; empty where nothing is known.
    pub(super) fn hint(&self, text: &str) -> &'static str {
        let digits = text.trim_start_matches(['+', '-']);
        let is_decimal = self.is_by_separator && Self::of(Some(Decimal::Comma)).value(text).is_some();
        match digits.split_once(',').filter(|_| is_decimal) {
            Some((whole, part)) if is_thousand(whole, part) => {
                " (without separators of thousands; a decimal comma needs --decimal ,)"
            }
            Some(_) => " (a decimal comma where commas separate the columns needs --decimal ,)",
            None if has_thousands_separators(text) => " (without separators of thousands)",
            None => "",
        }
    }

    /// Checks, behind the last row, that the marks that were found are decimal marks.
    ///
    /// # Errors
    /// [`BadInput`] for a column of whole numbers and of numbers such as `1,200`, which may be 1.2 or 1200.
    pub(super) fn check(&self) -> Result<()> {
        let columns = self.columns.borrow();
        let doubtful = columns
            .iter()
            .flatten()
            .find_map(|(_, column)| column.first.as_ref().filter(|_| column.has_short && !column.has_long));
        let Some((first, mark)) = doubtful else { return Ok(()) };
        let (name, option) = (mark.name(), if *mark == Decimal::Comma { ',' } else { '.' });
        bad_input!(
            "{first} can have a decimal {name} or a separator of thousands; expected numbers without separators of thousands, \
             or --decimal {option}"
        )
    }
}

/// True for the digits in front of and behind a mark that may separate thousands, as in `1,200`.
fn is_thousand(whole: &str, part: &str) -> bool {
    let are_few = (1..=3).contains(&whole.len()) && !whole.starts_with('0') && part.len() == 3;
    are_few && are_digits(whole) && are_digits(part)
}

fn are_digits(text: &str) -> bool {
    text.bytes().all(|byte| byte.is_ascii_digit())
}

/// True if a text would be a whole number without points, commas, blanks and apostrophes between its digits.
fn has_thousands_separators(text: &str) -> bool {
    const MARKS: [char; 7] = ['.', ',', ' ', '\'', '’', '\u{a0}', '\u{202f}'];
    let digits = text.trim_start_matches(['+', '-']);
    digits.starts_with(|letter: char| letter.is_ascii_digit())
        && digits.ends_with(|letter: char| letter.is_ascii_digit())
        && digits.contains(MARKS)
        && digits.chars().all(|letter| letter.is_ascii_digit() || MARKS.contains(&letter))
}

/// True for a line of nothing but blanks and separators.
pub(super) fn is_blank(line: &str) -> bool {
    line.chars().all(|letter| letter.is_whitespace() || ",;|".contains(letter))
}

/// True for a line without content, and for a comment that starts with `#`, `%` or `//`.
pub(super) fn is_above_header(line: &str) -> bool {
    let content = line.trim();
    is_blank(line) || ["#", "%", "//"].iter().any(|mark| content.starts_with(mark))
}
