//! Reads an image without running it.
//!
//! In: the bytes of an ELF file for a Cortex-M4. Out: whether the control tick can panic or uses a float ([`audit`]),
//! the greatest depth of the stack ([`stack`]), and the bytes of flash and RAM ([`size`]). [`elf`] reads symbols and
//! sections, [`thumb`] the instructions of one function.

pub(crate) mod audit;
pub(crate) mod elf;
pub(crate) mod size;
mod stack;
mod thumb;
