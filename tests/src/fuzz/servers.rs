//! The MCU's end of the link with its control tick, store and capture.

use std::sync::atomic::AtomicU32;

use firmware::capture::Recorder;
use firmware::control::{Control, Sensors, Untimed};
use firmware::reset_cause::Cause;
use firmware::store::{Memory, Store};
use firmware::{start, update};
use link::{About, Block, Command, Frame, Message, Receiver, Reply, Sequence, Server, Step, View};
use model::stiffness::{Cantilever, YoungsModulus};
use model::supervisor::{Fault, Faults, State};
use model::{Spring, device};
use serde::ser::SerializeTuple;
use serde::{Deserialize, Deserializer, Serialize, Serializer};

/// Rows for which the capture has room.
const ROWS: usize = 32;
/// Longest message; a larger first byte of an input's part stands for a tick.
const LONGEST: u8 = 40;

/// Messages and ticks: a first byte of at most [`LONGEST`] is followed by as many bytes of a request, which a host sends in its
/// session; any other by the inputs of a tick. Each request is answered, nothing is driven but while armed, and only an MCU without a
/// voltage is updated or restarted.
pub(super) fn server(bytes: &[u8]) {
    let mut chip = Chip::new(Store::new(Memory::default()));
    let mut left = bytes;
    while let Some((&first, rest)) = left.split_first() {
        let length = if first <= LONGEST { usize::from(first) } else { 2 };
        let (part, rest) = rest.split_at(length.min(rest.len()));
        left = rest;
        match (first, part) {
            (0..=LONGEST, message) => chip.exchange(&Raw(message.to_vec())),
            (_, &[inputs, faults]) => chip.disturb(inputs, faults),
            _ => {}
        }
    }
}

/// Bytes in the place of a request.
struct Raw(Vec<u8>);

impl Serialize for Raw {
    fn serialize<S: Serializer>(&self, serializer: S) -> Result<S::Ok, S::Error> {
        let mut bytes = serializer.serialize_tuple(self.0.len())?;
        self.0.iter().try_for_each(|byte| bytes.serialize_element(byte))?;
        bytes.end()
    }
}

impl<'de> Deserialize<'de> for Raw {
    fn deserialize<D: Deserializer<'de>>(_: D) -> Result<Self, D::Error> {
        Err(serde::de::Error::custom("only sent"))
    }
}

impl Message for Raw {
    const KIND: u8 = <link::Request as Message>::KIND;
}

struct Chip {
    server: Server,
    control: Control,
    store: Store<Memory>,
    settings: device::Settings,
    recorder: Recorder,
    memory: [AtomicU32; 2 * ROWS],
    sensors: Sensors,
    view: View,
    sequence: Sequence,
    session: link::Nonce,
}

impl Chip {
    fn new(store: Store<Memory>) -> Self {
        let built_in = device::Settings::PAPER;
        let loaded = start::load(&store, &built_in);
        let cause = Cause { name: "power-on", fault: None, standing: Faults::NONE };
        let mut place = None;
        let stored = store.newest(Block::Model);
        let (_, start) = start::control(&loaded, stored, &cause, &mut place).expect("what is stored was checked");
        assert!(loaded.rejected.is_none() && start.rejected.is_none(), "what is stored was checked");
        let mut control = place.expect("it was built");
        let (lowest_v, highest_v) = (start.amplifier.min_v, start.amplifier.max_v);
        let spring = Spring::new(YoungsModulus::PAPER, Cantilever::PAPER, lowest_v, highest_v).expect("a valid range");
        let rate_hz = loaded.settings.rate_hz();
        let about =
            About { rate_hz, silence_limit_ticks: 50, model: start.model, settings: loaded.blocks, ..About::default() };
        let sensors = Sensors { interlock_closed: true, ..Sensors::default() };
        let tick = control.tick(&Command::default(), &sensors, &mut Untimed);
        Self {
            server: Server::new(spring, about),
            view: tick.view(1, control.supervisor(), 0),
            control,
            store,
            settings: loaded.settings,
            recorder: Recorder::new(),
            memory: std::array::from_fn(|_| AtomicU32::new(0)),
            sensors,
            sequence: Sequence(0),
            session: link::Nonce::NONE,
        }
    }

    /// A tick; every report of a fault is sent, and a sample that is due.
    fn tick(&mut self, command: Command) {
        let heard = self.server.take_heard() || command.heard;
        let tick = self.control.tick(&Command { heard, ..command }, &self.sensors, &mut Untimed);
        let supervisor = self.control.supervisor();
        assert_eq!(tick.drive.enabled(), supervisor.state() == State::Armed, "{:?}", supervisor.state());
        self.view = tick.view(self.view.sample.tick + 1, supervisor, self.view.overruns);
        self.recorder.tick(&self.memory, &self.view.sample, self.view.overruns);
        let mut reports = 0;
        while self.server.fault(&self.view).is_some() {
            reports += 1;
        }
        assert!(reports <= Fault::ALL.len(), "{reports} reports after one tick");
        let _ = self.server.telemetry(&self.view);
    }

    /// Up to 256 ticks with an interlock and faults of its own in the first.
    fn disturb(&mut self, inputs: u8, faults: u8) {
        self.sensors.interlock_closed = inputs & 1 == 0;
        self.sensors.faults = Faults::from_bits(u16::from(faults) << (inputs >> 1 & 3));
        self.tick(Command::default());
        self.sensors.faults = Faults::NONE;
        (0..inputs >> 3).for_each(|_| self.tick(Command::default()));
    }

    fn exchange(&mut self, message: &Raw) {
        self.sequence = self.sequence.next();
        // A Hello is sent without a session, as by a host.
        let session = if message.0 == [0] { link::Nonce::NONE } else { self.session };
        let frame = Frame::new(session.stamp(self.sequence), message);
        let mut answered = false;
        for &byte in frame.as_bytes() {
            answered |= self.hear(byte);
        }
        assert!(answered, "no answer to {:?}", message.0);
    }

    /// Returns true if a byte is answered.
    fn hear(&mut self, byte: u8) -> bool {
        let before = self.view;
        let has_voltage = before.state == State::Armed;
        let answer = match self.server.on_byte(byte, &before) {
            None => return false,
            Some(Step::Send(bytes)) => bytes,
            Some(Step::Restart(bytes)) => {
                assert!(!has_voltage && !bytes.is_empty());
                *self = Self::new(Store::new(self.store.pages().clone()));
                return true;
            }
            Some(Step::Command(command)) => {
                self.tick(Command { heard: true, ..command });
                self.server.command_done(&self.view)
            }
            Some(Step::Update(block, update)) => {
                assert!(!has_voltage, "an update while armed");
                let kept = update::execute(&mut self.store, block, update, &device::Settings::PAPER);
                self.server.updated(block, kept, &before)
            }
            Some(Step::ReadSettings { built_in, number }) => {
                let settings = if built_in { &device::Settings::PAPER } else { &self.settings };
                self.server.settings_part(update::settings_part(settings, number))
            }
            Some(Step::Capture(request)) => self.server.answered(&self.recorder.execute(&self.memory, request)),
            Some(Step::Isolation(_)) => self.server.answered(&Reply::Isolation(Default::default())),
            Some(Step::Adaptation(_)) => self.server.answered(&Reply::Adaptation(Default::default())),
        };
        let mut receiver = Receiver::new();
        let packets = answer.iter().filter_map(|&byte| {
            let packet = receiver.on_byte(byte)?;
            packet.read::<Reply>().expect("an answer is a reply");
            Some(packet.session())
        });
        if let Some(session) = packets.last() {
            self.session = session;
        }
        !answer.is_empty()
    }
}
