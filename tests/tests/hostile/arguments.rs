//! Absurd command lines.

use std::ffi::OsStr;
use std::os::unix::ffi::OsStrExt;

use end_to_end::vsj::{text, vsj};

use crate::attack::Class;

#[test]
fn absurd_command_lines_are_refused_in_one_line() {
    let mut class = Class::new("command lines");
    let long = "a".repeat(100_000);
    let pets = "PET,".repeat(3000);
    for line in [
        &["nonsense"][..],
        &[""],
        &["\x1b[31m"],
        &["stair", "x"],
        &["stair", "--nonsense"],
        &["stair", "--kp"],
        &["stair", "--kp", "1", "--kp", "2"],
        &["stair", &long],
        &["stair", "--json", "--json"],
        &["stair", "--column", "x"],
        &["log"],
        &["link"],
        &["link", "x"],
        &["diagnose"],
        &["beam", "--stack", ""],
        &["beam", "--stack", ",,,"],
        &["beam", "--stack", &pets],
        &["beam", "--stack", "x\x1b[31m"],
        &["link", "unix:/nowhere", "acknowledge", &long],
        &["link", "unix:/nowhere", "acknowledge", "0"],
        &["link", "unix:/nowhere", "acknowledge", "256"],
        &["link", "unix:/nowhere", "set", "nan"],
        &["link", "unix:/nowhere", "set", "-inf"],
        &["link", "tcp:", "status"],
        &["link", "tcp:x", "status"],
        &["link", "tcp::::::", "status"],
        &["link", "tcp:127.0.0.1:99999", "status"],
        &["link", "tcp:256.256.256.256:1", "status"],
        &["link", "unix:", "status"],
        &["link", "unix:/tmp", "status"],
        &["link", "/dev/null", "status"],
        &["link", "/etc/passwd", "status"],
    ] {
        let name: String = line.join(" ").chars().take(60).collect();
        class.add_ending(name, line, &[2]);
    }
    for bytes in [&b"\xff\xfe"[..], b"unix:\xff", b"/tmp/\xff\xfe.toml"] {
        let argument = OsStr::from_bytes(bytes);
        class.add_ending("a path that is not UTF-8", [OsStr::new("diagnose"), argument], &[2]);
        class.add_ending("a name that is not UTF-8", [OsStr::new("stair"), OsStr::new("--plant"), argument], &[2]);
        class.add_ending("a port that is not UTF-8", [OsStr::new("link"), argument, OsStr::new("status")], &[2]);
        class.add_ending("two names that are not UTF-8", [OsStr::new("log"), argument, argument], &[2]);
    }
    class.run(|_, _| None);
}

#[test]
fn every_list_has_a_bound_that_its_error_names() {
    let mut class = Class::new("lists");
    let list = |count: usize| vec!["1"; count].join(",");
    let columns: String = (0..101).map(|volts| format!(",force_un_{volts}v")).collect();
    let readings = |columns: &str| {
        let row = |mm: usize| format!("{mm}{}\n", ",300".repeat(columns.matches(',').count()));
        format!("displacement_mm{columns}\n{}{}", row(1), row(2))
    };
    let wide = class.file("wide.csv", readings(&columns));
    class.add_ending("expected at most 16", ["compare", "--limit-v", &list(17)], &[2]);
    class.add_ending("expected at most 1000", ["beam", "--at-mm", &list(1001)], &[2]);
    class.add_ending("expected at most 100", ["beam", "--experiment", wide.to_str().expect("UTF-8")], &[2]);
    class.run(|bound, output| {
        let said = text(&output.stderr);
        (!said.contains(bound)).then(|| format!("`{bound}` is missing in: {said:.300}"))
    });
}

/// The bounds of the table in `docs/hostile-input.md`.
#[test]
fn every_bound_is_in_the_help_of_its_command() {
    for (command, bounds) in [
        (&["diagnose"][..], &["of at most 1 000 000 rows and 512 MiB", "A plant file has at most 1 MiB"][..]),
        (&["identify"], &["of at most 1 000 000 rows and 512 MiB"]),
        (&["isolate"], &["1 000 000 rows and 512 MiB", "a plant file of at most 1 MiB", "at most 16 MiB"]),
        (&["stair"], &["1 000 000 rows and 512 MiB", "a plant file of at most 1 MiB"]),
        (&["adapt"], &["a plant file of at most 1 MiB", "at most 16 MiB"]),
        (&["bound"], &["a plant file of at most 1 MiB", "at most 16 MiB"]),
        (&["tune"], &["a plant file of at most 1 MiB", "at most 16 MiB"]),
        (&["compare"], &["a plant file of at most 1 MiB", "in V; at most 16"]),
        (&["export", "model"], &["a plant file of at most 1 MiB"]),
        (&["plan"], &["at most 64 MiB"]),
        (&["log"], &["at most 256 MiB", "at most 1 000 000 lines"]),
        (&["beam"], &["at most 100 voltages and 100 000 readings", "at most 1000", "at most 20"]),
        (&["link"], &["How long to wait for the port to open, and for an answer"]),
        (&["link", "PORT", "record"], &["1 000 000 rows and 512 MiB", "at most 1e9 s"]),
    ] {
        let help = text(&vsj().args(command).arg("--help").output().expect("vsj starts").stdout);
        let help = help.split_whitespace().collect::<Vec<_>>().join(" ");
        for bound in bounds {
            assert!(help.contains(bound), "{command:?}: `{bound}` is missing in {help}");
        }
    }
}
