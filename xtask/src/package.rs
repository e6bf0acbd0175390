//! `cargo xtask python`: the Python package, installed as a user installs it, and its tests.

use std::env;
use std::path::Path;

use anyhow::{Context, Result};
use xtask::{build, python, shell};

/// Folder of the package.
const FOLDER: &str = "./python";
/// The packages that its tests need, those of the fleet included.
pub(crate) const REQUIREMENTS: &str = "python/requirements.txt";

/// Options of `cargo xtask python`.
#[derive(clap::Args)]
pub(crate) struct Args {
    /// One part alone
    #[arg(long, value_enum, value_name = "PART")]
    only: Option<Part>,

    /// Profile in which cargo builds the package
    #[arg(long, value_name = "PROFILE", default_value = RELEASE)]
    profile: String,
}

/// The profile that users install.
pub(crate) const RELEASE: &str = "release";

/// A part of the command.
#[derive(Clone, Copy, PartialEq, Eq, clap::ValueEnum)]
enum Part {
    /// Build the package and install it
    Install,
    /// Run the tests of the installed package
    Test,
}

/// Installs the package in a virtual environment under the target directory, and runs its tests there, which compare it with `vsj`.
pub(crate) fn run(args: &Args) -> Result<()> {
    let target = shell::target_directory()?;
    let python = python::environment(&target, "python", REQUIREMENTS)?;
    if args.only != Some(Part::Test) {
        install(&python, &target, &args.profile)?;
    }
    if args.only != Some(Part::Install) {
        let tests = ["-m", "pytest", "-q", "-p", "no:cacheprovider", "python/tests"];
        shell::run(shell::command(&python).args(tests).env("VSJ", build::vsj()?))?;
    }
    Ok(())
}

/// Installs the package in the virtual environment of an interpreter, which has maturin.
pub(crate) fn install(python: &Path, target: &Path, profile: &str) -> Result<()> {
    // In the same folder: what package and command depend on with the same features and profile is built once.
    let install = ["-m", "pip", "install", "--quiet", "--no-build-isolation", "--no-deps", "--force-reinstall", FOLDER];
    let path = with_first(python.parent().context("an interpreter is in a folder")?)?;
    let profile = format!("--profile {profile}");
    let mut command = shell::command(python);
    command.args(install).env("MATURIN_PEP517_ARGS", profile).env("CARGO_TARGET_DIR", target).env("PATH", path);
    shell::run(&mut command)
}

/// The search path with a folder in front.
fn with_first(folder: &Path) -> Result<std::ffi::OsString> {
    let path = env::var_os("PATH").unwrap_or_default();
    Ok(env::join_paths([folder.to_owned()].into_iter().chain(env::split_paths(&path)))?)
}

#[cfg(test)]
mod tests {
    use std::collections::{BTreeMap, BTreeSet};

    use xtask::shell;

    /// Features of each crate that a build of `packages` takes, by name and version.
    fn features(packages: &[&str], edges: &str) -> BTreeMap<String, BTreeSet<String>> {
        let tree = ["tree", "--prefix", "none", "--format", "{p}|{f}", "--edges", edges];
        let printed = shell::run_and_read(shell::cargo().args(tree).args(packages)).unwrap();
        let mut features = BTreeMap::<_, BTreeSet<_>>::new();
        for line in printed.lines().filter(|line| !line.is_empty()) {
            let (name, of) = line.trim_end_matches(" (*)").split_once('|').unwrap();
            features.entry(name.to_owned()).or_default().insert(of.to_owned());
        }
        features
    }

    /// One feature of one macro made cargo build every package of the workspace a second time.
    #[test]
    fn the_package_shares_what_the_other_members_have_built() {
        let others = features(&["--workspace", "--exclude=vsj-python"], "normal,build,dev");
        let package = features(&["--package=vsj-python"], "normal,build");
        let mut shared = 0;
        for (name, wanted) in &package {
            let Some(built) = others.get(name) else { continue };
            shared += 1;
            for of in wanted {
                assert!(built.contains(of), "{name}: the package wants [{of}], the other members {built:?}");
            }
        }
        assert!(shared > 20, "{shared} crates in common");
    }
}
