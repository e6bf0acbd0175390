//! Frames on the serial link, and models of the spring and settings in them.

use link::{
    Action, Frame, Message, Notice, Packet, Receiver, Reply, Request, Session, Unreadable, WireModel, WireSettings,
};

/// Bytes on the line: what is read is the message that was sent, and a session survives everything.
pub(super) fn wire(bytes: &[u8]) {
    messages(bytes);
    let mut session = Session::new(100, 7);
    for (now, &byte) in (0..).zip(bytes) {
        if let Some(Action::Apply(_)) = session.on_byte(byte, now) {
            let reply = Reply::Telemetry(link::Telemetry { tick: now, ..link::Telemetry::default() });
            assert!(!session.answer(&reply).is_empty());
        }
        if session.telemetry_due(now) {
            assert!(!session.telemetry(link::Telemetry::default(), now).is_empty());
        }
    }
    // The payload of a model, which the MCU gets in parts.
    if let Some(model) = WireModel::read(bytes)
        && let Some(payload) = model.payload()
    {
        let again = WireModel::read(&payload).expect("a payload is read");
        assert_eq!(format!("{again:?}"), format!("{model:?}"), "the model changes on the wire");
    }
    // The payload of settings.
    if let Some(settings) = WireSettings::read(bytes)
        && let Some(payload) = settings.payload()
    {
        let again = WireSettings::read(&payload).expect("a payload is read");
        assert_eq!(format!("{again:?}"), format!("{settings:?}"), "the settings change on the wire");
        // Whatever they hold, a check ends without a panic.
        let checked = settings.over(&model::device::Settings::PAPER).map(|settings| settings.check().is_ok());
        assert!(checked.is_ok(), "a host has every controller");
    }
}

/// The numbers of requests, replies and notices that are read, each the same after it was sent once more.
///
/// # Panics
/// If a message is another one then.
pub fn messages(bytes: &[u8]) -> [usize; 3] {
    let mut receiver = Receiver::new();
    let mut read = [0; 3];
    for &byte in bytes {
        if let Some(packet) = receiver.on_byte(byte) {
            let is =
                [check_message::<Request>(&packet), check_message::<Reply>(&packet), check_message::<Notice>(&packet)];
            read.iter_mut().zip(is).for_each(|(count, is)| *count += usize::from(is));
        }
    }
    read
}

/// Whether a message is read, which has to be the same after it was sent once more.
fn check_message<M: Message + std::fmt::Debug>(packet: &Packet<'_>) -> bool {
    let message = match packet.read::<M>() {
        Ok(message) => message,
        Err(Unreadable::Kind | Unreadable::Message | Unreadable::Version(_)) => return false,
    };
    let frame = Frame::new(packet.session().stamp(packet.sequence), &message);
    let mut receiver = Receiver::new();
    let again =
        frame.as_bytes().iter().find_map(|&byte| receiver.on_byte(byte).and_then(|packet| packet.read::<M>().ok()));
    // Compared as text, since NaN is a possible value.
    assert_eq!(
        again.map(|again| format!("{again:?}")),
        Some(format!("{message:?}")),
        "the message changes on the wire"
    );
    true
}
