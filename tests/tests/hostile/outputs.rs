//! Results that cannot be written, and commands that are ended while they write.

use std::collections::BTreeSet;
use std::ffi::OsString;
use std::fs;
use std::os::unix::fs::{PermissionsExt, symlink};
use std::path::Path;
use std::process::Command;
use std::time::{Duration, Instant};

use crate::attack::{Class, command, limited};

/// Commands with all the files that each of them writes.
const COMMANDS: &[(&[&str], &[&str])] = &[
    (&["stair"], &["stair.csv", "stiffness.svg", "voltage.svg"]),
    (&["dynamics", "zener"], &["response.csv", "response.svg"]),
    (&["joint"], &["joint.json", "joint.txt"]),
    (&["beam"], &["beam.txt", "beam.svg", "experiment.svg", "stack.svg"]),
];

fn names(folder: &Path) -> BTreeSet<String> {
    let entries = fs::read_dir(folder).into_iter().flatten().flatten();
    entries.map(|entry| entry.file_name().to_string_lossy().into_owned()).collect()
}

/// What is wrong with a folder of results: a part of them, or a file that is cut off.
fn complaint(folder: &Path, results: &[&str], success: bool) -> Option<String> {
    let have: BTreeSet<String> = names(folder).into_iter().filter(|name| results.contains(&name.as_str())).collect();
    if (success || !have.is_empty()) && have.len() != results.len() {
        return Some(format!("only {have:?}"));
    }
    have.iter().find_map(|name| {
        let bytes = fs::read(folder.join(name)).unwrap_or_default();
        let whole = match name.rsplit('.').next() {
            Some("svg") => bytes.trim_ascii_end().ends_with(b"</svg>"),
            Some("csv") => bytes.ends_with(b"\n"),
            _ => !bytes.is_empty(),
        };
        (!whole).then(|| format!("{name} is cut off"))
    })
}

#[test]
fn a_folder_that_cannot_be_written_gets_nothing() {
    let mut class = Class::new("folders");
    for (number, (command, results)) in COMMANDS.iter().enumerate() {
        let file = class.file(&format!("file{number}"), "x");
        let (circle, dangling) = (class.path(&format!("loop{number}")), class.path(&format!("dangling{number}")));
        symlink(&circle, &circle).expect("links are possible");
        symlink("/nowhere/at/all", &dangling).expect("links are possible");
        let long = class.path(&"n".repeat(300));
        let mut places = vec![
            file.clone(),
            file.join("y"),
            circle,
            dangling,
            long,
            "/dev/null".into(),
            "/proc/nothing".into(),
            "/sys/nothing".into(),
            "".into(),
        ];
        for result in *results {
            // The place of a result is taken by a folder, or by a device.
            let taken = class.path(&format!("taken{number}{result}"));
            fs::create_dir_all(taken.join(result).join("x")).expect("there is room");
            let linked = class.path(&format!("linked{number}{result}"));
            fs::create_dir(&linked).and_then(|()| symlink("/dev/full", linked.join(result))).expect("there is room");
            places.extend([taken, linked]);
        }
        for place in places {
            let arguments = command.iter().map(OsString::from).chain(["--out".into(), place.clone().into_os_string()]);
            let name = place.to_string_lossy().into_owned();
            class.add_ending(name, arguments.collect::<Vec<_>>(), &[1, 2]);
        }
    }
    class.run(|place, _| {
        let names = names(Path::new(place));
        (names.len() > 1).then(|| format!("{names:?}"))
    });
}

#[test]
fn results_beyond_a_limit_of_file_sizes_are_written_wholly_or_not_at_all() {
    let folder = tempfile::tempdir().expect("there is room");
    for (number, (line, results)) in COMMANDS.iter().enumerate() {
        for blocks in [0, 1, 20, 100_000] {
            let out = folder.path().join(format!("{number}-{blocks}"));
            let line: Vec<OsString> =
                line.iter().map(OsString::from).chain(["--out".into(), out.clone().into()]).collect();
            let limited = command(folder.path(), &line);
            let limit = format!("trap '' XFSZ; ulimit -f {blocks}; exec \"$0\" \"$@\"");
            let mut shell = Command::new("sh");
            shell.arg("-c").arg(limit).arg(limited.get_program()).args(limited.get_args()).current_dir(folder.path());
            let output = shell.output().expect("sh starts");
            assert!(matches!(output.status.code(), Some(0..=2)), "{out:?}: {output:?}");
            assert_eq!(complaint(&out, results, output.status.success()), None, "{out:?}");
            assert!(blocks > 0 || !output.status.success(), "{out:?}");
        }
    }
    assert_eq!(names(folder.path()).iter().filter(|name| name.starts_with(".vsj-")).count(), 0);
}

#[test]
fn a_new_run_replaces_all_results_and_keeps_what_else_is_in_the_folder() {
    let folder = tempfile::tempdir().expect("there is room");
    let out = folder.path().join("out");
    let run = |arguments: &[&str]| {
        let output = limited(folder.path(), &arguments.iter().map(OsString::from).collect::<Vec<_>>());
        assert!(output.status.success(), "{output:?}");
    };
    run(&["joint", "--out", "out"]);
    fs::write(out.join("notes.txt"), "mine").expect("there is room");
    fs::set_permissions(&out, fs::Permissions::from_mode(0o750)).expect("it is ours");
    let before = fs::read(out.join("joint.txt")).expect("it is written");
    // Beside notes, within a link, with folders in it, as the current folder.
    symlink("out", folder.path().join("link")).expect("links are possible");
    run(&["joint", "--springs", "7", "--out", "link"]);
    assert_ne!(fs::read(out.join("joint.txt")).expect("it is written"), before);
    assert!(fs::symlink_metadata(folder.path().join("link")).expect("it is there").is_symlink());
    assert_eq!(fs::metadata(&out).expect("it is there").permissions().mode() & 0o777, 0o750);
    fs::create_dir(out.join("more")).expect("there is room");
    run(&["joint", "--out", "out"]);
    assert_eq!(fs::read(out.join("joint.txt")).expect("it is written"), before);
    let output = limited(&out, &["dynamics", "zener", "--out", "."].map(OsString::from));
    assert!(output.status.success(), "{output:?}");
    let expected = ["joint.json", "joint.txt", "more", "notes.txt", "response.csv", "response.svg"];
    assert_eq!(names(&out), expected.map(str::to_owned).into());
    assert_eq!(fs::read(out.join("notes.txt")).expect("it is kept"), b"mine");
    assert_eq!(names(folder.path()), ["link", "out"].map(str::to_owned).into());
}

#[test]
fn a_signal_at_any_moment_leaves_old_results_or_new_ones_and_no_temporary_file() {
    let folder = tempfile::tempdir().expect("there is room");
    let (line, results) = COMMANDS[0];
    let line = |out: &str| line.iter().copied().chain(["--out", out]).map(OsString::from).collect::<Vec<_>>();
    let old = folder.path().join("old");
    assert!(limited(folder.path(), &line("old")).status.success());
    let mut interrupted = 0;
    for signal in ["INT", "TERM", "HUP", "KILL"] {
        // Anew for each: other tests make the machine faster or slower meanwhile.
        let started = Instant::now();
        assert!(limited(folder.path(), &line("old")).status.success());
        let took = started.elapsed().max(Duration::from_millis(20));
        for part in [0.2, 0.5, 0.8, 0.9, 0.95, 1.0, 1.05] {
            let out = format!("{signal}{part}");
            let path = folder.path().join(&out);
            fs::create_dir(&path).expect("there is room");
            for result in results {
                // Marked, to be distinguished from what the run writes.
                let copy = [&fs::read(old.join(result)).expect("it is written")[..], b"\n"].concat();
                fs::write(path.join(result), copy).expect("there is room");
            }
            let mut child = command(folder.path(), &line(&out)).spawn().expect("sh starts");
            std::thread::sleep(took.mul_f64(part));
            let sent = Command::new("kill").args([&format!("-{signal}"), &child.id().to_string()]).output();
            sent.expect("kill starts");
            let status = child.wait().expect("it ends");
            interrupted += u32::from(!status.success());
            let is_old = |result: &&&str| {
                let bytes = fs::read(path.join(result)).expect("a result is there");
                bytes != fs::read(old.join(result)).expect("it is written")
            };
            let count = results.iter().filter(is_old).count();
            assert!(count == 0 || count == results.len(), "{out}: {count} old files of {}", results.len());
            assert!(count == 0 || !status.success(), "{out}: {status}");
            let is_temporary = |name: &&String| name.starts_with(".vsj-");
            let left = [names(folder.path()), names(&path)].iter().flatten().filter(is_temporary).count();
            assert!(signal == "KILL" || left == 0, "{out}: {left} temporary files");
            if signal == "KILL" {
                for name in names(folder.path()).iter().filter(is_temporary) {
                    fs::remove_dir_all(folder.path().join(name)).expect("it is ours");
                }
            }
        }
    }
    println!("count: 28 runs of vsj with hostile input: signals");
    assert!(interrupted > 4, "{interrupted} of 28 runs were interrupted");
}

#[test]
fn runs_into_one_folder_at_once_leave_one_whole_set_of_results() {
    let folder = tempfile::tempdir().expect("there is room");
    for (number, (line, results)) in COMMANDS.iter().enumerate() {
        let out = format!("out{number}");
        let line: Vec<OsString> = line.iter().copied().chain(["--out", &out]).map(OsString::from).collect();
        let children: Vec<_> = (0..6).map(|_| command(folder.path(), &line).spawn().expect("sh starts")).collect();
        for mut child in children {
            let status = child.wait().expect("it ends");
            assert!(matches!(status.code(), Some(0..=2)), "{out}: {status}");
        }
        assert_eq!(complaint(&folder.path().join(&out), results, true), None, "{out}");
    }
    assert_eq!(names(folder.path()).iter().filter(|name| name.starts_with(".vsj-")).count(), 0);
}
