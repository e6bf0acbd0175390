//! The spring as a TOML file, for `--plant FILE.toml`:
//!
//! ```toml
//! schema = 1
//!
//! [relaxation]
//! share = 0.0909   # part of a change that comes at once
//! tau_s = 5.5      # time constant of the rest
//! ```

use std::path::Path;

use anyhow::Result;
use model::Plant;
use serde::Deserialize;

use crate::bad_input;

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct PlantFile {
    schema: u32,
    relaxation: Relaxation,
}

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct Relaxation {
    share: f64,
    tau_s: f64,
}

/// `paper`, or the path of a file.
///
/// # Errors
/// [`crate::BadInput`] with file, line, column and what was expected.
pub fn load(plant: &str) -> Result<Plant> {
    if plant == "paper" {
        return Ok(Plant::PAPER);
    }
    match std::fs::read_to_string(Path::new(plant)) {
        Ok(text) => parse(plant, &text),
        Err(error) => bad_input!("{plant}: cannot be read: {error}; expected `paper` or a plant file"),
    }
}

fn parse(name: &str, text: &str) -> Result<Plant> {
    let file: PlantFile = match toml::from_str(text) {
        Ok(file) => file,
        Err(error) => {
            let before = &text[..error.span().map_or(0, |span| span.start).min(text.len())];
            let line = before.matches('\n').count() + 1;
            let column = before.chars().rev().take_while(|&c| c != '\n').count() + 1;
            let what = error.message().replace('\n', ", ");
            bad_input!("{name}, line {line}, column {column}: {what}; expected schema, [relaxation] share and tau_s");
        }
    };
    if file.schema != 1 {
        bad_input!("{name}: schema = {} is not known; expected 1", file.schema);
    }
    Ok(Plant { share: file.relaxation.share, time_constant_s: file.relaxation.tau_s })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_file_gives_its_numbers() {
        let plant = parse("p", "schema = 1\n[relaxation]\nshare = 0.2\ntau_s = 3.0\n").unwrap();
        assert_eq!(plant, Plant { share: 0.2, time_constant_s: 3.0 });
    }

    #[test]
    fn faults_are_one_line_with_their_place() {
        for (text, expected) in [
            ("schema = 1\n[relaxation]\nshare = \"much\"\ntau_s = 3.0\n", "p, line 3, column 9:"),
            ("schema = 1\n[relaxation]\nshare = 0.2\n", "missing field `tau_s`"),
            (
                "schema = 1\n[relaxation]\nshare = 0.2\ntau_s = 3.0\nta = 1.0\n",
                "p, line 5, column 1: unknown field `ta`",
            ),
            ("schema = 2\n[relaxation]\nshare = 0.2\ntau_s = 3.0\n", "schema = 2 is not known; expected 1"),
            ("schema = ", "p, line 1"),
        ] {
            let got = parse("p", text).unwrap_err().to_string();
            assert!(got.contains(expected) && !got.contains('\n'), "{text:?}: {got}");
        }
    }
}
