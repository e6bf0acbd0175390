//! Programs from the registry, of one version, under the target directory: they do not touch what the user has.

use std::path::PathBuf;
use std::process::Command;

use anyhow::{Context, Result};

use crate::shell;

/// A program that is no part of the toolchain.
#[derive(Clone, Copy, Debug)]
pub struct Tool {
    /// Name of the package and of its program.
    pub name: &'static str,
    /// The version that the project was checked with.
    pub version: &'static str,
}

impl Tool {
    /// The program, installed if it is missing: from the user's path if that has this version.
    pub fn program(&self) -> Result<PathBuf> {
        let Self { name, version } = *self;
        let folder = shell::target_directory()?.join("tools");
        let own = folder.join("bin").join(name);
        for program in [own.clone(), PathBuf::from(name)] {
            if self.is(&program) {
                return Ok(program);
            }
        }
        eprintln!("{name}: {version} is missing, installing it into {}", folder.display());
        let install = ["install", "--locked", "--quiet", name, "--version", version, "--root"];
        shell::run(shell::cargo().args(install).arg(&folder))
            .with_context(|| format!("{name} {version} is needed, and cargo cannot install it from the registry"))?;
        Ok(own)
    }

    /// Whether `program` starts and is of this version.
    fn is(&self, program: &PathBuf) -> bool {
        // `cargo-NAME` expects the name of the subcommand first.
        let output = Command::new(program).args(self.name.strip_prefix("cargo-")).arg("--version").output();
        output.is_ok_and(|output| {
            output.status.success()
                && String::from_utf8_lossy(&output.stdout)
                    .split_whitespace()
                    .any(|word| word.trim_start_matches('v') == self.version)
        })
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_program_of_another_version_or_none_is_not_used() {
        let echo = |version| Tool { name: "cargo-echo", version };
        assert!(echo("echo").is(&PathBuf::from("/bin/echo")));
        assert!(!echo("9.9.9").is(&PathBuf::from("/bin/echo")));
        assert!(!echo("echo").is(&PathBuf::from("/bin/no-such-program")));
    }
}
