//! The MCU's images: ELF, bin, hex.

use std::fs;
use std::path::{Path, PathBuf};

use anyhow::{Context, Result};

use crate::variant::Variant;
use crate::{elf, shell};

/// What the optimiser aims at.
#[derive(Clone, Copy, Debug, PartialEq, Eq, clap::ValueEnum)]
pub(crate) enum Opt {
    /// Size, as it is flashed
    S,
    /// Speed
    #[value(name = "3")]
    Three,
}

impl Opt {
    pub(crate) const ALL: [Self; 2] = [Self::S, Self::Three];

    pub(crate) const fn name(self) -> &'static str {
        match self {
            Self::S => "s",
            Self::Three => "3",
        }
    }

    const fn profile(self) -> &'static str {
        match self {
            Self::S => "firmware",
            Self::Three => "firmware-3",
        }
    }
}

/// Binary and feature have the board's name.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Board {
    Nucleo,
    Mps2,
}

impl Board {
    pub(crate) const ALL: [Self; 2] = [Self::Nucleo, Self::Mps2];

    pub(crate) const fn name(self) -> &'static str {
        match self {
            Self::Nucleo => "nucleo-g474re",
            Self::Mps2 => "mps2-an386",
        }
    }

    const fn package(self) -> &'static str {
        match self {
            Self::Nucleo => "firmware",
            Self::Mps2 => "test-bench",
        }
    }
}

/// Builds an image as it is flashed and returns its ELF file.
pub(crate) fn build(board: Board, opt: Opt) -> Result<PathBuf> {
    build_with(&[], board, opt)
}

/// As [`build`], with these features of the firmware's.
pub(crate) fn build_with(features: &[&str], board: Board, opt: Opt) -> Result<PathBuf> {
    let features = [&[board.name()], features].concat();
    compile(board.package(), &features.join(","), opt, ["--bin", board.name()], board.name(), &features.join("-"))
}

/// As [`build`], of an example of the test bench, with these features of it.
pub(crate) fn example(name: &str, features: &str, opt: Opt) -> Result<PathBuf> {
    compile(Board::Mps2.package(), features, opt, ["--example", name], &format!("examples/{name}"), name)
}

/// Under a name of its own: cargo gives the images of all sets of features the same.
fn compile(package: &str, features: &str, opt: Opt, what: [&str; 2], file: &str, name: &str) -> Result<PathBuf> {
    let target = target_directory()?;
    let folder = target.join(shell::MCU).join(opt.profile());
    let images = folder.join("image");
    fs::create_dir_all(&images).with_context(|| format!("cannot make {}", images.display()))?;
    // Between building and copying nobody else may build.
    let turn = fs::File::create(folder.join("turn.lock")).context("cannot make a lock")?;
    turn.lock().context("cannot wait for a lock")?;
    shell::run(shell::cargo().args(["build", "--quiet", "--package", package]).args(what).args([
        "--features",
        features,
        "--profile",
        opt.profile(),
        "--target",
        shell::MCU,
    ]))?;
    let (built, own) = (folder.join(file), images.join(name));
    // A new file in place of the old one, which somebody may be running.
    let new = own.with_extension("new");
    fs::copy(&built, &new).with_context(|| format!("cannot copy {}", built.display()))?;
    fs::rename(&new, &own).with_context(|| format!("cannot write {}", own.display()))?;
    Ok(own)
}

/// Where cargo builds.
pub(crate) fn target_directory() -> Result<PathBuf> {
    let metadata = shell::metadata()?;
    Ok(metadata["target_directory"].as_str().context("cargo metadata names no target directory")?.into())
}

/// `cargo xtask image`.
pub(crate) fn run(variant: Variant) -> Result<()> {
    for board in Board::ALL {
        let path = build_with(&variant.features(), board, Opt::S)?;
        let flash = elf::flash(&read(&path)?).with_context(|| format!("in {}", path.display()))?;
        let (bin, hex) = (path.with_extension("bin"), path.with_extension("hex"));
        write(&bin, &flash.bytes)?;
        write(&hex, intel_hex(flash.address, &flash.bytes).as_bytes())?;
        println!("{}\n{}\n{}", path.display(), bin.display(), hex.display());
    }
    Ok(())
}

pub(crate) fn read(path: &Path) -> Result<Vec<u8>> {
    fs::read(path).with_context(|| format!("cannot read {}", path.display()))
}

fn write(path: &Path, bytes: &[u8]) -> Result<()> {
    fs::write(path, bytes).with_context(|| format!("cannot write {}", path.display()))
}

/// Intel HEX with 16 bytes a line.
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
    fn hex_is_as_intel_wrote_it() {
        let text =
            intel_hex(0x0800_fff0, &[0x21, 0x46, 1, 0x36, 1, 0x21, 0x47, 1, 0x36, 0, 0x7e, 0xfe, 9, 0xd2, 0x19, 1, 5]);
        let lines: Vec<&str> = text.lines().collect();
        assert_eq!(lines[0], ":020000040800F2");
        assert_eq!(lines[1], ":10FFF000214601360121470136007EFE09D2190152");
        assert_eq!(lines[2..], [":020000040801F1", ":0100000005FA", ":00000001FF"]);
    }
}
