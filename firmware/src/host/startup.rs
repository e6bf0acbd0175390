//! Construction of controller and server at the start.

use cortex_m::singleton;
use link::reply::Firmware;
use link::{About, Block, BrownOut, Controller, Server};
use model::stiffness::{Cantilever, YoungsModulus};
use model::{OutOfRange, SampleTime, Spring};

use crate::adaptation;
use crate::control::Control;
use crate::isolation::{self, Isolation};
use crate::log;
use crate::reset_cause::Cause;
use crate::start::{self, Loaded, Start};
use crate::store::{Pages, Store};

/// Controller, isolation bank and server.
type Built = (&'static mut Control, &'static mut Isolation, &'static mut Server);

/// Builds controller, isolation bank and server from the settings and the stored model; `None` from the second call on. The nonces
/// of the link's sessions follow from `seed`, which has to be another one at every start. A `brown_out` level that is not the expected one
/// is logged, and the host hears of it.
///
/// # Errors
/// [`OutOfRange`] names the invalid setting.
pub fn open<P: Pages>(
    loaded: &Loaded,
    store: &Store<P>,
    cause: &Cause,
    brown_out: Option<BrownOut>,
    seed: u32,
) -> Result<Option<Built>, OutOfRange> {
    if let Some(it) = brown_out.filter(|it| it.level != it.expected) {
        log::brown_out(it.level, it.expected);
    }
    let Some(place) = singleton!(: Option<Control> = None) else { return Ok(None) };
    let (control, start) = start::control(loaded, store.newest(Block::Model), cause, place)?;
    for field in loaded.rejected.into_iter().chain(start.rejected) {
        log::refused(field);
    }
    isolation::set_terms(start.isolation);
    adaptation::set_terms(adaptation::Terms::new(&loaded.settings, start.amplifier, &start.isolation));
    let Some(isolation) = singleton!(: Isolation = Isolation::off()) else { return Ok(None) };
    isolation.start(&start.isolation);
    Ok(server(&start, loaded, brown_out, seed)?.map(|server| (control, isolation, server)))
}

/// Builds the server. Not inlined, so that its stack frame is released.
#[inline(never)]
fn server(
    start: &Start,
    loaded: &Loaded,
    brown_out: Option<BrownOut>,
    seed: u32,
) -> Result<Option<&'static mut Server>, OutOfRange> {
    let (amplifier, settings) = (&start.amplifier, &loaded.settings);
    let spring = Spring::new(YoungsModulus::PAPER, Cantilever::PAPER, amplifier.min_v, amplifier.max_v)?;
    let part = |text: &str| text.parse().unwrap_or(0);
    let revision = env!("GIT_REVISION").get(..8).and_then(|digits| u32::from_str_radix(digits, 16).ok());
    let firmware = Firmware {
        major: part(env!("CARGO_PKG_VERSION_MAJOR")),
        minor: part(env!("CARGO_PKG_VERSION_MINOR")),
        patch: part(env!("CARGO_PKG_VERSION_PATCH")),
        revision: revision.unwrap_or(0),
        controller: Controller::of(&settings.control.compensation),
    };
    let about = About {
        firmware,
        rate_hz: settings.rate_hz(),
        silence_limit_ticks: settings.supervision.host_timeout_ticks(SampleTime::from_rate(settings.control.rate_hz)?),
        last_fault: start.last_fault.map_or(link::Fault::NONE, Into::into),
        model: start.model,
        settings: loaded.blocks,
        brown_out,
        seed,
    };
    Ok(singleton!(: Server = Server::new(spring, about)))
}
