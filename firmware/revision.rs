//! The git revision for build scripts.

use std::process::Command;

/// Sets `GIT_REVISION` for the package: twelve digits, or `unknown` in a source archive without git history.
pub(crate) fn set() {
    let git = |args: &[&str]| {
        let output = Command::new("git").args(args).output().ok().filter(|output| output.status.success())?;
        Some(String::from_utf8_lossy(&output.stdout).trim().to_owned())
    };
    println!("cargo:rustc-env=GIT_REVISION={}", git(&["rev-parse", "--short=12", "HEAD"]).unwrap_or("unknown".into()));
    if let Some(log) = git(&["rev-parse", "--path-format=absolute", "--git-path", "logs/HEAD"]) {
        println!("cargo:rerun-if-changed={log}");
    }
}
