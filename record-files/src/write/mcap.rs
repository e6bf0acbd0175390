//! A table as an MCAP file: a JSON object a row, with a JSON schema, on one topic.
//!
//! The schema has each column's unit under the key `unit`. Chunks are complete when they are written, so that a file that ends
//! early can be read up to its last one.

use std::collections::BTreeMap;
use std::io::Write;

use anyhow::Result;
use mcap::WriteOptions;
use mcap::records::{MessageHeader, Metadata};
use mcap::write::NoSeek;
use serde_json::{Map, Value, json};

use super::{Cell, Column, Kind, Sheet};

/// Size of a chunk in bytes, of which all is in memory until it is complete.
const CHUNK: u64 = 1 << 18;

/// Writes rows as messages.
pub struct Writer<W: Write> {
    inner: mcap::Writer<NoSeek<W>>,
    channel: u16,
    columns: Vec<Column>,
    rows: u32,
}

impl<W: Write> Writer<W> {
    pub(super) fn new(sheet: &Sheet<'_>, out: W) -> Result<Self> {
        let options = WriteOptions::new()
            .compression(None)
            .library(concat!("vsj ", env!("CARGO_PKG_VERSION")))
            .chunk_size(Some(CHUNK))
            .disable_seeking(true);
        let mut inner = options.create(NoSeek::new(out))?;
        let name = format!("vsj.{}", sheet.name);
        let schema = inner.add_schema(&name, "jsonschema", schema(&name, sheet).to_string().as_bytes())?;
        let channel = inner.add_channel(schema, &format!("/{}", sheet.name), "json", &BTreeMap::new())?;
        let metadata = BTreeMap::from([("source".to_owned(), sheet.source.to_owned())]);
        inner.write_metadata(&Metadata { name: "vsj".to_owned(), metadata })?;
        Ok(Self { inner, channel, columns: sheet.columns.to_vec(), rows: 0 })
    }

    pub(super) fn row(&mut self, time_ns: u64, cells: &[Cell<'_>]) -> Result<()> {
        let value = |cell: &Cell<'_>| match *cell {
            Cell::Missing => Value::Null,
            Cell::Number(number) => json!(number),
            Cell::Whole(number) => json!(number),
            Cell::Text(text) => json!(text),
        };
        let fields = self.columns.iter().zip(cells).map(|(column, cell)| (column.name.to_owned(), value(cell)));
        let message = Value::Object(fields.collect()).to_string();
        let header =
            MessageHeader { channel_id: self.channel, sequence: self.rows, log_time: time_ns, publish_time: time_ns };
        self.inner.write_to_known_channel(&header, message.as_bytes())?;
        self.rows = self.rows.wrapping_add(1);
        Ok(())
    }

    pub(super) fn flush(&mut self) -> Result<()> {
        Ok(self.inner.flush()?)
    }

    pub(super) fn finish(mut self) -> Result<()> {
        self.inner.finish()?;
        Ok(self.inner.into_inner().flush()?)
    }
}

/// The JSON schema of a row.
fn schema(name: &str, sheet: &Sheet<'_>) -> Value {
    let mut properties = Map::new();
    for column in sheet.columns {
        let kind = match column.kind {
            Kind::Number => "number",
            Kind::Whole => "integer",
            Kind::Text => "string",
        };
        let mut property = json!({ "type": [kind, "null"] });
        if !column.unit.is_empty() {
            property["unit"] = json!(column.unit);
            property["description"] = json!(format!("in {}", column.unit));
        }
        properties.insert(column.name.to_owned(), property);
    }
    json!({ "title": name, "description": sheet.source, "type": "object", "properties": properties })
}
