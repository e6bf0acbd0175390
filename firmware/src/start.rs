//! The controller, from what is stored.

use cortex_m::singleton;
use link::{ModelId, Reason, WireModel};
use model::supervisor::Fault;
use model::{Amplifier, OutOfRange, Settings};

use crate::control::Control;
use crate::log;
use crate::settings::{FLASHED, SUPERVISION};
use crate::store::{Pages, Store};

/// What a start comes to.
pub struct Start {
    /// The model that it runs.
    pub model: ModelId,
    /// The amplifier, as far as that model knows it.
    pub amplifier: Amplifier,
    /// Why voltages were taken away before; a stored model that cannot be run is a reason, too.
    pub last_fault: Option<Fault>,
}

/// Builds the controller, with the model that is built in unless there is a sound one in the store. `None` the second time.
///
/// # Errors
/// [`OutOfRange`] names the setting.
#[inline(never)]
pub fn control<P: Pages>(
    settings: &Settings,
    store: &Store<P>,
    last_fault: Option<Fault>,
) -> Result<Option<(&'static mut Control, Start)>, OutOfRange> {
    let Some(place) = singleton!(: Option<Control> = None) else { return Ok(None) };
    build(settings, last_fault, place)?;
    let Some(control) = place else { return Ok(None) };
    let mut start = Start { model: ModelId::default(), amplifier: settings.amplifier, last_fault };
    if let Some((model, payload)) = store.newest() {
        match take_on(settings, control, payload) {
            Ok(amplifier) => (start.model, start.amplifier) = (model, amplifier),
            Err(field) => {
                log::refused(field);
                control.fault(Fault::Config);
                start.last_fault = last_fault.or(Some(Fault::Config));
            }
        }
    }
    Ok(Some((control, start)))
}

/// Whether a payload holds a model that can be run.
///
/// # Errors
/// The [`Reason`] to refuse it with.
#[inline(never)]
pub fn check(payload: &[u8]) -> Result<(), Reason> {
    let found = WireModel::read(payload);
    let Some(found) = &found else { return Err(Reason::ModelDamaged) };
    Control::check(&FLASHED, found).map_err(|error| Reason::of_model(&error))
}

#[inline(never)]
fn take_on(settings: &Settings, control: &mut Control, payload: &[u8]) -> Result<Amplifier, &'static str> {
    let found = WireModel::read(payload);
    let Some(found) = &found else { return Err("format") };
    control.take_on(settings, found).map_err(|error| error.field)?;
    Ok(found.behind(settings.amplifier))
}

#[inline(never)]
fn build(settings: &Settings, last_fault: Option<Fault>, place: &mut Option<Control>) -> Result<(), OutOfRange> {
    *place = Some(Control::new(settings, &SUPERVISION, last_fault)?);
    Ok(())
}
