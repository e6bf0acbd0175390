//! `vsj log`: decoding, what is kept of a damaged log, and exit codes.

use std::fs;
use std::io::{BufRead, BufReader, Read, Write};
use std::process::{Command, Output, Stdio};

use end_to_end::defmt::Firmware;
use end_to_end::defmt::Value::{I32, Str, U8, U16, U32, U64};
use end_to_end::vsj::{golden, vsj};
use host_sim::log::{Decoder, Formats, Item, Line, Summary};
use proptest::prelude::*;
use tempfile::TempDir;

const BOOT: &str = "boot version={=str} git={=str} reset={=str} last_fault={=u8} rate_hz={=u32}";
const STATE: &str = "state {=str} -> {=str}";
const FAULT: &str = "fault code={=u8} name={=str} tick={=u32}";
const LIMIT: &str = "limit bits={=u8} tick={=u32}";
const SUMMARY: &str = "summary tick={=u32} overruns={=u32} worst_lateness_us={=u32} limited_ticks={=u32} state={=str} \
                       target_mv={=i32} applied_mv={=i32} stiffness_mv={=i32}";
const DONE: &str = "done ticks={=u32} missed={=u32} digest={=u64:x} min={=u32} mean={=u32} max={=u32}";
const NOTE: &str = "link says \"{=str}\", {}";
const SAY: &str = "{=str}";
/// Formats of nested arguments: elements without bytes, unlimited nesting, an enum.
const SLICE: &str = "{=[?]}";
const NOTHING: &str = "Nothing";
const NESTING: &str = "Nesting({=?})";
const ENUM: &str = "None|Some({=u8})";

fn firmware(encoding: &'static str) -> Firmware {
    let strings = vec![
        ("prim", SLICE),
        ("derived", NOTHING),
        ("derived", NESTING),
        ("derived", ENUM),
        ("info", BOOT),
        ("info", STATE),
        ("info", SUMMARY),
        ("info", DONE),
        ("info", NOTE),
        ("println", SAY),
        ("warn", LIMIT),
        ("error", FAULT),
    ];
    Firmware { encoding, strings }
}

/// Two starts of the firmware, the second after a fault.
fn frames(encoding: &'static str) -> Vec<Vec<u8>> {
    let fw = firmware(encoding);
    let boot =
        |time, reset, fault| fw.frame(BOOT, time, &[Str("0.1.0"), Str("36094dc"), Str(reset), U8(fault), U32(1000)]);
    let state = |time, from, to| fw.frame(STATE, time, &[Str(from), Str(to)]);
    let limit = |time, bits, tick| fw.frame(LIMIT, time, &[U8(bits), U32(tick)]);
    let summary = |time, counts: [u32; 4], state, applied| {
        let [tick, overruns, lateness, limited] = counts.map(U32);
        fw.frame(SUMMARY, time, &[tick, overruns, lateness, limited, Str(state), I32(250_000), I32(applied), I32(-125)])
    };
    vec![
        boot(1_200, "power-on", 0),
        state(1_450, "safe", "armed"),
        limit(13_001, 5, 12),
        limit(40_001, 0, 39),
        summary(1_000_450, [1000, 0, 17, 27], "armed", 262_500),
        fw.frame(NOTE, 1_500_000, &[Str("a, b\n\x1b[31m"), U16(fw.place(ENUM)), U8(1), U8(42)]),
        fw.frame(SAY, 1_600_000, &[Str("µ")]),
        summary(2_000_450, [2000, 3, 1250, 27], "armed", 250_000),
        fw.frame(FAULT, 2_400_000, &[U8(3), Str("overrun"), U32(2399)]),
        boot(1_210, "software", 3),
        fw.frame(FAULT, 1_900, &[U8(3), Str("overrun"), U32(1)]),
        limit(2_001, 8, 1),
        summary(1_000_450, [1000, 0, 9, 4], "safe", 0),
        fw.frame(DONE, 70_000_450, &[U32(70_000), U32(0), U64(0xbeef_0042), U32(91), U32(96), U32(131)]),
    ]
}

fn log(encoding: &'static str) -> Vec<u8> {
    frames(encoding).concat()
}

fn formats(encoding: &'static str) -> Formats {
    Formats::parse(&firmware(encoding).elf()).expect("the ELF file is one")
}

fn decode(encoding: &'static str, bytes: &[u8]) -> Vec<Item> {
    let mut decoder = Decoder::new(formats(encoding));
    let mut items = decoder.feed(bytes);
    items.extend(decoder.finish());
    items
}

fn lines(items: &[Item]) -> Vec<Line> {
    items.iter().filter_map(|item| if let Item::Line(line) = item { Some(line.clone()) } else { None }).collect()
}

fn summary(items: &[Item]) -> Summary {
    let mut summary = Summary::default();
    items.iter().for_each(|item| summary.add(item));
    summary
}

/// A folder with `fw.elf` and `log.bin`.
fn folder(encoding: &'static str, log: &[u8]) -> TempDir {
    let folder = tempfile::tempdir().expect("there is room");
    fs::write(folder.path().join("fw.elf"), firmware(encoding).elf()).expect("there is room");
    fs::write(folder.path().join("log.bin"), log).expect("there is room");
    folder
}

fn run(folder: &TempDir, arguments: &[&str]) -> Output {
    vsj().current_dir(folder).arg("log").args(arguments).output().expect("vsj starts")
}

fn text(bytes: &[u8]) -> &str {
    std::str::from_utf8(bytes).expect("vsj prints text")
}

/// Exit code; asserts that stderr has one line on failure and none on success.
fn code(output: &Output) -> i32 {
    let code = output.status.code().expect("vsj ends by itself");
    let lines = text(&output.stderr).lines().count();
    assert_eq!(lines, usize::from(code != 0), "stderr: {}", text(&output.stderr));
    code
}

#[test]
fn a_complete_log_is_printed_as_table_csv_and_json() {
    for encoding in ["rzcobs", "raw"] {
        let folder = folder(encoding, &log(encoding));
        for (option, name) in [("", "whole.txt"), ("--csv", "whole.csv"), ("--json", "whole.json")] {
            let options: Vec<&str> = ["fw.elf", "log.bin", option].into_iter().filter(|o| !o.is_empty()).collect();
            let output = run(&folder, &options);
            assert_eq!(code(&output), 0);
            let found = text(&output.stdout).replace("\"encoding\":\"raw\"", "\"encoding\":\"rzcobs\"");
            golden(&format!("log/{name}"), &found);
        }
    }
}

#[test]
fn csv_has_one_row_a_line_and_json_is_one_object() {
    let folder = folder("rzcobs", &log("rzcobs"));
    let csv = run(&folder, &["fw.elf", "log.bin", "--csv"]);
    let rows = text(&csv.stdout).lines().filter(|line| !line.starts_with('#')).count();
    assert_eq!(rows, 1 + frames("rzcobs").len());
    let json = run(&folder, &["fw.elf", "log.bin", "--json"]);
    let json: serde_json::Value = serde_json::from_slice(&json.stdout).expect("JSON");
    assert_eq!(json["lines"].as_array().map(Vec::len), Some(frames("rzcobs").len()));
    assert_eq!(json["summary"]["ticks"], 2399 + 70_000);
    assert_eq!(json["summary"]["done"]["digest"], "00000000beef0042");
}

/// The lines of `summary` have numbers, which are read as a record.
#[test]
fn a_log_is_written_as_mcap_and_parquet_with_the_numbers_of_its_lines() {
    let folder = folder("rzcobs", &frames("rzcobs")[..9].concat());
    let summary = run(&folder, &["fw.elf", "log.bin"]);
    for name in ["log.mcap", "log.parquet"] {
        let output = run(&folder, &["fw.elf", "log.bin", "--out", name]);
        assert_eq!(code(&output), 0);
        let printed = text(&output.stdout);
        assert!(printed.starts_with("summary\n") && printed.ends_with(&format!("wrote {name}\n")), "{printed}");
        assert!(text(&summary.stdout).contains(printed.trim_end_matches(&format!("wrote {name}\n"))));
        let columns = ["--voltage", "applied_v", "--reading", "estimate_v"];
        let read = vsj().current_dir(&folder).args(["identify", name]).args(columns).output().expect("vsj starts");
        let error = text(&read.stderr);
        let expected = format!("vsj: {name}, row 1, column applied_v: `NaN` is not a finite number");
        assert!(read.status.code() == Some(2) && error.starts_with(&expected), "{error}");
    }
    let output = run(&folder, &["fw.elf", "log.bin", "--out", "log.txt"]);
    assert_eq!(code(&output), 2);
    assert!(text(&output.stderr).contains("expected a name that ends in .mcap or .parquet"));
}

#[test]
fn a_log_of_which_no_line_can_be_read_replaces_no_file() {
    let folder = folder("rzcobs", &[0xff, 0x12, 0x34, 0]);
    fs::write(folder.path().join("log.mcap"), "an older one").expect("a file");
    let output = run(&folder, &["fw.elf", "log.bin", "--out", "log.mcap"]);
    assert_eq!(code(&output), 2);
    assert!(!text(&output.stdout).contains("wrote"), "{}", text(&output.stdout));
    assert_eq!(fs::read_to_string(folder.path().join("log.mcap")).expect("the file"), "an older one");
}

#[test]
fn damage_in_the_middle_loses_only_the_damaged_frames() {
    let mut frames = frames("rzcobs");
    frames[3] = vec![0xff, 0x12, 0x34, 0];
    frames[6].remove(2);
    let last = frames.last_mut().expect("there are frames");
    last.truncate(last.len() / 2);
    let folder = folder("rzcobs", &frames.concat());
    for (option, name) in [("", "damaged.txt"), ("--csv", "damaged.csv"), ("--json", "damaged.json")] {
        let options: Vec<&str> = ["fw.elf", "log.bin", option].into_iter().filter(|o| !o.is_empty()).collect();
        let output = run(&folder, &options);
        assert_eq!(code(&output), 1);
        golden(&format!("log/{name}"), text(&output.stdout));
        golden("log/damaged.stderr", text(&output.stderr));
    }
}

#[test]
fn a_raw_log_is_decoded_up_to_the_damage() {
    let mut frames = frames("raw");
    frames[4][1] = 0xff;
    let folder = folder("raw", &frames.concat());
    let output = run(&folder, &["fw.elf", "log.bin"]);
    assert_eq!(code(&output), 1);
    golden("log/damaged_raw.txt", text(&output.stdout));
}

#[test]
fn repeated_frame_delimiters_are_not_frames() {
    // Each start of the firmware sends one first.
    let fw = firmware("rzcobs");
    let mut bytes = vec![0, 0, 0];
    bytes.extend(fw.frame(SAY, 7, &[Str("")]));
    bytes.extend([0, 0]);
    let items = decode("rzcobs", &bytes);
    assert_eq!(items.len(), 1);
    assert_eq!(lines(&items)[0].message, "");
}

#[test]
fn a_log_cut_at_any_byte_keeps_the_lines_before() {
    for encoding in ["rzcobs", "raw"] {
        let frames = frames(encoding);
        let whole = log(encoding);
        let all = lines(&decode(encoding, &whole));
        assert_eq!(all.len(), frames.len());
        for length in 0..=whole.len() {
            let mut end = 0;
            let complete = frames
                .iter()
                .take_while(|frame| {
                    end += frame.len();
                    end <= length
                })
                .count();
            let start: usize = frames[..complete].iter().map(Vec::len).sum();
            let items = decode(encoding, &whole[..length]);
            assert_eq!(lines(&items), all[..complete], "{encoding} cut to {length} bytes");
            let cut_off = Item::CutOff { offset: start as u64, bytes: (length - start) as u64 };
            assert_eq!(items[complete..], if length > start { vec![cut_off] } else { vec![] }, "{encoding} {length}");
        }
    }
}

#[test]
fn a_cut_log_exits_with_1_and_prints_the_lines_before() {
    let whole = log("rzcobs");
    let folder = folder("rzcobs", &whole[..whole.len() - 3]);
    let output = run(&folder, &["fw.elf", "log.bin"]);
    assert_eq!(code(&output), 1);
    assert!(text(&output.stderr).contains("cut off"), "{}", text(&output.stderr));
    assert!(text(&output.stdout).contains("fault code=3"), "{}", text(&output.stdout));
}

#[test]
fn decoding_is_independent_of_the_chunk_size() {
    for encoding in ["rzcobs", "raw"] {
        let mut bytes = log(encoding);
        bytes.truncate(bytes.len() - 2);
        let whole = decode(encoding, &bytes);
        for size in [1, 2, 3, 7, 64] {
            let mut decoder = Decoder::new(formats(encoding));
            let mut items: Vec<Item> = bytes.chunks(size).flat_map(|piece| decoder.feed(piece)).collect();
            items.extend(decoder.finish());
            assert_eq!(items, whole, "{encoding}, pieces of {size}");
        }
    }
}

#[test]
fn one_wrong_byte_loses_at_most_two_lines() {
    let bytes = log("rzcobs");
    let all = lines(&decode("rzcobs", &bytes));
    for place in 0..bytes.len() {
        for wrong in [0x00, 0x01, 0x80, 0xff, bytes[place] ^ 0x10] {
            let mut damaged = bytes.clone();
            damaged[place] = wrong;
            let found = lines(&decode("rzcobs", &damaged));
            let before = all.iter().zip(&found).take_while(|(a, b)| a == b).count();
            let after = all.iter().rev().zip(found.iter().rev()).take_while(|(a, b)| a == b).count();
            assert!(before + after + 2 >= all.len(), "{wrong:#04x} at byte {place}: {before} + {after} lines left");
        }
    }
}

#[test]
fn a_frame_with_an_impossible_length_or_nesting_is_damaged() {
    let fw = firmware("raw");
    let nesting = U16(fw.place(NESTING));
    let slice = U16(fw.place(SLICE));
    let claims = [
        // Four thousand million elements without bytes.
        vec![Str(""), slice, U32(u32::MAX), U16(fw.place(NOTHING))],
        vec![Str(""), slice, U32(1 << 17), U16(fw.place(NOTHING))],
        // Nested deeper than any stack.
        [vec![Str("")], vec![nesting; 30_000]].concat(),
        // No such variant, no such argument, a line as an argument.
        vec![Str(""), U16(fw.place(ENUM)), U8(2)],
        vec![Str(""), U16(999)],
        vec![Str(""), U16(fw.place(SAY) + 1)],
    ];
    for claim in claims {
        let items = decode("raw", &fw.frame(NOTE, 0, &claim));
        assert!(matches!(items[..], [Item::Lost { offset: 0 }, Item::Unread { .. }]), "{items:?}");
    }
    // Longer than any frame: not waited for.
    let mut text = fw.frame(SAY, 0, &[Str("")]);
    let length = text.len();
    text[length - 4..].fill(0xff);
    text.resize(200_000, b'x');
    assert!(matches!(decode("raw", &text)[..], [Item::Lost { offset: 0 }, Item::Unread { bytes: 200_000 }]));
    assert!(!summary(&decode("rzcobs", &vec![0xff; 1 << 20])).is_whole());
}

proptest! {
    #[test]
    fn random_bytes_are_decoded_without_panic(bytes in proptest::collection::vec(any::<u8>(), 1..4000), size in 1..4000usize) {
        for encoding in ["rzcobs", "raw"] {
            let mut decoder = Decoder::new(formats(encoding));
            let mut items: Vec<Item> = bytes.chunks(size).flat_map(|piece| decoder.feed(piece)).collect();
            items.extend(decoder.finish());
            // No byte counts twice: lines and damage together do not exceed the input.
            let Summary { damaged_bytes, cut_off_bytes, lines, .. } = summary(&items);
            prop_assert!(damaged_bytes + cut_off_bytes + lines <= bytes.len() as u64);
        }
    }

    #[test]
    fn random_bytes_between_frames_are_skipped(
        garbage in proptest::collection::vec(any::<u8>(), 0..300), place in 0..15usize,
    ) {
        let mut frames = frames("rzcobs");
        let count = frames.len();
        let place = place.min(count);
        // The delimiter separates it from the next frame.
        frames.insert(place, [garbage, vec![0]].concat());
        let found = lines(&decode("rzcobs", &frames.concat()));
        let all = lines(&decode("rzcobs", &log("rzcobs")));
        prop_assert_eq!(&found[..place], &all[..place]);
        prop_assert_eq!(&found[found.len() - (count - place)..], &all[place..]);
    }

    #[test]
    fn random_arguments_are_decoded_without_panic(bytes in proptest::collection::vec(any::<u8>(), 0..200), string in 1..13u16) {
        for encoding in ["rzcobs", "raw"] {
            let mut frame = string.to_le_bytes().to_vec();
            frame.extend(&bytes);
            if encoding == "rzcobs" {
                frame = rzcobs::encode(&frame);
                frame.push(0);
            }
            decode(encoding, &frame);
        }
    }

    #[test]
    fn an_elf_file_of_random_bytes_is_rejected(bytes in proptest::collection::vec(any::<u8>(), 0..300), keep in 0..2000usize) {
        prop_assert!(Formats::parse(&bytes).is_err());
        let mut elf = firmware("raw").elf();
        elf.truncate(keep);
        elf.extend(&bytes);
        // Part of one may still be one.
        let _ = Formats::parse(&elf);
    }
}

#[test]
fn files_of_another_firmware_are_rejected_in_one_line() {
    let folder = folder("rzcobs", &log("rzcobs"));
    let write = |name: &str, bytes: &[u8]| fs::write(folder.path().join(name), bytes).expect("there is room");
    let other = Firmware { encoding: "rzcobs", strings: vec![("info", "{=bool}")] };
    write("other.elf", &other.elf());
    write("morse.elf", &Firmware { encoding: "morse", strings: Vec::new() }.elf());
    write("text.elf", b"not an ELF file\n");
    write("plain.elf", &plain_elf());
    write("empty.bin", b"");
    write("erased.bin", &[0; 100]);
    for (elf, log, expected) in [
        ("none.elf", "log.bin", "none.elf: cannot be read"),
        (".", "log.bin", "cannot be read"),
        ("text.elf", "log.bin", "text.elf: "),
        ("plain.elf", "log.bin", "plain.elf: has no .defmt section"),
        ("morse.elf", "log.bin", "morse"),
        ("other.elf", "log.bin", "log.bin: none of its frames fits other.elf"),
        ("fw.elf", "none.bin", "none.bin: cannot be read"),
        ("fw.elf", ".", "cannot be read"),
        ("fw.elf", "empty.bin", "empty.bin: empty"),
        ("fw.elf", "erased.bin", "erased.bin: empty"),
    ] {
        let output = run(&folder, &[elf, log]);
        assert_eq!(code(&output), 2, "{elf} {log}");
        assert!(text(&output.stderr).contains(expected), "{elf} {log}: {}", text(&output.stderr));
    }
    assert_eq!(code(&run(&folder, &[])), 2);
    assert_eq!(code(&run(&folder, &["fw.elf", "log.bin", "--csv", "--json"])), 2);
}

/// An ELF file of something that does not log.
fn plain_elf() -> Vec<u8> {
    use object::{Architecture, BinaryFormat, Endianness, write::Object};
    Object::new(BinaryFormat::Elf, Architecture::Arm, Endianness::Little).write().expect("the ELF file is small")
}

#[test]
fn bytes_after_the_last_argument_make_a_frame_damaged() {
    let raw = firmware("raw").frame(LIMIT, 1, &[U8(1), U32(2)]);
    let read = |behind: &[u8]| {
        let mut frame = rzcobs::encode(&[&raw, behind].concat());
        frame.push(0);
        lines(&decode("rzcobs", &frame)).len()
    };
    assert_eq!(read(&[]), 1);
    assert_eq!(read(&[1]), 0);
    assert_eq!(read(&[0, 0, 1]), 0);
    // More zeros than unpacking can leave.
    assert_eq!(read(&[0; 14]), 0);
}

#[test]
fn consecutive_damaged_frames_are_summarised_in_two_lines() {
    let frames = frames("rzcobs");
    let folder = folder("rzcobs", &[&frames[..2], &vec![vec![0xff, 0]; 500], &frames[2..4]].concat().concat());
    let output = run(&folder, &["fw.elf", "log.bin"]);
    assert_eq!(code(&output), 1);
    let found: Vec<&str> = text(&output.stdout).lines().filter(|line| line.contains("damaged:")).collect();
    assert_eq!(found.len(), 2, "{found:?}");
    assert!(found[1].ends_with("damaged: and 499 bytes after it, 499 frames"), "{found:?}");
}

#[test]
fn lines_of_a_live_log_are_printed_immediately() {
    let folder = folder("rzcobs", b"");
    let mut child = vsj()
        .current_dir(&folder)
        .args(["log", "fw.elf", "-"])
        .stdin(Stdio::piped())
        .stdout(Stdio::piped())
        .spawn()
        .expect("vsj starts");
    let mut stdin = child.stdin.take().expect("a pipe");
    let mut stdout = BufReader::new(child.stdout.take().expect("a pipe"));
    let mut line = String::new();
    stdout.read_line(&mut line).expect("the header");
    for (frame, expected) in frames("rzcobs").iter().zip(["boot version", "state safe", "limit bits"]) {
        // Split where a serial line might split it.
        let (first, second) = frame.split_at(frame.len() / 2);
        stdin.write_all(first).expect("vsj reads");
        stdin.write_all(second).expect("vsj reads");
        line.clear();
        stdout.read_line(&mut line).expect("a line");
        assert!(line.contains(expected), "{line}");
    }
    // Ctrl-C reaches the whole pipe; who writes ends first, and the summary still comes.
    if cfg!(unix) {
        let killed = Command::new("kill").args(["-INT", &child.id().to_string()]).status();
        assert!(killed.is_ok_and(|status| status.success()));
        std::thread::sleep(std::time::Duration::from_millis(100));
    }
    drop(stdin);
    let mut rest = String::new();
    stdout.read_to_string(&mut rest).expect("the summary");
    assert!(rest.contains("starts          1: power-on"), "{rest}");
    assert_eq!(child.wait().expect("vsj ends").code(), Some(0));
}

#[test]
fn a_closed_stdout_is_not_a_failure() {
    let folder = folder("rzcobs", &log("rzcobs").repeat(2000));
    let mut child = vsj()
        .current_dir(&folder)
        .args(["log", "fw.elf", "log.bin"])
        .stdout(Stdio::piped())
        .stderr(Stdio::piped())
        .spawn()
        .expect("vsj starts");
    drop(child.stdout.take());
    let output = child.wait_with_output().expect("vsj ends");
    assert_eq!(code(&output), 0);
}

#[test]
fn counts_continue_when_a_boot_line_is_missing() {
    let mut frames = frames("rzcobs");
    // The second start's boot line.
    frames.remove(9);
    let found = summary(&decode("rzcobs", &frames.concat()));
    assert_eq!((found.boots.len(), found.boots_not_seen), (1, 1));
    assert_eq!((found.ticks, found.overruns, found.limited_ticks), (2399 + 70_000, Some(3), Some(31)));
}

#[test]
fn the_time_in_limits_requires_the_tick_rate() {
    let frames = frames("rzcobs");
    let seen = summary(&decode("rzcobs", &frames.concat()));
    assert_eq!(seen.limited_s, Some(0.031));
    let unseen = summary(&decode("rzcobs", &frames[1..9].concat()));
    assert_eq!((unseen.limited_ticks, unseen.limited_s), (Some(27), None));
    let no_summary = summary(&decode("rzcobs", &frames[..4].concat()));
    assert_eq!((no_summary.overruns, no_summary.limited_s), (None, None));
}

#[test]
fn a_fault_that_is_reported_repeatedly_counts_once() {
    let frames = frames("rzcobs");
    let faults = |frames: &[Vec<u8>]| {
        let faults = summary(&decode("rzcobs", &frames.concat())).faults;
        faults.iter().map(|fault| fault.count).sum::<u64>()
    };
    assert_eq!(faults(&frames), 1);
    // The crash swallowed the line before the restart.
    assert_eq!(faults(&[&frames[..8], &frames[9..]].concat()), 1);
    // The log starts with the restart.
    assert_eq!(faults(&frames[9..]), 1);
    // It happens again.
    let again = [&frames[..], &frames[8..]].concat();
    assert_eq!(faults(&again), 2);
}
