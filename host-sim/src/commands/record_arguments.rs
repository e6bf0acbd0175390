//! Options of the commands that read measured records: files, columns, units.

use std::path::PathBuf;

use anyhow::Result;
use clap::Args;
use host_sim::output::terminal::remark;
use identify::Input;
use simulation::bad_input;
use simulation::csv_table::dialect::{Decimal, Separator};
use simulation::record::gaps::missed_turns;
use simulation::record::{Format, MeasuredRecord, columns_file};

use super::choice::{INPUT, one_of};

/// The records and how their files are written.
#[derive(Args, Debug)]
pub(crate) struct RecordArguments {
    /// The records: tables with a header, separated by commas, semicolons, tabs or blanks, of at most 1 000 000 rows and
    /// 512 MiB
    #[arg(value_name = "DATA.csv", required = true)]
    data: Vec<PathBuf>,
    /// Column of the time and its unit: ns, us, ms, s, min, h or d; or a column of ISO 8601 time stamps; default: time_s
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
    /// Separator of the columns: `,`, `;`, `tab`, `blanks` or another character; default: found in the file
    #[arg(long, value_name = "SEPARATOR")]
    separator: Option<Separator>,
    /// Decimal mark, `.` or `,`; default: found in the file
    #[arg(long, value_name = "MARK")]
    decimal: Option<Decimal>,
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
        let records: Vec<MeasuredRecord> = self.data.iter().map(|path| format.open(path)).collect::<Result<_>>()?;
        for record in &records[1..] {
            record.expect_quantities_of(&records[0])?;
        }
        for text in records.iter().flat_map(|record| &record.remarks) {
            remark(text);
        }
        for MeasuredRecord { record, .. } in &records {
            let turns = missed_turns(&record.rows);
            if turns > 0 {
                remark(&format!(
                    "{}: the voltage turns in {turns} gap(s) between the rows; what it did there is not in the record and may be \
                     taken for a property of the spring",
                    record.name
                ));
            }
        }
        Ok((records, input))
    }

    /// The options together with those of the file `--columns`.
    fn format(&self) -> Result<(Format, Input)> {
        let (mut format, named) = match &self.columns {
            Some(path) => columns_file::open(path)?,
            None => (Format::default(), None),
        };
        let columns = &mut format.columns;
        for (option, column) in [
            (&self.time, &mut columns.time),
            (&self.voltage, &mut columns.voltage),
            (&self.reading, &mut columns.reading),
            (&self.column, &mut columns.stiffness),
        ] {
            *column = option.clone().or(column.take());
        }
        format.dialect.separator = self.separator.or(format.dialect.separator);
        format.dialect.decimal = self.decimal.or(format.dialect.decimal);
        format.sort |= self.sort;
        let input = match (self.input, &named, &self.columns) {
            (Some(input), ..) => input,
            (None, Some(name), Some(path)) => match INPUT.iter().find(|(known, ..)| known == name) {
                Some((.., input)) => *input,
                None => bad_input!("{}, [columns]: input = {name:?}; expected hold, linear or stair", path.display()),
            },
            _ => Input::default(),
        };
        Ok((format, input))
    }
}
