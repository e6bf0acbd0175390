//! Symbols and sections of an image.

use anyhow::{Context, Result};
use object::elf::{FileHeader32, SHF_ALLOC};
use object::read::elf::{FileHeader, SectionHeader};
use object::{Endianness, Object, ObjectSection, ObjectSymbol};

type Header = FileHeader32<Endianness>;

/// Bytes of static variables in RAM.
pub(crate) fn ram(elf: &[u8]) -> Result<u32> {
    let header = Header::parse(elf)?;
    let endian = header.endian()?;
    let mut total = 0;
    for section in header.sections(endian, elf)?.iter() {
        let in_ram = (0x2000_0000..0x4000_0000).contains(&section.sh_addr(endian));
        if in_ram && section.sh_flags(endian) & SHF_ALLOC != 0 {
            total += section.sh_size(endian);
        }
    }
    Ok(total)
}

/// A function of the image: demangled name, address, size in bytes.
pub(crate) struct Function {
    pub(crate) name: String,
    pub(crate) address: u32,
    pub(crate) size: u32,
}

/// Every function, sorted by address. Names are demangled and have no hash.
pub(crate) fn functions(elf: &[u8]) -> Result<Vec<Function>> {
    let file = object::File::parse(elf)?;
    let mut functions: Vec<Function> = file
        .symbols()
        .filter(|symbol| symbol.kind() == object::SymbolKind::Text && symbol.size() > 0)
        .map(|symbol| Function {
            name: format!("{:#}", rustc_demangle::demangle(symbol.name().unwrap_or("?"))),
            address: symbol.address() as u32 & !1,
            size: symbol.size() as u32,
        })
        .collect();
    functions.sort_by_key(|function| function.address);
    Ok(functions)
}

/// The address of a symbol, named as in the file or demangled, without a suffix of the optimiser. A missing one is an
/// error.
pub(crate) fn symbol(elf: &[u8], name: &str) -> Result<u32> {
    let file = object::File::parse(elf)?;
    let is = |mangled: &str| {
        let demangled = format!("{:#}", rustc_demangle::demangle(mangled));
        mangled == name || demangled.strip_prefix(name).is_some_and(|rest| rest.is_empty() || rest.starts_with('.'))
    };
    let symbol = file.symbols().find(|symbol| symbol.name().is_ok_and(is));
    Ok(symbol.with_context(|| format!("no symbol {name}"))?.address() as u32)
}

/// The address of a section's first byte and that behind its last. A missing section is an error.
pub(crate) fn range(elf: &[u8], name: &str) -> Result<(u32, u32)> {
    let file = object::File::parse(elf)?;
    let section = file.section_by_name(name).with_context(|| format!("no section {name}"))?;
    Ok((section.address() as u32, (section.address() + section.size()) as u32))
}

/// Addresses at which data (true) or code (false) begins, sorted: ARM's mapping symbols `$d` and `$t`.
pub(crate) fn marks(elf: &[u8]) -> Result<Vec<(u32, bool)>> {
    let file = object::File::parse(elf)?;
    let mut marks: Vec<(u32, bool)> = file
        .symbols()
        .filter_map(|symbol| match symbol.name().ok()?.get(..2)? {
            "$d" => Some((symbol.address() as u32, true)),
            "$t" => Some((symbol.address() as u32, false)),
            _ => None,
        })
        .collect();
    marks.sort_unstable();
    Ok(marks)
}
