//! `cargo xtask deny`: licences, duplicates, sources and known vulnerabilities of all dependencies.

use anyhow::Result;
use xtask::shell;
use xtask::tally::Tally;
use xtask::tool::Tool;

const TOOL: Tool = Tool { name: "cargo-deny", version: "0.20.2" };

/// Checks what `deny.toml` says. The advisories need RustSec's database, which cargo-deny clones from GitHub: if it cannot be
/// had, that is said and is a failure only with `require_advisories`.
pub(crate) fn run(require_advisories: bool) -> Result<()> {
    let program = TOOL.program()?;
    // Those that only other platforms compile as well: the offline check reads their licences.
    shell::run(shell::cargo().args(["fetch", "--quiet", "--locked"]))?;
    let check = ["check", "--hide-inclusion-graph"];
    shell::run(shell::command(&program).arg("--offline").args(check).args(["licenses", "bans", "sources"]))?;
    let metadata = ["metadata", "--all-features", "--locked", "--offline", "--format-version=1"];
    let packages = shell::json(shell::cargo().args(metadata))?["packages"].as_array().map_or(0, Vec::len) as u64;
    let compared = match shell::run(shell::command(&program).args(check).arg("advisories")) {
        Ok(()) => {
            println!("licences, duplicates, sources and advisories are as deny.toml wants");
            packages
        }
        Err(error) if !require_advisories => {
            println!("licences, duplicates and sources are as deny.toml wants; advisories NOT checked: {error:#}");
            0
        }
        Err(error) => return Err(error.context("advisories")),
    };
    let counts = [
        ("packages: licence, source and versions as deny.toml wants", packages),
        ("packages: compared with the known vulnerabilities", compared),
    ];
    Tally::now(counts.map(|(what, count)| (what.to_owned(), count)))?.write("deny")
}
