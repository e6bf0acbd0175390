//! Compiled libraries that `vsj export` packs, and the platforms that they are for.

use std::env::consts::{DLL_PREFIX, DLL_SUFFIX};
use std::path::{Path, PathBuf};

use anyhow::{Context, Result};
use simulation::bad_input;
use simulation::bounded_file::read;

/// Largest size of a library, in MiB.
const MOST_MIB: usize = 512;
/// A function that every library of a unit has.
const FUNCTION: &[u8] = b"fmi3InstantiateCoSimulation";

/// A shared library.
#[derive(Debug)]
pub struct Library {
    /// What it runs on.
    pub platform: Platform,
    /// The file.
    pub bytes: Vec<u8>,
}

/// A processor and an operating system.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Platform {
    /// Name in FMI 3.0.
    pub name: &'static str,
    /// Name in FMI 2.0.
    pub in_fmi_2: &'static str,
    /// Ending of a shared library.
    pub ending: &'static str,
}

/// Whether a file is for a platform.
type IsFor = fn(&[u8]) -> bool;

/// Platforms for which a unit can have a library, and how each of their files begins.
const PLATFORMS: [(Platform, IsFor); 6] = [
    (Platform { name: "x86_64-linux", in_fmi_2: "linux64", ending: ".so" }, |bytes| elf(bytes) == Some(0x3e)),
    (Platform { name: "aarch64-linux", in_fmi_2: "aarch64-linux", ending: ".so" }, |bytes| elf(bytes) == Some(0xb7)),
    (Platform { name: "x86_64-windows", in_fmi_2: "win64", ending: ".dll" }, |bytes| pe(bytes) == Some(0x8664)),
    (Platform { name: "aarch64-windows", in_fmi_2: "aarch64-windows", ending: ".dll" }, |bytes| {
        pe(bytes) == Some(0xaa64)
    }),
    (Platform { name: "x86_64-darwin", in_fmi_2: "darwin64", ending: ".dylib" }, |bytes| {
        mach_o(bytes) == Some(0x0100_0007)
    }),
    (Platform { name: "aarch64-darwin", in_fmi_2: "aarch64-darwin", ending: ".dylib" }, |bytes| {
        mach_o(bytes) == Some(0x0100_000c)
    }),
];

/// The two bytes at `offset` as a little-endian number.
fn half_word(bytes: &[u8], offset: usize) -> Option<u16> {
    Some(u16::from_le_bytes(bytes.get(offset..offset + 2)?.try_into().ok()?))
}

/// The four bytes at `offset` as a little-endian number.
fn word(bytes: &[u8], offset: usize) -> Option<u32> {
    Some(u32::from_le_bytes(bytes.get(offset..offset + 4)?.try_into().ok()?))
}

/// Number of the machine of an ELF file with 64 bits, little-endian.
fn elf(bytes: &[u8]) -> Option<u16> {
    half_word(bytes.starts_with(b"\x7fELF\x02\x01").then_some(bytes)?, 18)
}

/// Number of the machine of a file for Windows.
fn pe(bytes: &[u8]) -> Option<u16> {
    let header = word(bytes.starts_with(b"MZ").then_some(bytes)?, 0x3c)? as usize;
    half_word(bytes.get(header..).filter(|header| header.starts_with(b"PE\0\0"))?, 4)
}

/// Number of the processor of a file for macOS with 64 bits.
fn mach_o(bytes: &[u8]) -> Option<u32> {
    word(bytes.starts_with(&[0xcf, 0xfa, 0xed, 0xfe]).then_some(bytes)?, 4)
}

impl Library {
    /// Reads a library of co-simulation units.
    ///
    /// # Errors
    /// [`simulation::BadInput`] if it is none, or for another platform than those of FMI.
    pub fn read(path: &Path) -> Result<Self> {
        let expected = "the shared library of the package fmu";
        let bytes = read(path, MOST_MIB, expected)?;
        let Some((platform, _)) = PLATFORMS.iter().find(|(_, is_its)| is_its(&bytes)) else {
            bad_input!("{}: expected {expected}, for x86_64 or aarch64 of Linux, Windows or macOS", path.display());
        };
        if !bytes.windows(FUNCTION.len()).any(|part| part == FUNCTION) {
            bad_input!("{}: a library without the functions of FMI; expected {expected}", path.display());
        }
        Ok(Self { platform: *platform, bytes })
    }
}

/// Reads the library `name` beside this program, where a release and a build have it; `build` is the command that makes it.
///
/// # Errors
/// [`simulation::BadInput`] with the folders that were looked into.
pub fn find(name: &str, build: &str) -> Result<Library> {
    let program = std::env::current_exe().and_then(|path| path.canonicalize()).context("where is this program?")?;
    let folder = program.parent().context("a program is in a folder")?;
    let file = format!("{DLL_PREFIX}{name}{DLL_SUFFIX}");
    // Cargo leaves the libraries that a program depends on in `deps`.
    let places: [PathBuf; 3] = [folder.join(&file), folder.join("deps").join(&file), folder.join("../lib").join(&file)];
    match places.iter().find(|place| place.is_file()) {
        Some(place) => Library::read(place),
        None => bad_input!(
            "{file} is not beside {}, nor in ../lib; expected it there, or with --library FILE; `{build}` makes it",
            program.display()
        ),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_library_is_recognised_by_its_first_bytes() {
        let mut pe = vec![0; 0x88];
        pe[..2].copy_from_slice(b"MZ");
        pe[0x3c] = 0x80;
        pe[0x80..0x86].copy_from_slice(b"PE\0\0\x64\x86");
        let mut elf = vec![0; 20];
        elf[..6].copy_from_slice(b"\x7fELF\x02\x01");
        elf[18] = 0xb7;
        for (bytes, name) in [
            (pe.as_slice(), Some("x86_64-windows")),
            (&elf, Some("aarch64-linux")),
            (b"\xcf\xfa\xed\xfe\x0c\x00\x00\x01", Some("aarch64-darwin")),
            (b"MZ", None),
            (b"", None),
            (b"\x7fELF\x01\x01", None),
        ] {
            let found = PLATFORMS.iter().find(|(_, is_its)| is_its(bytes)).map(|(platform, _)| platform.name);
            assert_eq!(found, name);
        }
    }
}
