//! Modules of JavaScript in one script: a page that is opened from a disk may not load modules from files.
//!
//! Each module becomes a function of its own, so that equal names do not meet. The modules use two forms alone: `import { a, b } from
//! "./x.js";` on one line, and `export` before a declaration.

use std::collections::BTreeSet;
use std::path::Path;

use anyhow::{Context, Result, bail};

use super::text;

/// Returns the module `first` of a folder together with all that it imports, each after the modules that it imports.
pub(super) fn bundle(folder: &Path, first: &str) -> Result<String> {
    let mut script = String::from("const modules = {};\n");
    add(folder, first, &mut BTreeSet::new(), &mut script)?;
    if script.contains("</script") {
        bail!("{first}: `</script` would end the script; expected it in two parts");
    }
    Ok(script)
}

fn add(folder: &Path, name: &str, begun: &mut BTreeSet<String>, script: &mut String) -> Result<()> {
    if !begun.insert(name.to_owned()) {
        return Ok(());
    }
    let (mut body, mut exported) = (String::new(), Vec::new());
    for (index, line) in text(&folder.join(name))?.lines().enumerate() {
        let wrong = || format!("{name}, line {}: `{line}`", index + 1);
        if let Some(import) = line.strip_prefix("import ") {
            let form = "expected import { NAMES } from \"./FILE\";";
            let (names, from) = import.split_once(" from \"./").with_context(|| format!("{}: {form}", wrong()))?;
            let from = from.strip_suffix("\";").with_context(|| format!("{}: {form}", wrong()))?;
            add(folder, from, begun, script)?;
            body += &format!("const {names} = modules[\"{from}\"];\n");
        } else if let Some(declaration) = line.strip_prefix("export ") {
            exported.push(declared(declaration).with_context(|| format!("{}: expected a declaration", wrong()))?);
            body += &format!("{declaration}\n");
        } else {
            body += &format!("{line}\n");
        }
    }
    let exported = exported.join(", ");
    *script += &format!("modules[\"{name}\"] = (() => {{\n{body}return {{ {exported} }};\n}})();\n");
    Ok(())
}

/// The name that a line declares.
fn declared(line: &str) -> Option<String> {
    let words = line.strip_prefix("async ").unwrap_or(line);
    let (kind, rest) = words.split_once(' ')?;
    let name: String = rest.chars().take_while(|letter| letter.is_alphanumeric() || *letter == '_').collect();
    (["function", "class", "const", "let"].contains(&kind) && !name.is_empty()).then_some(name)
}

#[cfg(test)]
mod tests {
    use std::fs;

    use super::*;

    #[test]
    fn a_module_follows_those_that_it_imports_and_each_is_there_once() {
        let folder = std::env::temp_dir().join(format!("xtask-bundle-{}", std::process::id()));
        fs::create_dir_all(&folder).unwrap();
        for (name, text) in [
            ("a.js", "import { b } from \"./b.js\";\nimport { c } from \"./c.js\";\nb(c);\n"),
            ("b.js", "import { c } from \"./c.js\";\nexport function b(x) {\n  return x + c;\n}\n"),
            ("c.js", "export const c = 1;\n"),
            ("wrong.js", "import c from './c.js'\n"),
        ] {
            fs::write(folder.join(name), text).unwrap();
        }
        let script = bundle(&folder, "a.js").unwrap();
        let wrong = bundle(&folder, "wrong.js").unwrap_err().to_string();
        fs::remove_dir_all(&folder).unwrap();
        let at = |name: &str| {
            let start = format!("modules[\"{name}\"] = ");
            assert_eq!(script.matches(&start).count(), 1, "{name}");
            script.find(&start)
        };
        assert!(at("c.js") < at("b.js") && at("b.js") < at("a.js"));
        assert!(script.contains("return { b };") && script.contains("const { c } = modules[\"c.js\"];"));
        assert!(!script.contains("export") && !script.contains("import"));
        assert!(wrong.starts_with("wrong.js, line 1: "), "{wrong}");
    }
}
