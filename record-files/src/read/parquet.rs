//! A Parquet file: its columns of numbers, time stamps, dates, times of day and texts; lists are left out.
//!
//! Units are in the file's metadata, as `{"units": {"x": "mm"}}` under the key `PANDAS_ATTRS`, which pandas makes of
//! `frame.attrs`, or as `{"x": "mm"}` under the key `units`; or they are in the names, as in CSV. Durations are read in s.

use anyhow::Result;
use bytes::Bytes;
use chrono::{DateTime, NaiveDate, NaiveTime, SecondsFormat, TimeDelta};
use parquet::basic::{ConvertedType, LogicalType, TimeUnit};
use parquet::column::reader::{ColumnReader, ColumnReaderImpl, get_column_reader};
use parquet::data_type::DataType;
use parquet::errors::ParquetError;
use parquet::file::metadata::KeyValue;
use parquet::file::reader::{FileReader, SerializedFileReader};
use parquet::schema::types::ColumnDescriptor;
use serde_json::{Map, Value};
use simulation::BadInput;
use simulation::csv_table::text::MOST_ROWS;
use simulation::record::columns::{Column, too_many_rows};
use simulation::record::{Format, is_like_date, with_unit};

use super::caught::caught;
use super::compressed::{Codec, Pages};
use super::{Cells, Columns, arrow, pages};

/// Number of cells that are read at a time.
const BATCH: usize = 1 << 12;

pub(crate) fn columns(name: &str, bytes: Vec<u8>, format: &Format) -> Result<Columns> {
    let damaged = || BadInput(format!("{name}: damaged; expected a Parquet file"));
    caught(|| read(name, bytes, format)).ok_or_else(damaged)?
}

fn read(name: &str, bytes: Vec<u8>, format: &Format) -> Result<Columns> {
    let damaged = |error: ParquetError| BadInput(format!("{name}: {error}; expected a Parquet file"));
    let bytes = Bytes::from(bytes);
    let reader = SerializedFileReader::new(bytes.clone()).map_err(damaged)?;
    let metadata = reader.metadata().file_metadata();
    if metadata.num_rows() > MOST_ROWS as i64 {
        return Err(too_many_rows(name).into());
    }
    let pairs = || metadata.key_value_metadata().into_iter().flatten();
    let of_arrow = pairs().find(|pair| pair.key == "ARROW:schema").and_then(|pair| pair.value.as_deref());
    let schema = metadata.schema_descr();
    let durations = of_arrow.map(|text| arrow::durations(text, schema.num_columns())).unwrap_or_default();
    let units = units(pairs);
    let flat = (0..schema.num_columns()).filter(|index| schema.column(*index).max_rep_level() == 0);
    let flat: Vec<usize> = flat.collect();
    let named = |index: &usize| {
        let column = schema.column(*index).path().string();
        let unit = units.get(&column).and_then(Value::as_str).unwrap_or_default();
        with_unit(&column, if durations.contains_key(&column) { "s" } else { unit })
    };
    let names: Vec<String> = flat.iter().map(named).collect();
    let needed = format.indices(name, names.iter().map(String::as_str))?;
    let mut columns = Vec::new();
    for (place, column) in names.into_iter().enumerate() {
        let per_second = durations.get(&schema.column(flat[place]).path().string()).copied();
        let cells = |rows| cells(&reader, &bytes, flat[place], per_second, rows);
        // What is neither needed nor readable has no dates.
        let has_dates = || matches!(cells(1), Ok(Column::Texts(first)) if first.iter().any(|cell| is_like_date(cell)));
        let cells = if needed.contains(&place) || has_dates() {
            cells(usize::MAX).map_err(|what| BadInput(format!("{name}, column {column}: {what}")))?
        } else {
            Column::Unread
        };
        columns.push((column, cells));
    }
    Ok(Columns { columns, remarks: Vec::new() })
}

/// Units of columns by name, from the file's metadata; of two, that of pandas, which is the one of the frame.
fn units<'a, P: Iterator<Item = &'a KeyValue>>(pairs: impl Fn() -> P) -> Map<String, Value> {
    let object = |key: &str| {
        let text = pairs().find(|pair| pair.key == key)?.value.as_deref()?;
        serde_json::from_str::<Map<String, Value>>(text).ok()
    };
    let mut units = object("units").unwrap_or_default();
    if let Some(Value::Object(of_frame)) = object("PANDAS_ATTRS").and_then(|mut attributes| attributes.remove("units"))
    {
        units.extend(of_frame);
    }
    units
}

/// The meaning of whole numbers.
#[derive(Clone, Copy)]
enum Whole {
    /// A number of this many decimal places.
    Number { places: i32, is_signed: bool },
    /// A time since 1970, in parts of a second.
    Stamp { per_second: i64, is_utc: bool },
    /// A duration in parts of a second, which becomes one in s.
    Duration { per_second: i64 },
    /// A time since midnight, in parts of a second.
    TimeOfDay { per_second: i64 },
    /// Days since 1970.
    Date,
}

impl Whole {
    /// `None` for a type that is none of these.
    fn of(column: &ColumnDescriptor) -> Option<Self> {
        let number = |places, is_signed| Some(Self::Number { places, is_signed });
        let stamp = |per_second, is_utc| Some(Self::Stamp { per_second, is_utc });
        let per_second = |unit: &TimeUnit| match unit {
            TimeUnit::MILLIS => 1_000,
            TimeUnit::MICROS => 1_000_000,
            TimeUnit::NANOS => 1_000_000_000,
        };
        match (column.logical_type_ref(), column.converted_type()) {
            (Some(LogicalType::Timestamp(time)), _) => stamp(per_second(&time.unit), time.is_adjusted_to_u_t_c),
            (Some(LogicalType::Time(time)), _) => Some(Self::TimeOfDay { per_second: per_second(&time.unit) }),
            (Some(LogicalType::Date), _) => Some(Self::Date),
            (Some(LogicalType::Decimal(decimal)), _) => number(decimal.scale, true),
            (Some(LogicalType::Integer(integer)), _) => number(0, integer.is_signed),
            (Some(_), _) => None,
            (None, ConvertedType::TIMESTAMP_MILLIS) => stamp(1_000, true),
            (None, ConvertedType::TIMESTAMP_MICROS) => stamp(1_000_000, true),
            (None, ConvertedType::DECIMAL) => number(column.type_scale(), true),
            (None, ConvertedType::UINT_32 | ConvertedType::UINT_64) => number(0, false),
            (None, ConvertedType::TIME_MILLIS) => Some(Self::TimeOfDay { per_second: 1_000 }),
            (None, ConvertedType::TIME_MICROS) => Some(Self::TimeOfDay { per_second: 1_000_000 }),
            (None, ConvertedType::DATE) => Some(Self::Date),
            (None, _) => number(0, true),
        }
    }

    /// Adds a value of 32 or 64 bits to a column.
    fn add(self, value: i64, unsigned: u64, cells: &mut Cells) {
        match self {
            Self::Number { places: 0, is_signed: true } => cells.whole(value.into()),
            Self::Number { places: 0, is_signed: false } => cells.whole(unsigned.into()),
            Self::Number { places, .. } => cells.number(value as f64 / 10f64.powi(places)),
            Self::Stamp { per_second, is_utc } => cells.text(stamp(value, per_second, is_utc)),
            Self::Duration { per_second } => cells.number(value as f64 / per_second as f64),
            Self::TimeOfDay { per_second } => cells.text(time_of_day(value, per_second).unwrap_or_default()),
            Self::Date => cells.text(date(value).map(|date| date.to_string()).unwrap_or_default()),
        }
    }
}

/// A time stamp of ISO 8601; empty if the year has more than four digits.
fn stamp(value: i64, per_second: i64, is_utc: bool) -> String {
    let nanoseconds = value.rem_euclid(per_second) * (1_000_000_000 / per_second);
    let time = DateTime::from_timestamp(value.div_euclid(per_second), nanoseconds as u32);
    let text = time.map(|time| time.to_rfc3339_opts(SecondsFormat::Nanos, true)).unwrap_or_default();
    if is_utc { text } else { text.trim_end_matches('Z').to_owned() }
}

fn time_of_day(value: i64, per_second: i64) -> Option<String> {
    let below_second = value.rem_euclid(per_second) * (1_000_000_000 / per_second);
    let seconds = u32::try_from(value.div_euclid(per_second)).ok()?;
    let time = NaiveTime::from_num_seconds_from_midnight_opt(seconds, u32::try_from(below_second).ok()?)?;
    Some(time.format("%H:%M:%S%.9f").to_string())
}

fn date(days: i64) -> Option<NaiveDate> {
    NaiveDate::default().checked_add_signed(TimeDelta::try_days(days)?)
}

/// The first `rows` cells of a column, or what is wrong with it; `per_second` is given for one of durations.
fn cells(
    file: &SerializedFileReader<Bytes>,
    bytes: &Bytes,
    index: usize,
    per_second: Option<i64>,
    rows: usize,
) -> Result<Column, String> {
    let descriptor = file.metadata().file_metadata().schema_descr().column(index);
    let most = descriptor.max_def_level();
    let empty = if per_second.is_some() { Column::Durations } else { Column::Numbers };
    let mut cells = Cells(empty(Vec::new()));
    let duration = per_second.map(|per_second| Whole::Duration { per_second });
    let whole = || duration.or_else(|| Whole::of(&descriptor)).ok_or_else(|| unsupported(&descriptor));
    for group in 0..file.num_row_groups() {
        if cells.len() >= rows {
            break;
        }
        check_pages(file, bytes, group, index)?;
        let reader = column_reader(file, bytes, group, index);
        let to = &mut cells;
        match reader.map_err(|error| unreadable(&error, to.len()))? {
            ColumnReader::BoolColumnReader(reader) => each(reader, most, rows, to, |it, to| to.whole((*it).into())),
            ColumnReader::Int32ColumnReader(reader) => {
                let whole = whole()?;
                each(reader, most, rows, to, |it, to| whole.add((*it).into(), (*it as u32).into(), to))
            }
            ColumnReader::Int64ColumnReader(reader) => {
                let whole = whole()?;
                each(reader, most, rows, to, |it, to| whole.add(*it, *it as u64, to))
            }
            ColumnReader::Int96ColumnReader(reader) => {
                each(reader, most, rows, to, |it, to| to.text(stamp(it.to_nanos(), 1_000_000_000, false)))
            }
            ColumnReader::FloatColumnReader(reader) => each(reader, most, rows, to, |it, to| to.number((*it).into())),
            ColumnReader::DoubleColumnReader(reader) => each(reader, most, rows, to, |it, to| to.number(*it)),
            ColumnReader::ByteArrayColumnReader(reader) if !is_decimal(&descriptor) => {
                each(reader, most, rows, to, |it, to| to.text(String::from_utf8_lossy(it.data()).into_owned()))
            }
            _ => Err(unsupported(&descriptor)),
        }?;
    }
    Ok(cells.0)
}

/// The values of a column in a group of rows.
fn column_reader(
    file: &SerializedFileReader<Bytes>,
    bytes: &Bytes,
    group: usize,
    index: usize,
) -> Result<ColumnReader, ParquetError> {
    let rows = file.metadata().row_group(group);
    match Codec::of(rows.column(index).compression()) {
        None => file.get_row_group(group)?.get_column_reader(index),
        Some(codec) => {
            let pages = Pages::new(bytes, rows, index, codec)?;
            Ok(get_column_reader(rows.column(index).column_descr_ptr(), Box::new(pages)))
        }
    }
}

/// Checks the sizes of the pages of a column in a group of rows.
fn check_pages(file: &SerializedFileReader<Bytes>, bytes: &[u8], group: usize, index: usize) -> Result<(), String> {
    let column = file.metadata().row_group(group).column(index);
    let start = column.dictionary_page_offset().unwrap_or(column.data_page_offset());
    let range = usize::try_from(start).ok().zip(usize::try_from(column.compressed_size()).ok());
    let pages = range.and_then(|(start, length)| bytes.get(start..start.checked_add(length)?));
    pages::check(pages.ok_or("outside of the file; expected a Parquet file")?)
}

fn is_decimal(column: &ColumnDescriptor) -> bool {
    column.converted_type() == ConvertedType::DECIMAL
        || matches!(column.logical_type_ref(), Some(LogicalType::Decimal(_)))
}

fn unsupported(column: &ColumnDescriptor) -> String {
    let kind = match (column.logical_type_ref(), column.converted_type()) {
        (Some(logical), _) => format!("{logical:?}"),
        (None, ConvertedType::NONE) => column.physical_type().to_string(),
        (None, converted) => converted.to_string(),
    };
    format!("values of the type {kind}; expected numbers, times, dates or texts")
}

/// What is wrong with a column that cannot be read further than a row.
fn unreadable(error: &ParquetError, row: usize) -> String {
    let text = error.to_string();
    // The name of a compression that is left out, which is another one.
    match text.rsplit_once("Disabled feature at compile time: ") {
        Some((_, compression)) => format!("compressed by {compression}; expected Snappy, zstd, gzip or none"),
        None => format!("after row {row}: {text}; expected a Parquet file"),
    }
}

/// Adds every value of a column to `cells`, up to a number of `rows`, and a missing cell for each null.
fn each<T: DataType>(
    mut reader: ColumnReaderImpl<T>,
    most: i16,
    rows: usize,
    cells: &mut Cells,
    add: impl Fn(&T::T, &mut Cells),
) -> Result<(), String> {
    let (mut values, mut levels) = (Vec::new(), Vec::new());
    loop {
        values.clear();
        levels.clear();
        let (records, ..) = reader
            .read_records(BATCH.min(rows - cells.len()), Some(&mut levels), None, &mut values)
            .map_err(|error| unreadable(&error, cells.len()))?;
        if records == 0 {
            return Ok(());
        }
        if most == 0 {
            values.iter().for_each(|value| add(value, cells));
        } else {
            let mut values = values.iter();
            for level in &levels {
                match if *level == most { values.next() } else { None } {
                    Some(value) => add(value, cells),
                    None => cells.missing(),
                }
            }
        }
        if cells.len() > MOST_ROWS {
            return Err(format!("more than {MOST_ROWS} rows; expected at most that"));
        }
    }
}
