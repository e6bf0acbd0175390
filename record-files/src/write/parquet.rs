//! A table as a Parquet file, compressed with Snappy, which every reader knows.
//!
//! The units are in the metadata under the key `PANDAS_ATTRS`, so that pandas has them as `frame.attrs["units"]`.

use std::io::Write;
use std::sync::Arc;

use anyhow::Result;
use parquet::basic::{Compression, LogicalType, Repetition, Type as Physical};
use parquet::data_type::{ByteArray, ByteArrayType, DoubleType, Int64Type};
use parquet::errors::ParquetError;
use parquet::file::metadata::KeyValue;
use parquet::file::properties::WriterProperties;
use parquet::file::writer::SerializedFileWriter;
use parquet::schema::types::Type;
use serde_json::{Map, Value, json};

use super::{Cell, Column, Kind, Sheet};

/// Rows of a row group, which are in memory until it is complete.
const GROUP: usize = 1 << 16;

/// Writes rows in groups.
pub struct Writer<W: Write + Send> {
    inner: SerializedFileWriter<W>,
    columns: Vec<Buffer>,
    rows: usize,
}

/// The cells of a column that are not written yet: values, and for each cell 1 or, if it is missing, 0.
struct Buffer {
    values: Values,
    levels: Vec<i16>,
}

enum Values {
    Numbers(Vec<f64>),
    Whole(Vec<i64>),
    Texts(Vec<ByteArray>),
}

impl<W: Write + Send> Writer<W> {
    pub(super) fn new(sheet: &Sheet<'_>, out: W) -> Result<Self> {
        let fields = sheet.columns.iter().map(|column| field(column).map(Arc::new));
        let fields = fields.collect::<Result<Vec<_>, ParquetError>>()?;
        let schema = Arc::new(Type::group_type_builder(sheet.name).with_fields(fields).build()?);
        let properties = WriterProperties::builder()
            .set_created_by(concat!("vsj ", env!("CARGO_PKG_VERSION")).to_owned())
            .set_compression(Compression::SNAPPY)
            .set_key_value_metadata(Some(vec![KeyValue::new("PANDAS_ATTRS".to_owned(), attributes(sheet).to_string())]))
            .build();
        let inner = SerializedFileWriter::new(out, schema, Arc::new(properties))?;
        Ok(Self { inner, columns: sheet.columns.iter().map(Buffer::new).collect(), rows: 0 })
    }

    pub(super) fn row(&mut self, cells: &[Cell<'_>]) -> Result<()> {
        self.columns.iter_mut().zip(cells).for_each(|(column, cell)| column.add(cell));
        self.rows += 1;
        if self.rows >= GROUP { self.write() } else { Ok(()) }
    }

    fn write(&mut self) -> Result<()> {
        let mut group = self.inner.next_row_group()?;
        for Buffer { values, levels } in &mut self.columns {
            let Some(mut column) = group.next_column()? else { break };
            match values {
                Values::Numbers(values) => {
                    column.typed::<DoubleType>().write_batch(values, Some(levels), None)?;
                    values.clear();
                }
                Values::Whole(values) => {
                    column.typed::<Int64Type>().write_batch(values, Some(levels), None)?;
                    values.clear();
                }
                Values::Texts(values) => {
                    column.typed::<ByteArrayType>().write_batch(values, Some(levels), None)?;
                    values.clear();
                }
            }
            levels.clear();
            column.close()?;
        }
        group.close()?;
        self.rows = 0;
        Ok(())
    }

    pub(super) fn finish(mut self) -> Result<()> {
        if self.rows > 0 {
            self.write()?;
        }
        Ok(self.inner.into_inner()?.flush()?)
    }
}

fn field(column: &Column) -> Result<Type, ParquetError> {
    let (physical, logical) = match column.kind {
        Kind::Number => (Physical::DOUBLE, None),
        Kind::Whole => (Physical::INT64, None),
        Kind::Text => (Physical::BYTE_ARRAY, Some(LogicalType::String)),
    };
    let field = Type::primitive_type_builder(column.name, physical).with_logical_type(logical);
    field.with_repetition(Repetition::OPTIONAL).build()
}

fn attributes(sheet: &Sheet<'_>) -> Value {
    let with_unit = sheet.columns.iter().filter(|column| !column.unit.is_empty());
    let units: Map<String, Value> = with_unit.map(|column| (column.name.to_owned(), json!(column.unit))).collect();
    json!({ "source": sheet.source, "units": units })
}

impl Buffer {
    fn new(column: &Column) -> Self {
        let values = match column.kind {
            Kind::Number => Values::Numbers(Vec::new()),
            Kind::Whole => Values::Whole(Vec::new()),
            Kind::Text => Values::Texts(Vec::new()),
        };
        Self { values, levels: Vec::new() }
    }

    fn add(&mut self, cell: &Cell<'_>) {
        let is_there = match (&mut self.values, *cell) {
            (Values::Numbers(values), Cell::Number(value)) if value.is_finite() => {
                values.push(value);
                true
            }
            (Values::Whole(values), Cell::Whole(value)) => {
                values.push(value);
                true
            }
            (Values::Texts(values), Cell::Text(text)) => {
                values.push(text.into());
                true
            }
            _ => false,
        };
        self.levels.push(is_there.into());
    }
}
