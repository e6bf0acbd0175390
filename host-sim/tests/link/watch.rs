//! `vsj watch` in a pseudo-terminal whose screen is read as a person would.

use std::io::{Read, Write};
use std::path::{Path, PathBuf};
use std::process::{Command, Stdio};
use std::sync::{Arc, Mutex};
use std::time::{Duration, Instant};

use link::State;
use portable_pty::{Child, CommandBuilder, MasterPty, PtySize, native_pty_system};
use simulation::record::{MEASURED, Record};

use crate::mcu::{Mcu, Setup};

/// Longest wait for something to be shown.
const PATIENCE: Duration = Duration::from_secs(30);

/// A program in a pseudo-terminal.
struct Terminal {
    screen: Arc<Mutex<vt100::Parser>>,
    master: Box<dyn MasterPty + Send>,
    keys: Box<dyn Write + Send>,
    child: Box<dyn Child + Send + Sync>,
}

fn size(rows: u16, cols: u16) -> PtySize {
    PtySize { rows, cols, pixel_width: 0, pixel_height: 0 }
}

impl Terminal {
    fn start(mut command: CommandBuilder) -> Self {
        let pair = native_pty_system().openpty(size(30, 100)).unwrap();
        if command.get_env("TERM").is_none_or(|name| name != "dumb") {
            command.env("TERM", "xterm-256color");
        }
        let child = pair.slave.spawn_command(command).unwrap();
        let screen = Arc::new(Mutex::new(vt100::Parser::new(30, 100, 0)));
        let (mut reader, parser) = (pair.master.try_clone_reader().unwrap(), screen.clone());
        std::thread::spawn(move || {
            let mut buffer = [0; 4096];
            while let Ok(count @ 1..) = reader.read(&mut buffer) {
                parser.lock().unwrap().process(&buffer[..count]);
            }
        });
        let keys = pair.master.take_writer().unwrap();
        Self { screen, master: pair.master, keys, child }
    }

    /// `vsj watch` with these arguments.
    fn watch(arguments: &[&str]) -> Self {
        let mut command = CommandBuilder::new(env!("CARGO_BIN_EXE_vsj"));
        command.arg("watch");
        command.args(arguments);
        Self::start(command)
    }

    fn text(&self) -> String {
        self.screen.lock().unwrap().screen().contents()
    }

    fn press(&mut self, keys: &str) {
        self.keys.write_all(keys.as_bytes()).unwrap();
    }

    /// Changes the size of the screen, and then that of the terminal: what the program draws for it must find that screen.
    fn resize(&mut self, rows: u16, columns: u16) {
        self.screen.lock().unwrap().screen_mut().set_size(rows, columns);
        self.master.resize(size(rows, columns)).unwrap();
    }

    /// Waits until the screen contains `text`.
    fn wait_for(&self, text: &str) -> String {
        self.wait_until(text, |shown| shown.contains(text))
    }

    fn wait_until(&self, what: &str, is_so: impl Fn(&str) -> bool) -> String {
        let begin = Instant::now();
        loop {
            let shown = self.text();
            if is_so(&shown) {
                return shown;
            }
            assert!(begin.elapsed() < PATIENCE, "never shown: {what}\n{shown}");
            std::thread::sleep(Duration::from_millis(10));
        }
    }

    /// Waits for the end of the program; returns its exit code.
    fn end(&mut self) -> u32 {
        let begin = Instant::now();
        loop {
            if let Some(status) = self.child.try_wait().unwrap() {
                // What was written last may still have to be read.
                std::thread::sleep(Duration::from_millis(100));
                return status.exit_code();
            }
            assert!(begin.elapsed() < PATIENCE, "still running:\n{}", self.text());
            std::thread::sleep(Duration::from_millis(10));
        }
    }

    /// Asserts that the terminal is as before the program: first screen, cursor shown, lines edited and echoed.
    fn assert_restored(&self) {
        use rustix::termios::{LocalModes, tcgetattr};
        let parser = self.screen.lock().unwrap();
        assert!(
            !parser.screen().alternate_screen() && !parser.screen().hide_cursor(),
            "{}",
            parser.screen().contents()
        );
        let slave = std::fs::File::open(self.master.tty_name().unwrap()).unwrap();
        let modes = tcgetattr(&slave).unwrap().local_modes;
        assert!(modes.contains(LocalModes::ICANON | LocalModes::ECHO | LocalModes::ISIG), "{modes:?}");
    }

    fn signal(&self, name: &str) {
        let process = self.child.process_id().unwrap().to_string();
        assert!(Command::new("kill").args([name, &process]).status().unwrap().success());
    }
}

impl Drop for Terminal {
    fn drop(&mut self) {
        let _ = self.child.kill();
        let _ = self.child.wait();
    }
}

/// The screen without what differs from run to run: numbers are `#`, runs of blanks and of lines of a plot are one.
fn masked(screen: &str, port: &str) -> String {
    let mut masked = String::new();
    for letter in screen.replace(port, "PORT").chars() {
        let letter = match letter {
            '0'..='9' | '.' => '#',
            '\u{2800}'..='\u{28ff}' => ' ',
            letter => letter,
        };
        if !([' ', '#', '─'].contains(&letter) && masked.ends_with(letter)) {
            masked.push(letter);
        }
    }
    masked.lines().map(|line| line.trim_end().to_owned() + "\n").collect()
}

#[test]
fn the_screen_of_a_disarmed_mcu_is_the_approved_one() {
    let mcu = Mcu::on_socket(Setup { sensor: true, ..Setup::default() });
    let mut terminal = Terminal::watch(&[&mcu.port]);
    let shown = terminal.wait_until("rates", |shown| shown.contains(", seen ") && shown.contains(" per s"));
    let found = masked(&shown, &mcu.port);
    let path = Path::new(env!("CARGO_MANIFEST_DIR")).join("tests/golden/watch/disarmed.txt");
    if std::env::var_os("GOLDEN").is_some_and(|what| what == "write") {
        std::fs::write(&path, &found).unwrap();
    }
    let expected = std::fs::read_to_string(&path).unwrap_or_default();
    assert!(found == expected, "the screen differs; GOLDEN=write replaces it. Screen:\n{found}\n{shown}");
    terminal.press("q");
    assert_eq!(terminal.end(), 0);
    terminal.assert_restored();
}

#[test]
fn keys_arm_set_step_and_stop() {
    let mcu = Mcu::on_socket(Setup::default());
    let mut terminal = Terminal::watch(&[&mcu.port]);
    terminal.wait_for(" DISARMED ");
    terminal.press("\x1b[A");
    terminal.wait_for("not armed");
    terminal.press("a");
    terminal.wait_for(" ARMED ");
    terminal.press("s300\r");
    terminal.wait_for("armed, target 300.000 V");
    terminal.press("\x1b[A");
    terminal.wait_for("armed, target 310.000 V");
    terminal.press("701\r");
    terminal.wait_for("refused: out of range: expected 0 to 700 V");
    assert!(mcu.wait_for(State::Armed).estimate.to_f64() > 50.0);
    // In an input as well.
    terminal.press("12 ");
    assert_eq!(mcu.wait_for(State::Disarmed).code, 0);
    terminal.wait_for(" DISARMED ");
    terminal.press("?");
    terminal.wait_for("STOP: disarm immediately, in every mode");
    terminal.press("x");
    terminal.press("a");
    mcu.wait_for(State::Armed);
    terminal.press("\x03");
    assert_eq!(terminal.end(), 0);
    assert_eq!(mcu.with(|shared| shared.sample.state), State::Disarmed);
    terminal.assert_restored();
}

/// An MCU from before the notices is asked for its verdict, twice per second.
#[test]
fn a_verdict_is_shown_as_it_comes_with_the_telemetry_or_asked_for() {
    for says_verdict in [true, false] {
        let mcu = Mcu::on_socket(Setup { says_verdict, ..Setup::default() });
        let mut terminal = Terminal::watch(&[&mcu.port]);
        terminal.wait_for(" DISARMED ");
        terminal.wait_until("rates", |shown| shown.contains(" per s"));
        mcu.with(|shared| (shared.isolation.verdict, shared.isolation_asked) = (0x302, 0));
        terminal.wait_for("named time-constant");
        mcu.with(|shared| shared.isolation.verdict = 0x100);
        terminal.wait_for("alarm");
        // Longer than from one request for the status to the next.
        std::thread::sleep(Duration::from_millis(1100));
        assert_eq!(mcu.with(|shared| shared.isolation_asked == 0), says_verdict);
        terminal.press("q");
        assert_eq!(terminal.end(), 0);
    }
}

#[test]
fn a_fault_is_shown_with_its_remedy_and_acknowledged() {
    let mcu = Mcu::on_socket(Setup::default());
    let mut terminal = Terminal::watch(&[&mcu.port]);
    terminal.wait_for(" DISARMED ");
    terminal.press("a");
    terminal.wait_for(" ARMED ");
    mcu.with(|shared| shared.interlock_open = true);
    terminal.wait_for("FAULT interlock (4): close the safety circuit, then k");
    terminal.press("k");
    terminal.wait_for("refused: the interlock is open");
    mcu.with(|shared| shared.interlock_open = false);
    terminal.press("k");
    terminal.wait_until("disarmed, no fault", |shown| shown.contains(" DISARMED ") && !shown.contains("FAULT"));
}

#[test]
fn a_schedule_is_played_and_recorded() {
    let mcu = Mcu::on_socket(Setup { sensor: true, ..Setup::default() });
    let folder = tempfile::tempdir().unwrap();
    let path = |name: &str| folder.path().join(name);
    std::fs::write(path("in.csv"), "time_s,voltage_v\n0,50\n0.6,150\n1.2,150\n").unwrap();
    let (input, out) = (path("in.csv").display().to_string(), path("out.csv").display().to_string());
    let mut terminal = Terminal::watch(&[&mcu.port, "--input", &input, "--record", &out]);
    terminal.wait_for("REC out.csv");
    terminal.press("p");
    terminal.wait_for("not armed: a schedule is played by an armed MCU");
    terminal.press("a");
    // Its state comes with the telemetry.
    terminal.wait_for(" ARMED ");
    terminal.press("p");
    terminal.wait_for("PLAY");
    terminal.wait_for("is over; the target stays");
    assert_eq!(mcu.with(|shared| shared.sample.target.to_f64()), 150.0);
    terminal.press("r");
    terminal.wait_for("out.csv: ");
    terminal.press("r");
    terminal.wait_for("REC out-2.csv");
    terminal.press("q");
    assert_eq!(terminal.end(), 0);
    let shown = terminal.text();
    assert_eq!(shown.matches("wrote ").count(), 2, "{shown}");
    let record = Record::open(&path("out.csv"), MEASURED).unwrap();
    let highest = record.rows.iter().map(|row| row.voltage_v).fold(0.0, f64::max);
    assert!(record.rows.len() > 50 && highest > 150.0, "{} rows, {highest} V", record.rows.len());
    assert!(record.rows.iter().all(|row| row.measured.is_some()));
    assert!(Record::open(&path("out-2.csv"), MEASURED).is_ok());
}

#[test]
fn a_lost_connection_comes_back() {
    let folder = tempfile::tempdir().unwrap();
    let link = folder.path().join("port");
    let first = Mcu::on_socket(Setup::default());
    let connect = |mcu: &Mcu| {
        let socket = PathBuf::from(mcu.port.strip_prefix("unix:").unwrap());
        let _ = std::fs::remove_file(&link);
        std::os::unix::fs::symlink(socket, &link).unwrap();
    };
    connect(&first);
    let mut terminal = Terminal::watch(&[&format!("unix:{}", link.display())]);
    terminal.wait_for("connected");
    terminal.press("a");
    terminal.wait_for(" ARMED ");
    drop(first);
    terminal.wait_for("WAS ARMED  LOST, reconnecting");
    // A stop that cannot be sent is not forgotten.
    terminal.press(" ");
    terminal.wait_for("the MCU is disarmed once it is back");
    let second = Mcu::on_socket(Setup::default());
    connect(&second);
    terminal.wait_for("connected again");
    terminal.wait_for(" DISARMED ");
    let is_disarm = |command: &link::Command| command.arming == Some(model::supervisor::Command::Disarm);
    assert!(second.with(|shared| shared.ordered.iter().any(is_disarm)));
    terminal.press("q");
    assert_eq!(terminal.end(), 0);
}

#[test]
fn another_size_of_the_terminal_is_drawn_anew() {
    let mcu = Mcu::on_socket(Setup::default());
    let mut terminal = Terminal::watch(&[&mcu.port]);
    terminal.wait_for("Applied voltage [V]");
    terminal.resize(12, 40);
    terminal.wait_until("a smaller screen", |shown| !shown.contains("Applied voltage") && shown.contains("space STOP"));
    terminal.resize(40, 120);
    terminal.wait_for("Applied voltage [V]");
    terminal.press("q");
    assert_eq!(terminal.end(), 0);
    terminal.assert_restored();
}

#[test]
fn signals_disarm_and_restore_the_terminal() {
    for (signal, code) in [("-TERM", 143), ("-HUP", 129), ("-INT", 0)] {
        let mcu = Mcu::on_socket(Setup::default());
        let mut terminal = Terminal::watch(&[&mcu.port]);
        terminal.wait_for(" DISARMED ");
        terminal.press("a");
        terminal.wait_for(" ARMED ");
        terminal.signal(signal);
        assert_eq!(terminal.end(), code, "{signal}");
        assert_eq!(mcu.with(|shared| shared.sample.state), State::Disarmed, "{signal}");
        terminal.assert_restored();
    }
}

/// Set where [`a_panic_restores_the_terminal_before_it_prints`] runs itself in a terminal.
const PANICS: &str = "VSJ_TEST_PANICS_ON_A_FULL_SCREEN";

fn panic_on_a_full_screen() {
    let _screen = host_sim::watch::terminal::FullScreen::enter().unwrap();
    std::thread::spawn(|| panic!("for a test")).join().unwrap_err();
    panic!("for a test");
}

#[test]
fn a_panic_restores_the_terminal_before_it_prints() {
    if std::env::var_os(PANICS).is_some() {
        panic_on_a_full_screen();
    }
    let mut command = CommandBuilder::new(std::env::current_exe().unwrap());
    command.args(["--exact", "watch::a_panic_restores_the_terminal_before_it_prints", "--nocapture"]);
    command.env(PANICS, "1");
    let mut terminal = Terminal::start(command);
    assert_ne!(terminal.end(), 0);
    terminal.assert_restored();
    assert!(terminal.text().contains("for a test"), "{}", terminal.text());
}

#[test]
fn a_dumb_terminal_and_a_pipe_get_lines() {
    let mcu = Mcu::on_socket(Setup::default());
    let mut command = CommandBuilder::new(env!("CARGO_BIN_EXE_vsj"));
    command.args(["watch", &mcu.port, "--every", "0.1"]);
    command.env("TERM", "dumb");
    let mut terminal = Terminal::start(command);
    terminal.wait_until("lines", |shown| shown.matches("disarmed").count() > 2);
    assert!(terminal.text().contains("no full screen (TERM=dumb): lines instead"), "{}", terminal.text());
    assert!(!terminal.screen.lock().unwrap().screen().alternate_screen());
    terminal.press("\x03");
    assert_eq!(terminal.end(), 0);

    let watch =
        |arguments: &[&str]| Command::new(env!("CARGO_BIN_EXE_vsj")).arg("watch").args(arguments).output().unwrap();
    let output = watch(&[&mcu.port, "--seconds", "0.5", "--every", "0.1"]);
    let (out, said) = (String::from_utf8(output.stdout).unwrap(), String::from_utf8(output.stderr).unwrap());
    assert!(output.status.success() && said.contains("no full screen (stdout is no terminal)"), "{said}");
    assert!(out.lines().count() > 3 && !out.contains('\x1b'), "{out}");
    for arguments in
        [&["/nonexistent"][..], &[], &[&mcu.port, "--emulated"], &[&mcu.port, "--input", "/nonexistent.csv"]]
    {
        let output = watch(arguments);
        let said = String::from_utf8(output.stderr).unwrap();
        assert_eq!(output.status.code(), Some(2), "{arguments:?}: {said}");
    }
}

/// Runs `vsj watch --emulated` with nothing but the programs of `folder` on the path; returns what it says.
fn emulated(folder: &Path, working: &Path) -> String {
    let mut command = Command::new(env!("CARGO_BIN_EXE_vsj"));
    let output =
        command.args(["watch", "--emulated", "--lines"]).env("PATH", folder).current_dir(working).output().unwrap();
    let said = String::from_utf8(output.stderr).unwrap();
    assert_eq!((output.status.code(), said.lines().count()), (Some(1), 1), "{said}");
    said
}

/// The emulator is a program that writes its number and stays, and the link a socket that never answers.
#[cfg(target_os = "linux")]
#[test]
fn an_emulated_board_ends_with_the_program_whatever_ends_it() {
    use std::os::unix::fs::PermissionsExt;
    let folder = tempfile::tempdir().unwrap();
    let (program, number) = (folder.path().join("qemu-system-arm"), folder.path().join("number"));
    let _socket = std::os::unix::net::UnixListener::bind(folder.path().join("socket")).unwrap();
    let script = format!(
        "#!/bin/sh\n[ \"$1\" = --version ] && exit\necho $$ > {}\nln -s {} link\nexec sleep 1000\n",
        number.display(),
        folder.path().join("socket").display()
    );
    std::fs::write(&program, script).unwrap();
    std::fs::set_permissions(&program, std::fs::Permissions::from_mode(0o755)).unwrap();
    let mut command = Command::new(env!("CARGO_BIN_EXE_vsj"));
    command.args(["watch", "--emulated", "--lines", "--timeout", "60", "--firmware"]).arg(&program);
    command.env("PATH", format!("{}:{}", folder.path().display(), std::env::var("PATH").unwrap()));
    let mut vsj = command.stdout(Stdio::null()).stderr(Stdio::null()).spawn().unwrap();
    let wait_for = |what: &str, is: &dyn Fn() -> bool| {
        let begin = Instant::now();
        while !is() {
            assert!(begin.elapsed() < Duration::from_secs(30), "{what}");
            std::thread::sleep(Duration::from_millis(10));
        }
    };
    let read = || std::fs::read_to_string(&number).unwrap_or_default();
    wait_for("it starts", &|| read().ends_with('\n'));
    let stat = format!("/proc/{}/stat", read().trim());
    assert!(Path::new(&stat).exists());
    // SIGKILL, which no program can handle.
    vsj.kill().unwrap();
    vsj.wait().unwrap();
    // One that nobody has waited for is dead, too.
    wait_for("it ends", &|| std::fs::read_to_string(&stat).map_or(true, |text| text.contains(") Z ")));
}

#[test]
fn a_missing_emulator_or_target_is_named_with_the_command_that_installs_it() {
    use std::os::unix::fs::PermissionsExt;
    let folder = tempfile::tempdir().unwrap();
    let sources = Path::new(env!("CARGO_MANIFEST_DIR"));
    let said = emulated(folder.path(), sources);
    assert!(
        said.contains("qemu-system-arm is not installed; install it: sudo apt-get install qemu-system-arm"),
        "{said}"
    );
    for program in ["qemu-system-arm", "rustc"] {
        let path = folder.path().join(program);
        std::fs::write(&path, "#!/bin/sh\necho /nonexistent\n").unwrap();
        std::fs::set_permissions(&path, std::fs::Permissions::from_mode(0o755)).unwrap();
    }
    let said = emulated(folder.path(), sources);
    assert!(said.contains("install it: rustup target add thumbv7em-none-eabihf"), "{said}");
}
