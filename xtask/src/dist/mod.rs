//! `cargo xtask dist`: the files of a release.
//!
//! In: the sources as they are. Out: a folder and its archive with `vsj` for this host, its manual pages and completions, the library
//! that `vsj export fmu` packs, the C library with its header for this host and for a Cortex-M4, the images of both boards for each
//! controller and amplifier, the Python package as a wheel, the manual, the page for a browser, this version's changes, the licences of all dependencies, and the
//! SHA-256 of every file.

mod licences;
mod wheel;

use std::fs;
use std::path::{Path, PathBuf};

use anyhow::{Context, Result, bail, ensure};
use sha2::{Digest, Sha256};
use xtask::build::{self, Board};
use xtask::files;
use xtask::shell;
use xtask::variant::Variant;

use crate::{image, manual, page};

/// The project's own texts.
const TEXTS: [&str; 4] = ["README.md", "CHANGELOG.md", "LICENSE-APACHE", "LICENSE-MIT"];
/// Shells and the usual names of their completions.
const COMPLETIONS: [(&str, &str); 3] = [("bash", "vsj.bash"), ("zsh", "_vsj"), ("fish", "vsj.fish")];
/// File with the checksums, in the form that `sha256sum --check` reads.
const CHECKSUMS: &str = "SHA256SUMS";

/// Makes folder and archive, and prints their paths. A folder of an earlier run is replaced once the new one is complete.
pub(crate) fn run() -> Result<()> {
    let target = shell::target_directory()?;
    let (version, host) = (env!("CARGO_PKG_VERSION"), host()?);
    let name = format!("vsj-{version}-{host}");
    let releases = target.join("releases");
    let (folder, new) = (releases.join(&name), releases.join("new"));
    files::remove(&new)?;
    files::make(&new)?;
    let program = program(&target)?;
    files::copy(&program, &new.join(program.file_name().context("a program has a name")?))?;
    commands(&program, &new)?;
    libraries(&target, &program, &host, &new)?;
    images(&new.join("firmware"))?;
    wheel::build(&target, &program, &new.join("python"))?;
    for text in TEXTS {
        files::copy(&shell::root().join(text), &new.join(text))?;
    }
    copy_folder(&manual::build(&program)?, &new.join("manual"))?;
    copy_folder(&page::build()?, &new.join("page"))?;
    let changes = fs::read_to_string(shell::root().join("CHANGELOG.md")).context("cannot read CHANGELOG.md")?;
    files::write(&new.join("CHANGES.md"), section(&changes, version)?)?;
    files::write(
        &new.join("THIRD-PARTY.txt"),
        licences::all(&["host-sim", "firmware", "test-bench", "page", "vsj-python"])?,
    )?;
    files::write(&new.join(CHECKSUMS), checksums(&new)?)?;
    files::remove(&folder)?;
    fs::rename(&new, &folder).with_context(|| format!("cannot write {}", folder.display()))?;
    let archive = releases.join(format!("{name}.tar.gz"));
    shell::run(shell::command("tar").arg("-C").arg(&releases).arg("-czf").args([archive.as_os_str(), name.as_ref()]))?;
    println!("{}\n{}", folder.display(), archive.display());
    Ok(())
}

/// The target triple of this machine.
fn host() -> Result<String> {
    let about = shell::output(shell::command("rustc").arg("-vV"))?;
    let line = about.lines().find_map(|line| line.strip_prefix("host: "));
    Ok(line.context("`rustc -vV` names no host")?.to_owned())
}

/// Builds `vsj` without symbols. Returns its path.
fn program(target: &Path) -> Result<PathBuf> {
    let mut command = shell::cargo();
    command.args(["build", "--quiet", "--locked", "--profile", "dist", "-p", "host-sim", "--bin", "vsj"]);
    shell::run(&mut command)?;
    Ok(target.join("dist").join(format!("vsj{}", std::env::consts::EXE_SUFFIX)))
}

/// Writes manual pages and completions, which `vsj` itself makes.
fn commands(program: &Path, folder: &Path) -> Result<()> {
    shell::output(shell::command(program).arg("man").arg("--out").arg(folder.join("man")))?;
    let completions = folder.join("completions");
    files::make(&completions)?;
    for (shell_name, file) in COMPLETIONS {
        let script = shell::output(shell::command(program).args(["completions", shell_name]))?;
        files::write(&completions.join(file), script)?;
    }
    Ok(())
}

/// Copies the library that `vsj` finds beside itself, and writes the folder `c`: settings, header and example of `vsj export c`, and
/// the library for this host and for the MCU.
fn libraries(target: &Path, program: &Path, host: &str, folder: &Path) -> Result<()> {
    let file = format!("{}vsj_fmu{}", std::env::consts::DLL_PREFIX, std::env::consts::DLL_SUFFIX);
    // Built with `vsj`, which depends on it.
    files::copy(&target.join("dist/deps").join(&file), &folder.join(&file))?;
    let c = folder.join("c");
    shell::output(shell::command(program).args(["export", "c", "--out"]).arg(&c))?;
    for (name, library) in [(host, build::c_library(false)?), (shell::MCU, build::c_library(true)?)] {
        files::copy(&library, &c.join("lib").join(name).join(library.file_name().context("a library has a name")?))?;
    }
    Ok(())
}

/// Copies the images of both boards for each controller and amplifier.
fn images(folder: &Path) -> Result<()> {
    files::make(folder)?;
    for variant in Variant::ALL {
        for board in Board::ALL {
            for file in image::files(variant, board)? {
                let mut name = file.file_name().context("an image has a name")?.to_owned();
                if file.extension().is_none() {
                    name.push(".elf");
                }
                files::copy(&file, &folder.join(name))?;
            }
        }
    }
    Ok(())
}

/// Copies a folder with all that it contains.
fn copy_folder(from: &Path, to: &Path) -> Result<()> {
    let mut found = Vec::new();
    list(from, &mut found)?;
    for file in found {
        files::copy(&file, &to.join(file.strip_prefix(from)?))?;
    }
    Ok(())
}

/// The part of the changes that is about a version, without its heading.
fn section<'a>(changes: &'a str, version: &str) -> Result<&'a str> {
    let heading = format!("\n## [{version}]");
    let Some((_, after)) = changes.split_once(&heading) else {
        bail!("CHANGELOG.md: no section `## [{version}]`; expected the changes of the version that is packed");
    };
    let after = after.split_once('\n').map_or("", |(_, after)| after);
    let section = after.split("\n## [").next().unwrap_or_default().trim();
    ensure!(!section.is_empty(), "CHANGELOG.md: the section `## [{version}]` is empty; expected the changes");
    Ok(section)
}

/// One line for each file below a folder: SHA-256 and path.
fn checksums(folder: &Path) -> Result<String> {
    let mut found = Vec::new();
    list(folder, &mut found)?;
    found.sort();
    let line = |file: &PathBuf| -> Result<String> {
        let sum: String = Sha256::digest(build::read(file)?).iter().map(|byte| format!("{byte:02x}")).collect();
        Ok(format!("{sum}  {}\n", file.strip_prefix(folder)?.display()))
    };
    found.iter().map(line).collect()
}

fn list(folder: &Path, found: &mut Vec<PathBuf>) -> Result<()> {
    for entry in fs::read_dir(folder).with_context(|| format!("cannot read {}", folder.display()))? {
        let path = entry?.path();
        if path.is_dir() { list(&path, found)? } else { found.push(path) }
    }
    Ok(())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_changes_of_one_version_end_at_the_next_heading() {
        let changes = "# Changelog\n\n## [0.2.0] - soon\n\n### Added\n- b\n\n## [0.1.0] - once\n- a\n\n## [0.0.1]\n";
        assert_eq!(section(changes, "0.2.0").unwrap(), "### Added\n- b");
        assert_eq!(section(changes, "0.1.0").unwrap(), "- a");
        for version in ["0.0.1", "0.3.0"] {
            assert!(section(changes, version).unwrap_err().to_string().contains("expected the changes"));
        }
        assert!(section(include_str!("../../../CHANGELOG.md"), env!("CARGO_PKG_VERSION")).is_ok());
    }
}
