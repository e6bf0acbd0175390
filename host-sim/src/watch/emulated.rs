//! The emulated board of `--emulated`: its image found or built, QEMU started in a temporary folder and ended with the program.

use std::env;
use std::fs::{self, File};
use std::io::{self, ErrorKind};
use std::path::{Path, PathBuf};
use std::process::{Child, Command, Stdio};
use std::sync::{Arc, Mutex, MutexGuard, PoisonError};
use std::thread;
use std::time::{Duration, Instant};

use anyhow::{Context, Result, bail};

use crate::qemu::{INSTALL, LINK, PROGRAM, Run};
use crate::signals::{self, TemporaryFolder};

/// Name of the board and of its image.
const BOARD: &str = "mps2-an386";
/// The compiler's target of the board.
const TARGET: &str = "thumbv7em-none-eabihf";
/// Longest wait for the emulator's socket.
const PATIENCE: Duration = Duration::from_secs(10);

/// A running emulated board; it ends when dropped, when a signal ends the program, and with the thread that has started it.
pub struct Emulated {
    child: Arc<Mutex<Child>>,
    /// Name of its port.
    pub port: String,
    _folder: TemporaryFolder,
}

impl Emulated {
    /// Starts the board with the image `elf`, or with one that is found or built. `say` receives what takes time.
    ///
    /// # Errors
    /// If QEMU, the compiler's target or the image is missing, with the command that helps; if QEMU does not start.
    pub fn start(elf: Option<&Path>, say: impl Fn(&str)) -> Result<Self> {
        let ends_with_us = emulator()?;
        let elf = match elf {
            Some(elf) => std::path::absolute(elf)?,
            None => image(say)?,
        };
        File::open(&elf).with_context(|| format!("cannot read {}", elf.display()))?;
        let folder = TemporaryFolder::new_in(&env::temp_dir()).context("cannot make a temporary folder")?;
        let (socket, messages) = (folder.path().join("link"), folder.path().join("messages"));
        let (host, clock) = (Run::socket(&socket), Run::real_time());
        let run = Run { script: LINK, host: &host, wire: Path::new("/dev/null"), clock: &clock };
        let command = run.command(&elf);
        let mut command = if ends_with_us { ending_with_us(&command) } else { command };
        // A stored model of the board ends with the folder.
        command.current_dir(folder.path()).stdin(Stdio::null()).stdout(Stdio::null()).stderr(File::create(&messages)?);
        own_group(&mut command);
        let child = Arc::new(Mutex::new(command.spawn().with_context(|| format!("cannot start {PROGRAM}"))?));
        let to_end = child.clone();
        signals::at_end(move || end(&to_end));
        let board = Self { child, port: format!("unix:{}", socket.display()), _folder: folder };
        board.wait_for(&socket, &messages)?;
        Ok(board)
    }

    fn wait_for(&self, socket: &Path, messages: &Path) -> Result<()> {
        let begin = Instant::now();
        while !socket.exists() {
            if let Some(status) = lock(&self.child).try_wait()? {
                let said = fs::read_to_string(messages).unwrap_or_default();
                bail!("{PROGRAM} has ended ({status}): {}", said.trim());
            }
            if begin.elapsed() > PATIENCE {
                bail!("{PROGRAM} has not opened {} within {} s", socket.display(), PATIENCE.as_secs());
            }
            thread::sleep(Duration::from_millis(10));
        }
        Ok(())
    }
}

impl Drop for Emulated {
    fn drop(&mut self) {
        end(&self.child);
    }
}

fn lock(child: &Mutex<Child>) -> MutexGuard<'_, Child> {
    child.lock().unwrap_or_else(PoisonError::into_inner)
}

/// Ends the emulator; one that has ended already stays so.
fn end(child: &Mutex<Child>) {
    let mut child = lock(child);
    let _ = child.kill();
    let _ = child.wait();
}

/// Takes the command out of the reach of the terminal's Ctrl-C: the board must still be there to be disarmed.
#[cfg(unix)]
fn own_group(command: &mut Command) {
    std::os::unix::process::CommandExt::process_group(command, 0);
}

#[cfg(not(unix))]
fn own_group(_: &mut Command) {}

/// Checks that the emulator is installed. Returns whether [`ending_with_us`] works here.
fn emulator() -> Result<bool> {
    let started = |command: &mut Command| command.stdout(Stdio::null()).stderr(Stdio::null()).status();
    let mut asked = Command::new(PROGRAM);
    asked.arg("--version");
    match started(&mut asked) {
        Err(error) if error.kind() == ErrorKind::NotFound => {
            bail!("--emulated: {PROGRAM} is not installed; install it: {INSTALL}")
        }
        Err(error) => Err(error).with_context(|| format!("cannot start {PROGRAM}")),
        Ok(_) => Ok(started(&mut ending_with_us(&asked)).is_ok_and(|status| status.success())),
    }
}

/// The command as one that the kernel of Linux ends together with the thread that starts it, even where this program cannot do it
/// any more, as after SIGKILL. That needs `setpriv` (util-linux): setting it in the child from here would be unsafe code.
fn ending_with_us(command: &Command) -> Command {
    let mut ending = Command::new("setpriv");
    ending.args(["--pdeathsig", "KILL", "--"]).arg(command.get_program()).args(command.get_args());
    ending
}

/// The image: that of the release which this program is in, otherwise built from the sources.
fn image(say: impl Fn(&str)) -> Result<PathBuf> {
    let program = env::current_exe().and_then(fs::canonicalize).unwrap_or_default();
    // Where a release has it.
    let shipped = program.with_file_name("firmware").join(format!("{BOARD}.elf"));
    if shipped.is_file() {
        return Ok(shipped);
    }
    let folder = env::current_dir().unwrap_or_default();
    let Some(root) = [&folder, &program].into_iter().find_map(|from| sources(from)) else {
        bail!(
            "--emulated: no image of the emulated board: expected {}, --firmware FILE, or a working directory in the project's \
             sources to build it from",
            shipped.display()
        );
    };
    target(&root)?;
    say("building the image of the emulated board (cargo xtask image), at first about a minute");
    build(&root)
}

/// The project's sources that `from` lies in.
fn sources(from: &Path) -> Option<PathBuf> {
    let is_root =
        |folder: &&Path| ["xtask", "test-bench"].iter().all(|part| folder.join(part).join("Cargo.toml").exists());
    from.ancestors().find(is_root).map(Path::to_owned)
}

/// Checks that the compiler has the board's target.
fn target(root: &Path) -> Result<()> {
    let library = Command::new("rustc")
        .current_dir(root)
        .args(["--print", "target-libdir", "--target", TARGET])
        .stderr(Stdio::null())
        .output()
        .map_err(|error| io::Error::new(error.kind(), format!("rustc: {error}; install it from https://rustup.rs")))?;
    let library = String::from_utf8_lossy(&library.stdout).trim().to_owned();
    if library.is_empty() || !Path::new(&library).exists() {
        bail!("--emulated: the compiler has no target {TARGET}; install it: rustup target add {TARGET}");
    }
    Ok(())
}

/// Builds the image with the project's own command; its messages go to stderr.
fn build(root: &Path) -> Result<PathBuf> {
    let args = ["xtask", "image", "--board", BOARD];
    let mut command = Command::new("cargo");
    command.current_dir(root).args(args).stdin(Stdio::null()).stderr(Stdio::inherit());
    let built = command.output().context("cannot start cargo")?;
    if !built.status.success() {
        bail!("--emulated: `cargo {}` failed in {} ({})", args.join(" "), root.display(), built.status);
    }
    let printed = String::from_utf8_lossy(&built.stdout);
    // The first line is the ELF file.
    let elf = printed.lines().next().context("cargo xtask image printed no path")?;
    Ok(elf.into())
}
