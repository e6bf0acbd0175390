//! Measured records in every supported dialect, and damaged ones.

use std::io::BufReader;

use proptest::prelude::*;
use simulation::bad_input::BadInput;
use simulation::csv_table::text::Source;
use simulation::record::{ColumnNames, Format, MeasuredRecord};

/// How the columns of a written record are named and their units given.
#[derive(Clone, Copy, Debug)]
enum Units {
    InNames,
    InOptions,
    BelowHeader,
}

/// A way to write a record.
#[derive(Clone, Debug)]
struct Dialect {
    separator: char,
    decimal: char,
    encoding: &'static str,
    line_end: &'static str,
    order: Vec<usize>,
    time: (&'static str, f64),
    voltage: (&'static str, f64),
    units: Units,
    quoted: bool,
    trailing: bool,
    preamble: &'static str,
}

/// Time, voltage and reading of a row as decimal numbers with a point.
type Cells = (String, String, Option<String>);

fn dialects() -> impl Strategy<Value = Dialect> {
    let separators =
        prop::sample::select(vec![(',', '.'), (';', '.'), (';', ','), ('\t', '.'), ('\t', ','), (' ', '.')]);
    let times =
        vec![("ns", 1e-9), ("us", 1e-6), ("ms", 1e-3), ("s", 1.0), ("min", 60.0), ("h", 3600.0), ("d", 86400.0)];
    let voltages = vec![("nV", 1e-9), ("mV", 1e-3), ("V", 1.0), ("kV", 1e3), ("MV", 1e6)];
    let encodings = vec!["utf-8", "utf-8-bom", "utf-16le", "utf-16be", "latin-1"];
    let preambles = vec!["", "# a comment, with; separators\n\n", "% a\n// b\n", "\n"];
    let how = (
        separators,
        prop::sample::select(encodings),
        prop::sample::select(vec!["\n", "\r\n", "\r"]),
        Just(vec![0, 1, 2, 3]).prop_shuffle(),
        prop::sample::select(preambles),
    );
    let what = (
        prop::sample::select(times),
        prop::sample::select(voltages),
        prop::sample::select(vec![Units::InNames, Units::InOptions, Units::BelowHeader]),
        any::<bool>(),
        any::<bool>(),
    );
    (how, what).prop_map(|((marks, encoding, line_end, order, preamble), (time, voltage, units, quoted, trailing))| {
        let (separator, decimal) = marks;
        Dialect { separator, decimal, encoding, line_end, order, time, voltage, units, quoted, trailing, preamble }
    })
}

fn rows() -> impl Strategy<Value = Vec<Cells>> {
    let number = |most: i64| (-most..=most, 0..1000u32).prop_map(|(whole, part)| format!("{whole}.{part:03}"));
    let row = (1..1_000_000u64, number(900_000), prop::option::weighted(0.8, number(1_000_000_000)));
    (prop::collection::vec(row, 2..30), 0..2_000_000_000_000u64).prop_map(|(rows, start)| {
        let mut thousandths = start;
        let mut cells = Vec::new();
        for (step, voltage, reading) in rows {
            thousandths += step;
            // Such a voltage is allowed in every unit but MV, for which it is made small.
            cells.push((format!("{}.{:03}", thousandths / 1000, thousandths % 1000), voltage, reading));
        }
        cells
    })
}

/// A line that is no header, with `|` for the separator of the table below.
fn titles() -> impl Strategy<Value = String> {
    let fixed = [
        "Channel list",
        "***End_of_Header***",
        "exported by X, of Y; see Z",
        "Serial|12345",
        "Samples|100|100|100",
        "Date|2026/01/31||",
        "Recorded on 31 January at 12:00 by two people",
        "Rack 7|||",
        "\"a quoted title\"",
    ];
    let words = prop::collection::vec("[a-z]{1,8}", 5..9).prop_map(|words| words.join(" "));
    prop_oneof![prop::sample::select(fixed.to_vec()).prop_map(str::to_owned), words]
}

impl Dialect {
    /// The voltage in this dialect's unit, within the range of amplifiers.
    fn voltage(&self, cell: &str) -> String {
        if self.voltage.1 > 1.0 {
            format!("0.{}", cell.trim_start_matches('-').replace('.', ""))
        } else {
            cell.to_owned()
        }
    }

    fn line(&self, cells: [String; 4]) -> String {
        let quoted = |cell: &String| {
            let is_quoted = self.quoted || (self.separator == ' ' && cell.contains(' '));
            if is_quoted { format!("\"{cell}\"") } else { cell.clone() }
        };
        let cells: Vec<String> = self.order.iter().map(|&index| quoted(&cells[index])).collect();
        let trailing = if self.trailing { self.separator.to_string() } else { String::new() };
        cells.join(&self.separator.to_string()) + &trailing + self.line_end
    }

    fn file(&self, rows: &[Cells]) -> Vec<u8> {
        let (time, voltage) = (self.time.0, self.voltage.0);
        let mut text = self.preamble.replace('\n', self.line_end);
        let header = match self.units {
            Units::InNames => [format!("Time [{time}]"), format!("u_{voltage}"), "T (\u{b0}C)".into(), "note".into()],
            _ => ["zeit", "command", "m\u{e4}rz", "note"].map(str::to_owned),
        };
        text += &self.line(header);
        if matches!(self.units, Units::BelowHeader) {
            text += &self.line([format!("[{time}]"), voltage.to_owned(), "\u{b0}C".to_owned(), "-".to_owned()]);
        }
        let missing = if self.separator == ' ' { ["NaN", "-"] } else { ["", "n/a"] };
        for (index, (time, voltage, reading)) in rows.iter().enumerate() {
            let marked = |cell: &str| cell.replace('.', &self.decimal.to_string());
            let reading = reading.as_deref().map_or(missing[index % 2].to_owned(), marked);
            text += &self.line([marked(time), marked(&self.voltage(voltage)), reading, "fine".to_owned()]);
        }
        match self.encoding {
            "utf-8" => text.into_bytes(),
            "utf-8-bom" => format!("\u{feff}{text}").into_bytes(),
            "utf-16le" => format!("\u{feff}{text}").encode_utf16().flat_map(u16::to_le_bytes).collect(),
            "utf-16be" => format!("\u{feff}{text}").encode_utf16().flat_map(u16::to_be_bytes).collect(),
            _ => text.chars().map(|letter| u8::try_from(u32::from(letter)).expect("Latin-1")).collect(),
        }
    }

    fn format(&self) -> Format {
        let columns = match self.units {
            Units::InNames => ColumnNames::default(),
            Units::BelowHeader => {
                ColumnNames { time: Some("ZEIT".into()), reading: Some("m\u{e4}rz".into()), ..ColumnNames::default() }
            }
            Units::InOptions => ColumnNames {
                time: Some(format!("Zeit:{}", self.time.0)),
                voltage: Some(format!("command:{}", self.voltage.0)),
                reading: Some("M\u{e4}rz:\u{b0}C".into()),
                stiffness: None,
            },
        };
        Format { columns, ..Format::default() }
    }
}

proptest! {
    #![proptest_config(ProptestConfig { cases: 1000, failure_persistence: None, ..ProptestConfig::default() })]

    #[test]
    fn a_record_reads_back_from_every_dialect(dialect in dialects(), rows in rows()) {
        let source = Source::new("r", dialect.file(&rows));
        let MeasuredRecord { record, units, .. } = dialect.format().read(source).map_err(|error| {
            TestCaseError::fail(format!("{error}\n{}", String::from_utf8_lossy(&dialect.file(&rows))))
        })?;
        prop_assert_eq!((&*units.time.name, units.time.si), dialect.time);
        prop_assert_eq!((&*units.voltage.name, units.voltage.si), dialect.voltage);
        prop_assert_eq!(&units.reading, "\u{b0}C");
        prop_assert_eq!(record.rows.len(), rows.len());
        let number = |cell: &str| cell.parse::<f64>().expect("a number");
        for (read, (time, voltage, reading)) in record.rows.iter().zip(&rows) {
            prop_assert_eq!(read.time_s, number(time) * dialect.time.1);
            prop_assert_eq!(read.voltage_v, number(&dialect.voltage(voltage)) * dialect.voltage.1);
            prop_assert_eq!(read.measured, reading.as_deref().map(number));
        }
    }

    #[test]
    fn lines_of_titles_above_the_header_change_nothing_but_the_line_numbers(
        dialect in dialects(),
        rows in rows(),
        titles in prop::collection::vec(titles(), 1..30),
    ) {
        let dialect = Dialect { preamble: "", encoding: "utf-8", ..dialect };
        let plain = dialect.file(&rows);
        let end = dialect.line_end;
        let above: String = titles.iter().map(|title| title.replace('|', &dialect.separator.to_string()) + end).collect();
        let read = |bytes: Vec<u8>| dialect.format().read(Source::new("r", bytes));
        let titled = [above.as_bytes(), &plain].concat();
        let shown = String::from_utf8_lossy(&titled).into_owned();
        let titled = read(titled).map_err(|error| TestCaseError::fail(format!("{error}\n{shown}")))?;
        let mut expected = read(plain).expect("every dialect is read");
        for row in &mut expected.record.rows {
            row.line += titles.len();
        }
        let (lines, header) = (titles.len(), titles.len() + 1);
        expected.remarks.insert(0, format!("r: {lines} line(s) above the header in line {header}, skipped"));
        prop_assert_eq!(titled, expected, "{}", shown);
    }

    #[test]
    fn a_damaged_file_is_read_or_rejected_in_one_line(
        dialect in dialects(),
        rows in rows(),
        piece in 1..40usize,
        damage in prop::collection::vec((any::<prop::sample::Index>(), any::<u8>()), 1..4),
        sort in any::<bool>(),
    ) {
        let mut bytes = dialect.file(&rows);
        for (place, byte) in damage {
            let place = place.index(bytes.len());
            bytes[place] = byte;
        }
        let format = Format { sort, ..dialect.format() };
        let in_pieces = format.read(Source::read("r.csv", BufReader::with_capacity(piece, &*bytes)));
        let in_pieces = in_pieces.map_err(|error| error.to_string());
        let whole = read(bytes, &format);
        // What cannot be a text is said before what is wrong in an earlier line of the same piece.
        if !matches!(&whole, Err(error) if error.contains("a byte 0") || error.contains("not UTF-16")) {
            prop_assert_eq!(&in_pieces, &whole);
        }
        if let Err(error) = whole {
            prop_assert!(error.starts_with("r.csv") && says_what_was_expected(&error), "{error}");
        }
    }
}

/// True for one line with the word "expected", or one that says what a cell is not.
fn says_what_was_expected(error: &str) -> bool {
    (error.contains("expected") || error.contains("` is not a ")) && !error.contains('\n')
}

fn read(text: impl Into<Vec<u8>>, format: &Format) -> Result<MeasuredRecord, String> {
    format.read(Source::new("r.csv", text)).map_err(|error| {
        assert!(error.is::<BadInput>(), "{error}");
        error.to_string()
    })
}

#[test]
fn every_damage_is_named_with_line_column_and_what_was_expected() {
    let any = Format::default();
    let asked = |time: &str| Format {
        columns: ColumnNames { time: Some(time.into()), ..ColumnNames::default() },
        ..Format::default()
    };
    let utf_16 = |text: &str| -> Vec<u8> { text.encode_utf16().flat_map(u16::to_le_bytes).collect() };
    let head = "t_ms;u_kV;x_mm\n";
    for (text, format, expected) in [
        (
            format!("{head}0;1;2\n1;1,5;2.5\n"),
            &any,
            "r.csv, line 3, column x_mm: `2.5` has a decimal point, line 3 a decimal comma",
        ),
        (
            format!("{head}0;1;1.234,5\n"),
            &any,
            "line 2, column x_mm: `1.234,5` is not a finite number (without separators of thousands)",
        ),
        (format!("{head}0;1;1 234\n"), &any, "`1 234` is not a finite number (without separators of thousands)"),
        (format!("{head}0;1;inf\n"), &any, "line 2, column x_mm: `inf` is not a finite number"),
        (format!("{head}0;NaN;1\n"), &any, "line 2, column u_kV: `NaN` is not a finite number"),
        (format!("{head};1;1\n"), &any, "line 2, column t_ms: no value; expected a finite number"),
        (format!("{head}0;;1\n"), &any, "line 2, column u_kV: no value; expected a finite number"),
        (format!("{head}0;1001;1\n"), &any, "line 2, column u_kV: `1001` is not a number from -1000 to 1000"),
        (format!("{head}0;1;1e16\n"), &any, "line 2, column x_mm: `1e16` is not a number from -1e15 to 1e15"),
        (
            format!("{head}0;1;1\n# a\n2;1;1\n1;1;1\n"),
            &any,
            "line 5, column t_ms: 1 follows 2; expected increasing times after line 4 (--sort",
        ),
        (format!("{head}0;1;1\n0;1\n"), &any, "line 3: 2 field(s); expected 3 as in the header"),
        (format!("{head}0;1;1;4\n"), &any, "line 2: 4 field(s); expected 3 as in the header"),
        (format!("{head}0;1;1\n"), &any, "1 row(s) of data; expected at least 2"),
        (
            "t_ms,u_kV,x_mm\n0,5,1,5,2,5\n".into(),
            &any,
            "line 2: 6 field(s); expected 3 as in the header (decimal commas need another separator",
        ),
        (
            "a,u,stiffness\n0,1,2\n1,1,2\n".into(),
            &asked("a:parsec"),
            "--time a:parsec: `parsec` is not a unit of time; expected ns, us, ms, s, min, h or d",
        ),
        (
            "t [weeks],u_V,x_mm\n0,1,2\n".into(),
            &asked("t [weeks]"),
            "--time t [weeks]: `weeks` is not a unit of time; expected ns",
        ),
        (
            "stiffness,u_V,a\nV,V,\"s]\n1,2,3\n1,2,4\n".into(),
            &asked("a"),
            "--time a: `s]\\n1,2,3\\n1,2,4` is not a unit of time; expected ns",
        ),
        (
            "time,u_V,x_mm\n2026-01-31,1,2\n".into(),
            &any,
            "line 2, column time: `2026-01-31` is a date without time; expected",
        ),
        (
            "time,u_V,x_mm\n2026-01-31T01:00,1,2\n5,1,2\n".into(),
            &any,
            "line 3, column time: `5` is not a time stamp without a zone, as in the first row; expected",
        ),
        (
            "time,u_V,x_mm\n2026-01-31T01:00Z,1,2\n2026-01-31T01:01,1,2\n".into(),
            &any,
            "line 3, column time: `2026-01-31T01:01` is not a time stamp with a zone",
        ),
        (
            "time,u_V,x_mm\n0,1,2\n2026-01-31T01:01,1,2\n".into(),
            &any,
            "line 3, column time: `2026-01-31T01:01` is not a finite number, as in the first row",
        ),
        (
            "time,u_V,x_mm\n2026-01-31T02:00,1,2\n2026-01-31T01:00,1,2\n".into(),
            &any,
            "line 3, column time: 2026-01-31T01:00 follows",
        ),
        (
            "time [ms],u_V,x_mm\n2026-01-31T01:00,1,2\n2026-01-31T02:00,1,2\n".into(),
            &any,
            "line 2, column time [ms]: `2026-01-31T01:00` is a time stamp, not a number in ms; expected",
        ),
        (
            "t u y\n0 1 2\n1 2\n".into(),
            &asked("t"),
            "line 1: no column `stiffness`; expected a header with t, voltage_v, stiffness, or --time t --voltage u --reading y, found `t,u,y`",
        ),
        (
            "time,u_V,x_mm\n01/31/2026 10:00,1,2\n".into(),
            &any,
            "line 2, column time: `01/31/2026 10:00` is not a time stamp; expected a number, or one such as 2026-01-31T23:59:58.5, 31",
        ),
        (
            "time,u_V,x_mm\n10:00:00,1,2\n,1,2\n".into(),
            &any,
            "line 3, column time: no value; expected a time of day, as in the first row",
        ),
        (
            "time,u_V,x_mm\n10:00,1,2\n10:01,1,2\n".into(),
            &any,
            "line 2, column time: `10:00` is not a time stamp; expected a number, or one such as 2026-01-31T23:59:58.5, \
             31.01.2026 23:59:58.5, 23:59:58.5, 59:58.5",
        ),
        (
            "time,u_V,x_mm\n59:59.5,1,2\n1:00:00.5,1,2\n".into(),
            &any,
            "line 3, column time: `1:00:00.5` is not a time in minutes and seconds, as in the first row; expected another such",
        ),
        (
            "time,u_V,x_mm\n10:01.5,1,2\n10:00.5,1,2\n".into(),
            &any,
            "line 3, column time: 10:00.5 follows a later or equal time; expected increasing times",
        ),
        (
            "time,u_V,x_mm\n60:01.5,1,2\n10:00.5,1,2\n".into(),
            &any,
            "line 3, column time: 10:00.5 follows a later or equal time; expected increasing times",
        ),
        (
            "time [min],u_V,x_mm\n10:01.5,1,2\n".into(),
            &any,
            "line 2, column time [min]: `10:01.5` is a time stamp, not a number in min; expected a number",
        ),
        (
            "time,u_V,x_mm\n10:00:00,1,2\n2026-01-31T10:00:01,1,2\n".into(),
            &any,
            "line 3, column time: `2026-01-31T10:00:01` is not a time of day, as in the first row; expected another such",
        ),
        (
            "time,u_V,x_mm\n25:00:00,1,2\n1:00:01,1,2\n".into(),
            &any,
            "line 3, column time: 1:00:01 follows a later or equal time; expected increasing times",
        ),
        (
            "time,u_V,x_mm\n10:00:01,1,2\n10:00:00,1,2\n".into(),
            &any,
            "line 3, column time: 10:00:00 follows a later or equal time; expected increasing times",
        ),
        ("0,0,2\n1,2,3\n".into(), &any, "line 1: numbers instead of names; expected a header with time_s"),
        (
            "0,1,2\n1,2,3\n".into(),
            &any,
            "line 1: numbers instead of names; expected a header with time_s, voltage_v, stiffness",
        ),
        (
            "t_ms,u_kV,\"x_mm\n0,1,2\n".into(),
            &any,
            "line 1: a line break, perhaps after an unclosed quote; expected a header with",
        ),
    ] {
        let error = read(text.clone(), format).unwrap_err();
        assert!(error.contains(expected) && says_what_was_expected(&error), "{text:?}: {error}");
    }
    let broken: Vec<u8> = utf_16("\u{feff}time_s,voltage_v\n").into_iter().chain([0x00, 0xd8]).collect();
    assert_eq!(
        read(broken, &any).unwrap_err(),
        "r.csv: not UTF-16LE, although it starts with its mark; expected UTF-8"
    );
}

#[test]
fn a_mark_that_may_separate_thousands_is_asked_for() {
    let forced = |decimal: &str| {
        let decimal = decimal.parse().ok();
        Format { dialect: simulation::csv_table::dialect::Dialect { separator: None, decimal }, ..Format::default() }
    };
    let voltages = |text: &str, decimal: &str| {
        read(text, &forced(decimal)).map(|read| read.record.rows.iter().map(|row| row.voltage_v).collect::<Vec<_>>())
    };
    let doubtful = "t_s;u_V;x_mm\n0;0;10\n1;800;11\n2;1,200;12\n";
    assert_eq!(
        voltages(doubtful, "").unwrap_err(),
        "r.csv, line 4, column u_V: `1,200` can have a decimal comma or a separator of thousands; expected numbers without \
         separators of thousands, or --decimal ,"
    );
    assert_eq!(voltages(doubtful, ","), Ok(vec![0.0, 800.0, 1.2]));
    assert!(voltages(doubtful, ".").unwrap_err().contains("`1,200` is not a finite number (without separators"));
    let points = doubtful.replace(',', ".").replace(';', "\t");
    assert!(voltages(&points, "").unwrap_err().ends_with("or --decimal ."), "{points}");
    for decimals in [
        // Three decimals everywhere, zeros in front, another number of decimals in any column, four digits without a mark.
        "t_s;u_V;x_mm\n0;1,125;2,125\n1;1,125;2,250\n",
        "t_s;u_V;x_mm\n0;0;12,345\n1;0,125;12,345\n",
        "t_s;u_V;x_mm\n0;0;1,5\n1;1,125;12,345\n",
        "t_s;u_V;x_mm\n0;1000;10\n1;0;10\n2;1,125;12\n",
        "t_s,u_V,x_mm\n0,0,10\n1,1.125,10\n",
    ] {
        assert!(voltages(decimals, "").is_ok(), "{decimals}: {:?}", voltages(decimals, ""));
    }
}

#[test]
fn a_decimal_comma_in_quotes_between_commas_is_asked_for() {
    let error = |cell: &str| {
        let text = format!("t_s,u_V,x_mm\n\"0\",\"0\",\"{cell}\"\n");
        let error = read(text, &Format::default()).unwrap_err();
        error.strip_prefix("r.csv, line 2, column x_mm: ").expect("the place").to_owned()
    };
    for (cell, expected) in [
        ("0,1", "`0,1` is not a finite number (a decimal comma where commas separate the columns needs --decimal ,)"),
        (
            "-12,5e3",
            "`-12,5e3` is not a finite number (a decimal comma where commas separate the columns needs --decimal ,)",
        ),
        (
            "1,200",
            "`1,200` is not a finite number (without separators of thousands; a decimal comma needs --decimal ,)",
        ),
        ("1,200.5", "`1,200.5` is not a finite number (without separators of thousands)"),
        ("1 200", "`1 200` is not a finite number (without separators of thousands)"),
    ] {
        assert_eq!(error(cell), expected);
    }
}

#[test]
fn marks_of_spreadsheets_and_libraries_are_missing_readings_and_failed_ones_are_not() {
    let reading = |cell: &str| read(format!("t_s;u_V;x_mm\n0;0;1\n1;0;{cell}\n"), &Format::default());
    for cell in
        ["", "-", "NaN", "nan", "-nan", "NA", "N/A", "n/a", "#N/A", "#NV", "<NA>", "null", "NULL", "None", "\"#N/A\""]
    {
        let read = reading(cell).unwrap_or_else(|error| panic!("{cell}: {error}"));
        assert_eq!(read.record.rows[1].measured, None, "{cell}");
        assert!(
            read.remarks.contains(&"r.csv: 1 of 2 rows without a reading".to_owned()),
            "{cell}: {:?}",
            read.remarks
        );
    }
    for cell in ["OVLD", "inf", "-Infinity", "#DIV/0!", "#REF!", "--"] {
        assert_eq!(
            reading(cell).unwrap_err(),
            format!(
                "r.csv, line 3, column x_mm: `{cell}` is not a finite number; a missing reading is an empty cell, `-`, NaN, NA, \
                 N/A, #N/A, null or None"
            )
        );
    }
    assert!(reading("1e16").unwrap_err().ends_with("`1e16` is not a number from -1e15 to 1e15"));
    let voltage = read("t_s;u_V;x_mm\n0;null;1\n", &Format::default()).unwrap_err();
    assert_eq!(voltage, "r.csv, line 2, column u_V: `null` is not a finite number");
}

#[test]
fn rows_may_lack_the_comment_with_which_labview_ends_its_header() {
    let header = "LabVIEW Measurement\t\nWriter_Version\t2\nReader_Version\t2\nSeparator\tTab\nDecimal_Separator\t.\n\
                  Multi_Headings\tNo\nX_Columns\tOne\nTime_Pref\tRelative\nDate\t2026/01/31\nTime\t10:00:00.5\n\
                  ***End_of_Header***\t\n\t\nChannels\t2\t\t\nSamples\t2\t2\t\nDate\t2026/01/31\t2026/01/31\t\n\
                  X_Dimension\tTime\tTime\t\nX0\t0.0\t0.0\t\nDelta_X\t0.1\t0.1\t\n***End_of_Header***\t\t\t\n";
    let names = ["X_Value:s", "Voltage", "Force:N"].map(|name| Some(name.to_owned()));
    let [time, voltage, reading] = names;
    let asked = Format { columns: ColumnNames { time, voltage, reading, stiffness: None }, ..Format::default() };
    for rows in ["0.0\t0\t1.5\n0.1\t36\t\n", "0.0\t0\t1.5\tbegun by hand\n0.1\t36\t\t\n"] {
        let text = format!("{header}X_Value\tVoltage\tForce\tComment\n{rows}");
        let read = read(text, &asked).unwrap_or_else(|error| panic!("{rows}: {error}"));
        let rows: Vec<_> =
            read.record.rows.iter().map(|row| (row.line, row.time_s, row.voltage_v, row.measured)).collect();
        assert_eq!(rows, [(21, 0.0, 0.0, Some(1.5)), (22, 0.1, 36.0, None)]);
        assert_eq!(read.remarks[0], "r.csv: 19 line(s) above the header in line 20, skipped");
    }
    let text = format!("{header}X_Value\tVoltage\tForce\tComment\n0.0\t0\t1.5\n0.1\t36\t1.5\n");
    let error = read(text, &Format::default()).unwrap_err();
    assert!(
        error.contains("--time one of X_Value, Force --voltage Voltage --reading one of X_Value, Force, found"),
        "{error}"
    );
    let short = read("t_s;u_V;x_mm;Comment\n0;0;1\n1;0\n", &Format::default()).unwrap_err();
    assert_eq!(short, "r.csv, line 3: 2 field(s); expected 4 as in the header");
}

#[test]
fn rows_of_separators_are_blank_lines() {
    let text = "t_s;u_V;x_mm\n0;0;1\n;;\n1;0;2\n;;\n;;\n";
    let rows = read(text, &Format::default()).unwrap().record.rows;
    assert_eq!(rows.iter().map(|row| row.line).collect::<Vec<_>>(), [2, 4]);
    assert!(
        read("t_s;u_V;x_mm\n0;0;1\n;;5\n", &Format::default()).unwrap_err().contains("line 3, column t_s: no value")
    );
}

#[test]
fn rows_of_separators_above_the_header_are_blank_lines_too() {
    for above in [";;\n", ";;\n\n # a\n;;\n", "a title;;\n;;\n"] {
        let read = read(format!("{above}t_s;u_V;x_mm\n0;0;1\n1;0;2\n"), &Format::default());
        assert_eq!(read.map(|read| read.record.rows.len()), Ok(2), "{above:?}");
    }
}

#[test]
fn a_row_of_letters_in_their_order_labels_the_channels_and_is_no_row_of_units() {
    let format =
        Format { columns: ColumnNames { reading: Some("x".into()), ..ColumnNames::default() }, ..Format::default() };
    let rows = "0;0;1\n1;0;2\n";
    for (above, units, remarks) in [
        ("t;u;x\n;A;B\n", ["s", "V", "units"], 3),
        ("t;u;x\nA;B;C\n", ["s", "V", "units"], 3),
        ("t;u;x\n;A;B\nms;V;mm\n", ["ms", "V", "mm"], 2),
        (";A;B\nt;u;x\n", ["s", "V", "units"], 3),
        ("A;B;C\nt;u;x\n", ["s", "V", "units"], 3),
        // Ampere and newton.
        ("t;u;x\n;A;N\n", ["s", "A", "N"], 2),
        ("t;u;x\ns;A;\n", ["s", "A", "units"], 1),
    ] {
        let read = read(format!("{above}{rows}"), &format).unwrap();
        let found = [&*read.units.time.name, &*read.units.voltage.name, &*read.units.reading];
        assert_eq!((found, read.remarks.len()), (units, remarks), "{above:?}: {:?}", read.remarks);
    }
    let named = ColumnNames {
        time: Some("A".into()),
        voltage: Some("B".into()),
        reading: Some("C".into()),
        ..ColumnNames::default()
    };
    let read = read(format!("a title\nA;B;C\n{rows}"), &Format { columns: named, ..Format::default() });
    assert_eq!(read.map(|read| read.record.rows.len()), Ok(2), "letters are names where there are no others");
}

#[test]
fn a_header_in_a_comment_is_named() {
    let error = |text: &str| read(text, &Format::default()).unwrap_err();
    assert_eq!(
        error("# by numpy\n# t_s u_V x_mm\n0.0 0.0 1.5\n0.5 0.0 1.25\n"),
        "r.csv, line 2: the names of the columns are a comment; expected a header: remove the mark in front of them"
    );
    assert!(error("% t_s,u_V,x_mm\n0.0,0.0,1.5\n0.5,0.0,1.25\n").starts_with("r.csv, line 1: the names"));
    assert!(error("# run by Bob\n0.5\n0.25\n").starts_with("r.csv, line 2: numbers instead of names"), "one column");
    assert!(error("# two columns\n0.0,0.0,1.5\n0.5,0.0,1.25\n").starts_with("r.csv, line 2: numbers instead of names"));
}

#[test]
fn a_header_that_could_be_another_line_is_refused_with_both_lines() {
    let rows = "0;0;1\n1;0;2\n";
    let error = |text: String| read(text, &Format::default()).unwrap_err();
    assert_eq!(
        error(format!("device;serial;place\nt_ms;u_V;x_mm\n{rows}")),
        "r.csv, lines 1 and 2: each can be the header; expected one line of names above the rows, at most a line of units \
         below it, and `#` before any other"
    );
    let table = "title\nchannel;lowest;highest\n".to_owned() + &"1;-10;10\n".repeat(16);
    assert!(
        error(format!("{table}t_ms;u_V;x_mm\n{rows}")).starts_with("r.csv, lines 2 and 19: each can be the header")
    );
    // Beyond a hundred titles, the first line counts.
    let titles = |count: usize| format!("{}t_ms;u_V;x_mm\n{rows}", "a title\n".repeat(count));
    assert_eq!(read(titles(100), &Format::default()).unwrap().record.rows[0].line, 102);
    assert!(error(titles(101)).starts_with("r.csv, line 1: no column `time_s`"), "{}", error(titles(101)));
}

#[test]
fn a_line_of_units_is_used_where_it_fits_and_said_where_not() {
    let remarks = |text: &str| read(text, &Format::default()).map(|read| (read.units, read.remarks));
    let (units, said) = remarks("by X\nt_ms;u;stiffness\ns;kV;N/m\n0;0;1\n1;0;1\n").unwrap();
    assert_eq!((&*units.time.name, &*units.voltage.name, &*units.reading), ("s", "kV", "N/m"));
    assert_eq!(
        said,
        [
            "r.csv: 1 line(s) above the header in line 2, skipped",
            "r.csv: units s, kV, N/m below the header",
            "r.csv: column `t_ms` is read in s, not in ms",
        ]
    );
    let asked =
        Format { columns: ColumnNames { time: Some("t_ms:ms".into()), ..ColumnNames::default() }, ..Format::default() };
    let in_ms = read("t_ms;u;stiffness\ns;kV;N/m\n0;0;1\n1;0;1\n", &asked).unwrap();
    assert_eq!((&*in_ms.units.time.name, in_ms.remarks.len()), ("ms", 2), "an option wins: {:?}", in_ms.remarks);
    let channels = Format {
        columns: ColumnNames {
            voltage: Some("Channel A".into()),
            reading: Some("Channel B".into()),
            ..ColumnNames::default()
        },
        ..Format::default()
    };
    let scope = read("Time,Channel A,Channel B\n(ms),(mV),(V)\n\n0,500,1\n1,0,1\n", &channels).unwrap();
    assert_eq!((&*scope.units.time.name, &*scope.units.voltage.name, &*scope.units.reading), ("ms", "mV", "V"));
    assert_eq!(scope.record.rows[0].voltage_v, 0.5);
    // A word of the row is no unit for a column that has one.
    assert_eq!(remarks("t_s,u_kV,stiffness\ns,off,V\n0,1,1\n1,0,1\n").unwrap().0.voltage.name, "kV");
    let stamps = "Time;u_V;x\nUTC;V;mm\n2026-01-31T00:00:02;1;4\n2026-01-31T00:00:03;0;0\n";
    assert_eq!(remarks(&stamps.replace(";x\n", ";stiffness\n")).unwrap().0.reading, "mm");
    assert_eq!(
        remarks("Time;u;stiffness\nsek;V;mm\n0;0;1\n1;0;1\n").unwrap_err(),
        "r.csv, line 2, column Time: `sek` is not a unit of time; expected ns, us, ms, s, min, h or d"
    );
}

#[test]
fn sorting_mends_order_and_repetitions_but_not_two_voltages() {
    let sort = Format { sort: true, ..Format::default() };
    let text = "t_ms,u_V,x_mm\n3,1,7\n1,1,4\n1,1,4\n2,1,5\n2,1,6\n2,1,-\n";
    let MeasuredRecord { record, remarks, .. } = read(text, &sort).unwrap();
    let rows: Vec<_> = record.rows.iter().map(|row| (row.line, row.time_s, row.measured)).collect();
    assert_eq!(rows, [(3, 0.001, Some(4.0)), (5, 0.002, Some(5.5)), (2, 0.003, Some(7.0))]);
    assert_eq!(
        remarks,
        [
            "r.csv: 1 row(s) earlier than the one above, sorted",
            "r.csv: 3 row(s) at the time of another, merged",
            "r.csv: 1 time(s) with different readings, averaged",
        ]
    );
    let stamps = "Time,u_V,x_mm\n2026-01-31T00:00:02,1,4\n2026-01-31T00:00:00.5,0,0\n";
    let times: Vec<f64> = read(stamps, &sort).unwrap().record.rows.iter().map(|row| row.time_s).collect();
    assert_eq!(times, [0.0, 1.5]);
    let error = read("t_ms,u_V,x_mm\n1,1,4\n0,0,0\n1,2,4\n", &sort).unwrap_err();
    assert_eq!(error, "r.csv, lines 2 and 4: two voltages at the same time, 1 V and 2 V; expected one");
}

#[test]
fn time_stamps_and_times_since_1970_are_counted_from_the_first_row() {
    let times = |text: &str| {
        let read = read(text, &Format::default()).unwrap();
        (read.record.rows.iter().map(|row| row.time_s).collect::<Vec<_>>(), read.units.time.name, read.remarks)
    };
    let from_first = vec!["r.csv: times are counted from the first row".to_owned()];
    let stamps = "Time;u_V;x_mm\n2026-01-31T23:59:59,5;0;1\n2026-02-01 00:00:01;0;1\n";
    assert_eq!(times(stamps), (vec![0.0, 1.5], "s".to_owned(), from_first.clone()));
    let days_first = "Time;u_V;x_mm\n31.01.2026 23:59:59,5;0;1\n1.2.2026 00:00:01;0;1\n";
    assert_eq!(times(days_first), (vec![0.0, 1.5], "s".to_owned(), from_first.clone()));
    let over_two_midnights = "Time;u_V;x_mm\n23:59:59,5;0;1\n0:00:01;0;1\n11:00:00;0;1\n22:00:00;0;1\n9:00:00;0;1\n";
    let expected = vec![0.0, 1.5, 39600.5, 79200.5, 118_800.5];
    assert_eq!(times(over_two_midnights), (expected, "s".to_owned(), from_first.clone()));
    let elapsed = "Time;u_V;x_mm\n0:00:00;0;1\n15:00:00;0;1\n31:00:00,25;0;1\n";
    assert_eq!(times(elapsed), (vec![0.0, 54000.0, 111_600.25], "s".to_owned(), from_first.clone()));
    let over_an_hour = "Time (mm:ss.s);u_V;x_mm\n59:59,5;0;1\n00:01,0;0;1\n30:00,0;0;1\n59:59,0;0;1\n0:00,5;0;1\n";
    assert_eq!(times(over_an_hour), (vec![0.0, 1.5, 1800.5, 3599.5, 3601.0], "s".to_owned(), from_first.clone()));
    let minutes = "Date;Time;u_V;x_mm\n2026-01-31;00:00.0;0;1\n2026-02-01;59:59.5;0;1\n2026-02-01;100:00.25;0;1\n";
    assert_eq!(times(minutes), (vec![0.0, 3599.5, 6000.25], "s".to_owned(), from_first.clone()));
    // The days are in a column of dates, of which one stays the same.
    let dates = |first: &str, second: &str, third: &str| {
        format!(
            "Calibrated;Date;Time;u_V;x_mm\n1.1.2026;{first};10:00:00;0;1\n1.1.2026;{second};10:00:01;0;1\n\
             1.1.2026;{third};10:00:00;0;1\n"
        )
    };
    let of_days = vec![from_first[0].clone(), "r.csv: the days of the times are in column `Date`".to_owned()];
    for (first, second, third) in [
        ("2026-01-31", "2026-01-31", "2026-02-03"),
        ("31.01.2026", "", "3.2.2026"),
        ("2026-01-31 00:00:00", "2026-01-31 00:00:00", "2026-02-03 00:00:00"),
    ] {
        assert_eq!(times(&dates(first, second, third)), (vec![0.0, 1.0, 259_200.0], "s".to_owned(), of_days.clone()));
    }
    let slashes = read(dates("1/31/2026", "1/31/2026", "2/3/2026"), &Format::default()).unwrap_err();
    assert!(slashes.contains("line 4, column Date: `2/3/2026` is not a date such as 2026-01-31 or 31.01"), "{slashes}");
    let stays = "Date;Time;u_V;x_mm\n1/31/2026;23:59:59;0;1\n1/31/2026;0:00:01;0;1\n";
    assert_eq!(times(stays).0, [0.0, 2.0]);
    let merged = "Date;Time;u_V;x_mm\n2026-01-31;23:59:59;0;1\n2026-02-01;0:00:01;0;1\n;0:00:02;0;1\n";
    assert_eq!(times(merged).0, [0.0, 2.0, 3.0]);
    let over_midnight = "Date;Time;u_V;x_mm\n1/31/2026;23:59:59;0;1\n2/1/2026;0:00:01;0;1\n2/1/2026;0:00:02;0;1\n";
    assert_eq!(times(over_midnight).0, [0.0, 2.0, 3.0]);
    let hours = "Date;Time;u_V;x_mm\n2026-01-31;26:00:00;0;1\n2026-02-01;26:00:01;0;1\n";
    assert_eq!(times(hours).0, [0.0, 1.0]);
    let stopwatch = "Date;Time;u_V;x_mm\n2026-01-31;0:00:01;0;1\n2026-02-01;0:00:02;0;1\n";
    let error = read(stopwatch, &Format::default()).unwrap_err();
    assert!(error.contains("line 3, column Time: `0:00:02` follows a smaller time while the date changes"), "{error}");
    let late = "Date;Time;u_V;x_mm\n2026-01-31;0:05:01;0;1\n2026-01-31;0:05:02;0;1\n2026-02-01;0:05:03;0;1\n";
    let error = read(late, &Format::default()).unwrap_err();
    assert!(error.contains("line 4, column Time: `0:05:03` follows a smaller time while the date changes"), "{error}");
    let after_a_day = late.replace("0:05:03", "0:05:13");
    assert_eq!(times(&after_a_day).0, [0.0, 1.0, 86_412.0]);
    let daily = "Date;Time;u_V;x_mm\n2026-01-31;12:00:01;0;1\n2026-02-01;12:00:02;0;1\n2026-02-02;12:00:03;0;1\n";
    assert_eq!(times(daily).0, [0.0, 86_401.0, 172_802.0]);
    // The difference is a nanosecond; doubles of this size are 256 apart.
    let epoch = "t_ns,u_V,x_mm\n1767225600123456789,0,1\n1767225600123456790,0,1\n";
    assert_eq!(times(epoch), (vec![0.0, 1e-9], "ns".to_owned(), from_first));
    let seconds = "t_s,u_V,x_mm\n1767225600.25,0,1\n1767225600.5,0,1\n";
    assert_eq!(times(seconds), (vec![1767225600.25, 1767225600.5], "s".to_owned(), vec![]));
}

#[test]
fn encodings_that_are_guessed_are_remarked_on() {
    let text = "t_ms,u_V,T (\u{b0}C)\n0,0,1\n1,0,1\n";
    let latin: Vec<u8> = text.chars().map(|letter| u8::try_from(u32::from(letter)).unwrap()).collect();
    let utf_16: Vec<u8> = format!("\u{feff}{text}").encode_utf16().flat_map(u16::to_be_bytes).collect();
    for (bytes, remarks) in [
        (text.as_bytes().to_vec(), vec![]),
        (latin, vec!["r.csv, line 1: not UTF-8; read as Latin-1 (Windows-1252)"]),
        // From there on: what was read before is UTF-8.
        (
            [text.as_bytes(), b"# m\xe4rz\n2,0,1\n"].concat(),
            vec!["r.csv, line 4: not UTF-8; read as Latin-1 (Windows-1252)"],
        ),
        (utf_16, vec!["r.csv: read as UTF-16BE; UTF-8 is the usual encoding"]),
    ] {
        let read = read(bytes, &Format::default()).unwrap();
        assert_eq!((read.remarks, &*read.units.reading), (remarks.into_iter().map(str::to_owned).collect(), "\u{b0}C"));
    }
}

#[test]
fn a_column_without_unit_is_remarked_on_unless_it_holds_time_stamps() {
    let remarks = |text: &str| read(text, &Format::default()).unwrap().remarks;
    let plain = remarks("Time,U,x_mm\n0,0,1\n1,0,1\n");
    assert_eq!(plain, ["r.csv: column `Time` has no unit; read in s", "r.csv: column `U` has no unit; read in V"]);
    assert!(remarks("time_s,applied_v,stiffness\n0,0,1\n1,0,1\n").is_empty());
    assert!(remarks("Time,U,stiffness\ns,kV,mm\n0,0,1\n1,0,1\n").len() == 1, "the units are below the header");
}

#[test]
fn separators_and_decimal_marks_can_be_forced() {
    let forced = |separator: &str, decimal: &str| Format {
        dialect: simulation::csv_table::dialect::Dialect {
            separator: separator.parse().ok(),
            decimal: decimal.parse().ok(),
        },
        ..Format::default()
    };
    let readings = |text: &str, format: &Format| {
        read(text, format).map(|read| read.record.rows.iter().filter_map(|row| row.measured).collect::<Vec<_>>())
    };
    assert_eq!(readings("t_ms:u_V:x_mm\n0:0:1\n1:0:2\n", &forced(":", "")), Ok(vec![1.0, 2.0]));
    assert_eq!(readings("t_ms,u_V,x_mm\n0,0,\"1,5\"\n1,0,2\n", &forced("", ",")), Ok(vec![1.5, 2.0]));
    assert_eq!(readings("sep=:\nt_ms:u_V:x_mm\n0:0:1\n1:0:2\n", &Format::default()), Ok(vec![1.0, 2.0]));
    // Names with blanks and commas between bars.
    let bars = "Time [ms] | Command, set [V] | Tip [mm]\n0 | 0 | 1,5\n1 | 0 | 2\n";
    assert_eq!(readings(bars, &Format::default()), Ok(vec![1.5, 2.0]));
    let error = readings("t_ms;u_V;x_mm\n0;0;1,5\n", &forced(";", ".")).unwrap_err();
    assert!(error.contains("line 2, column x_mm: `1,5` is not a finite number"), "{error}");
}
