//! Settings files.

use link::WireSettings;
use model::device;
use simulation::settings_file::{SettingsFile, Source};

use super::check_error;

/// A settings file: what is accepted is valid on the MCU too, survives the wire, and reads the same after it was written.
pub(super) fn settings(bytes: &[u8]) {
    let text = String::from_utf8_lossy(bytes);
    let built_in = WireSettings::new(&device::Settings::PAPER);
    let over = |name: &str, text: &str| Source::parse(name, text)?.over(&built_in);
    match over("file", &text) {
        Ok(wire) => {
            let settings = wire.over(&device::Settings::PAPER).expect("a host has every controller");
            settings.check().expect("accepted settings are valid");
            let payload = wire.payload().expect("accepted settings have a payload");
            assert_eq!(WireSettings::read(&payload), Some(wire), "the settings change on the wire");
            let text = SettingsFile::from(&wire).to_toml().expect("settings can be written");
            assert_eq!(over("again", &text).expect("written settings are accepted"), wire, "{text}");
        }
        Err(error) => check_error(&error, "file"),
    }
}
