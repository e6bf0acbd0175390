//! The result of a part: a page, criteria and a JSON value.

use std::fmt::Write;
use std::path::Path;

use anyhow::{Context, Result};
use serde_json::Value;
use validation::criterion::Criterion;

use crate::arguments::Part;

/// Result of a part.
pub(crate) struct Done {
    pub(crate) part: Part,
    /// Text of the page.
    pub(crate) markdown: String,
    /// List of the records that are not diagnosed correctly, one line each, which is printed and not written.
    pub(crate) wrong: String,
    pub(crate) criteria: Vec<Criterion>,
    pub(crate) json: Value,
    /// Name and text of an SVG file next to the page.
    pub(crate) figure: Option<(&'static str, String)>,
}

impl Done {
    /// A page without anything else.
    pub(crate) fn new(part: Part, markdown: String, json: Value) -> Self {
        Self { part, markdown, wrong: String::new(), criteria: Vec::new(), json, figure: None }
    }

    pub(crate) fn write(&self, folder: &Path) -> Result<()> {
        std::fs::create_dir_all(folder).with_context(|| format!("cannot make {}", folder.display()))?;
        let path = folder.join(format!("{}.md", self.part.name()));
        let arguments: Vec<String> = std::env::args().skip(1).collect();
        let (title, command) = (self.part.title(), arguments.join(" "));
        // `cargo thresholds` runs this program with the feature that the part needs.
        let alias = if self.part == Part::Thresholds { "cargo" } else { "cargo campaign" };
        let mut text = format!("# {title}\n\nPrinted by `{alias} {command}`.\n\n{}", self.markdown);
        if !self.criteria.is_empty() {
            text.push('\n');
            self.criteria.iter().try_for_each(|criterion| writeln!(text, "- {criterion}"))?;
        }
        let files = [(path, &text)].into_iter().chain(self.figure.iter().map(|(name, svg)| (folder.join(name), svg)));
        for (path, text) in files {
            std::fs::write(&path, text).with_context(|| format!("cannot write {}", path.display()))?;
        }
        Ok(())
    }
}
