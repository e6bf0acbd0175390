//! Options of the commands that read measured records: files, columns, units.

use std::path::{Path, PathBuf};

use anyhow::Result;
use clap::Args;
use host_sim::output::terminal::remark;
use identify::Input;
use record_files::open;
use simulation::bad_input;
use simulation::bad_input::BadInput;
use simulation::csv_table::dialect::{Decimal, Dialect, Separator};
use simulation::record::{ColumnNames, Format, MeasuredRecord, columns_file, remarks_on};

use super::choice::{INPUT, one_of};

/// The records and how their files are written.
#[derive(Args, Debug)]
pub(crate) struct RecordArguments {
    /// The records: tables with a header, separated by commas, semicolons, tabs, `|` or blanks, or MCAP or Parquet files; of at
    /// most 1 000 000 rows and 512 MiB
    #[arg(value_name = "DATA.csv", required = true)]
    data: Vec<PathBuf>,
    #[command(flatten)]
    format: FormatArguments,
    /// Interpolation of the voltage between the rows; default: hold
    #[arg(long, value_parser = one_of(INPUT))]
    input: Option<Input>,
}

/// How the files of records are written.
#[derive(Args, Debug)]
pub(crate) struct FormatArguments {
    /// Column of the time and its unit: ns, us, ms, s, min, h or d; or a column of time stamps, times of day or
    /// minutes and seconds (59:58.5); default: time_s
    #[arg(long, value_name = "NAME[:UNIT]")]
    time: Option<String>,
    /// Column of the commanded voltage and its unit: nV to MV, or any other unit of a command; default: voltage_v, else
    /// applied_v
    #[arg(long, value_name = "NAME[:UNIT]")]
    voltage: Option<String>,
    /// Column of the reading and its unit, e.g. N/m, mm, degC or counts; default: stiffness
    #[arg(long, value_name = "NAME[:UNIT]")]
    reading: Option<String>,
    /// Column of a reading that is the stiffness as the equivalent static voltage, in V
    #[arg(long, value_name = "NAME", conflicts_with = "reading")]
    column: Option<String>,
    /// File with these options as a table [columns]; options on the command line win
    #[arg(long, value_name = "FILE.toml")]
    columns: Option<PathBuf>,
    /// Separator of the columns of CSV files: `,`, `;`, `tab`, `blanks` or another character; default: found in the file
    #[arg(long, value_name = "SEPARATOR")]
    separator: Option<Separator>,
    /// Decimal mark of CSV files, `.` or `,`; default: found in the file
    #[arg(long, value_name = "MARK")]
    decimal: Option<Decimal>,
    /// Topic of the messages of an MCAP file; default: the only one that has the columns
    #[arg(long, value_name = "TOPIC")]
    topic: Option<String>,
    /// Order the rows by time; rows at the same time become one, with the mean of their readings
    #[arg(long)]
    sort: bool,
}

impl RecordArguments {
    /// Opens the records, all in the same way, and prints remarks about them to stderr. The second value is the interpolation
    /// of the voltage between the rows.
    ///
    /// # Errors
    /// [`simulation::bad_input::BadInput`] with file, line, column and what was expected.
    pub(crate) fn open(&self) -> Result<(Vec<MeasuredRecord>, Input)> {
        let (format, input) = self.format.read()?;
        let records = self.format.open(&self.data, &format)?;
        Ok((records, self.input.or(input).unwrap_or_default()))
    }
}

impl FormatArguments {
    /// True if the reading is the stiffness as the equivalent static voltage, in V, whatever its column is called.
    pub(crate) fn names_stiffness(&self) -> bool {
        self.column.is_some()
    }

    /// Opens a record whose voltage is held between its rows, and prints remarks about it to stderr.
    ///
    /// # Errors
    /// [`simulation::bad_input::BadInput`] with file, line, column and what was expected.
    pub(crate) fn open_held(&self, path: &Path) -> Result<MeasuredRecord> {
        let (format, input) = self.read()?;
        if let (Some(path), Some(Input::Linear | Input::Stair)) = (&self.columns, input) {
            bad_input!("{}, [columns]: input: expected hold, the voltage between the rows here", path.display());
        }
        let mut records = self.open(&[path.to_owned()], &format)?;
        Ok(records.remove(0))
    }

    fn open(&self, paths: &[PathBuf], format: &Format) -> Result<Vec<MeasuredRecord>> {
        let read = |path: &PathBuf| open(path, format, self.topic.as_deref());
        let records: Vec<MeasuredRecord> = paths.iter().map(read).collect::<Result<_>>()?;
        for text in remarks_on(&records)? {
            remark(&text);
        }
        Ok(records)
    }

    /// The options together with those of the file `--columns`, which may also name the interpolation of the voltage.
    fn read(&self) -> Result<(Format, Option<Input>)> {
        let columns = ColumnNames {
            time: self.time.clone(),
            voltage: self.voltage.clone(),
            reading: self.reading.clone(),
            stiffness: self.column.clone(),
        };
        let dialect = Dialect { separator: self.separator, decimal: self.decimal };
        let given = Format { columns, dialect, sort: self.sort };
        let Some(path) = &self.columns else { return Ok((given, None)) };
        let (in_file, input) = columns_file::open(path)?;
        let in_table = |error| BadInput(format!("{}, [columns]: {error}", path.display()));
        let input = input.map(|name| name.parse().map_err(in_table)).transpose()?;
        Ok((given.or(in_file), input))
    }
}
