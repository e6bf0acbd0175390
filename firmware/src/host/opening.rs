//! Controller and desk, at the start.

use cortex_m::singleton;
use link::reply::Firmware;
use link::{About, Controller, Desk};
use model::stiffness::{Cantilever, YoungsModulus};
use model::supervisor::Fault;
use model::{OutOfRange, SampleTime, Settings, Spring};

use crate::control::Control;
use crate::settings::SUPERVISION;
use crate::start::{self, Start};
use crate::store::{Pages, Store};
use crate::{RATE_HZ, log};

/// Controller and desk, from what is stored; `None` if somebody has them already.
///
/// # Errors
/// [`OutOfRange`] names the setting.
pub fn open<P: Pages>(
    settings: &Settings,
    store: &Store<P>,
    last_fault: Option<Fault>,
) -> Result<Option<(&'static mut Control, &'static mut Desk)>, OutOfRange> {
    let Some(place) = singleton!(: Option<Control> = None) else { return Ok(None) };
    let (control, start) = start::control(settings, store.newest(), last_fault, place)?;
    if let Some(field) = start.refused {
        log::refused(field);
    }
    Ok(desk(&start, Controller::of(&settings.compensation))?.map(|desk| (control, desk)))
}

/// Not inlined: what it needs on the stack is not to stay there.
#[inline(never)]
fn desk(start: &Start, controller: Controller) -> Result<Option<&'static mut Desk>, OutOfRange> {
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
    };
    Ok(singleton!(: Desk = Desk::new(spring, about)))
}
