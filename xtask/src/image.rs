//! `cargo xtask image`: the MCU's images as ELF, bin and hex, each with its software bill of materials.

use std::path::PathBuf;

use anyhow::{Context, Result};
use xtask::build::{self, Board, Opt};
use xtask::files;
use xtask::segments;
use xtask::variant::Variant;

use crate::sbom;

/// Options of `cargo xtask image`.
#[derive(clap::Args)]
pub(crate) struct Args {
    #[command(flatten)]
    variant: Variant,
    /// This board's image alone
    #[arg(long, value_parser = board)]
    board: Option<Board>,
}

fn board(name: &str) -> Result<Board, String> {
    let names = || Board::ALL.map(Board::name).join(", ");
    Board::ALL.into_iter().find(|board| board.name() == name).ok_or_else(|| format!("expected {}", names()))
}

/// Builds the image of each board and prints the paths of its four files, the ELF file first.
pub(crate) fn run(Args { variant, board }: Args) -> Result<()> {
    for board in Board::ALL.into_iter().filter(|each| board.is_none_or(|only| *each == only)) {
        for path in files(variant, board)? {
            println!("{}", path.display());
        }
    }
    Ok(())
}

/// Builds an image; returns the paths of the ELF file, the bin, the hex, and the bill of materials.
pub(crate) fn files(variant: Variant, board: Board) -> Result<[PathBuf; 4]> {
    let path = build::image_with(&variant.features(), board, Opt::S)?;
    let flash = segments::flash(&build::read(&path)?).with_context(|| format!("in {}", path.display()))?;
    let [bin, hex, bom] = ["bin", "hex", "cdx.json"].map(|extension| path.with_extension(extension));
    files::write(&bin, &flash.bytes)?;
    files::write(&hex, intel_hex(flash.address, &flash.bytes))?;
    let name = path.file_name().unwrap_or_default().to_string_lossy();
    files::write(&bom, sbom::of_image(board, &variant.features(), &name)?)?;
    Ok([path, bin, hex, bom])
}

/// Formats bytes that begin at `address` as Intel HEX, 16 bytes a line.
fn intel_hex(address: u32, bytes: &[u8]) -> String {
    let mut text = String::new();
    let mut line = |kind: u8, offset: u16, data: &[u8]| {
        let [high, low] = offset.to_be_bytes();
        let mut record = vec![data.len() as u8, high, low, kind];
        record.extend_from_slice(data);
        let sum = record.iter().fold(0u8, |sum, byte| sum.wrapping_add(*byte)).wrapping_neg();
        record.push(sum);
        text.push(':');
        text.extend(record.iter().map(|byte| format!("{byte:02X}")));
        text.push('\n');
    };
    let mut upper = None;
    for (index, chunk) in bytes.chunks(16).enumerate() {
        let at = address + 16 * index as u32;
        if upper != Some(at >> 16) {
            upper = Some(at >> 16);
            line(4, 0, &((at >> 16) as u16).to_be_bytes());
        }
        line(0, at as u16, chunk);
    }
    line(1, 0, &[]);
    text
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn hex_lines_have_address_type_and_checksum() {
        let text =
            intel_hex(0x0800_fff0, &[0x21, 0x46, 1, 0x36, 1, 0x21, 0x47, 1, 0x36, 0, 0x7e, 0xfe, 9, 0xd2, 0x19, 1, 5]);
        let lines: Vec<&str> = text.lines().collect();
        assert_eq!(lines[0], ":020000040800F2");
        assert_eq!(lines[1], ":10FFF000214601360121470136007EFE09D2190152");
        assert_eq!(lines[2..], [":020000040801F1", ":0100000005FA", ":00000001FF"]);
    }
}
