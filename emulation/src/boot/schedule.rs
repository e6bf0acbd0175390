//! What a host at the serial line sends in each run, and when, and what the chip has stored before.

use anyhow::{Context, Result};
use firmware::settings::{WATCHDOG_MS, built_in};
use firmware::store::{Memory, Page, Pages, Side, Store, WORD};
use link::frame::checksum;
use link::nonce::Nonces;
use link::{Block, Desired, Fault, Frame, Part, Reason, Request, Sequence, WireModel, WireSettings, block};
use model::extended::{Law, Memory as Hysteresis, Relaxation};
use model::{ExtendedPlant, supervisor};
use serde_json::{Value, json};
use xtask::variant::{Controller, Variant};

use crate::variant;

/// Random number that the chip's generator delivers.
pub(super) const RANDOM: u32 = 0x7a11_ab1e;
/// Two targets, in V. Under the time-optimal controller the voltage leaves the amplifier's limit before the second.
pub(super) const TARGETS_V: [f64; 2] = [100.0, 60.0];
/// Time of the watchdog in the stored settings, in ms.
pub(super) const STORED_RESET_MS: u32 = 2 * WATCHDOG_MS;
/// Interval of the telemetry in the flood, in ticks.
pub(super) const EVERY_TICKS: u16 = 10;

/// Time between two requests, in us: most are answered within it.
const STEP_US: u32 = 20_000;
/// Time in which a page is erased and a part is written or a block sealed, in us.
const ERASE_US: u32 = 50_000;
/// Time from a request to restart until the chip listens again, in us.
const RESTART_US: u32 = 150_000;

/// Time that the start of a variant takes longer than that of the others, in us: the robust controller's design is a part of it.
pub(super) const fn later_us(variant: Variant) -> u32 {
    if matches!(variant.controller, Controller::Robust) { 40_000 } else { 0 }
}

/// Time in us and request of each frame, whose sequence number is its index. Frames of the same time follow one another without a gap.
#[derive(Default)]
pub(super) struct Schedule(pub(super) Vec<(u32, Request)>);

impl Schedule {
    /// Adds a request `wait_us` after the last one.
    fn then(&mut self, wait_us: u32, request: Request) {
        let at = self.0.last().map_or(0, |(at, _)| *at) + wait_us;
        self.0.push((at, request));
    }

    /// Adds the parts of a block's payload, of which there are more than one, and its end.
    fn send(&mut self, block: Block, payload: &[u8]) {
        for (number, request) in Request::sending(block, payload).enumerate() {
            self.then(if number <= 1 { ERASE_US } else { STEP_US }, request);
        }
    }

    /// Adds the requests that arm, follow two targets and keep the host alive. A Hello has to come before.
    fn drive(&mut self) {
        self.then(STEP_US, Request::Arm);
        self.then(STEP_US, set(TARGETS_V[0]));
        for request in [Request::Heartbeat, Request::Heartbeat, Request::Status] {
            self.then(100_000, request);
        }
        self.then(100_000, set(TARGETS_V[1]));
        self.then(100_000, Request::Heartbeat);
        self.then(100_000, Request::Heartbeat);
    }

    /// Returns the frames of the schedule as JSON, each with its time in us and its bytes in hex. The session is the first
    /// of a chip whose generator delivers `random`.
    pub(super) fn frames(&self, random: u32) -> Value {
        let nonce = Nonces::new(random).draw();
        let mut frames: Vec<(u32, String)> = Vec::new();
        for ((us, request), number) in self.0.iter().zip(0..) {
            let bytes = hex(Frame::new(nonce.stamp(Sequence(number)), request).as_bytes());
            match frames.last_mut() {
                Some((at, before)) if *at == *us => before.push_str(&bytes),
                _ => frames.push((*us, bytes)),
            }
        }
        json!(frames)
    }
}

/// Arms, follows two targets and falls silent.
pub(super) fn armed() -> Schedule {
    let mut schedule = Schedule::default();
    schedule.then(STEP_US, Request::Hello);
    schedule.drive();
    schedule
}

/// Asks for the level of the brown-out reset.
pub(super) fn level() -> Schedule {
    Schedule(
        [Request::Hello, Request::BrownOut].into_iter().zip(1..).map(|(request, at)| (at * STEP_US, request)).collect(),
    )
}

/// Arms, asks for telemetry, and then sends valid frames as fast as the line carries them, to the end of the run.
pub(super) fn flood() -> Schedule {
    let mut schedule = Schedule::default();
    for request in [Request::Hello, Request::Arm, set(TARGETS_V[0]), Request::Stream { every_ticks: EVERY_TICKS }] {
        schedule.then(STEP_US, request);
    }
    let at = 5 * STEP_US;
    let requests = [Request::Heartbeat, set(TARGETS_V[0]), Request::Status];
    schedule.0.extend(requests.into_iter().cycle().take(220).map(|request| (at, request)));
    schedule
}

/// Stores settings and a model, restarts, asks what runs, and then does what [`armed`] does.
pub(super) fn sent(variant: Variant) -> Result<Schedule> {
    let mut schedule = Schedule::default();
    schedule.then(STEP_US, Request::Hello);
    schedule.send(Block::Settings, &settings(variant)?);
    schedule.send(Block::Model, &model()?);
    schedule.then(ERASE_US, Request::Restart);
    schedule.then(RESTART_US, Request::Hello);
    for request in [Request::Settings, Request::Model, Request::BrownOut] {
        schedule.then(STEP_US, request);
    }
    schedule.drive();
    Ok(schedule)
}

/// A block that is stored in place of another.
pub(super) struct Replacement {
    pub(super) block: Block,
    /// Payload that is stored before.
    pub(super) old: Vec<u8>,
    /// Payload that a host sends.
    pub(super) new: Vec<u8>,
}

impl Replacement {
    /// Settings, and a model.
    pub(super) fn both(variant: Variant) -> Result<[Self; 2]> {
        Ok([
            Self { block: Block::Settings, old: settings(variant)?, new: resetting_after(variant, 3 * WATCHDOG_MS)? },
            Self { block: Block::Model, old: old_model()?, new: model()? },
        ])
    }

    /// The request that asks which block is stored and which runs.
    const fn asked(&self) -> Request {
        match self.block {
            Block::Settings => Request::Settings,
            Block::Model => Request::Model,
        }
    }

    /// Number of operations of the flash with which the new block is stored: one that erases, and one for each word.
    pub(super) fn operations(&self) -> usize {
        1 + words(&self.new)
    }

    /// Sends the block again after each of `cuts` resets, having asked what runs and armed; then restarts, asks what runs and
    /// acknowledges a fault of what was stored.
    pub(super) fn cut(&self, cuts: usize) -> Schedule {
        let mut schedule = Schedule::default();
        for _ in 0..=cuts {
            schedule.then(RESTART_US, Request::Hello);
            for request in [self.asked(), Request::Arm, Request::Disarm] {
                schedule.then(STEP_US, request);
            }
            schedule.send(self.block, &self.new);
        }
        schedule.then(ERASE_US, Request::Restart);
        schedule.then(RESTART_US, Request::Hello);
        schedule.then(STEP_US, self.asked());
        schedule.then(STEP_US, Request::Acknowledge(Fault::from(supervisor::Fault::Config)));
        schedule
    }
}

/// Sends the first part of a model, then asks what runs and arms.
pub(super) fn protected() -> Result<Schedule> {
    let mut schedule = Schedule::default();
    let model = model()?;
    let first = Request::sending(Block::Model, &model).next();
    for request in [Request::Hello].into_iter().chain(first).chain([Request::Model, Request::Arm]) {
        schedule.then(STEP_US, request);
    }
    Ok(schedule)
}

const fn set(volts: f64) -> Request {
    Request::Set(Desired::ScaledVolts(volts))
}

/// Bytes as hexadecimal text.
pub(super) fn hex(bytes: &[u8]) -> String {
    bytes.iter().map(|byte| format!("{byte:02x}")).collect()
}

/// Payload of settings that differ from the built-in ones of `variant` in the time of the watchdog.
pub(super) fn settings(variant: Variant) -> Result<Vec<u8>> {
    resetting_after(variant, STORED_RESET_MS)
}

/// Payload of the built-in settings of `variant` with a watchdog of `reset_ms`.
fn resetting_after(variant: Variant, reset_ms: u32) -> Result<Vec<u8>> {
    let built_in = WireSettings::new(&built_in(variant::settings(variant)));
    let [hang_ms, stall_ms, _] = built_in.watchdogs_ms;
    let settings = WireSettings { watchdogs_ms: [hang_ms, stall_ms, reset_ms], ..built_in };
    Ok(settings.payload().context("settings without a payload")?.to_vec())
}

/// A spring with a second relaxation, hysteresis and a static law.
pub(super) fn extended() -> Result<WireModel> {
    let plant = ExtendedPlant {
        memory: Some(Hysteresis { direct: 0.8, thresholds_v: &[10.0, 25.0], weights: &[0.15, 0.05] }),
        law: Some(Law {
            voltage_v: &[0.0, 100.0, 200.0, 300.0, 400.0, 500.0],
            stiffness: &[0.0, 90.0, 190.0, 300.0, 410.0, 500.0],
        }),
        leakage: None,
        relaxation: Relaxation {
            share: 0.09,
            time_constants_s: &[5.5, 40.0],
            weights: &[0.8, 0.11],
            time_constant_high_s: None,
        },
    };
    WireModel::new(&plant, None, None).context("a model that is too long")
}

/// Payload of [`extended`].
pub(super) fn model() -> Result<Vec<u8>> {
    Ok(extended()?.payload().context("a model without a payload")?.to_vec())
}

/// Payload of the model that is stored before: a time constant alone.
pub(super) fn old_model() -> Result<Vec<u8>> {
    let time_constants_s = [5.0].into_iter().collect();
    let model = WireModel { share: 0.1, time_constants_s, ..WireModel::default() };
    Ok(model.payload().context("a model without a payload")?.to_vec())
}

/// The first page of `block` after `payload` was stored in it.
pub(super) fn page(block: Block, payload: &[u8]) -> Result<Vec<u8>> {
    let mut store = Store::new(Memory::default());
    let refused = |reason: Reason| anyhow::anyhow!("{reason}");
    for Part { number, bytes, .. } in Part::all(payload) {
        store.part(block, number, &bytes).map_err(refused)?;
    }
    store.end(block, u16::try_from(payload.len())?, checksum(payload), |_, _| Ok(())).map_err(refused)?;
    Ok(store.pages().bytes(Page { block, side: Side::A }).to_vec())
}

/// Number of words with which a payload is stored: those of its parts, and two that seal it.
pub(super) fn words(payload: &[u8]) -> usize {
    payload.len().div_ceil(block::PART) * block::PART / WORD + 2
}
