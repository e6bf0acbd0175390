//! The licences of all packages that a release contains, with their texts.

use std::collections::{BTreeMap, BTreeSet};
use std::fmt::Write;
use std::fs;
use std::path::Path;

use anyhow::{Context, Result, ensure};
use serde_json::Value;
use xtask::shell;

/// First letters of the names of files with a licence, in capitals.
const NAMES: [&str; 5] = ["LICENSE", "LICENCE", "COPYING", "NOTICE", "UNLICENSE"];

/// The licences of what `roots`, packages of the workspace, are linked with, in any of their variants: each package with its
/// licence expression, then each text with the packages that contain it.
pub(super) fn all(roots: &[&str]) -> Result<String> {
    let metadata = shell::json(shell::cargo().args(["metadata", "--locked", "--format-version=1"]))?;
    let linked = linked(&metadata, roots)?;
    let mut list = String::from("Packages from the registry that this release contains, with their licences.\n\n");
    let mut texts = BTreeMap::<String, BTreeSet<String>>::new();
    let packages = metadata["packages"].as_array().context("cargo metadata lists no packages")?;
    for package in packages.iter().filter(|package| !package["source"].is_null()) {
        let text = |key: &str| package[key].as_str().unwrap_or_default();
        if !linked.contains(text("id")) {
            continue;
        }
        let name = format!("{} {}", text("name"), text("version"));
        let licence = text("license").replace('/', " OR ");
        ensure!(!licence.is_empty() || !package["license_file"].is_null(), "{name} names no licence");
        let folder = Path::new(text("manifest_path")).parent().context("a manifest is in a folder")?;
        let own = files(folder)?;
        let without_text = if own.is_empty() { " (the package contains no text)" } else { "" };
        let _ = writeln!(list, "{name}: {licence}{without_text}");
        for text in own {
            texts.entry(text).or_default().insert(name.clone());
        }
    }
    for (text, packages) in texts {
        let packages: Vec<String> = packages.into_iter().collect();
        let _ = write!(list, "\n{}\n{}\n\n{text}\n", "=".repeat(80), packages.join(", "));
    }
    Ok(list)
}

/// Identities of the packages that are linked into one of `roots`.
fn linked<'a>(metadata: &'a Value, roots: &[&str]) -> Result<BTreeSet<&'a str>> {
    let nodes = metadata["resolve"]["nodes"].as_array().context("cargo metadata has no graph")?;
    let on: BTreeMap<&str, &Value> = nodes.iter().filter_map(|node| Some((node["id"].as_str()?, node))).collect();
    let packages = metadata["packages"].as_array().context("cargo metadata lists no packages")?;
    let is_root = |package: &&Value| package["source"].is_null() && roots.iter().any(|root| package["name"] == **root);
    let mut waiting: Vec<&str> = packages.iter().filter(is_root).filter_map(|package| package["id"].as_str()).collect();
    ensure!(waiting.len() == roots.len(), "expected the packages {} in the workspace", roots.join(", "));
    let mut linked = BTreeSet::new();
    while let Some(id) = waiting.pop() {
        if !linked.insert(id) {
            continue;
        }
        let dependencies = on.get(id).and_then(|node| node["deps"].as_array());
        for dependency in dependencies.into_iter().flatten() {
            // Neither build scripts' dependencies nor those of tests are part of what is linked.
            let is_linked = |kinds: &Vec<Value>| kinds.iter().any(|kind| kind["kind"].is_null());
            if dependency["dep_kinds"].as_array().is_some_and(is_linked) {
                waiting.extend(dependency["pkg"].as_str());
            }
        }
    }
    Ok(linked)
}

/// The texts of the licences in a package's folder, in the order of their names.
fn files(folder: &Path) -> Result<Vec<String>> {
    let entries = fs::read_dir(folder).with_context(|| format!("cannot read {}", folder.display()))?;
    let mut paths: Vec<_> =
        entries.filter_map(|entry| Some(entry.ok()?.path())).filter(|path| path.is_file()).collect();
    paths.retain(|path| {
        let name = path.file_name().unwrap_or_default().to_string_lossy().to_uppercase();
        NAMES.iter().any(|start| name.starts_with(start))
    });
    paths.sort();
    let read = |path: &std::path::PathBuf| {
        let bytes = fs::read(path).with_context(|| format!("cannot read {}", path.display()))?;
        Ok(String::from_utf8_lossy(&bytes).replace("\r\n", "\n").trim().to_owned())
    };
    paths.iter().map(read).collect()
}

#[cfg(test)]
mod tests {
    use super::*;
    use serde_json::json;

    #[test]
    fn what_only_builds_or_tests_is_not_linked() {
        let dependency = |id: &str, kind: Value| json!({ "pkg": id, "dep_kinds": [{ "kind": kind }] });
        let metadata = json!({
            "packages": [{ "name": "app", "id": "app", "source": null }, { "name": "app", "id": "other", "source": "registry" }],
            "resolve": { "nodes": [
                { "id": "app", "deps": [dependency("a", Value::Null), dependency("b", json!("build")), dependency("d", json!("dev"))] },
                { "id": "a", "deps": [dependency("c", Value::Null), dependency("app", Value::Null)] },
            ] },
        });
        assert_eq!(linked(&metadata, &["app"]).unwrap(), BTreeSet::from(["a", "app", "c"]));
        assert!(linked(&metadata, &["none"]).is_err());
    }
}
