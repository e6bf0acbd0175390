//! How to read a record, as the table `[columns]` of a TOML file.
//!
//! ```toml
//! [columns]
//! time = "t_ms:ms"
//! voltage = "u_kV:kV"
//! reading = "x_mm:mm"
//! input = "hold"
//! separator = ";"
//! decimal = ","
//! sort = true
//! ```

use std::path::Path;

use anyhow::Result;
use serde::Deserialize;
use serde::de::IgnoredAny;

use super::{ColumnNames, Format};
use crate::bad_input::BadInput;
use crate::csv_table::dialect::Dialect;
use crate::csv_table::text::Source;
use crate::plant_file::place::line_and_column;

/// The whole file.
#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct File {
    columns: Columns,
    /// What is known to be in the record, for `cargo campaign real`.
    #[serde(default, rename = "known")]
    _known: IgnoredAny,
}

/// The table `[columns]`; every entry may be absent.
#[derive(Default, Deserialize)]
#[serde(deny_unknown_fields)]
struct Columns {
    time: Option<String>,
    voltage: Option<String>,
    reading: Option<String>,
    input: Option<String>,
    separator: Option<String>,
    decimal: Option<String>,
    #[serde(default)]
    sort: bool,
}

/// Reads a file: the format of the record, and the name of the interpolation of the voltage between rows.
///
/// # Errors
/// [`BadInput`] with file, line, column and what was expected.
pub fn open(path: &Path) -> Result<(Format, Option<String>)> {
    let name = path.display().to_string();
    parse(&name, &Source::open(path)?.utf_8()?)
}

/// Reads the text of a file that messages call `name`: as [`open`].
///
/// # Errors
/// [`BadInput`] with file, line, column and what was expected.
pub fn parse(name: &str, text: &str) -> Result<(Format, Option<String>)> {
    let File { columns, .. } = toml::from_str(text).map_err(|error| {
        let (at, what) = (error.span().map_or(0, |span| span.start), error.message().replace('\n', ", "));
        let expected = "expected [columns] with time, voltage, reading, input, separator, decimal, sort";
        BadInput(format!("{}: {what}; {expected}", line_and_column(name, text, at)))
    })?;
    let in_file = |error: BadInput| BadInput(format!("{name}, [columns]: {error}"));
    let Columns { time, voltage, reading, input, separator, decimal, sort } = columns;
    let dialect = Dialect {
        separator: separator.map(|it| it.parse()).transpose().map_err(in_file)?,
        decimal: decimal.map(|it| it.parse()).transpose().map_err(in_file)?,
    };
    let columns = ColumnNames { time, voltage, reading, stiffness: None };
    Ok((Format { columns, dialect, sort }, input))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_file_names_columns_and_dialect() {
        let text =
            "[columns]\ntime = \"t:ms\"\nseparator = \"tab\"\ndecimal = \",\"\ninput = \"linear\"\nsort = true\n";
        let (format, input) = parse("c.toml", text).unwrap();
        assert_eq!(
            (format.columns.time.as_deref(), input.as_deref(), format.sort),
            (Some("t:ms"), Some("linear"), true)
        );
        assert_eq!(format.dialect.separator, "tab".parse().ok());
        for (text, expected) in [
            ("[columns]\nx = 1\n", "c.toml, line 2, column 1: unknown field `x`"),
            ("[columns]\ntime = 1\n", "c.toml, line 2, column 8: invalid type"),
            ("", "c.toml, line 1, column 1: missing field `columns`"),
            ("[columns]\nseparator = \"ab\"\n", "c.toml, [columns]: `ab` is not a separator; expected"),
            ("[columns]\ndecimal = \";\"\n", "c.toml, [columns]: `;` is not a decimal mark; expected"),
        ] {
            let error = parse("c.toml", text).unwrap_err().to_string();
            assert!(error.starts_with(expected) && error.contains("expected"), "{error}");
        }
    }
}
