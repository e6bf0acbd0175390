//! Damaged and absurd plant files.

use end_to_end::vsj::text;

use crate::attack::Class;

const BASE: &str = "schema = 1\n[relaxation]\nshare = 0.0909\ntau_s = 5.5\n";

/// Name and content of each file.
fn files() -> Vec<(&'static str, Vec<u8>)> {
    let with = |name, text: &str| (name, format!("{BASE}{text}\n").into_bytes());
    let changed = |name, from: &str, to: &str| (name, BASE.replace(from, to).into_bytes());
    let many = vec!["1.0"; 100_000].join(", ");
    let numbers = |count: usize| (1..=count).map(|number| format!("{number}.0")).collect::<Vec<_>>().join(",");
    vec![
        ("empty", Vec::new()),
        ("schema only", b"schema = 1\n".to_vec()),
        changed("schema 2", "schema = 1", "schema = 2"),
        changed("schema negative", "schema = 1", "schema = -1"),
        changed("schema large", "schema = 1", "schema = 99999999999999999999"),
        changed("schema text", "schema = 1", "schema = \"1\""),
        with("unknown key", "colour = 3"),
        with("unknown table", "[colour]\nx = 1"),
        with("escape", "[unmodelled]\nx = [1, {a = \"\\u001b[2J\"}]"),
        with("escape in a key", "[unmodelled]\n\"\\u001b[31m\\n\" = 1"),
        changed("share NaN", "0.0909", "nan"),
        changed("share infinite", "0.0909", "inf"),
        changed("share negative", "0.0909", "-0.5"),
        changed("share 1", "0.0909", "1.0"),
        changed("share 0", "0.0909", "0.0"),
        changed("share denormal", "0.0909", "5e-324"),
        changed("share huge", "0.0909", "1e308"),
        changed("tau 0", "5.5", "0"),
        changed("tau negative", "5.5", "-1.0"),
        changed("tau denormal", "5.5", "5e-324"),
        changed("tau huge", "5.5", "1e308"),
        changed("tau NaN", "5.5", "nan"),
        changed("tau tiny", "5.5", "1e-4"),
        changed("tau empty", "5.5", "[]"),
        changed("tau many", "5.5", &format!("[{many}]")),
        changed("tau five", "5.5", "[1,2,3,4,5]"),
        changed("tau nested", "5.5", "[[5.5]]"),
        changed("tau date", "5.5", "1979-05-27"),
        changed("tau long", "5.5", &format!("5.{}", "5".repeat(500_000))),
        with("weights long", &format!("weights = [{many}]")),
        changed("weights huge", "5.5", "[1.0,5.5]\nweights = [1e308,-1e308]"),
        changed("weights NaN", "5.5", "[1.0,5.5]\nweights = [nan,nan]"),
        changed("weights denormal", "5.5", "[1.0,5.5]\nweights = [5e-324,0.9091]"),
        with("tau high NaN", "tau_high_s = nan"),
        with("tau high tiny", "tau_high_s = 1e-6"),
        with("plays many", &format!("[memory]\ndirect = 0.8\nthresholds_v = [{0}]\nweights = [{0}]", numbers(2000))),
        with("plays negative", "[memory]\ndirect = -5.0\nthresholds_v = [-10.0]\nweights = [-0.2]"),
        with("plays unsorted", "[memory]\ndirect = 0.8\nthresholds_v = [20.0, 10.0]\nweights = [0.1, 0.1]"),
        with("plays huge", "[memory]\ndirect = 1e308\nthresholds_v = [1e308]\nweights = [1e308]"),
        with("law of one point", "[law]\nvoltage_v = [0]\nstiffness = [0]"),
        with("law empty", "[law]\nvoltage_v = []\nstiffness = []"),
        with("law falling", "[law]\nvoltage_v = [0, 100, 200]\nstiffness = [0, 100, 50]"),
        with("law steep", "[law]\nvoltage_v = [0, 1e-9, 500]\nstiffness = [0, 400, 500]"),
        with("law infinite", "[law]\nvoltage_v = [0, inf]\nstiffness = [0, inf]"),
        with("law long", &format!("[law]\nvoltage_v = [0,{0}]\nstiffness = [0,{0}]", numbers(2000))),
        with("leakage 1", "[leakage]\nshare = 1.0\ntau_s = 40.0"),
        with("leakage NaN", "[leakage]\nshare = nan\ntau_s = nan"),
        with("limit 0", "[amplifier]\nlimit_v = 0.0"),
        with("limit huge", "[amplifier]\nlimit_v = 1e308"),
        with("slew 0", "[amplifier]\nslew_v_per_s = 0.0"),
        with("slew 1", "[amplifier]\nslew_v_per_s = 1.0"),
        with("delay huge", "[amplifier]\ndelay_s = 1e308"),
        with("deep arrays", &format!("[unmodelled]\nx = {}{}", "[".repeat(100_000), "]".repeat(100_000))),
        with("deep tables", &format!("[unmodelled]\nx = {}1{}", "{a = ".repeat(50_000), "}".repeat(50_000))),
        with("deep keys", &format!("[unmodelled{}]", ".a".repeat(50_000))),
        with("dotted keys", &format!("[unmodelled]\na{} = 1", ".a".repeat(50_000))),
        with(
            "many keys",
            &format!("[unmodelled]\n{}", (0..50_000).map(|key| format!("k{key} = 1\n")).collect::<String>()),
        ),
        with("byte order mark", "\u{feff}"),
        with("NUL", "\0"),
        with("unclosed", "x = \""),
        ("latin-1", [BASE.as_bytes(), b"# \xe9\n"].concat()),
        ("garbage", b"}{][==".to_vec()),
        ("bytes", (0..100_000u32).map(|n| (n.wrapping_mul(2_654_435_761) >> 24) as u8).collect()),
    ]
}

/// A short record, since what is hostile is the plant.
fn small_record() -> String {
    let row = |row: u32| format!("{row},{},{}\n", 100 * (row / 15), 9 * (row / 15) + row % 15 * 3);
    format!("time_s,voltage_v,stiffness\n{}", (0..90).map(row).collect::<String>())
}

#[test]
fn damaged_plant_files_are_refused_or_simulated() {
    let mut class = Class::new("plant files");
    let record = class.file("record.csv", small_record());
    let record = record.to_str().expect("UTF-8").to_owned();
    for (number, (name, content)) in files().into_iter().enumerate() {
        let file = class.file(&format!("{number}.toml"), content);
        let file = file.to_str().expect("UTF-8");
        class.add(format!("stair {name}"), ["stair", "--plant", file]);
        class.add(format!("stair fast {name}"), ["stair", "--plant", file, "--controller", "fast", "--input", "step"]);
        class.add(format!("joint {name}"), ["joint", "--plant", file]);
        class.add(format!("diagnose {name}"), ["diagnose", "--effort", "quick", "--plant", file, &record]);
        class.add_ending(format!("link {name}"), ["link", "unix:/nowhere", "model", file], &[2]);
    }
    class.run(|_, _| None);
}

#[test]
fn a_file_without_end_is_read_up_to_a_bound_that_the_error_names() {
    let mut class = Class::new("files without end");
    let large = class.path("large");
    std::fs::File::create(&large).and_then(|file| file.set_len(600 << 20)).expect("holes take no room");
    let record = class.file("record.csv", small_record());
    let record = record.to_str().expect("UTF-8").to_owned();
    for file in ["/dev/zero", large.to_str().expect("UTF-8")] {
        class.add_ending("larger than 1 MiB", ["stair", "--plant", file], &[2]);
        class.add_ending("larger than 1 MiB", ["diagnose", "--plant", file, &record], &[2]);
        class.add_ending("larger than 1 MiB", ["link", "unix:/nowhere", "model", file], &[2]);
        class.add_ending("larger than 64 MiB", ["plan", file], &[2]);
        class.add_ending("larger than 256 MiB", ["log", file, "/dev/null"], &[2]);
        class.add_ending("a byte 0", ["diagnose", file], &[2]);
        class.add_ending("a byte 0", ["identify", file], &[2]);
        class.add_ending("a byte 0", ["stair", "--input", file], &[2]);
        class.add_ending("a byte 0", ["beam", "--experiment", file], &[2]);
        class.add_ending("a byte 0", ["beam", "--layers", file], &[2]);
        class.add_ending("a byte 0", ["diagnose", "x.csv", "--columns", file], &[2]);
    }
    class.run(|bound, output| {
        let said = text(&output.stderr);
        (!said.contains(bound)).then(|| format!("`{bound}` is missing in: {said:.300}"))
    });
}
