//! The command line of QEMU for the emulated board, MPS2 with image AN386: a Cortex-M4.

use std::path::Path;
use std::process::Command;

/// The emulator's program.
pub const PROGRAM: &str = "qemu-system-arm";
/// Debian's and Ubuntu's way to install it.
pub const INSTALL: &str = "sudo apt-get install qemu-system-arm";
/// QEMU's `-icount shift`: an instruction takes 2^6 ns of the board's time.
pub const SHIFT: u32 = 6;
/// Name of the script in which a host commands the board.
pub const LINK: &str = "link";

/// What the board is connected to, and how its clock runs.
#[derive(Clone, Copy, Debug)]
pub struct Run<'a> {
    /// Name of the script that the firmware plays.
    pub script: &'a str,
    /// QEMU's name of the device that the serial link is connected to.
    pub host: &'a str,
    /// File that takes what is written to the DAC.
    pub wire: &'a Path,
    /// QEMU's `-icount`.
    pub clock: &'a str,
}

impl Run<'_> {
    /// `-icount` of a board in real time: its clock is slowed down to the host's.
    pub fn real_time() -> String {
        format!("shift={SHIFT},align=on")
    }

    /// QEMU's name of a unix socket that a host may connect to at any time.
    pub fn socket(path: &Path) -> String {
        format!("unix:{},server=on,wait=off", path.display())
    }

    /// The command that runs the image `elf`. Its log goes to stdout; the board's files are in the command's working directory.
    pub fn command(&self, elf: &Path) -> Command {
        let mut command = Command::new(PROGRAM);
        command
            .args(["-M", "mps2-an386", "-display", "none", "-monitor", "none", "-serial", self.host])
            .args(["-serial", &format!("file:{}", self.wire.display())])
            .args(["-icount", self.clock])
            .args(["-semihosting-config", &format!("enable=on,target=native,arg={}", self.script)])
            .arg("-kernel")
            .arg(elf);
        command
    }
}
