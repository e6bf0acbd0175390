//! The wheel of the Python package.

use std::fs;
use std::path::{Path, PathBuf};

use anyhow::{Context, Result, bail, ensure};
use xtask::{files, python, shell};

use crate::package::REQUIREMENTS;

/// Imports the installed package and identifies a record with it.
const TRY: &str = "import sys, vsj; print(vsj.identify(sys.argv[1]).to_json())";
/// Record that [`TRY`] reads.
const RECORD: &str = "data/sample_hysteresis.csv";

/// Builds the wheel for this host into `folder`, and tries it: it is installed below `target`, imported, and has to identify a record as
/// `program`, the command, does.
pub(super) fn build(target: &Path, program: &Path, folder: &Path) -> Result<()> {
    let python = python::environment(target, "python", REQUIREMENTS)?;
    let maturin = python.with_file_name(format!("maturin{}", std::env::consts::EXE_SUFFIX));
    let build = ["build", "--quiet", "--locked", "--manifest-path", "python/Cargo.toml", "--profile", "dist", "--out"];
    // In the same folder: what package and command depend on with the same features and profile is built once.
    let mut command = shell::command(maturin);
    shell::run(command.args(build).arg(folder).arg("--interpreter").arg(&python).env("CARGO_TARGET_DIR", target))?;
    let wheel = only_wheel(folder)?;
    let listed = shell::output(shell::command(&python).args(["-m", "zipfile", "--list"]).arg(&wheel))?;
    check(&listed)?;
    let installed = target.join("tmp").join("wheel");
    files::remove(&installed)?;
    let install = ["-m", "pip", "install", "--quiet", "--no-deps", "--no-index", "--target"];
    shell::run(shell::command(&python).args(install).arg(&installed).arg(&wheel))?;
    let found = shell::json(shell::command(&python).args(["-c", TRY, RECORD]).env("PYTHONPATH", &installed))?;
    let expected = shell::json(shell::command(program).args(["identify", RECORD, "--json"]))?;
    ensure!(found == expected, "{}: {found}\nexpected as of the command: {expected}", wheel.display());
    Ok(())
}

/// The wheel in a folder that has nothing else, of this version and for Python 3.9 and later.
fn only_wheel(folder: &Path) -> Result<PathBuf> {
    let found = fs::read_dir(folder).with_context(|| format!("cannot read {}", folder.display()))?;
    let found = found.map(|entry| Ok(entry?.path())).collect::<Result<Vec<_>>>()?;
    let [wheel] = &found[..] else { bail!("{}: {} files; expected one wheel", folder.display(), found.len()) };
    let name = wheel.file_name().unwrap_or_default().to_string_lossy();
    let start = format!("vsj-{}-cp39-abi3-", env!("CARGO_PKG_VERSION"));
    ensure!(name.starts_with(&start) && name.ends_with(".whl"), "{name}: expected {start}PLATFORM.whl");
    Ok(wheel.clone())
}

/// Checks the list of a wheel's files: the package, its types, its compiled part and its metadata; neither tests nor sources.
fn check(listed: &str) -> Result<()> {
    let names: Vec<&str> = listed.lines().filter_map(|line| line.split_whitespace().next()).collect();
    for wanted in ["vsj/__init__.py", "vsj/py.typed", "vsj/_vsj.pyi", "vsj/fleet/__init__.py", ".dist-info/METADATA"] {
        ensure!(names.iter().any(|name| name.ends_with(wanted)), "the wheel has no {wanted}; it has {names:?}");
    }
    let is_compiled = |name: &&&str| name.starts_with("vsj/_vsj.") && !name.ends_with(".pyi");
    ensure!(names.iter().filter(is_compiled).count() == 1, "expected one compiled part; the wheel has {names:?}");
    for name in &names {
        ensure!(!name.contains("test") && !name.ends_with(".rs"), "{name} does not belong in a wheel");
    }
    Ok(())
}

#[cfg(test)]
mod tests {
    use super::*;

    const LISTED: &str = "\
File Name                                             Modified             Size
vsj/__init__.py                                2026-11-30 12:00:00         1000
vsj/_vsj.abi3.so                               2026-11-30 12:00:00      5000000
vsj/_vsj.pyi                                   2026-11-30 12:00:00         4000
vsj/fleet/__init__.py                          2026-11-30 12:00:00         1000
vsj/py.typed                                   2026-11-30 12:00:00            0
vsj-0.1.0.dist-info/METADATA                   2026-11-30 12:00:00         2000
";

    #[test]
    fn a_wheel_without_a_part_or_with_a_test_is_refused() {
        check(LISTED).unwrap();
        for line in LISTED.lines().skip(1) {
            let without = LISTED.replace(&format!("{line}\n"), "");
            assert!(check(&without).is_err(), "{line}");
        }
        let error = check(&(LISTED.to_owned() + "vsj/test_files.py 2026-11-30 12:00:00 1\n")).unwrap_err();
        assert_eq!(error.to_string(), "vsj/test_files.py does not belong in a wheel");
    }

    #[test]
    fn only_one_wheel_of_this_version_is_accepted() {
        let folder = shell::target_directory().unwrap().join("tmp").join(format!("wheels-{}", std::process::id()));
        files::remove(&folder).unwrap();
        files::make(&folder).unwrap();
        assert!(only_wheel(&folder).is_err());
        files::write(&folder.join("vsj-0.0.1-cp39-abi3-any.whl"), "").unwrap();
        assert!(only_wheel(&folder).unwrap_err().to_string().contains("expected vsj-"));
        files::remove(&folder).unwrap();
        files::make(&folder).unwrap();
        let name = format!("vsj-{}-cp39-abi3-linux_x86_64.whl", env!("CARGO_PKG_VERSION"));
        files::write(&folder.join(&name), "").unwrap();
        assert_eq!(only_wheel(&folder).unwrap(), folder.join(name));
        files::write(&folder.join("other.whl"), "").unwrap();
        assert!(only_wheel(&folder).is_err());
        files::remove(&folder).unwrap();
    }
}
