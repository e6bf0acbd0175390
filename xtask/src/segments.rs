//! The bytes of an ELF file that are written to the MCU's flash.

use anyhow::{Context, Result, bail, ensure};

/// The flash's content, without holes.
pub struct Flash {
    /// Address of the first byte.
    pub address: u32,
    /// The content from there on.
    pub bytes: Vec<u8>,
}

/// Type of a program header whose segment is loaded.
const PT_LOAD: u32 = 1;
/// Largest image that is accepted, in bytes: twice the flash of the MCU.
const MOST: usize = 1 << 20;

/// Extends each loadable segment of an ELF file by 0xff up to the next one, where the file has room for it: a loader
/// that writes the segments alone then leaves no byte of the flash undefined.
pub(crate) fn fill_gaps(elf: &mut [u8]) -> Result<()> {
    let headers = word(elf, 0x1c)? as usize;
    let (size, count) = (half(elf, 0x2a)?, half(elf, 0x2c)?);
    let mut parts = Vec::new();
    for header in (0..count).map(|index| headers + index * size) {
        let field = |offset| word(elf, header + offset);
        if field(0)? == PT_LOAD && field(16)? > 0 {
            parts.push((field(12)?, field(4)? as usize, field(16)?, header));
        }
    }
    parts.sort_unstable();
    for pair in parts.windows(2) {
        let [(address, offset, length, header), (next, next_offset, ..)] = *pair else { continue };
        let gap = next.saturating_sub(address + length);
        let room = next_offset.saturating_sub(offset + length as usize);
        if gap == 0 {
            continue;
        }
        ensure!(room == gap as usize, "a gap of {gap} bytes between segments, and {room} in the file");
        elf[offset + length as usize..next_offset].fill(0xff);
        for field in [16, 20] {
            elf[header + field..header + field + 4].copy_from_slice(&(length + gap).to_le_bytes());
        }
    }
    Ok(())
}

/// Joins the loadable segments of a 32-bit little-endian ELF file at their load addresses. Gaps are filled with 0xff,
/// which erased flash holds. Other files, overlapping segments and images above 1 MB are errors.
pub fn flash(elf: &[u8]) -> Result<Flash> {
    ensure!(elf.starts_with(b"\x7fELF\x01\x01"), "not a 32-bit little-endian ELF file");
    let headers = word(elf, 0x1c)? as usize;
    let (size, count) = (half(elf, 0x2a)?, half(elf, 0x2c)?);
    let mut parts = Vec::new();
    for header in (0..count).map(|index| headers + index * size) {
        let field = |offset| word(elf, header + offset);
        let (offset, length) = (field(4)? as usize, field(16)? as usize);
        if field(0)? == PT_LOAD && length > 0 {
            let bytes = elf.get(offset..offset + length).context("a segment lies outside of the file")?;
            parts.push((field(12)?, bytes));
        }
    }
    parts.sort_by_key(|(address, _)| *address);
    let address = parts.first().context("no segment to load")?.0;
    let mut bytes = Vec::new();
    for (at, part) in parts {
        let offset = (at - address) as usize;
        if offset < bytes.len() || offset > MOST {
            bail!("segments overlap or lie far apart");
        }
        bytes.resize(offset, 0xff);
        bytes.extend_from_slice(part);
    }
    Ok(Flash { address, bytes })
}

fn half(elf: &[u8], at: usize) -> Result<usize> {
    let bytes = elf.get(at..at + 2).context("the ELF file is cut off")?;
    Ok(usize::from(u16::from_le_bytes(bytes.try_into()?)))
}

fn word(elf: &[u8], at: usize) -> Result<u32> {
    let bytes = elf.get(at..at + 4).context("the ELF file is cut off")?;
    Ok(u32::from_le_bytes(bytes.try_into()?))
}

#[cfg(test)]
pub(crate) mod tests {
    use super::*;

    /// An ELF file with these program headers (type, load address, content).
    pub(crate) fn file(segments: &[(u32, u32, &[u8])]) -> Vec<u8> {
        let mut elf = b"\x7fELF\x01\x01".to_vec();
        elf.resize(0x34, 0);
        elf[0x1c] = 0x34;
        elf[0x2a] = 32;
        elf[0x2c] = segments.len() as u8;
        let mut content = 0x34 + 32 * segments.len() as u32;
        for (kind, address, bytes) in segments {
            let length = bytes.len() as u32;
            for field in [*kind, content, *address, *address, length, length, 0, 0] {
                elf.extend(field.to_le_bytes());
            }
            content += length;
        }
        segments.iter().for_each(|(.., bytes)| elf.extend(*bytes));
        elf
    }

    #[test]
    fn loadable_segments_are_joined_in_order_of_address() {
        let elf = file(&[(1, 0x0800_0004, &[5, 6]), (4, 0x0700_0000, &[9]), (1, 0x0800_0000, &[1, 2]), (1, 0, &[])]);
        let Flash { address, bytes } = flash(&elf).unwrap();
        assert_eq!((address, bytes.as_slice()), (0x0800_0000, &[1, 2, 0xff, 0xff, 5, 6][..]));
    }

    #[test]
    fn gaps_between_segments_are_filled_in_the_file() {
        let mut elf = file(&[(1, 0x100, &[1, 2]), (0, 0, &[0, 0]), (1, 0x104, &[5])]);
        let before = flash(&elf).unwrap().bytes;
        fill_gaps(&mut elf).unwrap();
        assert_eq!(flash(&elf).unwrap().bytes, before);
        assert_eq!((word(&elf, 0x34 + 16).unwrap(), word(&elf, 0x34 + 20).unwrap()), (4, 4));
        let sealed = elf.clone();
        fill_gaps(&mut elf).unwrap();
        assert_eq!(elf, sealed);
        let error = fill_gaps(&mut file(&[(1, 0, &[1, 2]), (1, 4, &[5])])).unwrap_err().to_string();
        assert!(error.contains("a gap of 2 bytes"), "{error}");
    }

    #[test]
    fn other_files_are_rejected() {
        let error = |elf: &[u8]| flash(elf).err().expect("an error").to_string();
        assert!(error(b"\x7fELF\x02\x01").contains("32-bit"));
        assert!(error(&file(&[])).contains("no segment"));
        assert!(error(&file(&[(1, 0, &[1, 2, 3, 4]), (1, 2, &[5])])).contains("overlap"));
        let mut short = file(&[(1, 0, &[1, 2])]);
        short.pop();
        assert!(error(&short).contains("outside"));
        short.truncate(0x40);
        assert!(error(&short).contains("cut off"));
    }
}
