//! Runs `vsj` as a user would, in a folder of its own.

use std::path::Path;
use std::process::{Command, Output};
use std::sync::OnceLock;

use serde_json::Value;

/// `vsj` with `arguments`, in `folder`.
///
/// # Panics
/// If it cannot be built or started.
pub fn vsj(folder: &Path, arguments: &[&str]) -> Output {
    static BUILT: OnceLock<escargot::CargoRun> = OnceLock::new();
    let built = BUILT.get_or_init(|| {
        let manifest = concat!(env!("CARGO_MANIFEST_DIR"), "/../host-sim/Cargo.toml");
        // Optimised: the tests run hundreds of thousands of ticks.
        escargot::CargoBuild::new().manifest_path(manifest).bin("vsj").release().run().expect("vsj builds")
    });
    Command::new(built.path()).args(arguments).current_dir(folder).output().expect("vsj starts")
}

/// What `vsj` prints as JSON, nothing else being on stdout.
///
/// # Panics
/// If it fails, or prints anything else.
pub fn json(folder: &Path, arguments: &[&str]) -> Value {
    let output = vsj(folder, arguments);
    assert!(output.status.success(), "{arguments:?}: {}", text(&output.stderr));
    serde_json::from_slice(&output.stdout).expect("one JSON object on stdout")
}

/// Bytes as text.
pub fn text(bytes: &[u8]) -> String {
    String::from_utf8_lossy(bytes).into_owned()
}
