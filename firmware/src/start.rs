//! The controller, from what is stored and from why the last run ended.

use link::{ModelId, Reason, WireModel};
use model::supervisor::Fault;
use model::{Amplifier, OutOfRange, Settings};

use crate::control::Control;
use crate::settings::{FLASHED, SUPERVISION};

/// What a start comes to.
#[derive(Clone, Copy, Debug)]
pub struct Start {
    /// The model that it runs.
    pub model: ModelId,
    /// The one that is stored, if it was refused, too.
    pub stored: ModelId,
    /// The amplifier, as far as the running model knows it.
    pub amplifier: Amplifier,
    /// Why voltages were taken away before.
    pub last_fault: Option<Fault>,
    /// What is wrong with the stored model.
    pub refused: Option<&'static str>,
}

/// Builds the controller, with the model that is built in unless there is a sound one among what is `stored`.
///
/// # Errors
/// [`OutOfRange`] names the setting.
#[inline(never)]
pub fn control<'a>(
    settings: &Settings,
    stored: Option<(ModelId, &[u8])>,
    last_fault: Option<Fault>,
    place: &'a mut Option<Control>,
) -> Result<(&'a mut Control, Start), OutOfRange> {
    let control = build(settings, place)?;
    let (builtin, amplifier) = (ModelId::default(), settings.amplifier);
    let mut start = Start { model: builtin, stored: builtin, amplifier, last_fault, refused: None };
    if let Some((stored, payload)) = stored {
        start.stored = stored;
        match take_on(settings, control, payload) {
            Ok(amplifier) => (start.model, start.amplifier) = (stored, amplifier),
            Err(field) => start.refused = Some(field),
        }
    }
    // The refusal is what has to be acknowledged. Why the last run ended is told beside it.
    if let Some(fault) = start.refused.map_or(last_fault, |_| Some(Fault::Config)) {
        control.fault(fault);
    }
    Ok((control, start))
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
fn build<'a>(settings: &Settings, place: &'a mut Option<Control>) -> Result<&'a mut Control, OutOfRange> {
    Ok(place.insert(Control::new(settings, &SUPERVISION, None)?))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::settings::SETTINGS;
    use model::supervisor::State;

    fn model(share: f64) -> WireModel {
        let time_constants_s = [5.5].into_iter().collect();
        WireModel { share, time_constants_s, limit_v: Some(650.0), ..WireModel::default() }
    }

    #[test]
    fn a_refused_model_is_a_fault_of_its_own_whatever_ended_the_last_run() {
        let start = |stored: Option<&[u8]>, last_fault| {
            let mut place = None;
            let stored = stored.map(|payload| (ModelId::of(3, payload), payload));
            let (control, start) = control(&SETTINGS, stored, last_fault, &mut place).unwrap();
            (control.supervisor().state(), start)
        };
        let (sound, unsound) = (model(0.1).payload().unwrap(), model(2.0).payload().unwrap());
        let faulted = State::Faulted;
        for (stored, last_fault, state, refused, limit_v) in [
            (None, None, State::Disarmed, None, 700.0),
            (None, Some(Fault::Panic), faulted(Fault::Panic), None, 700.0),
            (Some(&sound[..]), None, State::Disarmed, None, 650.0),
            (Some(&sound), Some(Fault::Panic), faulted(Fault::Panic), None, 650.0),
            (Some(&unsound), None, faulted(Fault::Config), Some("share"), 700.0),
            (Some(&unsound), Some(Fault::Panic), faulted(Fault::Config), Some("share"), 700.0),
            (Some(b"noise"), Some(Fault::Panic), faulted(Fault::Config), Some("format"), 700.0),
        ] {
            let (is, start) = start(stored, last_fault);
            assert_eq!((is, start.refused, start.amplifier.max_v), (state, refused, limit_v));
            assert_eq!(start.last_fault, last_fault, "told beside it");
            assert_eq!(start.stored.number, if stored.is_some() { 3 } else { 0 }, "refused or not");
            assert_eq!(start.model, if refused.is_some() { ModelId::default() } else { start.stored });
        }
    }
}
