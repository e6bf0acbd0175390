//! Construction of the controller at the start, from the stored model and the fault of the last run.

use link::{BlockId, Reason, WireModel};
use model::supervisor::Fault;
use model::{Amplifier, OutOfRange, Settings};

use crate::control::Control;
use crate::reset_cause::Cause;
use crate::settings::{FLASHED, SUPERVISION};

/// Result of the start.
#[derive(Clone, Copy, Debug)]
pub struct Start {
    /// Running model.
    pub model: BlockId,
    /// Stored model, even if its validation failed; the built-in model if none is stored.
    pub stored: BlockId,
    /// Amplifier with the limits of the running model.
    pub amplifier: Amplifier,
    /// Fault of the last run.
    pub last_fault: Option<Fault>,
    /// Invalid field of the stored model, or `format`; `None` if it is valid.
    pub rejected: Option<&'static str>,
}

/// Builds the controller in `place`, with the `stored` model if it is valid, otherwise with the built-in one.
///
/// # Errors
/// [`OutOfRange`] names the invalid setting.
#[inline(never)]
pub fn control<'a>(
    settings: &Settings,
    stored: Option<(BlockId, &[u8])>,
    cause: &Cause,
    place: &'a mut Option<Control>,
) -> Result<(&'a mut Control, Start), OutOfRange> {
    let control = build(settings, place)?;
    let (builtin, amplifier) = (BlockId::default(), settings.amplifier);
    let mut start = Start { model: builtin, stored: builtin, amplifier, last_fault: cause.fault, rejected: None };
    if let Some((stored, payload)) = stored {
        start.stored = stored;
        match use_model(settings, control, payload) {
            Ok(amplifier) => (start.model, start.amplifier) = (stored, amplifier),
            Err(field) => start.rejected = Some(field),
        }
    }
    // Every one of them has to be acknowledged; the state shows the first.
    let rejected = start.rejected.map(|_| Fault::Config);
    for fault in rejected.into_iter().chain(cause.fault).chain(cause.standing.iter()) {
        control.fault(fault);
    }
    Ok((control, start))
}

/// Validates the model in `payload` for the flashed settings.
///
/// # Errors
/// The [`Reason`] for rejecting the model.
#[inline(never)]
pub fn check(payload: &[u8]) -> Result<(), Reason> {
    let model = WireModel::read(payload);
    let Some(model) = &model else { return Err(Reason::Damaged) };
    Control::check(&FLASHED, model).map_err(|error| Reason::of_model(&error))
}

#[inline(never)]
fn use_model(settings: &Settings, control: &mut Control, payload: &[u8]) -> Result<Amplifier, &'static str> {
    let model = WireModel::read(payload);
    let Some(model) = &model else { return Err("format") };
    control.use_model(settings, model).map_err(|error| error.field)?;
    Ok(model.behind(settings.amplifier))
}

#[inline(never)]
fn build<'a>(settings: &Settings, place: &'a mut Option<Control>) -> Result<&'a mut Control, OutOfRange> {
    Ok(place.insert(Control::new(settings, &SUPERVISION, None)?))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::settings::SETTINGS;
    use link::wire_model::FORMAT;
    use model::supervisor::{Faults, State};

    fn model(share: f64) -> WireModel {
        let time_constants_s = [5.5].into_iter().collect();
        WireModel { share, time_constants_s, limit_v: Some(650.0), ..WireModel::default() }
    }

    #[test]
    fn a_rejected_model_is_a_config_fault_and_the_last_fault_stands_as_well() {
        let start = |stored: Option<&[u8]>, last_fault: Option<Fault>| {
            let mut place = None;
            let stored = stored.map(|payload| (BlockId::of(3, payload), payload));
            let standing = last_fault.map_or(Faults::NONE, |_| Faults::NONE.with(Fault::Panic).with(Fault::Interlock));
            let cause = Cause { name: "software", fault: last_fault, standing };
            let (control, start) = control(&SETTINGS, stored, &cause, &mut place).unwrap();
            let stands = start.rejected.map_or(standing, |_| standing.with(Fault::Config));
            assert_eq!(control.supervisor().standing(), stands);
            (control.supervisor().state(), start)
        };
        let (valid, invalid) = (model(0.1).payload().unwrap(), model(2.0).payload().unwrap());
        let faulted = State::Faulted;
        for (stored, last_fault, state, rejected, limit_v) in [
            (None, None, State::Disarmed, None, 700.0),
            (None, Some(Fault::Panic), faulted(Fault::Panic), None, 700.0),
            (Some(&valid[..]), None, State::Disarmed, None, 650.0),
            (Some(&valid), Some(Fault::Panic), faulted(Fault::Panic), None, 650.0),
            (Some(&invalid), None, faulted(Fault::Config), Some("share"), 700.0),
            (Some(&invalid), Some(Fault::Panic), faulted(Fault::Config), Some("share"), 700.0),
            (Some(b"noise"), Some(Fault::Panic), faulted(Fault::Config), Some("format"), 700.0),
        ] {
            let (is, start) = start(stored, last_fault);
            assert_eq!((is, start.rejected, start.amplifier.max_v), (state, rejected, limit_v));
            assert_eq!(start.last_fault, last_fault, "reported in any case");
            assert_eq!(start.stored.number, if stored.is_some() { 3 } else { 0 }, "valid or not");
            assert_eq!(start.model, if rejected.is_some() { BlockId::default() } else { start.stored });
        }
    }

    #[test]
    fn a_model_is_checked_before_it_is_stored() {
        let payload = |share| model(share).payload().unwrap();
        assert_eq!(check(&payload(0.1)), Ok(()));
        assert_eq!(check(b"noise"), Err(Reason::Damaged));
        assert!(matches!(check(&payload(2.0)), Err(reason) if reason != Reason::Damaged));
    }

    /// The first byte of a payload is the version of its format.
    #[test]
    fn a_model_of_a_newer_format_is_neither_stored_nor_run() {
        let mut newer = model(0.1).payload().unwrap();
        for version in (0..=u8::MAX).filter(|version| *version != FORMAT) {
            newer[0] = version;
            assert_eq!(check(&newer), Err(Reason::Damaged), "format {version}");
            let mut place = None;
            let stored = Some((BlockId::of(3, &newer), &newer[..]));
            let cause = Cause { name: "power-on", fault: None, standing: Faults::NONE };
            let (control, start) = control(&SETTINGS, stored, &cause, &mut place).unwrap();
            assert_eq!((start.rejected, start.model), (Some("format"), BlockId::default()));
            assert_eq!(control.supervisor().state(), State::Faulted(Fault::Config));
        }
    }
}
