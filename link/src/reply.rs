//! Replies of the MCU.

use model::Compensation;
use model::supervisor::Faults;
use serde::{Deserialize, Serialize};

use crate::adaptation::AdaptationReport;
use crate::block::{Blocks, Part};
use crate::capture::{Captured, Rows};
use crate::diagnosis::Mismatch;
use crate::fault::Fault;
use crate::isolation::IsolationReport;
use crate::reason::Reason;
use crate::telemetry::{State, Telemetry};
use crate::value::WireVolts;

/// Reply to a request, with the sequence number of that request. Telemetry has sequence numbers of its own.
///
/// The order of the variants defines their codes on the wire.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub enum Reply {
    /// The request was executed.
    Ack {
        /// State after the request.
        state: State,
        /// Target after the request.
        target: WireVolts,
    },
    /// The request was rejected and has changed nothing.
    Refused(Reason),
    /// Complete state of the MCU.
    Status(Status),
    /// One sample of the control loop.
    Telemetry(Telemetry),
    /// The running and the stored model.
    Model(Blocks),
    /// A new fault; sent without a request, and again and again until the host has heard of it.
    Fault(FaultReport),
    /// The running and the stored settings.
    Settings(Blocks),
    /// A part of the payload of settings.
    SettingsPart(Part),
    /// How far the fast capture is.
    Captured(Captured),
    /// Rows of the fast capture.
    Rows(Rows),
    /// What the isolation bank says.
    Isolation(IsolationReport),
    /// What the adaptation does.
    Adaptation(AdaptationReport),
    /// The level of the brown-out reset; `None` if the board has no such level.
    BrownOut(Option<BrownOut>),
}

/// The level of the supply below which the chip holds itself in reset: an option of the chip, which the firmware does not program.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub struct BrownOut {
    /// Level that is set, 0 to 4 as the chip numbers it.
    pub level: u8,
    /// Level that is expected, 0 to 4.
    pub expected: u8,
}

/// Report of a fault that has come since the start.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
pub struct FaultReport {
    /// Number of faults since the start, this one included; it wraps around. Of several in one tick, the fault with the lowest
    /// code comes first. The host names the number when it has heard of the fault.
    pub number: u32,
    /// Tick in which the fault was seen.
    pub tick: u64,
    /// The fault.
    pub fault: Fault,
    /// All faults that stand when the report is sent: bit 0 for the fault with code 1.
    pub standing: u16,
    /// What disagreed with the output when the fault was seen.
    pub mismatch: Mismatch,
}

impl FaultReport {
    /// The standing faults.
    pub fn faults(&self) -> impl Iterator<Item = Fault> {
        Faults::from_bits(self.standing).iter().map(Fault::from)
    }
}

/// Complete state of the MCU.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
pub struct Status {
    /// Version of the program and its controller.
    pub firmware: Firmware,
    /// Rate of the control tick, in Hz.
    pub rate_hz: u32,
    /// Permitted silence of the host, in ticks.
    pub silence_limit_ticks: u32,
    /// Lowest permitted target, as equivalent static voltage: the amplifier's range, independent of the spring's model.
    pub lowest: WireVolts,
    /// Highest permitted target, as equivalent static voltage.
    pub highest: WireVolts,
    /// Number of missed ticks since the start.
    pub overruns: u32,
    /// Present fault, or [`Fault::NONE`].
    pub fault: Fault,
    /// Fault that caused the last reset, or [`Fault::NONE`].
    pub last_fault: Fault,
    /// Latest sample of the control loop.
    pub sample: Telemetry,
    /// Counters of the received frames.
    pub counters: Counters,
}

/// Counters of the frames since the start. Each counter saturates.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
pub struct Counters {
    /// Requests that were executed.
    pub accepted: u32,
    /// Repeated requests, to which the same reply was sent again.
    pub repeated: u32,
    /// Frames that did not decode or had a wrong CRC.
    pub damaged: u32,
    /// Frames that were longer than the longest message.
    pub oversize: u32,
    /// Frames with a correct CRC but another protocol version.
    pub bad_version: u32,
    /// Frames with a correct CRC that were rejected because of their session or sequence number.
    pub out_of_order: u32,
    /// Frames with a correct CRC that were not a request.
    pub unknown: u32,
    /// Telemetry samples that were due and not sent completely, because the line was busy.
    pub telemetry_dropped: u32,
}

/// Identity of the program on the MCU.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
pub struct Firmware {
    /// Major version.
    pub major: u8,
    /// Minor version.
    pub minor: u8,
    /// Patch version.
    pub patch: u8,
    /// First eight hexadecimal digits of the git revision, or 0 if it is unknown.
    pub revision: u32,
    /// Pre-compensator in use.
    pub controller: Controller,
}

/// Type of the pre-compensator.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
pub enum Controller {
    /// No pre-compensation: the target is the voltage.
    #[default]
    None,
    /// The source report's proportional-integral controller.
    Paper,
    /// The time-optimal controller.
    Fast,
    /// The controller for a spring that is known to within errors.
    Robust,
}

impl Controller {
    /// Type of the controller with the settings `compensation`.
    pub const fn of(compensation: &Compensation) -> Self {
        match compensation {
            Compensation::None => Self::None,
            Compensation::ProportionalIntegral(_) => Self::Paper,
            Compensation::TimeOptimal(_) => Self::Fast,
            Compensation::Robust(_) => Self::Robust,
        }
    }

    /// Name on the command line of `vsj` and in the log.
    pub const fn name(self) -> &'static str {
        match self {
            Self::None => "none",
            Self::Paper => "paper",
            Self::Fast => "fast",
            Self::Robust => "robust",
        }
    }
}
