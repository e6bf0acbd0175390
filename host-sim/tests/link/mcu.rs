//! An MCU in the test process: the firmware's control loop behind [`link::Server`], on a socket or a pseudo-terminal, with
//! a line that can be bad.

use std::fs::File;
use std::io::{ErrorKind, Read, Write};
use std::os::unix::net::UnixListener;
use std::path::PathBuf;
use std::sync::atomic::{AtomicBool, AtomicU32, Ordering};
use std::sync::{Arc, Mutex};
use std::thread::JoinHandle;
use std::time::{Duration, Instant};

use firmware::capture::Recorder;
use firmware::control::{Control, Sensors, Untimed};
use firmware::reset_cause::Cause;
use firmware::start::{self, Start};
use firmware::store::{Memory, Store};
use firmware::update;
use link::isolation::{Isolation, Off};
use link::reply::Firmware;
use link::session::Counters;
use link::{
    About, AdaptationReport, Block, BrownOut, Command, Controller, Fault, IsolationReport, Notice, Packet, Reason,
    Receiver, Reply, Server, State, Step, Telemetry, View,
};
use model::adaptation::Phase;
use model::stiffness::{Cantilever, YoungsModulus};
use model::{Spring, device, supervisor};
use random_numbers::Xorshift64;
use serialport::{SerialPort, TTYPort};

/// Properties of the MCU and its line.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Setup {
    /// Bits are flipped in one of this number of bytes, in both directions.
    pub(crate) damage_one_in: Option<u32>,
    /// True if there is a stiffness sensor.
    pub(crate) sensor: bool,
    /// The connection closes after this number of ticks.
    pub(crate) hang_up_after: Option<u64>,
    /// Longest allowed silence of the host, in ms.
    pub(crate) silence_ms: u32,
    /// True if a restart erases the stored models.
    pub(crate) forgets: bool,
    /// Width of the converter.
    pub(crate) dac_bits: u32,
    /// True if the verdict of the isolation bank comes with the telemetry.
    pub(crate) says_verdict: bool,
    /// Level of the brown-out reset.
    pub(crate) brown_out: Option<BrownOut>,
    /// True if the MCU's program is from before the requests for the isolation bank, the adaptation and the brown-out level.
    pub(crate) is_older: bool,
    /// Nothing that the MCU sends arrives any more, see [`Shared::mute`], as soon as this is true of a sample.
    pub(crate) mute_when: fn(&Telemetry) -> bool,
}

impl Default for Setup {
    fn default() -> Self {
        // Longer than a busy machine needs to start one command after another.
        Self {
            damage_one_in: None,
            sensor: false,
            hang_up_after: None,
            silence_ms: 5000,
            forgets: false,
            dac_bits: 12,
            says_verdict: true,
            brown_out: None,
            is_older: false,
            mute_when: |_| false,
        }
    }
}

/// State of the MCU that the test can read and change while it runs.
#[derive(Default)]
pub(crate) struct Shared {
    /// What reached the control tick.
    pub(crate) ordered: Vec<Command>,
    /// The latest sample.
    pub(crate) sample: Telemetry,
    /// The first sample, and each one whose state differs from that of the sample before.
    pub(crate) changes: Vec<Telemetry>,
    /// Tick in which the host was heard last.
    pub(crate) heard: u64,
    /// Time by which the MCU's clock is ahead of the host's.
    pub(crate) ahead: Duration,
    /// Counters of received frames.
    pub(crate) counters: Counters,
    /// What the isolation bank says.
    pub(crate) isolation: IsolationReport,
    /// Number of requests for it.
    pub(crate) isolation_asked: u32,
    /// What the adaptation does.
    pub(crate) adaptation: AdaptationReport,
    /// True if the interlock is open.
    pub(crate) interlock_open: bool,
    /// Fault that another part of the program finds in the next tick.
    pub(crate) fault: Option<supervisor::Fault>,
    /// True if nothing that the MCU sends arrives.
    pub(crate) mute: bool,
    /// True if the MCU is to restart at the next tick.
    pub(crate) restart: bool,
    /// Seed of the nonces since the last start.
    pub(crate) seed: u32,
    /// Memory that survives a restart.
    pub(crate) flash: Memory,
}

/// A running MCU, stopped when dropped.
pub(crate) struct Mcu {
    /// Name of the port for `vsj link`.
    pub(crate) port: String,
    pub(crate) shared: Arc<Mutex<Shared>>,
    stop: Arc<AtomicBool>,
    thread: Option<JoinHandle<()>>,
    _folder: Option<tempfile::TempDir>,
    /// Keeps the pseudo-terminal open; it hangs up when nobody holds it.
    _terminal: Option<File>,
}

/// A seed that no other start has.
fn next_seed() -> u32 {
    static SEED: AtomicU32 = AtomicU32::new(0);
    SEED.fetch_add(1 << 20, Ordering::Relaxed)
}

/// What the image has built in, whatever features this build has.
const BUILT_IN: device::Settings = device::Settings::PAPER;
/// Rows for which the MCU has room.
pub(crate) const ROWS: usize = 2000;

const POLL: Duration = Duration::from_micros(500);

impl Mcu {
    /// Runs on a unix socket, for one host at a time.
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

    /// Runs on a pseudo-terminal.
    pub(crate) fn on_terminal(setup: Setup) -> Self {
        let (mut master, slave) = TTYPort::pair().unwrap();
        master.set_timeout(POLL).unwrap();
        let mut mcu = Self::new(slave.name().unwrap());
        // In place of `slave`, which is locked against other programs.
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
        let stop = Arc::default();
        let adaptation = AdaptationReport::off(Off::NotBuiltIn, 0);
        let shared = Arc::new(Mutex::new(Shared { seed: next_seed(), adaptation, ..Shared::default() }));
        Self { port, shared, stop, thread: None, _folder: None, _terminal: None }
    }

    /// Reads or changes the state of the MCU.
    pub(crate) fn with<T>(&self, look: impl FnOnce(&mut Shared) -> T) -> T {
        look(&mut self.shared.lock().unwrap())
    }

    /// Waits until the MCU is in `state`, at most 10 s.
    pub(crate) fn wait_for(&self, state: State) -> Telemetry {
        self.wait_until(&state.to_string(), |sample| sample.state == state)
    }

    /// Waits until the MCU has this target in V, at most 10 s.
    pub(crate) fn wait_for_target(&self, volts: f64) -> Telemetry {
        self.wait_until(&format!("at {volts} V"), |sample| sample.target.to_f64() == volts)
    }

    fn wait_until(&self, what: &str, reached: impl Fn(&Telemetry) -> bool) -> Telemetry {
        let start = Instant::now();
        while start.elapsed() < Duration::from_secs(10) {
            let sample = self.with(|shared| shared.sample);
            if reached(&sample) {
                return sample;
            }
            std::thread::sleep(Duration::from_millis(2));
        }
        panic!("never {what}: {:?}", self.with(|shared| shared.sample));
    }

    /// `exchange` sends its second argument (`None` hangs up) and reads into its first.
    fn run(&mut self, setup: Setup, mut exchange: impl FnMut(&mut [u8], Option<&[u8]>) -> usize + Send + 'static) {
        let (shared, stop) = (self.shared.clone(), self.stop.clone());
        self.thread = Some(std::thread::spawn(move || {
            let mut noise = Noise { one_in: setup.damage_one_in, numbers: Xorshift64::new(0x2545_F491_4F6C_DD1D) };
            let mut chip = Chip::new(setup, shared);
            let mut start = Instant::now();
            let mut out = Vec::new();
            while !stop.load(Ordering::Relaxed) {
                if chip.shared.lock().unwrap().mute {
                    out.clear();
                }
                noise.spoil(&mut out);
                let mut bytes = [0; 256];
                let hung_up = setup.hang_up_after.is_some_and(|ticks| chip.view.sample.tick > ticks);
                let count = exchange(&mut bytes, (!hung_up).then_some(&out));
                out.clear();
                noise.spoil(&mut bytes[..count]);
                if std::mem::take(&mut chip.shared.lock().unwrap().restart) {
                    chip.shared.lock().unwrap().seed = next_seed();
                    (chip, start) = (Chip::new(setup, chip.shared), Instant::now());
                }
                let now = start.elapsed() + chip.shared.lock().unwrap().ahead;
                while chip.view.sample.tick as f64 * chip.period.as_secs_f64() < now.as_secs_f64() {
                    chip.tick(Command::default());
                }
                for byte in &bytes[..count] {
                    chip.hear(*byte, &mut out);
                }
                chip.report_faults(&mut out);
                out.extend_from_slice(chip.server.telemetry(&chip.view).unwrap_or_default());
                chip.send_verdict(&mut out);
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

/// Answer to a request that the program does not know.
const UNKNOWN: Reply = Reply::Refused(Reason::UnknownRequest);

/// True if the bytes of an answer say the level of the brown-out reset.
fn says_brown_out(bytes: &[u8]) -> bool {
    let mut receiver = Receiver::new();
    let says = |&byte: &u8| {
        let packet = receiver.on_byte(byte);
        packet.is_some_and(|packet| matches!(Packet::read::<Reply>(&packet), Ok(Reply::BrownOut(_))))
    };
    bytes.iter().any(says)
}

/// The program of the MCU.
struct Chip {
    setup: Setup,
    shared: Arc<Mutex<Shared>>,
    server: Server,
    control: Control,
    store: Store<Memory>,
    view: View,
    settings: device::Settings,
    recorder: Recorder,
    memory: Vec<AtomicU32>,
    /// Time between two ticks.
    period: Duration,
}

impl Chip {
    fn new(setup: Setup, shared: Arc<Mutex<Shared>>) -> Self {
        let store = Store::new(shared.lock().unwrap().flash.clone());
        let mut loaded = start::load(&store, &BUILT_IN);
        loaded.settings.control.amplifier.dac_bits = setup.dac_bits;
        let settings = loaded.settings;
        loaded.settings.supervision.host_timeout_s = f64::from(setup.silence_ms) / 1000.0;
        let cause = Cause { name: "power-on", fault: None, standing: supervisor::Faults::NONE };
        let mut place = None;
        let (_, start) = start::control(&loaded, store.newest(Block::Model), &cause, &mut place).unwrap();
        let control = place.unwrap();
        let Start { amplifier, model, .. } = start;
        let blocks = loaded.blocks;
        let controller = Controller::of(&settings.control.compensation);
        let spring = Spring::new(YoungsModulus::PAPER, Cantilever::PAPER, amplifier.min_v, amplifier.max_v).unwrap();
        let about = About {
            firmware: Firmware { major: 0, minor: 1, patch: 0, revision: 0xabcd, controller },
            rate_hz: settings.rate_hz(),
            silence_limit_ticks: setup.silence_ms * settings.rate_hz() / 1000,
            last_fault: Fault::NONE,
            model,
            settings: blocks,
            brown_out: setup.brown_out,
            seed: shared.lock().unwrap().seed,
        };
        let server = Server::new(spring, about);
        let (state, standing) = (supervisor::State::Disarmed, supervisor::Faults::NONE);
        let view = View { sample: Telemetry::default(), state, standing, refusal: None, overruns: 0 };
        let period = Duration::from_secs(1) / settings.rate_hz();
        let memory = (0..2 * ROWS).map(|_| AtomicU32::new(0)).collect();
        let mut chip =
            Self { setup, shared, server, control, store, view, settings, recorder: Recorder::new(), memory, period };
        chip.tick(Command::default());
        chip
    }

    fn tick(&mut self, command: Command) {
        let heard = self.server.take_heard() || command.heard;
        let (interlock_closed, faults) = {
            let mut shared = self.shared.lock().unwrap();
            (!shared.interlock_open, shared.fault.take().into_iter().collect())
        };
        let sensors = Sensors { interlock_closed, faults, ..Sensors::default() };
        let tick = self.control.tick(&Command { heard, ..command }, &sensors, &mut Untimed);
        let supervisor = self.control.supervisor();
        let sample = Telemetry {
            tick: self.view.sample.tick + 1,
            state: supervisor.into(),
            target: tick.output.target.into(),
            applied: tick.output.applied.into(),
            estimate: tick.output.stiffness.into(),
            measured: self.setup.sensor.then_some(tick.output.stiffness.into()),
            code: tick.drive.code().0,
            limits: supervisor.limits(&tick.output).bits(),
            mismatch: supervisor.mismatch().into(),
            sensor: link::Sensor(u8::from(self.setup.sensor)),
        };
        self.recorder.tick(&self.memory, &sample, 0);
        let mut shared = self.shared.lock().unwrap();
        if shared.changes.last().is_none_or(|last| last.state != sample.state) {
            shared.changes.push(sample);
        }
        shared.mute |= (self.setup.mute_when)(&sample) && !(self.setup.mute_when)(&self.view.sample);
        if heard {
            shared.heard = sample.tick;
        }
        (shared.sample, shared.counters) = (sample, self.server.counters());
        let (state, standing) = (supervisor.state(), supervisor.standing());
        self.view = View { sample, state, standing, refusal: supervisor.refusal(), overruns: 0 };
    }

    fn report_faults(&mut self, out: &mut Vec<u8>) {
        while let Some(bytes) = self.server.fault(&self.view) {
            out.extend_from_slice(bytes);
        }
    }

    /// Sends what the bank says with the telemetry, unless the MCU's program is from before that.
    fn send_verdict(&mut self, out: &mut Vec<u8>) {
        let report = IsolationReport { tick: self.view.sample.tick, ..self.shared.lock().unwrap().isolation };
        if self.setup.says_verdict && self.server.verdict_due(report.verdict, &self.view) {
            out.extend_from_slice(self.server.verdict(report.verdict, &Notice::Isolation(report), &self.view));
        }
    }

    fn hear(&mut self, byte: u8, out: &mut Vec<u8>) {
        match self.server.on_byte(byte, &self.view) {
            Some(Step::Command(command)) => {
                self.shared.lock().unwrap().ordered.push(command);
                self.tick(Command { heard: true, ..command });
                self.report_faults(out);
                out.extend_from_slice(self.server.command_done(&self.view));
            }
            Some(Step::Send(bytes)) => {
                let is_unknown = self.setup.is_older && says_brown_out(bytes);
                out.extend_from_slice(if is_unknown { self.server.answered(&UNKNOWN) } else { bytes });
            }
            Some(Step::Isolation(_) | Step::Adaptation(_)) if self.setup.is_older => {
                out.extend_from_slice(self.server.answered(&UNKNOWN));
            }
            Some(Step::Update(block, update)) => {
                let kept = update::execute(&mut self.store, block, update, &BUILT_IN);
                out.extend_from_slice(self.server.updated(block, kept, &self.view));
            }
            Some(Step::ReadSettings { built_in, number }) => {
                let settings = if built_in { &BUILT_IN } else { &self.settings };
                out.extend_from_slice(self.server.settings_part(update::settings_part(settings, number)));
            }
            Some(Step::Capture(request)) => {
                let reply = self.recorder.execute(&self.memory, request);
                out.extend_from_slice(self.server.answered(&reply));
            }
            Some(Step::Isolation(request)) => {
                let mut shared = self.shared.lock().unwrap();
                shared.isolation_asked += 1;
                if request == Isolation::Acknowledge {
                    shared.isolation = IsolationReport::default();
                }
                let reply = Reply::Isolation(IsolationReport { tick: self.view.sample.tick, ..shared.isolation });
                drop(shared);
                out.extend_from_slice(self.server.answered(&reply));
            }
            Some(Step::Adaptation(request)) => {
                let mut shared = self.shared.lock().unwrap();
                if let Some(on) = request.switch()
                    && shared.adaptation.phase().is_some()
                {
                    shared.adaptation.phase = if on { Phase::Watching } else { Phase::Returning } as u8;
                }
                let reply = Reply::Adaptation(AdaptationReport { tick: self.view.sample.tick, ..shared.adaptation });
                drop(shared);
                out.extend_from_slice(self.server.answered(&reply));
            }
            Some(Step::Restart(bytes)) => {
                out.extend_from_slice(bytes);
                let mut shared = self.shared.lock().unwrap();
                shared.restart = true;
                shared.flash = if self.setup.forgets { Memory::default() } else { self.store.pages().clone() };
            }
            None => {}
        }
    }
}

/// Damage on the line, the same in every run.
struct Noise {
    one_in: Option<u32>,
    numbers: Xorshift64,
}

impl Noise {
    fn spoil(&mut self, bytes: &mut [u8]) {
        let Some(one_in) = self.one_in else { return };
        for byte in bytes {
            let drawn = self.numbers.draw();
            if (drawn >> 8).is_multiple_of(u64::from(one_in)) {
                *byte ^= 1 << (drawn & 7);
            }
        }
    }
}
