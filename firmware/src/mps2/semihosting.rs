//! Two calls to the emulator: which script is to be played, and the way out.

use core::arch::asm;

const GET_COMMAND_LINE: u32 = 0x15;
const EXIT_EXTENDED: u32 = 0x20;
const APPLICATION_EXIT: u32 = 0x2_0026;

/// The emulator's `arg` options, joined by blanks.
pub fn command_line(buffer: &mut [u8]) -> &str {
    let mut block = [buffer.as_mut_ptr() as u32, buffer.len() as u32];
    let failed = call(GET_COMMAND_LINE, block.as_mut_ptr() as u32) != 0;
    let length = if failed { 0 } else { block[1] as usize };
    buffer.get(..length).and_then(|bytes| core::str::from_utf8(bytes).ok()).unwrap_or("").trim_end_matches('\0')
}

/// Ends the emulator.
pub fn exit(code: u32) -> ! {
    let block = [APPLICATION_EXIT, code];
    call(EXIT_EXTENDED, block.as_ptr() as u32);
    super::actor::hang()
}

fn call(number: u32, block: u32) -> u32 {
    let answer;
    // SAFETY: the emulator reads and writes what `block` points to, which outlives the call.
    unsafe { asm!("bkpt 0xab", inout("r0") number => answer, in("r1") block) }
    answer
}
