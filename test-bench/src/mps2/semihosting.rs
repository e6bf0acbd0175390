//! Calls to the emulator: command line, files of the machine that it runs on, and exit.
//!
//! The board's clock stands still during a call, however long it takes.

use core::arch::asm;

const OPEN: u32 = 0x01;
const WRITE: u32 = 0x05;
const READ: u32 = 0x06;
const SEEK: u32 = 0x0a;
const CLOCK: u32 = 0x10;
const TIME: u32 = 0x11;
const GET_COMMAND_LINE: u32 = 0x15;
const EXIT_EXTENDED: u32 = 0x20;
const APPLICATION_EXIT: u32 = 0x2_0026;

/// The emulator's `arg` options, joined by blanks; empty if they do not fit into `buffer`.
pub fn command_line(buffer: &mut [u8]) -> &str {
    let mut block = [buffer.as_mut_ptr() as u32, buffer.len() as u32];
    let failed = call(GET_COMMAND_LINE, block.as_mut_ptr() as u32) != 0;
    let length = if failed { 0 } else { block[1] as usize };
    buffer.get(..length).and_then(|bytes| core::str::from_utf8(bytes).ok()).unwrap_or("").trim_end_matches('\0')
}

/// Mode in which a file is opened, with the number that semihosting assigns to the mode string of C.
#[derive(Clone, Copy, Debug)]
#[repr(u32)]
pub enum Mode {
    /// Mode `rb`.
    Read = 1,
    /// Mode `r+b`: the file must exist.
    Update = 3,
    /// Mode `wb`.
    Write = 5,
}

/// A file or pipe in the emulator's folder.
#[derive(Debug)]
pub struct File(u32);

impl File {
    /// Opens the file `name`; `None` if that fails.
    pub fn open(name: &'static core::ffi::CStr, mode: Mode) -> Option<Self> {
        let block = [name.as_ptr() as u32, mode as u32, name.count_bytes() as u32];
        let handle = call(OPEN, block.as_ptr() as u32);
        (handle != u32::MAX).then_some(Self(handle))
    }

    /// Sets the position to `at` bytes from the beginning. False if that fails.
    pub fn seek(&mut self, at: usize) -> bool {
        call(SEEK, [self.0, at as u32].as_ptr() as u32) == 0
    }

    /// Writes `bytes`. True if all of them were written.
    pub fn write(&mut self, bytes: &[u8]) -> bool {
        call(WRITE, [self.0, bytes.as_ptr() as u32, bytes.len() as u32].as_ptr() as u32) == 0
    }

    /// Fills `bytes`. True if all of them were read.
    pub fn read(&mut self, bytes: &mut [u8]) -> bool {
        call(READ, [self.0, bytes.as_mut_ptr() as u32, bytes.len() as u32].as_ptr() as u32) == 0
    }
}

/// A number that differs from start to start: the time of the machine that the emulator runs on, in s, and that since the
/// emulator's start, in 10 ms.
pub fn seed() -> u32 {
    call(TIME, 0).wrapping_mul(1 << 12).wrapping_add(call(CLOCK, 0))
}

/// Ends the emulator with this exit code.
pub fn exit(code: u32) -> ! {
    let block = [APPLICATION_EXIT, code];
    call(EXIT_EXTENDED, block.as_ptr() as u32);
    loop {
        cortex_m::asm::nop();
    }
}

fn call(number: u32, block: u32) -> u32 {
    let answer;
    // SAFETY: the emulator accesses only the memory that `block` points to, which outlives the call.
    unsafe { asm!("bkpt 0xab", inout("r0") number => answer, in("r1") block) }
    answer
}
