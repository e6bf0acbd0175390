//! The software bill of materials of an image, as CycloneDX 1.5 JSON.
//!
//! In: the packages that `cargo tree` resolves for the image, and their checksums in `Cargo.lock`. Out: every package
//! with version, licence, package URL, checksum and dependencies. What only runs at build time (build scripts,
//! procedural macros) has the scope `excluded`. There is no time stamp: the same sources give the same file.

use std::collections::{BTreeMap, BTreeSet};

use anyhow::{Context, Result, ensure};
use serde_json::{Value, json};
use xtask::build::Board;
use xtask::shell;

/// A package as `cargo tree` prints it.
#[derive(Clone, Debug, PartialEq, Eq, PartialOrd, Ord)]
struct Package {
    name: String,
    version: String,
    licence: String,
}

impl Package {
    /// Identifies the package within the file.
    fn reference(&self) -> String {
        format!("pkg:cargo/{}@{}", self.name, self.version)
    }
}

/// Packages, each with those it depends on.
type Graph = BTreeMap<Package, BTreeSet<Package>>;

/// The bill of materials of a board's image with further features.
pub(crate) fn of_image(board: Board, features: &[&str], image: &str) -> Result<String> {
    let features = [&[board.name()], features].concat().join(",");
    let tree = |edges: &str| -> Result<Graph> {
        let mut command = shell::cargo();
        command.args(["tree", "--locked", "--package", board.package(), "--features", &features]);
        command.args(["--target", shell::MCU, "--edges", edges, "--prefix", "depth", "--format", "\t{p}\t{l}"]);
        parse(&shell::output(&mut command)?)
    };
    let (all, linked) = (tree("normal,build")?, tree("normal,no-proc-macro")?);
    let lock = std::fs::read_to_string(shell::root().join("Cargo.lock")).context("cannot read Cargo.lock")?;
    let bom = bom(image, board.package(), &all, &linked, &checksums(&lock)?)?;
    Ok(serde_json::to_string_pretty(&bom)? + "\n")
}

/// Parses lines of depth, package and licence; a package that was printed before ends with `(*)`.
fn parse(tree: &str) -> Result<Graph> {
    let (mut graph, mut path) = (Graph::new(), Vec::<Package>::new());
    for line in tree.lines().filter(|line| !line.is_empty()) {
        let mut columns = line.split('\t');
        let mut column = || columns.next().with_context(|| format!("`{line}` is no line of cargo tree"));
        let (depth, package, licence) = (column()?.parse::<usize>()?, column()?, column()?);
        let mut words = package.split_whitespace();
        let (name, version) = (words.next().context("no name")?, words.next().context("no version")?);
        let package = Package {
            name: name.to_owned(),
            version: version.trim_start_matches('v').to_owned(),
            licence: licence.trim_end_matches("(*)").trim().to_owned(),
        };
        ensure!(depth <= path.len(), "`{line}` has no parent");
        path.truncate(depth);
        if let Some(parent) = path.last() {
            graph.entry(parent.clone()).or_default().insert(package.clone());
        }
        graph.entry(package.clone()).or_default();
        path.push(package);
    }
    Ok(graph)
}

/// SHA-256 of each package from the registry, by name and version.
fn checksums(lock: &str) -> Result<BTreeMap<(String, String), String>> {
    let lock: toml::Table = lock.parse().context("cannot parse Cargo.lock")?;
    let packages = lock.get("package").and_then(|list| list.as_array()).context("Cargo.lock lists no packages")?;
    let entries = packages.iter().filter_map(|package| {
        let text = |key: &str| package.get(key).and_then(|it| it.as_str()).map(str::to_owned);
        Some(((text("name")?, text("version")?), text("checksum")?))
    });
    Ok(entries.collect())
}

fn bom(
    image: &str,
    root: &str,
    all: &Graph,
    linked: &Graph,
    checksums: &BTreeMap<(String, String), String>,
) -> Result<Value> {
    let main = all.keys().find(|package| package.name == root).context("the image's own package is missing")?;
    let component = |package: &Package| {
        let Package { name, version, licence } = package;
        // A slash once meant OR in Cargo.toml; it is no licence expression.
        let licence = licence.replace('/', " OR ");
        let mut component = json!({
            "type": "library",
            "bom-ref": package.reference(),
            "name": name,
            "version": version,
            "purl": package.reference(),
            "scope": if linked.contains_key(package) { "required" } else { "excluded" },
            "licenses": [{ "expression": licence }],
        });
        if let Some(checksum) = checksums.get(&(name.clone(), version.clone())) {
            component["hashes"] = json!([{ "alg": "SHA-256", "content": checksum }]);
        }
        component
    };
    let dependencies = all.iter().map(|(package, on)| {
        json!({ "ref": package.reference(), "dependsOn": on.iter().map(Package::reference).collect::<Vec<_>>() })
    });
    Ok(json!({
        "bomFormat": "CycloneDX",
        "specVersion": "1.5",
        "version": 1,
        "metadata": {
            "component": {
                "type": "firmware",
                "bom-ref": main.reference(),
                "name": image,
                "version": main.version,
                "licenses": [{ "expression": main.licence }],
            }
        },
        "components": all.keys().filter(|package| *package != main).map(component).collect::<Vec<_>>(),
        "dependencies": dependencies.collect::<Vec<_>>(),
    }))
}

#[cfg(test)]
mod tests {
    use super::*;

    const TREE: &str = "\
0\tfirmware v0.1.0 (/x)\tMIT OR Apache-2.0
1\tmodel v0.1.0 (/x)\tMIT OR Apache-2.0
2\tlibm v0.2.16\tMIT
1\tdefmt v1.0.1\tMIT/Apache-2.0
2\tdefmt-macros v1.0.1 (proc-macro)\tMIT
1\tlibm v0.2.16\tMIT (*)
";
    const LINKED: &str = "0\tfirmware v0.1.0 (/x)\tMIT\n1\tlibm v0.2.16\tMIT\n";

    #[test]
    fn the_bill_lists_each_package_once_with_licence_checksum_and_dependencies() {
        let (all, linked) = (parse(TREE).unwrap(), parse(LINKED).unwrap());
        let checksums = BTreeMap::from([(("libm".to_owned(), "0.2.16".to_owned()), "ab".to_owned())]);
        let bom = bom("board", "firmware", &all, &linked, &checksums).unwrap();
        let components = bom["components"].as_array().unwrap();
        let named = |name: &str| components.iter().find(|it| it["name"] == name).unwrap();
        assert_eq!(components.len(), 4);
        assert_eq!(named("libm")["hashes"][0]["content"], "ab");
        assert_eq!(named("libm")["scope"], "required");
        assert_eq!(named("defmt-macros")["scope"], "excluded");
        assert_eq!(named("defmt")["licenses"][0]["expression"], "MIT OR Apache-2.0");
        let main = bom["dependencies"].as_array().unwrap().iter().find(|it| it["ref"] == "pkg:cargo/firmware@0.1.0");
        assert_eq!(main.unwrap()["dependsOn"].as_array().unwrap().len(), 3);
        assert_eq!(bom["metadata"]["component"]["name"], "board");
    }

    #[test]
    fn a_tree_of_another_form_is_an_error() {
        assert!(parse("firmware v0.1.0").is_err());
        assert!(parse("2\tlibm v0.2.16\tMIT").is_err());
    }

    #[test]
    fn the_lock_file_of_the_workspace_has_a_checksum_for_what_comes_from_the_registry() {
        let checksums = checksums(include_str!("../../Cargo.lock")).unwrap();
        assert!(checksums.iter().any(|((name, _), sum)| name == "libm" && sum.len() == 64));
        assert!(!checksums.keys().any(|(name, _)| name == "model"));
    }
}
