//! The durations among the columns of a Parquet file. Parquet has no such type: they are whole numbers, and only the Arrow schema that
//! pandas, polars and others put into the file's metadata says what they count.
//!
//! That schema is a FlatBuffer in base64, of which the names and types of the columns are read. What cannot be read has no durations.

use std::collections::HashMap;

/// Durations per second of each column of durations, by name; `schema` is the text under the key `ARROW:schema` of a file with a number of
/// `columns`, more of which are not read.
pub(super) fn durations(schema: &str, columns: usize) -> HashMap<String, i64> {
    let bytes = base64(schema);
    // The continuation mark and the length of the message are in front of it.
    let message = bytes.as_deref().and_then(|bytes| Buffer(bytes.get(8..)?).root());
    let fields = message.and_then(|message| message.table(2)?.tables(1)).unwrap_or_default();
    fields.into_iter().take(columns).filter_map(|field| Some((field.text(0)?, per_second(field)?))).collect()
}

/// The `n` of a field whose values are nths of a second; `None` for a field of another type.
fn per_second(field: Table<'_>) -> Option<i64> {
    const DURATION: u8 = 18;
    if field.byte(2)? != DURATION {
        return None;
    }
    // The default of a FlatBuffer, milliseconds, is not written.
    let unit = field.table(3)?.byte(0).unwrap_or(1);
    [1, 1_000, 1_000_000, 1_000_000_000].get(usize::from(unit)).copied()
}

/// The bytes of a text in base64.
fn base64(text: &str) -> Option<Vec<u8>> {
    const DIGITS: &[u8] = b"ABCDEFGHIJKLMNOPQRSTUVWXYZabcdefghijklmnopqrstuvwxyz0123456789+/";
    let digits = text.trim_end_matches('=').bytes().map(|byte| DIGITS.iter().position(|digit| *digit == byte));
    let digits: Vec<usize> = digits.collect::<Option<_>>()?;
    let bytes = digits.chunks(4).flat_map(|group| {
        let bits = group.iter().enumerate().fold(0, |bits, (place, digit)| bits | digit << (18 - 6 * place));
        bits.to_be_bytes()[size_of::<usize>() - 3..][..group.len().saturating_sub(1)].to_vec()
    });
    Some(bytes.collect())
}

/// A FlatBuffer.
#[derive(Clone, Copy)]
struct Buffer<'a>(&'a [u8]);

/// A table of a FlatBuffer, and where it begins.
#[derive(Clone, Copy)]
struct Table<'a> {
    buffer: Buffer<'a>,
    start: usize,
}

impl<'a> Buffer<'a> {
    fn root(self) -> Option<Table<'a>> {
        Some(Table { buffer: self, start: self.behind(0)? })
    }

    fn bytes<const N: usize>(self, at: usize) -> Option<[u8; N]> {
        self.0.get(at..at.checked_add(N)?)?.try_into().ok()
    }

    fn whole(self, at: usize) -> Option<usize> {
        usize::try_from(u32::from_le_bytes(self.bytes(at)?)).ok()
    }

    /// The place that the offset at a place refers to.
    fn behind(self, at: usize) -> Option<usize> {
        at.checked_add(self.whole(at)?)
    }
}

impl<'a> Table<'a> {
    /// Place of a field; `None` for one that is not written.
    fn field(self, index: usize) -> Option<usize> {
        let offset = i64::from(i32::from_le_bytes(self.buffer.bytes(self.start)?));
        let names = usize::try_from(i64::try_from(self.start).ok()? - offset).ok()?;
        let short = |at: usize| self.buffer.bytes(at).map(u16::from_le_bytes).map(usize::from);
        let entry = 4 + 2 * index;
        let offset = if entry < short(names)? { short(names.checked_add(entry)?)? } else { 0 };
        (offset > 0).then(|| self.start.checked_add(offset)).flatten()
    }

    fn byte(self, index: usize) -> Option<u8> {
        Some(self.buffer.bytes::<1>(self.field(index)?)?[0])
    }

    fn table(self, index: usize) -> Option<Self> {
        Some(Self { start: self.buffer.behind(self.field(index)?)?, ..self })
    }

    fn tables(self, index: usize) -> Option<Vec<Self>> {
        let vector = self.buffer.behind(self.field(index)?)?;
        // No more than the buffer has room for.
        let count = self.buffer.whole(vector)?.min(self.buffer.0.len() / 4);
        let table = |place: usize| Some(Self { start: self.buffer.behind(vector + 4 + 4 * place)?, ..self });
        (0..count).map(table).collect()
    }

    fn text(self, index: usize) -> Option<String> {
        let text = self.buffer.behind(self.field(index)?)?;
        let start = text.checked_add(4)?;
        let bytes = self.buffer.0.get(start..start.checked_add(self.buffer.whole(text)?)?)?;
        String::from_utf8(bytes.to_vec()).ok()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// What pyarrow 21 writes for the columns `time` (duration in ns), `u` (double), `t2` (in ms), `t3` (in s), `x` (whole).
    const SCHEMA: &str = "/////zABAAAQAAAAAAAKAAwABgAFAAgACgAAAAABBAAMAAAACAAIAAAABAAIAAAABAAAAAUAAADQAAAAlAAAAGgAAAA8AAAABAAAAFT///8A\
AAECEAAAABwAAAAEAAAAAAAAAAEAAAB4AAAACAAMAAgABwAIAAAAAAAAAUAAAACI////AAABEhAAAAAUAAAABAAAAAAAAAACAAAAdDMAAHb///8AAAAAsP///wAAARIQAAAAGAAA\
AAQAAAAAAAAAAgAAAHQyAAAEAAQABAAAANj///8AAAEDEAAAABQAAAAEAAAAAAAAAAEAAAB1AAAAxv///wAAAgAQABQACAAGAAcADAAAABAAEAAAAAAAARIQAAAAHAAAAAQAAAAA\
AAAABAAAAHRpbWUAAAYACAAGAAYAAAAAAAMA";

    #[test]
    fn the_durations_of_a_schema_are_found() {
        assert_eq!(durations(SCHEMA, 1), [("time".to_owned(), 1_000_000_000)].into());
        let expected = [("time", 1_000_000_000), ("t2", 1_000), ("t3", 1)];
        assert_eq!(durations(SCHEMA, 5), expected.map(|(name, parts)| (name.to_owned(), parts)).into());
    }

    #[test]
    fn a_damaged_schema_is_no_error() {
        for end in 0..SCHEMA.len() {
            durations(&SCHEMA[..end], 5);
            let damaged = format!("{}/{}", &SCHEMA[..end], &SCHEMA[end + 1..]);
            durations(&damaged, 5);
        }
        assert!(durations("\u{b5}", 5).is_empty());
    }
}
