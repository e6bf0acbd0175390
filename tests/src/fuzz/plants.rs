//! Plant files.

use link::WireModel;
use simulation::plant_file::{PlantFile, parse, parse_for_host};

use super::check_error;

/// A plant file: what is accepted reads the same after it was written, and what the tick accepts can be sent to the MCU.
pub(super) fn plant(bytes: &[u8]) {
    let text = String::from_utf8_lossy(bytes);
    match parse_for_host("file", &text) {
        Ok(file) => check_written(&file, |text| parse_for_host("again", text)),
        Err(error) => check_error(&error, "file"),
    }
    match parse("file", &text) {
        Ok(file) => {
            check_written(&file, |text| parse("again", text));
            let wire = file.wire().expect("an accepted plant can be sent");
            let payload = wire.payload().expect("a model that can be sent has a payload");
            assert_eq!(WireModel::read(&payload), Some(wire), "the model changes on the wire");
        }
        Err(error) => check_error(&error, "file"),
    }
}

fn check_written(file: &PlantFile, parse: impl Fn(&str) -> anyhow::Result<PlantFile>) {
    let text = file.to_toml().expect("an accepted plant can be written");
    let again = parse(&text).expect("a written plant is accepted");
    // NaN is possible among values that are kept but not read.
    assert_eq!(format!("{again:?}"), format!("{file:?}"), "the plant changes when it is written and read:\n{text}");
}
