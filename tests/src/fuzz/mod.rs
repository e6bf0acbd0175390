//! What must hold for any bytes that come in, one function for each format: libFuzzer calls them (`cargo xtask fuzz`), and
//! so do ordinary tests, with the same corpora.
//!
//! In: bytes from a file, a port or a fuzzer. Out: nothing, or a panic that says which property is violated. That nothing
//! else panics, overflows or is read out of bounds is a property of every call.

pub mod frames;
mod logs;
mod plants;
mod recordings;
mod servers;
mod settings;
mod tables;
mod texts;

/// A check of all properties of one format for some bytes.
pub type Check = fn(&[u8]);

/// Name of each format, as that of its target and corpus, and its check.
pub const TARGETS: &[(&str, Check)] = &[
    ("csv", tables::csv),
    ("mcap", tables::mcap),
    ("parquet", tables::parquet),
    ("schedule", tables::schedule),
    ("plant", plants::plant),
    ("log", logs::log),
    ("elf", logs::elf),
    ("recording", recordings::recording),
    ("wire", frames::wire),
    ("server", servers::server),
    ("plan", texts::plan),
    ("columns", texts::columns),
    ("settings", settings::settings),
];

/// Runs the check of a format by its name.
///
/// # Panics
/// If a property is violated, or there is no such format.
pub fn run(name: &str, bytes: &[u8]) {
    let target = TARGETS.iter().find(|(target, _)| *target == name);
    target.unwrap_or_else(|| panic!("no target {name}")).1(bytes);
}

/// Checks an error for the user: one line that begins with the name of the file.
fn check_error(error: &anyhow::Error, name: &str) {
    let text = format!("{error:#}");
    assert!(error.is::<simulation::BadInput>(), "an error of another kind: {text}");
    assert!(text.starts_with(name) && !text.contains(['\n', '\r']), "not one line with the name of the file: {text:?}");
}
