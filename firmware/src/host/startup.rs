//! Construction of controller and server at the start.

use cortex_m::singleton;
use link::reply::Firmware;
use link::{About, Controller, Server};
use model::stiffness::{Cantilever, YoungsModulus};
use model::{OutOfRange, SampleTime, Settings, Spring};

use crate::control::Control;
use crate::log;
use crate::reset_cause::Cause;
use crate::settings::{RATE_HZ, SUPERVISION};
use crate::start::{self, Start};
use crate::store::{Pages, Store};

/// Builds controller and server from the stored model; `None` from the second call on. The nonces of the link's sessions
/// follow from `seed`, which has to be another one at every start.
///
/// # Errors
/// [`OutOfRange`] names the invalid setting.
pub fn open<P: Pages>(
    settings: &Settings,
    store: &Store<P>,
    cause: &Cause,
    seed: u32,
) -> Result<Option<(&'static mut Control, &'static mut Server)>, OutOfRange> {
    let Some(place) = singleton!(: Option<Control> = None) else { return Ok(None) };
    let (control, start) = start::control(settings, store.newest(), cause, place)?;
    if let Some(field) = start.rejected {
        log::refused(field);
    }
    Ok(server(&start, Controller::of(&settings.compensation), seed)?.map(|server| (control, server)))
}

/// Builds the server. Not inlined, so that its stack frame is released.
#[inline(never)]
fn server(start: &Start, controller: Controller, seed: u32) -> Result<Option<&'static mut Server>, OutOfRange> {
    let amplifier = &start.amplifier;
    let spring = Spring::new(YoungsModulus::PAPER, Cantilever::PAPER, amplifier.min_v, amplifier.max_v)?;
    let part = |text: &str| text.parse().unwrap_or(0);
    let revision = env!("GIT_REVISION").get(..8).and_then(|digits| u32::from_str_radix(digits, 16).ok());
    let firmware = Firmware {
        major: part(env!("CARGO_PKG_VERSION_MAJOR")),
        minor: part(env!("CARGO_PKG_VERSION_MINOR")),
        patch: part(env!("CARGO_PKG_VERSION_PATCH")),
        revision: revision.unwrap_or(0),
        controller,
    };
    let about = About {
        firmware,
        rate_hz: RATE_HZ,
        silence_limit_ticks: SUPERVISION.host_timeout_ticks(SampleTime::from_rate(f64::from(RATE_HZ))?),
        last_fault: start.last_fault.map_or(link::Fault::NONE, Into::into),
        model: start.model,
        stored: start.stored,
        seed,
    };
    Ok(singleton!(: Server = Server::new(spring, about)))
}
