//! Options of the commands that read measured records: files, columns, units.

use std::path::PathBuf;

use anyhow::Result;
use clap::Args;
use host_sim::output::terminal::remark;
use identify::Input;
use record_files::open;
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
    /// Column of the time and its unit: ns, us, ms, s, min, h or d; or a column of time stamps or times of day; default: time_s
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
    /// Interpolation of the voltage between the rows; default: hold
    #[arg(long, value_parser = one_of(INPUT))]
    input: Option<Input>,
}

impl RecordArguments {
    /// Opens the records, all in the same way, and prints remarks about them to stderr. The second value is the interpolation
    /// of the voltage between the rows.
    ///
    /// # Errors
    /// [`simulation::bad_input::BadInput`] with file, line, column and what was expected.
    pub(crate) fn open(&self) -> Result<(Vec<MeasuredRecord>, Input)> {
        let (format, input) = self.format()?;
        let read = |path: &PathBuf| open(path, &format, self.topic.as_deref());
        let records: Vec<MeasuredRecord> = self.data.iter().map(read).collect::<Result<_>>()?;
        for text in remarks_on(&records)? {
            remark(&text);
        }
        Ok((records, input))
    }

    /// The options together with those of the file `--columns`.
    fn format(&self) -> Result<(Format, Input)> {
        let columns = ColumnNames {
            time: self.time.clone(),
            voltage: self.voltage.clone(),
            reading: self.reading.clone(),
            stiffness: self.column.clone(),
        };
        let dialect = Dialect { separator: self.separator, decimal: self.decimal };
        let given = Format { columns, dialect, sort: self.sort };
        let Some(path) = &self.columns else { return Ok((given, self.input.unwrap_or_default())) };
        let (in_file, input) = columns_file::open(path)?;
        let in_table = |error| BadInput(format!("{}, [columns]: {error}", path.display()));
        let input = input.map(|name| name.parse().map_err(in_table)).transpose()?;
        Ok((given.or(in_file), self.input.or(input).unwrap_or_default()))
    }
}
