//! `cargo xtask reproducible`: builds the images in two folders with names of different lengths, and compares the files.

use anyhow::{Result, ensure};
use xtask::build::{self, Board};
use xtask::files;
use xtask::segments;
use xtask::shell;
use xtask::tally::Tally;
use xtask::variant::Variant;

/// Names of the two folders under the target directory. A path's length once changed the size of an image.
const FOLDERS: [&str; 2] = ["a", "another-folder-whose-name-is-longer"];

/// Copies the sources to both folders, builds each board's image in both, and prints their sizes if all bytes agree.
pub(crate) fn run(variant: Variant) -> Result<()> {
    let target = shell::target_directory()?.join("reproducible");
    let copies = FOLDERS.map(|name| target.join(name));
    copies.iter().try_for_each(|folder| files::copy_tracked(folder))?;
    let mut counts = Vec::new();
    for board in Board::ALL {
        let [one, other] = [&copies[0], &copies[1]].map(|root| build::image_of_copy(root, &variant.features(), board));
        let (one, other) = (build::read(&one?)?, build::read(&other?)?);
        let flash = [&one, &other].map(|elf| segments::flash(elf));
        let [flash, other_flash] = flash;
        let (flash, other_flash) = (flash?.bytes, other_flash?.bytes);
        ensure!(flash == other_flash, "{}: the flash differs {}", board.name(), first(&flash, &other_flash));
        ensure!(one == other, "{}: the ELF file differs {}", board.name(), first(&one, &other));
        println!("{}: {} bytes of flash and {} bytes of ELF agree", board.name(), flash.len(), one.len());
        for (part, bytes) in [("flash", &flash), ("ELF", &one)] {
            counts.push((format!("bytes of {part} that agree, {}", board.name()), bytes.len() as u64));
        }
    }
    Tally::now(counts)?.write(&variant.tally("reproducible"))
}

/// Where two files differ first.
fn first(one: &[u8], other: &[u8]) -> String {
    let at = one.iter().zip(other).take_while(|(one, other)| one == other).count();
    format!("from byte {at} on ({} and {} bytes)", one.len(), other.len())
}
