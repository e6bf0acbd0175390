//! `docs/promises.md`: everything that it names exists, and its tables are those of the code.

use std::fmt::Write;
use std::fs;
use std::path::{Path, PathBuf};

use firmware::LONGEST_HANG_MS;
use firmware::settings::{LONGEST_STALL_MS, SUPERVISION, WATCHDOG_MS};
use link::{Field, Reason};
use model::device::LONGEST_ROUND_MS;
use model::supervisor::{Command, Fault, Faults, Inputs, Monitors, State, Supervisor};
use model::units::SampleTime;
use model::{Config, Input, Settings, Volts};
use test_bench::script::FaultInjection;

const PAGE: &str = "docs/promises.md";
/// Commands of `cargo xtask` that count as evidence, and where each is.
const COMMANDS: [(&str, &str); 5] = [
    ("proof", "emulation/src/proof.rs"),
    ("prove", "xtask/src/prove.rs"),
    ("talk", "emulation/src/talk"),
    ("story", "emulation/src/story/isolation.rs"),
    ("size", "emulation/src/binary/size.rs"),
];

fn root() -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("..").canonicalize().unwrap()
}

fn read(path: &str) -> String {
    fs::read_to_string(root().join(path)).unwrap_or_else(|error| panic!("{path}: {error}"))
}

/// The rows of every table whose header's second column is `header`, as pairs of cells.
fn rows(page: &str, header: &str) -> Vec<(String, String)> {
    let mut rows = Vec::new();
    let mut inside = false;
    for line in page.lines() {
        let Some(cells) = line.strip_prefix("| ").and_then(|line| line.strip_suffix(" |")) else {
            inside = false;
            continue;
        };
        let Some((left, right)) = cells.split_once(" | ") else { continue };
        if right == header {
            inside = true;
        } else if inside && !right.starts_with("---") {
            rows.push((left.to_owned(), right.to_owned()));
        }
    }
    rows
}

/// Whether `source` has a test of this name that runs: a function whose attributes, above or below its documentation, contain `#[test]` and
/// not `#[ignore]`.
fn has_test(source: &str, name: &str) -> bool {
    let lines: Vec<&str> = source.lines().map(str::trim_start).collect();
    let start = format!("fn {name}(");
    let at = lines.iter().position(|line| line.starts_with(&start));
    at.is_some_and(|at| {
        let above = lines[..at].iter().rev();
        let above: Vec<_> = above.take_while(|line| line.starts_with("#[") || line.starts_with("//")).collect();
        above.iter().any(|line| **line == "#[test]") && !above.iter().any(|line| line.starts_with("#[ignore"))
    })
}

/// What is wrong with one piece of evidence: `file::test`, ``drill `name` ``, ``boot `name` `` or a command.
fn fault_of(evidence: &str) -> Option<String> {
    if let Some(name) = evidence.strip_prefix("drill ") {
        let name = name.trim_matches('`');
        let known = FaultInjection::ALL.into_iter().any(|drill| drill.name() == name);
        let approved = root().join("test-bench/drills").join(name).with_extension("log").exists();
        return (!known || !approved).then(|| format!("no drill {name}"));
    }
    if let Some(name) = evidence.strip_prefix("boot ") {
        let name = name.trim_matches('`');
        let played = read("emulation/models/boot.py").contains(&format!("\"{name}\": lambda: play("));
        let checked = read("emulation/src/boot/checks.rs").contains(&format!("\"{name}\""));
        return (!played || !checked).then(|| format!("no boot run {name}"));
    }
    if let Some((_, file)) = COMMANDS.into_iter().find(|(name, _)| *name == evidence) {
        return (!root().join(file).exists()).then(|| format!("no command {evidence}"));
    }
    let Some((file, name)) = evidence.trim_matches('`').split_once("::") else {
        return Some(format!("{evidence} is no evidence"));
    };
    let source = fs::read_to_string(root().join(file));
    (!source.is_ok_and(|source| has_test(&source, name))).then(|| format!("no test {name} in {file}"))
}

#[test]
fn every_promise_names_evidence_that_exists() {
    let promises = rows(&read(PAGE), "breaks");
    let mut evidence = 0;
    let mut wrong = Vec::new();
    for (promise, breaks) in &promises {
        for one in breaks.split([',', ';']).map(str::trim) {
            evidence += 1;
            wrong.extend(fault_of(one).map(|why| format!("{promise}: {why}")));
        }
    }
    assert!(wrong.is_empty(), "{}", wrong.join("\n"));
    assert!(promises.len() >= 30 && evidence >= 50, "{} promises, {evidence} pieces of evidence", promises.len());
    println!("{} promises, {evidence} pieces of evidence", promises.len());
}

#[test]
fn every_drill_and_every_boot_run_breaks_a_promise() {
    let page = read(PAGE);
    for drill in FaultInjection::ALL {
        let name = drill.name();
        assert!(page.contains(&format!("drill `{name}`")), "drill {name}");
    }
    let boot = read("emulation/models/boot.py");
    let runs = boot.lines().filter_map(|line| line.trim_start().strip_prefix('"')?.split_once("\": lambda: play("));
    for (name, _) in runs {
        assert!(page.contains(&format!("boot `{name}`")), "boot run {name}");
    }
}

#[test]
fn evidence_that_does_not_exist_is_found() {
    for missing in ["drill `earthquake`", "boot `earthquake`", "earthquake", "`link/tests/session.rs::earthquake`"] {
        assert!(fault_of(missing).is_some(), "{missing}");
    }
    assert!(fault_of("`tests/tests/promises.rs::has_test`").is_some(), "a function that is no test");
    assert_eq!(fault_of("`tests/tests/promises.rs::evidence_that_does_not_exist_is_found`"), None);
}

#[test]
fn the_tables_are_those_of_the_code() {
    let mut page = read(PAGE);
    for (name, table) in [("faults", fault_table()), ("refusals", refusal_table())] {
        let (begin, end) = (format!("<!-- {name}: begin -->\n"), format!("<!-- {name}: end -->"));
        let from = page.find(&begin).unwrap() + begin.len();
        let to = page.find(&end).unwrap();
        page.replace_range(from..to, &table);
    }
    if std::env::var_os("GOLDEN").is_some_and(|golden| golden == "write") {
        return fs::write(root().join(PAGE), page).unwrap();
    }
    assert!(page == read(PAGE), "{PAGE} differs from the code; GOLDEN=write cargo test -p end-to-end --test promises");
}

/// The states of the fault table.
const STATES: [&str; 4] = ["disarmed", "armed", "host silent", "another fault"];

fn fault_table() -> String {
    let mut table = format!("| code | fault | detected by | within | {} | remedy | drill |\n", STATES.join(" | "));
    table += &format!("{}|\n", "| --- ".repeat(6 + STATES.len() + 1));
    for fault in Fault::ALL {
        let reactions = STATES.map(|state| reaction(fault, state)).join(" | ");
        let (code, name, detection) = (fault.code(), fault.name(), fault.detection());
        let (remedy, drill) = (fault.remedy(), drill(fault));
        let _ =
            writeln!(table, "| {code} | {name} | {detection} | {} | {reactions} | {remedy} | {drill} |", within(fault));
    }
    table
}

/// The longest time from the cause to zero volts.
fn within(fault: Fault) -> String {
    let ms = |seconds: f64| (seconds * 1000.0).round() + 1.0;
    let (driven, off) = (ms(SUPERVISION.monitor_time_s), ms(SUPERVISION.discharge_time_s));
    let after = SUPERVISION.missed_ticks_allowed;
    match fault {
        Fault::Panic | Fault::HardFault => "5 us".into(),
        Fault::Overrun => format!("the tick after missed tick {}", after + 1),
        Fault::Interlock => "1 ms".into(),
        Fault::Watchdog => format!(
            "control task {LONGEST_HANG_MS} ms, any other {} ms, interrupts off {WATCHDOG_MS} ms",
            // The round in which the task has still checked in, and two ticks.
            LONGEST_STALL_MS + LONGEST_ROUND_MS + 2
        ),
        Fault::Monitor => format!("{driven} ms, {off} ms while the output is off"),
        Fault::Config => "nothing was enabled".into(),
        Fault::Supply => "immediately, by the reset".into(),
        Fault::SelfTest => "nothing was enabled".into(),
        Fault::Isolation => "the tick after the cause is named".into(),
    }
}

/// What runs the fault on an image.
fn drill(fault: Fault) -> &'static str {
    match fault {
        Fault::Panic => "drill `panic`, boot `panic`",
        Fault::HardFault => "drill `hard-fault`, drill `stack-overflow`, boot `two wrong bits`",
        Fault::Overrun => "drill `overrun`, boot `overrun`",
        Fault::Interlock => "drill `interlock`, boot `interlock`",
        Fault::Watchdog => {
            "drill `hang`, drill `deaf`, drill `stall`, boot `hang`, boot `deaf`, boot `stalled tasks`, boot `stopped timer`, boot `halted`"
        }
        Fault::Monitor => {
            "boot `too low`, boot `slow amplifier`, boot `no voltage`, \
             boot `short circuit`, boot `current`, boot `supply of 3.6 V`"
        }
        Fault::Config => "drill `unguarded`, boot `unguarded`, boot `damaged settings`",
        Fault::Supply => "boot `dip`, boot `button while armed`",
        Fault::SelfTest => "boot `stuck bit`, boot `coupled bits`, boot `slow processor`",
        Fault::Isolation => {
            "`tests/tests/firmware_isolation.rs::a_cause_of_trip_on_cause_is_a_fault_until_it_is_acknowledged_and_another_cause_is_not`"
        }
    }
}

#[test]
fn the_drills_of_the_fault_table_exist() {
    for evidence in Fault::ALL.into_iter().flat_map(|fault| drill(fault).split(", ")) {
        assert_eq!(fault_of(evidence), None);
    }
}

/// What a supervisor does when the cause of `fault` comes in `state` and lasts for two seconds.
fn reaction(fault: Fault, state: &str) -> &'static str {
    let config: Config = Settings::PAPER.validate().unwrap().quantize();
    let sample_time = SampleTime::from_rate(1000.0).unwrap();
    let mut supervisor = Supervisor::new(SUPERVISION.validate(sample_time).unwrap().quantize(), None);
    let mut spring = model::State::default();
    let target = Volts::new(600.0).unwrap();
    let mut tick = |supervisor: &mut Supervisor, inputs: &Inputs| {
        supervisor.decide(inputs);
        let output = config.tick(&mut spring, Input { target, measured: None });
        let drive = supervisor.release(&output);
        assert!(supervisor.state() == State::Armed || !drive.enabled());
    };
    let good = Inputs { ticks_since_host: 0, interlock_closed: true, target, ..Inputs::default() };
    let mut inputs = good;
    match state {
        "disarmed" => {}
        "armed" => tick(&mut supervisor, &Inputs { command: Some(Command::Arm), ..good }),
        "host silent" => {
            tick(&mut supervisor, &Inputs { command: Some(Command::Arm), ..good });
            inputs.ticks_since_host = u32::MAX;
            tick(&mut supervisor, &inputs);
            assert!(supervisor.ramping());
        }
        _ => supervisor.fail(if fault == Fault::Panic { Fault::HardFault } else { Fault::Panic }),
    }
    let before = supervisor.state();
    match fault {
        Fault::Interlock => inputs.interlock_closed = false,
        Fault::Overrun => inputs.missed_ticks = SUPERVISION.missed_ticks_allowed + 1,
        Fault::Monitor => {
            let voltage = Volts::new(900.0).unwrap();
            inputs.monitors = Some(Monitors { voltage, current_ua: 0, supply_mv: None });
        }
        _ => inputs.faults = Faults::NONE.with(fault),
    }
    for _ in 0..2000 {
        tick(&mut supervisor, &inputs);
    }
    let stands = supervisor.standing().contains(fault);
    match (before, supervisor.state(), stands) {
        (State::Faulted(_), _, true) => "stands as well",
        (_, State::Faulted(shown), true) if shown == fault => "faulted",
        (_, State::Disarmed | State::Faulted(_), false) => "no fault",
        (before, after, _) => panic!("{fault:?}: {before:?}, {after:?}"),
    }
}

fn refusal_table() -> String {
    let fault = link::Fault::from(Fault::Interlock);
    let reasons = [
        Reason::OutOfRange { lowest: 0.0, highest: 700.0 },
        Reason::NotArmed,
        Reason::Faulted(fault),
        Reason::BadVersion(link::VERSION + 1),
        Reason::HelloFirst,
        Reason::Stale { newest: 7 },
        Reason::SequenceReused,
        Reason::UnknownRequest,
        Reason::InterlockOpen,
        Reason::OtherFault(fault),
        Reason::HostSilent,
        Reason::Armed,
        Reason::PartMissing(2),
        Reason::Damaged,
        Reason::BadModel { field: Field::named("leakage.share"), lowest: 0.0, highest: 1.0 },
        Reason::NotStored,
        Reason::Live,
        Reason::CausePresent(fault),
        Reason::OtherSession,
        Reason::Reference,
        Reason::BadSettings { field: Field::named("hang_ms"), lowest: 7.0, highest: 99.0 },
        Reason::NotBuiltIn(Field::named("controller")),
        Reason::TooManyRows { most: 14_342 },
    ];
    let mut table = "| code | text |\n| --- | --- |\n".to_owned();
    for (code, reason) in (0..).zip(reasons) {
        assert_eq!(reason.code(), code, "a code is missing");
        let _ = writeln!(table, "| {code} | {reason} |");
    }
    // The wire knows no further code.
    assert!(link_reply(&[1, 1, 0, 0, 0, 0]).is_some());
    let beyond = [1, reasons.len() as u8, 0, 0, 0, 0];
    assert!(link_reply(&beyond).is_none(), "a reason is missing in the table");
    table
}

/// A reply with this message, if it is one.
fn link_reply(message: &[u8]) -> Option<link::Reply> {
    let mut packet = vec![link::VERSION, b'A', 0, 0];
    packet.extend_from_slice(message);
    packet.extend(link::frame::checksum(&packet).to_le_bytes());
    let mut frame = vec![0];
    for block in packet.split(|byte| *byte == 0) {
        frame.push(block.len() as u8 + 1);
        frame.extend_from_slice(block);
    }
    frame.push(0);
    let mut receiver = link::Receiver::new();
    frame.into_iter().find_map(|byte| receiver.on_byte(byte).map(|packet| packet.read().ok())).flatten()
}
