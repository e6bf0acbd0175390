//! The program under test.

use std::path::{Path, PathBuf};
use std::process::{Command, Output};
use std::sync::OnceLock;

use serde_json::Value;

/// The command `vsj`, to be run in this package's folder: the file that the variable `VSJ` names. Without it the command is built at the
/// first call, because cargo does not build binaries of other packages for a test.
pub fn vsj() -> Command {
    static BUILT: OnceLock<PathBuf> = OnceLock::new();
    let program = BUILT.get_or_init(|| {
        if let Some(built) = std::env::var_os("VSJ") {
            return built.into();
        }
        // The test is TARGET/PROFILE/deps/NAME.
        let test = std::env::current_exe().expect("a test has a path");
        let target = test.ancestors().nth(3).expect("a test is below the target folder");
        let cargo = std::env::var_os("CARGO").unwrap_or_else(|| "cargo".into());
        let built = Command::new(cargo)
            .args(["build", "--quiet", "--release", "--package", "host-sim", "--bin", "vsj", "--target-dir"])
            .arg(target)
            .current_dir(env!("CARGO_MANIFEST_DIR"))
            .status();
        assert!(built.is_ok_and(|status| status.success()), "vsj does not build");
        target.join("release").join(format!("vsj{}", std::env::consts::EXE_SUFFIX))
    });
    let mut command = Command::new(program);
    command.current_dir(env!("CARGO_MANIFEST_DIR"));
    command
}

/// Runs `vsj` with `arguments` in `folder`.
pub fn run(folder: &Path, arguments: &[&str]) -> Output {
    vsj().args(arguments).current_dir(folder).output().expect("vsj starts")
}

/// Runs `vsj` successfully with `arguments` in `folder` and parses its stdout as one JSON object.
pub fn json(folder: &Path, arguments: &[&str]) -> Value {
    let output = run(folder, arguments);
    assert!(output.status.success(), "{arguments:?}: {}", text(&output.stderr));
    serde_json::from_slice(&output.stdout).expect("one JSON object on stdout")
}

/// Converts UTF-8 bytes to text.
pub fn text(bytes: &[u8]) -> String {
    String::from_utf8_lossy(bytes).into_owned()
}

/// Compares with a file below `golden/`; with `GOLDEN=write` in the environment, writes it instead.
pub fn golden(name: &str, found: &str) {
    let path = Path::new(env!("CARGO_MANIFEST_DIR")).join("golden").join(name);
    if std::env::var_os("GOLDEN").is_some_and(|what| what == "write") {
        std::fs::write(&path, found).unwrap_or_else(|e| panic!("{}: {e}", path.display()));
        return;
    }
    let expected = std::fs::read_to_string(&path).unwrap_or_else(|e| panic!("{}: {e}", path.display()));
    assert!(
        found == expected,
        "{} differs from the output; GOLDEN=write replaces it. Output:\n{found}",
        path.display()
    );
}
