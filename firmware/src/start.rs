//! Settings, model and fault of the last run at the start, and the controller that is built from them.
//!
//! Stored settings run from the start on, or not at all: those of another format, out of range or beyond what the image
//! contains are a `config` fault, and so is a damaged page of settings or model. Its cause is there until a start finds others:
//! what the program runs instead, the content before or the built-in one, may have a larger range, and never drives the output. An
//! erased page is none.

use link::{Block, BlockId, Blocks, Field, Reason, WireModel, WireSettings};
use model::supervisor::Fault;
use model::{Amplifier, OutOfRange, device};

use crate::control::Control;
use crate::isolation::Terms;
use crate::reset_cause::Cause;
use crate::store::{Pages, Store};

/// Settings of a run.
#[derive(Clone, Copy, Debug)]
pub struct Loaded {
    /// Settings that run.
    pub settings: device::Settings,
    /// Identities of the settings that run and of those stored, even if the stored ones failed their validation.
    pub blocks: Blocks,
    /// Invalid field of the stored settings, or `format`, or which block is damaged; `None` if settings are valid and nothing is
    /// damaged.
    pub rejected: Option<&'static str>,
}

/// Result of the start.
#[derive(Clone, Copy, Debug)]
pub struct Start {
    /// Model that runs, and the stored one, even if its validation failed.
    pub model: Blocks,
    /// Amplifier with the limits of the running model.
    pub amplifier: Amplifier,
    /// Fault of the last run.
    pub last_fault: Option<Fault>,
    /// The isolation bank of the running model.
    pub isolation: Terms,
    /// Invalid field of the stored model, or `format`, or `trip_on_cause` if no isolation bank runs that could trip; `None` if all is
    /// valid.
    pub rejected: Option<&'static str>,
}

impl Loaded {
    /// Settings that do not come from the store.
    pub const fn fixed(settings: device::Settings) -> Self {
        let builtin = BlockId { number: 0, format: 0, length: 0, checksum: 0 };
        Self { settings, blocks: Blocks { active: builtin, stored: builtin }, rejected: None }
    }
}

/// The settings in the store if they are valid, otherwise `built_in`.
#[inline(never)]
pub fn load<P: Pages>(store: &Store<P>, built_in: &device::Settings) -> Loaded {
    let mut loaded = Loaded::fixed(*built_in);
    if let Some((stored, payload)) = store.newest(Block::Settings) {
        loaded.blocks.stored = stored;
        match read(payload, built_in) {
            Ok(settings) => (loaded.settings, loaded.blocks.active) = (settings, stored),
            Err(Reason::NotBuiltIn(field) | Reason::BadSettings { field, .. }) => loaded.rejected = Some(field.name()),
            Err(_) => loaded.rejected = Some("format"),
        }
    }
    let damaged = [(Block::Settings, "damaged settings"), (Block::Model, "damaged model")];
    let damaged = damaged.into_iter().find(|(block, _)| store.is_damaged(*block)).map(|(_, what)| what);
    loaded.rejected = loaded.rejected.or(damaged);
    loaded
}

/// Builds the controller in `place`, with the `stored` model if it is valid, otherwise with the built-in one.
///
/// # Errors
/// [`OutOfRange`] names the invalid setting.
#[inline(never)]
pub fn control<'a>(
    loaded: &Loaded,
    stored: Option<(BlockId, &[u8])>,
    cause: &Cause,
    place: &'a mut Option<Control>,
) -> Result<(&'a mut Control, Start), OutOfRange> {
    let settings = &loaded.settings;
    let control = build(settings, place)?;
    let (model, amplifier) = (Blocks::default(), settings.control.amplifier);
    let isolation = Terms::new(settings, Some(settings.control.plant), amplifier.max_v);
    let mut start = Start { model, amplifier, last_fault: cause.fault, isolation, rejected: None };
    if let Some((stored, payload)) = stored {
        start.model.stored = stored;
        match use_model(settings, control, payload) {
            Ok((amplifier, isolation)) => {
                (start.model.active, start.amplifier, start.isolation) = (stored, amplifier, isolation);
            }
            Err(field) => start.rejected = Some(field),
        }
    }
    if let Err(error) = start.isolation.check() {
        start.rejected = start.rejected.or(Some(error.field));
    }
    // Every one of them has to be acknowledged; the state shows the first.
    if start.rejected.or(loaded.rejected).is_some() {
        control.cause(Fault::Config);
    }
    for fault in cause.fault.into_iter().chain(cause.standing.iter()) {
        control.fault(fault);
    }
    Ok((control, start))
}

/// Validates the model in `payload` for the settings of the next start.
///
/// # Errors
/// The [`Reason`] for rejecting the model.
#[inline(never)]
pub fn check_model<P: Pages>(store: &Store<P>, payload: &[u8], built_in: &device::Settings) -> Result<(), Reason> {
    let model = WireModel::read(payload);
    let Some(model) = &model else { return Err(Reason::Damaged) };
    check_together(&load(store, built_in).settings, model).map_err(|error| Reason::of_model(&error))
}

/// Validates the settings in `payload`, also for the stored model.
///
/// # Errors
/// The [`Reason`] for rejecting the settings.
#[inline(never)]
pub fn check_settings<P: Pages>(store: &Store<P>, payload: &[u8], built_in: &device::Settings) -> Result<(), Reason> {
    let settings = read(payload, built_in)?;
    let model = store.newest(Block::Model).and_then(|(_, payload)| WireModel::read(payload));
    let Some(model) = &model else { return Ok(()) };
    check_together(&settings, model).map_err(|error| Reason::of_settings(&error))
}

/// Checks a model and settings with each other.
fn check_together(settings: &device::Settings, model: &WireModel) -> Result<(), OutOfRange> {
    Control::check(&settings.control, model)?;
    terms(settings, model).check()
}

/// The isolation bank for a model.
fn terms(settings: &device::Settings, model: &WireModel) -> Terms {
    Terms::new(settings, model.plant().plain(), model.behind(settings.control.amplifier).max_v)
}

/// Reads and validates settings; what they leave out is that of `built_in`.
#[inline(never)]
fn read(payload: &[u8], built_in: &device::Settings) -> Result<device::Settings, Reason> {
    let wire = WireSettings::read(payload);
    let Some(wire) = &wire else { return Err(Reason::Damaged) };
    let settings = wire.over(built_in).map_err(Reason::NotBuiltIn)?;
    if let Some(field) = not_built_in(&settings, cfg!(feature = "isolation"), cfg!(feature = "adaptation")) {
        return Err(Reason::NotBuiltIn(Field::named(field)));
    }
    settings.check().map_err(|error| Reason::of_settings(&error))?;
    if cfg!(feature = "adaptation") {
        settings.check_adaptation().map_err(|error| Reason::of_settings(&error))?;
    }
    Ok(settings)
}

/// Returns the first setting that asks for a part that the image does not have, if any does.
fn not_built_in(settings: &device::Settings, isolation: bool, adaptation: bool) -> Option<&'static str> {
    if !isolation && !settings.trip_on_cause.is_empty() {
        return Some("trip_on_cause");
    }
    (!adaptation && settings.adaptation.is_some()).then_some("adaptation.enabled")
}

#[inline(never)]
fn use_model(
    settings: &device::Settings,
    control: &mut Control,
    payload: &[u8],
) -> Result<(Amplifier, Terms), &'static str> {
    let model = WireModel::read(payload);
    let Some(model) = &model else { return Err("format") };
    control.use_model(&settings.control, model).map_err(|error| error.field)?;
    Ok((model.behind(settings.control.amplifier), terms(settings, model)))
}

#[inline(never)]
fn build<'a>(settings: &device::Settings, place: &'a mut Option<Control>) -> Result<&'a mut Control, OutOfRange> {
    Ok(place.insert(Control::new(&settings.control, &settings.supervision, None)?))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::control::{Sensors, Untimed};
    use crate::settings::BUILT_IN;
    use crate::settings::{SETTINGS, built_in};
    use crate::store::{Memory, Page, Side, WORD};
    use link::wire_model::FORMAT;
    use link::{Command, Controller, Field, frame, wire_settings};
    use model::isolation::Causes;
    use model::supervisor::{self, Faults, Refusal, State};
    use model::{adaptation, isolation};
    use std::vec::Vec;

    const PAPER: Loaded = Loaded::fixed(built_in(SETTINGS));

    /// A store with these payloads, as an earlier firmware may have left them.
    fn store(contents: &[(Block, &[u8])]) -> Store<Memory> {
        let mut store = Store::new(Memory::default());
        for (block, payload) in contents {
            for (number, part) in (0..).zip(payload.chunks(link::block::PART)) {
                let bytes: Vec<u8> = part.iter().copied().chain([0; link::block::PART]).collect();
                store.part(*block, number, bytes.first_chunk().unwrap()).unwrap();
            }
            store.end(*block, payload.len() as u16, frame::checksum(payload), |_, _| Ok(())).unwrap();
        }
        store
    }

    /// Whether `fault` stays, although the host acknowledges and arms.
    fn stays(control: &mut Control, fault: Fault) -> bool {
        let sensors = Sensors { interlock_closed: true, ..Sensors::default() };
        for arming in [supervisor::Command::Disarm, supervisor::Command::Arm, supervisor::Command::Disarm] {
            let command = Command { heard: true, arming: Some(arming), target: None };
            control.tick(&command, &sensors, &mut Untimed);
        }
        let supervisor = control.supervisor();
        (supervisor.state(), supervisor.refusal()) == (State::Faulted(fault), Some(Refusal::CausePresent))
    }

    fn built_in_settings() -> WireSettings {
        WireSettings::new(&BUILT_IN)
    }

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
            let (control, start) = control(&PAPER, stored, &cause, &mut place).unwrap();
            let stands = start.rejected.map_or(standing, |_| standing.with(Fault::Config));
            assert_eq!(control.supervisor().standing(), stands);
            let state = control.supervisor().state();
            assert_eq!(stays(control, Fault::Config), start.rejected.is_some(), "until a start finds another model");
            (state, start)
        };
        let (valid, invalid) = (model(0.1).payload().unwrap(), model(2.0).payload().unwrap());
        let (faulted, built_in_v) = (State::Faulted, BUILT_IN.control.amplifier.max_v);
        for (stored, last_fault, state, rejected, limit_v) in [
            (None, None, State::Disarmed, None, built_in_v),
            (None, Some(Fault::Panic), faulted(Fault::Panic), None, built_in_v),
            (Some(&valid[..]), None, State::Disarmed, None, 650.0),
            (Some(&valid), Some(Fault::Panic), faulted(Fault::Panic), None, 650.0),
            (Some(&invalid), None, faulted(Fault::Config), Some("share"), built_in_v),
            (Some(&invalid), Some(Fault::Panic), faulted(Fault::Config), Some("share"), built_in_v),
            (Some(b"noise"), Some(Fault::Panic), faulted(Fault::Config), Some("format"), built_in_v),
        ] {
            let (is, start) = start(stored, last_fault);
            assert_eq!((is, start.rejected, start.amplifier.max_v), (state, rejected, limit_v));
            assert_eq!(start.last_fault, last_fault, "reported in any case");
            assert_eq!(start.model.stored.number, if stored.is_some() { 3 } else { 0 }, "valid or not");
            assert_eq!(start.model.active, if rejected.is_some() { BlockId::default() } else { start.model.stored });
        }
    }

    #[test]
    fn a_model_is_checked_before_it_is_stored() {
        let payload = |share| model(share).payload().unwrap();
        let check = |payload: &[u8]| check_model(&store(&[]), payload, &BUILT_IN);
        assert_eq!(check(&payload(0.1)), Ok(()));
        assert_eq!(check(b"noise"), Err(Reason::Damaged));
        assert!(matches!(check(&payload(2.0)), Err(Reason::BadModel { .. })));
    }

    /// The first byte of a payload is the version of its format.
    #[test]
    fn a_model_of_a_newer_format_is_neither_stored_nor_run() {
        let mut newer = model(0.1).payload().unwrap();
        for version in (0..=u8::MAX).filter(|version| *version != FORMAT) {
            newer[0] = version;
            assert_eq!(check_model(&store(&[]), &newer, &BUILT_IN), Err(Reason::Damaged), "format {version}");
            let mut place = None;
            let stored = Some((BlockId::of(3, &newer), &newer[..]));
            let cause = Cause { name: "power-on", fault: None, standing: Faults::NONE };
            let (control, start) = control(&PAPER, stored, &cause, &mut place).unwrap();
            assert_eq!((start.rejected, start.model.active), (Some("format"), BlockId::default()));
            assert_eq!(control.supervisor().state(), State::Faulted(Fault::Config));
        }
    }

    #[test]
    fn stored_settings_run_and_the_board_keeps_its_own() {
        let wire = WireSettings { full_scale_v: 450.0, max_v: 400.0, rate_hz: 1250, ..built_in_settings() };
        let loaded = load(&store(&[(Block::Settings, &wire.payload().unwrap())]), &BUILT_IN);
        assert_eq!((loaded.rejected, loaded.blocks.active), (None, loaded.blocks.stored));
        assert_eq!((loaded.blocks.active.number, loaded.settings.rate_hz()), (1, 1250));
        let amplifier = Amplifier { full_scale_v: 450.0, max_v: 400.0, ..BUILT_IN.control.amplifier };
        let control = model::Settings { rate_hz: 1250.0, amplifier, ..BUILT_IN.control };
        assert_eq!(loaded.settings, device::Settings { control, ..BUILT_IN });
        assert_eq!(load(&store(&[]), &BUILT_IN).settings, BUILT_IN, "without stored ones the built-in settings run");
    }

    #[test]
    fn rejected_settings_are_a_config_fault_that_no_acknowledgement_ends() {
        let wire = built_in_settings();
        let good = wire.payload().unwrap();
        let newer = [&[wire_settings::FORMAT + 1], &good[1..]].concat();
        let longer = [&good[..], &[0]].concat();
        for (payload, rejected) in [
            (&newer[..], "format"),
            (&longer, "format"),
            (b"noise", "format"),
            (&WireSettings { max_v: f64::NAN, ..wire }.payload().unwrap(), "max_v"),
            (&WireSettings { rate_hz: 0, ..wire }.payload().unwrap(), "rate_hz"),
            (&WireSettings { rate_hz: u32::MAX, ..wire }.payload().unwrap(), "rate_hz"),
            (&WireSettings { watchdogs_ms: [0; 3], ..wire }.payload().unwrap(), "hang_ms"),
            (&WireSettings { missed_ticks_allowed: u32::MAX, ..wire }.payload().unwrap(), "missed_ticks_allowed"),
        ] {
            let store = store(&[(Block::Settings, payload)]);
            let loaded = load(&store, &BUILT_IN);
            assert_eq!((loaded.rejected, loaded.settings), (Some(rejected), BUILT_IN));
            assert_eq!((loaded.blocks.active, loaded.blocks.stored.number), (BlockId::default(), 1));
            assert!(check_settings(&store, payload, &BUILT_IN).is_err(), "{rejected}: it is not stored either");
            let mut place = None;
            let cause = Cause { name: "power-on", fault: None, standing: Faults::NONE };
            let (control, _) = control(&loaded, None, &cause, &mut place).unwrap();
            assert_eq!(control.supervisor().state(), State::Faulted(Fault::Config), "{rejected}");
            assert!(stays(control, Fault::Config), "{rejected}");
        }
    }

    #[test]
    fn a_damaged_page_is_a_config_fault_until_it_is_written_again() {
        let wire = WireSettings { rate_hz: 1250, ..built_in_settings() };
        let (settings, model) = (wire.payload().unwrap(), model(0.1).payload().unwrap());
        for (block, payload, what) in
            [(Block::Settings, &settings[..], "damaged settings"), (Block::Model, &model[..], "damaged model")]
        {
            let mut pages = store(&[(block, payload)]).pages().clone();
            let page = Page { block, side: Side::A };
            let mut word = [0; WORD];
            word.copy_from_slice(&pages.bytes(page)[2 * WORD..3 * WORD]);
            word[3] ^= 1;
            pages.program(page, 2 * WORD, word).unwrap();
            let loaded = load(&Store::new(pages), &BUILT_IN);
            assert_eq!((loaded.rejected, loaded.settings), (Some(what), BUILT_IN));
            let mut place = None;
            let cause = Cause { name: "power-on", fault: None, standing: Faults::NONE };
            let (control, _) = control(&loaded, None, &cause, &mut place).unwrap();
            assert_eq!(control.supervisor().state(), State::Faulted(Fault::Config), "{what}");
            assert!(stays(control, Fault::Config), "{what}");
            assert_eq!(load(&store(&[(block, payload)]), &BUILT_IN).rejected, None);
        }
        assert_eq!(load(&store(&[]), &BUILT_IN).rejected, None, "a board to which nothing was ever sent");
    }

    /// Settings with a sensor, and with these causes as a trip.
    fn with_sensor(trip_on_cause: u16) -> WireSettings {
        let sensor = Some([1.0, 1.0, 0.1, 1e-3, 0.01, -50.0, 1000.0, 2.0]);
        WireSettings { sensor, trip_on_cause, ..built_in_settings() }
    }

    /// Only a plain spring has an isolation bank, without which a trip would never come.
    #[cfg(feature = "isolation")]
    #[test]
    fn a_trip_and_an_extended_spring_exclude_each_other() {
        let plain = model(0.1).payload().unwrap();
        let extended = WireModel { leakage: Some((0.1, 40.0)), ..model(0.1) }.payload().unwrap();
        let [quiet, trip] = [0, 0x8000].map(|trip| with_sensor(trip).payload().unwrap());
        for (model, settings, accepted) in
            [(&plain, &quiet, true), (&plain, &trip, true), (&extended, &quiet, true), (&extended, &trip, false)]
        {
            let of_settings = check_settings(&store(&[(Block::Model, model)]), settings, &BUILT_IN);
            let of_model = check_model(&store(&[(Block::Settings, settings)]), model, &BUILT_IN);
            let field = Field::named("trip_on_cause");
            if accepted {
                assert_eq!((of_settings, of_model), (Ok(()), Ok(())));
            } else {
                assert!(matches!(of_settings, Err(Reason::BadSettings { field: found, .. }) if found == field));
                assert!(matches!(of_model, Err(Reason::BadModel { field: found, .. }) if found == field));
            }
            let (mut place, loaded) = (None, load(&store(&[(Block::Settings, settings)]), &BUILT_IN));
            let cause = Cause { name: "power-on", fault: None, standing: Faults::NONE };
            let stored = Some((BlockId::of(3, model), &model[..]));
            let (control, start) = control(&loaded, stored, &cause, &mut place).unwrap();
            assert_eq!(start.rejected, if accepted { None } else { Some("trip_on_cause") });
            assert_eq!(control.supervisor().standing() == Faults::NONE, accepted);
        }
    }

    /// The features of this build decide, as those of an image do.
    #[test]
    fn what_the_image_does_not_contain_is_refused_by_its_name() {
        let check = |wire: WireSettings| check_settings(&store(&[]), &wire.payload().unwrap(), &BUILT_IN);
        let fast = WireSettings { controller: Controller::Fast, ..built_in_settings() };
        let robust = WireSettings { controller: Controller::Robust, margin: Some([0.05; 5]), ..built_in_settings() };
        let sensor = with_sensor(0);
        let contains =
            |feature: bool, field| if feature { Ok(()) } else { Err(Reason::NotBuiltIn(Field::named(field))) };
        let fast_is_there = model::Approach::new(0.0).is_some();
        let sensor_is_there = model::Feedback::from_values([1.0; 8]).is_some();
        let robust_is_there = model::Margin::from_values([0.05; 5]).is_some();
        assert_eq!(check(fast), contains(fast_is_there, "controller"));
        assert_eq!(check(robust), contains(robust_is_there, "controller"));
        // In every build: an image without this controller reads no margin, and without one nothing could run.
        assert_eq!(check(WireSettings { margin: None, ..robust }), contains(false, "controller"));
        if robust_is_there {
            let wide = check(WireSettings { margin: Some([0.05, 0.3, 0.0, 0.02, 0.0]), ..robust });
            assert!(matches!(wide, Err(Reason::BadSettings { field, .. }) if field == Field::named("margin.share")));
        }
        assert_eq!(check(sensor), contains(sensor_is_there, "sensor"));
        if sensor_is_there {
            assert_eq!(check(with_sensor(0x8000)), contains(cfg!(feature = "isolation"), "trip_on_cause"));
            let adaptation = Some(adaptation::Settings::TYPICAL.values());
            let adapts = WireSettings { adaptation, ..with_sensor(0) };
            let built_in = cfg!(feature = "adaptation");
            assert_eq!(check(adapts), contains(built_in, "adaptation.enabled"));
            if built_in {
                let wide = check(WireSettings { adaptation: Some([0.9; 6]), ..adapts });
                let field = Field::named("adaptation.time_constant");
                assert!(matches!(wide, Err(Reason::BadSettings { field: found, .. }) if found == field));
            }
        }
        assert_eq!(check(WireSettings { controller: Controller::None, ..built_in_settings() }), Ok(()));
    }

    #[test]
    fn an_image_without_isolation_and_adaptation_runs_neither() {
        let plain = device::Settings { adaptation: None, ..BUILT_IN };
        let trip = device::Settings { trip_on_cause: Causes::NONE.with(isolation::Cause::GainError), ..plain };
        let adapts = device::Settings { adaptation: Some(adaptation::Settings::TYPICAL), ..plain };
        assert_eq!(not_built_in(&plain, false, false), None);
        assert_eq!([not_built_in(&trip, false, true), not_built_in(&trip, true, false)], [Some("trip_on_cause"), None]);
        let refused = [not_built_in(&adapts, true, false), not_built_in(&adapts, false, true)];
        assert_eq!(refused, [Some("adaptation.enabled"), None]);
    }

    #[test]
    fn model_and_settings_are_checked_with_each_other() {
        let model = model(0.5).payload().unwrap();
        // Whatever controller the image has built in.
        let wire = WireSettings { controller: Controller::Paper, integral_per_s: 1.35, ..built_in_settings() };
        let strong = WireSettings { proportional: 90.0, ..wire }.payload().unwrap();
        assert_eq!(check_settings(&store(&[]), &strong, &BUILT_IN), Ok(()), "with the built-in model");
        let short = WireModel { time_constants_s: [0.01].into_iter().collect(), ..WireModel::default() };
        let short = short.payload().unwrap();
        assert_eq!(check_settings(&store(&[(Block::Model, &model)]), &strong, &BUILT_IN), Ok(()));
        let refused = check_settings(&store(&[(Block::Model, &short)]), &strong, &BUILT_IN);
        assert!(
            matches!(refused, Err(Reason::BadSettings { field, .. }) if field == Field::named("proportional_gain"))
        );
        let refused = check_model(&store(&[(Block::Settings, &strong)]), &short, &BUILT_IN);
        assert!(matches!(refused, Err(Reason::BadModel { field, .. }) if field == Field::named("proportional_gain")));
        assert_eq!(check_model(&store(&[]), &short, &BUILT_IN), Ok(()));
    }
}
