//! An MCU in the test process: the firmware's control loop behind [`link::Session`], on a socket or a pseudo-terminal, with
//! a line that can be bad.

use std::fs::File;
use std::io::{ErrorKind, Read, Write};
use std::os::unix::net::UnixListener;
use std::path::PathBuf;
use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::{Arc, Mutex};
use std::thread::JoinHandle;
use std::time::{Duration, Instant};

use firmware::control::{Control, Orders, Senses, Untimed};
use link::reply::Firmware;
use link::session::Counters;
use link::{Action, Fault, Order, Reason, Reply, Request, Session, State, Status, Telemetry};
use model::stiffness::{Cantilever, YoungsModulus};
use model::{Settings, Spring, supervisor};
use serialport::{SerialPort, TTYPort};

/// What goes wrong, and what it is.
#[derive(Clone, Copy, Debug, Default)]
pub(crate) struct Setup {
    /// One in so many bytes arrives with a flipped bit, in both directions.
    pub(crate) damage_one_in: Option<u32>,
    /// There is a stiffness sensor.
    pub(crate) sensor: bool,
    /// It hangs up after so many ticks.
    pub(crate) hang_up_after: Option<u64>,
}

/// What the test can see and do while the MCU runs.
#[derive(Default)]
pub(crate) struct Shared {
    /// Requests that were applied.
    pub(crate) applied: Vec<Request>,
    /// The latest sample.
    pub(crate) sample: Telemetry,
    /// What came over the link.
    pub(crate) counters: Counters,
    /// The interlock is open.
    pub(crate) interlock_open: bool,
    /// Restart at the next tick.
    pub(crate) restart: bool,
}

/// A running MCU; it ends with the test.
pub(crate) struct Mcu {
    /// For `vsj link`.
    pub(crate) port: String,
    pub(crate) shared: Arc<Mutex<Shared>>,
    stop: Arc<AtomicBool>,
    thread: Option<JoinHandle<()>>,
    _folder: Option<tempfile::TempDir>,
    /// A pseudo-terminal that nobody holds open hangs up.
    _terminal: Option<File>,
}

const POLL: Duration = Duration::from_micros(500);

impl Mcu {
    /// On a unix socket; one host at a time.
    pub(crate) fn on_socket(setup: Setup) -> Self {
        let folder = tempfile::tempdir().unwrap();
        let path: PathBuf = folder.path().join("mcu");
        let listener = UnixListener::bind(&path).unwrap();
        listener.set_nonblocking(true).unwrap();
        let mut mcu = Self::new(format!("unix:{}", path.display()));
        mcu._folder = Some(folder);
        let mut stream = None;
        mcu.run(setup, move |bytes, out| {
            if stream.is_none()
                && let Ok((accepted, _)) = listener.accept()
            {
                accepted.set_read_timeout(Some(POLL)).unwrap();
                stream = Some(accepted);
            }
            let Some(connected) = &mut stream else {
                std::thread::sleep(POLL);
                return 0;
            };
            if out.is_none() || connected.write_all(out.unwrap()).is_err() {
                stream = None;
                return 0;
            }
            match connected.read(bytes) {
                Ok(0) => {
                    stream = None;
                    0
                }
                Ok(count) => count,
                Err(_) => 0,
            }
        });
        mcu
    }

    /// On a pseudo-terminal.
    pub(crate) fn on_terminal(setup: Setup) -> Self {
        let (mut master, slave) = TTYPort::pair().unwrap();
        master.set_timeout(POLL).unwrap();
        let mut mcu = Self::new(slave.name().unwrap());
        // Instead of `slave`, which is locked against others.
        mcu._terminal = Some(File::options().read(true).write(true).open(&mcu.port).unwrap());
        drop(slave);
        mcu.run(setup, move |bytes, out| {
            if let Some(out) = out
                && !out.is_empty()
            {
                master.write_all(out).unwrap();
            }
            match master.read(bytes) {
                Ok(count) => count,
                Err(error) => {
                    assert_eq!(error.kind(), ErrorKind::TimedOut, "{error}");
                    0
                }
            }
        });
        mcu
    }

    fn new(port: String) -> Self {
        let (shared, stop) = Default::default();
        Self { port, shared, stop, thread: None, _folder: None, _terminal: None }
    }

    /// Looks at the MCU, or does something to it.
    pub(crate) fn with<T>(&self, look: impl FnOnce(&mut Shared) -> T) -> T {
        look(&mut self.shared.lock().unwrap())
    }

    /// Waits until the MCU is in `state`.
    pub(crate) fn wait_for(&self, state: State) -> Telemetry {
        let start = Instant::now();
        while start.elapsed() < Duration::from_secs(10) {
            let sample = self.with(|shared| shared.sample);
            if sample.state == state {
                return sample;
            }
            std::thread::sleep(Duration::from_millis(2));
        }
        panic!("never {state}: {:?}", self.with(|shared| shared.sample));
    }

    /// `exchange` sends its second argument (`None` hangs up) and reads into its first.
    fn run(&mut self, setup: Setup, mut exchange: impl FnMut(&mut [u8], Option<&[u8]>) -> usize + Send + 'static) {
        let (shared, stop) = (self.shared.clone(), self.stop.clone());
        self.thread = Some(std::thread::spawn(move || {
            let mut noise = Noise { one_in: setup.damage_one_in, state: 0x2545_F491_4F6C_DD1D };
            let mut chip = Chip::new(setup, shared);
            let mut start = Instant::now();
            let mut out = Vec::new();
            while !stop.load(Ordering::Relaxed) {
                noise.spoil(&mut out);
                let mut bytes = [0; 256];
                let hung_up = setup.hang_up_after.is_some_and(|ticks| chip.tick > ticks);
                let count = exchange(&mut bytes, (!hung_up).then_some(&out));
                out.clear();
                noise.spoil(&mut bytes[..count]);
                if std::mem::take(&mut chip.shared.lock().unwrap().restart) {
                    (chip, start) = (Chip::new(setup, chip.shared), Instant::now());
                }
                while u128::from(chip.tick) < start.elapsed().as_millis() {
                    chip.tick(Orders::default());
                }
                for byte in &bytes[..count] {
                    chip.hear(*byte, &mut out);
                }
                if chip.session.telemetry_due(chip.tick) {
                    out.extend_from_slice(chip.session.telemetry(chip.sample, chip.tick));
                }
            }
        }));
    }
}

impl Drop for Mcu {
    fn drop(&mut self) {
        self.stop.store(true, Ordering::Relaxed);
        let ended = self.thread.take().unwrap().join();
        assert!(ended.is_ok() || std::thread::panicking(), "the MCU panicked");
    }
}

/// The MCU's program.
struct Chip {
    setup: Setup,
    shared: Arc<Mutex<Shared>>,
    session: Session,
    control: Control,
    spring: Spring,
    tick: u64,
    sample: Telemetry,
}

impl Chip {
    fn new(setup: Setup, shared: Arc<Mutex<Shared>>) -> Self {
        let control = Control::new(&Settings::PAPER, &supervisor::Settings::DEFAULT, None).unwrap();
        let spring = Spring::new(YoungsModulus::PAPER, Cantilever::PAPER, 0.0, 700.0).unwrap();
        let mut chip =
            Self { setup, shared, session: Session::new(500), control, spring, tick: 0, sample: Telemetry::default() };
        chip.tick(Orders::default());
        chip
    }

    fn tick(&mut self, orders: Orders) {
        let heard = self.session.silent_ticks(self.tick) == Some(0);
        let interlock_closed = !self.shared.lock().unwrap().interlock_open;
        let senses = Senses { interlock_closed, ..Senses::default() };
        let tick = self.control.tick(&Orders { heard: heard || orders.heard, ..orders }, &senses, &mut Untimed);
        self.tick += 1;
        self.sample = Telemetry {
            tick: self.tick,
            state: self.control.supervisor().into(),
            target: tick.output.target.into(),
            applied: tick.output.applied.into(),
            estimate: tick.output.stiffness.into(),
            measured: self.setup.sensor.then_some(tick.output.stiffness.into()),
            code: tick.drive.code().0,
            limits: self.control.supervisor().limits(&tick.output).bits(),
        };
        let mut shared = self.shared.lock().unwrap();
        (shared.sample, shared.counters) = (self.sample, self.session.counters());
    }

    fn hear(&mut self, byte: u8, out: &mut Vec<u8>) {
        match self.session.on_byte(byte, self.tick) {
            Some(Action::Apply(request)) => {
                let reply = self.apply(request);
                out.extend_from_slice(self.session.answer(&reply));
            }
            Some(Action::Send(bytes)) => out.extend_from_slice(bytes),
            None => {}
        }
    }

    fn apply(&mut self, request: Request) -> Reply {
        self.shared.lock().unwrap().applied.push(request);
        if matches!(request, Request::Hello | Request::Status) {
            return Reply::Status(self.status());
        }
        match Order::new(request, self.control.supervisor().state(), &self.spring) {
            Err(reason) => Reply::Refused(reason),
            Ok(Order { command, target }) => {
                self.tick(Orders { heard: true, command, target });
                match self.control.supervisor().refusal() {
                    Some(refusal) => Reply::Refused(Reason::of_refusal(refusal, self.fault())),
                    None => Reply::Ack { state: self.sample.state, target: self.sample.target },
                }
            }
        }
    }

    fn fault(&self) -> Fault {
        match self.control.supervisor().state() {
            supervisor::State::Faulted(fault) => fault.into(),
            _ => Fault::NONE,
        }
    }

    fn status(&self) -> Status {
        Status {
            firmware: Firmware { major: 0, minor: 1, patch: 0, revision: 0xabcd },
            rate_hz: 1000,
            silence_limit_ticks: self.session.silence_limit_ticks(),
            overruns: 0,
            fault: self.fault(),
            last_fault: Fault::NONE,
            sample: self.sample,
            counters: self.session.counters(),
        }
    }
}

/// A bad line, always bad in the same way.
struct Noise {
    one_in: Option<u32>,
    state: u64,
}

impl Noise {
    fn spoil(&mut self, bytes: &mut [u8]) {
        let Some(one_in) = self.one_in else { return };
        for byte in bytes {
            // xorshift
            self.state ^= self.state << 13;
            self.state ^= self.state >> 7;
            self.state ^= self.state << 17;
            if (self.state >> 8).is_multiple_of(u64::from(one_in)) {
                *byte ^= 1 << (self.state & 7);
            }
        }
    }
}
