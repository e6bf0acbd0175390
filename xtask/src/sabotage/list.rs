//! `.cargo/sabotages.toml`: the list of sabotages, and of the evidence that has none.

use std::collections::BTreeMap;
use std::fs;
use std::path::Path;

use anyhow::{Context, Result, bail, ensure};
use xtask::{files, shell};

use super::evidence::Evidence;

/// The list.
pub(super) const FILE: &str = ".cargo/sabotages.toml";

/// One change of the product's code that breaks a promise.
#[derive(Clone, Debug)]
pub(super) struct Sabotage {
    /// What must notice it.
    pub(super) evidence: Evidence,
    /// The file that is changed, below the workspace's root.
    pub(super) file: String,
    /// Text that is in the file once.
    from: String,
    /// What stands there instead.
    to: String,
}

impl Sabotage {
    /// Changes the file in `tree`, and returns its text before.
    pub(super) fn apply(&self, tree: &Path) -> Result<String> {
        let path = tree.join(&self.file);
        let text = fs::read_to_string(&path).with_context(|| format!("cannot read {}", path.display()))?;
        files::write(&path, self.changed(&text)?)?;
        Ok(text)
    }

    /// The text of the file with the change.
    fn changed(&self, text: &str) -> Result<String> {
        let Self { file, from, to, .. } = self;
        ensure!(from != to, "nothing changes in {file}");
        match text.matches(from.as_str()).count() {
            1 => Ok(text.replacen(from, to, 1)),
            count => bail!("{count} times in {file} instead of once: {from:?}"),
        }
    }
}

/// The list in the file.
#[derive(Debug)]
pub(super) struct List {
    /// In the order of the file.
    pub(super) sabotages: Vec<Sabotage>,
    /// Evidence without a sabotage, with the reason.
    pub(super) without: BTreeMap<Evidence, String>,
}

impl List {
    /// Reads the file of this workspace.
    pub(super) fn read() -> Result<Self> {
        let path = shell::root().join(FILE);
        let text = fs::read_to_string(&path).with_context(|| format!("cannot read {}", path.display()))?;
        Self::parse(&text).with_context(|| format!("cannot use {FILE}"))
    }

    /// Parses `[[sabotage]]` tables of `test`, `file`, `from` and `to`, and `[[without]]` tables of `tests` and one `reason`.
    fn parse(text: &str) -> Result<Self> {
        let table: toml::Table = text.parse()?;
        let entries = |name: &str| table.get(name).and_then(|list| list.as_array()).into_iter().flatten();
        let evidence =
            |text: &str| Evidence::parse(text).with_context(|| format!("no test, drill or boot run: {text}"));
        let mut sabotages = Vec::new();
        for entry in entries("sabotage") {
            let word = |key: &str| entry.get(key).and_then(|it| it.as_str());
            let text = |key: &str| {
                word(key).map(str::to_owned).with_context(|| format!("a sabotage without `{key}`: {entry:?}"))
            };
            let evidence = evidence(&text("test")?)?;
            sabotages.push(Sabotage { evidence, file: text("file")?, from: text("from")?, to: text("to")? });
        }
        let mut without = BTreeMap::new();
        for entry in entries("without") {
            let reason = entry.get("reason").and_then(|it| it.as_str()).context("evidence without a reason")?;
            let tests = entry.get("tests").and_then(|it| it.as_array()).context("a reason without evidence")?;
            for test in tests {
                let test = test.as_str().context("evidence that is no text")?;
                without.insert(evidence(test)?, reason.to_owned());
            }
        }
        Ok(Self { sabotages, without })
    }
}

#[cfg(test)]
mod tests {
    use std::collections::BTreeSet;

    use super::*;

    const PAGE: &str = "docs/promises.md";

    #[test]
    fn each_sabotage_changes_one_place_of_the_product() {
        let mut wrong = Vec::new();
        for sabotage in List::read().unwrap().sabotages {
            let text = fs::read_to_string(shell::root().join(&sabotage.file));
            let text = text.unwrap_or_else(|error| panic!("{}: {error}", sabotage.file));
            wrong.extend(sabotage.changed(&text).err().map(|error| format!("{}: {error}", sabotage.evidence)));
            // A test that is changed would show nothing.
            let is_test = sabotage.file.split('/').any(|part| part == "tests" || part == "tests.rs");
            let code = text.find("#[cfg(test)]\nmod tests {").unwrap_or(text.len());
            if is_test || text.find(&sabotage.from).is_some_and(|at| at > code) {
                wrong.push(format!("{}: changes a test", sabotage.evidence));
            }
        }
        assert!(wrong.is_empty(), "{}", wrong.join("\n"));
    }

    #[test]
    fn each_test_drill_and_boot_run_of_the_promises_has_a_sabotage_or_a_reason() {
        let list = List::read().unwrap();
        let named = Evidence::of_page(&fs::read_to_string(shell::root().join(PAGE)).unwrap());
        assert!(named.len() > 150, "{} pieces of evidence", named.len());
        let sabotaged: BTreeSet<Evidence> = list.sabotages.into_iter().map(|it| it.evidence).collect();
        let mut wrong = Vec::new();
        for evidence in &named {
            match (sabotaged.contains(evidence), list.without.contains_key(evidence)) {
                (false, false) => wrong.push(format!("{evidence}: neither sabotage nor reason")),
                (true, true) => wrong.push(format!("{evidence}: a sabotage, and a reason for the lack of one")),
                _ => {}
            }
        }
        for evidence in sabotaged.iter().chain(list.without.keys()).filter(|it| !named.contains(it)) {
            wrong.push(format!("{evidence}: not in {PAGE}"));
        }
        assert!(wrong.is_empty(), "{}", wrong.join("\n"));
        assert!(list.without.values().all(|reason| reason.len() > 20), "{:#?}", list.without);
    }

    #[test]
    fn a_sabotage_changes_one_place_or_is_an_error() {
        let text = |from: &str| format!("[[sabotage]]\ntest = 'boot quiet'\nfile = 'a.rs'\nfrom = '{from}'\nto = 'x'");
        let changed = |from: &str, code: &str| List::parse(&text(from)).unwrap().sabotages[0].changed(code);
        assert_eq!(changed("b", "abc").unwrap(), "axc");
        assert!(changed("b", "bb").is_err() && changed("b", "").is_err() && changed("x", "x").is_err());
        assert!(List::parse("[[sabotage]]\ntest = 'boot quiet'").is_err());
        assert!(List::parse("[[without]]\ntests = ['boot quiet']").is_err());
        assert!(List::parse("[[without]]\ntests = ['quiet']\nreason = 'x'").is_err());
    }
}
