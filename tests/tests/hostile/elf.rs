//! Damaged logs, and images of the firmware with absurd format strings.

use end_to_end::defmt::{Firmware, Value};
use end_to_end::vsj::text;
use random_numbers::Xorshift32;

use crate::attack::Class;

const STRINGS: &[(&str, &str)] = &[
    ("info", "boot version={=str} git={=str} reset={=str} last_fault={=u8} rate_hz={=u32}"),
    ("info", "state {=str} -> {=str}"),
    ("error", "fault code={=u8} name={=str} tick={=u32}"),
    ("info", "x {=[u8]}"),
    ("info", "y {=?}"),
    ("info", "plain"),
];

/// Format strings that no firmware has.
const ABSURD: &[&str] = &[
    "{=[u8;4294967295]}",
    "{=[?;4294967295]}",
    "{",
    "}",
    "{{",
    "{=}",
    "{=u128}",
    "{=u8:4294967295}",
    "{=u64:999999999}",
    "{=u64:0999999999}",
    "{=u8:0999999999x}",
    "{=[u8]:060000x}",
    "{999999999=u8}",
    "{18446744073709551616=u8}",
    "{=0..0}",
    "{=63..200}",
    "{0=0..8}{0=8..128}",
    "{=str:\0}",
    "{=u64:us}{=u64:ms}",
    "{=u64:iso8601s}",
    "{=u64:iso8601ms}",
    "{=u64:tds}",
    "{=f32}{=f64}{=bool}{=char}",
    "{=istr}",
    "{=__internal_Display}{=__internal_FormatSequence}",
    "{=[u8]:a}{=[u8]:?}{=[u8]:02x}",
    "{:#010x}",
    "{=char}",
    "None|Some({=?})",
    "{=u8:\u{e9}}",
    "{=[[u8;2];2]}",
    "{=[u8;0]}",
    "{=[[?;65535];65535]}",
    "{=[u8]:cbor}",
    "{=?:iso8601s}",
];

fn firmware(encoding: &'static str) -> Firmware {
    Firmware { encoding, strings: STRINGS.to_vec() }
}

/// A log of a few lines, often enough to be longer than one read.
fn log(firmware: &Firmware) -> Vec<u8> {
    let boot = [Value::Str("0.1.0"), Value::Str("abc"), Value::Str("power-on"), Value::U8(0), Value::U32(1000)];
    let frames = [
        firmware.frame(STRINGS[0].1, 1000, &boot),
        firmware.frame(STRINGS[1].1, 2000, &[Value::Str("disarmed"), Value::Str("armed")]),
        firmware.frame(STRINGS[2].1, 3000, &[Value::U8(3), Value::Str("\x1b[31m\n"), Value::U32(7)]),
        firmware.frame(STRINGS[5].1, u64::MAX, &[]),
    ];
    frames.concat().repeat(100)
}

/// Bytes without order, the same in each run.
fn noise(seed: u32, length: usize) -> Vec<u8> {
    let mut numbers = Xorshift32::new(seed.wrapping_mul(2_654_435_761) | 1);
    (0..length).map(|_| numbers.draw() as u8).collect()
}

/// A copy with bytes changed here and there.
fn damaged(bytes: &[u8], seed: u32) -> Vec<u8> {
    let mut bytes = bytes.to_vec();
    let at = noise(seed, 3 * 16);
    for three in at.chunks(3).take(1 << (seed % 5)) {
        let place = usize::from(three[0]) << 8 | usize::from(three[1]);
        let length = bytes.len();
        bytes[place % length] = [0, 255, 127, three[2]][usize::from(three[2]) % 4];
    }
    bytes
}

fn cases(encoding: &'static str) {
    let mut class = Class::new(encoding);
    let firmware = firmware(encoding);
    let (image, log) = (firmware.elf(), log(&firmware));
    let path = |path: std::path::PathBuf| path.to_str().expect("UTF-8").to_owned();
    let elf = path(class.file("fw.elf", &image));
    let whole = path(class.file("whole.bin", &log));
    for option in ["--csv", "--json"] {
        class.add_ending(format!("whole {option}"), ["log", &elf, &whole, option], &[0]);
    }
    for length in (0..150).step_by(7) {
        let cut = path(class.file(&format!("cut{length}.bin"), &log[..length]));
        class.add(format!("cut at {length}"), ["log", &elf, &cut]);
    }
    for seed in 0..40 {
        let flipped = path(class.file(&format!("flip{seed}.bin"), damaged(&log[..400], seed)));
        class.add(format!("damaged log {seed}"), ["log", &elf, &flipped, "--json"]);
        let flipped = path(class.file(&format!("flip{seed}.elf"), damaged(&image, seed)));
        class.add(format!("damaged image {seed}"), ["log", &flipped, &whole]);
    }
    for length in (0..image.len()).step_by(211) {
        let cut = path(class.file(&format!("cut{length}.elf"), &image[..length]));
        class.add(format!("image cut at {length}"), ["log", &cut, &whole]);
    }
    for (name, bytes) in [
        ("noise", noise(1, 2_000_000)),
        ("zeros", vec![0; 2_000_000]),
        ("ones", vec![0xff; 2_000_000]),
        ("many lines", firmware.frame(STRINGS[5].1, 1, &[]).repeat(100_000)),
        ("a string of 4 GiB", firmware.frame(STRINGS[3].1, 1, &[Value::U32(u32::MAX), Value::U64(0)])),
    ] {
        let file = path(class.file(name, bytes));
        class.add(name, ["log", &elf, &file]);
        class.add(format!("{name} --json"), ["log", &elf, &file, "--json"]);
    }
    for (number, absurd) in ABSURD.iter().enumerate() {
        for (place, strings, timestamp) in [
            ("line", vec![("info", *absurd), ("derived", absurd)], "{=u64:us}"),
            ("stamp", vec![("info", "x")], absurd),
        ] {
            let firmware = Firmware { encoding, strings };
            let image = path(class.file(&format!("{number}{place}.elf"), firmware.elf_stamped(timestamp)));
            let first = firmware.strings[0].1;
            let values: Vec<Value<'_>> = [1, 1 << 60].into_iter().cycle().take(400).map(Value::U64).collect();
            let late = firmware.frame(first, u64::MAX, &values);
            let log = path(class.file(&format!("{number}{place}.bin"), late));
            class.add(format!("{place} {absurd}"), ["log", &image, &log]);
        }
    }
    for file in ["/dev/null", "/", "/nowhere", "", "/bin/sh"] {
        class.add_ending(format!("image {file}"), ["log", file, &whole], &[2]);
        class.add(format!("log {file}"), ["log", &elf, file]);
    }
    class.run(|_, _| None);
}

#[test]
fn damaged_raw_logs_are_read_as_far_as_possible() {
    cases("raw");
}

#[test]
fn damaged_packed_logs_are_read_as_far_as_possible() {
    cases("rzcobs");
}

#[test]
fn a_log_of_many_lines_is_printed_as_a_table_but_not_kept_for_json() {
    let mut class = Class::new("long logs");
    let firmware = firmware("rzcobs");
    let elf = class.file("fw.elf", firmware.elf());
    let log = class.file("log.bin", firmware.frame(STRINGS[5].1, 1, &[]).repeat(1_000_001));
    let (elf, log) = (elf.to_str().expect("UTF-8"), log.to_str().expect("UTF-8"));
    class.add_ending("more than 1000000 lines; expected at most that with --json", ["log", elf, log, "--json"], &[2]);
    class.add_ending("", ["log", elf, log, "--csv"], &[0]);
    class.run(|expected, output| {
        let said = text(&output.stderr);
        (!said.contains(expected)).then(|| format!("`{expected}` is missing in: {said:.300}"))
    });
}

#[test]
fn a_format_string_with_a_number_beyond_any_frame_is_refused_by_name() {
    let mut class = Class::new("format strings");
    for (number, (string, expected)) in [
        ("{999999999=u8}", "the number 999999999; expected at most 65536"),
        ("{=u8:0999999999x}", "the number 0999999999; expected at most 65536"),
        ("{=u8:0300x}", "the width 300; expected at most 256"),
        ("{=[u8;4294967295]}", "the number 4294967295; expected at most 65536"),
    ]
    .into_iter()
    .enumerate()
    {
        let firmware = Firmware { encoding: "raw", strings: vec![("info", string)] };
        let image = class.file(&format!("{number}.elf"), firmware.elf());
        class.add_ending(expected, ["log", image.to_str().expect("UTF-8"), "/dev/null"], &[2]);
    }
    // Outside a parameter a number is text.
    let firmware = Firmware { encoding: "raw", strings: vec![("info", "1000000 {{=u8:0999999999x}}")] };
    let image = class.file("text.elf", firmware.elf());
    class.add_ending("empty; expected the log", ["log", image.to_str().expect("UTF-8"), "/dev/null"], &[2]);
    class.run(|expected, output| {
        let said = text(&output.stderr);
        (!said.contains(expected)).then(|| format!("`{expected}` is missing in: {said:.300}"))
    });
}
