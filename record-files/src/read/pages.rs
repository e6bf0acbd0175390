//! The sizes that the pages of a Parquet file's column claim, checked before any is decompressed: a damaged header of a few bytes
//! may claim 2 GiB.
//!
//! A page's header is a structure of Thrift's compact protocol; its fields 2 and 3 are the sizes with and without compression.

use simulation::csv_table::text::MOST_BYTES;

/// Deepest structure inside structures of a header; statistics are in the third.
const MOST_DEEP: usize = 8;

/// Checks the pages of a column, which lie one after the other in `bytes`.
///
/// # Errors
/// A text if a header is damaged, or if the pages are larger than the largest file.
pub(super) fn check(bytes: &[u8]) -> Result<(), String> {
    let mut headers = Headers { rest: bytes };
    let mut sum = 0;
    while !headers.rest.is_empty() {
        let (size, compressed) = headers.sizes().ok_or("a damaged page; expected a Parquet file")?;
        sum += size;
        if sum > MOST_BYTES {
            return Err(format!("more than {} MiB; expected at most that", MOST_BYTES >> 20));
        }
        headers.take(compressed).ok_or("a page that is cut off; expected a Parquet file")?;
    }
    Ok(())
}

struct Headers<'a> {
    rest: &'a [u8],
}

impl<'a> Headers<'a> {
    /// Reads a header; returns the size of its page in memory and in the file.
    fn sizes(&mut self) -> Option<(usize, usize)> {
        let (mut sizes, mut id) = ([None, None], 0);
        while let Some((kind, next)) = self.field(id)? {
            id = next;
            match (id, kind) {
                (2 | 3, 5) => sizes[usize::from(id == 3)] = usize::try_from(self.integer()?).ok(),
                _ => self.skip(kind, 0)?,
            }
        }
        Some((sizes[0]?, sizes[1]?))
    }

    fn take(&mut self, count: usize) -> Option<&'a [u8]> {
        let (taken, rest) = self.rest.split_at_checked(count)?;
        self.rest = rest;
        Some(taken)
    }

    fn byte(&mut self) -> Option<u8> {
        self.take(1)?.first().copied()
    }

    fn varint(&mut self) -> Option<u64> {
        let mut value = 0;
        for shift in (0..64).step_by(7) {
            let byte = self.byte()?;
            value |= u64::from(byte & 0x7f) << shift;
            if byte < 0x80 {
                return Some(value);
            }
        }
        None
    }

    /// A signed number: its lowest bit is the sign.
    fn integer(&mut self) -> Option<i64> {
        let value = self.varint()?;
        Some((value >> 1) as i64 ^ -((value & 1) as i64))
    }

    /// The type and number of the field that follows field `last`; `Some(None)` at the end of the structure.
    fn field(&mut self, last: i64) -> Option<Option<(u8, i64)>> {
        let byte = self.byte()?;
        let (step, kind) = (byte >> 4, byte & 15);
        if kind == 0 {
            return Some(None);
        }
        let id = if step == 0 { self.integer()? } else { last.checked_add(step.into())? };
        Some(Some((kind, id)))
    }

    fn skip(&mut self, kind: u8, deep: usize) -> Option<()> {
        if deep > MOST_DEEP {
            return None;
        }
        match kind {
            1 | 2 => (),
            3 => drop(self.byte()?),
            4..=6 => drop(self.varint()?),
            7 => drop(self.take(8)?),
            8 => {
                let length = self.varint()?;
                self.take(usize::try_from(length).ok()?)?;
            }
            12 => {
                let mut id = 0;
                while let Some((kind, next)) = self.field(id)? {
                    id = next;
                    self.skip(kind, deep + 1)?;
                }
            }
            // Lists and maps, which no header has.
            _ => return None,
        }
        Some(())
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A header of a data page of three bytes: type 0, the sizes, and a structure with a text in it.
    fn page(size: &[u8]) -> Vec<u8> {
        [&[0x15, 0, 0x15][..], size, &[0x15, 6, 0x2c, 0x15, 6, 0x18, 2, b'a', b'b', 0, 0], b"xyz"].concat()
    }

    #[test]
    fn sizes_are_added_up_and_bounded() {
        assert_eq!(check(&[page(&[20]), page(&[0x80, 1])].concat()), Ok(()));
        // 300 MiB each.
        let large = page(&[0x80, 0x80, 0x80, 0xac, 2]);
        assert_eq!(check(&large), Ok(()));
        assert!(check(&[large.clone(), large].concat()).unwrap_err().contains("more than 512 MiB"));
        assert!(check(&page(&[1])).unwrap_err().contains("damaged"), "a negative size");
    }

    #[test]
    fn every_cut_is_an_error() {
        let whole = page(&[20]);
        for length in 1..whole.len() {
            assert!(check(&whole[..length]).is_err(), "{length}");
        }
    }
}
