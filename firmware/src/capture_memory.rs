//! Memory of the fast capture: all of the RAM behind the program's variables. Its size follows from the linker, so that an
//! image with fewer variables has room for more rows.

#![allow(unsafe_code)]

use core::sync::atomic::AtomicU32;

unsafe extern "C" {
    /// End of the program's variables.
    static __euninit: AtomicU32;
    /// End of the RAM.
    static _ram_end: AtomicU32;
}

/// The memory. The start-up code does not clear it, and the test of the RAM does not cover it.
pub fn words() -> &'static [AtomicU32] {
    let (begin, end) = (&raw const __euninit, &raw const _ram_end);
    let length = (end as usize).saturating_sub(begin as usize) / size_of::<AtomicU32>();
    // SAFETY: aligned words of RAM in which the linker places nothing, and of which every pattern of bits is valid.
    unsafe { core::slice::from_raw_parts(begin, length) }
}
