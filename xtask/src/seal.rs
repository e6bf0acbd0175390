//! The checksum in an image, which the firmware compares with the flash at its start (`firmware/src/image_check.rs`).

use anyhow::{Context, Result, bail, ensure};

use crate::segments;

/// The mark before the checksum.
const MARK: &[u8] = b"vsj image crc32c";
/// Length of the checksum, in bytes.
const LENGTH: usize = 4;

/// Writes the checksum into an ELF file, and 0xff between its segments; one that has it already does not change. A file without exactly one mark in
/// its flash and in itself is an error.
pub(crate) fn seal(elf: &mut [u8]) -> Result<()> {
    segments::fill_gaps(elf)?;
    let mut flash = segments::flash(elf)?.bytes;
    let place = |bytes: &[u8]| -> Result<std::ops::Range<usize>> {
        let mut found = bytes.windows(MARK.len()).enumerate().filter(|(_, window)| *window == MARK);
        let at = found.next().context("no mark of a checksum in the image")?.0 + MARK.len();
        if found.next().is_some() {
            bail!("two marks of a checksum in the image");
        }
        ensure!(at + LENGTH <= bytes.len(), "the image ends in its checksum");
        Ok(at..at + LENGTH)
    };
    let in_flash = place(&flash)?;
    flash[in_flash].fill(0xff);
    // Without the first word, the top of the stack.
    let checked = flash.get(4..).unwrap_or_default();
    let in_elf = place(elf)?;
    elf[in_elf].copy_from_slice(&crc_32c(checked).to_le_bytes());
    Ok(())
}

/// CRC-32C (Castagnoli), bit by bit.
fn crc_32c(bytes: &[u8]) -> u32 {
    let bit = |crc: u32, _| if crc & 1 == 1 { crc >> 1 ^ 0x82f6_3b78 } else { crc >> 1 };
    !bytes.iter().fold(u32::MAX, |crc, byte| (0..8).fold(crc ^ u32::from(*byte), bit))
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Check value of CRC-32/ISCSI in the catalogue of parametrised CRC algorithms.
    #[test]
    fn the_check_value_of_crc_32_iscsi_is_reproduced() {
        assert_eq!(crc_32c(b"123456789"), 0xe306_9283);
    }

    #[test]
    fn the_checksum_is_that_of_the_flash_with_ones_in_its_place() {
        let content = [&[1, 2, 3, 4][..], MARK, &[0xff; 4], &[5]].concat();
        let mut elf = segments::tests::file(&[(1, 0x0800_0000, &content)]);
        seal(&mut elf).unwrap();
        let sealed = segments::flash(&elf).unwrap().bytes;
        assert_eq!(sealed[20..24], crc_32c(&content[4..]).to_le_bytes());
        assert_eq!((&sealed[..20], &sealed[24..]), (&content[..20], &content[24..]));
        let before = elf.clone();
        seal(&mut elf).unwrap();
        assert_eq!(elf, before, "once is enough");
    }

    #[test]
    fn an_image_without_exactly_one_mark_is_rejected() {
        let error = |content: &[u8]| seal(&mut segments::tests::file(&[(1, 0, content)])).unwrap_err().to_string();
        assert!(error(&[1, 2, 3]).contains("no mark"));
        assert!(error(&[MARK, &[0; 4], MARK, &[0; 4]].concat()).contains("two marks"));
        assert!(error(&[MARK, &[0; 3]].concat()).contains("ends"));
    }
}
