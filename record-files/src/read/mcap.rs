//! An MCAP file: the JSON messages of one topic, a row each.
//!
//! A field is a column; one inside an object is `outer.inner`, an object of `sec` and `nsec` is a time in s, and arrays are left
//! out. The time at which a message was logged is the column `log_time`, which is taken where the messages have no other time.

use std::collections::BTreeMap;

use anyhow::Result;
use serde_json::{Map, Value};
use simulation::bad_input;
use simulation::csv_table::text::MOST_ROWS;
use simulation::record::columns::{Column, too_many_rows};
use simulation::record::{Format, is_like_date, with_unit};

use super::messages::{Message, each_message};
use super::{Cells, Columns};

/// Column of the time at which a message was logged, in s.
const LOG_TIME: &str = "log_time [s]";
/// Name of the column of the time at which a message was logged, in s, if the messages have no time of their own.
const TIME: &str = "time [s]";

/// The field of an object that is a column: the keys that lead to it.
type Path = Vec<String>;

/// The fields of a topic's messages.
struct Topic {
    fields: Vec<Path>,
    /// The fields that are dates in the first message.
    dates: Vec<Path>,
    /// Units of fields by the name of their column.
    units: BTreeMap<String, String>,
}

pub(crate) fn columns(name: &str, bytes: &[u8], format: &Format, topic: Option<&str>) -> Result<Columns> {
    let mut topics: BTreeMap<String, Topic> = BTreeMap::new();
    let (mut others, mut count) = (Vec::new(), 0);
    let cut_off = each_message(name, bytes, |message| {
        count = message.number;
        let topic = message.channel.topic.as_str();
        if message.channel.message_encoding != "json" {
            let other = format!("{topic} ({})", message.channel.message_encoding);
            if !others.contains(&other) && others.len() < MOST_LISTED {
                others.push(other);
            }
        } else if !topics.contains_key(topic) {
            topics.insert(topic.to_owned(), Topic::of(name, message)?);
        }
        Ok(())
    })?;
    let mut remarks = Vec::new();
    if let Some(error) = cut_off {
        remarks.push(format!("{name}: cut off after {count} messages ({error}); read up to there"));
    }
    let (topic, header, indices) = chosen(name, &topics, &others, format, topic)?;
    let fields = &topics[&topic].fields;
    let mut cells: Vec<(usize, Cells)> = Vec::new();
    let dates = (0..fields.len()).filter(|index| topics[&topic].dates.contains(&fields[*index]));
    for index in indices.into_iter().chain(dates) {
        if !cells.iter().any(|(other, _)| *other == index) {
            cells.push((index, Cells::new()));
        }
    }
    each_message(name, bytes, |message| {
        if message.channel.topic != topic || message.channel.message_encoding != "json" {
            return Ok(());
        }
        let object = object(name, message)?;
        for (index, cells) in &mut cells {
            match fields.get(*index) {
                Some(path) => add(cells, at(&object, path)),
                None => cells.text(seconds(message.log_time.into())),
            }
            if cells.len() > MOST_ROWS {
                return Err(too_many_rows(name).into());
            }
        }
        Ok(())
    })?;
    let mut columns: Vec<(String, Column)> = header.into_iter().map(|column| (column, Column::Unread)).collect();
    for (index, Cells(column)) in cells {
        columns[index].1 = column;
    }
    Ok(Columns { columns, remarks })
}

/// Largest number of topics that an error lists.
const MOST_LISTED: usize = 6;

/// The topic of the record, the names of its columns, and the indices of time, voltage and reading among them.
fn chosen(
    name: &str,
    topics: &BTreeMap<String, Topic>,
    others: &[String],
    format: &Format,
    asked: Option<&str>,
) -> Result<(String, Vec<String>, [usize; 3])> {
    let found = topics.keys().map(String::as_str).chain(others.iter().map(String::as_str));
    let found: Vec<&str> = found.take(MOST_LISTED).collect();
    let found = if found.is_empty() { "no messages".to_owned() } else { format!("found {}", found.join(", ")) };
    if let Some(asked) = asked
        && !topics.contains_key(asked)
    {
        bad_input!("{name}: no topic `{asked}` with JSON messages; expected one of the file: {found}");
    }
    let mut fitting = Vec::new();
    let mut first_error = None;
    for (topic, fields) in topics.iter().filter(|(topic, _)| asked.is_none_or(|asked| asked == *topic)) {
        let header = |log_time: &str| {
            let names = fields.fields.iter().map(|path| fields.name(path));
            names.chain([log_time.to_owned()]).collect::<Vec<_>>()
        };
        let find = |header: &[String]| format.indices(name, header.iter().map(String::as_str));
        let (with_own_time, without) = (header(LOG_TIME), header(TIME));
        match find(&with_own_time) {
            Ok(indices) => fitting.push((topic.clone(), with_own_time, indices)),
            Err(error) => match find(&without) {
                Ok(indices) => fitting.push((topic.clone(), without, indices)),
                Err(_) => first_error = first_error.or(Some(error)),
            },
        }
    }
    match (fitting.len(), first_error) {
        (1, _) => Ok(fitting.remove(0)),
        (0, Some(error)) => Err(error),
        (0, None) => {
            bad_input!("{name}: no topic with JSON messages, {found}; expected one with the columns of a record")
        }
        _ => {
            let names: Vec<String> = fitting.iter().map(|(topic, ..)| format!("--topic {topic}")).collect();
            bad_input!("{name}: {} topics have the columns; expected one of {}", fitting.len(), names.join(", "))
        }
    }
}

impl Topic {
    /// The fields of a message and of its schema, and the units that the schema gives them.
    fn of(name: &str, message: &Message<'_>) -> Result<Self> {
        let object = object(name, message)?;
        let (mut fields, mut units) = (Vec::new(), BTreeMap::new());
        collect(&object, &mut Vec::new(), &mut fields);
        let is_date = |path: &&Path| at(&object, path).and_then(Value::as_str).is_some_and(is_like_date);
        let dates = fields.iter().filter(is_date).cloned().collect();
        for path in &fields {
            if let Some(Value::Object(_)) = at(&object, path) {
                units.insert(path.join("."), "s".to_owned());
            }
        }
        let schema = message.channel.schema.as_ref().filter(|schema| schema.encoding == "jsonschema");
        if let Some(schema) = schema.and_then(|schema| serde_json::from_slice::<Value>(&schema.data).ok()) {
            properties(&schema, &mut Vec::new(), &mut |path, property| {
                if let Some(unit) = property.get("unit").and_then(Value::as_str) {
                    units.insert(path.join("."), unit.to_owned());
                }
                let is_inner = property.get("properties").is_some() || property.get("items").is_some();
                if !is_inner && !fields.contains(path) && !is_time_part(path, &fields) {
                    fields.push(path.clone());
                }
            });
        }
        Ok(Self { fields, dates, units })
    }

    /// Name of a field's column, with its unit.
    fn name(&self, path: &Path) -> String {
        let name = path.join(".");
        match self.units.get(&name) {
            Some(unit) => with_unit(&name, unit),
            None => name,
        }
    }
}

/// True for `sec` and `nsec` of a field that is a time.
fn is_time_part(path: &Path, fields: &[Path]) -> bool {
    path.split_last().is_some_and(|(last, outer)| {
        ["sec", "nsec"].contains(&last.as_str()) && fields.iter().any(|field| field.as_slice() == outer)
    })
}

/// Deepest object inside objects that is looked into.
const MOST_DEEP: usize = 8;

/// Calls `each` with the path of every property of a JSON schema, and what the schema says of it.
fn properties(schema: &Value, path: &mut Path, each: &mut impl FnMut(&Path, &Value)) {
    for (key, property) in schema.get("properties").and_then(Value::as_object).into_iter().flatten() {
        path.push(key.clone());
        each(path, property);
        if path.len() < MOST_DEEP {
            properties(property, path, each);
        }
        path.pop();
    }
}

/// The object that a message is.
fn object(name: &str, message: &Message<'_>) -> Result<Map<String, Value>> {
    let (topic, number) = (&message.channel.topic, message.number);
    match serde_json::from_slice(message.data) {
        Ok(Value::Object(object)) => Ok(object),
        Ok(_) => bad_input!("{name}, message {number}, topic {topic}: no JSON object; expected one"),
        Err(error) => bad_input!("{name}, message {number}, topic {topic}: {error}; expected a JSON object"),
    }
}

/// Collects the paths of the values that are cells.
fn collect(object: &Map<String, Value>, path: &mut Path, fields: &mut Vec<Path>) {
    for (key, value) in object {
        path.push(key.clone());
        match value {
            Value::Object(inner) if nanoseconds(inner).is_none() => {
                if path.len() < MOST_DEEP {
                    collect(inner, path, fields);
                }
            }
            Value::Array(_) => (),
            _ => fields.push(path.clone()),
        }
        path.pop();
    }
}

/// The time that an object of `sec` and `nsec` is, in ns; `None` for any other object.
fn nanoseconds(object: &Map<String, Value>) -> Option<i128> {
    let part = |key| object.get(key)?.as_i64().map(i128::from);
    (object.len() == 2).then_some(())?;
    Some(part("sec")? * 1_000_000_000 + part("nsec")?)
}

/// A time in ns as seconds with all its digits, which a double does not have.
fn seconds(nanoseconds: i128) -> String {
    let (sign, size) = (if nanoseconds < 0 { "-" } else { "" }, nanoseconds.unsigned_abs());
    format!("{sign}{}.{:09}", size / 1_000_000_000, size % 1_000_000_000)
}

/// The value at a path.
fn at<'a>(object: &'a Map<String, Value>, path: &Path) -> Option<&'a Value> {
    let (last, outer) = path.split_last()?;
    outer.iter().try_fold(object, |object, key| object.get(key)?.as_object())?.get(last)
}

fn add(cells: &mut Cells, value: Option<&Value>) {
    match value {
        None | Some(Value::Null | Value::Array(_)) => cells.missing(),
        Some(Value::Bool(is_true)) => cells.number(f64::from(u8::from(*is_true))),
        Some(Value::String(text)) => cells.text(text.clone()),
        Some(Value::Number(number)) => match (number.as_i128(), number.as_f64()) {
            (Some(whole), _) => cells.whole(whole),
            (None, number) => cells.number(number.unwrap_or(f64::NAN)),
        },
        Some(Value::Object(object)) => match nanoseconds(object) {
            Some(time) => cells.text(seconds(time)),
            None => cells.missing(),
        },
    }
}
