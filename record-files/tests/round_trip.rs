//! What is written is read back, and what others write is read as a CSV file with the same columns is.

use std::path::PathBuf;

use mcap::records::op;
use record_files::{Cell, Column, Container, Sheet, Writer, open, read};
use simulation::BadInput;
use simulation::csv_table::dialect::{Decimal, Dialect, Separator};
use simulation::record::{ColumnNames, Format, MeasuredRecord};

const BOTH: [Container; 2] = [Container::Mcap, Container::Parquet];

fn bytes(container: Container, columns: &[Column], rows: &[Vec<Cell<'_>>]) -> Vec<u8> {
    let mut bytes = Vec::new();
    let sheet = Sheet { name: "record", source: "a test", columns };
    let mut writer = Writer::new(container, &sheet, &mut bytes).unwrap();
    for (number, row) in rows.iter().enumerate() {
        writer.row(number as u64, row).unwrap();
    }
    writer.finish().unwrap();
    bytes
}

const RECORD: [Column; 3] =
    [Column::number("time_s", "s"), Column::number("voltage_v", "V"), Column::number("stiffness", "V")];

fn record(rows: &[(f64, f64, f64)]) -> Vec<Vec<Cell<'static>>> {
    let row = |&(time, voltage, reading): &(f64, f64, f64)| [time, voltage, reading].map(Cell::Number).to_vec();
    rows.iter().map(row).collect()
}

fn parsed(container: Container, bytes: Vec<u8>, format: &Format) -> MeasuredRecord {
    read("r", container, bytes, format, None).unwrap()
}

fn message(container: Container, bytes: Vec<u8>, format: &Format) -> String {
    let error = read("r", container, bytes, format, None).unwrap_err();
    let text = error.downcast_ref::<BadInput>().expect("bad input").0.clone();
    assert!(text.starts_with('r') && !text.contains('\n'), "{text}");
    text
}

#[test]
fn a_record_is_read_to_the_last_bit_and_as_its_csv_is() {
    let values = [(0.0, 0.1 + 0.2, 1.0 / 3.0), (0.001, -7e-9, f64::NAN), (3.25e9, 500.0, -5e-324), (1e10, 1.0, 4.2e14)];
    let text = values.map(|(time, voltage, reading)| format!("{time:?},{voltage:?},{reading:?}\n")).concat();
    let text = format!("time_s,voltage_v,stiffness\n{text}");
    let csv = Format::default().read(simulation::csv_table::text::Source::new("r", text)).unwrap();
    for container in BOTH {
        let found = parsed(container, bytes(container, &RECORD, &record(&values)), &Format::default());
        let plain = |measured: &MeasuredRecord| {
            measured.record.rows.iter().map(|row| (row.time_s, row.voltage_v, row.measured)).collect::<Vec<_>>()
        };
        assert_eq!(plain(&found), plain(&csv), "{container:?}");
        assert_eq!((&found.units, &found.column, &found.remarks), (&csv.units, &csv.column, &csv.remarks));
        assert_eq!(found.record.rows[0].line, 1, "rows count from 1");
    }
}

#[test]
fn units_of_columns_are_those_of_the_file() {
    let columns = [Column::number("t", "ms"), Column::number("u", "kV"), Column::number("x", "mm")];
    for container in BOTH {
        let file = bytes(container, &columns, &record(&[(0.0, 1.0, 2.0), (5.0, 2.0, 3.0)]));
        let found = parsed(container, file, &Format::default());
        assert_eq!((&*found.units.time.name, &*found.units.voltage.name, &*found.units.reading), ("ms", "kV", "mm"));
        assert_eq!((found.record.rows[1].time_s, found.record.rows[1].voltage_v), (0.005, 2000.0));
    }
}

#[test]
fn errors_name_row_and_column() {
    let rows = record(&[(0.0, 1.0, 2.0), (1.0, 2e6, 3.0)]);
    let late = record(&[(0.0, 1.0, 2.0), (0.0, 2.0, 3.0)]);
    let many = [Column::number("time_s", "s"), Column::number("x", "mm"), Column::number("y", "mm")];
    for container in BOTH {
        let error = message(container, bytes(container, &RECORD, &rows), &Format::default());
        assert!(error.starts_with("r, row 2, column voltage_v: `2000000.0` is not a number from -1000000"), "{error}");
        let error = message(container, bytes(container, &RECORD, &late), &Format::default());
        assert!(
            error.starts_with("r, row 2, column time_s: 0 follows 0; expected increasing times after row 1"),
            "{error}"
        );
        let error = message(container, bytes(container, &many, &rows), &Format::default());
        assert!(
            error.starts_with("r: no column `voltage_v`; expected a header with time_s, voltage_v, stiff"),
            "{error}"
        );
        let error = message(container, bytes(container, &RECORD, &rows[..1]), &Format::default());
        assert_eq!(error, "r: 1 row(s) of data; expected at least 2");
        assert!(message(container, bytes(container, &RECORD, &[]), &Format::default()).contains("expected"));
    }
}

#[test]
fn the_controllers_estimate_is_no_measurement_here_either() {
    let columns = [RECORD[0], RECORD[1], Column::number("estimate", "V")];
    for container in BOTH {
        let file = bytes(container, &columns, &record(&[(0.0, 1.0, 2.0), (1.0, 2.0, 3.0)]));
        let error = message(container, file, &Format::default());
        assert!(error.contains("the controller's own estimate"), "{error}");
    }
}

#[test]
fn texts_and_whole_numbers_can_be_times() {
    let columns = [Column::text("timestamp"), Column::number("voltage_v", "V"), Column::number("stiffness", "V")];
    let stamped = ["2026-01-31T23:59:58Z", "2026-01-31T23:59:59.5Z"];
    let rows = stamped.map(|stamp| vec![Cell::Text(stamp), Cell::Number(1.0), Cell::Number(2.0)]);
    let whole = [Column::whole("time_ns"), columns[1], columns[2]];
    let start = 1_767_225_600_123_456_789;
    let counted = [0, 1_500].map(|ns| vec![Cell::Whole(start + ns), Cell::Number(1.0), Cell::Number(2.0)]);
    for container in BOTH {
        let found = parsed(container, bytes(container, &columns, &rows), &Format::default());
        assert_eq!(found.record.rows[1].time_s, 1.5);
        let found = parsed(container, bytes(container, &whole, &counted), &Format::default());
        assert_eq!(found.record.rows[1].time_s, 1.5e-6, "{:?}", found.remarks);
    }
}

#[test]
fn the_days_of_times_are_in_a_column_of_dates() {
    let columns = [Column::text("made"), Column::text("day"), Column::text("time"), RECORD[1], RECORD[2]];
    let rows = [("2026-01-31", "23:59:59"), ("2026-02-02", "00:00:01"), ("2026-02-02", "00:00:02")]
        .map(|(day, time)| [["2026-01-30", day, time].map(Cell::Text).to_vec(), vec![Cell::Number(1.0); 2]].concat());
    for container in BOTH {
        let found = parsed(container, bytes(container, &columns, &rows), &Format::default());
        let times: Vec<f64> = found.record.rows.iter().map(|row| row.time_s).collect();
        assert_eq!(times, [0.0, 86_402.0, 86_403.0], "{container:?}");
        assert_eq!(found.remarks[1], "r: the days of the times are in column `day`");
    }
}

/// Files of pyarrow, which the writer here cannot make: two groups of rows, a dictionary, missing readings; `v2` are pages of version 2.
const COMPRESSED: [(&str, &[u8]); 4] = [
    ("zstd", include_bytes!("../../fuzz/corpus/parquet/zstd.parquet")),
    ("gzip", include_bytes!("../../fuzz/corpus/parquet/gzip.parquet")),
    ("zstd v2", include_bytes!("../../fuzz/corpus/parquet/zstd_v2.parquet")),
    ("gzip v2", include_bytes!("../../fuzz/corpus/parquet/gzip_v2.parquet")),
];

#[test]
fn columns_that_zstd_or_gzip_has_compressed_are_read() {
    for (name, file) in COMPRESSED {
        let found = parsed(Container::Parquet, file.to_vec(), &Format::default());
        assert_eq!(found.record.rows.len(), 60, "{name}");
        for (number, row) in found.record.rows.iter().enumerate() {
            let reading = (number % 7 != 3).then_some(50.0 + number as f64);
            let expected = (0.25 * number as f64, [0.0, 100.0, 250.0][number % 3], reading);
            assert_eq!((row.time_s, row.voltage_v, row.measured), expected, "{name}");
        }
    }
}

#[test]
fn every_damaged_file_is_an_error_in_one_line_or_a_remark() {
    for container in BOTH {
        let rows: Vec<_> = (0..50).map(|row| (f64::from(row), 1.0, 2.0)).collect();
        let whole = bytes(container, &RECORD, &record(&rows));
        let check = |bytes: Vec<u8>| match read("r", container, bytes, &Format::default(), None) {
            Ok(_) => (),
            Err(error) => {
                let text = error.downcast_ref::<BadInput>().expect("bad input").0.clone();
                let says_what = text.contains("expected") || text.contains("is not a");
                assert!(!text.contains('\n') && says_what, "{text:?}");
            }
        };
        for length in 0..whole.len() {
            check(whole[..length].to_vec());
        }
        for at in 0..whole.len() {
            for flip in [1, 0x80, 0xff] {
                let mut bytes = whole.clone();
                bytes[at] ^= flip;
                check(bytes);
            }
        }
    }
}

#[test]
fn a_recording_that_was_killed_is_read_as_far_as_it_goes() {
    let mut file = Vec::new();
    let sheet = Sheet { name: "record", source: "a test", columns: &RECORD };
    let mut writer = Writer::new(Container::Mcap, &sheet, &mut file).unwrap();
    for row in record(&[(0.0, 1.0, 2.0), (1.0, 2.0, 3.0), (2.0, 2.0, 3.5)]) {
        writer.row(0, &row).unwrap();
    }
    writer.flush().unwrap();
    writer.row(0, &[Cell::Number(3.0), Cell::Number(2.0), Cell::Number(3.6)]).unwrap();
    // Neither the last chunk nor the end is written.
    std::mem::forget(writer);
    let found = parsed(Container::Mcap, file, &Format::default());
    assert_eq!(found.record.rows.len(), 3);
    assert!(found.remarks[0].starts_with("r: cut off after 3 messages"), "{:?}", found.remarks);
}

#[test]
fn a_recording_cut_in_a_chunk_larger_than_the_rest_of_the_file_keeps_the_chunks_before() {
    let mut file = Vec::new();
    let sheet = Sheet { name: "record", source: "a test", columns: &RECORD };
    let mut writer = Writer::new(Container::Mcap, &sheet, &mut file).unwrap();
    let rows: Vec<_> = (0..5_000).map(|row| (f64::from(row), 0.1, f64::from(row * 7_919 % 5_003) / 7.0)).collect();
    for (number, row) in record(&rows).iter().enumerate() {
        writer.row(number as u64, row).unwrap();
        if number == 2 {
            writer.flush().unwrap();
        }
    }
    writer.finish().unwrap();
    let (mut at, mut chunks) = (mcap::MAGIC.len(), 0);
    let cut = loop {
        let (&[opcode, ref length @ ..], _) =
            file[at..].split_first_chunk::<9>().expect("a third chunk, after those of the schema and of three rows");
        let (length, cut) = (u64::from_le_bytes(*length) as usize, at + 100);
        chunks += usize::from(opcode == op::CHUNK);
        if chunks == 3 {
            assert!(length > cut, "{length} of {cut}");
            break cut;
        }
        at += 9 + length;
    };
    file.truncate(cut);
    let found = parsed(Container::Mcap, file, &Format::default());
    assert_eq!(found.record.rows.len(), 3);
    assert!(found.remarks[0].starts_with("r: cut off after 3 messages"), "{:?}", found.remarks);
}

fn foreign(topics: &[(&str, &str, &[&str])]) -> Vec<u8> {
    let mut writer = mcap::WriteOptions::new().compression(None).create(std::io::Cursor::new(Vec::new())).unwrap();
    for (topic, encoding, messages) in topics {
        let channel = writer.add_channel(0, topic, encoding, &Default::default()).unwrap();
        for (number, message) in messages.iter().enumerate() {
            let time = 1_700_000_000_000_000_000 + 500_000_000 * number as u64;
            let header =
                mcap::records::MessageHeader { channel_id: channel, sequence: 0, log_time: time, publish_time: time };
            writer.write_to_known_channel(&header, message.as_bytes()).unwrap();
        }
    }
    writer.finish().unwrap();
    writer.into_inner().into_inner()
}

#[test]
fn messages_of_others_have_fields_inside_objects_and_times_in_two_parts() {
    let messages = [
        r#"{"stamp": {"sec": 1700000000, "nsec": 5}, "drive": {"u": 1.5}, "tip": {"x": 0.25, "raw": [1, 2]}}"#,
        r#"{"stamp": {"sec": 1700000001, "nsec": 6}, "drive": {"u": 2.5}, "tip": {"x": null, "raw": [1, 2]}}"#,
    ];
    let other: &[&str] = &["\0", "\0"];
    let file = foreign(&[("/spring", "json", &messages), ("/camera", "cdr", other)]);
    let columns = ColumnNames {
        time: Some("stamp".into()),
        voltage: Some("drive.u:kV".into()),
        reading: Some("tip.x:mm".into()),
        ..ColumnNames::default()
    };
    let format = Format { columns, ..Format::default() };
    let found = parsed(Container::Mcap, file.clone(), &format);
    assert_eq!((found.record.rows[1].time_s, found.record.rows[1].voltage_v), (1_700_000_001.000_000_006, 2500.0));
    assert_eq!((found.record.rows[0].measured, found.record.rows[1].measured), (Some(0.25), None));
    let error = message(Container::Mcap, file, &Format::default());
    assert!(error.contains("--time") && error.contains("tip.x"), "{error}");
}

#[test]
fn without_a_time_in_the_messages_they_have_the_time_of_logging() {
    let messages = [r#"{"voltage_v": 1, "stiffness": 2}"#, r#"{"voltage_v": 2, "stiffness": 3}"#];
    let found = parsed(Container::Mcap, foreign(&[("/a", "json", &messages)]), &Format::default());
    assert_eq!(found.record.rows[1].time_s - found.record.rows[0].time_s, 0.5);
    let two = foreign(&[("/a", "json", &messages), ("/b", "json", &messages)]);
    let error = message(Container::Mcap, two.clone(), &Format::default());
    assert_eq!(error, "r: 2 topics have the columns; expected one of --topic /a, --topic /b");
    assert!(read("r", Container::Mcap, two.clone(), &Format::default(), Some("/b")).is_ok());
    let error = read("r", Container::Mcap, two, &Format::default(), Some("/c")).unwrap_err().to_string();
    assert_eq!(error, "r: no topic `/c` with JSON messages; expected one of the file: found /a, /b");
    let error = message(Container::Mcap, foreign(&[("/camera", "cdr", &["\0"])]), &Format::default());
    assert!(error.starts_with("r: no topic with JSON messages, found /camera (cdr); expected"), "{error}");
}

#[test]
fn files_are_recognised_by_their_first_bytes() {
    let folder = tempfile::tempdir().unwrap();
    let path = |name: &str| -> PathBuf { folder.path().join(name) };
    for container in BOTH {
        std::fs::write(path("a.csv"), bytes(container, &RECORD, &record(&[(0.0, 1.0, 2.0), (1.0, 2.0, 3.0)]))).unwrap();
        assert_eq!(open(&path("a.csv"), &Format::default(), None).unwrap().record.rows.len(), 2);
    }
    for name in ["a.mcap", "b.Parquet"] {
        std::fs::write(path(name), "time_s,voltage_v,stiffness\n0,1,2\n1,2,3\n").unwrap();
        let error = open(&path(name), &Format::default(), None).unwrap_err().to_string();
        assert!(error.contains("does not start with") && error.contains("expected"), "{error}");
    }
    std::fs::write(path("a.csv"), "time_s,voltage_v,stiffness\n0,1,2\n1,2,3\n").unwrap();
    assert!(open(&path("a.csv"), &Format::default(), None).is_ok());
    let error = open(&path("a.csv"), &Format::default(), Some("/a")).unwrap_err().to_string();
    assert!(error.contains("--topic applies to MCAP only"), "{error}");
    let separated = Dialect { separator: Some(Separator::COMMA), ..Dialect::default() };
    let points = Dialect { decimal: Some(Decimal::Point), ..Dialect::default() };
    for (option, dialect) in [("--separator", separated), ("--decimal", points)] {
        let format = Format { dialect, ..Format::default() };
        assert!(open(&path("a.csv"), &format, None).is_ok());
        for container in BOTH {
            let error = read("x", container, Vec::new(), &format, None).unwrap_err().to_string();
            let expected = format!("x: {option} applies to CSV only, and this is {}; expected none", container.name());
            assert_eq!(error, expected);
        }
    }
    assert!(open(folder.path(), &Format::default(), None).unwrap_err().to_string().contains("cannot be read"));
}

/// The library would reserve up to 4 GiB for it, which ends the program where there is less.
#[test]
fn a_text_longer_than_its_record_is_damage_and_takes_no_memory() {
    let long = u32::MAX.to_le_bytes().to_vec();
    for (opcode, body) in [
        (op::SCHEMA, [vec![0; 2], long.clone()].concat()),
        (op::CHANNEL, [vec![0; 8], long.clone()].concat()),
        (op::CHANNEL, [vec![0; 12], 4u32.to_le_bytes().to_vec(), long.clone()].concat()),
        (op::CHUNK, [vec![0; 28], long].concat()),
    ] {
        let length = (body.len() as u64).to_le_bytes();
        let error = message(Container::Mcap, [mcap::MAGIC, &[opcode], &length, &body].concat(), &Format::default());
        assert!(error.contains("a text that is longer than its record"), "{opcode}: {error}");
    }
}
