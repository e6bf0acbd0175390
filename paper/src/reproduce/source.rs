//! The printed numbers of `data/printed.toml` and of the tables it names.

use std::collections::BTreeMap;

use anyhow::{Context, Result, bail};
use serde::{Deserialize, Serialize};
use toml::Value;

use crate::reproduce::printed::Relation;

const PRINTED: &str = include_str!("../../../data/printed.toml");

/// Tables by file name.
const TABLES: [(&str, &str); 3] = [
    ("table1_bending.csv", include_str!("../../../data/table1_bending.csv")),
    ("section414_tip_displacement.csv", include_str!("../../../data/section414_tip_displacement.csv")),
    ("table3_stair.csv", include_str!("../../../data/table3_stair.csv")),
];

/// What depends on a number, most important first.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, PartialOrd, Ord, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum BearsOn {
    /// A claim of the report.
    Conclusion,
    /// An input of a model, or the validity of a model.
    Model,
    /// A result that nothing else depends on.
    #[default]
    Result,
    /// A side remark.
    Detail,
}

/// A printed number and its computation.
#[derive(Clone, Debug)]
pub struct Entry {
    /// Place in the report.
    pub place: String,
    /// The number as printed.
    pub printed: String,
    /// Unit of the number.
    pub unit: String,
    /// Relation between the printed and the true number.
    pub relation: Relation,
    /// Name of the computation.
    pub of: String,
    /// Inputs of the computation.
    pub inputs: BTreeMap<String, Value>,
    /// Other values of the inputs that the text may mean.
    pub also: BTreeMap<String, Vec<Value>>,
    /// Why the computation applies, where that is not obvious.
    pub because: Option<String>,
    /// What depends on the number.
    pub bears_on: BearsOn,
    /// Name of the numbers printed with the same rounding rule.
    pub group: String,
    /// True for a number of a table, whose inputs are the other columns of its row.
    pub of_table: bool,
}

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct File {
    number: Vec<Number>,
    column: Vec<Column>,
}

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct Number {
    #[serde(rename = "where")]
    place: String,
    printed: String,
    unit: String,
    #[serde(default)]
    relation: Relation,
    of: String,
    from: BTreeMap<String, Value>,
    #[serde(default)]
    also: BTreeMap<String, Vec<Value>>,
    because: Option<String>,
    #[serde(default)]
    bears_on: BearsOn,
    group: Option<String>,
}

/// A column of a table: one number per row, with the other columns as inputs.
#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct Column {
    file: String,
    column: String,
    #[serde(rename = "where")]
    place: String,
    unit: String,
    of: String,
    #[serde(default)]
    from: BTreeMap<String, Value>,
    #[serde(default)]
    bears_on: BearsOn,
    group: Option<String>,
    /// Number of rows at the top that cannot be computed.
    #[serde(default)]
    skip: usize,
}

/// All printed numbers, those of tables first.
///
/// # Errors
/// If a built-in data file is damaged.
pub fn entries() -> Result<Vec<Entry>> {
    let file: File = toml::from_str(PRINTED).context("data/printed.toml")?;
    let mut entries = Vec::new();
    for column in file.column {
        entries.extend(rows(&column).with_context(|| format!("data/{}", column.file))?);
    }
    entries.extend(file.number.into_iter().map(|number| Entry {
        group: number.group.unwrap_or_else(|| before_comma(&number.place)),
        place: number.place,
        printed: number.printed,
        unit: number.unit,
        relation: number.relation,
        of: number.of,
        inputs: number.from,
        also: number.also,
        because: number.because,
        bears_on: number.bears_on,
        of_table: false,
    }));
    Ok(entries)
}

fn rows(column: &Column) -> Result<Vec<Entry>> {
    let Some((_, text)) = TABLES.iter().find(|(name, _)| *name == column.file) else { bail!("no such table") };
    let mut reader = csv::ReaderBuilder::new().comment(Some(b'#')).from_reader(text.as_bytes());
    let header = reader.headers()?.clone();
    let mut entries = Vec::new();
    for record in reader.records().skip(column.skip) {
        let record = record?;
        let (mut inputs, mut place, mut printed) = (column.from.clone(), column.place.clone(), None);
        for (name, cell) in header.iter().zip(&record) {
            place = place.replace(&format!("{{{name}}}"), cell);
            if name == column.column {
                printed = Some(cell.to_owned());
            } else if !inputs.contains_key(name) {
                inputs.insert(name.to_owned(), Value::Float(cell.parse()?));
            }
        }
        entries.push(Entry {
            printed: printed.with_context(|| format!("no column {}", column.column))?,
            unit: column.unit.clone(),
            relation: Relation::Equal,
            of: column.of.clone(),
            inputs,
            also: BTreeMap::new(),
            because: None,
            bears_on: column.bears_on,
            group: column.group.clone().unwrap_or_else(|| before_comma(&place)),
            place,
            of_table: true,
        });
    }
    Ok(entries)
}

fn before_comma(place: &str) -> String {
    place.split(',').next().unwrap_or(place).to_owned()
}
