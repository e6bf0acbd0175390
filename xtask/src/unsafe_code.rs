//! The test that `docs/unsafe.md` lists every file with `unsafe` code, with its number of lines and the reason.

use std::collections::BTreeMap;
use std::fs;
use std::path::Path;

use xtask::shell;

/// Counts the lines of each Rust file below `folder` that contain the keyword outside of a comment.
fn count(folder: &Path, found: &mut BTreeMap<String, usize>) {
    for entry in fs::read_dir(folder).expect("a readable folder").flatten() {
        let path = entry.path();
        let name = entry.file_name();
        if path.is_dir() {
            if name != "target" && !name.to_string_lossy().starts_with('.') {
                count(&path, found);
            }
            continue;
        }
        if path.extension().is_none_or(|ending| ending != "rs") {
            continue;
        }
        let text = fs::read_to_string(&path).expect("a readable file");
        let lines = text.lines().filter(|line| is_unsafe(line)).count();
        if lines > 0 {
            let path = path.strip_prefix(shell::root()).expect("inside the workspace");
            found.insert(path.display().to_string(), lines);
        }
    }
}

/// Whether a line has the keyword, as a word outside of comments and strings, or allows it to the code of a macro.
fn is_unsafe(line: &str) -> bool {
    let code = line.split("//").next().unwrap_or_default();
    let outside: String = code.split('"').step_by(2).collect();
    let mut words = outside.split(|letter: char| !letter.is_alphanumeric() && letter != '_');
    words.any(|word| word == concat!("un", "safe")) || outside.contains(concat!("allow(un", "safe_code)"))
}

#[test]
fn docs_list_every_file_with_unsafe_code_and_its_reason() {
    let mut found = BTreeMap::new();
    count(shell::root(), &mut found);
    let page = fs::read_to_string(shell::root().join("docs/unsafe.md")).expect("the page");
    let rows = page.lines().filter_map(|line| {
        let cells: Vec<&str> = line.split('|').map(str::trim).collect();
        let [_, file, lines, why, _] = cells.as_slice() else { return None };
        let lines = lines.parse::<usize>().ok()?;
        assert!(why.len() > 20, "{file} needs a reason");
        Some((file.trim_matches('`').to_owned(), lines))
    });
    assert_eq!(rows.collect::<BTreeMap<_, _>>(), found);
}

#[test]
fn comments_strings_and_longer_words_are_no_unsafe_code() {
    for (line, expected) in [
        ("    unsafe { read() }", true),
        ("#[unsafe(no_mangle)]", true),
        ("// unsafe", false),
        ("#![allow(unsafe_code)]", true),
        ("#![forbid(unsafe_code)]", false),
    ] {
        assert_eq!(is_unsafe(line), expected, "{line}");
    }
}
