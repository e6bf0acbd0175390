//! `cargo xtask deny`: licences, duplicates, sources and known vulnerabilities of all dependencies.

use anyhow::{Context, Result};
use xtask::shell;
use xtask::tool::Tool;

const TOOL: Tool = Tool { name: "cargo-deny", version: "0.20.2" };

/// Checks what `deny.toml` says. The advisories need a database from the network: if it cannot be had, that is said and is
/// a failure only with `require_advisories`.
pub(crate) fn run(require_advisories: bool) -> Result<()> {
    let program = TOOL.program()?;
    shell::run(shell::command(&program).args(["--offline", "check", "licenses", "bans", "sources"]))?;
    let advisories = shell::run(shell::command(&program).args(["check", "advisories"]));
    match advisories {
        Err(error) if !require_advisories => {
            println!("licences, bans and sources are as deny.toml wants; advisories NOT checked: {error:#}");
            Ok(())
        }
        other => {
            other.context("advisories")?;
            println!("licences, bans, sources and advisories are as deny.toml wants");
            Ok(())
        }
    }
}
