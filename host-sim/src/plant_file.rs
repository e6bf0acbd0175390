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
use model::{Plant, SampleTime, estimator};
use serde::Deserialize;
use toml::Spanned;

use crate::bad_input;

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct PlantFile {
    schema: Spanned<u32>,
    relaxation: Relaxation,
}

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct Relaxation {
    share: Spanned<f64>,
    tau_s: Spanned<f64>,
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
    let place = |start: usize| {
        let before = &text[..start.min(text.len())];
        let line = before.matches('\n').count() + 1;
        let column = before.chars().rev().take_while(|&c| c != '\n').count() + 1;
        format!("{name}, line {line}, column {column}")
    };
    let PlantFile { schema, relaxation: Relaxation { share, tau_s } } = match toml::from_str(text) {
        Ok(file) => file,
        Err(error) => {
            let (at, what) = (place(error.span().map_or(0, |span| span.start)), error.message().replace('\n', ", "));
            bad_input!("{at}: {what}; expected schema, [relaxation] share and tau_s");
        }
    };
    if *schema.get_ref() != 1 {
        bad_input!("{}: schema = {} is not known; expected 1", place(schema.span().start), schema.get_ref());
    }
    let plant = Plant { share: *share.get_ref(), time_constant_s: *tau_s.get_ref() };
    // At the fastest rate; a slower one may refuse a short time constant later.
    if let Err(error) = estimator::Config::new(&plant, SampleTime::from_rate(10_000.0)?) {
        let at = if error.field == "share" { share.span() } else { tau_s.span() };
        bad_input!("{}: {error}", place(at.start));
    }
    Ok(plant)
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
            (
                "schema = 2\n[relaxation]\nshare = 0.2\ntau_s = 3.0\n",
                "p, line 1, column 10: schema = 2 is not known; expected 1",
            ),
            ("schema = 1\n[relaxation]\nshare = -1.0\ntau_s = 3.0\n", "p, line 3, column 9: share = -1 is not allowed"),
            ("schema = 1\n[relaxation]\nshare = 0.1\ntau_s = nan\n", "p, line 4, column 9: time_constant_s = NaN"),
            ("schema = ", "p, line 1"),
        ] {
            let got = parse("p", text).unwrap_err().to_string();
            assert!(got.contains(expected) && !got.contains('\n'), "{text:?}: {got}");
        }
    }
}
