//! Check of the image in flash at the start, against the checksum that `cargo xtask` has written into it.

#![allow(unsafe_code)]

use link::checksum::checksum_of;

/// Length of the checksum, in bytes.
const LENGTH: usize = 4;

/// The mark by which `cargo xtask` finds the checksum, and the checksum: CRC-32C of the image, from its second word
/// on, with 0xff in its place.
#[repr(C)]
struct Seal {
    mark: [u8; 16],
    checksum: [u8; LENGTH],
}

#[used]
static SEAL: Seal = Seal { mark: *b"vsj image crc32c", checksum: [0xff; LENGTH] };

unsafe extern "C" {
    static __RESET_VECTOR: u8;
    static __sidata: u8;
    static __sdata: u8;
    static __edata: u8;
}

/// True if the flash contains the image that was built: from the reset vector to the initial values of the variables. The word
/// before is the top of the stack, which this function stands on; its address is 0 on the emulated board, where no slice begins.
pub fn intact() -> bool {
    let (begin, checksum) = (&raw const __RESET_VECTOR, &raw const SEAL.checksum);
    let variables = (&raw const __edata as usize).saturating_sub(&raw const __sdata as usize);
    let length = (&raw const __sidata as usize).saturating_add(variables).saturating_sub(begin as usize);
    // SAFETY: the linker places the image there without holes, and nothing writes to it.
    let image = unsafe { core::slice::from_raw_parts(begin, length) };
    // SAFETY: a constant of the image; volatile, because its value is written after the compilation.
    let expected = u32::from_le_bytes(unsafe { checksum.read_volatile() });
    let at = (checksum as usize).saturating_sub(begin as usize);
    let (Some(before), Some(after)) = (image.get(..at), image.get(at.saturating_add(LENGTH)..)) else { return false };
    checksum_of(&[before, &[0xff; LENGTH], after]) == expected
}
