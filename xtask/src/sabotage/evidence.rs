//! What breaks when a promise does: a test, a drill or a boot run, by its name in `docs/promises.md`.

#[cfg(test)]
use std::collections::BTreeSet;
use std::fmt;
use std::fs;
use std::path::Path;

use anyhow::{Context, Result, bail};
use xtask::shell;

/// Packages that are tested alone, because the little that they depend on is compiled in seconds, and their features beside the
/// default ones. The others are tested as parts of the workspace, so that what they share is compiled once.
const ALONE: [(&str, &str); 3] = [("vsj-model", ""), ("vsj-link", ""), ("firmware", "fast,robust,adaptation")];

/// What all of them are compiled with, as by `cargo xtask mutants`: what has not changed is not compiled again.
pub(super) const PROFILE: &str = "mutants";

/// One piece of evidence.
#[derive(Clone, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub(super) enum Evidence {
    /// A test: the file below the workspace's root, and the name of the function.
    Test(String, String),
    /// A drill under QEMU.
    Drill(String),
    /// A run of the flashed image on register models.
    Boot(String),
}

impl fmt::Display for Evidence {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Test(file, name) => write!(f, "{file}::{name}"),
            Self::Drill(name) => write!(f, "drill {name}"),
            Self::Boot(name) => write!(f, "boot {name}"),
        }
    }
}

impl Evidence {
    /// Reads `FILE::NAME`, `drill NAME` or `boot NAME`.
    pub(super) fn parse(text: &str) -> Option<Self> {
        if let Some(name) = text.strip_prefix("drill ") {
            return Some(Self::Drill(name.to_owned()));
        }
        if let Some(name) = text.strip_prefix("boot ") {
            return Some(Self::Boot(name.to_owned()));
        }
        let (file, name) = text.split_once("::")?;
        file.ends_with(".rs").then(|| Self::Test(file.to_owned(), name.to_owned()))
    }

    /// The evidence that a page names: tests between backticks, drills and boot runs as ``drill `NAME` ``.
    #[cfg(test)]
    pub(super) fn of_page(page: &str) -> BTreeSet<Self> {
        // Every second piece is between backticks.
        let pieces: Vec<&str> = page.split('`').collect();
        let quoted = pieces.chunks_exact(2).filter_map(|pair| {
            let [before, quoted] = pair else { return None };
            let kind = ["drill ", "boot "].into_iter().find(|kind| before.ends_with(kind));
            Self::parse(&format!("{}{quoted}", kind.unwrap_or_default()))
        });
        quoted.collect()
    }
}

/// A program of tests, as cargo is asked for it.
#[derive(Clone, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub(super) struct Program {
    /// Arguments of `cargo test`.
    pub(super) arguments: Vec<String>,
    /// Modules of the file within the program, as the names of its tests begin.
    pub(super) modules: String,
}

impl Program {
    /// The program that a file of the workspace is compiled into.
    pub(super) fn of(file: &str) -> Result<Self> {
        let is_package = |folder: &&Path| shell::root().join(folder).join("Cargo.toml").exists();
        let folder = Path::new(file).ancestors().skip(1).find(is_package).context("no package")?;
        let manifest: toml::Table = fs::read_to_string(shell::root().join(folder).join("Cargo.toml"))?.parse()?;
        let package = manifest.get("package").and_then(|it| it.get("name")?.as_str());
        let package = package.with_context(|| format!("{} names no package", folder.display()))?;
        let alone = ALONE.iter().find(|(name, _)| *name == package).map(|(_, features)| *features);
        let below = Path::new(file).strip_prefix(folder)?.with_extension("");
        let parts: Vec<&str> = below.iter().filter_map(|part| part.to_str()).collect();
        let is_library = shell::root().join(folder).join("src/lib.rs").exists();
        let (target, modules) = match parts.as_slice() {
            ["src", modules @ ..] if is_library => (vec!["--lib"], modules),
            ["src", modules @ ..] => (vec!["--bin", package], modules),
            ["tests", program, modules @ ..] => (vec!["--test", program], modules),
            _ => bail!("{file} belongs to no program of tests"),
        };
        let mut arguments = match alone {
            Some(features) => vec!["-p", package, "--features", features],
            None if target == ["--lib"] => vec!["-p", package],
            None => vec!["--workspace", "--exclude=vsj-python"],
        };
        arguments.extend(["--profile", PROFILE].iter().chain(&target));
        let modules = modules.iter().filter(|name| !["mod", "lib", "main"].contains(name));
        Ok(Self {
            arguments: arguments.into_iter().map(str::to_owned).collect(),
            modules: modules.map(|name| format!("{name}::")).collect(),
        })
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn evidence_is_read_as_a_page_names_it() {
        let page = "`cargo xtask boot`: boot `late tick`, drill `hang`; `a/b.rs::c` and `no evidence`";
        let found: Vec<String> = Evidence::of_page(page).iter().map(Evidence::to_string).collect();
        assert_eq!(found, ["a/b.rs::c", "drill hang", "boot late tick"]);
        assert!(found.iter().all(|text| Evidence::parse(text).is_some_and(|it| it.to_string() == *text)));
    }

    #[test]
    fn a_file_leads_to_its_program_and_modules() {
        for (file, arguments, modules) in [
            (
                "model/src/supervisor/tests/states.rs",
                "-p vsj-model --features  --profile mutants --lib",
                "supervisor::tests::states::",
            ),
            ("model/tests/controller.rs", "-p vsj-model --features  --profile mutants --test controller", ""),
            (
                "firmware/src/store/mod.rs",
                "-p firmware --features fast,robust,adaptation --profile mutants --lib",
                "store::",
            ),
            (
                "host-sim/tests/link/command.rs",
                "--workspace --exclude=vsj-python --profile mutants --test link",
                "command::",
            ),
            ("link-host/src/client.rs", "-p link-host --profile mutants --lib", "client::"),
            (
                "emulation/src/soak/mod.rs",
                "--workspace --exclude=vsj-python --profile mutants --bin emulation",
                "soak::",
            ),
        ] {
            let program = Program::of(file).unwrap();
            assert_eq!(
                (program.arguments.join(" ").as_str(), program.modules.as_str()),
                (arguments, modules),
                "{file}"
            );
        }
        assert!(Program::of("docs/promises.md").is_err());
    }
}
